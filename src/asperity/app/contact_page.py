"""Page of a contact: inputs and results, redrawn whenever the session changes."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from bokeh.models import Column, UIElement

from asperity.app import export
from asperity.app.contact_jobs import (
    JobFailure,
    MachineDrawer,
    ReportWriter,
    make_report,
    open_surface,
)
from asperity.app.contact_result import ContactResult, spectrum_title
from asperity.app.contact_tools import PictureButton, Sound, link_button
from asperity.app.figures import SPECTRUM_HEIGHT, TRIALS_HEIGHT, SpectrumFigure, TrialFigures
from asperity.app.jobs import JobQueue, VisitPool
from asperity.app.machine_drawing import MachineDrawing
from asperity.app.map_images import MapImages, placeholder
from asperity.app.presets import TITLES, preset_case
from asperity.app.session import ContactSession
from asperity.app.settings import Settings, preset_key, surface_key
from asperity.app.speed_curve import SpeedCurve
from asperity.app.surface_store import SurfaceStore
from asperity.app.uploads import FileDrop
from asperity.app.widgets import (
    CHIP,
    CHOSEN,
    DROP,
    FADE,
    HEADLINE,
    INHERIT,
    LOOK,
    MAP_KEY,
    TILE_STYLES,
    Download,
    HeadlineStrip,
    InputWidget,
    Layout,
    PageBlock,
    StaleMark,
    button,
    button_row,
    headline,
    notes,
    sentences,
    text_block,
    tiles,
)
from asperity.case import Case, MachineCase

LINK_NOTE = "The link to this page remains valid while the server runs."
SURFACE_LIMIT = 300_000_000  # bytes of a measured surface


class ReportTools(NamedTuple):
    """Functions of `asperity.report` that the page calls, passed in by the command line.

    `write_report` writes the report of a run, `draw_machine` draws a machine to scale.
    """

    write_report: ReportWriter
    draw_machine: MachineDrawer


class ContactView:
    """Contact of one visitor with its widgets.

    Parameters
    ----------
    settings : the opened case
    worker_pool : runs the jobs
    deliver : calls a function under the document's lock
    set_address : sets the query of the browser's address
    tools : report of a run and drawing of a machine
    surfaces : stores dropped surfaces
    """

    def __init__(
        self,
        settings: Settings,
        worker_pool: VisitPool,
        deliver: Callable[[Callable[[], None]], None],
        set_address: Callable[[str], None],
        tools: ReportTools,
        surfaces: SurfaceStore,
    ) -> None:
        self._surfaces = surfaces
        self._set_address, self._tools = set_address, tools
        self._worker_pool, self._deliver = worker_pool, deliver
        coarse, full = (JobQueue(worker_pool, deliver, solves=True) for _ in range(2))
        self.session = ContactSession(settings, coarse, self.draw, full)
        self._side_jobs = JobQueue(worker_pool, deliver)
        self.drawing = MachineDrawing(worker_pool, deliver, tools.draw_machine)
        self.sound, self.picture = Sound(), PictureButton()
        self.speeds = SpeedCurve(
            JobQueue(worker_pool, deliver, solves=True), lambda: not self.session.pending
        )
        self.inputs: dict[str, InputWidget] = {}
        self._built: Case | MachineCase | None = None
        self._more = False
        self._drawn: tuple[ContactResult, ContactResult | None] | None = None
        self._judged: ContactResult | None = None  # latest result with a verdict
        self._create_outputs()
        self._create_controls()
        self._build_knobs()
        worker_pool.when_warm(lambda: deliver(self.draw))

    def _create_outputs(self) -> None:
        """Create texts, and placeholders of the figures."""
        self.maps = MapImages()
        self.spectrum = placeholder(SPECTRUM_HEIGHT)
        self.share, self.resonance = placeholder(TRIALS_HEIGHT), placeholder(TRIALS_HEIGHT)
        self._spectrum: SpectrumFigure | None = None
        self._trials: TrialFigures | None = None
        self._pending_figures = [
            *self.maps.steps(),
            self._make_spectrum,
            self._make_trials,
            self.speeds.create,
        ]
        self.status, self.verdict, self.notes, self.message = (text_block() for _ in range(4))
        self.tiles = text_block(TILE_STYLES)
        self.strip = HeadlineStrip()
        self.stale_mark = StaleMark(self.status)
        self.download = Download()

    def _create_controls(self) -> None:
        """Create the column of inputs, the file drop and the buttons."""
        self.input_column = Column(sizing_mode="stretch_width", stylesheets=[INHERIT])
        self.drop = FileDrop(
            limit=SURFACE_LIMIT,
            on_file=self._surface_dropped,
            on_error=self._show_message,
            several=False,
            name="Drop a measured surface here",
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[LOOK, DROP],
        )
        self.more = button("More inputs", self._show_more)
        self._chips = {
            key: button(title, partial(self._open_preset, key)) for key, title in TITLES.items()
        }
        self.presets = button_row(*self._chips.values())
        self.presets.styles = {"flex-wrap": "nowrap", "overflow-x": "auto"}
        self.presets.stylesheets = [INHERIT, FADE]
        self.pin = button("Pin to compare", self._pin)
        self.report = button("Report", self._make_report)
        self.buttons = button_row(
            self.sound.button,
            self.pin,
            link_button(),
            self.picture.button,
            button("Case file", self._give_case),
            button("Python script", self._give_script),
            self.report,
        )

    def begin(self, query: str, result: ContactResult | None = None) -> None:
        """Show a stored result, or solve the contact that the address describes."""
        if result is not None and not query:
            self.session.open(self.session.settings, result)
            return
        if (preset := preset_key(query)) in TITLES:
            self.session.settings = Settings(preset_case(preset), preset=preset)
        key = surface_key(query)
        case = self._surfaces.load(key, self.drop.folder) if key else None
        if case is not None:
            self.session.settings = Settings(case, dropped=case.contents.surface.name, held=key)
            self._build_knobs()
        self._show_message(*self.session.go_to(query))

    def create_next_figure(self) -> None:
        """Create the next figure and schedule the one after it, to keep the server responsive."""
        if self._pending_figures:
            self._pending_figures.pop(0)()
            self._deliver(self.create_next_figure)
        else:
            self.draw()

    def close(self) -> None:
        """Release the resources of the visit."""
        self._pending_figures.clear()
        self.session.close()
        self._side_jobs.close()
        self.drawing.close()
        self.speeds.close()
        self.drop.close()

    # Results
    # ---------------------------------------------------------------------------------

    def draw(self) -> None:
        """Draw the current state of the session."""
        session = self.session
        if session.settings.opened is not self._built:
            self._build_knobs()
        loading = self._worker_pool.is_compiling
        kind = (
            "alarm"
            if session.problem or (session.result is not None and not session.result.converged)
            else "soft"
        )
        status = session.status if session.stale or not self._pending_figures else "Drawing ..."
        self._draw_inputs()
        self.stale_mark.show(session.stale)
        self.drawing.show(session.settings.machine)
        self._draw_strip(loading=loading)
        if session.pending:
            self.speeds.pause()
        if session.result is not None:
            self.tiles.text = tiles(
                [tile for tile in session.result.tiles if tile.key not in HEADLINE],
                session.result,
                session.pinned,
                stale=session.stale,
            )
            if (session.result, session.pinned) != self._drawn:
                self._draw_result(session.result, session.pinned)
                self._drawn = (session.result, session.pinned)
            self._draw_verdict()
        self.pin.label = "Unpin" if session.pinned is not None else "Pin to compare"
        notice = "Loading the solver (the first time, it is also compiled). " if loading else ""
        self.status.text = sentences(
            [f"{notice}{status}"], kind
        )  # last: a screen reader announces it when the page is complete

    def _draw_inputs(self) -> None:
        """Show values, errors and remarks of the inputs, and the selected preset."""
        session = self.session
        for key, widget in self.inputs.items():
            rejected = session.rejected.get(key)
            widget.show(
                rejected.text if rejected else session.settings.text(key),
                rejected.message if rejected else "",
                "" if rejected else session.settings.remark(key),
            )
        for key, chip in self._chips.items():
            chosen = key == session.settings.preset
            chip.stylesheets = [LOOK, CHIP, *([CHOSEN] if chosen else [])]

    def _draw_strip(self, *, loading: bool) -> None:
        """Draw regime, load share and resonance, which stay visible."""
        session = self.session
        html = self.strip.html
        if session.result is not None:
            html = headline(
                session.result, session.pinned, state=session.state, stale=session.stale
            )
        self.strip.show(html, busy=loading)

    def _draw_verdict(self) -> None:
        """Draw the latest verdict; it is marked while other values are solved or invalid."""
        if self._judged is not None:
            mark = "Previous result: " if self.session.stale else ""
            kind = "" if self._judged.converged else "alarm"
            self.verdict.text = sentences([f"{mark}{self._judged.verdict}"], kind)

    def _draw_result(self, result: ContactResult, pinned: ContactResult | None) -> None:
        self.maps.show(result, pinned)
        if result.text == self.session.settings.case.text:
            self.picture.show(self.session.settings)
        if result.coarse:
            return
        self._judged = result
        self.notes.text = notes(result.notes)
        self._draw_spectrum()
        self._draw_trials()
        self.sound.show(result)
        if not self.session.pending and result.converged:
            self.speeds.follow(self.session.settings.case, result)
        self._set_address(self.session.settings.address)

    def _make_spectrum(self) -> None:
        self._spectrum = SpectrumFigure()
        self.spectrum.children = [self._spectrum.figure]
        self._draw_spectrum()

    def _make_trials(self) -> None:
        self._trials = TrialFigures(self._restore)
        self.share.children, self.resonance.children = [self._trials.share], [self._trials.crf]
        self._draw_trials()

    def _draw_spectrum(self) -> None:
        result = self.session.result
        pinned = self.session.pinned
        if self._spectrum is not None and result is not None and not result.coarse:
            self._spectrum.show(
                result.spectrum,
                None if pinned is None else pinned.spectrum,
                spectrum_title(result),
            )

    def _draw_trials(self) -> None:
        if self._trials is not None:
            self._trials.show(self.session.trials)

    def _show_message(self, *lines: str) -> None:
        self.message.text = sentences(lines, "alarm")

    # Inputs
    # ---------------------------------------------------------------------------------

    def _build_knobs(self) -> None:
        """Create the widgets of the visible inputs, grouped under headings."""
        if self.session.settings.opened is not self._built:
            self._built = self.session.settings.opened
            self.inputs.clear()
        children: list[UIElement] = []
        group = ""
        for key, case_input in self.session.settings.inputs.items():
            if case_input.more and not self._more:
                continue
            if key not in self.inputs:
                self.inputs[key] = InputWidget(case_input, self._change)
            widget = self.inputs[key]
            if case_input.group != group:
                group = case_input.group
                heading = text_block("h3 { font-size: .95rem; margin: 12px 0 2px; }")
                heading.text = f"<h3>{group}</h3>"
                children.append(heading)
            children.append(widget.model)
        self.input_column.children = children

    def _change(self, key: str, text: str) -> None:
        self._show_message()
        self.session.change(key, text)

    def _show_more(self) -> None:
        self._more = not self._more
        self.more.label = "Fewer inputs" if self._more else "More inputs"
        self._build_knobs()
        self.draw()

    def _open_preset(self, name: str) -> None:
        """Open a preset case."""
        self._show_message()
        self.session.open(Settings(preset_case(name), preset=name))

    def _restore(self, number: int) -> None:
        """Restore the settings of an earlier result."""
        self._show_message()
        self.session.go_back(number)

    def _pin(self) -> None:
        if self.session.pinned is not None:
            self.session.unpin()
        else:
            self.session.pin()

    # Uploads and downloads
    # ---------------------------------------------------------------------------------

    def _surface_dropped(self, path: Path) -> None:
        self._show_message()
        case = self.session.settings.case
        self._side_jobs.submit((open_surface, (case, path)), self._surface_read)

    def _surface_read(self, result: object) -> None:
        if isinstance(result, JobFailure):
            self._show_message(result.message)
            return
        assert isinstance(result, tuple)
        case, key, steps = result
        self._surfaces.add(key, case)
        self.message.text = sentences((*steps, LINK_NOTE), "soft")
        self.session.open(Settings(case, dropped=case.contents.surface.name, held=key))

    def _give_case(self) -> None:
        self.download.offer(
            export.CASE_FILE, "application/toml", export.case_text(self.session.settings.case)
        )

    def _give_script(self) -> None:
        self.download.offer(export.SCRIPT, "text/x-python", export.python_script())

    def _make_report(self) -> None:
        self.report.disabled, self.report.label = True, "Writing report ..."
        self._side_jobs.submit(
            (make_report, (self.session.settings.case, self._tools.write_report)), self._report_made
        )

    def _report_made(self, result: object) -> None:
        self.report.disabled, self.report.label = False, "Report"
        if isinstance(result, JobFailure):
            self._show_message(result.message)
        else:
            self.download.offer(export.REPORT, "text/html", str(result))


def layout(view: ContactView) -> Layout:
    """Return the parts of the page by name, and the sections that contain them."""
    parts = {
        "presets": view.presets,
        "drawing": view.drawing.model,
        "headline": view.strip.model,
        "inputs": view.input_column,
        "more": view.more,
        "drop": view.drop,
        "status": view.status,
        "verdict": view.verdict,
        "message": view.message,
        "tiles": view.tiles,
        "buttons": view.buttons,
        "film": view.maps.film,
        "pressure": view.maps.pressure,
        "change": view.maps.change,
        "cut": Column(view.maps.cut_pressure, view.maps.cut_film, sizing_mode="stretch_width"),
        "spectrum": view.spectrum,
        "stribeck": view.speeds.model,
        "sound": view.sound.model,
        "share": view.share,
        "resonance": view.resonance,
        "notes": view.notes,
        "download": view.download.model,
    }
    inputs: list[PageBlock] = [{"names": [name]} for name in ("drawing", "inputs", "more", "drop")]
    results: list[PageBlock] = [
        {"names": ["presets"], "first": True},
        {"names": ["status"], "live": True, "first": True},
        {"names": ["message"], "live": True, "first": True},
        {"names": ["tiles"], "first": True},
        {"names": ["verdict"]},
        {"names": ["buttons"]},
        {"names": ["film", "pressure"], "key": MAP_KEY, "first": True},
        {"names": ["change"]},
        {"names": ["cut", "spectrum"]},
        {"names": ["stribeck"]},
        {"names": ["share", "resonance"], "heading": "Earlier results"},
        {"names": ["notes"]},
        {"names": ["download", "headline", "sound"]},
    ]
    return parts, [
        {"kind": "inputs", "label": "Inputs", "blocks": inputs},
        {"kind": "results", "label": "Contact", "blocks": results},
    ]
