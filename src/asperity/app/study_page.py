"""Page of a study: outputs over the swept quantities; a click on a point solves its contact."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from bokeh.models import Band, BasicTicker, ColumnDataSource, Select
from markupsafe import Markup

from asperity.app.contact_jobs import JobFailure
from asperity.app.contact_result import ContactResult
from asperity.app.figures import BLUE, VERMILION, plain_figure, to_display
from asperity.app.folder_jobs import StudyData, open_study, solve_row
from asperity.app.jobs import JobQueue, VisitPool
from asperity.app.map_images import MapImages
from asperity.app.settings import Settings
from asperity.app.widgets import (
    LOOK,
    MAP_KEY,
    TILE_STYLES,
    Layout,
    Look,
    PageBlock,
    StaleMark,
    notes,
    sentences,
    text_block,
    tiles,
)
from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.quantities import in_print, quantity
from asperity.study import as_written


class StudyView:
    """Study of one visitor with its widgets."""

    def __init__(
        self,
        folder: Path,
        case: Case,
        worker_pool: VisitPool,
        deliver: Callable[[Callable[[], None]], None],
    ) -> None:
        self._folder, self._case = folder, case
        self._queue = JobQueue(worker_pool, deliver)
        self.study: StudyData | None = None
        self._rows: list[int] = []
        self.status, self.verdict, self.notes, self.chosen, self.link = (
            text_block() for _ in range(5)
        )
        self.tiles = text_block(TILE_STYLES)
        self.stale_mark = StaleMark(self.chosen)
        self._solution: ContactResult | None = None
        self._create_choices()
        self._create_figure()
        self.maps = MapImages()

    def _create_choices(self) -> None:
        style: Look = {
            "sizing_mode": "stretch_width",
            "stylesheets": [LOOK],
            "margin": (0, 0, 6, 0),
        }
        self.x_choice = Select(title="Swept quantity", **style)
        self.y_choice = Select(title="Output", **style)
        self.point = Select(title="Contact of the study", **style)
        for choice in (self.x_choice, self.y_choice):
            choice.on_change("value", lambda _name, _old, _new: self._draw())
        self.point.on_change("value", lambda _name, _old, new: self._solve(new))

    def _create_figure(self) -> None:
        self.figure = plain_figure(
            "", "", label="Outputs of the study over a swept quantity", height=380, tapped=True
        )
        self._points = ColumnDataSource({"x": [], "y": []})
        self._means = ColumnDataSource({"x": [], "mean": [], "low": [], "high": []})
        self.figure.scatter("x", "y", source=self._points, size=9, color=BLUE, alpha=0.6)
        self.figure.line("x", "mean", source=self._means, color=VERMILION, line_width=2)
        fields = {"base": "x", "lower": "low", "upper": "high"}
        band = Band(**fields, source=self._means, fill_color=VERMILION, fill_alpha=0.18)
        self.figure.add_layout(band)
        self._points.selected.on_change("indices", lambda _name, _old, new: self._pick(new))

    def begin(self) -> None:
        """Start reading the study."""
        self.status.text = sentences(["Reading the study ..."], "soft")
        self._queue.submit((open_study, (self._folder,)), self._read)

    def close(self) -> None:
        """Release the resources of the visit."""
        self._queue.close()
        self.study = self._solution = None

    def _read(self, result: object) -> None:
        if isinstance(result, JobFailure):
            self.status.text = sentences([result.message], "alarm")
            return
        assert isinstance(result, StudyData)
        self.study = study = result
        self.verdict.text, self.notes.text = sentences([study.verdict]), notes(study.notes)
        self._rows = list(range(len(study.numbers)))
        labels = [
            (str(row), in_print(f"{study.numbers[row]}: {self._words(row)}")) for row in self._rows
        ]
        self.point.update(options=[("", "select"), *labels], value="")
        if study.axes and study.outputs:
            first = next(iter(study.outputs))
            self.x_choice.update(options=[axis.key for axis in study.axes], value=study.axes[0].key)
            self.y_choice.update(
                options=[(key, quantity(key).title) for key in study.outputs], value=first
            )
            self._draw()
        hint = (
            "Click a point to see its contact."
            if study.axes
            else "No swept quantity; select a contact below."
        )
        self.status.text = sentences([hint], "soft")

    def _draw(self) -> None:
        study = self.study
        if (
            study is None
            or self.x_choice.value not in study.values
            or self.y_choice.value not in study.outputs
        ):
            return
        axis = next(axis for axis in study.axes if axis.key == self.x_choice.value)
        entry = quantity(self.y_choice.value)
        column = study.outputs[entry.key]
        finite = np.flatnonzero(np.isfinite(column))
        self._rows = [int(row) for row in finite]
        self._points.selected.indices = []
        self._points.data = {
            "x": study.values[axis.key][finite],
            "y": to_display(entry.key, column[finite]),
        }
        self._draw_means(entry.key, *study.means[axis.key, entry.key])
        self.figure.xaxis.axis_label = (
            f"{axis.key} [{in_print(axis.unit)}]" if axis.unit else axis.key
        )
        self.figure.yaxis.axis_label = entry.axis
        ticks = dict(enumerate(axis.names))
        self.figure.xaxis.ticker = list(ticks) if ticks else BasicTicker()
        self.figure.xaxis.major_label_overrides = ticks

    def _draw_means(self, key: str, x: Field, mean: Field, low: Field, high: Field) -> None:
        """Draw means with their intervals, of zero width where unknown."""
        lows, highs = (np.where(np.isfinite(limits), limits, mean) for limits in (low, high))
        parts = {"mean": mean, "low": lows, "high": highs}
        displayed = {name: to_display(key, values) for name, values in parts.items()}
        self._means.data = {"x": x, **displayed}

    def _pick(self, indices: list[int]) -> None:
        if indices and indices[0] < len(self._rows):
            self.point.value = str(self._rows[indices[0]])

    def _solve(self, row: str) -> None:
        study = self.study
        if study is None or not row.isdigit():
            return
        number = int(row)
        self._mark(stale=True)
        self.link.text = ""  # belongs to the previous point
        self.chosen.text = sentences([f"Solving {self._words(number)} ..."], "soft")
        self._queue.submit(
            (solve_row, (self._folder, study.numbers[number])),
            lambda result: self._solved(result, number),
        )

    def _solved(self, result: object, row: int) -> None:
        if isinstance(result, JobFailure):
            self.chosen.text = sentences([result.message], "alarm")
            return
        assert isinstance(result, ContactResult)
        self._solution = result
        self._mark(stale=False)
        self.maps.make()
        self.maps.show(result)
        link = Markup('<p><a href="contact?{}">Open with its inputs</a></p>')
        self.link.text = link.format(self._address(row))
        self.chosen.text = sentences(
            [f"{self._words(row)}: {result.verdict}"]
        )  # last: a screen reader announces it when the page is complete

    def _mark(self, *, stale: bool) -> None:
        """Mark numbers and maps as those of the selected point, or of the previous one."""
        if self._solution is not None:
            self.tiles.text = tiles(self._solution.tiles, self._solution, None, stale=stale)
            self.stale_mark.show(stale)

    def _address(self, row: int) -> str:
        """Return the address of the contact page with the settings of a row."""
        assert self.study is not None
        settings = Settings(self._case)
        for key, value in self.study.changed[row].items():
            pair = [f"{key}.0", f"{key}.1"] if isinstance(value, list) else [key]
            for name, text in zip(
                pair, value if isinstance(value, list) else [value], strict=False
            ):
                if name in settings.inputs and isinstance(
                    changed := settings.with_value(name, str(text)), Settings
                ):
                    settings = changed
        return settings.address

    def _words(self, row: int) -> str:
        """Describe the overrides of a row's case."""
        changed = {} if self.study is None else self.study.changed[row]
        return (
            ", ".join(f"{key} {as_written(value)}" for key, value in changed.items())
            or "common case"
        )


