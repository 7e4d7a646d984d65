"""The contact as it was at some jumps, for pictures of it as it moves and wears: few enough, spread over the history.

Which jumps are kept depends on how many there have been alone, so that a run that was killed keeps
the same.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field, Mask
from asperity.simulation.wear.contact import SolvedPosition
from asperity.wear import TrackPosition

MOST = 24  # frames of a history, besides its end


class WearFrame(NamedTuple):
    """The contact at one position of the tracks, at the beginning of a jump: maps on the contact's grid.

    `gap` [m] and `pressure` [Pa] as oil and asperities have it; `in_contact` is where bodies press
    on one another.
    """

    number: int
    hours: float
    position: TrackPosition
    gap: Field
    pressure: Field
    in_contact: Mask

    @classmethod
    def of(
        cls, number: int, hours: float, at: Sequence[tuple[TrackPosition, SolvedPosition]]
    ) -> "WearFrame":
        """The first position of a jump; single precision is enough for the eye."""
        place, solved = at[0]
        gap, pressure = (
            np.asarray(field, dtype=np.float32) for field in (solved.film, solved.pressure)
        )
        return cls(number, hours, place, gap, pressure, solved.asperity_pressure > 0.0)

    def arrays(self) -> dict[str, npt.NDArray[Any]]:
        """As arrays by name."""
        told = np.array([self.number, self.hours, *self.position], dtype=float)
        return {
            "told": told,
            "gap": self.gap,
            "pressure": self.pressure,
            "in_contact": self.in_contact,
        }

    @classmethod
    def of_arrays(cls, arrays: Mapping[str, npt.NDArray[Any]]) -> "WearFrame":
        """What `arrays` made."""
        number, hours, first, second = map(float, arrays["told"])
        place = TrackPosition(int(first), int(second))
        return cls(
            int(number), hours, place, arrays["gap"], arrays["pressure"], arrays["in_contact"]
        )


def is_kept(number: int, latest: int) -> bool:
    """Whether a history that has come to the latest jump keeps the frame of one before: every 2^n-th, MOST at most."""
    every = 1
    while latest >= every * MOST:
        every *= 2
    return number % every == 0
