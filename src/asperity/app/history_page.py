"""The page of a history, or of wear: maps that move with a slider over the steps or hours, and curves over time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from bokeh.models import Column, ColumnDataSource, Range1d, Slider, Span

from asperity.app.contact_jobs import Refused
from asperity.app.figures import BLUE, VERMILION, plain_figure, shown
from asperity.app.folder_jobs import Moved, open_history
from asperity.app.jobs import Queue, Workshop
from asperity.app.map_images import Pictures
from asperity.app.widgets import BAR, LOOK, button, notes, sentences, text_block
from asperity.core.quantities import quantity


class HistoryView:
    """One user's look at a history, with its widgets."""

    def __init__(
        self, folder: Path, workshop: Workshop, deliver: Callable[[Callable[[], None]], None]
    ) -> None:
        self._folder = folder
        self._queue = Queue(workshop, deliver)
        self.moved: Moved | None = None
        self.playing = False
        self.status, self.verdict, self.notes = (text_block() for _ in range(3))
        self.step = Slider(
            title="",
            start=0,
            end=1,
            step=1,
            value=0,
            bar_color=BAR,
            sizing_mode="stretch_width",
            show_value=False,
            stylesheets=[LOOK],
            margin=(0, 12, 6, 12),
            tags=["Step", "0"],
        )
        self.step.on_change("value", lambda _name, _old, new: self._show(int(new)))
        self.play = button("Play", self._toggle)
        self.pictures = Pictures()
        self.curves = Column(sizing_mode="stretch_width")
        self._now: list[Span] = []

    def begin(self) -> None:
        """Read the history."""
        self.status.text = sentences(["Reading the history ..."], "soft")
        self._queue.ask((open_history, (self._folder,)), self._read)

    def close(self) -> None:
        """Give back what the session took."""
        self._queue.close()
        self.moved = None

    def advance(self) -> None:
        """Go one kept step on while it plays, and from the last to the first."""
        if self.playing and self.moved is not None and self.moved.pictures:
            self.step.value = (int(self.step.value) + 1) % len(self.moved.pictures)

    def _toggle(self) -> None:
        self.playing = not self.playing
        self.play.label = "Stop" if self.playing else "Play"

    def _read(self, result: Any) -> None:
        if isinstance(result, Refused):
            self.status.text = sentences([result.sentence], "alarm")
            return
        moved: Moved = result
        self.moved = moved
        self.verdict.text, self.notes.text = sentences([moved.verdict]), notes(moved.notes)
        self._draw_curves(moved)
        if not moved.pictures:
            self.status.text = sentences(["No maps were kept of this history."], "soft")
            return
        self.step.update(start=0, end=max(1, len(moved.pictures) - 1))
        self._show(0)

    def _draw_curves(self, moved: Moved) -> None:
        clock = quantity(moved.clock)
        time = moved.time * clock.factor
        across = Range1d(float(time[0]), float(time[-1]) or 1.0)
        figures = []
        for key, values in moved.curves.items():
            made = plain_figure(
                "", key, label=f"{quantity(key).title} over time", height=170, x_range=across
            )
            made.line(
                "x", "y", source=ColumnDataSource({"x": time, "y": shown(key, values)}), color=BLUE
            )
            self._now.append(
                Span(dimension="height", line_color=VERMILION, line_dash="dashed", location=0.0)
            )
            made.add_layout(self._now[-1])
            figures.append(made)
        if figures:
            figures[-1].xaxis.axis_label = clock.axis
        self.curves.children = figures

    def _show(self, place: int) -> None:
        """Draw the maps of a kept step."""
        moved = self.moved
        if moved is None or not 0 <= place < len(moved.pictures):
            return
        clock = quantity(moved.clock)
        at = moved.times[place] * clock.factor
        told = f"{moved.names[place]}, {at:.4g} {clock.display}, map {place + 1} of {len(moved.pictures)}"
        self.step.tags = ["Step", moved.names[place]]
        self.pictures.make()
        self.pictures.show(moved.pictures[place])
        for mark in self._now:
            mark.location = at
        self.status.text = sentences([told], "soft")


def layout(view: HistoryView) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The parts of the page by name, and the sections that they stand in."""
    parts = {
        "step": view.step,
        "play": view.play,
        "status": view.status,
        "verdict": view.verdict,
        "film": view.pictures.film,
        "pressure": view.pictures.pressure,
        "cutpressure": view.pictures.cut_pressure,
        "cutfilm": view.pictures.cut_film,
        "curves": view.curves,
        "notes": view.notes,
    }
    key = (("touching", "asperity contact"), ("ruptured", "no pressure"), ("hertz", "Hertz zone"))
    shown_parts = [
        {"names": ["verdict"], "first": True},
        {"names": ["status"], "live": True, "first": True},
        {"names": ["film", "pressure"], "key": key, "first": True},
        {"names": ["cutpressure", "cutfilm"]},
        {"names": ["curves"], "heading": "Over time"},
        {"names": ["notes"]},
    ]
    return parts, [
        {
            "kind": "knobs",
            "label": "Steps",
            "blocks": [{"names": ["step"], "heading": "Steps"}, {"names": ["play"]}],
        },
        {"kind": "shown", "label": "The history", "blocks": shown_parts},
    ]
