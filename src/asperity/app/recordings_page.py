"""The page of recordings: a folder watched or files dropped, spectra over the series, its track, and the verdict."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, LinearColorMapper, Range1d, Select, Span, TextInput
from bokeh.palettes import Viridis256
from markupsafe import Markup

from asperity.app.contact_jobs import Refused
from asperity.app.figures import BLUE, GREY, VERMILION, plain_figure
from asperity.app.jobs import Queue, Workshop
from asperity.app.recording_jobs import Heard, Stated, hear_files, hear_folder
from asperity.app.uploads import Drop
from asperity.app.widgets import DROP, LOOK, TABLE, button, notes, sentences, text_block
from asperity.case import Case, read_amount
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity

RECORDING_LIMIT = 400_000_000  # bytes of a recording
NORMAL_90 = 1.6449  # standard deviations on either side of 90 %
LOUD = 30.0  # dB over the median, where the colours of the waterfall end
SHOWN = ("crf_hz", "crfa", "damping_ratio", "clr")


class RecordingsView:
    """One user's recordings with their widgets.

    Parameters
    ----------
    folder : watched; None where files are dropped
    case : where to look and what a resonance stands for; None: the paper's contact, and the notes say so
    """

    def __init__(
        self,
        folder: Path | None,
        case: Case | None,
        workshop: Workshop,
        deliver: Callable[[Callable[[], None]], None],
    ) -> None:
        self._folder, self._case = folder, case
        self._queue = Queue(workshop, deliver)
        self._dropped: list[Path] = []
        self._asked = 0
        self._memory: TemporaryDirectory[str] | None = None
        self.heard: Heard | None = None
        self.status, self.verdict, self.notes = (text_block() for _ in range(3))
        self.table = text_block(TABLE)
        self.drop = Drop(
            limit=RECORDING_LIMIT,
            arrived=self._came,
            refused=self._say,
            several=True,
            name="Recordings, dropped here",
            sizing_mode="stretch_width",
            margin=0,
            stylesheets=[LOOK, DROP],
        )
        look: dict[str, Any] = {
            "sizing_mode": "stretch_width",
            "stylesheets": [LOOK],
            "margin": (0, 0, 6, 0),
        }
        self.rate = TextInput(
            title="Sampling rate, where files do not say", placeholder="20 kHz", **look
        )
        self.unit = TextInput(
            title="Unit of the values, where files do not say", placeholder="g", **look
        )
        self.channel = TextInput(title="Channel, where files have several", **look)
        self.band = TextInput(
            title="Band to look in, in place of the case's", placeholder="2 kHz to 5 kHz", **look
        )
        self.again = button("Read again", self.read)
        self.choice = Select(title="Recording", options=[], **look)
        self.choice.on_change("value", lambda _name, _old, new: self._show_one(new))
        self._build_figures()

    def _build_figures(self) -> None:
        self.waterfall = plain_figure(
            "", "frequency_hz", label="Spectra over the series", title="Spectra", height=320
        )
        self.waterfall.xaxis.axis_label = "recording"
        self._mapper = LinearColorMapper(
            palette=Viridis256, low=-5.0, high=LOUD, nan_color="#00000000"
        )
        self._water = ColumnDataSource({"image": [], "x": [], "y": [], "dw": [], "dh": []})
        self.waterfall.image(
            "image", "x", "y", "dw", "dh", source=self._water, color_mapper=self._mapper
        )
        self._edges = [
            Span(dimension="width", line_color="white", line_dash="dashed") for _ in range(2)
        ]
        for edge in self._edges:
            self.waterfall.add_layout(edge)
        self.waterfall.x_range, self.waterfall.y_range = Range1d(0, 1), Range1d(0, 1)
        self.track = plain_figure(
            "",
            "crf_hz",
            label="Contact resonance over the series",
            title="Contact resonance",
            height=320,
            tapped=True,
        )
        none: dict[str, Any] = {"x": [], "crf": [], "low": [], "high": [], "colour": []}
        self._line = ColumnDataSource(none)
        self.track.segment("x", "low", "x", "high", source=self._line, color=GREY)
        self.track.scatter("x", "crf", source=self._line, size=9, color="colour")
        self._split = Span(
            dimension="height", line_color=VERMILION, line_dash="dashed", visible=False
        )
        self.track.add_layout(self._split)
        self._line.selected.on_change("indices", lambda _name, _old, new: self._pick(new))
        self.one = plain_figure(
            "frequency_hz",
            "",
            label="Spectrum of a recording with the fitted resonance",
            title="Spectrum",
            y_axis_type="log",
        )
        self._density, self._curve = (ColumnDataSource({"f": [], "s": []}) for _ in range(2))
        self.one.line("f", "s", source=self._density, color=GREY)
        self.one.line("f", "s", source=self._curve, color=VERMILION, line_width=2)
        self._crf = Span(dimension="height", line_color=BLUE, line_dash="dashed", visible=False)
        self.one.add_layout(self._crf)

    # What is read
    # ---------------------------------------------------------------------------------

    def stated(self) -> Stated:
        """What was typed; BadInput for what cannot be meant."""
        rate = self.rate.value.strip()
        band = None
        if self.band.value.strip():
            parts = self.band.value.replace("–", "to").split("to")
            if len(parts) != 2:
                raise BadInput(
                    f'the band must be two frequencies such as "2 kHz to 5 kHz", got "{self.band.value}"'
                )
            low, high = (read_amount("the band", "Hz", part.strip()) for part in parts)
            band = (low, high)
        return Stated(
            rate_hz=read_amount("the sampling rate", "Hz", rate) if rate else None,
            unit=self.unit.value.strip() or None,
            channel=self.channel.value.strip() or None,
            band_hz=band,
        )

    def read(self) -> None:
        """Read the folder or the dropped files with what was typed."""
        self._forget()
        self.look()

    def look(self) -> None:
        """Look at the folder anew, or read what was dropped; a look that still runs is not disturbed."""
        if self._queue.busy or (self._folder is None and not self._dropped):
            return
        try:
            stated = self.stated()
        except BadInput as refusal:
            self._say(str(refusal))
            return
        if self._dropped:
            self._asked = len(self._dropped)
            self._tell(f"Reading {self._asked} of your recordings ...")
            self._queue.ask((hear_files, (tuple(self._dropped), stated, self._case)), self._read)
            return
        if self._memory is None:
            self._memory = TemporaryDirectory(prefix="asperity-page-")
            self._tell("Reading the folder ...")
        self._queue.ask(
            (hear_folder, (self._folder, Path(self._memory.name), stated, self._case)), self._read
        )

    @property
    def watches(self) -> bool:
        """Whether a folder is looked at again and again."""
        return self._folder is not None and not self._dropped

    def close(self) -> None:
        """Give back what the session took."""
        self._queue.close()
        self.drop.close()
        self._forget()
        self.heard = None

    def _forget(self) -> None:
        if self._memory is not None:
            self._memory.cleanup()
            self._memory = None

    def _came(self, path: Path) -> None:
        self._dropped.append(path)
        self.look()

    def _read(self, result: Any) -> None:
        if isinstance(result, Refused):
            self._say(result.sentence)
        elif result is None:
            self._tell("No recording has arrived yet; the folder is watched.")
        else:
            self.show(result)
        if len(self._dropped) > self._asked:
            self.look()  # more has come while these were read

    # What is shown
    # ---------------------------------------------------------------------------------

    def _say(self, sentence: str) -> None:
        self.status.text = sentences([f"{sentence.rstrip('.')}."], "alarm")

    def _tell(self, sentence: str) -> None:
        self.status.text = sentences([sentence], "soft")

    def show(self, heard: Heard) -> None:
        """Draw a series."""
        self.heard = heard
        self.verdict.text = sentences([heard.verdict], "alarm" if heard.alarm == "alarm" else "")
        self.notes.text = notes(heard.notes)
        self.table.text = _table(heard)
        self._draw_waterfall(heard)
        self._draw_track(heard)
        names = [f"{number}: {row['file']}" for number, row in enumerate(heard.rows, 1)]
        kept = self.choice.value if self.choice.value in names else names[-1]
        self.choice.update(options=names, value=kept)
        self._show_one(kept)
        waiting = f", {heard.waiting} wait" if heard.waiting else ""
        watched = "; the folder is watched" if self.watches else ""
        self._tell(
            f"{len(heard.rows)} recordings read{waiting}{watched}."
        )  # last: who hears it finds everything there

    def _draw_waterfall(self, heard: Heard) -> None:
        if not heard.levels.size:
            self._water.data = {"image": [], "x": [], "y": [], "dw": [], "dh": []}
            return
        count, (low, high) = len(heard.rows), heard.band_hz
        low_hz, high_hz = float(heard.frequency[0]), float(heard.frequency[-1])
        place = {"x": [0.5], "y": [low_hz], "dw": [count], "dh": [high_hz - low_hz]}
        self._water.data = {"image": [np.ascontiguousarray(heard.levels.T)], **place}
        self.waterfall.x_range.update(start=0.5, end=count + 0.5)
        self.waterfall.y_range.update(start=low_hz, end=min(high_hz, 1.6 * high))
        for edge, end in zip(self._edges, (low, high), strict=True):
            edge.location = end

    def _draw_track(self, heard: Heard) -> None:
        rows = [(number, row) for number, row in enumerate(heard.rows) if row["crf_hz"] is not None]
        x = [row["x"] for _, row in rows]
        crf = [row["crf_hz"] for _, row in rows]
        reach = [NORMAL_90 * (row["crf_std_hz"] or 0.0) for _, row in rows]
        self._line.data = {
            "x": x,
            "crf": crf,
            "low": [value - half for value, half in zip(crf, reach, strict=True)],
            "high": [value + half for value, half in zip(crf, reach, strict=True)],
            "colour": [VERMILION if row["label"] == "severe" else BLUE for _, row in rows],
        }
        self._numbers = [number for number, _ in rows]
        self.track.xaxis.axis_label = heard.x_name
        self._split.update(visible=heard.split is not None, location=heard.split or 0.0)

    def _pick(self, indices: list[int]) -> None:
        if indices and self.heard is not None and indices[0] < len(self._numbers):
            self.choice.value = self.choice.options[self._numbers[indices[0]]]

    def _show_one(self, name: str) -> None:
        """Draw the spectrum of one recording, or say why there is none."""
        heard = self.heard
        if heard is None or not name.partition(":")[0].isdigit():
            return
        number = int(name.partition(":")[0]) - 1
        row, ear = heard.rows[number], heard.ears[number]
        crf = quantity("crf_hz").text(row["crf_hz"], row["crf_std_hz"])
        self.one.title.text = (
            f"{row['file']}: CRF {crf}" if row["found"] else f"{row['file']}: {row['reason']}"
        )
        nothing: dict[str, Any] = {"f": [], "s": []}
        self._density.data = (
            nothing if ear is None else {"f": ear.frequency[1:], "s": ear.density[1:]}
        )
        fitted = ear is not None and ear.curve.size > 0
        self._curve.data = (
            {"f": ear.frequency, "s": ear.curve} if fitted and ear is not None else nothing
        )
        unit = "" if ear is None else ear.unit.replace("^2", "²")
        self.one.yaxis.axis_label = f"density [{unit}]" if unit else ""
        self._crf.update(visible=row["crf_hz"] is not None, location=row["crf_hz"] or 0.0)


def _table(heard: Heard) -> Markup:
    """Every recording with its numbers, or why it has none."""
    head = Markup("").join(Markup("<th>{}</th>").format(quantity(key).label) for key in SHOWN)
    rows = []
    for row in heard.rows:
        cells = Markup("").join(
            Markup("<td>{}</td>").format(quantity(key).number_in(row)) for key in SHOWN
        )
        said = row["remarks"] if row["found"] else row["reason"]
        rows.append(Markup("<tr><th>{}</th>{}<td>{}</td></tr>").format(row["file"], cells, said))
    body = Markup("").join(rows)
    return Markup(
        "<table><thead><tr><th>recording</th>{}<th></th></tr></thead><tbody>{}</tbody></table>"
    ).format(head, body)


def layout(view: RecordingsView) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The parts of the page by name, and the sections that they stand in."""
    parts = {
        "drop": view.drop,
        "rate": view.rate,
        "unit": view.unit,
        "channel": view.channel,
        "band": view.band,
        "again": view.again,
        "status": view.status,
        "verdict": view.verdict,
        "waterfall": view.waterfall,
        "track": view.track,
        "choice": view.choice,
        "one": view.one,
        "table": view.table,
        "notes": view.notes,
    }
    stated = [{"names": [name]} for name in ("drop", "rate", "unit", "channel", "band", "again")]
    shown = [
        {"names": ["status"], "live": True, "first": True},
        {"names": ["verdict"], "first": True},
        {"names": ["waterfall", "track"], "first": True},
        {"names": ["choice"]},
        {"names": ["one"]},
        {"names": ["table"], "heading": "Recordings"},
        {"names": ["notes"]},
    ]
    return parts, [
        {"kind": "knobs", "label": "What is stated of the recordings", "blocks": stated},
        {"kind": "shown", "label": "The series", "blocks": shown},
    ]
