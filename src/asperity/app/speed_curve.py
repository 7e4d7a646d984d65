"""Stribeck curve of the contact, solved point by point while the page is idle."""

from collections.abc import Callable

import numpy as np
from bokeh.models import ColumnDataSource, Range1d

from asperity.app.contact_jobs import JobFailure, solve_at_speed
from asperity.app.contact_result import ContactResult
from asperity.app.figures import BLUE, TRIALS_HEIGHT, VERMILION, Plot, plain_figure, to_display
from asperity.app.jobs import JobQueue
from asperity.app.map_images import placeholder
from asperity.app.widgets import sentences, text_block
from asperity.case import Case
from asperity.results import FrictionPoint

SPEED_RANGE, POINTS = 10.0, 9  # range up and down from the speed of the case; number of points
SPEED = "contact.entrainment_speed"
MARGIN = 1.15  # of the axes beyond the values


class SpeedCurve:
    """Friction over entrainment speed, with the working point.

    Parameters
    ----------
    queue : runs one point at a time
    may_solve : returns True if no other job waits for a worker
    """

    def __init__(self, queue: JobQueue, may_solve: Callable[[], bool]) -> None:
        self._queue, self._may_solve = queue, may_solve
        self._case: Case | None = None
        self._contact = ""  # text of the case at a common speed
        self._slides = False
        self._remaining: list[float] = []
        self.points: list[FrictionPoint] = []
        self._line = ColumnDataSource({"u": [], "mu": [], "low": [], "high": []})
        self._now = ColumnDataSource({"u": [], "mu": []})
        self.figure: Plot | None = None
        self.model = placeholder(TRIALS_HEIGHT)
        self._sentence = text_block()  # in place of the figure

    def create(self) -> None:
        """Create the figure."""
        self.figure = plain_figure(
            "entrainment_speed_m_s",
            "friction_coefficient",
            label="Stribeck curve with the working point",
            title="Stribeck curve",
            x_axis_type="log",
            height=TRIALS_HEIGHT,
            x_range=Range1d(0.1, 10.0),
            y_range=Range1d(0.0, 0.1),
        )
        self.figure.segment("u", "low", "u", "high", source=self._line, color=BLUE, alpha=0.5)
        self.figure.line("u", "mu", source=self._line, color=BLUE, line_width=2)
        self.figure.scatter("u", "mu", source=self._line, color=BLUE, size=6)
        self.figure.scatter(
            "u", "mu", source=self._now, color=VERMILION, size=11, line_color="white"
        )
        self.model.children = [self._sentence, self.figure]
        self._draw()

    def pause(self) -> None:
        """Stop solving, because the contact is being changed."""
        self._queue.cancel()

    def close(self) -> None:
        """Release the queue."""
        self._queue.close()

    def follow(self, case: Case, result: ContactResult) -> None:
        """Show the working point of a solved contact and continue its curve."""
        conditions = case.conditions
        contact = case.with_written({SPEED: "1 m/s"}).text
        if contact != self._contact:
            self._case, self._contact, self.points = case, contact, []
            self._remaining = []
            self._slides = bool(conditions.sliding_speed and conditions.entrainment_speed)
            if self._slides:
                factors = np.geomspace(1.0 / SPEED_RANGE, SPEED_RANGE, POINTS)
                ordered = sorted(factors, key=lambda factor: abs(np.log(factor)))
                self._remaining = [float(f) * conditions.entrainment_speed for f in ordered]
        friction = result.row.get("friction_coefficient")
        self._now.data = {
            "u": [] if friction is None else [conditions.entrainment_speed],
            "mu": [] if friction is None else [friction],
        }
        self._draw()
        self._next()

    def _next(self) -> None:
        if not self._remaining or self._queue.busy or not self._may_solve():
            return
        speed = self._remaining[0]
        assert self._case is not None
        self._queue.submit(
            (solve_at_speed, (self._case, speed)), lambda result: self._receive(result, speed)
        )

    def _receive(self, result: object, speed: float) -> None:
        """Add a point; one that failed is left out."""
        if self._remaining[:1] == [speed]:
            self._remaining.pop(0)
        if not isinstance(result, JobFailure):
            assert isinstance(result, FrictionPoint)
            if result.converged:
                self.points.append(result)
        self._draw()
        self._next()

    def _draw(self) -> None:
        points = sorted(self.points, key=lambda point: point.entrainment_speed_m_s)
        friction = [point.friction_coefficient for point in points]
        low, high = (
            [getattr(point, end) or point.friction_coefficient for point in points]
            for end in ("friction_coefficient_low", "friction_coefficient_high")
        )
        columns = {"mu": friction, "low": low, "high": high}
        self._line.data = {
            "u": [point.entrainment_speed_m_s for point in points],
            **{
                name: to_display("friction_coefficient", values) for name, values in columns.items()
            },
        }
        if self.figure is None:
            return
        speeds, values = self._extremes(low, high)
        drawn = self._slides and bool(values)
        if drawn:
            _set_range(self.figure.x_range, min(speeds) / MARGIN, max(speeds) * MARGIN)
            _set_range(self.figure.y_range, MARGIN * min(0.0, *values), MARGIN * max(*values, 1e-3))
        self.figure.title.text = self._title()
        self._sentence.text = sentences([self._title()], "soft")
        self._sentence.visible, self.figure.visible = not drawn, drawn
        self.model.min_height = TRIALS_HEIGHT if drawn else 0

    def _extremes(self, low: list[float], high: list[float]) -> tuple[list[float], list[float]]:
        """Return the speeds and the friction coefficients that the axes hold."""
        speeds = [point.entrainment_speed_m_s for point in self.points]
        return [*speeds, *self._remaining, *self._now.data["u"]], [
            *low,
            *high,
            *self._now.data["mu"],
        ]

    def _title(self) -> str:
        if self._case is None:
            return "The Stribeck curve follows when the contact is solved."
        if not self._slides:
            return "No Stribeck curve: nothing slides."
        if self._remaining:
            total = len(self.points) + len(self._remaining)
            return f"Stribeck curve, {len(self.points)} of {total} points"
        if not self.points:
            return "No Stribeck curve: no speed has a friction coefficient."
        return "Stribeck curve"


def _set_range(axis: Range1d, start: float, end: float) -> None:
    axis.update(start=start, end=end, reset_start=start, reset_end=end)
