"""From conditions, oil and surface to a solved contact: coarse to fine, and the decision when to stop."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions
from asperity.ehl.iterate import Step, newton
from asperity.ehl.problem import Balance, Form, Problem
from asperity.ehl.scales import Scales
from asperity.ehl.solution import (
    ATTEMPTS,
    CONSERVING,
    ContactSolution,
    Convergence,
    Figures,
    Iteration,
    Options,
    SolveStatus,
)
from asperity.ehl.transfer import interpolated
from asperity.errors import BadInput, NotConverged
from asperity.lubricant import Lubricant
from asperity.surface import Surface

Progress = Callable[[Iteration], None]

FEWEST_COARSE_CELLS = 48
COARSE_TOLERANCE = 1e-3  # a coarse solution only has to be a good start
MOST_COARSE_ITERATIONS = 40
MOST_HELD_ITERATIONS = 40  # at one distance of the bodies
FAR_OFF = 0.1  # a coarse solution that misses by more is no start at all
CENTRE = 0.1  # half-widths each side of x = 0 that count as the centre of the contact


def solve_contact(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    options: Options | None = None,
    start: ContactSolution | None = None,
    viscosity_factor: Field | None = None,
    strict: bool = True,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the rough, lubricated contact on the surface's grid.

    Parameters
    ----------
    conditions, surface : the contact and its composite roughness; the surface's grid is the grid that is solved
    lubricant : the oil; None for a dry contact
    options : tolerances; `Options()` unless given
    start : a neighbouring solution on a grid of the same cells to start from (other load, speed or roughness)
    viscosity_factor : local over isothermal viscosity, shape (nx, ny), where the film is not at ambient temperature
    strict : raise when the tolerance is not met; otherwise return the unfinished state
    progress : called after every Newton step

    Raises
    ------
    BadInput
        for a grid that does not hold the contact or repeats along the wrong axis, or factors that do not fit it.
    NotConverged
        when strict and the tolerance was not met; carries the unfinished solution.
    """
    options = options or Options()
    began = time.perf_counter()
    scales = Scales.of(conditions, lubricant)
    _check_grid(conditions, surface)
    if viscosity_factor is not None:
        _check_factor(viscosity_factor, surface)
    if options.model == CONSERVING:
        from asperity.ehl.conserving_solve import solve_conserving

        return solve_conserving(
            conditions,
            lubricant,
            surface,
            options=options,
            start=start,
            viscosity_factor=viscosity_factor,
            strict=strict,
            progress=progress,
        )
    whole = contact_problem(conditions, lubricant, surface, options, viscosity_factor)
    finest = on_one_line(whole) if whole.uniform else whole
    search = Search(options, scales.gap, progress)
    if start is None:
        levels = grid_levels(finest)
        guess = first_guess(levels[-1], conditions, lubricant, scales)
    else:
        levels = [finest]
        guess = _warm_start(start, finest.cells, scales)
    for attempt in ATTEMPTS:
        if attempt == ATTEMPTS[1]:
            if not finest.accurate:
                continue
            levels = [replace(level, accurate=False) for level in levels]
        step = search.climb(levels, *guess, held=attempt == ATTEMPTS[2])
        if search.settled(options.tolerance):
            break

    solution = search.solution(
        step,
        surface,
        conditions,
        lubricant,
        seconds=time.perf_counter() - began,
        attempt=attempt,
        discretisation=search.discretisation_error if start is None else start.convergence.discretisation_error,
        viscosity_factor=viscosity_factor,
    )
    if strict and not solution.convergence.converged:
        raise NotConverged(solution, f"contact not solved: {solution.convergence.explain()}")
    return solution


