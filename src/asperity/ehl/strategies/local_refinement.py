"""Local refinement of an initial guess for smooth bodies: nonlinear elimination.

A pressure spike is sharper and elsewhere on each grid, and so is the border of the ruptured oil.
Newton steps follow both by a few cells each, while all other cells have converged. So the cells
with the largest residuals are first solved in boxes, with the surrounding pressures and the
approach fixed. Source: P. J. Lanzkron, D. J. Rose, J. T. Wilkes, SIAM J. Sci. Comput. 17 (1996)
538. This changes the initial guess and no solution.
"""

from dataclasses import replace

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.ehl.controls import MARCHING, REFINEMENT, RESIDUALS
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.mixed import newton

Box = tuple[slice, slice]


def refine_locally(problem: Problem, unknowns: Pressures) -> Pressures:
    """Solve the worst cells of an initial guess for their surroundings.

    The guess is unchanged if these cells are many.
    """
    balance = evaluate(problem, unknowns, second_order=False)
    oil = unknowns.oil.copy()
    total = unknowns.total.copy()
    for box in _worst_boxes(balance):
        subproblem, start = _subproblem(balance, box)
        oil[box], total[box] = _solved(subproblem, start)
    return Pressures(oil, total, unknowns.approach)


def _solved(problem: Problem, start: Pressures) -> tuple[Field, Field]:
    """Return the oil and total pressures of the smallest residual in a few Newton steps."""
    best = start
    for step in newton(problem, start, second_order=False):
        residual = step.balance.residual_rms
        if step.number == 0:
            first = least = residual
        elif residual < least:
            assert isinstance(step.balance, MixedBalance)
            least = residual
            best = step.balance.unknowns
        if (
            least < RESIDUALS.initial_guess * first
            or step.number == MARCHING.max_newton_steps
            or not np.isfinite(residual)
        ):
            break
    return best.oil, best.total


def _worst_boxes(balance: MixedBalance) -> list[Box]:
    """Return boxes around the largest residuals; none where these are many, or small."""
    problem = balance.problem
    residual = np.abs(balance.oil_residual)
    worst = residual > REFINEMENT.worst_residual * residual.max()
    if balance.residual_rms < RESIDUALS.coarse_grid:
        return []
    if problem.form.periodic:
        worst = np.broadcast_to(worst.any(axis=1, keepdims=True), worst.shape)
    groups, _ = scipy.ndimage.label(scipy.ndimage.maximum_filter(worst, 2 * REFINEMENT.margin + 1))
    boxes: list[Box] = scipy.ndimage.find_objects(groups)  # type: ignore[assignment]
    size = sum((x.stop - x.start) * (y.stop - y.start) for x, y in boxes)
    return boxes if size < REFINEMENT.max_box_share * residual.size else []


def _subproblem(balance: MixedBalance, box: Box) -> tuple[Problem, Pressures]:
    """Return the subproblem on `box` and its initial pressures.

    Deflection due to pressures outside the box is included in the undeformed gap.
    """
    problem = balance.problem
    (along, across) = box
    (x, y) = problem.lower
    (dx, dy) = problem.spacing
    start = Pressures(balance.unknowns.oil[box], balance.unknowns.total[box], 0.0)
    fixed = np.ones(start.total.shape, dtype=bool)
    fixed_margin = REFINEMENT.margin // 3
    inner = slice(fixed_margin, -fixed_margin)
    mirror = problem.mirror if across.stop == problem.cells[1] else 0
    fixed[
        inner,
        slice(None) if problem.form.periodic else slice(fixed_margin, None) if mirror else inner,
    ] = False
    factor = problem.viscosity_factor
    subproblem = replace(
        problem,
        lower=(x + along.start * dx, y + across.start * dy),
        roughness=problem.roughness[box],
        viscosity_factor=None if factor is None else factor[box],
        fixed=fixed,
        mirror=mirror,
    )
    shape = balance.gap[box] - subproblem.deflection(start.total)
    return replace(
        subproblem, roughness=subproblem.form.gap(subproblem.x, subproblem.y) - shape
    ), start
