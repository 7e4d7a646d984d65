"""Strategies of the two-pressure models without a neighbouring solution, over all grids."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.ehl.controls import CONTINUATION, RESIDUALS
from asperity.ehl.models.mixed import Pressures
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.outcome import SolveStrategy
from asperity.ehl.problem_setup import (
    coarser_in_all_axes,
    first_guess,
    grid_levels,
    smooth_film,
    usable_levels,
)
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.initial_guess import (
    DryAndLubricated,
    dry_start,
    level_guess,
    roller_start,
)
from asperity.ehl.strategies.mixed_search import Level, MixedSearch
from asperity.ehl.strategies.oil_state import unknowns_of
from asperity.ehl.strategies.one_grid import (
    AS_GUESS,
    FROM_AFAR,
    FROM_COARSE,
    FROM_NEIGHBOUR,
    solve_again,
)
from asperity.lubricant import Lubricant
from asperity.surface import Surface

Guess = Callable[[Problem], tuple[Field, float]]  # pressure and approach on a grid


class Roughness(NamedTuple):
    """Roughness and film of a contact, which decide the strategies; lengths in m."""

    sq: float  # 0: smooth bodies
    film: float  # of the smooth bodies
    contact_film: float
    sharp_ends: bool  # of a roller

    @property
    def dominates(self) -> bool:
        """True if the smooth bodies' film is thinner than roughness, or than the contact film."""
        return self.film < (self.sq or self.contact_film)


@dataclass(frozen=True)
class ColdStart(ABC):
    """Strategy from the conditions alone."""

    name: SolveStrategy

    @property
    def third_order(self) -> bool:
        """True if the wedge is third order where the bodies are smooth."""
        return self.name == SolveStrategy.COARSE_TO_FINE

    @abstractmethod
    def applies(self, roughness: Roughness) -> bool:
        """Return True where the strategy can be used."""

    @abstractmethod
    def solve(self, search: MixedSearch, levels: Sequence[Problem], guess: Guess) -> Step:
        """Solve on grids, finest first, and return the last step, which the search judges."""


@dataclass(frozen=True)
class FromDry(ColdStart):
    """From the dry contact, with the asperities carrying the load at first."""

    dominant: bool  # applies where roughness dominates, or where it does not

    def applies(self, roughness: Roughness) -> bool:
        """Return True once for rough bodies, never for smooth ones whose film separates them."""
        return roughness.dominates == self.dominant and (self.dominant or roughness.sq > 0.0)

    def solve(self, search: MixedSearch, levels: Sequence[Problem], _guess: Guess) -> Step:
        """Solve on every grid from its dry contact."""
        return solve_from_dry(search, levels)


class CoarseToFine(ColdStart):
    """From Hertz pressure on the coarsest grid, carried by the oil."""

    def applies(self, roughness: Roughness) -> bool:
        """Return True; for rough bodies once, as their wedge is never third order."""
        return self.third_order or not roughness.sq

    def solve(self, search: MixedSearch, levels: Sequence[Problem], guess: Guess) -> Step:
        """Solve on every grid from the next coarser one.

        Restarts from Hertz pressure after a grid that does not converge.
        """
        search.figures, search.smooth = [], not np.any(levels[0].roughness)
        unknowns = None
        roller = levels[0].accurate and levels[0].form.roller is not None
        coarser: DryAndLubricated | None = None
        for problem in reversed(levels):
            if roller:
                dry, unknowns = roller_start(problem, coarser, *guess(problem))
            else:
                unknowns = level_guess(problem, unknowns, guess)
            if problem is not levels[0]:
                step = search.first_converged(AS_GUESS, problem, unknowns, Level(coarse=True))
            else:
                strategies = FROM_COARSE if search.figures else FROM_AFAR
                step = search.first_converged(strategies, problem, unknowns)
            if search.smooth and not search.converged(RESIDUALS.rough_solution):
                search.figures, unknowns, coarser = [], None, None
                continue
            if problem is not levels[0] and not search.converged(RESIDUALS.rough_solution):
                search.figures = []  # an initial guess, but no solution to compare with
            elif coarser_in_all_axes(problem, levels[0]):
                search.keep(problem, step)
            unknowns = unknowns_of(step)
            coarser = DryAndLubricated(dry, unknowns) if roller else None
        if levels[0].conserve:  # coarser grids do not conserve oil
            search.figures = search.figures[-1:]
        return step


class FromSinglePressure(CoarseToFine):
    """From the solution of the single-pressure model: smooth bodies share no cell with the oil."""

    def applies(self, roughness: Roughness) -> bool:
        """Return True for smooth bodies; sharp ends need the robust wedge."""
        return not (roughness.sq or (roughness.sharp_ends and self.third_order))

    def solve(self, search: MixedSearch, levels: Sequence[Problem], guess: Guess) -> Step:
        """Solve with one pressure, at fixed approach if need be, and from there with two."""
        for fixed in (False, True):
            step = search.solve_levels(levels, *guess(levels[-1]), fixed=fixed)
            if search.converged(search.options.tolerance):
                break
        pressure = step.balance.pressure
        unknowns = Pressures(pressure, pressure, step.approach)
        step = search.first_converged(FROM_NEIGHBOUR, levels[0], unknowns)
        search.figures[-1:] = [search.figures_of(step)]
        return step


