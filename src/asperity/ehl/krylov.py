"""GMRES, right-preconditioned, without restart.

SciPy's preconditions from the left, so that it stops on a residual nobody asked for, and orthogonalises vector by
vector; at 65 000 unknowns and a few dozen steps that costs as much as the physics.
"""

from collections.abc import Callable

import numpy as np

from asperity.arrays import Field

Operator = Callable[[Field], Field]


def gmres(product: Operator, precondition: Operator, wanted: Field, *, tolerance: float, most_steps: int) -> Field:
    """Solve product(x) = wanted until the residual has fallen by `tolerance` or steps run out; return the best x."""
    norm = float(np.linalg.norm(wanted))
    if norm == 0.0:
        return np.zeros_like(wanted)
    basis = np.empty((most_steps + 1, wanted.size))
    corrections = np.empty((most_steps, wanted.size))
    hessenberg = np.zeros((most_steps + 1, most_steps))
    target = np.zeros(most_steps + 1)
    target[0] = norm
    basis[0] = wanted / norm
    weights: Field = np.zeros(0)
    for step in range(most_steps):
        corrections[step] = precondition(basis[step])
        new = product(corrections[step])
        known = basis[: step + 1]
        for _ in range(2):  # once is not enough in floating point
            overlaps = known @ new
            hessenberg[: step + 1, step] += overlaps
            new -= overlaps @ known
        length = float(np.linalg.norm(new))
        hessenberg[step + 1, step] = length
        reduced = hessenberg[: step + 2, : step + 1]
        weights, *_ = np.linalg.lstsq(reduced, target[: step + 2], rcond=None)
        if np.linalg.norm(reduced @ weights - target[: step + 2]) < tolerance * norm or length < 1e-14 * norm:
            break
        basis[step + 1] = new / length
    return np.asarray(weights @ corrections[: weights.size])
