"""Smooth films on automatic grids: lines of M 5 to 500, a soft ball, light contacts.

Line films are compared with an independent one-dimensional solver on non-uniform nodes, X
-4.5..1.9, for M 5 -10..3; one minimum film comes from its counterpart in the tests
(`tests/validation/test_auto_grid.py` checks the same). The soft ball is compared with Hamrock and
Dowson's fit for soft bodies (1978), light contacts with a fine grid, X -30..8, 1024 cells.
"""

import time
from collections.abc import Iterator

import numpy as np

from asperity.case import load_case
from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.ehl import ContactSolution, auto_grid, solve_contact
from asperity.lubricant import Lubricant
from asperity.solution import regime_card
from asperity.surface import flat_surface
from benchmarks.films import line_case

FILMS = (  # M, L, law, H_c, H_min
    (5, 10, "Barus", 5.447, 4.577),
    (5, 10, "Roelands", 5.301, 4.441),
    (50, 10, "Barus", 3.909, 3.495),
    (50, 10, "Roelands", 3.783, 3.376),
    (100, 10, "Roelands", 3.409, 3.094),
    (100, 5, "Roelands", 2.332, 2.051),
    (300, 5, "Roelands", 1.937, 1.758),
    (500, 10, "Roelands", 2.688, 2.522),
)
LIGHT = ((2.4, 17), (0.47, 17), (0.15, 17), (2.4, 5), (0.47, 5))
WITHIN = 0.01
TRIES = 3
SOFT = """
[contact]
geometry = "point"
radius = "10 mm"
load = "1 N"
entrainment_speed = "0.1 m/s"
[material]
youngs_modulus = ["5 MPa", "70 GPa"]
poisson_ratio = [0.49, 0.22]
[lubricant]
viscosity = { law = "barus", eta0 = "0.1 Pa s", alpha = "1 1/GPa" }
density = { law = "incompressible", rho0 = "1000 kg/m^3" }
rheology = "newtonian"
[surface]
kind = "flat"
"""


def timed(conditions: ContactConditions, oil: Lubricant) -> tuple[ContactSolution, float]:
    """Return the solution on the automatic grid and the least CPU time of a few tries [s].

    The time includes the choice of the grid.
    """
    seconds = []
    for _ in range(TRIES):
        began = time.process_time()
        solution = solve_contact(
            conditions, oil, flat_surface(auto_grid(conditions, oil)), strict=False
        )
        seconds.append(time.process_time() - began)
    return solution, min(seconds)


def films(solution: ContactSolution) -> tuple[float, float]:
    """Return the film at x = 0 and the minimum film [m]."""
    middle = slice(solution.grid.cells[1] // 2 - 1, solution.grid.cells[1] // 2 + 1)
    along = solution.gap[:, middle].mean(axis=1)
    return float(np.interp(0.0, solution.grid.x, along)), float(solution.gap.min())


def heavy() -> Iterator[str]:
    yield (
        "| M, L, law | cells | time [s] | H_c | error [%] | error bar [%] | H_min | error [%] |"
        " error"
        " bar [%] | covered |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for load_number, oil_number, law, central, least in FILMS:
        conditions, oil, unit = line_case(load_number, oil_number, law)
        solution, seconds = timed(conditions, oil)
        error, cells, held = solution.convergence.error, [], True
        assert error is not None
        for film, bar, true in zip(
            films(solution), (error.h_central, error.h_min), (central, least), strict=True
        ):
            off, own = film / unit / true - 1.0, bar / film
            held = held and abs(off) <= max(WITHIN, own)
            cells.append(f"{film / unit:.3f} | {100.0 * off:+.2f} | {100.0 * own:.2f}")
        shown = " x ".join(map(str, solution.grid.cells))
        yield (
            f"| {load_number}, {oil_number}, {law} | {shown} | {seconds:.2f} | {' | '.join(cells)}"
            f" | {'yes' if held and solution.convergence.converged else 'no'} |"
        )


def light() -> Iterator[str]:
    yield "| M, L (Roelands) | cells | time [s] | H_c over that from -30 a [%] | H_min [%] |"
    yield "|---|---|---|---|---|"
    for load_number, oil_number in LIGHT:
        conditions, oil, _ = line_case(load_number, oil_number, "Roelands")
        a = conditions.hertz.half_widths[0]
        far = films(
            solve_contact(
                conditions, oil, flat_surface(Grid((1024, 8), (-30.0 * a, -a), (8.0 * a, a)))
            )
        )
        solution, seconds = timed(conditions, oil)
        off = [
            f"{100.0 * (value / reference - 1.0):+.2f}"
            for value, reference in zip(films(solution), far, strict=True)
        ]
        shown = " x ".join(map(str, solution.grid.cells))
        yield f"| {load_number}, {oil_number} | {shown} | {seconds:.2f} | {' | '.join(off)} |"


NAMES = {"central": "central", "least": "minimum"}


def soft() -> str:
    case = load_case(SOFT, name="soft")
    assert case.lubricant is not None
    solution, seconds = timed(case.conditions, case.lubricant)
    off = ", ".join(
        f"{NAMES[fit.place]} film {100.0 * fit.deviation:+.1f} % ({fit.source})"
        for fit in regime_card(solution).fits
    )
    shown = " x ".join(map(str, solution.grid.cells))
    touching = int(solution.in_contact.sum())
    return (
        f"Soft ball ({shown} cells, {seconds:.2f} s) against the fits: {off}; {touching} cells"
        " touch."
    )


def lines(*, fast: bool) -> Iterator[str]:  # noqa: ARG001 - short as it is
    """Yield the tables as Markdown."""
    yield "## Smooth films on automatic grids\n"
    yield (
        f"Lines, CPU time on one thread, least of {TRIES}; covered: error within 1 % or the"
        " stated error bar:\n"
    )
    yield from heavy()
    yield f"\n{soft()}\n"
    yield "Light contacts against the same contacts with an inlet from -30 half-widths:\n"
    yield from light()
