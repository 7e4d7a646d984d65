"""Where Newton's steps on a grid begin: with the dry contact, or with what a coarser grid has told."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.arrays import Field
from asperity.ehl.dry import dry_contact
from asperity.ehl.iterate import newton
from asperity.ehl.locally import smoothed
from asperity.ehl.mixed import Pressures
from asperity.ehl.problem import Problem
from asperity.ehl.search import COARSE_TOLERANCE
from asperity.ehl.transfer import interpolated

MOST_GRADIENTS, MOST_DRY = 60, 20  # steps by conjugate gradients, and then Newton's, for the dry contact


class Lubricated(NamedTuple):
    """A contact on one grid without oil and with it."""

    dry: Pressures
    wet: Pressures

    def granted(self, dry: Pressures, cap: float) -> Pressures:
        """About what oil makes of the dry contact on another grid."""
        cells = dry.total.shape
        changed = interpolated(self.wet.total - self.dry.total, cells)
        total = np.clip(dry.total + changed, 0.0, cap)
        oil = np.minimum(interpolated(np.maximum(self.wet.oil, 0.0), cells), total)
        return Pressures(oil, total, dry.approach + self.wet.approach - self.dry.approach)


def dry_start(problem: Problem) -> tuple[Field, float]:
    """Pressure and approach without oil: by conjugate gradients, and by Newton's steps where the cap is too busy."""
    dry = replace(problem, lubricant=None, contact_gap=0.0)
    pressure = problem.form.hertz(problem.x, problem.y)
    pressure, approach, met = dry_contact(dry, pressure, most_steps=MOST_GRADIENTS)
    if not met:
        for step in newton(dry, pressure, approach):
            left = max(step.balance.residual_rms, abs(step.balance.load_error))
            if left < COARSE_TOLERANCE or step.number == MOST_DRY:
                break
        pressure, approach = step.balance.pressure, step.approach
    return pressure, approach


def handed_up(problem: Problem, unknowns: Pressures) -> Pressures:
    """A coarser grid's pressures on this one; those of smooth bodies nearer to what this one has, where they jump."""
    total, oil = (
        np.clip(interpolated(np.maximum(part, 0.0), problem.cells, cubic=problem.accurate), 0.0, problem.p_cap)
        for part in (unknowns.total, unknowns.oil)
    )
    handed = Pressures(np.minimum(oil, total), total, unknowns.approach)
    return smoothed(problem, handed) if problem.accurate else handed


def on_a_roller(
    problem: Problem, before: Lubricated | None, pressure: Field, approach: float
) -> tuple[Pressures, Pressures]:
    """The dry contact of a smooth roller that ends, and where to start: there, with what oil changed on a coarser grid.

    Or, with none before, with the film of a guessed `pressure` and `approach`. How high the pressure at a sharp end is
    hangs on the cells: a coarser grid's is too low by half, which Newton's steps answer by bodies that overlap.
    """
    total, distance = dry_start(problem)
    dry = Pressures(total, total, distance)
    if before is None:
        film = approach + float((problem.undeformed + problem.deflection(pressure)).min())
        return dry, Pressures(total, total, distance + film)
    start = before.granted(dry, problem.p_cap)
    return dry, smoothed(problem, Pressures(start.total, start.total, start.approach))
