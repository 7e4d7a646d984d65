"""The dry contact of elastic, perfectly plastic bodies: a quadratic programme with bounds, by conjugate gradients.

Pressures between 0 and the cap, in sum the load, that leave no gap where they lie between, an open one at 0 and an
overlap at the cap. Source: I. A. Polonsky, L. M. Keer, Wear 231 (1999) 206, with the upper bound treated as the lower.
"""

import numpy as np

from asperity.arrays import Field, Mask
from asperity.ehl.problem import Problem

TOLERANCE = 1e-4  # root mean square of the equations, as a share of p_h
MOST_STEPS = 300
MOST_SHARINGS = 40  # rounds in which what the bounds cut off is put on other cells


def dry_contact(problem: Problem, pressure: Field, *, most_steps: int = MOST_STEPS) -> tuple[Field, float, bool]:
    """Pressure (nx, ny) and approach of the dry contact from a first guess, and whether they met the tolerance."""
    deflection, cap = problem.deflection, problem.p_cap
    inside = np.broadcast_to(~problem.rim, problem.cells)
    stiffness = 1.0 / problem.softness
    pressure = _carrying(problem, np.where(inside, np.clip(pressure, 0.0, cap), 0.0), inside)
    direction, size, keep = np.zeros_like(pressure), 1.0, 0.0
    for step in range(most_steps + 1):
        gap = problem.undeformed + deflection(pressure)
        free = (pressure > 0.0) & (pressure < cap) & inside
        approach = -float(gap[free].mean()) if free.any() else -float(gap.min())
        gap += approach
        left = np.where(inside, np.maximum(np.minimum(pressure, gap * stiffness), pressure - cap), 0.0)
        met = float(np.sqrt(np.mean(left**2))) < TOLERANCE
        if met or step == most_steps:
            break
        steepest = np.where(free, gap, 0.0)
        before, size = size, float((steepest**2).sum())
        direction = np.where(free, steepest + (keep * size / before if before > 0.0 else 0.0) * direction, 0.0)
        answer = deflection(direction)
        answer -= answer[free].mean() if free.any() else 0.0
        curvature = float((answer * direction).sum())
        length = float((steepest * direction).sum()) / curvature if curvature > 0.0 else stiffness
        pressure = np.clip(pressure - length * direction, 0.0, cap)
        wrong = inside & (((pressure <= 0.0) & (gap < 0.0)) | ((pressure >= cap) & (gap > 0.0)))
        keep = 0.0 if wrong.any() else 1.0
        pressure = _carrying(problem, np.where(wrong, np.clip(pressure - length * gap, 0.0, cap), pressure), inside)
    return pressure, approach, met


def _carrying(problem: Problem, pressure: Field, inside: Mask) -> Field:
    """The pressure scaled where no bound holds it, so that it carries the load."""
    (dx, dy), cap = problem.spacing, problem.p_cap
    wanted = problem.load / (dx * dy)
    for _ in range(MOST_SHARINGS):
        missing = wanted - float(pressure.sum())
        if abs(missing) <= 1e-12 * wanted:
            break
        free = (pressure > 0.0) & (pressure < cap)
        carried = float(pressure[free].sum())
        if carried + missing <= 0.0 or carried == 0.0:
            pressure = np.where(inside, np.clip(pressure + missing / inside.sum(), 0.0, cap), 0.0)
        else:
            pressure = np.where(free, np.minimum(pressure * (1.0 + missing / carried), cap), pressure)
    return pressure