STRATEGIES = (  # in the order in which they are tried
    FromDry(SolveStrategy.FROM_DRY, dominant=True),
    CoarseToFine(SolveStrategy.COARSE_TO_FINE),
    FromSinglePressure(SolveStrategy.COARSE_TO_FINE),
    CoarseToFine(SolveStrategy.SECOND_ORDER),
    FromSinglePressure(SolveStrategy.SECOND_ORDER),
    FromDry(SolveStrategy.FROM_DRY, dominant=False),
)


def solve_cold(
    search: MixedSearch,
    finest: Problem,
    surface: Surface,
    conditions: ContactConditions,
    lubricant: Lubricant,
) -> tuple[SolveStrategy, Step]:
    """Solve without a neighbouring solution; return the strategy's name and its last step."""
    options, robust = search.options, replace(finest, exact=False)
    tolerance, search.is_guess = options.tolerance, finest.exact
    if finest.exact:
        tolerance = max(tolerance, RESIDUALS.rough_solution)
        search.options = replace(options, tolerance=tolerance)
    roughness = Roughness(
        surface.sq,
        smooth_film(conditions, lubricant),
        options.contact_film,
        finest.form.roller is not None,
    )
    scales = Scales.from_conditions(conditions, lubricant)
    guess = partial(first_guess, conditions=conditions, lubricant=lubricant, scales=scales)
    for strategy in STRATEGIES:
        if not strategy.applies(roughness):
            continue
        problem = robust if strategy.third_order else replace(robust, accurate=False)
        levels, name = usable_levels(problem, conditions, lubricant), strategy.name
        search.prepare(finest)
        step = strategy.solve(search, levels, guess)
        if search.converged(tolerance):
            if finest.accurate and not strategy.third_order and roughness.sharp_ends:
                name, step = _refine_third_order(search, finest, step)
            solve_coarser_grid(search, robust)
            if finest.exact:
                search.options, search.is_guess = options, False
                del step  # its fields take as much memory as those of the next solution
                step = _solve_on_exact_faces(search)
        if search.converged(options.tolerance):
            break
    search.options = options
    return name, step


def _refine_third_order(
    search: MixedSearch, problem: Problem, step: Step
) -> tuple[SolveStrategy, Step]:
    """Refine with the third-order wedge; return strategy and step, unchanged if this fails."""
    earlier = list(search.history), list(search.figures), search.iteration_error
    tolerance = search.options.tolerance
    better = search.steps(problem, unknowns_of(step), tolerance, CONTINUATION.max_iterations)
    if search.converged(tolerance):
        search.figures[-1] = search.figures_of(better)
        return SolveStrategy.COARSE_TO_FINE, better
    search.history, search.figures, search.iteration_error = earlier
    return SolveStrategy.SECOND_ORDER, step


def _solve_on_exact_faces(search: MixedSearch) -> Step:
    """Solve again on exact faces, from the rough solution; if that fails, from a close one."""
    tolerance, solved = search.options.tolerance, list(search.solved)
    step = solve_again(search, solved)
    if not (search.converged(tolerance) or search.arithmetic):
        finest, guess = solved[-1]
        close = search.first_converged(FROM_NEIGHBOUR, finest, guess)
        if search.converged(tolerance):
            step = solve_again(search, [*solved[:-1], (finest, unknowns_of(close))])
    return step


def solve_from_dry(search: MixedSearch, levels: Sequence[Problem]) -> Step:
    """Solve on every grid, coarsest first, from its dry contact.

    The effect of oil on a grid is transferred to the dry contact of the next finer one.
    """
    search.figures, search.smooth = [], False
    coarser, dry = None, None
    for problem in reversed(levels):
        total, approach = dry_start(problem, dry)
        dry = Pressures(np.zeros_like(total), total, approach + problem.contact_gap)
        finest = problem is levels[0]
        level = Level(coarse=not finest)
        if coarser is None:
            step = search.first_converged(FROM_AFAR, problem, dry, level)
        else:
            start = coarser.transfer_to(problem, dry)
            step = search.first_converged(FROM_COARSE, problem, start, level._replace(last=False))
        # the effect of oil on the coarser grid was no good guess
        if coarser is not None and not search.converged(RESIDUALS.initial_guess):
            shorter = level._replace(length=2.0 * problem.spacing[0])
            step = search.first_converged(FROM_AFAR, problem, dry, shorter)
        if finest or search.converged(max(RESIDUALS.rough_solution, search.options.tolerance)):
            if coarser_in_all_axes(problem, levels[0]):
                search.keep(problem, step)
            coarser = DryAndLubricated(dry, unknowns_of(step))
        else:
            search.figures, coarser = [], None
    return step


def solve_coarser_grid(search: MixedSearch, finest: Problem) -> None:
    """Solve the next coarser grid from dry, to estimate the discretisation error.

    There is no effect if that fails.
    """
    levels = grid_levels(finest)
    if len(levels) == 1 or len(search.figures) != 1 or not coarser_in_all_axes(levels[1], finest):
        return
    if not np.any(levels[1].form.hertz(levels[1].x, levels[1].y)):
        return  # no dry contact on such cells
    coarse_search = MixedSearch(
        replace(search.options, max_iterations=CONTINUATION.max_iterations),
        search.gap_scale,
        search.progress,
    )
    solve_from_dry(coarse_search, levels[1:2])
    search.history = [*coarse_search.history, *search.history]
    if coarse_search.converged(search.options.tolerance):
        search.figures = [*coarse_search.figures, *search.figures]
        search.solved = [*coarse_search.solved, *search.solved]
