"""Grid continuation from an initial guess on the coarsest grid, and convergence tests."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, Mask
from asperity.ehl.contact_solution import ContactSolution, Oil
from asperity.ehl.controls import CONTINUATION, RESIDUALS
from asperity.ehl.grid_error import grid_error
from asperity.ehl.grid_transfer import AnyField
from asperity.ehl.load_shares import CENTRE, area_share, carried_share
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.single_pressure import Step, newton
from asperity.ehl.outcome import (
    CONSERVING,
    Convergence,
    Figures,
    GridError,
    Iteration,
    Options,
    SolveStatus,
    SolveStrategy,
)
from asperity.ehl.problem_setup import coarser_in_all_axes
from asperity.ehl.scales import Scales
from asperity.lubricant import Lubricant
from asperity.surface import Surface

Progress = Callable[[Iteration], None]


class Search:
    """Grid continuation that records all its steps."""

    def __init__(self, options: Options, gap_scale: float, progress: Progress | None) -> None:
        self.options, self.gap_scale, self.progress = options, gap_scale, progress
        self.history: list[Iteration] = []
        self.figures: list[Figures] = []  # one per grid of the present continuation
        # first-order results on the finest grid, if the search obtained them
        self.by_first_order: Figures | None = None
        self.cell = 0.0  # of the finest grid along x, in half-widths
        self.iteration_error: Figures | None = None
        self.smooth = False  # bodies without roughness
        self.order = 1 if options.model == CONSERVING else 2  # of the wedge
        self.failed = False

    @property
    def discretisation_error(self) -> GridError | None:
        """Discretisation error from the last grids; see `grid_error`."""
        return grid_error(
            self.figures,
            smooth=self.smooth,
            cell=self.cell,
            by_first_order=self.by_first_order,
            order=self.order,
        )

    def converged(self, tolerance: float, *, check_load: bool = True) -> bool:
        """Return True if the last step met the tolerance in residual, change and load.

        The load counts unless `check_load` is False.
        """
        last = self.history[-1]
        return max(last.residual, last.load_error if check_load else 0.0, last.change) < tolerance

    def solve_levels(
        self, levels: Sequence[Problem], pressure: Field, approach: float, *, fixed: bool
    ) -> Step:
        """Solve on successive grids, from the last, coarsest one to the first."""
        self.figures, self.smooth = [], not np.any(levels[0].roughness)
        self.cell = levels[0].spacing[0]
        for problem in reversed(levels):
            coarsest, finest = problem is levels[-1], problem is levels[0]
            tolerance = self.level_tolerance(finest=finest)
            if problem.cells != pressure.shape:
                pressure = problem.interpolate(pressure)
            if fixed:
                step = self.bracket_approach(
                    problem, pressure, approach, tolerance, from_outside=coarsest
                )
            else:
                max_steps = self.options.max_iterations
                if not finest:
                    max_steps = min(max_steps, CONTINUATION.max_iterations)
                bracket = coarsest and not finest
                step = self._solve_level(
                    problem, pressure, approach, tolerance, max_steps, bracket=bracket
                )
            pressure, approach = step.balance.pressure, step.approach
            if coarser_in_all_axes(problem, levels[0]):
                self.figures.append(self.figures_of(step))
        return step

    def level_tolerance(self, *, finest: bool) -> float:
        """Return the tolerance on the finest or a coarser grid."""
        tolerance = self.options.tolerance
        return tolerance if finest else max(RESIDUALS.coarse_grid, tolerance)

    def _solve_level(
        self,
        problem: Problem,
        pressure: Field,
        approach: float,
        tolerance: float,
        max_steps: int,
        *,
        bracket: bool,
    ) -> Step:
        """Solve on one grid by Newton's method.

        Where the third-order wedge diverges, retry from a second-order start; with `bracket`, where
        that fails too, at fixed approach.
        """
        steps = newton(problem, pressure, approach)
        divergence = RESIDUALS.divergence if problem.accurate else np.inf
        step = self.run(problem, steps, tolerance, max_steps, divergence=divergence)
        diverged = step.number < max_steps and not (self.converged(tolerance) or self.failed)
        if problem.accurate and diverged:
            pressure, approach = self.robust_start(problem, pressure, approach)
            step = self.run(problem, newton(problem, pressure, approach), tolerance, max_steps)
        if bracket and not self.converged(RESIDUALS.initial_guess):
            # the load of a capped contact is too nonlinear in the approach for Newton
            trial = self.bracket_approach(problem, pressure, approach, tolerance, from_outside=True)
            step = trial if self.converged(RESIDUALS.initial_guess) else step
        return step

    def robust_start(
        self, problem: Problem, pressure: Field, approach: float
    ) -> tuple[Field, float]:
        """Return an initial guess for the third-order wedge from a few second-order steps.

        It is unchanged if these do not converge.
        """
        sturdy = replace(problem, accurate=False)
        step = self.run(
            sturdy,
            newton(sturdy, pressure, approach),
            RESIDUALS.initial_guess,
            CONTINUATION.max_iterations,
        )
        return (
            (step.balance.pressure, step.approach)
            if self.converged(RESIDUALS.initial_guess)
            else (pressure, approach)
        )

    def run(
        self,
        problem: Problem,
        steps: Iterator[Step],
        tolerance: float,
        max_steps: int,
        *,
        check_load: bool = True,
        divergence: float = np.inf,
    ) -> Step:
        """Take steps until they meet the tolerance or reach the number `max_steps`.

        They also end where the residual reaches `divergence` times that of the first step.
        """
        step = next(steps)
        earlier = step
        largest_residual = divergence * max(earlier.balance.residual_rms, RESIDUALS.rough_solution)
        while True:
            self._record(problem, step)
            self.failed = step.number > 0 and not np.isfinite(step.change)
            if (
                self.converged(tolerance, check_load=check_load)
                or step.number >= max_steps
                or self.failed
            ):
                break
            if step.balance.residual_rms > largest_residual:
                break
            earlier = step  # drops the fields of the step before
            step = next(steps)
        if not np.isfinite(step.balance.residual_rms):  # diverged: the last finite solution
            step = earlier
        self.iteration_error = self.figures_of(step).abs_difference(self.figures_of(earlier))
        return step

    def bracket_approach(
        self,
        problem: Problem,
        pressure: Field,
        approach: float,
        tolerance: float,
        *,
        from_outside: bool,
    ) -> Step:
        """Solve at fixed approach, and search the approach that carries the load.

        This is slower, but each problem is simpler.
        """
        roughness = float(np.std(problem.roughness))
        stride = max(0.5, 0.5 * roughness) if from_outside else max(0.05, 0.05 * roughness)
        approach += 2.0 * roughness if from_outside else 0.0
        bracket, remaining = _Bracket(stride), self.options.max_iterations
        while True:
            step = self.run(
                problem,
                newton(problem, pressure, approach, fixed=True),
                tolerance,
                min(remaining, CONTINUATION.max_iterations),
                check_load=False,
            )
            remaining -= max(step.number, 1)
            pressure = step.balance.pressure
            if remaining <= 0 or self.failed or self.converged(tolerance):
                return step
            approach = bracket.next_approach(approach, step.balance.load_error)

    def solution(
        self,
        step: Step,
        surface: Surface,
        conditions: ContactConditions,
        lubricant: Lubricant | None,
        *,
        seconds: float,
        strategy: SolveStrategy = SolveStrategy.COARSE_TO_FINE,
        start: ContactSolution | None = None,
    ) -> ContactSolution:
        """Return the result of the search in SI units on the surface's grid.

        A warm `start` passes on its discretisation error only if it solves the same contact, except
        for its temperature.
        """
        discretisation = self.discretisation_error
        if start is not None:
            same = _is_same_contact(start, surface, conditions, lubricant, self.options)
            discretisation = start.convergence.discretisation_error if same else None
        scales, balance = Scales.from_conditions(conditions, lubricant), step.balance
        lines = surface.grid.cells[1]
        stopped = SolveStatus.STALLED if self.failed else SolveStatus.OUT_OF_ITERATIONS
        touching = balance.in_contact & (balance.pressure > 0.0)
        pressure, height = (
            on_all_lines(balance.problem, field, lines)
            for field in (balance.pressure, balance.height)
        )
        return ContactSolution(
            conditions=conditions,
            lubricant=lubricant,
            surface=surface,
            options=self.options,
            pressure=pressure * scales.pressure,
            gap=height * scales.gap,
            in_contact=on_all_lines(balance.problem, touching, lines),
            rigid_approach=step.approach * scales.gap,
            oil=self.oil(step, lines, scales),
            convergence=Convergence(
                status=SolveStatus.CONVERGED if self.converged(self.options.tolerance) else stopped,
                history=tuple(self.history),
                tolerance=self.options.tolerance,
                seconds=seconds,
                attempt=strategy,
                iteration_error=self.iteration_error,
                discretisation_error=discretisation,
            ),
        )

    def oil(self, _step: Step, _lines: int, _scales: Scales) -> Oil | None:
        """Return the state of the oil; None where it shares its pressure with the asperities."""
        return None

    def figures_of(self, step: Step) -> Figures:
        """Return the key results of a step."""
        balance = step.balance
        touching, unfold = balance.in_contact & (balance.pressure > 0.0), balance.problem.unfold
        fields = unfold(balance.pressure), unfold(touching), unfold(balance.height)
        return figures(balance.problem.unfolded, *fields, self.gap_scale)

    def _record(self, problem: Problem, step: Step) -> None:
        """Record a step and report progress."""
        balance = step.balance
        residuals = balance.residual_rms, abs(balance.load_error), step.change
        iteration = Iteration(problem.all_cells, step.number, *residuals)
        self.history.append(iteration)
        if self.progress:
            self.progress(iteration)


def _is_same_contact(
    start: ContactSolution,
    surface: Surface,
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    options: Options,
) -> bool:
    """Return True for a solution of the same contact; its temperature may differ."""
    alike = replace(start.options, max_iterations=options.max_iterations)
    same = (start.conditions, start.lubricant, alike) == (conditions, lubricant, options)
    same = same and start.grid == surface.grid
    return same and np.array_equal(start.surface.heights, surface.heights)


class _Bracket:
    """Bracket of the approach for a load, by strides, then Illinois' false position."""

    def __init__(self, stride: float) -> None:
        self.stride = stride
        # approach and load error, by whether the load is too large
        self.ends: dict[bool, tuple[float, float]] = {}
        self.last_side: bool | None = None

    def next_approach(self, approach: float, error: float) -> float:
        """Add an approach with its load error; return the next one."""
        side = error > 0.0
        self.ends[side] = approach, error
        if len(self.ends) < 2:
            stride, self.stride = self.stride, 1.5 * self.stride
            return approach + (stride if side else -stride)
        if side == self.last_side:  # Illinois: halve the weight of the end that does not move
            self.ends[not side] = self.ends[not side][0], 0.5 * self.ends[not side][1]
        self.last_side = side
        (closer, too_much), (apart, too_little) = self.ends[True], self.ends[False]
        weight = min(max(too_much / (too_much - too_little), 0.02), 0.98)
        return closer + weight * (apart - closer)


def on_all_lines(problem: Problem, field: AnyField, lines: int) -> AnyField:
    """Expand a field of a reduced problem, shape (nx', ny'), to shape (nx', lines)."""
    unfolded = problem.unfold(field)
    return np.repeat(unfolded, lines // unfolded.shape[1], axis=1)


def figures(
    problem: Problem, pressure: Field, touching: Mask, gap: Field, gap_scale: float
) -> Figures:
    """Return the key results of dimensionless fields; lengths in the unit of `gap_scale`."""
    profile, end_values = problem.form.roller, {}
    if profile is not None:
        dome, film = (
            profile.end_values(problem.y, of)
            for of in (
                profile.central_pressure(problem.x, pressure, problem.spacing[0]),
                gap.min(axis=0),
            )
        )
        if dome.size:
            end_values = {
                "edge_pressure": float(dome.max()) * problem.p_scale,
                "end_film": float(film.min()) * gap_scale,
            }
    return Figures(
        **end_values,
        car=area_share(touching, problem.zone()),
        clr=carried_share(pressure, touching),
        h_min=float(gap.min()) * gap_scale,
        h_central=float(gap[problem.zone(CENTRE)].mean()) * gap_scale,
    )
