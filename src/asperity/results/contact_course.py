"""Contact over the course of wear: its spring at three roughnesses."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.ehl import Iteration
from asperity.results.run import Run
from asperity.results.solve import solve_case
from asperity.solution import OscillatingContact

ROUGHNESS_FACTORS = (1.25, 1.0, 0.8)  # of Sq, from rough to worn
BAND_HZ = (50.0, 20_000.0)  # of modes
FREQUENCIES = 6  # at which the contact's stiffness and damping are computed


@dataclass(frozen=True, eq=False, slots=True)
class DynamicSpring:
    """Dynamic stiffness and damping of a contact over frequency [N/m, N s/m], shape (n,) each."""

    frequencies_hz: Field
    stiffness: Field
    damping: Field

    def __call__(self, frequency_hz: float) -> tuple[float, float]:
        """Return stiffness and damping at a frequency, those of the ends outside the band."""
        place = math.log(min(max(frequency_hz, self.frequencies_hz[0]), self.frequencies_hz[-1]))
        grid = np.log(self.frequencies_hz)
        return (
            float(np.interp(place, grid, self.stiffness)),
            float(np.interp(place, grid, self.damping)),
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactCourse:
    """Solved contacts of a case over the course of wear, from rough to worn.

    `own` is the number of the run with the case's own roughness, `sq` [m] that of each run.
    """

    case: Case
    sq: tuple[float, ...]
    own: int
    runs: tuple[Run, ...] = field(repr=False)

    @property
    def clr(self) -> tuple[float, ...]:
        """Load share of the asperities of each run."""
        return tuple(run.state.clr for run in self.runs)

    @cached_property
    def springs(self) -> tuple[DynamicSpring, ...]:
        """Dynamic stiffness and damping of each run.

        Raises
        ------
        AsperityError
            if the contact's dynamic stiffness does not converge.
        """
        return tuple(map(contact_spring, self.runs))


def contact_spring(run: Run) -> DynamicSpring:
    """Compute the dynamic stiffness and damping of a solved contact from 50 Hz to 20 kHz."""
    contact = OscillatingContact(run.solution)
    frequencies_hz = np.geomspace(*BAND_HZ, FREQUENCIES)
    values = [contact.evaluate(float(frequency_hz)) for frequency_hz in frequencies_hz]
    return DynamicSpring(
        frequencies_hz,
        np.array([value.stiffness for value in values]),
        np.array([value.damping for value in values]),
    )


def solve_course(
    case: Case, *, progress: Callable[[Iteration], None] | None = None
) -> ContactCourse:
    """Solve the contact of a case with 1.25, 1 and 0.8 times its Sq; once without a scalable Sq.

    The contact is a snapshot of standing roughness.

    Raises
    ------
    NotConverged
        if a contact does not converge.
    """
    still = case.with_written({"contact.roughness": "standing", "solver.surfaces": 1})
    sq = still.surface().sq
    scalable = hasattr(still.contents.surface, "sq") and still.stored is None
    factors = ROUGHNESS_FACTORS if scalable and sq > 0.0 else (1.0,)
    runs = tuple(
        solve_case(
            still if factor == 1.0 else still.with_overrides({"surface.sq": factor * sq}),
            groups=(),
            progress=progress,
        )
        for factor in factors
    )
    return ContactCourse(
        case=case, sq=tuple(factor * sq for factor in factors), own=factors.index(1.0), runs=runs
    )
