"""Stribeck curve of the contact, solved point by point while the page is idle."""

from collections.abc import Callable

import numpy as np
from bokeh.models import ColumnDataSource

from asperity.app.contact_jobs import JobFailure, solve_at_speed
from asperity.app.contact_result import ContactResult
from asperity.app.figures import BLUE, TRIALS_HEIGHT, VERMILION, Plot, plain_figure, to_display
from asperity.app.jobs import JobQueue
from asperity.case import Case
from asperity.results import FrictionPoint

SPEED_RANGE, POINTS = 10.0, 9  # range up and down from the speed of the case; number of points
SPEED = "contact.entrainment_speed"


class SpeedCurve:
    """Friction over entrainment speed, with the working point.

    Parameters
    ----------
    queue : runs one point at a time
    may_solve : tells that nothing else waits for a worker
    """

    def __init__(self, queue: JobQueue, may_solve: Callable[[], bool]) -> None:
        self._queue, self._may_solve = queue, may_solve
        self._case: Case | None = None
        self._contact = ""  # text of the case at a common speed
        self._remaining: list[float] = []
        self.points: list[FrictionPoint] = []
        self._line = ColumnDataSource({"u": [], "mu": [], "low": [], "high": []})
        self._now = ColumnDataSource({"u": [], "mu": []})
        self.figure: Plot | None = None

    def create(self) -> Plot:
        """Create the figure."""
        self.figure = plain_figure(
            "entrainment_speed_m_s",
            "friction_coefficient",
            label="Stribeck curve with the working point",
            title="Stribeck curve",
            x_axis_type="log",
            height=TRIALS_HEIGHT,
        )
        self.figure.segment("u", "low", "u", "high", source=self._line, color=BLUE, alpha=0.5)
        self.figure.line("u", "mu", source=self._line, color=BLUE, line_width=2)
        self.figure.scatter("u", "mu", source=self._line, color=BLUE, size=6)
        self.figure.scatter(
            "u", "mu", source=self._now, color=VERMILION, size=11, line_color="white"
        )
        self._draw()
        return self.figure

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
            if conditions.sliding_speed and conditions.entrainment_speed:
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
        if self.figure is not None:
            self.figure.title.text = self._title()

    def _title(self) -> str:
        if not self.points and not self._remaining:
            return "No Stribeck curve: nothing slides"
        if self._remaining:
            total = len(self.points) + len(self._remaining)
            return f"Stribeck curve, {len(self.points)} of {total} points"
        return "Stribeck curve"
