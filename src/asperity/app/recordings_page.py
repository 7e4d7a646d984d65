"""Page of recordings, from a watched folder or dropped files: verdict, spectra and trend."""

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from bokeh.models import ColumnDataSource, HoverTool, Select, Span, TextInput
from markupsafe import Markup

from asperity.app.contact_jobs import JobFailure
from asperity.app.figures import BLUE, GREY, VERMILION, legend_above, plain_figure
from asperity.app.jobs import JobQueue, VisitPool
from asperity.app.recording_jobs import (
    RecordingContext,
    RecordingInputs,
    RecordingSeries,
    simulate_example,
    track_files,
    track_folder,
)
from asperity.app.uploads import FileDrop
from asperity.app.waterfall import Waterfall
from asperity.app.widgets import (
    DROP,
    LOOK,
    TABLE,
    Layout,
    Look,
    PageBlock,
    button,
    notes,
    sentences,
    text_block,
)
from asperity.case import read_amount
from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR, PERCENT
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity

RECORDING_LIMIT = 400_000_000  # bytes of a recording
NO_LINE: dict[str, Sequence[float] | Field] = {"f": [], "s": []}
TRACK_COLUMNS = ("x", "crf", "low", "high", "colour", "stage", "file")
COLUMNS = ("crf_hz", "crfa", "damping_ratio", "clr")


