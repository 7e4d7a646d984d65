"""Cycles of load, speeds and radius of a contact, such as a cam's revolution or a tooth's passage.

Between the rows of its table everything varies linearly. x points in the direction of entrainment:
where the entrainment speed changes its sign, the contact is seen from the other side.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput

MAX_ROWS = 100_000
SAME = 1e-9  # relative difference between the ends of a cycle that repeats


class CycleState(NamedTuple):
    """Contact at one time of a cycle: `load` [N], `speeds` of both surfaces [m/s], `radius` [m].

    The radius is that along rolling; `carried` is the load that energy and wear count [N].
    """

    time: float
    load: float
    speeds: tuple[float, float]
    radius: float
    carried: float

    @property
    def entrainment_speed(self) -> float:
        """Mean of the surface speeds [m/s], with sign."""
        return 0.5 * (self.speeds[0] + self.speeds[1])

    @property
    def sliding_speed(self) -> float:
        """Difference of the surface speeds [m/s], with sign."""
        return self.speeds[0] - self.speeds[1]


@dataclass(frozen=True, eq=False)
class OperatingCycle:
    """Load, surface speeds and radius of a contact over time.

    Parameters
    ----------
    times : from 0, increasing [s], (n,)
    loads : normal load on the whole contact [N], (n,)
    speeds : of both surfaces along x [m/s], (n, 2), with sign
    radii : effective radius along rolling [m], (n,)
    positions : where in a machine's cycle the contact is, (n,), such as an angle [rad]
    place : key of the quantity of the positions
    continuous : the cycle may follow itself; False for a passage that begins without contact
    carried : load that energy and wear count [N], (n,), where the contact is solved for the line
        load of its most loaded slice; default: the loads

    Raises
    ------
    BadInput
        for fewer than two rows, arrays of other lengths, times that do not increase from 0, loads
        or radii that are not positive, or surfaces that never move.

    Examples
    --------
    >>> from asperity.contact.cycle import OperatingCycle
    >>> stop = OperatingCycle(
    ...     times=[0.0, 0.1],
    ...     loads=[50.0, 50.0],
    ...     speeds=[(1.0, 1.0), (0.0, 0.0)],
    ...     radii=[0.01, 0.01],
    ... )
    >>> stop.state(0.05).entrainment_speed
    0.5
    """

    times: Sequence[float] | Field
    loads: Sequence[float] | Field
    speeds: Sequence[tuple[float, float]] | Field
    radii: Sequence[float] | Field
    positions: Sequence[float] | Field | None = None
    place: str = ""
    continuous: bool = True
    carried: Sequence[float] | Field | None = None

    def __post_init__(self) -> None:
        if self.carried is None:
            object.__setattr__(self, "carried", self.loads)
        for name in ("times", "loads", "speeds", "radii", "carried"):
            object.__setattr__(
                self,
                name,
                np.asarray(getattr(self, name), float),
            )
        rows = len(self._times)
        if not 2 <= rows <= MAX_ROWS:
            raise BadInput(f"a cycle has 2 to {MAX_ROWS} rows, got {rows}; correct its table")
        self._require_columns(rows)
        if not np.all(np.isfinite(self._times)):
            raise BadInput("the times of a cycle must be finite; correct its table")
        if self._times[0] != 0.0 or not np.all(np.diff(self._times) > 0.0):
            raise BadInput("the times of a cycle must increase from 0; sort its table")
        self._require_positive("load", self._loads, "N")
        self._require_positive("radius", self._radii, "m")
        if not np.all(np.isfinite(self._speeds)):
            raise BadInput("the speeds of a cycle must be finite; correct its table")

    def _require_columns(self, rows: int) -> None:
        """Raise BadInput for columns of another length."""
        shapes = [self._loads.shape, self._radii.shape, self._speeds.shape]
        if shapes != [(rows,), (rows,), (rows, 2)]:
            raise BadInput(
                f"a cycle of {rows} times needs as many loads, pairs of speeds and radii, got "
                f"{[shape[0] for shape in shapes]}; complete its table"
            )
        placed = np.zeros(rows) if self.positions is None else np.asarray(self.positions, float)
        if placed.shape != (rows,) or self._carried.shape != (rows,):
            raise BadInput(
                f"a cycle of {rows} times needs as many positions and carried loads, got "
                f"{placed.size} and {self._carried.size}; complete them"
            )

    def _require_positive(self, name: str, values: Field, unit: str) -> None:
        """Raise BadInput for a column with a value that is not positive and finite."""
        wrong = np.flatnonzero(~((values > 0.0) & np.isfinite(values)))
        if wrong.size:
            row = wrong[0]
            raise BadInput(
                f"the {name} of a cycle must be positive, got {values[row]:g} {unit} at "
                f"{self._times[row]:g} s; leave out the part without contact"
            )

    @property
    def _times(self) -> Field:
        return np.asarray(self.times)

    @property
    def _loads(self) -> Field:
        return np.asarray(self.loads)

    @property
    def _speeds(self) -> Field:
        return np.asarray(self.speeds)

    @property
    def _carried(self) -> Field:
        return np.asarray(self.carried)

    @property
    def _radii(self) -> Field:
        return np.asarray(self.radii)

    def position(self, time: float) -> float | None:
        """Return where in the machine's cycle the contact is at a time [s], if that is known."""
        if self.positions is None:
            return None
        return float(
            np.interp(
                time,
                self._times,
                np.asarray(self.positions, float),
            )
        )

    @property
    def period(self) -> float:
        """Duration [s]."""
        return float(self._times[-1])

    @cached_property
    def repeats(self) -> bool:
        """True if the cycle can follow itself: continuous, and its last row equals the first."""
        columns = (self._loads, self._radii, *self._speeds.T)
        return self.continuous and all(
            abs(column[-1] - column[0]) <= SAME * np.max(np.abs(column)) for column in columns
        )

    @property
    def reverses(self) -> bool:
        """True if oil enters from both sides in turn."""
        means = self._speeds.mean(axis=1)
        return bool(np.min(means) < 0.0 < np.max(means))

    def state(self, time: float) -> CycleState:
        """Return the contact at a time [s]; outside a cycle that does not repeat, that of its end.

        A cycle that repeats goes on.
        """
        within = time
        if self.repeats and not 0.0 <= time <= self.period:
            within = time % self.period
        load, first, second, radius, carried = (
            float(np.interp(within, self._times, column))
            for column in (self._loads, *self._speeds.T, self._radii, self._carried)
        )
        return CycleState(time, load, (first, second), radius, carried)

    def columns(self, times: Field) -> tuple[Field, Field, Field]:
        """Return entrainment and sliding speed [m/s], with sign, and carried load [N], (n,)."""
        first, second, carried = (
            np.interp(
                times,
                self._times,
                column,
            )
            for column in (*self._speeds.T, self._carried)
        )
        return 0.5 * (first + second), first - second, carried

    def travelled(self, time: float) -> tuple[float, float]:
        """Return the distances by which both surfaces have moved since time 0 [m], with sign.

        Outside a cycle that does not repeat, the speeds are those of its ends.
        """
        turns, rest = divmod(time, self.period) if self.repeats else (0.0, time)
        within = min(max(rest, 0.0), self.period)
        row = int(np.searchsorted(self._times, within, side="right")) - 1
        row = min(max(row, 0), len(self._times) - 2)
        speeds = np.array(self.state(within).speeds)
        part = 0.5 * (self._speeds[row] + speeds) * (within - self._times[row])
        first, second = (
            turns * self._distances[-1] + self._distances[row] + part + speeds * (rest - within)
        )
        return float(first), float(second)

    @cached_property
    def _distances(self) -> Field:
        steps = 0.5 * (self._speeds[1:] + self._speeds[:-1]) * np.diff(self._times)[:, None]
        return np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def conditions(self, time: float, contact: ContactConditions) -> ContactConditions:
        """Return the conditions of a contact at a time [s], x in the direction of entrainment.

        Parameters
        ----------
        time : [s]
        contact : its bodies and geometry; of an elliptic contact, the radius across is kept
        """
        instant = self.state(time)
        side = -1.0 if instant.entrainment_speed < 0.0 else 1.0
        first, second = instant.speeds
        return conditions_of(instant, contact, (side * first, side * second))

    def even_times(self, steps: int) -> Field:
        """Return the times of some steps between which the conditions change about equally.

        Load and radius count by their roots, as Hertz pressure does, and speeds by themselves, each
        as a share of the largest; time counts as its share of the cycle.
        """
        top = max(float(np.max(np.abs(self._speeds))), np.finfo(float).tiny)
        change = np.diff(self._times) / self.period
        roots = (np.sqrt(column / column.max()) for column in (self._loads, self._radii))
        for column in (*roots, *(self._speeds.T / top)):
            change = change + np.abs(np.diff(column))
        passed = np.concatenate([[0.0], np.cumsum(change)])
        times = np.interp(
            np.linspace(0.0, passed[-1], steps + 1),
            passed,
            self._times,
        )
        times[0], times[-1] = 0.0, self.period
        return times


def conditions_of(
    instant: CycleState, contact: ContactConditions, speeds: tuple[float, float]
) -> ContactConditions:
    """Return the conditions of a contact at an instant, with other surface speeds [m/s]."""
    radius = contact.radius
    return replace(
        contact,
        load=instant.load,
        radius=(instant.radius, radius[1]) if isinstance(radius, tuple) else instant.radius,
        surface_speeds=speeds,
    )
