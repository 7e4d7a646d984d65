"""Step limits of Newton's method, shared by all models; their numbers are in `ehl.controls`.

A cell whose step reverses takes shorter steps, so that a few undecided cells do not stall the
others; the approach of the bodies is limited in the same way.
"""

import numpy as np

from asperity.core.arrays import Field
from asperity.ehl.controls import STEP_LIMITS
from asperity.kernels.step_limits import StepBounds, limit_steps


class StepLimit:
    """Largest pressure step of every cell.

    Limits start at `initial`. With `bound_reversals` a reversing cell's last limit is bounded by
    the size of its pressure before it is halved.
    """

    def __init__(
        self, pressure: Field, *, initial: float = np.inf, bound_reversals: bool = True
    ) -> None:
        self.previous, self.longest = np.zeros_like(pressure), np.full_like(pressure, initial)
        self.bounds = StepBounds(
            STEP_LIMITS.max_pressure_step, STEP_LIMITS.max_relative_step, bound_reversals
        )

    def __call__(self, step: Field, size: Field) -> Field:
        """Return the limited step; `size` is the magnitude of each cell's pressure."""
        limited = np.empty_like(step)
        limit_steps(step, size, self.bounds, self.previous, self.longest, limited)
        self.previous = step
        return limited


class ApproachLimit:
    """Largest change of the approach; grows without reversals, halves with them.

    It is a share of the largest of a²/R, the roughness, and the `film` of a light contact.
    """

    def __init__(self, roughness: Field, film: float) -> None:
        self.largest = self.current = largest_approach_step(roughness, film)
        self.previous = 0.0

    def __call__(self, step: float) -> float:
        """Return the limited step."""
        reverses = step * self.previous < 0.0 and abs(step) > 0.5 * self.current
        grown = min(STEP_LIMITS.approach_growth * self.current, self.largest)
        self.current, self.previous = 0.5 * self.current if reverses else grown, step
        return float(np.clip(step, -self.current, self.current))


def largest_approach_step(roughness: Field, film: float) -> float:
    """Return the largest step of the approach on a roughness and film, all in a²/R."""
    return STEP_LIMITS.max_approach_step * max(1.0, float(np.std(roughness)), film)
