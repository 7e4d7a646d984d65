"""The page of a contact: knobs beside what becomes of them, drawn anew whenever the desk changes."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from bokeh.models import Column

from asperity.app import export as take
from asperity.app.contact_jobs import Refused, ReportWriter, make_report, open_surface
from asperity.app.contact_result import Answer
from asperity.app.figures import SPECTRUM_HEIGHT, TRAIL_HEIGHT, Spectrum, Trail
from asperity.app.jobs import Queue, Workshop
from asperity.app.map_images import Pictures, place
from asperity.app.session import Desk
from asperity.app.settings import Settings, held_in
from asperity.app.surface_store import Shelf
from asperity.app.uploads import Drop
from asperity.app.widgets import (
    DROP,
    INHERIT,
    LOOK,
    MAP_KEY,
    TILE_STYLES,
    Handout,
    KnobWidget,
    OldMark,
    button,
    button_row,
    notes,
    sentences,
    text_block,
    tiles,
)
from asperity.case import Case
from asperity.core.quantities import quantity

HELD_SO_LONG = "The address brings it back as long as this server runs."
SURFACE_LIMIT = 300_000_000  # bytes of a measured surface


class ContactView:
    """One user's contact with its widgets.

    Parameters
    ----------
    settings : the opened case
    workshop : solves
    deliver : calls a function under the document's lock
    set_address : puts a query into the browser's address
    write_report : makes a run's page
    shelf : holds surfaces that are dropped
    """

    def __init__(
        self,
        settings: Settings,
        workshop: Workshop,
        deliver: Callable[[Callable[[], None]], None],
        set_address: Callable[[str], None],
        write_report: ReportWriter,
        shelf: Shelf,
    ) -> None:
        self._shelf = shelf
        self._set_address, self._write_report = set_address, write_report
        self._workshop, self._deliver = workshop, deliver
        self.desk = Desk(settings, Queue(workshop, deliver), self.draw, Queue(workshop, deliver))
        self._side = Queue(workshop, deliver)
        self.pictures = Pictures()
        self.hearing, self.share, self.pitch = (
            place(SPECTRUM_HEIGHT),
            place(TRAIL_HEIGHT),
            place(TRAIL_HEIGHT),
        )
        self._spectrum: Spectrum | None = None
        self._trail: Trail | None = None
        self._unmade = [*self.pictures.steps(), self._make_spectrum, self._make_trail]
        self.status, self.verdict, self.notes, self.said = (text_block() for _ in range(4))
        self.tiles = text_block(TILE_STYLES)
        self.old = OldMark(self.status)
        self.handout = Handout()
        self.knobs: dict[str, KnobWidget] = {}
        self._built: Case | None = None
        self.knob_column = Column(sizing_mode="stretch_width", stylesheets=[INHERIT])
        self._more = False
        self._drawn: tuple[Answer, Answer | None] | None = None
        self.drop = Drop(
            limit=SURFACE_LIMIT,
            arrived=self._surface_came,
            refused=self._say,
            several=False,
            name="Measured surface, dropped here",
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[LOOK, DROP],
        )
        self.more = button("More knobs", self._show_more)
        self.pin = button("Pin to compare", self._pin)
        self.report = button("Report", self._make_report)
        self.take = button_row(
            self.pin,
            button("Case file", self._give_case),
            button("Python lines", self._give_script),
            self.report,
        )
        self._build_knobs()

    def begin(self, query: str, answer: Answer | None = None) -> None:
        """Solve what the address says, or show what is solved already."""
        if answer is not None and not query:
            self.desk.open(self.desk.settings, answer)
            return
        held = held_in(query)
        case = self._shelf.lend(held, self.drop.folder) if held else None
        if case is not None:
            self.desk.settings = Settings(case, dropped=case.contents.surface.name, held=held)
            self._build_knobs()
        self._say(*self.desk.go_to(query))

    def furnish(self) -> None:
        """Make the next figure and ask for the one after it; between them others are served."""
        if self._unmade:
            self._unmade.pop(0)()
            self._deliver(self.furnish)
        else:
            self.draw()

    def close(self) -> None:
        """Give back what the session took."""
        self._unmade.clear()
        self.desk.close()
        self._side.close()
        self.drop.close()

    # What is shown
    # ---------------------------------------------------------------------------------

    def draw(self) -> None:
        """Draw the desk as it is now."""
        desk = self.desk
        if desk.settings.opened is not self._built:
            self._build_knobs()
        warming = (
            ""
            if self._workshop.is_warm
            else "Warming up: the solver is loaded, and compiled the first time. "
        )
        kind = (
            "alarm"
            if desk.problem or (desk.answer is not None and not desk.answer.converged)
            else "soft"
        )
        status = desk.status if desk.stale or not self._unmade else "Drawing ..."
        for key, widget in self.knobs.items():
            refusal = desk.refusals.get(key)
            widget.show(
                refusal.text if refusal else desk.settings.text(key),
                refusal.sentence if refusal else "",
            )
        self.old.show(desk.stale)
        if desk.answer is not None:
            self.tiles.text = tiles(desk.answer.tiles, desk.answer, desk.pinned, old=desk.pending)
            if (desk.answer, desk.pinned) != self._drawn:
                self._draw_answer(desk.answer, desk.pinned)
                self._drawn = (desk.answer, desk.pinned)
        self.pin.label = "Unpin" if desk.pinned is not None else "Pin to compare"
        self.status.text = sentences(
            [f"{warming}{status}"], kind
        )  # last: who hears it finds everything there

    def _draw_answer(self, answer: Answer, pinned: Answer | None) -> None:
        self.pictures.show(answer, pinned)
        if answer.coarse:
            return
        self.verdict.text = sentences([answer.verdict], "" if answer.converged else "alarm")
        self.notes.text = notes(answer.notes)
        self._draw_spectrum()
        self._draw_trail()
        self._set_address(self.desk.settings.address)

    def _make_spectrum(self) -> None:
        self._spectrum = Spectrum()
        self.hearing.children = [self._spectrum.figure]
        self._draw_spectrum()

    def _make_trail(self) -> None:
        self._trail = Trail(self._again)
        self.share.children, self.pitch.children = [self._trail.share], [self._trail.pitch]
        self._draw_trail()

    def _draw_spectrum(self) -> None:
        answer, pinned = self.desk.answer, self.desk.pinned
        if self._spectrum is not None and answer is not None and not answer.coarse:
            self._spectrum.show(
                answer.sound, None if pinned is None else pinned.sound, _heard(answer)
            )

    def _draw_trail(self) -> None:
        if self._trail is not None:
            self._trail.show(self.desk.trail)

    def _say(self, *lines: str) -> None:
        self.said.text = sentences(lines, "alarm")

    # What is turned
    # ---------------------------------------------------------------------------------

    def _build_knobs(self) -> None:
        """A widget for every knob of the opened case that is shown, under the headings of their groups."""
        if self.desk.settings.opened is not self._built:
            self._built = self.desk.settings.opened
            self.knobs.clear()
        children: list[Any] = []
        group = ""
        for key, knob in self.desk.settings.knobs.items():
            if knob.more and not self._more:
                continue
            if key not in self.knobs:
                self.knobs[key] = KnobWidget(knob, self._turned)
            widget = self.knobs[key]
            if knob.group != group:
                group = knob.group
                heading = text_block("h3 { font-size: .95rem; margin: 12px 0 2px; }")
                heading.text = f"<h3>{group}</h3>"
                children.append(heading)
            children.append(widget.model)
        self.knob_column.children = children

    def _turned(self, key: str, text: str) -> None:
        self._say()
        self.desk.turn(key, text)

    def _show_more(self) -> None:
        self._more = not self._more
        self.more.label = "Fewer knobs" if self._more else "More knobs"
        self._build_knobs()
        self.draw()

    def _again(self, number: int) -> None:
        """Go back to a setting that was tried."""
        self._say()
        self.desk.go_back(number)

    def _pin(self) -> None:
        if self.desk.pinned is not None:
            self.desk.unpin()
        else:
            self.desk.pin()

    # What is dropped and taken away
    # ---------------------------------------------------------------------------------

    def _surface_came(self, path: Path) -> None:
        self._say()
        case = self.desk.settings.case
        self._side.ask((open_surface, (case, path)), self._surface_read)

    def _surface_read(self, result: Any) -> None:
        if isinstance(result, Refused):
            self._say(result.sentence)
            return
        case, held, steps = result
        self._shelf.put(held, case)
        self.said.text = sentences((*steps, HELD_SO_LONG), "soft")
        self.desk.open(Settings(case, dropped=case.contents.surface.name, held=held))

    def _give_case(self) -> None:
        self.handout.give(
            take.CASE_FILE, "application/toml", take.case_text(self.desk.settings.case)
        )

    def _give_script(self) -> None:
        self.handout.give(take.SCRIPT, "text/x-python", take.python_lines())

    def _make_report(self) -> None:
        self.report.disabled, self.report.label = True, "Report is made ..."
        self._side.ask(
            (make_report, (self.desk.settings.case, self._write_report)), self._report_made
        )

    def _report_made(self, result: Any) -> None:
        self.report.disabled, self.report.label = False, "Report"
        if isinstance(result, Refused):
            self._say(result.sentence)
        else:
            self.handout.give(take.REPORT, "text/html", result)


def _heard(answer: Answer) -> str:
    """What the spectrum says, as its title."""
    sound = answer.sound
    if sound is None:
        return "No vibration asked for"
    if sound.crf_hz is None:
        return f"No contact resonance: {sound.reason}"
    crf = quantity("crf_hz")
    fitted = f", fitted to ± {crf.text(sound.crf_std_hz)}" if sound.crf_std_hz is not None else ""
    return f"{crf.named(sound.crf_hz)}{fitted}"


def layout(view: ContactView) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The parts of the page by name, and the sections that they stand in."""
    parts = {
        "knobs": view.knob_column,
        "more": view.more,
        "drop": view.drop,
        "status": view.status,
        "verdict": view.verdict,
        "said": view.said,
        "tiles": view.tiles,
        "take": view.take,
        "film": view.pictures.film,
        "pressure": view.pictures.pressure,
        "change": view.pictures.change,
        "cut": Column(
            view.pictures.cut_pressure, view.pictures.cut_film, sizing_mode="stretch_width"
        ),
        "spectrum": view.hearing,
        "share": view.share,
        "pitch": view.pitch,
        "notes": view.notes,
        "handout": view.handout.model,
    }
    knobs: list[dict[str, Any]] = [{"names": [name]} for name in ("knobs", "more", "drop")]
    shown: list[dict[str, Any]] = [
        {"names": ["status"], "live": True, "first": True},
        {"names": ["said"], "live": True, "first": True},
        {"names": ["tiles"], "first": True},
        {"names": ["verdict"]},
        {"names": ["take"]},
        {"names": ["film", "pressure"], "key": MAP_KEY, "first": True},
        {"names": ["change"]},
        {"names": ["cut", "spectrum"]},
        {"names": ["share", "pitch"], "heading": "What was tried"},
        {"names": ["notes"]},
        {"names": ["handout"]},
    ]
    return parts, [
        {"kind": "knobs", "label": "Knobs", "blocks": knobs},
        {"kind": "shown", "label": "The contact", "blocks": shown},
    ]
