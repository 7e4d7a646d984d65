"""Elastic bodies without a pressure cap: load share on finer grids, iterations in motion."""

from itertools import islice

import numpy as np
import pytest

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import Options, film_fits, solve_contact
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state
from asperity.surface import MovingSurfaces, gaussian_surface
from asperity.transient import moving_contact

OIL = Lubricant(
    viscosity=Roelands(0.04, 20e-9), density=DowsonHigginson(870.0), rheology=Newtonian()
)


def line_contact(hertz_pressure, speeds):
    """Return an elastic line contact of steel, without a pressure cap."""
    pair, radius, length = ElasticPair((206e9, 206e9), (0.3, 0.3)), 10e-3, 1e-3
    return ContactConditions(
        pair=pair,
        geometry="line",
        radius=radius,
        length=length,
        load=hertz_pressure**2 * np.pi * radius / pair.reduced_modulus * length,
        surface_speeds=speeds,
    )


def rough(conditions, cells, film_ratio, lengths_per_sq):
    """Return roughness of a film ratio on a grid of square cells."""
    a = conditions.hertz.half_widths[0]
    film = next(fit.film for fit in film_fits(conditions, OIL) if fit.place == "central")
    grid = Grid((cells, cells // 2), (-3.0 * a, -1.125 * a), (1.5 * a, 1.125 * a))
    sq = film / film_ratio
    return gaussian_surface(
        grid, sq=sq, correlation_length=lengths_per_sq * sq, rng=np.random.default_rng(3)
    )


def load_share(cells, film_ratio, lengths_per_sq):
    """Return CLR at Hertz pressure 1 GPa."""
    conditions = line_contact(1e9, (1.0, 1.0))
    surface = rough(conditions, cells, film_ratio, lengths_per_sq)
    return contact_state(solve_contact(conditions, OIL, surface)).clr


def test_the_load_share_of_standing_roughness_agrees_on_a_grid_twice_as_fine():
    coarse, fine = (load_share(cells, 0.5, 40.0) for cells in (64, 128))
    assert coarse == pytest.approx(fine, abs=0.03)


def test_cells_below_the_contact_film_do_not_slow_newtons_method():
    """With the mobility slope of an open cell a time step takes 44 iterations in the mean."""
    conditions = line_contact(0.43e9, (1.5, 0.5))
    moving = MovingSurfaces.one_rough(rough(conditions, 48, 0.46, 24.0), conditions.surface_speeds)
    options = Options(tolerance=1e-3)
    steps = islice(moving_contact(conditions, OIL, moving, time_step=2.0, options=options), 1, 9)
    assert np.mean([step.solution.convergence.iterations for step in steps]) < 20
