"""Solution at one position of the tracks: maps and numbers for wear, here or in worker processes.

Each position is solved from scratch, so neither order nor process changes a number. With moving
roughness it is reached one passage of the Hertz zone after a steady start.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing import get_context
from typing import Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from asperity import ehl
from asperity.case import Case
from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.core.processes import cores, set_up_worker
from asperity.ehl import ContactSolution, ContactState, Options
from asperity.lubricant import Lubricant, Thermal
from asperity.solution import (
    Friction,
    Observables,
    Sensing,
    contact_state,
    friction,
    friction_and_heat,
    inlet_viscosity_factor,
    observables,
    plastic_overlap,
    solve_thermal_contact,
)
from asperity.surface import MovingSurfaces, Surface
from asperity.transient import solve_passage

# tolerances of a first solve, whose result starts Newton's method at the case's own tolerance
LOOSE_TOLERANCES = (5e-2, 1e-2)
# iterations of the first solve per grid, and from its result; about ten where it converges
LOOSE_ITERATIONS, START_ITERATIONS = 80, 30


@dataclass(frozen=True, slots=True, kw_only=True)
class SolvedPosition:
    """Contact solved at one position, on its own grid.

    Maps: `pressure`, `asperity_pressure` (that of touching cells, with the oil there counted as CLR
    counts it) and `shear` on body 1 [Pa], `film` and `overlap` (None unless requested) [m],
    `temperatures` of both surfaces [K above ambient], None where the heat could not be partitioned.
    """

    pressure: Field
    asperity_pressure: Field
    shear: Field
    film: Field
    overlap: Field | None
    temperatures: tuple[Field, Field] | None
    state: ContactState
    friction: Friction
    flash_temperature: float
    observables: Observables
    at_edge: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedPosition:
    """Position that could not be solved, with the reason."""

    reason: str


@dataclass(frozen=True, kw_only=True)
class PositionSolver:
    """Solver of the case's contact over a roughness."""

    conditions: ContactConditions
    lubricant: Lubricant | None
    options: Options
    thermal: Thermal
    sensing: Sensing
    boundary_friction: float
    flattening: bool
    running: bool

    @classmethod
    def from_case(cls, case: Case, *, flattening: bool) -> "PositionSolver":
        """Return the solver of a case."""
        return cls(
            conditions=case.conditions,
            lubricant=case.lubricant,
            options=case.options,
            thermal=case.thermal,
            sensing=case.sensing,
            boundary_friction=case.boundary_friction,
            flattening=flattening,
            running=case.is_running,
        )

    def __call__(self, surfaces: MovingSurfaces) -> SolvedPosition | FailedPosition:
        """Solve the contact; single-threaded, as sums depend on the number of threads."""
        with threadpool_limits(1):
            try:
                solution = self._solved(surfaces)
            except AsperityError as refusal:
                return FailedPosition(reason=str(refusal).rstrip("."))
            return self._read(solution)

    def _solved(self, surfaces: MovingSurfaces) -> ContactSolution:
        """Return the solution with running or with standing roughness."""
        if self.running and self.lubricant is not None and any(surfaces.rough):
            return solve_passage(
                self.conditions,
                self.lubricant,
                surfaces,
                options=self.options,
                viscosity_factor=inlet_viscosity_factor(
                    self.conditions, self.lubricant, surfaces.grid, self.thermal
                ),
            )
        return self._standing(surfaces.composite_at(0.0))

    def _standing(self, surface: Surface) -> ContactSolution:
        """Solve loosely first, then to the tolerance from there.

        On worn plateaus, the default method stalls near the solution with cells that open and
        close in turn; started from the loose solution, all cells converge.
        """
        limit = self.options.max_iterations
        few = replace(self.options, max_iterations=min(START_ITERATIONS, limit))
        if self.lubricant is not None and np.any(surface.heights):
            for tolerance in (
                value for value in LOOSE_TOLERANCES if value > self.options.tolerance
            ):
                loose = replace(
                    self.options, tolerance=tolerance, max_iterations=min(LOOSE_ITERATIONS, limit)
                )
                with suppress(AsperityError):  # the regular solve below reports errors
                    guess = ehl.solve_contact(
                        self.conditions, self.lubricant, surface, options=loose, strict=False
                    )
                    trial = self._with_heat(surface, few, replace(guess, options=few), strict=False)
                    if trial.convergence.converged:
                        return trial
        return self._with_heat(surface, self.options)

    def _with_heat(
        self,
        surface: Surface,
        options: Options,
        start: ContactSolution | None = None,
        *,
        strict: bool = True,
    ) -> ContactSolution:
        return solve_thermal_contact(
            self.conditions,
            self.lubricant,
            surface,
            boundary_friction=self.boundary_friction,
            thermal=self.thermal,
            options=options,
            start=start,
            strict=strict,
        )

    def _read(self, solution: ContactSolution) -> SolvedPosition:
        asperity_pressure = np.where(solution.in_contact, np.maximum(solution.pressure, 0.0), 0.0)
        rubbing: Friction | None = None
        temperatures, flash = None, np.nan
        rise: Field | float = 0.0
        try:
            rubbing, heat = friction_and_heat(
                solution, boundary_friction=self.boundary_friction, thermal=self.thermal
            )
            temperatures = (heat.surface_1, heat.surface_2)
            flash, rise = heat.max_k, heat.film
        except AsperityError:  # the contact is valid without temperatures
            rubbing = rubbing or friction(solution, boundary_friction=self.boundary_friction)
        endless = self.conditions.endless
        return SolvedPosition(
            pressure=solution.pressure,
            asperity_pressure=asperity_pressure,
            shear=rubbing.shear,
            film=solution.gap,
            overlap=np.array(plastic_overlap(solution)) if self.flattening else None,
            temperatures=temperatures,
            state=contact_state(solution),
            friction=rubbing,
            flash_temperature=flash,
            observables=observables(solution, self.sensing, thermal=self.thermal, film_rise=rise),
            # a scar as wide as the grid; cells at the rim carry no load
            at_edge=not endless and bool(asperity_pressure[:, [1, -2]].any()),
        )


class BatchSolver(Protocol):
    """Solver of several positions at once."""

    def __call__(self, surfaces: Sequence[MovingSurfaces]) -> list[SolvedPosition | FailedPosition]:
        """Return the results in the order of the surfaces."""
        ...


@contextmanager
def position_solvers(solver: PositionSolver, workers: int) -> Iterator[BatchSolver]:
    """Create a solver with `workers` processes, or in this process for one worker.

    Solving raises AsperityError where a process cannot start or dies.
    """
    if min(workers, cores()) <= 1:
        yield lambda surfaces: [solver(surface) for surface in surfaces]
        return
    pool = ProcessPoolExecutor(min(workers, cores()), get_context("spawn"), set_up_worker)

    def solve(surfaces: Sequence[MovingSurfaces]) -> list[SolvedPosition | FailedPosition]:
        try:
            return list(pool.map(solver, surfaces))
        except BrokenExecutor:
            raise AsperityError(
                "a worker process could not start or died, possibly for lack of memory; "
                "use workers=1"
            ) from None

    try:
        yield solve
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
