"""Waviness moving through a line contact: published amplitudes, orders of convergence, accepted
steps, cost.
"""

from collections.abc import Iterator
from functools import cache
from itertools import islice
from statistics import median
from time import perf_counter
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import Options, solve_contact
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.surface import MovingSurfaces, Surface, flat_surface
from asperity.transient import moving_contact
from benchmarks.roughness_levels import paper_case

# deformed over undeformed amplitude by wavelength over half-width, pure rolling, M 100, L 11,
# amplitude 0.1 H_c: Venner, Couhier, Lubrecht and Greenwood, Tribology Series 32 (1997) 103,
# transcribed second-hand
VENNER = {4.0: 0.030, 2.0: 0.073, 1.0: 0.183, 0.5: 0.394, 0.25: 0.660, 0.125: 0.839}
M, L = 100.0, 11.0
ALPHA, ETA0, EFFECTIVE, RADIUS = (
    2.2e-8,
    0.04,
    2.26e11,
    12.5e-3,
)  # the Moes numbers decide; these values only have to be consistent with them
OIL = Lubricant(
    viscosity=Roelands(ETA0, ALPHA), density=DowsonHigginson(870.0), rheology=Newtonian()
)
DOMAIN = (-2.5, 1.5)  # half-widths
CROSSING = 1.4  # travel in half-widths before the amplitude is measured, over one wavelength more


def master_curve(wavelength: float, moes_oil: float = L) -> float:
    """Return the curve fitted to such results, of λ/b M^(3/4)/L^(1/2) (same paper)."""
    r = wavelength * M**0.75 / moes_oil**0.5
    return 1.0 / (1.0 + 0.125 * r + 0.04 * r**2)


def contact(m: float = M, l: float = L) -> ContactConditions:  # noqa: E741
    """Return a line contact for Moes numbers, M = W (2U)^(-1/2), L = G (2U)^(1/4), pure rolling."""
    twice_u = (l / (ALPHA * EFFECTIVE)) ** 4
    speed = twice_u * EFFECTIVE * RADIUS / (2.0 * ETA0)
    young = EFFECTIVE * (1.0 - 0.3**2)
    return ContactConditions(
        pair=ElasticPair((young, young), (0.3, 0.3)),
        geometry="line",
        radius=RADIUS,
        load=m * np.sqrt(twice_u) * EFFECTIVE * RADIUS * 0.01,
        length=0.01,
        surface_speeds=(speed, speed),
    )


class Waves(NamedTuple):
    """Complex first harmonic over time of the film at each cell, relative to the undeformed
    wave.
    """

    x: np.ndarray
    harmonic: np.ndarray
    seconds: float
    steps: int

    def at(self, x: float) -> complex:
        return complex(self.harmonic[np.argmin(np.abs(self.x - x))])

    @property
    def central(self) -> float:
        return abs(self.at(0.0))