class RecordingsView:
    """Recordings of one visitor with their widgets.

    Parameters
    ----------
    folder : watched folder; None for dropped files
    context : contact and table of the series
    """

    def __init__(
        self,
        folder: Path | None,
        context: RecordingContext,
        worker_pool: VisitPool,
        deliver: Callable[[Callable[[], None]], None],
    ) -> None:
        self._folder, self._context = folder, context
        self._queue = JobQueue(worker_pool, deliver)
        self._dropped: list[Path] = []
        self._submitted = 0
        self._memory: TemporaryDirectory[str] | None = None
        self._example: TemporaryDirectory[str] | None = None
        self.series: RecordingSeries | None = None
        self.status, self.verdict, self.notes = (text_block() for _ in range(3))
        self.table = text_block(TABLE)
        self._create_inputs()
        self._build_figures()
        for part in (self.waterfall.figure, self.track, self.one, self.choice):
            part.visible = False  # until there are recordings
        if folder is None:
            self._tell(
                "Drop recordings (CSV, WAV, HDF5, TDMS, UFF ...) to see the contact resonance and "
                "its trend, or try an example: the paper's wear test, simulated."
            )

    def _create_inputs(self) -> None:
        """Create the file drop, the typed properties and the buttons."""
        self.drop = FileDrop(
            limit=RECORDING_LIMIT,
            on_file=self._file_dropped,
            on_error=self._show_message,
            several=True,
            name="Drop recordings here",
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[LOOK, DROP],
        )
        style: Look = {
            "sizing_mode": "stretch_width",
            "stylesheets": [LOOK],
            "margin": (0, 0, 6, 0),
        }
        self.rate = TextInput(
            title="Sampling rate, if not in the files", placeholder="20 kHz", **style
        )
        self.unit = TextInput(
            title="Unit of the values, if not in the files", placeholder="g", **style
        )
        self.channel = TextInput(title="Channel, if files have several", **style)
        self.band = TextInput(
            title="Search band (default: from the case)", placeholder="2 kHz to 5 kHz", **style
        )
        self.reread = button("Read again", self.read)
        self.example = button("Try an example", self._open_example)
        self.example.visible = self._folder is None
        self.choice = Select(title="Recording", options=[], **style)
        self.choice.on_change("value", lambda _name, _old, new: self._show_one(new))

    def _build_figures(self) -> None:
        self.waterfall = Waterfall()
        self._build_track()
        self._build_spectrum()

    def _build_track(self) -> None:
        self.track = plain_figure(
            "",
            "crf_hz",
            label="Contact resonance over the series",
            title="Contact resonance",
            height=320,
            tapped=True,
        )
        self._line = ColumnDataSource({name: [] for name in TRACK_COLUMNS})
        dots = self.track.scatter(
            "x", "crf", source=self._line, size=8, color="colour", legend_field="stage"
        )
        # ends wider than the dots, to be seen where an interval is narrower than a dot
        bars: Look = {"source": self._line, "color": GREY, "legend_label": f"{PERCENT} interval"}
        self.track.segment("x", "low", "x", "high", **bars)
        for end in ("low", "high"):
            self.track.scatter("x", end, marker="dash", size=18, **bars)
        legend_above(self.track)
        unit = quantity("crf_hz").display
        crf = f"@crf{{0.0}} {unit} ({PERCENT}: @low{{0.0}} to @high{{0.0}})"
        self.track.add_tools(
            HoverTool(renderers=[dots], tooltips=[("CRF", crf), ("recording", "@file")])
        )
        self._split = Span(
            dimension="height", line_color=VERMILION, line_dash="dashed", visible=False
        )
        self.track.add_layout(self._split)
        self._line.selected.on_change("indices", lambda _name, _old, new: self._pick(new))

    def _build_spectrum(self) -> None:
        self.one = plain_figure(
            "frequency_hz",
            "",
            label="Spectrum of a recording with the fitted resonance",
            title="Spectrum",
            y_axis_type="log",
        )
        self._density, self._curve = (ColumnDataSource({"f": [], "s": []}) for _ in range(2))
        self.one.line("f", "s", source=self._density, color=GREY, legend_label="spectrum")
        self.one.line(
            "f",
            "s",
            source=self._curve,
            color=VERMILION,
            line_width=2,
            legend_label="fitted resonance",
        )
        legend_above(self.one)
        self._crf = Span(dimension="height", line_color=BLUE, line_dash="dashed", visible=False)
        self.one.add_layout(self._crf)

    # Reading
    # ---------------------------------------------------------------------------------

    def typed_inputs(self) -> RecordingInputs:
        """Return the typed properties; raise BadInput for invalid ones."""
        rate = self.rate.value.strip()
        band = None
        if self.band.value.strip():
            parts = self.band.value.replace("–", "to").split("to")
            if len(parts) != 2:
                raise BadInput(
                    'the band must be two frequencies such as "2 kHz to 5 kHz", got '
                    f'"{self.band.value}"'
                )
            low, high = (read_amount("the band", "Hz", part.strip()) for part in parts)
            band = (low, high)
        return RecordingInputs(
            rate_hz=read_amount("the sampling rate", "Hz", rate) if rate else None,
            unit=self.unit.value.strip() or None,
            channel=self.channel.value.strip() or None,
            band_hz=band,
        )

    def read(self) -> None:
        """Read the folder or the dropped files again, with the typed properties."""
        self._discard_memory()
        self.refresh()

    def refresh(self) -> None:
        """Check the folder or read the dropped files, unless a job is still running."""
        if self._queue.busy or (self._folder is None and not self._dropped):
            return
        try:
            inputs = self.typed_inputs()
        except BadInput as error:
            self._show_message(str(error))
            return
        if self._dropped:
            self._submitted = len(self._dropped)
            self._tell(f"Reading {self._submitted} recordings ...")
            self._queue.submit(
                (track_files, (tuple(self._dropped), inputs, self._context)), self._read
            )
            return
        if self._memory is None:
            self._memory = TemporaryDirectory(prefix="asperity-page-")
            self._tell("Reading the folder ...")
        self._queue.submit(
            (track_folder, (self._folder, Path(self._memory.name), inputs, self._context)),
            self._read,
        )

    @property
    def watches(self) -> bool:
        """True if a folder is watched."""
        return self._folder is not None and not self._dropped

    def close(self) -> None:
        """Release the resources of the visit."""
        self._queue.close()
        self.drop.close()
        self._discard_memory()
        if self._example is not None:
            self._example.cleanup()
        self.series = None

    def _discard_memory(self) -> None:
        if self._memory is not None:
            self._memory.cleanup()
            self._memory = None

    def _open_example(self) -> None:
        """Simulate the paper's wear test and open its recordings."""
        if self._queue.busy:
            return
        if self._example is None:
            self._example = TemporaryDirectory(prefix="asperity-page-")
        folder = Path(self._example.name) / "rig"
        self._tell("Simulating the recordings of the paper's wear test ...")
        self.example.disabled = True
        self._queue.submit((simulate_example, (folder,)), self._example_made)

    def _example_made(self, result: object) -> None:
        self.example.disabled = False
        if isinstance(result, JobFailure):
            self._show_message(result.message)
            return
        assert isinstance(result, RecordingContext)
        assert result.table is not None
        self._context = result
        self._dropped = sorted(result.table.parent.glob("*.h5"))
        self.refresh()

    def _file_dropped(self, path: Path) -> None:
        self._dropped.append(path)
        self.refresh()

    def _read(self, result: object) -> None:
        if isinstance(result, JobFailure):
            self._show_message(result.message)
        elif result is None:
            self._tell("No recording has arrived yet; the folder is being watched.")
        else:
            assert isinstance(result, RecordingSeries)
            self.show(result)
        if len(self._dropped) > self._submitted:
            self.refresh()  # further files arrived in the meantime

    # Results
    # ---------------------------------------------------------------------------------

    def _show_message(self, message: str) -> None:
        self.status.text = sentences([f"{message.rstrip('.')}."], "alarm")

    def _tell(self, message: str) -> None:
        self.status.text = sentences([message], "soft")

    def show(self, series: RecordingSeries) -> None:
        """Draw a series."""
        self.series = series
        for part in (self.waterfall.figure, self.track, self.one, self.choice):
            part.visible = True
        self.verdict.text = sentences([series.verdict], "alarm" if series.alarm == "alarm" else "")
        self.notes.text = notes(series.notes)
        self.table.text = _table(series)
        self.waterfall.show(series)
        self._draw_track(series)
        names = [f"{number}: {row['file']}" for number, row in enumerate(series.rows, 1)]
        selected = self.choice.value if self.choice.value in names else names[-1]
        self.choice.update(options=names, value=selected)
        self._show_one(selected)
        waiting = f", {series.waiting} waiting" if series.waiting else ""
        watched = "; the folder is being watched" if self.watches else ""
        self._tell(
            f"{len(series.rows)} recordings read{waiting}{watched}."
        )  # last: a screen reader announces it when the page is complete

    def _draw_track(self, series: RecordingSeries) -> None:
        rows = [
            (number, row) for number, row in enumerate(series.rows) if row["crf_hz"] is not None
        ]
        x = [row["x"] for _, row in rows]
        crf = [row["crf_hz"] for _, row in rows]
        bars = [NORMAL_FACTOR * (row["crf_std_hz"] or 0.0) for _, row in rows]
        self._line.data = {
            "x": x,
            "crf": crf,
            "low": [value - bar for value, bar in zip(crf, bars, strict=True)],
            "high": [value + bar for value, bar in zip(crf, bars, strict=True)],
            "colour": [VERMILION if row["label"] == "severe" else BLUE for _, row in rows],
            "stage": [row["label"] or "CRF" for _, row in rows],
            "file": [row["file"] for _, row in rows],
        }
        self._numbers = [number for number, _ in rows]
        self.track.xaxis.axis_label = series.x_label
        self.track.title.text = (
            "Contact resonance" if series.split is None else "Resonance; dashed: change point"
        )
        self._split.update(visible=series.split is not None, location=series.split or 0.0)

    def _pick(self, indices: list[int]) -> None:
        if indices and self.series is not None and indices[0] < len(self._numbers):
            self.choice.value = self.choice.options[self._numbers[indices[0]]]

    def _show_one(self, name: str) -> None:
        """Draw the spectrum of one recording, or state why there is none."""
        series = self.series
        if series is None or not name.partition(":")[0].isdigit():
            return
        number = int(name.partition(":")[0]) - 1
        row = series.rows[number]
        spectrum = series.spectra[number]
        crf = quantity("crf_hz").text(row["crf_hz"], row["crf_std_hz"])
        self.one.title.text = (
            f"{row['file']}: CRF {crf}" if row["found"] else f"{row['file']}: {row['reason']}"
        )
        density = curve = NO_LINE
        if spectrum is not None:
            density = {"f": spectrum.frequency[1:], "s": spectrum.density[1:]}
            if spectrum.curve.size > 0:
                curve = {"f": spectrum.frequency, "s": spectrum.curve}
        self._density.data, self._curve.data = density, curve
        unit = "" if spectrum is None else spectrum.unit.replace("^2", "²")
        self.one.yaxis.axis_label = f"density [{unit}]" if unit else ""
        self._crf.update(visible=row["crf_hz"] is not None, location=row["crf_hz"] or 0.0)


