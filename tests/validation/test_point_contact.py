"""Point and elliptic contacts, dry and smooth-lubricated, against closed forms and a second-order
reference.

Reference films: Richardson extrapolation from 257 and 513 points per side, X -4.5..1.5, Y -3..3, in
Moes units H = (h/R)(2U)^-1/2, M = W (2U)^-3/4, L = G (2U)^1/4 with the mean speed in U.
"""

import numpy as np
import pytest

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import Options, least_film, solve_contact
from asperity.lubricant import Barus, Incompressible, Lubricant, Newtonian, ReeEyring, Roelands
from asperity.solution import contact_state
from asperity.surface import flat_surface
from support.paper import FirstPrinted

PAIR = ElasticPair((200e9, 200e9), (0.3, 0.3))
RADIUS, ETA0, ALPHA = 12.5e-3, 0.04, 22e-9


def moes_contact(m: float, l: float) -> tuple[ContactConditions, float]:  # noqa: E741
    """Return a ball on a flat with these Moes numbers, and the film [m] of one unit of H."""
    modulus = PAIR.effective_modulus
    twice_u = (l / (ALPHA * modulus)) ** 4
    speed = twice_u * modulus * RADIUS / (2.0 * ETA0)
    load = m * twice_u**0.75 * modulus * RADIUS**2
    conditions = ContactConditions(
        pair=PAIR, geometry="point", radius=RADIUS, load=load, surface_speeds=(speed, speed)
    )
    return conditions, RADIUS * twice_u**0.5


def films(conditions: ContactConditions, oil: Lubricant, cells: int) -> tuple[float, float]:
    """Return the film at the centre and the minimum film [m]."""
    a = conditions.hertz.half_widths[0]
    grid = Grid((cells, cells), (-4.5 * a, -3.0 * a), (1.5 * a, 3.0 * a), periodic=(False, False))
    solution = solve_contact(conditions, oil, flat_surface(grid), options=Options(tolerance=1e-6))
    middle = solution.gap[:, cells // 2 - 1 : cells // 2 + 1].mean(axis=1)
    return float(np.interp(0.0, grid.x, middle)), float(solution.gap.min())


BARUS = Lubricant(viscosity=Barus(ETA0, ALPHA), density=Incompressible(870.0), rheology=Newtonian())
ROELANDS = Lubricant(
    viscosity=Roelands(ETA0, ALPHA), density=FirstPrinted(870.0), rheology=Newtonian()
)


@pytest.mark.parametrize(
    ("m", "l", "oil", "h_central", "h_min"),
    [
        (20, 10, BARUS, 4.803, 2.961),
        (100, 5, BARUS, 3.102, 1.439),
        (20, 10, ROELANDS, 4.171, 2.823),
        (100, 5, ROELANDS, 2.736, 1.414),
    ],
)
def test_films_of_a_ball_on_a_flat(m, l, oil, h_central, h_min):  # noqa: E741
    """Extrapolated from 96 and 192 cells per side; the scheme is of second order."""
    conditions, unit = moes_contact(m, l)
    (coarse_c, coarse_m), (fine_c, fine_m) = (films(conditions, oil, cells) for cells in (96, 192))
    extrapolated_c, extrapolated_m = (
        fine_c + (fine_c - coarse_c) / 3.0,
        fine_m + (fine_m - coarse_m) / 3.0,
    )
    assert extrapolated_c / unit == pytest.approx(h_central, rel=0.005)
    assert extrapolated_m / unit == pytest.approx(h_min, rel=0.005)
    assert abs(fine_c / unit - h_central) < abs(coarse_c / unit - h_central) / 2.0


def test_a_ball_in_isoviscous_oil_is_separated_in_few_iterations():
    """From the hard fit's film, half of the soft one's, the bodies touched, and 270 iterations
    hardly separated them.
    """
    conditions, _ = moes_contact(20, 0.5)
    a = conditions.hertz.half_widths[0]
    grid = Grid((129, 129), (-4.5 * a, -3.0 * a), (1.5 * a, 3.0 * a), periodic=(False, False))
    solution = solve_contact(
        conditions, BARUS, flat_surface(grid), options=Options(contact_film=1e-12)
    )
    assert len(solution.convergence.history) < 40
    assert solution.gap.min() == pytest.approx(least_film(conditions, BARUS), rel=0.1)


@pytest.mark.parametrize("radius", [5e-3, (5e-3, 10e-3), (12e-3, 4e-3)])
def test_a_dry_contact_agrees_with_hertz(radius):
    conditions = ContactConditions(
        pair=PAIR,
        geometry="elliptic" if isinstance(radius, tuple) else "point",
        radius=radius,
        load=20.0,
        surface_speeds=(1.0, 1.0),
    )
    a, b = conditions.hertz.half_widths
    grid = Grid((128, 128), (-1.5 * a, -1.5 * b), (1.5 * a, 1.5 * b), periodic=(False, False))
    solution = solve_contact(conditions, None, flat_surface(grid), options=Options(tolerance=1e-6))
    state = contact_state(solution)
    assert state.p_max == pytest.approx(conditions.hertz.p_max, rel=2e-3)
    assert state.car_domain == pytest.approx(1.0, rel=0.01)
    along = solution.in_contact[:, 64].sum() * grid.spacing[0]
    across = solution.in_contact[64].sum() * grid.spacing[1]
    assert along == pytest.approx(2.0 * a, abs=2.0 * grid.spacing[0])
    assert across == pytest.approx(2.0 * b, abs=2.0 * grid.spacing[1])


def test_shear_thinning_reduces_the_film_only_with_sliding():
    thin = Lubricant(
        viscosity=Barus(ETA0, ALPHA), density=Incompressible(870.0), rheology=ReeEyring(1e5)
    )
    rolling, _ = moes_contact(20, 10)
    assert films(rolling, thin, 48) == pytest.approx(films(rolling, BARUS, 48), rel=1e-4)
    speed = rolling.entrainment_speed
    sliding = ContactConditions(
        pair=PAIR,
        geometry="point",
        radius=RADIUS,
        load=rolling.load,
        surface_speeds=(1.8 * speed, 0.2 * speed),
    )
    assert films(sliding, thin, 48)[0] < 0.9 * films(sliding, BARUS, 48)[0]