class Search:
    """The way from a guess on the coarsest grid to the solution on the finest, all steps of it on record."""

    def __init__(self, options: Options, gap_scale: float, progress: Progress | None) -> None:
        self.options, self.gap_scale, self.progress = options, gap_scale, progress
        self.history: list[Iteration] = []
        self.figures: list[Figures] = []  # a grid each, since the last climb began
        self.iteration_error: Figures | None = None
        self.smooth = False
        self.lost = False

    @property
    def discretisation_error(self) -> Figures | None:
        """From the last grids, Roache's grid convergence index: their difference for a smooth, second-order solution.

        That is three times its error. A rough one has no such order and gets twice the difference, but no less than a
        quarter of that between the grids before, lest two grids agree by chance. Source: P. J. Roache, J. Fluids Eng.
        116 (1994) 405.
        """
        if len(self.figures) < 2:
            return None
        *before, coarse, fine = self.figures
        error = fine.off(coarse).times(1.0 if self.smooth else 2.0)
        return error.at_least(coarse.off(before[-1]).times(0.25)) if before else error

    def settled(self, tolerance: float) -> bool:
        """Whether the last step met the tolerance in residual, load and change."""
        last = self.history[-1]
        return last.residual < tolerance and last.load_error < tolerance and last.change < tolerance

    def climb(self, levels: Sequence[Problem], pressure: Field, approach: float, *, held: bool) -> Step:
        """Solve on grid after grid, from the last, coarsest one to the first."""
        options, self.figures, self.smooth = self.options, [], not np.any(levels[0].roughness)
        for problem in reversed(levels):
            coarsest, finest = problem is levels[-1], problem is levels[0]
            tolerance = options.tolerance if finest else max(COARSE_TOLERANCE, options.tolerance)
            if problem.cells != pressure.shape:
                pressure = interpolated(pressure, problem.cells)
            if held:
                step = self.position(problem, pressure, approach, tolerance, from_outside=coarsest)
            else:
                most = options.max_iterations if finest else min(options.max_iterations, MOST_COARSE_ITERATIONS)
                step = self.run(problem, newton(problem, pressure, approach), tolerance, most)
                if coarsest and not finest and not self.settled(FAR_OFF):
                    # a capped contact answers its approach too unevenly for Newton
                    found = self.position(problem, pressure, approach, tolerance, from_outside=True)
                    step = found if self.settled(FAR_OFF) else step
            pressure, approach = step.balance.pressure, step.approach
            self.figures.append(figures(step.balance, self.gap_scale))
        return step

    def run(
        self, problem: Problem, steps: Iterator[Step], tolerance: float, most: int, *, of_load: bool = True
    ) -> Step:
        """Take steps until they meet the tolerance, `of_load` too, or there have been too many."""
        before = step = next(steps)
        while True:
            self._record(problem, step)
            last = self.history[-1]
            load_error = last.load_error if of_load else 0.0
            self.lost = step.number > 0 and not np.isfinite(step.change)
            if max(last.residual, load_error, last.change) < tolerance or step.number >= most or self.lost:
                break
            before, step = step, next(steps)
        self.iteration_error = figures(step.balance, self.gap_scale).off(figures(before.balance, self.gap_scale))
        return step

    def position(
        self, problem: Problem, pressure: Field, approach: float, tolerance: float, *, from_outside: bool
    ) -> Step:
        """The contact held at approach after approach until it carries the load: slower, but each is a simple problem.

        The load falls as the bodies part; the approach is bracketed, then found by false position (Illinois).
        """
        roughness = float(np.std(problem.roughness))
        stride = max(0.5, 0.5 * roughness) if from_outside else max(0.05, 0.05 * roughness)
        approach += 2.0 * roughness if from_outside else 0.0
        bracket: dict[bool, tuple[float, float]] = {}  # by whether too much is carried: approach and load error
        last_side, left = None, self.options.max_iterations
        while True:
            most = min(left, MOST_HELD_ITERATIONS)
            step = self.run(problem, newton(problem, pressure, approach, held=True), tolerance, most, of_load=False)
            left -= max(step.number, 1)
            pressure, error = step.balance.pressure, step.balance.load_error
            if left <= 0 or self.lost or self.settled(tolerance):
                return step
            side = error > 0.0
            bracket[side] = approach, error
            if len(bracket) < 2:
                approach += stride if side else -stride
                stride *= 1.5
                continue
            if side == last_side:  # the other end is standing still: give it less weight
                bracket[not side] = bracket[not side][0], 0.5 * bracket[not side][1]
            last_side = side
            (near, too_much), (apart, too_little) = bracket[True], bracket[False]
            share = min(max(too_much / (too_much - too_little), 0.02), 0.98)
            approach = near + share * (apart - near)

    def solution(
        self,
        step: Step,
        surface: Surface,
        conditions: ContactConditions,
        lubricant: Lubricant | None,
        *,
        seconds: float,
        attempt: str = ATTEMPTS[0],
        discretisation: Figures | None = None,
        viscosity_factor: Field | None = None,
    ) -> ContactSolution:
        """Where the search ended, in SI on the surface's grid, whether it was solved on one line of it or on all."""
        scales, balance = Scales.of(conditions, lubricant), step.balance
        stopped = SolveStatus.STALLED if self.lost else SolveStatus.OUT_OF_ITERATIONS
        lines = surface.grid.cells[1] // balance.problem.cells[1]
        pressure, gap = np.repeat(balance.pressure, lines, axis=1), np.repeat(balance.gap, lines, axis=1)
        return ContactSolution(
            conditions=conditions,
            lubricant=lubricant,
            surface=surface,
            options=self.options,
            pressure=pressure * scales.pressure,
            gap=np.maximum(gap, 0.0 if lubricant is None else balance.problem.contact_gap) * scales.gap,
            in_contact=np.repeat(balance.in_contact & (balance.pressure > 0.0), lines, axis=1),
            rigid_approach=step.approach * scales.gap,
            convergence=Convergence(
                status=SolveStatus.CONVERGED if self.settled(self.options.tolerance) else stopped,
                history=tuple(self.history),
                tolerance=self.options.tolerance,
                seconds=seconds,
                attempt=attempt,
                iteration_error=self.iteration_error,
                discretisation_error=discretisation,
            ),
            viscosity_factor=viscosity_factor,
        )

    def _record(self, problem: Problem, step: Step) -> None:
        balance = step.balance
        iteration = Iteration(problem.cells, step.number, balance.residual_rms, abs(balance.load_error), step.change)
        self.history.append(iteration)
        if self.progress:
            self.progress(iteration)