@cache
def waves(
    wavelength: float,
    cells_per_b: int,
    time_step: float = 1.0,
    share: float = 0.1,
    moes_oil: float = L,
) -> Waves:
    """Run a wave of `share` of the smooth film through the contact; lengths in half-widths."""
    conditions, (left, right) = contact(l=moes_oil), DOMAIN
    b = conditions.hertz.half_widths[0]
    period = round(wavelength * cells_per_b)
    cells = -(-round((right - left) * cells_per_b) // period) * period  # the track repeats
    left = right - cells / cells_per_b
    grid = Grid((cells, 8), (left * b, -b), (right * b, b))
    options = Options(tolerance=1e-5, contact_film=1e-9)
    smooth = solve_contact(conditions, OIL, flat_surface(grid), options=options)
    height = share * float(np.interp(0.0, grid.x, smooth.gap[:, 0]))
    profile = height * np.cos(2.0 * np.pi * grid.x / (wavelength * b))
    surfaces = MovingSurfaces.one_rough(
        Surface(np.repeat(profile[:, None], 8, axis=1), grid), conditions.surface_speeds
    )
    in_period = round(period / time_step)
    last = round(CROSSING * cells_per_b / time_step) + in_period
    began, films = perf_counter(), []
    for snapshot in moving_contact(conditions, OIL, surfaces, options=options, time_step=time_step):
        assert snapshot.solution.convergence.converged
        films.append(snapshot.solution.gap[:, 0])
        if snapshot.number == last:
            break
    travelled = np.arange(last - in_period + 1, last + 1) * time_step / cells_per_b
    turns = np.exp(2j * np.pi * travelled / wavelength)
    own = -height * np.exp(2j * np.pi * grid.x / (wavelength * b)) / 2.0  # a crest is a thin film
    return Waves(
        grid.x / b,
        (turns @ np.array(films[-in_period:])) / in_period / own,
        perf_counter() - began,
        last,
    )


def _amplitudes(*, fast: bool) -> Iterator[str]:
    grids = (64,) if fast else (64, 128, 256)
    yield (
        f"| wavelength/b | {' | '.join(f'{n} cells per half-width' for n in grids)} | Δ -> 0 |"
        " Venner"
        " | error | curve |"
    )
    yield "|---|" + "---|" * (len(grids) + 4)
    for wavelength, printed in VENNER.items():
        found = [waves(wavelength, cells).central for cells in grids]
        limit = (
            found[-1] + (found[-1] - found[-2]) / 3.0 if len(found) > 1 else None
        )  # a single grid has no extrapolation
        off = 100.0 * ((found[-1] if limit is None else limit) / printed - 1.0)
        row = " | ".join(
            "not determined" if value is None else f"{value:.4f}" for value in (*found, limit)
        )
        yield (
            f"| {wavelength:g} | {row} | {printed:.3f} | {off:+.1f} % |"
            f" {master_curve(wavelength):.3f} |"
        )


def _orders(*, fast: bool) -> Iterator[str]:
    for grids in ((32, 64, 128),) if fast else ((32, 64, 128), (64, 128, 256)):
        coarse, middle, fine = (waves(0.5, cells).at(0.0) for cells in grids)
        order = np.log2(abs(coarse - middle) / abs(middle - fine))
        yield (
            f"Order in Δx = u Δt together (wavelength b/2, {grids} cells per half-width):"
            f" {order:.2f}."
        )
    long, half, quarter = (waves(0.5, 64, time_step).at(0.0) for time_step in (0.5, 0.25, 0.125))
    order = np.log2(abs(half - long) / abs(quarter - half))
    yield (
        "Order in Δt alone (steps of 1/2, 1/4, 1/8 cell, separate time and wedge terms):"
        f" {order:.2f}."
    )
    for label, time_step in (
        ("Lagrangian, steps of 1 cell", 1.0),
        ("Eulerian, steps of 1/4 cell", 0.25),
    ):
        amplitude = abs(waves(0.125, 64, time_step).at(0.0))
        yield f"A wave of b/8 on 8 cells, {label}: {amplitude:.3f} of its height at x = 0."


def _costs(*, fast: bool) -> Iterator[str]:
    yield (
        "| Sq [um] | cells | steps | not converged | fixed approach | Newton steps | s per step |"
        " over a"
        " cold solve |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for cells in (64,) if fast else (64, 128, 256):
        for sq in (0.5, 1.0, 2.5, 4.0):
            case = paper_case(sq, 0, cells)
            steps = 40 if fast or cells > 128 else cells
            surfaces = MovingSurfaces.one_rough(case.surface(), case.conditions.surface_speeds)
            taken = moving_contact(case.conditions, case.lubricant, surfaces, options=case.options)
            start, *rest = [
                convergence.solution.convergence for convergence in islice(taken, steps + 1)
            ]
            bad, fixed_approach = (
                sum(not convergence.converged for convergence in rest),
                sum("fixed approach" in convergence.attempt for convergence in rest),
            )
            newton, seconds = (
                median(convergence.iterations for convergence in rest),
                median(convergence.seconds for convergence in rest),
            )
            ratio = seconds / start.seconds
            yield (
                f"| {sq} | {cells} | {steps} | {bad} | {fixed_approach} | {newton:g} |"
                f" {seconds:.3f} |"
                f" {ratio:.2f} |"
            )


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the tables as Markdown."""
    yield "## Motion"
    yield ""
    yield "Amplitude of moving waviness at x = 0, pure rolling, M 100, L 11:"
    yield ""
    yield from _amplitudes(fast=fast)
    yield ""
    yield from _orders(fast=fast)
    yield ""
    yield "A rough surface through the paper's contact, 2 GPa cap, tolerance 1e-4:"
    yield ""
    yield from _costs(fast=fast)
