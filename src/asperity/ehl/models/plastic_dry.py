"""Dry contact of elastic, perfectly plastic bodies: a quadratic programme with bounds.

Pressures between 0 and the cap whose sum is the load, with zero gap between the bounds, an open gap
at 0 and an overlap at the cap. Where bodies yield, nearly all touching cells are at the cap: a
semismooth Newton method in single precision finds the active set, and the pressures of the few free
cells follow quickly. Where the set cycles, projected conjugate gradients take over. Sources: M.
Hintermüller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865; I. A. Polonsky, L. M. Keer, Wear 231
(1999) 206, with the upper bound treated like the lower.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import DRY, KRYLOV, STEP_LIMITS
from asperity.ehl.deflection import Deflection
from asperity.ehl.models.elastic_dry import level_gaps
from asperity.ehl.models.single_pressure import Problem


class _Sets(NamedTuple):
    """Dry contact in single precision: the bodies, and the pressures between 0 and the cap."""

    deflection: Deflection
    undeformed: Field
    inside: Mask
    cap: np.float32
    stiffness: np.float32
    load: float  # sum of the pressures

    @classmethod
    def from_problem(cls, problem: Problem) -> "_Sets":
        """Return the contact of a problem."""
        (dx, dy) = problem.spacing
        real = np.float32
        return cls(
            problem.deflection,
            problem.undeformed.astype(real),
            np.broadcast_to(~problem.rim, problem.cells),
            real(problem.p_cap),
            real(1.0 / problem.softness),
            problem.load / (dx * dy),
        )

    def solve_free(self, pressure: Field, capped: Mask, free: Mask) -> tuple[Field, float]:
        """Return the pressure at which free cells have one gap, and that gap at approach 0."""
        zero = np.float32(0.0)
        bound = np.where(capped, self.cap, np.where(free, pressure, zero))
        bound[free] += np.float32((self.load - bound.sum(dtype=float)) / np.count_nonzero(free))
        gap = self.undeformed + self.deflection(bound)
        change, level, _ = level_gaps(
            self.deflection, free, gap, KRYLOV.tolerance, KRYLOV.max_steps
        )
        return np.clip(bound + change.astype(np.float32), zero, self.cap), level


def active_set_dry(
    problem: Problem, pressure: Field, approach: float, tolerance: float
) -> tuple[Field, float, bool]:
    """Solve the dry contact by active sets, in single precision, from an initial guess.

    Returns pressure (nx, ny), approach, and whether residual and load error met the tolerance.
    """
    sets = _Sets.from_problem(problem)
    inside, cap = sets.inside, sets.cap
    furthest = STEP_LIMITS.max_approach_step * max(1.0, float(np.std(problem.roughness)))
    pressure = np.where(inside, np.clip(pressure, 0.0, cap), 0.0).astype(np.float32)
    for number in range(DRY.max_rounds + 1):
        gap = sets.undeformed + sets.deflection(pressure) + np.float32(approach)
        touching = gap * sets.stiffness
        load_missing = abs(float(pressure.sum(dtype=float)) / sets.load - 1.0)
        converged = max(_residual(pressure, touching, cap, inside), load_missing) < tolerance
        capped = inside & (pressure - cap > touching)
        free = inside & (pressure > touching) & ~capped
        if converged or number == DRY.max_rounds or not free.any():
            break
        pressure, level = sets.solve_free(pressure, capped, free)
        approach += float(np.clip(-level - approach, -furthest, furthest))
    return np.where(pressure < cap, pressure.astype(float), problem.p_cap), approach, converged


def _residual(pressure: Field, touching: Field, cap: float | np.float32, inside: Mask) -> float:
    """Return the root mean square residual; `touching` is the gap times the stiffness of a cell."""
    residual = np.where(
        inside, np.maximum(np.minimum(pressure, touching), pressure - cap), pressure.dtype.type(0.0)
    )
    return float(np.sqrt(np.mean(residual**2)))


def dry_contact(
    problem: Problem, pressure: Field, *, max_steps: int = DRY.max_krylov_steps
) -> tuple[Field, float, bool]:
    """Solve the dry contact by projected conjugate gradients from an initial guess.

    Returns pressure (nx, ny), approach, and whether the residual met the tolerance.
    """
    cap = problem.p_cap
    stiffness = 1.0 / problem.softness
    inside = np.broadcast_to(~problem.rim, problem.cells)
    pressure = _scale_to_load(problem, pressure)
    direction = np.zeros_like(pressure)
    size = 1.0
    keep = False
    for step in range(max_steps + 1):
        gap, approach, free = _level_gap(problem, pressure, inside)
        converged = _residual(pressure, gap * stiffness, cap, inside) < DRY.tolerance
        if converged or step == max_steps:
            break
        steepest = np.where(free, gap, 0.0)
        previous, size = size, float((steepest**2).sum())
        weight = size / previous if keep and previous > 0.0 else 0.0
        direction = np.where(free, steepest + weight * direction, 0.0)
        length = _step_length(problem, steepest, direction, free)
        pressure = np.clip(pressure - length * direction, 0.0, cap)
        wrong = inside & _leaves_bound(pressure, gap, cap)
        keep = not wrong.any()
        pressure = _scale_to_load(problem, np.where(wrong, pressure - length * gap, pressure))
    return pressure, approach, converged


def _level_gap(problem: Problem, pressure: Field, inside: Mask) -> tuple[Field, float, Mask]:
    """Return the gap, the approach that makes its mean over free cells zero, and these cells."""
    free = (pressure > 0.0) & (pressure < problem.p_cap) & inside
    gap = problem.undeformed + problem.deflection(pressure)
    approach = -float(gap[free].mean()) if free.any() else -float(gap.min())
    gap += approach
    return gap, approach, free


def _leaves_bound(pressure: Field, gap: Field, cap: float) -> Mask:
    """Return the cells whose pressure is at a bound that their gap contradicts."""
    return ((pressure <= 0.0) & (gap < 0.0)) | ((pressure >= cap) & (gap > 0.0))


def _step_length(problem: Problem, steepest: Field, direction: Field, free: Mask) -> float:
    """Return the step along a direction that minimises the energy at constant load."""
    response = problem.deflection(direction)
    response -= response[free].mean() if free.any() else 0.0
    curvature = float((response * direction).sum())
    if not curvature > 0.0:
        return 1.0 / problem.softness
    return float((steepest * direction).sum()) / curvature


def _scale_to_load(problem: Problem, pressure: Field) -> Field:
    """Clip the pressure to its bounds and scale it between them until it carries the load."""
    (dx, dy) = problem.spacing
    cap = problem.p_cap
    inside = np.broadcast_to(~problem.rim, problem.cells)
    pressure = np.where(inside, np.clip(pressure, 0.0, cap), 0.0)
    target = problem.load / (dx * dy)
    for _ in range(DRY.max_rounds):
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
