"""Solve 200 ellipses and 100 rollers from fixed Latin hypercubes, rough and lubricated.

Ellipses: Rx 4-20 mm, Ry/Rx 0.3-10, 5-500 N. Rollers: R 2-20 mm, 1-20 mm long, 20-400 N/mm;
logarithmic profile for half to three times the load, or a circular crown with a drop of 1-50 um;
half of them tilted by up to 2 mrad. Both: Sq 0.05-2 um, correlation lengths 10-120 um or four
cells, pressure cap 1, 2, 4 GPa or none, inlet at -4.5 or -1.9 half-widths, 0.01-20 m/s.
"""

import csv
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.contact.rollers import RollerShape
from asperity.ehl import auto_grid, solve_contact
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state
from asperity.surface import Surface, gaussian_surface

STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
OIL = Lubricant(
    viscosity=Roelands(0.08, 20e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
)
CAPS = (1e9, 2e9, 4e9, None)
INLETS = (-4.5, -1.9)
ELLIPSE_CELLS, ROLLER_CELLS = (128, 128), (128, 256)
MOST_TILTED = 2e-3


def _sample(count: int, dimensions: int, seed: int) -> np.ndarray:
    from scipy.stats.qmc import LatinHypercube

    return np.asarray(LatinHypercube(d=dimensions, rng=np.random.default_rng(seed)).random(count))


def _between(low: float, high: float, share: float) -> float:
    return float(low * (high / low) ** share)


def _rough(shares: np.ndarray, number: int, grid: Grid) -> Surface:
    least, most = [4.0 * cell for cell in grid.spacing], [0.4 * side for side in grid.extent]
    sampled_length = _between(10e-6, 120e-6, shares[1])
    lengths = tuple(
        min(max(sampled_length, low), high) for low, high in zip(least, most, strict=True)
    )
    rng, sq = np.random.default_rng(number), _between(0.05e-6, 2e-6, shares[0])
    return gaussian_surface(grid, sq=sq, correlation_length=(lengths[0], lengths[1]), rng=rng)


def ellipses(count: int = 200) -> Iterator[tuple[int, ContactConditions, Surface]]:
    """Yield number, contact and roughness of each sample."""
    for number, row in enumerate(_sample(count, 8, 20261122)):
        radius, speed = _between(4e-3, 20e-3, row[2]), _between(0.01, 20.0, row[7])
        conditions = ContactConditions(
            pair=STEEL,
            geometry="elliptic",
            radius=(radius, radius * _between(0.3, 10.0, row[3])),
            load=_between(5.0, 500.0, row[4]),
            surface_speeds=(1.1 * speed, 0.9 * speed),
            hardness=CAPS[int(row[5] * len(CAPS))],
        )
        a, b = conditions.hertz.half_widths
        inlet = INLETS[int(row[6] * len(INLETS))]
        side = 0.7 * -inlet
        grid = Grid(
            ELLIPSE_CELLS, (inlet * a, -side * b), (1.9 * a, side * b), periodic=(False, False)
        )
        yield number, conditions, _rough(row, number, grid)


def rollers(count: int = 100) -> Iterator[tuple[int, ContactConditions, Surface]]:
    """Yield number, contact and roughness of each sample."""
    for number, row in enumerate(_sample(count, 11, 20261123)):
        radius, length, speed = (
            _between(2e-3, 20e-3, row[2]),
            _between(1e-3, 20e-3, row[3]),
            _between(0.01, 20.0, row[7]),
        )
        load = length * _between(2e4, 4e5, row[4])
        logarithm = RollerShape.johns_gohar(
            load * _between(0.5, 3.0, row[9]), length, radius, STEEL.reduced_modulus
        )
        crown = RollerShape(crown_radius=length**2 / 8.0 / _between(1e-6, 50e-6, row[9]))
        shape = (RollerShape(), logarithm, logarithm, crown)[int(row[8] * 4)]
        tilt = 0.0 if row[10] < 0.5 else MOST_TILTED * (4.0 * row[10] - 3.0)
        conditions = ContactConditions(
            pair=STEEL,
            geometry="roller",
            radius=radius,
            length=length,
            load=load,
            surface_speeds=(1.1 * speed, 0.9 * speed),
            hardness=CAPS[int(row[5] * len(CAPS))],
            shape=shape.tilted(tilt),
        )
        a = conditions.hertz.half_widths[0] * conditions.sliced_load.peak**0.5
        x = (INLETS[int(row[6] * len(INLETS))] * a, 1.9 * a)
        grid = auto_grid(conditions, OIL, x=x, cells=ROLLER_CELLS)
        yield number, conditions, _rough(row, number, grid)


def outcomes(
    contacts: Iterator[tuple[int, ContactConditions, Surface]],
) -> Iterator[dict[str, object]]:
    """Solve each contact and return one row for each."""
    for number, conditions, surface in contacts:
        began = time.process_time()
        solution = solve_contact(conditions, OIL, surface, strict=False)
        state, convergence = contact_state(solution), solution.convergence
        yield {
            "number": number,
            "geometry": conditions.geometry,
            "status": str(convergence.status),
            "attempt": convergence.attempt,
            "steps": convergence.iterations,
            "processor_s": time.process_time() - began,
            "clr": state.clr,
            "residual": state.reynolds_residual,
            "load_error": state.load_error,
            "sq_um": 1e6 * state.sq,
            "h_min_um": 1e6 * state.h_min,
            "p_max_gpa": 1e-9 * state.p_max,
            "shape": str(conditions.shape),
        }


def lines(*, fast: bool, artefact: Path = Path("build/bounded.csv")) -> Iterator[str]:
    """Yield the summary as Markdown; all outcomes go into `artefact`."""
    samples = {"ellipses": ellipses(20 if fast else 200), "rollers": rollers(10 if fast else 100)}
    artefact.parent.mkdir(exist_ok=True)
    yield "## Ellipses and rollers from fixed Latin hypercubes, 128 x 128 and 128 x 256"
    yield ""
    with artefact.open("w", newline="") as file:
        writer: csv.DictWriter[str] | None = None
        for name, contacts in samples.items():
            rows = []
            for row in outcomes(contacts):
                if writer is None:
                    writer = csv.DictWriter(file, list(row))
                    writer.writeheader()
                writer.writerow(row)
                file.flush()
                rows.append(row)
            solved = [row for row in rows if row["status"] == "converged"]
            times, steps = (
                [float(str(row[key])) for row in solved] for key in ("processor_s", "steps")
            )
            yield (
                f"{name}: {len(solved)} of {len(rows)} solved, failures are reported; median"
                f" {np.median(times):.1f} s of CPU time and {np.median(steps):.0f} steps, at"
                f" most {max(times):.0f} s."
            )
    yield f"All results: {artefact}."
