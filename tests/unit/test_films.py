"""Fits of smooth films: constants by quadrature, values against solved films, and the choice of
regime.
"""

import numpy as np
import pytest
import scipy
from benchmarks.films import ball

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.ehl import film_fits, film_numbers, least_film, lubrication_regime
from asperity.ehl.film_formulas import PEAK_TO_MIN_FILM, _asymptotes, central_film, least_films
from asperity.lubricant import Barus, DowsonHigginson, Incompressible, Lubricant, Newtonian
from support.paper import barus, contact

PAIR = ElasticPair((200e9, 200e9), (0.3, 0.3))


def line(load_number, oil_number, *, alpha=22e-9, eta0=0.04, radius=5.4e-3):
    """Line contact with these Moes numbers, its oil, and the film thickness [m] at H = 1."""
    modulus = PAIR.effective_modulus
    twice_u = (oil_number / (alpha * modulus)) ** 4
    speed = twice_u * modulus * radius / (2.0 * eta0)
    conditions = ContactConditions(
        pair=PAIR,
        geometry="line",
        radius=radius,
        length=0.01,
        load=load_number * twice_u**0.5 * modulus * radius * 0.01,
        surface_speeds=(speed, speed),
    )
    oil = Lubricant(
        viscosity=Barus(eta0, alpha), density=DowsonHigginson(870.0), rheology=Newtonian()
    )
    return conditions, oil, radius * twice_u**0.5


def rigid_cylinder():
    """Solve Reynolds' equation between a parabola and a plane with p = dp/dx = 0 at rupture.

    With s = x/sqrt(2 R h0): dq/ds = 12 eta u sqrt(2R) h0^-1.5 (1 + s² - c)/(1 + s²)³. Returns c,
    the film at the pressure maximum over the minimum film; q_max in 12 eta u sqrt(2R) h0^-1.5; and
    the load in 24 eta u R/h0.
    """

    def slope(s, c):
        return (1.0 + s**2 - c) / (1.0 + s**2) ** 3

    def pressure(s, c):
        return scipy.integrate.quad(slope, -np.inf, s, args=(c,))[0]

    c = scipy.optimize.brentq(lambda c: pressure(np.sqrt(c - 1.0), c), 1.05, 1.6)
    load = scipy.integrate.quad(
        lambda s: pressure(s, c), -400.0, np.sqrt(c - 1.0), limit=500, points=[-40.0, -4.0]
    )[0]
    return c, pressure(-np.sqrt(c - 1.0), c), load


def test_rigid_films_of_a_line_contact_match_reynolds_equation():
    """Martin h0 w/(eta u R) = 4.898; Blok 1.666 (alpha eta u)^2/3 at alpha q = 1; Moes' multiplied
    by c.
    """
    c, highest, load = rigid_cylinder()
    conditions, oil, unit = line(0.1, 1.0)
    numbers = film_numbers(conditions, oil)
    films = least_films(conditions, oil)
    martin = 24.0 * load * numbers.speed / numbers.load * conditions.radius
    blok = (12.0 * np.sqrt(2.0) * highest * numbers.material * numbers.speed) ** (
        2.0 / 3.0
    ) * conditions.radius
    assert films["isoviscous-rigid"].film == pytest.approx(martin, rel=1e-3)
    assert films["piezoviscous-rigid"].film == pytest.approx(blok, rel=1e-3)
    assert pytest.approx(c, rel=1e-4) == PEAK_TO_MIN_FILM
    thin, _, _ = line(0.01, 1e-3)
    assert central_film(thin, oil) == pytest.approx(c * martin_of(thin, oil), rel=0.005)
    assert _asymptotes(conditions, numbers).piezoviscous_rigid * unit == pytest.approx(
        c * blok, rel=0.002
    )


def martin_of(conditions, oil):
    return least_films(conditions, oil)["isoviscous-rigid"].film


@pytest.mark.parametrize(
    ("m", "l", "solved", "rho"),
    # central H with Roelands' law, and density at p_h: smooth line contacts by a non-uniform-grid
    # solver
    [
        (5, 10, 5.301, 1.145),
        (50, 10, 3.783, 1.242),
        (100, 5, 2.332, 1.214),
        (300, 5, 1.937, 1.257),
        (500, 10, 2.688, 1.308),
    ],
)
def test_moes_central_film_matches_the_solved_film_at_ambient_density(m, l, solved, rho):  # noqa: E741
    conditions, oil, unit = line(m, l)
    assert central_film(conditions, oil) / unit == pytest.approx(solved * rho, rel=0.04)


@pytest.mark.parametrize(("m", "l", "solved"), [(20, 10, 4.803), (100, 5, 3.102)])
def test_nijenbannings_central_film_matches_the_solved_ball(m, l, solved):  # noqa: E741
    """Barus, incompressible, extrapolated from 257 and 513 points; the fit is 11 and 13 % lower."""
    conditions, unit = ball(m, l)
    oil = Lubricant(
        viscosity=Barus(0.04, 22e-9), density=Incompressible(870.0), rheology=Newtonian()
    )
    assert central_film(conditions, oil) / unit == pytest.approx(solved, rel=0.15)


@pytest.mark.parametrize(
    ("m", "l", "regime"),
    [
        (0.05, 0.1, "isoviscous-rigid"),
        (20, 0.1, "isoviscous-elastic"),
        (1, 20, "piezoviscous-rigid"),
        (100, 10, "piezoviscous-elastic"),
    ],
)
def test_the_corners_of_the_chart(m, l, regime):  # noqa: E741
    conditions, oil, _ = line(m, l)
    assert lubrication_regime(conditions, oil) == regime
    assert {fit.place for fit in film_fits(conditions, oil)} == {"central", "least"}


def test_the_papers_contact_uses_dowsons_film():
    """Dowson's formula (1968) of the paper applies in the regime of its contact."""
    conditions, oil = contact(), barus()
    numbers = film_numbers(conditions, oil)
    dowson = (
        2.65 * numbers.material**0.54 * numbers.speed**0.7 * numbers.load**-0.13 * conditions.radius
    )
    assert least_film(conditions, oil) == pytest.approx(dowson, rel=1e-12)
    assert (numbers.moes_load, numbers.moes_oil) == pytest.approx(
        (2.342 * (2.0 / 1.91) ** 0.5, 16.97 * (1.91 / 2.0) ** 0.25), rel=1e-3
    )


def test_the_film_is_continuous_between_regimes():
    """Over six decades of speed, from thin piezoviscous films to rigid bodies."""
    speeds = np.geomspace(1e-4, 1e3, 400)
    films = np.array([least_film(contact(speed=speed), barus()) for speed in speeds])
    assert len({lubrication_regime(contact(speed=speed), barus()) for speed in speeds}) == 3
    steps = np.diff(np.log(films)) / np.diff(np.log(speeds))
    assert 0.6 < steps.min() <= steps.max() < 1.01


def test_no_fit_applies_to_a_contact_narrow_across_rolling():
    narrow = ContactConditions(
        pair=PAIR, geometry="elliptic", radius=(0.02, 0.01), load=20.0, surface_speeds=(1, 1)
    )
    wide = ContactConditions(
        pair=PAIR, geometry="elliptic", radius=(0.01, 0.02), load=20.0, surface_speeds=(1, 1)
    )
    assert film_fits(narrow, barus()) == ()
    assert len(film_fits(wide, barus())) == 3