def layout(view: StudyView) -> Layout:
    """Return the parts of the page by name, and the sections that contain them."""
    parts = {
        "xchoice": view.x_choice,
        "ychoice": view.y_choice,
        "point": view.point,
        "status": view.status,
        "verdict": view.verdict,
        "curve": view.figure,
        "chosen": view.chosen,
        "link": view.link,
        "tiles": view.tiles,
        "film": view.maps.film,
        "pressure": view.maps.pressure,
        "cutpressure": view.maps.cut_pressure,
        "cutfilm": view.maps.cut_film,
        "notes": view.notes,
    }
    choices: list[PageBlock] = [{"names": [name]} for name in ("xchoice", "ychoice", "point")]
    results: list[PageBlock] = [
        {"names": ["verdict"], "first": True},
        {"names": ["status"], "live": True, "first": True},
        {"names": ["curve"], "first": True},
        {"names": ["chosen"], "live": True},
        {"names": ["link"]},
        {"names": ["tiles"]},
        {"names": ["film", "pressure"], "key": MAP_KEY},
        {"names": ["cutpressure", "cutfilm"]},
        {"names": ["notes"]},
    ]
    return parts, [
        {"kind": "inputs", "label": "Selection", "blocks": choices},
        {"kind": "results", "label": "Study", "blocks": results},
    ]