def figures(balance: Balance, gap_scale: float) -> Figures:
    """The first figures of a balance; lengths in the unit of `gap_scale`."""
    problem, pressure = balance.problem, balance.pressure
    touching = balance.in_contact & (pressure > 0.0)
    gap = np.maximum(balance.gap, problem.contact_gap)
    return Figures(
        car=float(touching[problem.zone()].mean()),
        clr=float(pressure[touching].sum() / (pressure.sum() or 1.0)),
        h_min=float(gap.min()) * gap_scale,
        h_central=float(gap[problem.zone(CENTRE)].mean()) * gap_scale,
    )


def contact_problem(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    options: Options,
    viscosity_factor: Field | None = None,
    *,
    attempt: str = ATTEMPTS[0],
) -> Problem:
    """The dimensionless problem on the surface's own grid, as the attempt poses it."""
    scales = Scales.of(conditions, lubricant)
    grid, line = surface.grid, conditions.geometry == "line"
    (dx, dy), (left, front) = grid.spacing, grid.lower
    load = conditions.line_load * grid.extent[1] if line else conditions.load
    radius, modulus = conditions.radius_along_rolling, conditions.pair.effective_modulus
    return Problem(
        form=Form(
            flatness=0.0 if line else radius / conditions.radius_across_rolling,
            compliance=2.0 * scales.pressure * radius / (np.pi * modulus * scales.length),
            aspect=np.inf if line else conditions.hertz.half_widths[1] / scales.length,
            periodic=line,
        ),
        roughness=surface.heights / scales.gap,
        lower=(left / scales.length, front / scales.length),
        spacing=(dx / scales.length, dy / scales.length),
        load=load / (scales.pressure * scales.length**2),
        p_cap=np.inf if conditions.hardness is None else conditions.hardness / scales.pressure,
        contact_gap=options.contact_film / scales.gap if lubricant else 0.0,
        speed=scales.speed,
        sliding=conditions.sliding_speed / scales.gap,
        p_scale=scales.pressure,
        lubricant=lubricant,
        viscosity_factor=viscosity_factor,
        accurate=attempt == ATTEMPTS[0] and not np.any(surface.heights),
    )


def first_guess(
    problem: Problem, conditions: ContactConditions, lubricant: Lubricant | None, scales: Scales
) -> tuple[Field, float]:
    """Hertz pressure, with the bodies as far apart as the film of a smooth contact holds them."""
    across = problem.y / problem.form.aspect
    pressure = np.sqrt(np.maximum(1.0 - (problem.x**2)[:, None] - across**2, 0.0))
    pressure = np.minimum(pressure, problem.p_cap)
    film = smooth_film(conditions, lubricant) / scales.gap if lubricant else 0.0
    smooth = problem.form.gap(problem.x, problem.y) + problem.deflection(pressure)
    return pressure, film - float(np.min(smooth))


