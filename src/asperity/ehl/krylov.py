"""GMRES, right-preconditioned, without restart, in the precision of what is wanted; real or complex.

SciPy's preconditions from the left, so that it stops on a residual nobody asked for, and orthogonalises vector by
vector; at 65 000 unknowns and a few dozen steps that costs as much as the physics.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

Vector = np.ndarray[Any, Any]
Operator = Callable[[Any], Vector]

FEW = 7  # vectors that there is room for at first: memory that is asked for in vain is given back and asked for anew
CANCELLED = 0.5  # share of a vector left by orthogonalising it, below which that is done once more


@np.errstate(over="ignore", invalid="ignore")  # what leaves this precision's range is found out below
def gmres(product: Operator, precondition: Operator, wanted: Vector, *, tolerance: float, most_steps: int) -> Vector:
    """Solve product(x) = wanted until the residual has fallen by `tolerance` or steps run out; return the best x."""
    exact = np.result_type(wanted.dtype, float)
    norm = _length(wanted)
    if norm == 0.0:
        return np.zeros_like(wanted)
    basis, corrections = np.empty((2, min(FEW, most_steps) + 1, wanted.size), dtype=wanted.dtype)
    triangle = np.zeros((most_steps, most_steps), exact)
    turns = np.zeros(
        (most_steps, 2), exact
    )  # cosine and sine of the rotations that make the Hessenberg matrix a triangle
    target = np.zeros(most_steps + 1, exact)
    target[0] = norm
    np.divide(wanted, norm, out=basis[0])
    for step in range(most_steps):
        if step + 1 == len(basis):
            basis, corrections = (np.concatenate([part, np.empty_like(part)]) for part in (basis, corrections))
        corrections[step] = precondition(basis[step])
        new = product(corrections[step])
        known = basis[: step + 1]
        before = _length(new)
        overlaps = (known @ new.conj()).conj()
        new -= overlaps @ known
        column, length = overlaps.astype(exact), _length(new)
        if not np.isfinite(length):  # out of this precision's range: what is known already has to do
            step -= 1
            break
        if length < CANCELLED * before:
            overlaps = (known @ new.conj()).conj()
            new -= overlaps @ known
            column, length = column + overlaps, _length(new)
        for i, (cosine, sine) in enumerate(turns[:step]):
            column[i : i + 2] = (
                cosine.conj() * column[i] + sine * column[i + 1],
                cosine * column[i + 1] - sine * column[i],
            )
        slant = float(np.hypot(abs(column[step]), length))
        cosine, sine = turns[step] = (column[step] / slant, length / slant) if slant else (1.0, 0.0)
        column[step] = slant
        triangle[: step + 1, step] = column
        target[step : step + 2] = np.conj(cosine) * target[step], -sine * target[step]
        if abs(target[step + 1]) < tolerance * norm or length < np.finfo(wanted.dtype).eps * before:
            break
        np.divide(new, length, out=basis[step + 1])
    count = step + 1
    if count == 0:
        return np.full_like(wanted, np.nan)
    weights = np.linalg.lstsq(triangle[:count, :count], target[:count], rcond=None)[0]
    return np.asarray(weights.astype(wanted.dtype) @ corrections[:count])


def _length(vector: Vector) -> float:
    return float(np.sqrt((vector.conj() @ vector).real))
