"""Steps cut short, cell by cell."""

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit


@njit(cache=True)
def shorten(
    step: Field,
    size: Field,
    most: tuple[float, float, float],
    before: Field,
    longest: Field,
    out: Field,
) -> None:
    """Fill in the step, as far as `longest` allows, which is brought up to date: half where the step turns back.

    `most` is the longest of all steps and the share of a cell's `size` that may be more, and what
    always may be added; `before` is what the last step asked for.
    """
    nx, ny = step.shape
    least, share, upward = most
    for i in range(nx):
        for j in range(ny):
            asked, limit = step[i, j], longest[i, j]
            allowed = max(least, share * size[i, j])
            turned_back = asked * before[i, j] < 0.0 and abs(asked) > limit
            limit = 0.5 * min(limit, allowed) if turned_back else min(1.5 * limit, allowed)
            longest[i, j] = limit
            out[i, j] = min(max(asked, -limit), max(limit, upward))