def smooth_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Least film of the smooth contact [m] by the usual fits.

    Line: H = 2.65 G^0.54 U^0.7 W^-0.13, Dowson (1968). Point and elliptic: H = 3.63 U^0.68 G^0.49 W^-0.073
    (1 - exp(-0.68 k)), k the axis ratio across over along rolling, Hamrock and Dowson (1977).
    """
    radius, modulus = conditions.radius_along_rolling, conditions.pair.effective_modulus
    material = float(lubricant.viscosity.log_slope(np.zeros(1))[0]) * modulus
    speed = lubricant.viscosity.eta0 * conditions.entrainment_speed / (modulus * radius)
    if conditions.geometry == "line":
        load = conditions.line_load / (modulus * radius)
        return float(2.65 * material**0.54 * speed**0.7 * load**-0.13 * radius)
    a, b = conditions.hertz.half_widths
    load = conditions.load / (modulus * radius**2)
    side_leakage = 1.0 - np.exp(-0.68 * b / a)
    return float(3.63 * speed**0.68 * material**0.49 * load**-0.073 * side_leakage * radius)


def grid_levels(finest: Problem) -> list[Problem]:
    """The problem on its own grid and on coarser and coarser ones."""
    levels = [finest]
    while (cells := _halved(levels[-1].cells)) != levels[-1].cells:
        levels.append(levels[-1].coarsened(cells))
    return levels


def _halved(cells: tuple[int, int]) -> tuple[int, int]:
    nx, ny = ((n + 1) // 2 if n // 2 >= FEWEST_COARSE_CELLS else n for n in cells)
    return nx, ny


def on_one_line(problem: Problem) -> Problem:
    """What does not vary along y, on one line of cells that is as wide as all."""
    factor, (dx, dy) = problem.viscosity_factor, problem.spacing
    return replace(
        problem,
        roughness=problem.roughness[:, :1],
        viscosity_factor=None if factor is None else factor[:, :1],
        spacing=(dx, problem.cells[1] * dy),
    )


def _warm_start(start: ContactSolution, cells: tuple[int, int], scales: Scales) -> tuple[Field, float]:
    pressure = start.pressure / scales.pressure
    if cells[1] == 1:
        pressure = pressure.mean(axis=1, keepdims=True)
    if pressure.shape != cells:
        raise BadInput(f"start has {start.grid.cells} cells, the surface {cells}; solve without start")
    return pressure, start.rigid_approach / scales.gap


def _check_factor(factor: Field, surface: Surface) -> None:
    if factor.shape != surface.grid.cells or not np.all((factor > 0.0) & (factor < np.inf)):
        raise BadInput(
            f"viscosity_factor must be positive on the surface's {surface.grid.cells} cells, "
            f"got shape {factor.shape} from {np.min(factor):g} to {np.max(factor):g}"
        )


def _check_grid(conditions: ContactConditions, surface: Surface) -> None:
    grid, line = surface.grid, conditions.geometry == "line"
    if grid.periodic != (False, line):
        raise BadInput(
            f"a {conditions.geometry} contact needs a grid with periodic=(False, {line}), got periodic={grid.periodic}"
        )
    a, b = conditions.hertz.half_widths
    for axis, index, half in [("x", 0, a)] if line else [("x", 0, a), ("y", 1, b)]:
        low, high, spacing = grid.lower[index], grid.upper[index], grid.spacing[index]
        if low > -1.2 * half or high < 1.2 * half:
            raise BadInput(
                f"grid from {low * 1e6:.4g} to {high * 1e6:.4g} um along {axis} must reach at least "
                f"1.2 Hertz half-widths ({1.2 * half * 1e6:.4g} um) to both sides; widen it"
            )
        if spacing > 0.25 * half:
            raise BadInput(
                f"cells of {spacing * 1e6:.3g} um along {axis} leave fewer than 8 across the contact of "
                f"{2.0 * half * 1e6:.3g} um; use more cells"
            )
