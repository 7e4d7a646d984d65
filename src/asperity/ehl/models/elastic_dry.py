"""Dry contact of elastic bodies by active sets of touching cells, to any tolerance.

Non-negative pressures whose sum is the load, with zero gap where they are positive and a
non-negative one elsewhere. A semismooth Newton method finds the touching cells; conjugate gradients
in single precision, on a window of touching lines, find their pressures, with residuals in double
precision. Sources: M. Hintermüller, K. Ito, K. Kunisch, SIAM J. Optim. 13 (2002) 865; I. A.
Polonsky, L. M. Keer, Wear 231 (1999) 206.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.ehl.controls import DRY, KRYLOV
from asperity.ehl.deflection import Deflection
from asperity.ehl.models.single_pressure import Problem


class _ContactLines(NamedTuple):
    """Adjacent lines of a problem, (lines, ny), that contain all contact."""

    deflection: Deflection
    undeformed: Field
    inside: Mask
    stiffness: float
    load: float  # sum of the pressures
    cells: int  # number in the whole problem

    @classmethod
    def from_problem(cls, problem: Problem) -> "_ContactLines":
        """Return all lines of a problem."""
        inside = np.broadcast_to(~problem.rim, problem.cells)
        dx, dy = problem.spacing
        load = problem.load / (dx * dy)
        stiffness = 1.0 / problem.softness
        return cls(problem.deflection, problem.undeformed, inside, stiffness, load, inside.size)

    def window(self, touching: Mask) -> tuple["_ContactLines", slice]:
        """Return the touching lines with a margin."""
        margin = self.undeformed.shape[0] // DRY.window_margin
        lines = np.flatnonzero(touching.any(axis=1))
        window = slice(max(lines[0] - margin, 0), lines[-1] + 1 + margin)
        undeformed = self.undeformed[window]
        restrict_to = self.deflection.restrict_to(undeformed.shape[0])
        return self._replace(
            deflection=restrict_to, undeformed=undeformed, inside=self.inside[window]
        ), window

    def state(self, pressure: Field) -> tuple[Field, float, float]:
        """Return the gap, the approach, and the residual (rms).

        The approach makes the mean gap zero where there is pressure.
        """
        gap = self.undeformed + self.deflection(pressure)
        approach = -float(gap[pressure > 0.0].mean())
        gap += approach
        residual = np.minimum(pressure, gap * self.stiffness)[self.inside]
        return gap, approach, float(np.sqrt(np.vdot(residual, residual) / self.cells))


def elastic_contact(
    problem: Problem, pressure: Field, tolerance: float
) -> tuple[Field, float, bool]:
    """Solve the elastic, dry contact from an initial guess of the pressure.

    Returns pressure (nx, ny), approach, and whether the residual met the tolerance: root mean
    square as a share of p_h.
    """
    contact = _ContactLines.from_problem(problem)
    pressure = np.where(contact.inside, np.maximum(pressure, 0.0), 0.0)
    pressure *= contact.load / pressure.sum()
    steps = DRY.max_krylov_steps
    for _ in range(DRY.max_rounds):
        gap, approach, residual = contact.state(pressure)
        if residual < tolerance or steps <= 0:
            break
        lines, window = contact.window(contact.inside & ((pressure > 0.0) | (gap < 0.0)))
        window_pressure, steps_taken = _solve_window(lines, pressure[window], tolerance, steps)
        pressure = np.zeros_like(pressure)
        pressure[window] = window_pressure
        steps -= steps_taken
    return pressure, approach, residual < tolerance


def _solve_window(
    lines: _ContactLines, pressure: Field, tolerance: float, max_steps: int
) -> tuple[Field, int]:
    """Return non-negative pressures on some lines, and the number of conjugate-gradient steps."""
    steps, previous = 0, pressure > 0.0
    for _ in range(DRY.max_rounds):
        gap, _, residual = lines.state(pressure)
        if residual < tolerance or steps >= max_steps:
            break
        touching = lines.inside & (pressure > gap * lines.stiffness)
        count = np.count_nonzero(touching)
        settled = np.where(touching, pressure, 0.0)
        if np.any(settled != pressure):
            settled[touching] += (lines.load - settled.sum()) / count
            gap = lines.undeformed + lines.deflection(settled)
        changing = np.any(touching != previous)
        reduction = KRYLOV.tolerance if changing else DRY.tolerance
        reduction = max(reduction, 0.2 * tolerance / residual)
        change, _, inner = level_gaps(lines.deflection, touching, gap, reduction, max_steps - steps)
        pressure, previous, steps = settled + change, touching, steps + inner
    pressure = np.maximum(pressure, 0.0)
    return pressure * (lines.load / pressure.sum()), steps


def level_gaps(
    deflection: Deflection, touching: Mask, gap: Field, reduction: float, max_steps: int
) -> tuple[Field, float, int]:
    """Solve for a pressure change of touching cells with zero sum that equalises their gaps.

    Its relative residual is at most `reduction`. Returns change, mean gap and number of steps.
    """
    count = np.float32(np.count_nonzero(touching))
    level = gap[touching].mean()
    residual = np.where(touching, level - gap, 0.0).astype(np.float32)
    change = np.zeros_like(residual)
    direction = residual.copy()
    step = 0
    size = first = float(np.vdot(residual, residual))
    while size > reduction**2 * first and step < max_steps:
        response = deflection(direction)
        response[~touching] = 0.0
        mean = response.sum() / count
        response -= np.where(touching, mean, np.float32(0.0))
        length = np.float32(size / float(np.vdot(response, direction)))
        change += length * direction
        level += length * mean
        residual -= length * response
        previous, size = size, float(np.vdot(residual, residual))
        direction *= np.float32(size / previous)
        direction += residual
        step += 1
    exact = change.astype(float)
    exact[touching] -= exact[touching].mean()
    return exact, float(level), step
