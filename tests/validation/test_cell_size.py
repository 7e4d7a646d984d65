"""Load share of elastic bodies on finer grids: the same roughness, standing in a line contact."""

import numpy as np
import pytest

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import film_fits, solve_contact
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state
from asperity.surface import gaussian_surface

OIL = Lubricant(
    viscosity=Roelands(0.04, 20e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
)


def load_share(cells, film_ratio, lengths_per_sq):
    """Return CLR at Hertz pressure 1 GPa, without a pressure cap."""
    pair, radius, length = ElasticPair((206e9, 206e9), (0.3, 0.3)), 10e-3, 1e-3
    conditions = ContactConditions(
        pair=pair,
        geometry="line",
        radius=radius,
        length=length,
        load=1e18 * np.pi * radius / pair.reduced_modulus * length,
        surface_speeds=(1.0, 1.0),
    )
    a = conditions.hertz.half_widths[0]
    film = next(fit.film for fit in film_fits(conditions, OIL) if fit.place == "central")
    grid = Grid((cells, cells // 2), (-3.0 * a, -1.125 * a), (1.5 * a, 1.125 * a))
    sq = film / film_ratio
    surface = gaussian_surface(
        grid, sq=sq, correlation_length=lengths_per_sq * sq, rng=np.random.default_rng(3)
    )
    return contact_state(solve_contact(conditions, OIL, surface)).clr


def test_the_load_share_of_standing_roughness_agrees_on_a_grid_twice_as_fine():
    coarse, fine = (load_share(cells, 0.5, 40.0) for cells in (64, 128))
    assert coarse == pytest.approx(fine, abs=0.03)
