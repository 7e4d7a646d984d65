"""Contact maps of selected jumps, spread over a wear history, for figures and animations.

The selection depends only on the number of jumps, so a resumed run keeps the same frames.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.simulation.folder import Arrays
from asperity.simulation.wear.contact import SolvedPosition
from asperity.wear import TrackPosition

MAX_FRAMES = 24  # of a history, besides its end


class WearFrame(NamedTuple):
    """Contact at one position of the tracks at the beginning of a jump: maps on the contact's grid.

    `gap` [m] and `pressure` [Pa] of oil and asperities together; `in_contact` where the bodies
    touch.
    """

    number: int
    hours: float
    position: TrackPosition
    gap: Field
    pressure: Field
    in_contact: Mask

    @classmethod
    def from_solutions(
        cls, number: int, hours: float, solutions: Sequence[tuple[TrackPosition, SolvedPosition]]
    ) -> "WearFrame":
        """Return the first position of a jump, in single precision."""
        position, solved = solutions[0]
        gap, pressure = (
            np.asarray(field, dtype=np.float32) for field in (solved.film, solved.pressure)
        )
        return cls(number, hours, position, gap, pressure, solved.asperity_pressure > 0.0)

    def arrays(self) -> Arrays:
        """Return the arrays to store, by name."""
        numbers = np.array([self.number, self.hours, *self.position], dtype=float)
        return {
            "numbers": numbers,
            "gap": self.gap,
            "pressure": self.pressure,
            "in_contact": self.in_contact,
        }

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "WearFrame":
        """Rebuild a frame from `arrays`."""
        number, hours, first, second = map(float, arrays["numbers"])
        position = TrackPosition(int(first), int(second))
        return cls(
            int(number), hours, position, arrays["gap"], arrays["pressure"], arrays["in_contact"]
        )


def is_kept(number: int, latest: int) -> bool:
    """Return True if the frame of jump `number` is kept at jump `latest`: every 2^n-th jump."""
    every = 1
    while latest >= every * MAX_FRAMES:
        every *= 2
    return number % every == 0
