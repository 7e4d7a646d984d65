"""Smooth films against published values: line contacts in Moes numbers, balls on flats and barrels.

Line contacts are compared with the tests' independent one-dimensional solver on 3201 nodes, which
is validated with a published table; balls with Richardson-extrapolated references; balls and
barrels with the fit of Nijenbanning, Venner and Moes, Wear 176 (1994) 217 (central film, Roelands,
stated accuracy 10 %), and with Hamrock and Dowson's.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np
import scipy

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import Options, solve_contact
from asperity.ehl.problem_setup import smooth_film
from asperity.lubricant import (
    Barus,
    DowsonHigginson,
    Incompressible,
    Lubricant,
    Newtonian,
    Roelands,
)
from asperity.surface import flat_surface

PAIR = ElasticPair((200e9, 200e9), (0.3, 0.3))
RADIUS, ETA0, ALPHA = 12.5e-3, 0.04, 22e-9
NO_FLOOR = 1e-13  # [m]: low speeds give films thinner than the default contact film
ROELANDS = Lubricant(
    viscosity=Roelands(ETA0, ALPHA), density=DowsonHigginson(870.0), rheology=Newtonian()
)
BARUS = Lubricant(viscosity=Barus(ETA0, ALPHA), density=Incompressible(870.0), rheology=Newtonian())
# M, L, oil: central and minimum film, Richardson from 257 and 513 points, X -4.5..1.5, Y -3..3
REFERENCE = {
    (20, 10, "Barus"): (4.803, 2.961),
    (100, 5, "Barus"): (3.102, 1.439),
    (20, 10, "Roelands"): (4.171, 2.823),
    (100, 5, "Roelands"): (2.736, 1.414),
}


def ball(
    load_number: float, oil_number: float, ratio: float = 1.0
) -> tuple[ContactConditions, float]:
    """Return a ball or barrel (`ratio` = Rx/Ry) on a flat for Moes numbers, and the film [m] of
    H = 1.
    """
    modulus = PAIR.effective_modulus
    twice_u = (oil_number / (ALPHA * modulus)) ** 4
    speed = twice_u * modulus * RADIUS / (2.0 * ETA0)
    conditions = ContactConditions(
        pair=PAIR,
        geometry="point" if ratio == 1.0 else "elliptic",
        radius=RADIUS if ratio == 1.0 else (RADIUS, RADIUS / ratio),
        load=load_number * twice_u**0.75 * modulus * RADIUS**2,
        surface_speeds=(speed, speed),
    )
    return conditions, RADIUS * twice_u**0.5


TIMED = ((20, 10, BARUS), (100, 5, BARUS), (500, 10, ROELANDS), (20, 2, BARUS), (200, 15, BARUS))
TRIES = 5


@dataclass(frozen=True)
class Films:
    """Central and minimum film in units of H, on the finest grid and extrapolated.

    The extrapolation uses the next coarser grid.
    """

    central: float
    least: float
    central_extrapolated: float
    least_extrapolated: float
    seconds: float


def ball_films(
    load_number: float,
    oil_number: float,
    oil: Lubricant,
    cells: int,
    *,
    ratio: float = 1.0,
    reach: float = 4.5,
) -> Films:
    """Solve on X -reach..1.5, Y -3..3 half-widths, wider for a longer reach."""
    conditions, unit = ball(load_number, oil_number, ratio)
    a, b = conditions.hertz.half_widths
    wide = max(3.0, reach / 1.5)
    found = []
    for n in (cells // 2, cells):
        grid = Grid(
            (n, n), (-reach * a, -wide * b), (reach / 3.0 * a, wide * b), periodic=(False, False)
        )
        solution = solve_contact(
            conditions,
            oil,
            flat_surface(grid),
            options=Options(tolerance=1e-5, contact_film=NO_FLOOR),
        )
        middle = solution.gap[:, n // 2 - 1 : n // 2 + 1].mean(axis=1)
        found.append(
            (
                np.interp(0.0, grid.x, middle) / unit,
                solution.gap.min() / unit,
                solution.convergence.seconds,
            )
        )
    (coarse_c, coarse_m, _), (fine_c, fine_m, seconds) = found
    third = 1.0 / 3.0  # second order
    return Films(
        float(fine_c),
        float(fine_m),
        float(fine_c + third * (fine_c - coarse_c)),
        float(fine_m + third * (fine_m - coarse_m)),
        seconds,
    )


def nijenbanning(load_number: float, oil_number: float, ratio: float = 1.0) -> float:
    """Return the central film H of Nijenbanning, Venner and Moes (1994)."""
    shape = 1.0 + 0.006 * np.log(ratio) + 0.63 * ratio ** (4.0 / 7.0)
    rigid = (
        145.0 * (1.0 + 0.796 * ratio ** (14.0 / 15.0)) ** (-15.0 / 7.0) / ratio * load_number**-2.0
    )
    elastic = 3.18 * shape ** (-14.0 / 25.0) * ratio ** (-1.0 / 15.0) * load_number ** (-2.0 / 15.0)
    rigid_thick = 1.29 * (1.0 + 0.691 * ratio) ** (-2.0 / 3.0) * oil_number ** (2.0 / 3.0)
    elastic_thick = (
        1.48
        * shape ** (-7.0 / 20.0)
        * ratio ** (-1.0 / 24.0)
        * load_number ** (-1.0 / 12.0)
        * oil_number**0.75
    )
    s = 1.5 * (1.0 + np.exp(-1.2 * elastic / elastic_thick))
    thin = rigid**1.5 + (elastic**-4.0 + (1.8 / ratio) ** -4.0) ** (-3.0 / 8.0)
    thick = (rigid_thick**-8.0 + elastic_thick**-8.0) ** (-s / 8.0)
    return float((thin ** (2.0 * s / 3.0) + thick) ** (1.0 / s))


def line_case(
    load_number: float, oil_number: float, law: str
) -> tuple[ContactConditions, Lubricant, float]:
    """Return a line contact for Moes numbers, its oil, and the film [m] of H = 1."""
    modulus, radius = PAIR.effective_modulus, 5.4e-3
    twice_u = (oil_number / (ALPHA * modulus)) ** 4
    speed = twice_u * modulus * radius / (2.0 * ETA0)
    conditions = ContactConditions(
        pair=PAIR,
        geometry="line",
        radius=radius,
        length=10e-3,
        load=load_number * twice_u**0.5 * modulus * radius * 10e-3,
        surface_speeds=(speed, speed),
    )
    viscosity = Roelands(ETA0, ALPHA) if law == "Roelands" else Barus(ETA0, ALPHA)
    oil = Lubricant(viscosity=viscosity, density=DowsonHigginson(870.0), rheology=Newtonian())
    return conditions, oil, radius * twice_u**0.5


def line_films(load_number: float, oil_number: float, law: str, cells: int) -> tuple[float, float]:
    """Return the film at x = 0 and the minimum film in units of H; light loads get a longer
    inlet.
    """
    conditions, oil, unit = line_case(load_number, oil_number, law)
    a = conditions.hertz.half_widths[0]
    reach = (
        10.0 if load_number <= 10.0 else 4.5 if load_number <= 20.0 else 2.5
    )  # thin films need only a short inlet
    grid = Grid((cells, 8), (-reach * a, -a), (max(1.4, 0.3 * reach) * a, a))
    solution = solve_contact(
        conditions, oil, flat_surface(grid), options=Options(tolerance=1e-7, contact_film=NO_FLOOR)
    )
    return float(np.interp(0.0, grid.x, solution.gap[:, 0]) / unit), float(
        solution.gap.min() / unit
    )


def fft_pair() -> Callable[[], object]:
    """Return a real FFT pair of 512 x 512 in double precision, the unit of the times."""
    field = np.random.default_rng(0).random((512, 512))
    return lambda: scipy.fft.irfft2(scipy.fft.rfft2(field), s=field.shape)


def spent(work: Callable[[], object], tries: int) -> float:
    """Return the least CPU time [s] of several tries."""
    times = []
    for _ in range(tries):
        began = process_time()
        work()
        times.append(process_time() - began)
    return min(times)


def _timed(load_number: float, oil_number: float, oil: Lubricant) -> str:
    """Return the cost of a ball; the FFT pair is measured in between."""
    conditions, unit = ball(load_number, oil_number)
    a, n, pair = conditions.hertz.half_widths[0], 257, fft_pair()
    surface = flat_surface(
        Grid((n, n), (-4.5 * a, -3.0 * a), (1.5 * a, 3.0 * a), periodic=(False, False))
    )
    options = Options(contact_film=NO_FLOOR)
    seconds, fft_seconds = [], []
    for _ in range(TRIES):
        fft_seconds.append(spent(pair, TRIES))
        seconds.append(spent(lambda: solve_contact(conditions, oil, surface, options=options), 1))
    solution = solve_contact(conditions, oil, surface, options=options)
    steps = [
        sum(step.cells[0] == cells for step in solution.convergence.history)
        for cells in (65, 129, 257)
    ]
    law = type(oil.viscosity).__name__
    found = (
        np.interp(0.0, surface.grid.x, solution.gap[:, n // 2]) / unit,
        solution.gap.min() / unit,
    )
    off = ["-", "-"]
    if (known := REFERENCE.get((load_number, oil_number, law))) is not None:
        off = [
            f"{100.0 * (film / true - 1.0):+.2f}" for film, true in zip(found, known, strict=True)
        ]
    return (
        f"| {load_number}, {oil_number}, {law} | {', '.join(map(str, steps))} | {min(seconds):.2f}"
        f" | {min(seconds) / min(fft_seconds):.0f} | {' | '.join(off)} |"
    )


LINE_CASES = ((5, 5), (10, 10), (20, 2), (20, 10), (50, 15), (100, 5), (200, 10))


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the tables as Markdown."""
    yield "## Smooth films"
    yield ""
    yield (
        "Line contacts at 256 cells against 4096; the order is log2 of the ratio of errors at 128"
        " and 256 cells."
    )
    yield ""
    yield "| M, L | law | H_c | error [%] | order | H_min | error [%] | order |"
    yield "|---|---|---|---|---|---|---|---|"
    for load_number, oil_number in LINE_CASES[:: 3 if fast else 1]:
        for law in ("Barus", "Roelands"):
            coarse, here, true = (
                line_films(load_number, oil_number, law, n) for n in (128, 256, 4096)
            )
            cells = []
            for before, value, reference in zip(coarse, here, true, strict=True):
                order = np.log2(abs((before - reference) / (value - reference)))
                cells.append(
                    f"{value:.3f} | {100.0 * (value / reference - 1.0):+.2f} | {order:.1f}"
                )
            yield f"| {load_number}, {oil_number} | {law} | {' | '.join(cells)} |"
    yield ""
    yield "Balls against extrapolated references:"
    yield ""
    yield (
        "| M, L, oil | cells | H_c | error [%] | extrapolated | H_min | error [%] | extrapolated"
        " | seconds |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for (load_number, oil_number, name), (central, least) in REFERENCE.items():
        films = ball_films(load_number, oil_number, ROELANDS if name == "Roelands" else BARUS, 256)
        off = [
            100.0 * (value / reference - 1.0)
            for value, reference in (
                (films.central, central),
                (films.central_extrapolated, central),
                (films.least, least),
                (films.least_extrapolated, least),
            )
        ]
        yield (
            f"| {load_number}, {oil_number}, {name} | 256 x 256 | "
            f"{films.central:.3f} | {off[0]:+.2f} | {off[1]:+.2f} | "
            f"{films.least:.3f} | {off[2]:+.2f} | {off[3]:+.2f} | {films.seconds:.2f} |"
        )
    yield ""
    yield (
        "Balls on 257 x 257 cells to 1e-4, one thread, CPU time, least of five; steps"
        " evaluated on 65, 129 and 257 cells per side; an FFT pair is a real 512 x 512 FFT and"
        " its inverse, in the same run:"
    )
    yield ""
    yield "| M, L, oil | steps | time [s] | over an FFT pair | H_c error [%] | H_min error [%] |"
    yield "|---|---|---|---|---|---|"
    for timed in TIMED:
        yield _timed(*timed)
    yield ""
    yield "Balls and barrels (Roelands) against fits; extrapolated from 256 and 512 cells per side:"
    yield ""
    yield (
        "| M, L, Rx/Ry | H_c | Nijenbanning et al. | error [%] | H_min | Hamrock and Dowson |"
        " error [%] |"
    )
    yield "|---|---|---|---|---|---|---|"
    balls = [
        (load_number, oil_number, 1.0)
        for load_number in (5, 20, 100, 500)
        for oil_number in (2, 5, 10, 15)
    ]
    barrels = [(100, 10, ratio) for ratio in (0.5, 0.2, 0.1, 2.0)]
    for load_number, oil_number, ratio in [
        *balls[:: 5 if fast else 1],
        *barrels[:: 3 if fast else 1],
    ]:
        films = ball_films(
            load_number,
            oil_number,
            ROELANDS,
            256 if fast else 512,
            ratio=ratio,
            reach=9.0 if load_number <= 20 else 4.5,
        )
        conditions, unit = ball(load_number, oil_number, ratio)
        fit, least = (
            nijenbanning(load_number, oil_number, ratio),
            smooth_film(conditions, ROELANDS) / unit,
        )
        yield (
            f"| {load_number}, {oil_number}, {ratio:g} | {films.central_extrapolated:.3f} |"
            f" {fit:.3f} | {100.0 * (films.central_extrapolated / fit - 1.0):+.1f} |"
            f" {films.least_extrapolated:.3f} | {least:.3f} |"
            f" {100.0 * (films.least_extrapolated / least - 1.0):+.1f} |"
        )
