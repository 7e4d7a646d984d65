"""Step limiter of the Newton iterations, cell by cell."""

from typing import NamedTuple

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit


class StepBounds(NamedTuple):
    """Largest step of a cell: `absolute`, or the share `relative` of its size if that is more.

    A reversing cell halves its last limit; with `bound_reversals` that limit is bounded first.
    """

    absolute: float
    relative: float
    bound_reversals: bool


@njit(cache=True)
def limit_steps(
    step: Field, size: Field, bounds: StepBounds, before: Field, longest: Field, out: Field
) -> None:
    """Fill `out` with the limited step and update the limits `longest` in place.

    `before` is the last unlimited step. The limit halves where a step exceeds it and reverses
    the sign of `before`; elsewhere it grows by half, up to the bounds.
    """
    nx, ny = step.shape
    for i in range(nx):
        for j in range(ny):
            proposed, limit = step[i, j], longest[i, j]
            allowed = max(bounds.absolute, bounds.relative * size[i, j])
            if proposed * before[i, j] < 0.0 and abs(proposed) > limit:
                limit = 0.5 * (min(limit, allowed) if bounds.bound_reversals else limit)
            else:
                limit = min(1.5 * limit, allowed)
            longest[i, j] = limit
            out[i, j] = min(max(proposed, -limit), limit)
