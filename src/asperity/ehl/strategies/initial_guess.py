"""Where Newton's steps on a grid begin: with the dry contact, or with what a coarser grid has told."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.ehl.controls import GRID_CONTINUATION, INITIAL_GUESS
from asperity.ehl.models.elastic_dry import elastic_contact
from asperity.ehl.models.mixed import Pressures
from asperity.ehl.models.plastic_dry import active_set_dry, dry_contact
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step, newton
from asperity.ehl.strategies.local_refinement import refine_locally


class DryAndLubricated(NamedTuple):
    """A contact on one grid without oil and with it."""

    dry: Pressures
    wet: Pressures

    def transfer_to(self, problem: Problem, dry: Pressures) -> Pressures:
        """About what oil makes of the dry contact on another grid."""
        changed = problem.interpolate(self.wet.total - self.dry.total)
        total = np.clip(dry.total + changed, 0.0, problem.p_cap)
        oil = np.minimum(problem.interpolate(np.maximum(self.wet.oil, 0.0)), total)
        return Pressures(oil, total, dry.approach + self.wet.approach - self.dry.approach)


def dry_start(problem: Problem, coarser: Pressures | None = None) -> tuple[Field, float]:
    """Pressure and approach without oil, from those on a `coarser` grid or from Hertz's pressure.

    As elastic bodies, if these stay below the cap. Otherwise by sets of cells that yield. Where
    these go round in circles by Newton's steps from the coarser grid, where that leads nowhere by
    conjugate gradients, and by Newton's steps where the cap is too busy for these.
    """
    if problem.mirror:
        whole = None if coarser is None else coarser._replace(total=problem.unfold(coarser.total))
        pressure, approach = dry_start(problem.unfolded, whole)
        return np.ascontiguousarray(pressure[:, : problem.cells[1]]), approach
    dry, guess = (
        replace(problem, lubricant=None, contact_gap=0.0),
        problem.form.hertz(problem.x, problem.y),
    )
    if coarser is not None:
        guess = problem.interpolate(coarser.total)
    if np.all(guess < problem.p_cap):
        pressure, approach, converged = elastic_contact(
            dry, guess, GRID_CONTINUATION.coarse_tolerance
        )
        if converged and np.all(pressure < problem.p_cap):
            return pressure, approach
    approach_guess = (
        _first_contact(dry, guess) if coarser is None else coarser.approach - problem.contact_gap
    )
    pressure, approach, converged = active_set_dry(
        dry, guess, approach_guess, INITIAL_GUESS.dry_tolerance
    )
    if converged:
        return pressure, approach
    if coarser is not None:
        step, converged = _by_newton(dry, guess, approach_guess)
        if converged:
            return step.balance.pressure, step.approach
        guess = problem.form.hertz(problem.x, problem.y)
    pressure, approach, converged = dry_contact(
        dry, guess, max_steps=INITIAL_GUESS.max_gradient_steps
    )
    if not converged:
        step, _ = _by_newton(dry, pressure, approach)
        pressure, approach = step.balance.pressure, step.approach
    return pressure, approach


def _first_contact(dry: Problem, pressure: Field) -> float:
    """The approach at which only high asperities touch, under the smooth bodies' pressure."""
    smooth = dry.form.gap(dry.x, dry.y) + dry.deflection(pressure)
    return INITIAL_GUESS.first_asperities * float(np.std(dry.roughness)) - float(smooth.min())


def _by_newton(dry: Problem, pressure: Field, approach: float) -> tuple[Step, bool]:
    """Where Newton's steps lead, and whether that is near enough for a start."""
    for step in newton(dry, pressure, approach):
        residual = max(step.balance.residual_rms, abs(step.balance.load_error))
        if residual < INITIAL_GUESS.dry_tolerance or step.number == INITIAL_GUESS.max_newton_steps:
            break
    return step, residual < INITIAL_GUESS.dry_tolerance


def interpolate_unknowns(problem: Problem, unknowns: Pressures) -> Pressures:
    """A coarser grid's pressures on this one; those of smooth bodies nearer to what this one has, where they jump."""
    total, oil = (
        np.clip(
            problem.interpolate(np.maximum(part, 0.0), cubic=problem.accurate), 0.0, problem.p_cap
        )
        for part in (unknowns.total, unknowns.oil)
    )
    handed = Pressures(np.minimum(oil, total), total, unknowns.approach)
    return refine_locally(problem, handed) if problem.accurate else handed


def roller_start(
    problem: Problem, before: DryAndLubricated | None, pressure: Field, approach: float
) -> tuple[Pressures, Pressures]:
    """The dry contact of a smooth roller that ends, and where to start: there, with what oil changed on a coarser grid.

    Or, with none before, with the film of a guessed `pressure` and `approach`. How high the
    pressure at a sharp end is hangs on the cells: a coarser grid's is too low by half, which
    Newton's steps answer by bodies that overlap.
    """
    total, distance = dry_start(problem)
    dry = Pressures(total, total, distance)
    if before is None:
        film = approach + float((problem.undeformed + problem.deflection(pressure)).min())
        return dry, Pressures(total, total, distance + film)
    start = before.transfer_to(problem, dry)
    return dry, refine_locally(problem, Pressures(start.total, start.total, start.approach))
