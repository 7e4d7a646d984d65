"""Initial guesses on a grid: the dry contact, or the solution on a coarser grid."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.ehl.controls import CONTINUATION, RESIDUALS
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
        """Estimate the lubricated contact on another grid from its dry contact."""
        changed = problem.interpolate(self.wet.total - self.dry.total)
        total = np.clip(dry.total + changed, 0.0, problem.p_cap)
        oil = np.minimum(problem.interpolate(np.maximum(self.wet.oil, 0.0)), total)
        return Pressures(oil, total, dry.approach + self.wet.approach - self.dry.approach)


def dry_start(problem: Problem, coarser: Pressures | None = None) -> tuple[Field, float]:
    """Return pressure and approach without oil, from a `coarser` grid or from Hertz pressure.

    The bodies are first elastic, which is valid below the cap; then active sets are used; if these
    cycle, Newton steps from the coarser grid; if those fail, projected conjugate gradients, and
    Newton steps where these do not converge.
    """
    if problem.mirror:
        full = None if coarser is None else coarser._replace(total=problem.unfold(coarser.total))
        pressure, approach = dry_start(problem.unfolded, full)
        return np.ascontiguousarray(pressure[:, : problem.cells[1]]), approach
    dry = replace(problem, lubricant=None, contact_gap=0.0)
    hertz = problem.form.hertz(problem.x, problem.y)
    guess = hertz if coarser is None else problem.interpolate(coarser.total)
    if (elastic := _elastic_start(dry, guess)) is not None:
        return elastic
    approach_guess = (
        _first_contact(dry, guess) if coarser is None else coarser.approach - problem.contact_gap
    )
    pressure, approach, converged = active_set_dry(
        dry, guess, approach_guess, RESIDUALS.rough_solution
    )
    if converged:
        return pressure, approach
    if coarser is not None:
        step, converged = _by_newton(dry, guess, approach_guess)
        if converged:
            return step.balance.pressure, step.approach
    pressure, approach, converged = dry_contact(dry, hertz, max_steps=CONTINUATION.max_iterations)
    if not converged:
        step, _ = _by_newton(dry, pressure, approach)
        pressure = step.balance.pressure
        approach = step.approach
    return pressure, approach


def _elastic_start(dry: Problem, guess: Field) -> tuple[Field, float] | None:
    """Return pressure and approach of elastic bodies; None if they reach the cap."""
    if np.any(guess >= dry.p_cap):
        return None
    pressure, approach, converged = elastic_contact(dry, guess, RESIDUALS.coarse_grid)
    return (pressure, approach) if converged and np.all(pressure < dry.p_cap) else None


def _first_contact(dry: Problem, pressure: Field) -> float:
    """Return the approach at which the smooth bodies touch under this pressure."""
    smooth = dry.form.gap(dry.x, dry.y) + dry.deflection(pressure)
    return -float(smooth.min())


def _by_newton(dry: Problem, pressure: Field, approach: float) -> tuple[Step, bool]:
    """Return the result of Newton steps, and whether it suffices as an initial guess."""
    for step in newton(dry, pressure, approach):
        residual = max(step.balance.residual_rms, abs(step.balance.load_error))
        if residual < RESIDUALS.rough_solution or step.number == CONTINUATION.max_iterations:
            break
    return step, residual < RESIDUALS.rough_solution


def interpolate_unknowns(problem: Problem, unknowns: Pressures) -> Pressures:
    """Interpolate a coarser grid's pressures; those of smooth bodies are refined locally."""
    total, oil = (
        np.clip(
            problem.interpolate(np.maximum(part, 0.0), cubic=problem.accurate), 0.0, problem.p_cap
        )
        for part in (unknowns.total, unknowns.oil)
    )
    handed = Pressures(np.minimum(oil, total), total, unknowns.approach)
    return refine_locally(problem, handed) if problem.accurate else handed


def roller_start(
    problem: Problem, coarser: DryAndLubricated | None, pressure: Field, approach: float
) -> tuple[Pressures, Pressures]:
    """Return the dry contact of a smooth roller with ends, and an initial guess.

    The guess adds the effect of the oil on a coarser grid or, without one, the film of a guessed
    `pressure` and `approach`. The pressure at a sharp end depends on the cell size: that of a
    coarser grid is half as high, and Newton steps from it make the bodies overlap.
    """
    total, distance = dry_start(problem)
    dry = Pressures(total, total, distance)
    if coarser is None:
        film = approach + float((problem.undeformed + problem.deflection(pressure)).min())
        return dry, Pressures(total, total, distance + film)
    start = coarser.transfer_to(problem, dry)
    return dry, refine_locally(problem, Pressures(start.total, start.total, start.approach))


def level_guess(
    problem: Problem,
    coarser: Pressures | None,
    guess: Callable[[Problem], tuple[Field, float]],
) -> Pressures:
    """Return the unknowns of the next coarser grid on this one; without these, those guessed."""
    if coarser is None:
        pressure, approach = guess(problem)
        return Pressures(pressure, pressure, approach)
    if problem.cells == coarser.total.shape:
        return coarser
    return interpolate_unknowns(problem, coarser)
