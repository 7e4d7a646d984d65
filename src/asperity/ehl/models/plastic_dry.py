"""Dry contact of elastic, perfectly plastic bodies: a quadratic programme with bounds.

Pressures between 0 and the cap whose sum is the load, with zero gap between the bounds, an open gap
at 0 and an overlap at the cap. Where bodies yield, nearly all touching cells are at the cap: a
semismooth Newton method in single precision finds the active set, and the pressures of the few free
cells follow quickly. Where the set cycles, projected conjugate gradients take over. Sources: M.
Hintermüller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865; I. A. Polonsky, L. M. Keer, Wear 231
(1999) 206, with the upper bound treated like the lower.
"""

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import PLASTIC_DRY, STEP_LIMITS
from asperity.ehl.models.elastic_dry import level_gaps
from asperity.ehl.models.single_pressure import Problem


def active_set_dry(
    problem: Problem, pressure: Field, approach: float, tolerance: float
) -> tuple[Field, float, bool]:
    """Solve the dry contact by active sets, in single precision, from an initial guess.

    Returns pressure (nx, ny), approach, and whether residual and load error met the tolerance.
    """
    real, deflection, (dx, dy) = np.float32, problem.deflection, problem.spacing
    undeformed, cap, stiffness = (
        problem.undeformed.astype(real),
        real(problem.p_cap),
        real(1.0 / problem.softness),
    )
    inside, load = np.broadcast_to(~problem.rim, problem.cells), problem.load / (dx * dy)
    furthest = STEP_LIMITS.max_approach_step * max(1.0, float(np.std(problem.roughness)))
    pressure = np.where(inside, np.clip(pressure, 0.0, cap), 0.0).astype(real)
    for number in range(PLASTIC_DRY.max_active_sets + 1):
        touching = (undeformed + deflection(pressure) + real(approach)) * stiffness
        residual = np.where(
            inside, np.maximum(np.minimum(pressure, touching), pressure - cap), real(0.0)
        )
        load_missing = abs(float(pressure.sum(dtype=float)) / load - 1.0)
        converged = max(float(np.sqrt(np.mean(residual**2))), load_missing) < tolerance
        capped = inside & (pressure - cap > touching)
        free = inside & (pressure > touching) & ~capped
        count = np.count_nonzero(free)
        if converged or number == PLASTIC_DRY.max_active_sets or count == 0:
            break
        bound = np.where(capped, cap, np.where(free, pressure, real(0.0)))
        bound[free] += real((load - bound.sum(dtype=float)) / count)
        gap = undeformed + deflection(bound)
        change, level, _ = level_gaps(
            deflection, free, gap, PLASTIC_DRY.linear_tolerance, PLASTIC_DRY.max_krylov_steps
        )
        pressure = np.clip(bound + change.astype(real), real(0.0), cap)
        approach += float(np.clip(-level - approach, -furthest, furthest))
    return np.where(pressure < cap, pressure.astype(float), problem.p_cap), approach, converged


def dry_contact(
    problem: Problem, pressure: Field, *, max_steps: int = PLASTIC_DRY.max_steps
) -> tuple[Field, float, bool]:
    """Solve the dry contact by projected conjugate gradients from an initial guess.

    Returns pressure (nx, ny), approach, and whether the residual met the tolerance.
    """
    deflection, cap = problem.deflection, problem.p_cap
    inside = np.broadcast_to(~problem.rim, problem.cells)
    stiffness = 1.0 / problem.softness
    pressure = _scale_to_load(problem, np.where(inside, np.clip(pressure, 0.0, cap), 0.0), inside)
    direction, size, keep = np.zeros_like(pressure), 1.0, 0.0
    for step in range(max_steps + 1):
        gap = problem.undeformed + deflection(pressure)
        free = (pressure > 0.0) & (pressure < cap) & inside
        approach = -float(gap[free].mean()) if free.any() else -float(gap.min())
        gap += approach
        residual = np.where(
            inside, np.maximum(np.minimum(pressure, gap * stiffness), pressure - cap), 0.0
        )
        converged = float(np.sqrt(np.mean(residual**2))) < PLASTIC_DRY.tolerance
        if converged or step == max_steps:
            break
        steepest = np.where(free, gap, 0.0)
        before, size = size, float((steepest**2).sum())
        direction = np.where(
            free, steepest + (keep * size / before if before > 0.0 else 0.0) * direction, 0.0
        )
        answer = deflection(direction)
        answer -= answer[free].mean() if free.any() else 0.0
        curvature = float((answer * direction).sum())
        length = float((steepest * direction).sum()) / curvature if curvature > 0.0 else stiffness
        pressure = np.clip(pressure - length * direction, 0.0, cap)
        wrong = inside & (((pressure <= 0.0) & (gap < 0.0)) | ((pressure >= cap) & (gap > 0.0)))
        keep = 0.0 if wrong.any() else 1.0
        pressure = _scale_to_load(
            problem, np.where(wrong, np.clip(pressure - length * gap, 0.0, cap), pressure), inside
        )
    return pressure, approach, converged


def _scale_to_load(problem: Problem, pressure: Field, inside: Mask) -> Field:
    """Scale the pressure between its bounds until it carries the load."""
    (dx, dy), cap = problem.spacing, problem.p_cap
    target = problem.load / (dx * dy)
    for _ in range(PLASTIC_DRY.max_load_corrections):
        load_missing = target - float(pressure.sum())
        if abs(load_missing) <= 1e-12 * target:
            break
        free = (pressure > 0.0) & (pressure < cap)
        carried = float(pressure[free].sum())
        if carried + load_missing <= 0.0 or carried == 0.0:
            pressure = np.where(
                inside, np.clip(pressure + load_missing / inside.sum(), 0.0, cap), 0.0
            )
        else:
            pressure = np.where(
                free, np.minimum(pressure * (1.0 + load_missing / carried), cap), pressure
            )
    return pressure
