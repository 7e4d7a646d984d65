"""Convergence and errors of six hundred contacts from a fixed Latin hypercube.

Roughness 0.25-6 um, correlation length 10-120 um, Gaussian and self-affine, pressure cap 0.65, 1,
2 GPa or none, inlet at -1.9 or -4.5 half-widths, load 50-2000 N, speed 0.01-20 m/s. Thirty
converged contacts are solved again with a 100 times smaller tolerance.
"""

import csv
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import ContactSolution, Options, Scales, solve_contact
from asperity.ehl.problem_setup import contact_problem
from asperity.kernels.reynolds import CAPPED
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian
from asperity.solution import contact_state
from asperity.surface import Surface, gaussian_surface, self_affine_surface

CAPS_GPA = (0.65, 1.0, 2.0, None)
INLETS = (-4.5, -1.9)
OIL = Lubricant(
    viscosity=Barus(0.096, 18.2e-9), density=DowsonHigginson(880.0), rheology=Newtonian()
)
STEEL = ElasticPair((200e9, 200e9), (0.3, 0.3))


@dataclass(frozen=True)
class Contact:
    """One sample of the hypercube."""

    number: int
    sq_um: float
    correlation_length_um: float
    self_affine: bool
    cap_gpa: float | None
    inlet: float
    load_n: float
    speed: float


@dataclass(frozen=True)
class Outcome:
    """Result of a contact."""

    contact: Contact
    status: str
    steps: int
    seconds: float
    clr: float
    overlap_nm: float  # deepest overlap of the deformed bodies, outside cells at the cap
    clr_error: float | None = None

    def row(self) -> dict[str, object]:
        """Return the outcome as one flat row."""
        rest = asdict(self)
        return {**rest.pop("contact"), **rest}


def contacts(count: int = 600) -> list[Contact]:
    """Draw the fixed sample; roughness, lengths, load and speed are log-uniform."""
    from scipy.stats.qmc import LatinHypercube

    unit = LatinHypercube(d=7, rng=np.random.default_rng(20261121)).random(count)

    def between(low: float, high: float, share: float) -> float:
        return float(low * (high / low) ** share)

    return [
        Contact(
            number,
            between(0.25, 6.0, row[0]),
            between(10.0, 120.0, row[1]),
            bool(row[2] < 0.5),
            CAPS_GPA[int(row[3] * len(CAPS_GPA))],
            INLETS[int(row[4] * len(INLETS))],
            between(50.0, 2000.0, row[5]),
            between(0.01, 20.0, row[6]),
        )
        for number, row in enumerate(unit)
    ]


def prepared(
    contact: Contact, cells: int, *, shown: int | None = None
) -> tuple[ContactConditions, Surface]:
    """Return conditions and surface; the correlation length is at most 0.45 of the shorter side.

    The roughness contains only waves that a grid of `shown` cells resolves, so that it is the same
    on finer grids.
    """
    conditions = ContactConditions(
        pair=STEEL,
        geometry="line",
        radius=5.4e-3,
        length=10e-3,
        load=contact.load_n,
        surface_speeds=(1.1 * contact.speed, 0.9 * contact.speed),
        hardness=None if contact.cap_gpa is None else contact.cap_gpa * 1e9,
    )
    a = conditions.hertz.half_widths[0]
    grid = Grid((cells, cells), (contact.inlet * a, -1.6 * a), (1.9 * a, 1.6 * a))
    cell, side = max(grid.spacing) * cells / (shown or cells), min(grid.extent)
    length = min(max(contact.correlation_length_um * 1e-6, 4.0 * cell), 0.45 * side)
    rng = np.random.default_rng(contact.number)
    sq = contact.sq_um * 1e-6
    if contact.self_affine:
        cutoffs = (max(min(6.0 * cell, 0.5 * length), 4.0 * cell), max(2.0 * length, 10.0 * cell))
        return conditions, self_affine_surface(grid, sq=sq, hurst=0.8, cutoffs=cutoffs, rng=rng)
    return conditions, gaussian_surface(grid, sq=sq, correlation_length=length, rng=rng)


def overlap(solution: ContactSolution) -> float:
    """Return the depth [m] to which the deformed bodies penetrate the contact film.

    It is computed from the pressure, as the solution's gap is at least the contact film by
    construction. Cells at the pressure cap are flattened plastically and do not count.
    """
    scales = Scales.from_conditions(solution.conditions, solution.lubricant)
    problem = contact_problem(
        solution.conditions, solution.lubricant, solution.surface, solution.options
    )
    balance = problem.evaluate(
        solution.pressure / scales.pressure, solution.rigid_approach / scales.gap
    )
    elastic = balance.rows.state != CAPPED
    return float(np.max(problem.contact_gap - balance.gap[elastic], initial=0.0)) * scales.gap


def outcomes(
    *,
    count: int = 600,
    cells: int = 128,
    checked: int = 30,
    progress: Callable[[Outcome], None] = lambda _: None,
) -> Iterator[Outcome]:
    """Solve every contact; every (count/checked)-th again with a 100 times smaller tolerance."""
    for contact in contacts(count):
        conditions, surface = prepared(contact, cells)
        solution = solve_contact(conditions, OIL, surface, strict=False)
        state = contact_state(solution)
        error = None
        if contact.number % (count // checked) == 0 and solution.convergence.converged:
            tight = solve_contact(
                conditions, OIL, surface, options=Options(tolerance=1e-6), strict=False
            )
            error = (
                abs(contact_state(tight).clr - state.clr)
                if tight.convergence.converged
                else float("nan")
            )
        outcome = Outcome(
            contact,
            str(solution.convergence.status),
            solution.convergence.iterations,
            solution.convergence.seconds,
            state.clr,
            1e9 * overlap(solution),
            error,
        )
        progress(outcome)
        yield outcome


def lines(*, fast: bool, artefact: Path = Path("build/robustness.csv")) -> Iterator[str]:
    """Yield the summary as Markdown; write every contact and its result to `artefact`."""
    results = list(outcomes(count=60 if fast else 600, checked=3 if fast else 30))
    artefact.parent.mkdir(exist_ok=True)
    with artefact.open("w", newline="") as file:
        writer = csv.DictWriter(file, list(results[0].row()))
        writer.writeheader()
        writer.writerows(outcome.row() for outcome in results)
    solved = [outcome for outcome in results if outcome.status == "converged"]
    errors = [outcome.clr_error for outcome in results if outcome.clr_error is not None]
    yield "## Contacts from a fixed Latin hypercube, 128 x 128"
    yield ""
    yield (
        f"{len(solved)} of {len(results)} converged, failures are reported; median"
        f" {np.median([outcome.seconds for outcome in solved]):.2f} s and"
        f" {np.median([outcome.steps for outcome in solved]):.0f} iterations. Bodies overlap by at"
        f" most {max(outcome.overlap_nm for outcome in solved):.3f} nm. {len(errors)} were solved"
        f" again with a 100 times smaller tolerance: {sum(np.isnan(errors))} of these did not"
        f" converge; the CLR of the others differs by at most {np.nanmax(errors):.1e}. All"
        f" contacts: {artefact}."
    )
