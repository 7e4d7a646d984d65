"""The contact with two pressures solved: from the dry contact, or coarse to fine from Hertz's pressure."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from typing import Any

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.ehl.contact_solution import ContactSolution, Oil
from asperity.ehl.controls import GRID_CONTINUATION, MIXED_SEARCH, TIME_MARCHING
from asperity.ehl.load_shares import carried_share
from asperity.ehl.models.mixed import MixedBalance, Pressures, evaluate, uses_limiter
from asperity.ehl.models.single_pressure import Problem, TransientTerm
from asperity.ehl.newton.mixed import newton
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.outcome import ATTEMPTS, FROM_DRY, Options
from asperity.ehl.problem_setup import (
    coarser_in_all_axes,
    contact_problem,
    first_guess,
    grid_levels,
    reduced_problem,
    smooth_film,
    usable_levels,
)
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.grid_continuation import Progress, Search, on_all_lines
from asperity.ehl.strategies.initial_guess import (
    DryAndLubricated,
    dry_start,
    interpolate_unknowns,
    roller_start,
)
from asperity.ehl.strategies.local_refinement import refine_locally
from asperity.lubricant import Lubricant
from asperity.surface import Surface

COARSE_TO_FINE, ROBUST = ATTEMPTS[:2]


def solve_mixed(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options,
    start: ContactSolution | None = None,
    viscosity_factor: Field | None = None,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the contact with a pressure each for oil and asperities; as `solve_contact`, which calls this."""
    began = time.perf_counter()
    assert lubricant is not None  # without oil there is one pressure
    scales = Scales.from_conditions(conditions, lubricant)
    whole = contact_problem(conditions, lubricant, surface, options, viscosity_factor)
    finest = reduced_problem(whole)
    search = MixedSearch(options, scales.gap, progress)
    if conditions.geometry == "roller":
        search.most_work = (
            MIXED_SEARCH.max_roller_work * options.max_iterations * finest.roughness.size
        )
    if start is not None:
        strategy, step = (
            COARSE_TO_FINE,
            search.continue_from(finest, pressures_of(start, finest, scales)),
        )
    else:
        for strategy in _strategies(
            surface, smooth_film(conditions, lubricant), options.contact_film
        ):
            problem = finest if strategy == COARSE_TO_FINE else replace(finest, accurate=False)
            levels = usable_levels(problem, conditions, lubricant)
            step = search.solve_by(
                strategy, levels, lambda on: first_guess(on, conditions, lubricant, scales)
            )
            if search.converged(options.tolerance):
                if (
                    strategy != COARSE_TO_FINE
                    and finest.accurate
                    and finest.form.roller is not None
                ):
                    strategy, step = search.refine_third_order(finest, step)
                search.solve_coarser_grid(finest)
                break
            if search.exhausted:
                break
    return search.solution(
        step,
        surface,
        conditions,
        lubricant,
        seconds=time.perf_counter() - began,
        attempt=strategy,
        start=start,
        viscosity_factor=viscosity_factor,
    )


def _strategies(surface: Surface, film: float, contact_film: float) -> tuple[str, ...]:
    """What is tried, one after the other, on a film [m] of the bodies if they were smooth."""
    if not np.any(surface.heights):
        return (
            (FROM_DRY, COARSE_TO_FINE, ROBUST) if film < contact_film else (COARSE_TO_FINE, ROBUST)
        )
    return (
        (FROM_DRY, COARSE_TO_FINE)
        if film < MIXED_SEARCH.dry_film_ratio * surface.sq
        else (COARSE_TO_FINE, FROM_DRY)
    )


