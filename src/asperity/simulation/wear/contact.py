"""One position of the tracks, solved: maps that wear needs, and numbers; here or in worker processes.

Each is solved from nothing, so that neither the order nor the process changes a number.
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
    contact_state,
    friction,
    friction_and_heat,
    plastic_overlap,
    solve_thermal_contact,
)
from asperity.surface import Surface

LOOSELY = (
    5e-2,
    1e-2,
)  # tolerances of a first solve, from which Newton's steps at once then meet the case's own
NEARLY, AT_ONCE = (
    80,
    30,
)  # steps of the first solve on each grid, and at once: where these lead anywhere, some ten


@dataclass(frozen=True, slots=True, kw_only=True)
class SolvedPosition:
    """A contact at one position, on its own grid; or `failure`, why there is none.

    Maps: `pressure`, `asperity_pressure` (that of touching cells, what the oil there bears
    counted, as CLR counts it) and `shear` on body 1 [Pa], `film` and `overlap` (None unless asked
    for) [m], `temperatures` of both surfaces [K above ambient], None where heat could not be
    shared between the bodies.
    """

    pressure: Field
    asperity_pressure: Field
    shear: Field
    film: Field
    overlap: Field | None
    temperatures: tuple[Field, Field] | None
    state: ContactState
    friction_coefficient: float
    flash_temperature: float
    at_edge: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FailedPosition:
    """A position that could not be solved, and why."""

    reason: str


@dataclass(frozen=True, kw_only=True)
class PositionSolver:
    """Solves the case's contact over a roughness."""

    conditions: ContactConditions
    lubricant: Lubricant | None
    options: Options
    thermal: Thermal
    boundary_friction: float
    flattening: bool

    @classmethod
    def of(cls, case: Case, *, flattening: bool) -> "PositionSolver":
        """That of a case."""
        return cls(
            conditions=case.conditions,
            lubricant=case.lubricant,
            options=case.options,
            thermal=case.thermal,
            boundary_friction=case.boundary_friction,
            flattening=flattening,
        )

    def __call__(self, surface: Surface) -> SolvedPosition | FailedPosition:
        """The contact there; one thread does the algebra, as two would sum in another order."""
        with threadpool_limits(1):
            try:
                solution = self._solved(surface)
            except AsperityError as refusal:
                return FailedPosition(reason=str(refusal).rstrip("."))
            return self._read(solution)

    def _solved(self, surface: Surface) -> ContactSolution:
        """Loosely first, and to the tolerance from there.

        On plateaus that wear has left, the first way gets near the solution and then goes round,
        cells of a closed land opening and closing in turn, and a second way begins anew; from what
        the first has found, all cells follow.
        """
        most = self.options.max_iterations
        few = replace(self.options, max_iterations=min(AT_ONCE, most))
        if self.lubricant is not None and np.any(surface.heights):
            for tolerance in (one for one in LOOSELY if one > self.options.tolerance):
                loose = replace(self.options, tolerance=tolerance, max_iterations=min(NEARLY, most))
                with suppress(
                    AsperityError
                ):  # what is wrong with the contact, the case's own way says
                    near = ehl.solve_contact(
                        self.conditions, self.lubricant, surface, options=loose, strict=False
                    )
                    found = self._with_heat(surface, few, replace(near, options=few), strict=False)
                    if found.convergence.converged:
                        return found
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
        borne = np.where(solution.in_contact, np.maximum(solution.pressure, 0.0), 0.0)
        rubbing: Friction | None = None
        temperatures, flash = None, np.nan
        try:
            rubbing, heat = friction_and_heat(
                solution, boundary_friction=self.boundary_friction, thermal=self.thermal
            )
            temperatures, flash = (heat.surface_1, heat.surface_2), heat.max_k
        except AsperityError:  # the contact is as good without its heat
            rubbing = rubbing or friction(solution, boundary_friction=self.boundary_friction)
        endless = self.conditions.endless
        return SolvedPosition(
            pressure=solution.pressure,
            asperity_pressure=borne,
            shear=rubbing.shear,
            film=solution.gap,
            overlap=np.array(plastic_overlap(solution)) if self.flattening else None,
            temperatures=temperatures,
            state=contact_state(solution),
            friction_coefficient=rubbing.coefficient,
            flash_temperature=flash,
            at_edge=not endless
            and bool(
                borne[:, [1, -2]].any()
            ),  # a scar as wide as the grid, whose rim bears nothing
        )


class Crew(Protocol):
    """What solves several positions at once."""

    def __call__(self, surfaces: Sequence[Surface]) -> list[SolvedPosition | FailedPosition]:
        """In their order."""
        ...


@contextmanager
def crew(solver: PositionSolver, workers: int) -> Iterator[Crew]:
    """So many processes, or none but this one; raises AsperityError, as it works, where one cannot start or dies."""
    if min(workers, cores()) <= 1:
        yield lambda surfaces: [solver(surface) for surface in surfaces]
        return
    pool = ProcessPoolExecutor(min(workers, cores()), get_context("spawn"), set_up_worker)

    def solve(surfaces: Sequence[Surface]) -> list[SolvedPosition | FailedPosition]:
        try:
            return list(pool.map(solver, surfaces))
        except BrokenExecutor:
            raise AsperityError(
                "a worker process could not start or died, for want of memory perhaps; wear with workers=1"
            ) from None

    try:
        yield solve
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
