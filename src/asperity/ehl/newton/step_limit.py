"""How far a Newton step may go in one cell: so that a few undecided cells cannot keep all others waiting."""

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.step_limits import shorten

LONGEST_STEP = 0.5  # of p_h, in one cell and one Newton step ...
LONGEST_SHARE = 0.5  # ... or this share of the cell's own pressure


class StepLimit:
    """The longest step of every cell, which shrinks where it turns back."""

    def __init__(self, before: Field) -> None:
        self.before, self.longest = before, np.full_like(before, np.inf)

    def limited(self, step: Field, size: Field, upward: float) -> Field:
        """The step, no longer than what its cell's `size` and its past allow, but for `upward` if that is more."""
        limited = np.empty_like(step)
        shorten(
            step, size, (LONGEST_STEP, LONGEST_SHARE, upward), self.before, self.longest, limited
        )
        self.before = step
        return limited