class MixedSearch(Search):
    """The ways to the solution, all steps of them on record."""

    imbalance = 0.0  # of the last step, where no oil may be lost

    def converged(self, tolerance: float, *, check_load: bool = True) -> bool:
        """Whether the last step met the tolerance, and the one of the whole solve with all oil accounted for."""
        closely = tolerance <= self.options.tolerance
        return super().converged(tolerance, check_load=check_load) and not (
            closely and self.imbalance > MIXED_SEARCH.max_imbalance
        )

    def solution(
        self,
        step: Step,
        surface: Surface,
        conditions: ContactConditions,
        lubricant: Lubricant | None,
        **how: Any,
    ) -> ContactSolution:
        """Where the search ended, the oil's own pressure with it."""
        solution = super().solution(step, surface, conditions, lubricant, **how)
        return replace(
            solution, oil=_oil(step, surface, Scales.from_conditions(conditions, lubricant))
        )

    def solve_by(
        self,
        strategy: str,
        levels: Sequence[Problem],
        guess: Callable[[Problem], tuple[Field, float]],
    ) -> Step:
        """Solve in one of the manners that are tried, on the first of the levels."""
        self.cell, self.by_first_order = (
            levels[0].spacing[0],
            None,
        )  # what a way before has left is not this one's
        if strategy == FROM_DRY:
            return self.from_dry(levels)
        step = self.coarse_to_fine(levels, guess)
        ends = (
            levels[0].form.roller is not None and strategy == COARSE_TO_FINE
        )  # sharp ones go on the sturdier way
        single_pressure_suffices = (
            self.smooth and not ends
        )  # that bodies without roughness have: oil and asperities never share
        if single_pressure_suffices and not self.converged(self.options.tolerance):
            step = self.from_single_pressure(levels, guess)
        return step

    def from_single_pressure(
        self, levels: Sequence[Problem], guess: Callable[[Problem], tuple[Field, float]]
    ) -> Step:
        """From the paper's solution, in which oil and asperities have one pressure."""
        finest = levels[0]
        for fixed in (False, True):
            step = self.solve_levels(levels, *guess(levels[-1]), fixed=fixed)
            if self.converged(self.options.tolerance):
                break
        self.figures = self.figures[:-1]
        step = self.continue_from(
            finest, Pressures(step.balance.pressure, step.balance.pressure, step.approach)
        )
        self.figures.append(self._figures(step))
        return step

    def continue_from(self, problem: Problem, unknowns: Pressures) -> Step:
        """From a neighbouring solution: second order at once, or if that leads nowhere as from afar."""
        most = min(self.options.max_iterations, MIXED_SEARCH.max_second_order_iterations)
        step = self.run(
            problem, newton(problem, unknowns, second_order=True), self.options.tolerance, most
        )
        return (
            step
            if self.converged(self.options.tolerance)
            else self.solve_from_afar(problem, unknowns)
        )

    def solve_from_coarse(
        self, problem: Problem, unknowns: Pressures, *, coarse: bool = False, last: bool = True
    ) -> Step:
        """From a coarser grid's solution: second order, or if that gains little as from afar.

        What the order of the wedge makes of the figures is then told on the way back to first
        order.
        """
        tolerance, most = self._targets(problem, coarse=coarse, near=True)
        roughly, soon = (
            max(MIXED_SEARCH.first_order_tolerance, tolerance),
            min(MIXED_SEARCH.max_second_order_iterations, most),
        )
        if uses_limiter(problem):
            steps = newton(problem, unknowns, second_order=True)
            step = self.run(
                problem,
                steps,
                roughly,
                min(MIXED_SEARCH.max_restart_iterations, soon),
                divergence=MIXED_SEARCH.divergence,
            )
            if self.converged(roughly) and not self.converged(tolerance):
                step = self.run(
                    problem,
                    steps,
                    tolerance,
                    step.number + soon,
                    divergence=MIXED_SEARCH.divergence,
                    after=step,
                )
            if self.converged(tolerance):
                if not coarse:
                    self.by_first_order = self._figures(_back_to_first_order(problem, step))
                return step
        return self.solve_from_afar(problem, unknowns, coarse=coarse, last=last)

    def _targets(self, problem: Problem, *, coarse: bool, near: bool = False) -> tuple[float, int]:
        """Tolerance and most steps, of the whole solve or of a grid that is only the way."""
        tolerance, most = self.options.tolerance, self.options.max_iterations
        if not coarse:
            return tolerance, most
        roughly = (
            GRID_CONTINUATION.coarse_tolerance
            if problem.accurate or near
            else 0.5 * MIXED_SEARCH.first_order_tolerance
        )
        return max(roughly, tolerance), min(MIXED_SEARCH.max_error_grid_iterations, most)

    def refine_third_order(self, problem: Problem, step: Step) -> tuple[str, Step]:
        """A sturdy solution of smooth bodies led on to the accurate wedge and its way; or as it is, if that fails."""
        history, figures, error = list(self.history), list(self.figures), self.iteration_error
        better = self.run(
            problem,
            newton(problem, _unknowns(step), second_order=False),
            self.options.tolerance,
            MIXED_SEARCH.max_second_order_iterations,
        )
        if self.converged(self.options.tolerance):
            self.figures[-1] = self._figures(better)
            return COARSE_TO_FINE, better
        self.history, self.figures, self.iteration_error = history, figures, error
        return ROBUST, step

    def solve_from_afar(
        self,
        problem: Problem,
        unknowns: Pressures,
        *,
        coarse: bool = False,
        length: float = 1.0,
        last: bool = True,
    ) -> Step:
        """From afar: in steps of time first, from `length` half-widths on; then what stands still; `coarse` roughly.

        The wedge is of first order until that is met roughly, then of second; where oil is
        conserved of first order throughout. Where time leads nowhere the `last` resort is the
        contact whose cavities are refilled, if oil is conserved, and then what stands still at
        once.
        """
        tolerance, most = self._targets(problem, coarse=coarse)
        if problem.conserve or not problem.accurate:
            step = self.march_in_time(problem, unknowns, length)
            if not self.converged(TIME_MARCHING.tolerance) and not last:
                return step
            if not self.converged(TIME_MARCHING.tolerance) and problem.conserve:
                step = self.from_refilled_cavities(problem, unknowns, length)
            unknowns = _unknowns(step) if self.converged(TIME_MARCHING.tolerance) else unknowns
        if problem.accurate and problem.form.roller is not None:
            most = min(most, MIXED_SEARCH.max_roller_iterations)
        if not uses_limiter(problem):
            return self.run(problem, newton(problem, unknowns, second_order=False), tolerance, most)
        roughly = max(MIXED_SEARCH.first_order_tolerance, tolerance)
        steps = newton(problem, unknowns, second_order=False)
        step = self.run(
            problem,
            steps,
            roughly,
            min(most, MIXED_SEARCH.max_first_order_iterations),
            divergence=MIXED_SEARCH.divergence,
        )
        if not self.converged(roughly):  # too much was left to the last: closer now
            unknowns = _unknowns(
                self.march_in_time(
                    problem, unknowns, length, met=MIXED_SEARCH.first_order_tolerance
                )
            )
            step = self.run(
                problem,
                newton(problem, unknowns, second_order=False),
                roughly,
                min(most, MIXED_SEARCH.max_first_order_iterations),
            )
        if not self.converged(GRID_CONTINUATION.failed_residual):
            return step
        self.by_first_order = self._figures(step)
        return self.run(
            problem, newton(problem, _unknowns(step), second_order=True), tolerance, most
        )

    def march_in_time(
        self,
        problem: Problem,
        unknowns: Pressures,
        first: float,
        *,
        met: float = TIME_MARCHING.tolerance,
    ) -> Step:
        """Towards what stands still in steps of time, longer and longer ones, each from where the last led.

        A step begins with the oil that was there and has little to change: where Newton's steps
        lead nowhere all the same, it was too long. From a start that tells too little of the oil
        no step is short enough.
        """
        length, content = first, evaluate(problem, unknowns, second_order=False).content
        most = min(TIME_MARCHING.max_newton_steps, self.options.max_iterations)
        for _ in range(TIME_MARCHING.max_steps):
            stepped = replace(problem, past=_implicit_step(problem, length, content))
            step = self.run(
                stepped,
                newton(stepped, unknowns, second_order=False),
                met,
                most,
                divergence=MIXED_SEARCH.divergence,
            )
            if self.converged(met):
                unknowns, content = _unknowns(step), step.balance.content
                if length >= TIME_MARCHING.final_length:
                    break
                length *= (
                    (TIME_MARCHING.growth if length >= 1.0 else 3.0)
                    if step.number <= 2
                    else 2.0
                    if step.number <= 4
                    else 1.2
                )
            elif length < TIME_MARCHING.min_length * first:
                break
            else:  # what was left of the steps before may be what goes round: closer from now on
                length, met = 0.25 * length, min(met, MIXED_SEARCH.first_order_tolerance)
        return step

    def from_refilled_cavities(self, problem: Problem, unknowns: Pressures, length: float) -> Step:
        """Towards what loses no oil from the contact whose cavities are refilled."""
        start = Pressures(
            np.clip(unknowns.oil, 0.0, problem.p_cap), unknowns.total, unknowns.approach
        )
        step = self.march_in_time(replace(problem, conserve=False), start, length)
        return (
            self.march_in_time(problem, _unknowns(step), length)
            if self.converged(TIME_MARCHING.tolerance)
            else step
        )

    def coarse_to_fine(
        self, levels: Sequence[Problem], guess: Callable[[Problem], tuple[Field, float]]
    ) -> Step:
        """Coarse to fine from Hertz's pressure, all of it the oil's; from there again after a grid that led nowhere."""
        self.figures, self.smooth = [], not np.any(levels[0].roughness)
        unknowns = None
        roller = levels[0].accurate and levels[0].form.roller is not None
        coarser: DryAndLubricated | None = None
        for problem in reversed(levels):
            if roller:
                dry, unknowns = roller_start(problem, coarser, *guess(problem))
            elif unknowns is None:
                pressure, approach = guess(problem)
                unknowns = Pressures(pressure, pressure, approach)
            elif problem.cells != unknowns.total.shape:
                unknowns = interpolate_unknowns(problem, unknowns)
            if problem is levels[0]:
                step = (
                    self.solve_from_coarse(problem, unknowns)
                    if self.figures
                    else self.solve_from_afar(problem, unknowns)
                )
            else:
                step = self.solve_coarse(problem, unknowns)
            if self.smooth and not self.converged(MIXED_SEARCH.smooth_coarse_residual):
                self.figures, unknowns, coarser = [], None, None
                continue
            if problem is not levels[0] and not self.converged(MIXED_SEARCH.first_order_tolerance):
                self.figures = []  # a start, but no solution to compare with
            elif coarser_in_all_axes(problem, levels[0]):
                self.figures.append(self._figures(step))
            unknowns = _unknowns(step)
            coarser = DryAndLubricated(dry, unknowns) if roller else None
        if levels[0].conserve:  # on coarser grids oil was made
            self.figures = self.figures[-1:]
        return step

    def solve_coarse(self, problem: Problem, unknowns: Pressures) -> Step:
        """A start for the next finer grid; of smooth bodies by a few steps, then the worst cells, in turns."""
        tolerance = max(GRID_CONTINUATION.coarse_tolerance, self.options.tolerance)
        steps = newton(replace(problem, conserve=False), unknowns, second_order=False)
        for _ in range(MIXED_SEARCH.max_smooth_turns if problem.accurate else 0):
            step = self.run(problem, steps, tolerance, MIXED_SEARCH.steps_per_turn)
            if self.converged(tolerance):
                return step
            if step.balance.residual_rms < MIXED_SEARCH.first_order_tolerance:
                break
            steps = newton(problem, refine_locally(problem, _unknowns(step)), second_order=False)
        return self.run(problem, steps, tolerance, GRID_CONTINUATION.max_coarse_iterations)

    def from_dry(self, levels: Sequence[Problem]) -> Step:
        """From bodies that carry all the load themselves, on grid after grid.

        What oil changed on a grid is granted to the dry contact of the next finer one.
        """
        self.figures, self.smooth = [], False
        coarser, dry = None, None
        for problem in reversed(levels):
            total, approach = dry_start(problem, dry)
            dry = Pressures(np.zeros_like(total), total, approach + problem.contact_gap)
            finest = problem is levels[0]
            start = dry if coarser is None else coarser.transfer_to(problem, dry)
            if coarser is None:
                step = self.solve_from_afar(problem, start, coarse=not finest)
            else:
                step = self.solve_from_coarse(problem, start, coarse=not finest, last=False)
            if coarser is not None and not self.converged(
                GRID_CONTINUATION.failed_residual
            ):  # what oil changed on the coarser grid was no start
                step = self.solve_from_afar(
                    problem, dry, coarse=not finest, length=2.0 * problem.spacing[0]
                )
            if finest or self.converged(
                max(MIXED_SEARCH.first_order_tolerance, self.options.tolerance)
            ):
                if coarser_in_all_axes(problem, levels[0]):
                    self.figures.append(self._figures(step))
                coarser = DryAndLubricated(dry, _unknowns(step))
            else:
                self.figures, coarser = [], None
        return step

    def _record(self, problem: Problem, step: Step) -> None:
        balance = step.balance
        self.imbalance = (
            balance.imbalance if isinstance(balance, MixedBalance) and problem.conserve else 0.0
        )
        super()._record(problem, step)

    def solve_coarser_grid(self, finest: Problem) -> None:
        """Solve the next coarser grid from dry, for what the cells' size may have done; nothing if that fails."""
        levels = grid_levels(finest)
        if len(levels) == 1 or len(self.figures) != 1 or not coarser_in_all_axes(levels[1], finest):
            return
        coarse_search = MixedSearch(
            replace(self.options, max_iterations=MIXED_SEARCH.max_error_grid_iterations),
            self.gap_scale,
            self.progress,
        )
        coarse_search.from_dry(levels[1:2])
        self.history = [*coarse_search.history, *self.history]
        if coarse_search.converged(self.options.tolerance):
            self.figures = [*coarse_search.figures, *self.figures]


