"""How far a number of a contact may be off: 90 % intervals by where the doubt comes from, and all of it together.

Says what the parts are and how they add up; what each amounts to is worked out where it is known.
"""

import math
from dataclasses import dataclass
from typing import TypeAlias

Sides: TypeAlias = tuple[float, float]  # how far a value may lie below and above
NONE: Sides = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Uncertainty:
    """A number, and how far it may lie below and above by each source of doubt, each at 90 %.

    Parameters
    ----------
    value : the best estimate, mean over the surfaces that were solved
    iteration : from Newton's last step; None where it is not determined
    grid : from the cells' size; None where it is not determined, as on a grid too small to have a coarser one
    surfaces : from one surface to another of its kind; None where one was solved, and all is about that one
    record : from the length of one record; of a number that no record is needed for, none
    range : what the number cannot leave
    """

    value: float
    iteration: Sides | None
    grid: Sides | None
    surfaces: Sides | None = None
    record: Sides | None = NONE
    range: tuple[float, float] = (-math.inf, math.inf)

    @property
    def numerical(self) -> Sides | None:
        """Iteration and grid together: errors that add up."""
        if self.iteration is None or self.grid is None:
            return None
        return self.iteration[0] + self.grid[0], self.iteration[1] + self.grid[1]

    @property
    def interval(self) -> tuple[float, float] | None:
        """The whole 90 % interval: independent parts by their squares, within the range; None if one is unknown."""
        if self.numerical is None or self.record is None:
            return None
        below, above = (
            math.hypot(*parts)
            for parts in zip(self.numerical, self.surfaces or NONE, self.record, strict=True)
        )
        least, most = self.range
        return min(max(self.value - below, least), self.value), max(
            min(self.value + above, most), self.value
        )

    @property
    def halves(self) -> dict[str, float | None]:
        """Half-width of each part, mean of both sides; None where it is not known."""
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
    """How far the figures of a contact may be off.

    `clr` of the load share, `crf_hz` of the contact resonance (None where none was looked for, or
    none found); `surfaces` how many were solved. `choices` are in no interval: what was chosen,
    and would move the numbers if it were chosen otherwise, a few words each.
    """

    clr: Uncertainty
    crf_hz: Uncertainty | None = None
    surfaces: int = 1
    choices: tuple[str, ...] = ()
