"""How far a Newton step may go in one cell: so that a few undecided cells cannot keep all others waiting."""

import numpy as np

from asperity.arrays import Field

LONGEST_STEP = 0.5  # of p_h, in one cell and one Newton step ...
LONGEST_SHARE = 0.5  # ... or this share of the cell's own pressure


class StepLimit:
    """The longest step of every cell, which shrinks where it turns back."""

    def __init__(self, before: Field) -> None:
        self.before, self.longest = before, np.full_like(before, np.inf)

    def limited(self, step: Field, size: Field, upward: Field | float) -> Field:
        """The step, no longer than what its cell's `size` and its past allow, but for `upward` if that is more."""
        most = np.maximum(LONGEST_STEP, LONGEST_SHARE * size)
        turned_back = (step * self.before < 0.0) & (np.abs(step) > self.longest)
        self.longest = np.where(turned_back, 0.5 * np.minimum(self.longest, most), np.minimum(1.5 * self.longest, most))
        self.before = step
        return np.clip(step, -self.longest, np.maximum(self.longest, upward))