def pressures_of(solution: ContactSolution, problem: Problem, scales: Scales) -> Pressures:
    """The unknowns of a solution of any model, on the grid of `problem`."""
    total = solution.pressure / scales.pressure
    signed = total if solution.oil is None else _signed(solution.oil, problem, scales)
    if problem.cells[1] == 1:
        total, signed = (field[:, :1] for field in (total, signed))
    if total.shape != problem.all_cells:
        raise BadInput(
            f"start has {solution.grid.cells} cells, the surface {problem.all_cells}; solve without start"
        )
    signed, total = (np.ascontiguousarray(part[:, : problem.cells[1]]) for part in (signed, total))
    return Pressures(signed, total, solution.rigid_approach / scales.gap)


def _signed(oil: Oil, problem: Problem, scales: Scales) -> Field:
    """The oil's unknown: below 0 what is missing, above the cap what has pressed the gap open."""
    if not problem.conserve:
        return oil.pressure / scales.pressure
    growth = oil.growth / scales.gap
    pressed = problem.p_cap + growth / problem.softness
    return np.where(
        oil.content < 1.0,
        oil.content - 1.0,
        np.where(growth > 0.0, pressed, oil.pressure / scales.pressure),
    )


def _implicit_step(problem: Problem, length: float, content: Field) -> TransientTerm:
    """The problem's past, or none, and on top the oil that was there when it was `length` farther back."""
    past = (
        TransientTerm(0.0, np.zeros_like(content), lagrangian=False)
        if problem.past is None
        else problem.past
    )
    return replace(past, rate=past.rate + 1.0 / length, source=past.source - content / length)


