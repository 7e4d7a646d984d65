"""The page of a study: curves with their scatter over what was swept; a point that is clicked becomes its contact."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from bokeh.models import Band, BasicTicker, ColumnDataSource, Select
from markupsafe import Markup

from asperity.app.contact_jobs import Refused
from asperity.app.contact_result import Answer
from asperity.app.figures import BLUE, VERMILION, plain_figure, shown
from asperity.app.folder_jobs import Swept, open_study, solve_row
from asperity.app.jobs import Queue, Workshop
from asperity.app.map_images import Pictures
from asperity.app.settings import Settings
from asperity.app.widgets import (
    LOOK,
    MAP_KEY,
    TILE_STYLES,
    OldMark,
    notes,
    sentences,
    text_block,
    tiles,
)
from asperity.case import Case
from asperity.core.quantities import in_print, quantity
from asperity.study import as_written


class StudyView:
    """One user's look at a study, with its widgets."""

    def __init__(
        self,
        folder: Path,
        case: Case,
        workshop: Workshop,
        deliver: Callable[[Callable[[], None]], None],
    ) -> None:
        self._folder, self._case = folder, case
        self._queue = Queue(workshop, deliver)
        self.swept: Swept | None = None
        self._rows: list[int] = []
        self.status, self.verdict, self.notes, self.chosen, self.way = (
            text_block() for _ in range(5)
        )
        self.tiles = text_block(TILE_STYLES)
        self.old = OldMark(self.chosen)
        self._answer: Answer | None = None
        look: dict[str, Any] = {
            "sizing_mode": "stretch_width",
            "stylesheets": [LOOK],
            "margin": (0, 0, 6, 0),
        }
        self.across, self.up = Select(title="Over", **look), Select(title="Of the contact", **look)
        self.point = Select(title="A contact of the study", **look)
        for choice in (self.across, self.up):
            choice.on_change("value", lambda _name, _old, _new: self._draw())
        self.point.on_change("value", lambda _name, _old, new: self._solve(new))
        self.figure = plain_figure(
            "", "", label="A study's results over what was swept", height=380, tapped=True
        )
        self._points = ColumnDataSource({"x": [], "y": []})
        self._means = ColumnDataSource({"x": [], "mean": [], "low": [], "high": []})
        self.figure.scatter("x", "y", source=self._points, size=9, color=BLUE, alpha=0.6)
        self.figure.line("x", "mean", source=self._means, color=VERMILION, line_width=2)
        band = Band(
            base="x",
            lower="low",
            upper="high",
            source=self._means,
            fill_color=VERMILION,
            fill_alpha=0.18,
        )
        self.figure.add_layout(band)
        self._points.selected.on_change("indices", lambda _name, _old, new: self._pick(new))
        self.pictures = Pictures()

    def begin(self) -> None:
        """Read the study."""
        self.status.text = sentences(["Reading the study ..."], "soft")
        self._queue.ask((open_study, (self._folder,)), self._read)

    def close(self) -> None:
        """Give back what the session took."""
        self._queue.close()
        self.swept = self._answer = None

    def _read(self, result: Any) -> None:
        if isinstance(result, Refused):
            self.status.text = sentences([result.sentence], "alarm")
            return
        swept: Swept = result
        self.swept = swept
        self.verdict.text, self.notes.text = sentences([swept.verdict]), notes(swept.notes)
        self._rows = list(range(len(swept.numbers)))
        labels = [
            (str(row), in_print(f"{swept.numbers[row]}: {self._words(row)}")) for row in self._rows
        ]
        self.point.update(options=[("", "choose one"), *labels], value="")
        if swept.axes and swept.outputs:
            first = next(iter(swept.outputs))
            self.across.update(options=[axis.key for axis in swept.axes], value=swept.axes[0].key)
            self.up.update(
                options=[(key, quantity(key).title) for key in swept.outputs], value=first
            )
            self._draw()
        told = (
            "Click a point to see its contact."
            if swept.axes
            else "Nothing was swept; choose a contact below."
        )
        self.status.text = sentences([told], "soft")

    def _draw(self) -> None:
        swept = self.swept
        if (
            swept is None
            or self.across.value not in swept.values
            or self.up.value not in swept.outputs
        ):
            return
        axis = next(axis for axis in swept.axes if axis.key == self.across.value)
        entry = quantity(self.up.value)
        column = swept.outputs[entry.key]
        known = np.flatnonzero(np.isfinite(column))
        self._rows = [int(row) for row in known]
        self._points.selected.indices = []
        self._points.data = {
            "x": swept.values[axis.key][known],
            "y": shown(entry.key, column[known]),
        }
        x, mean, low, high = swept.means[axis.key, entry.key]
        lows, highs = (np.where(np.isfinite(ends), ends, mean) for ends in (low, high))
        parts: Mapping[str, Any] = {"mean": mean, "low": lows, "high": highs}
        self._means.data = {
            "x": x,
            **{name: shown(entry.key, values) for name, values in parts.items()},
        }
        self.figure.xaxis.axis_label = (
            f"{axis.key} [{in_print(axis.unit)}]" if axis.unit else axis.key
        )
        self.figure.yaxis.axis_label = entry.axis
        ticks = dict(enumerate(axis.names))
        self.figure.xaxis.ticker = list(ticks) if ticks else BasicTicker()
        self.figure.xaxis.major_label_overrides = ticks

    def _pick(self, indices: list[int]) -> None:
        if indices and indices[0] < len(self._rows):
            self.point.value = str(self._rows[indices[0]])

    def _solve(self, row: str) -> None:
        swept = self.swept
        if swept is None or not row.isdigit():
            return
        number = int(row)
        self._mark(old=True)
        self.way.text = ""  # leads to the point before
        self.chosen.text = sentences([f"Solving {self._words(number)} ..."], "soft")
        self._queue.ask(
            (solve_row, (self._folder, swept.numbers[number])),
            lambda result: self._solved(result, number),
        )

    def _solved(self, result: Any, row: int) -> None:
        if isinstance(result, Refused) or self.swept is None:
            self.chosen.text = sentences([result.sentence], "alarm")
            return
        self._answer = result
        self._mark(old=False)
        self.pictures.make()
        self.pictures.show(result)
        link = Markup('<p><a href="contact?{}">Turn its knobs</a></p>')
        self.way.text = link.format(self._address(row))
        self.chosen.text = sentences(
            [f"{self._words(row)}: {result.verdict}"]
        )  # last: all is there when it says so

    def _mark(self, *, old: bool) -> None:
        """Show the contact's numbers and pictures as those of the chosen point, or of the one before."""
        if self._answer is not None:
            self.tiles.text = tiles(self._answer.tiles, self._answer, None, old=old)
            self.old.show(old)

    def _address(self, row: int) -> str:
        """A row's settings as an address of the contact's page; what is no knob there stays as the study has it."""
        assert self.swept is not None
        settings = Settings(self._case)
        for key, value in self.swept.changed[row].items():
            pair = [f"{key}.0", f"{key}.1"] if isinstance(value, list) else [key]
            for name, text in zip(
                pair, value if isinstance(value, list) else [value], strict=False
            ):
                if name in settings.knobs and isinstance(
                    turned := settings.turned(name, str(text)), Settings
                ):
                    settings = turned
        return settings.address

    def _words(self, row: int) -> str:
        """What a row's case differs in."""
        changed = {} if self.swept is None else self.swept.changed[row]
        return (
            ", ".join(f"{key} {as_written(value)}" for key, value in changed.items()) or "its case"
        )


def layout(view: StudyView) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The parts of the page by name, and the sections that they stand in."""
    parts = {
        "across": view.across,
        "up": view.up,
        "point": view.point,
        "status": view.status,
        "verdict": view.verdict,
        "curve": view.figure,
        "chosen": view.chosen,
        "way": view.way,
        "tiles": view.tiles,
        "film": view.pictures.film,
        "pressure": view.pictures.pressure,
        "cutpressure": view.pictures.cut_pressure,
        "cutfilm": view.pictures.cut_film,
        "notes": view.notes,
    }
    choices = [{"names": [name]} for name in ("across", "up", "point")]
    shown_parts = [
        {"names": ["verdict"], "first": True},
        {"names": ["status"], "live": True, "first": True},
        {"names": ["curve"], "first": True},
        {"names": ["chosen"], "live": True},
        {"names": ["way"]},
        {"names": ["tiles"]},
        {"names": ["film", "pressure"], "key": MAP_KEY},
        {"names": ["cutpressure", "cutfilm"]},
        {"names": ["notes"]},
    ]
    return parts, [
        {"kind": "knobs", "label": "What is shown of the study", "blocks": choices},
        {"kind": "shown", "label": "The study", "blocks": shown_parts},
    ]
