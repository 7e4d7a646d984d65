"""Finite rollers: best profile drop, dry, level and tilted; time to solve a lubricated roller.

Steel on steel, R 3.629 mm, 10 mm long, 2000 N: about the most loaded roller of an NU 206. The oil
has 0.04 Pa s and 20 1/GPa; pure rolling at 3.5 m/s.
"""

import time
from collections.abc import Iterator

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.contact.rollers import RollerShape
from asperity.ehl import solve_contact
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import axial_distribution, contact_state
from asperity.surface import flat_surface

STEEL = ElasticPair((206e9, 206e9), (0.3, 0.3))
RADIUS, LENGTH, LOAD = 3.629e-3, 10e-3, 2000.0
OIL = Lubricant(
    viscosity=Roelands(0.04, 20e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
)
DROPS = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)  # design load over load
TILTS = (0.0, 0.25e-3, 0.5e-3, 1e-3)
TIMED = (128, 256), (256, 512)


def conditions(shape: RollerShape) -> ContactConditions:
    """Return the conditions of a roller of this shape."""
    return ContactConditions(
        pair=STEEL,
        geometry="roller",
        radius=RADIUS,
        length=LENGTH,
        load=LOAD,
        surface_speeds=(3.5, 3.5),
        shape=shape,
    )


def lundberg(share: float) -> RollerShape:
    """Return Johns and Gohar's profile for a share of the load."""
    return RollerShape.johns_gohar(share * LOAD, LENGTH, RADIUS, STEEL.reduced_modulus)


def between(contact: ContactConditions, cells: tuple[int, int], x: tuple[float, float]) -> Grid:
    """Return a grid over `x` [half-widths] with four rows of cells past each end of the roller.

    Coarser grids then have rows past the ends, too.
    """
    a, end = contact.hertz.half_widths[0], 0.5 * LENGTH * cells[1] / (cells[1] - 8)
    return Grid(cells, (x[0] * a, -end), (x[1] * a, end), periodic=(False, False))


def _largest(shape: RollerShape) -> float:
    contact = conditions(shape)
    solution = solve_contact(contact, None, flat_surface(between(contact, (48, 258), (-2.2, 2.2))))
    return float(solution.pressure.max()) / contact.hertz.p_max


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the tables as Markdown."""
    yield "## Rollers: largest dry pressure over Hertz's, by design load of the logarithmic profile"
    yield ""
    yield f"| design load over load | {' | '.join(f'{1e3 * tilt:g} mrad' for tilt in TILTS)} |"
    yield f"|---{'|---' * len(TILTS)}|"
    for share in DROPS[::3] if fast else DROPS:
        values = (f"{_largest(lundberg(share).tilted(tilt)):.3f}" for tilt in TILTS)
        yield f"| {share:g} | {' | '.join(values)} |"
    yield ""
    yield "## Rollers: smooth and lubricated, CPU time on one thread"
    yield ""
    yield (
        "| shape | cells | iterations | time [s] | central film [um] | film at the ends [um] | edge"
        " pressure [GPa] |"
    )
    yield "|---|---|---|---|---|---|---|"
    iso = RollerShape.iso(9e-3, LENGTH)
    shapes = {
        "ISO 16281": iso,
        "the same, 0.5 mrad": iso.tilted(0.5e-3),
        "Johns and Gohar, 1.5 times the load": lundberg(1.5),
        "Johns and Gohar, the load": lundberg(1.0),
    }
    for name, shape in shapes.items():
        for cells in TIMED[:1] if fast else TIMED:
            yield _timed(name, conditions(shape), cells)
    for cells in TIMED[:1] if fast else TIMED:
        yield _timed("straight", conditions(RollerShape()), cells)


def _timed(name: str, contact: ContactConditions, cells: tuple[int, int]) -> str:
    wide = contact.sliced_load.peak**0.5
    surface = flat_surface(between(contact, cells, (-4.5 * wide, 1.5 * wide)))
    began = time.process_time()
    solution = solve_contact(contact, OIL, surface)
    seconds = time.process_time() - began
    along, state = axial_distribution(solution), contact_state(solution)
    assert along is not None
    edge, end = (
        f"{factor * found.on_grid:.3f}"
        + (" (not determined)" if found.value is None else f" ± {factor * (found.bar or 0.0):.3f}")
        for factor, found in ((1e-9, along.edge_pressure), (1e6, along.end_film))
        if found is not None
    )
    return (
        f"| {name} | {cells[0]} x {cells[1]} | {solution.convergence.iterations} | {seconds:.1f} | "
        f"{1e6 * state.h_central:.4f} | {end} | {edge} |"
    )