def _back_to_first_order(problem: Problem, step: Step) -> Step:
    """From the second-order wedge's solution to the first-order one, met roughly, or as far as steps move the load."""
    previous = back = step
    for back in islice(
        newton(problem, _unknowns(step), second_order=False),
        MIXED_SEARCH.max_backward_iterations + 1,
    ):
        if back.number > 0:
            moved, all_of_it = (
                abs(_load_share(back) - _load_share(other)) for other in (previous, step)
            )
            if (
                back.balance.residual_rms < MIXED_SEARCH.first_order_tolerance
                or moved < MIXED_SEARCH.backward_tolerance * all_of_it
            ):
                break
            previous = back
    return back


def _load_share(step: Step) -> float:
    return carried_share(step.balance.pressure, step.balance.in_contact)


def _unknowns(step: Step) -> Pressures:
    assert isinstance(step.balance, MixedBalance)
    return step.balance.unknowns


def _oil(step: Step, surface: Surface, scales: Scales) -> Oil:
    balance = step.balance
    assert isinstance(balance, MixedBalance)
    content, pressure, growth = (
        on_all_lines(balance.problem, part, surface.grid.cells[1])
        for part in (balance.film_share, balance.oil_pressure, balance.growth)
    )
    return Oil(content=content, pressure=pressure * scales.pressure, growth=growth * scales.gap)