def _table(series: RecordingSeries) -> Markup:
    """Return the table of recordings: numbers, or why there are none."""
    head = Markup("").join(Markup("<th>{}</th>").format(quantity(key).label) for key in COLUMNS)
    rows = []
    for row in series.rows:
        cells = Markup("").join(
            Markup("<td>{}</td>").format(quantity(key).number_in(row)) for key in COLUMNS
        )
        remark = row["remarks"] if row["found"] else row["reason"]
        rows.append(Markup("<tr><th>{}</th>{}<td>{}</td></tr>").format(row["file"], cells, remark))
    body = Markup("").join(rows)
    return Markup(
        "<h2>Recordings</h2><table><thead><tr><th>recording</th>{}<th></th></tr></thead><tbody>{}</tbody></table>"
    ).format(head, body)


def layout(view: RecordingsView) -> Layout:
    """Return the parts of the page by name, and the sections that contain them."""
    parts = {
        "drop": view.drop,
        "example": view.example,
        "rate": view.rate,
        "unit": view.unit,
        "channel": view.channel,
        "band": view.band,
        "again": view.reread,
        "status": view.status,
        "verdict": view.verdict,
        "waterfall": view.waterfall.figure,
        "track": view.track,
        "choice": view.choice,
        "one": view.one,
        "table": view.table,
        "notes": view.notes,
    }
    names = ("drop", "example", "rate", "unit", "channel", "band", "again")
    inputs: list[PageBlock] = [{"names": [name]} for name in names]
    results: list[PageBlock] = [
        {"names": ["status"], "live": True, "first": True},
        {"names": ["verdict"], "first": True},
        {"names": ["waterfall", "track"], "first": True},
        {"names": ["choice"]},
        {"names": ["one"]},
        {"names": ["table"]},
        {"names": ["notes"]},
    ]
    return parts, [
        {"kind": "inputs", "label": "Properties of the recordings", "blocks": inputs},
        {"kind": "results", "label": "Series", "blocks": results},
    ]
