"""Uncertainty of a contact's numbers: 90 % intervals by source, and their combination.

This module defines the sources and how they combine; other modules determine their values.
"""

import math
from dataclasses import dataclass
from typing import TypeAlias

Sides: TypeAlias = tuple[float, float]  # error below and above a value
NONE: Sides = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Uncertainty:
    """A number, and its error below and above it by each source.

    Parameters
    ----------
    value : best estimate, mean over the solved surfaces
    iteration : from Newton's last step; None where undetermined
    grid : from the cell size; None where undetermined, as on a grid too small to have a coarser one
    surfaces : from surface to surface of one kind, of a running contact from the finite time and
        number of tracks; None where the result is about one surface
    record : from the length of one record; NONE for a number that needs no record
    oil : from an estimated pressure-viscosity coefficient; None where undetermined, NONE for one
        that is stated
    range : bounds of the number
    """

    value: float
    iteration: Sides | None
    grid: Sides | None
    surfaces: Sides | None = None
    record: Sides | None = NONE
    oil: Sides | None = NONE
    range: tuple[float, float] = (-math.inf, math.inf)

    @property
    def numerical(self) -> Sides | None:
        """Sum of iteration and grid error."""
        if self.iteration is None or self.grid is None:
            return None
        return self.iteration[0] + self.grid[0], self.iteration[1] + self.grid[1]

    @property
    def interval(self) -> tuple[float, float] | None:
        """Total interval within the range; None if a part is unknown.

        Independent parts add in quadrature.
        """
        if self.numerical is None or self.record is None or self.oil is None:
            return None
        sides = (self.numerical, self.surfaces or NONE, self.record, self.oil)
        below, above = (math.hypot(*parts) for parts in zip(*sides, strict=True))
        least, most = self.range
        return min(max(self.value - below, least), self.value), max(
            min(self.value + above, most), self.value
        )

    @property
    def halves(self) -> dict[str, float | None]:
        """Half-width of each part, mean of both sides; None where unknown."""
        parts = {"numerical": self.numerical, "surfaces": self.surfaces, "record": self.record}
        return {
            name: None if sides is None else 0.5 * (sides[0] + sides[1])
            for name, sides in parts.items()
        }

    @property
    def low(self) -> float | None:
        """Lower end of the interval."""
        return None if self.interval is None else self.interval[0]

    @property
    def high(self) -> float | None:
        """Upper end of the interval."""
        return None if self.interval is None else self.interval[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactError:
    """Uncertainty of a contact's load share and resonance.

    `clr` of the load share, `crf_hz` of the contact resonance (None where not sought or not found);
    `surfaces` the number of solved surfaces, or of tracks of a `running` contact. `choices` names
    assumptions not covered by the interval.
    """

    clr: Uncertainty
    crf_hz: Uncertainty | None = None
    surfaces: int = 1
    choices: tuple[str, ...] = ()
    running: bool = False
