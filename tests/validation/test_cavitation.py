"""Rupture and reformation of the oil film between rigid walls, against closed forms and quadratures
of the same problem.

Two published cases (B1, a parabolic slider; B3, a slider with a pocket) and three further ones: a
journal bearing by Sommerfeld's substitution, a wavy slider and a starved slider by quadrature. p =
0 is the cavitation pressure.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from asperity.core.errors import BadInput, NotConverged
from asperity.ehl import FilmBoundary, solve_film
from asperity.lubricant import Barus, DowsonHigginson

VISCOSITY, SPEED = 0.039, 4.57 / 2.0
LENGTH, MIN_GAP = 76.2e-3, 25.4e-6
GAUSS = np.polynomial.legendre.leggauss(200)


def parabola(x):
    return MIN_GAP * (1.0 + (2.0 * x / LENGTH - 1.0) ** 2)


def wave(x):
    """Three waves between slightly diverging walls, so that each wave has a different cavity."""
    return MIN_GAP * (1.2 + 0.4 * np.cos(6.0 * np.pi * x / LENGTH) + 0.1 * x / LENGTH)


def film_between(gap, *, ends=(0.0, 0.0), sides=None, inflow_content=1.0, **more):
    boundary = FilmBoundary(ends=ends, sides=sides, inflow_content=inflow_content)
    return solve_film(gap, boundary=boundary, **more)


def slider(gap, cells, *, ends=(0.0, 0.0), **more):
    x = (np.arange(cells) + 0.5) * LENGTH / cells
    more = {"viscosity": VISCOSITY, **more}
    return film_between(gap(x), spacing=LENGTH / cells, entrainment_speed=SPEED, ends=ends, **more)


def rise(gap, flux, start, end):
    """Pressure rise from start to end at this flow: the integral of 12 eta (u h - q)/h^3."""
    points, weights = GAUSS
    h = gap(start + (points + 1.0) / 2.0 * (end - start))
    return (end - start) / 2.0 * weights @ (12.0 * VISCOSITY * (SPEED * h - flux) / h**3)


def peak(gap, flux, start, end, first=0.0):
    """Pressure at the position between start and end where the gap is q/u."""
    top = brentq(lambda x: SPEED * gap(x) - flux, start, end)
    return first + rise(gap, flux, start, top)


def test_parabolic_slider_b1():
    errors = []
    for cells in (400, 800):
        film = slider(parabola, cells, ends=(3364.14, 0.0))
        (rupture,), formed = film.fronts
        errors.append(abs(film.pressure.max() / 3.594269e6 - 1.0))
        assert np.ptp(film.flux) < 1e-10 * film.flux.mean()
        assert film.flux.mean() == pytest.approx(6.547565e-5, rel=1e-5)
        assert film.load == pytest.approx(101.4578e3, rel=1e-4)
        assert rupture / LENGTH == pytest.approx(0.6789776, abs=1.0 / cells)
        assert film.spacing[0] * (np.argmax(film.pressure) + 0.5) / LENGTH == pytest.approx(
            0.321022, abs=1.0 / cells
        )
        assert formed.size == 0
    assert errors[0] < 1e-4
    assert errors[1] < errors[0] / 2.0


@pytest.mark.parametrize("cells", [100, 400])
def test_slider_with_a_pocket_b3(cells):
    length = 20e-3
    x = (np.arange(cells) + 0.5) * length / cells
    gap = np.where((x > 4e-3) & (x < 10e-3), 2e-6, 1e-6)
    film = film_between(
        gap, spacing=length / cells, entrainment_speed=0.5, viscosity=0.01, ends=(1e5, 1e5)
    )
    (rupture,), (formed,) = film.fronts
    assert np.ptp(film.flux) < 1e-10 * film.flux.mean()
    assert film.flux.mean() == pytest.approx(5.002083e-7, rel=1e-6)
    assert film.pressure.max() == pytest.approx(350e3, rel=0.8 / cells)
    assert film.content[film.cavitated].min() == pytest.approx(0.500208, rel=1e-5)
    assert film.load == pytest.approx(2458.170, rel=4e-3)
    assert rupture == pytest.approx(4e-3)
    assert formed == pytest.approx(
        9.953314e-3, abs=0.2 * length / cells
    )  # the cell at the step of the gap


@pytest.mark.parametrize("eccentricity", [0.3, 0.8])
def test_long_journal_bearing_with_a_groove_at_the_widest_gap(eccentricity):
    """Closed form by Sommerfeld's substitution, 1 + e cos(phi) = (1 - e^2)/(1 - e cos(gamma)).

    Source: the integrals of dphi/h^2 and dphi/h^3 as in Pinkus and Sternlicht (1961); rupture
    where dp/dx = p = 0.
    """
    e = eccentricity

    def second(g):
        return (g - e * np.sin(g)) / (1.0 - e**2) ** 1.5

    def third(g):
        return (g * (1.0 + e**2 / 2.0) - 2.0 * e * np.sin(g) + e**2 * np.sin(2.0 * g) / 4.0) / (
            1.0 - e**2
        ) ** 2.5

    def widest(g):
        return (1.0 - e**2) / (1.0 - e * np.cos(g))

    end = brentq(lambda g: second(g) - widest(g) * third(g), np.pi + 1e-6, 2.0 * np.pi - 1e-6)
    top = 2.0 * np.pi - end
    rupture = 2.0 * np.pi - np.arccos((widest(end) - 1.0) / e)
    largest = 12.0 * (second(top) - widest(end) * third(top))  # in eta u r/c^2
    eta, u, r, c, cells = 0.02, 3.0, 25e-3, 30e-6, 400
    angle = (np.arange(cells) + 0.5) * 2.0 * np.pi / cells
    film = film_between(
        c * (1.0 + e * np.cos(angle)),
        spacing=2.0 * np.pi * r / cells,
        entrainment_speed=u,
        viscosity=eta,
    )
    assert film.pressure.max() == pytest.approx(largest * eta * u * r / c**2, rel=5e-4)
    assert film.flux.mean() == pytest.approx(u * c * widest(end), rel=1e-4)
    assert np.ptp(film.flux) < 1e-10 * film.flux.mean()
    assert film.fronts[0][0] / r == pytest.approx(rupture, abs=2.0 * np.pi / cells)
    streams = film.cavitated & (angle > rupture + 0.1)
    np.testing.assert_allclose(
        film.content[streams] * film.gap[streams], c * widest(end), rtol=1e-4
    )


def wavy_film(outlet):
    """Flow, peaks, and positions of rupture and reformation in the wavy slider, by quadrature."""
    x = np.linspace(0.0, LENGTH, 20001)
    slope = np.diff(wave(x))
    narrow = x[1:-1][(slope[:-1] < 0.0) & (slope[1:] >= 0.0)]
    wide = np.append(x[1:-1][(slope[:-1] > 0.0) & (slope[1:] <= 0.0)], LENGTH)

    def rupture(flux, k):
        return brentq(lambda x: SPEED * wave(x) - flux, narrow[k], wide[k + 1])

    least = SPEED * wave(narrow[0])
    flux = brentq(lambda q: rise(wave, q, 0.0, rupture(q, 0)), 1.001 * least, 1.3 * least)
    ruptures = [rupture(flux, k) for k in range(3)]
    reformed = [
        brentq(lambda x, k=k: rise(wave, flux, x, ruptures[k]), wide[k], narrow[k] - 0.001 * LENGTH)
        for k in (1, 2)
    ]
    reformed.append(brentq(lambda x: rise(wave, flux, x, LENGTH) - outlet, ruptures[2], LENGTH))
    peaks = [peak(wave, flux, start, narrow[k]) for k, start in enumerate([0.0, *reformed[:2]])]
    return flux, peaks, ruptures, reformed


def test_a_wavy_slider_ruptures_and_reforms_three_times():
    outlet = 2e6
    flux, peaks, ruptures, reformed = wavy_film(outlet)
    errors = []
    for cells in (400, 800, 1600):
        film = slider(wave, cells, ends=(0.0, outlet))
        x = (np.arange(cells) + 0.5) * LENGTH / cells
        found = [film.pressure[(x > end - 0.25 * LENGTH) & (x < end)].max() for end in ruptures]
        errors.append(float(np.max(np.abs(np.divide(found, peaks) - 1.0))))
        assert np.ptp(film.flux) < 1e-10 * flux
        assert film.flux.mean() == pytest.approx(flux, rel=1e-3)
        np.testing.assert_allclose(film.fronts[0], ruptures, atol=1.5 * LENGTH / cells)
        np.testing.assert_allclose(film.fronts[1], reformed, atol=0.05 * LENGTH / cells)
    assert errors[0] < 0.02
    assert errors[1] < errors[0] / 1.7
    assert errors[2] < errors[1] / 1.7


def test_a_starved_slider_fills_where_the_gap_matches_its_flow():
    content, cells = 0.53, 800
    flux = content * SPEED * parabola(LENGTH / cells / 2.0)
    film = slider(parabola, cells, inflow_content=content)
    filled = [
        brentq(lambda x: SPEED * parabola(x) - flux, *side)
        for side in ((0.0, LENGTH / 2), (LENGTH / 2, LENGTH))
    ]
    reformed = brentq(lambda x: rise(parabola, flux, x, filled[1]), 0.0, filled[0] - 1e-4 * LENGTH)
    assert film.fronts[1] == pytest.approx([reformed], abs=0.1 * LENGTH / cells)
    assert film.fronts[0] == pytest.approx([filled[1]], abs=1.5 * LENGTH / cells)
    assert film.pressure.max() == pytest.approx(rise(parabola, flux, reformed, filled[0]), rel=0.02)
    assert np.ptp(film.flux) < 1e-10 * flux


def test_excess_oil_at_the_inlet_flows_back():
    flooded, nearly_flooded = slider(parabola, 200), slider(parabola, 200, inflow_content=0.9)
    assert flooded.flux.mean() < 0.9 * SPEED * flooded.gap[0]
    assert nearly_flooded.flux.mean() == pytest.approx(flooded.flux.mean(), rel=0.01)


def test_barus_oil_is_an_isoviscous_oil_in_reduced_pressure():
    """With eta0 exp(alpha p) the reduced pressure (1 - exp(-alpha p))/alpha satisfies the equation
    of an isoviscous oil.
    """
    alpha = 0.9 / slider(parabola, 400, viscosity=VISCOSITY).pressure.max()
    errors = []
    for cells in (400, 800):
        isoviscous = slider(parabola, cells)
        film = slider(parabola, cells, viscosity=Barus(VISCOSITY, alpha))
        errors.append(
            np.max(
                np.abs(
                    (1.0 - np.exp(-alpha * film.pressure)) / alpha / isoviscous.pressure.max()
                    - isoviscous.pressure / isoviscous.pressure.max()
                )
            )
        )
        assert film.pressure.max() > 2.0 * isoviscous.pressure.max()
        assert np.ptp(film.flux) < 1e-10 * film.flux.mean()
    assert errors[0] < 1e-3
    assert errors[1] < errors[0] / 2.0


def test_a_field_uniform_across_equals_a_line():
    line, gap = slider(wave, 200, ends=(0.0, 2e6)), wave((np.arange(200) + 0.5) * LENGTH / 200)
    field = film_between(
        np.repeat(gap[:, None], 5, axis=1),
        spacing=(LENGTH / 200, 1e-3),
        entrainment_speed=SPEED,
        viscosity=VISCOSITY,
        ends=(0.0, 2e6),
    )
    np.testing.assert_allclose(
        field.pressure, np.repeat(line.pressure[:, None], 5, axis=1), rtol=1e-8, atol=1.0
    )
    np.testing.assert_allclose(
        field.content, np.repeat(line.content[:, None], 5, axis=1), rtol=1e-8
    )
    assert field.load == pytest.approx(line.load * 5e-3)


def test_a_short_journal_bearing_has_ocvirks_pressure():
    """p = -6 eta u (b^2/4 - y^2) h'/h^3 in the converging gap, and rupture at the minimum gap.
    Source: Ocvirk (1952).
    """
    e, r, c, width, cells = 0.6, 25e-3, 30e-6, 2e-3, (200, 24)
    angle = (np.arange(cells[0]) + 0.5) * 2.0 * np.pi / cells[0]
    y = (np.arange(cells[1]) + 0.5) * width / cells[1] - width / 2.0
    gap = c * (1.0 + e * np.cos(angle))
    film = film_between(
        np.repeat(gap[:, None], cells[1], axis=1),
        spacing=(2.0 * np.pi * r / cells[0], width / cells[1]),
        entrainment_speed=3.0,
        viscosity=0.02,
        sides=(0.0, 0.0),
    )
    narrowing = c * e * np.sin(angle) / r
    expected = 6.0 * 0.02 * 3.0 * (width**2 / 4.0 - y**2) * (narrowing / gap**3)[:, None]
    assert film.pressure.max() == pytest.approx(expected.max(), rel=0.01)
    loaded = (angle > 0.5) & (angle < 2.9)
    np.testing.assert_allclose(film.pressure[loaded], expected[loaded], atol=0.03 * expected.max())
    assert film.cavitated[(angle > np.pi + 0.05)].all()


def rough_gap(cells, spread, seed=1):
    rng = np.random.default_rng(seed)
    waves = (
        np.hypot(*np.meshgrid(np.fft.fftfreq(cells), np.fft.rfftfreq(cells), indexing="ij")) * cells
    )
    heights = np.fft.irfft2(
        np.fft.rfft2(rng.standard_normal((cells, cells))) * np.exp(-((waves / 6.0) ** 2))
    )
    return 1e-6 * np.exp(spread * heights / heights.std())


@pytest.mark.parametrize(
    "oil", [{"viscosity": 0.01}, {"viscosity": Barus(0.01, 20e-9), "density": DowsonHigginson(880)}]
)
def test_no_oil_is_lost_between_rough_walls(oil):
    gap = rough_gap(64, 0.5)
    film = film_between(gap, spacing=(15e-6, 15e-6), entrainment_speed=1.0, ends=(1e5, 1e5), **oil)
    through = film.flux.sum(axis=1)
    assert np.ptp(through) < 1e-10 * through.mean()
    assert 0.1 < film.cavitated.mean() < 0.9
    assert not film.pressure[film.cavitated].any()
    assert film.pressure.min() >= 0.0
    assert film.content.max() == 1.0
    assert film.content.min() > 0.0


def test_an_unsolved_film_raises_not_converged():
    stiff = {"spacing": (40e-6, 40e-6), "entrainment_speed": 1.0, "viscosity": Barus(0.1, 20e-9)}
    with pytest.raises(NotConverged, match="imbalance") as failed:
        film_between(0.5 * rough_gap(24, 0.7), **stiff)
    assert failed.value.solution.pressure.shape == (24, 24)
    assert not film_between(0.5 * rough_gap(24, 0.7), strict=False, **stiff).residual < 1e-11


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"gap": np.zeros(20)}, "gap must be positive"),
        ({"gap": np.ones((2, 2, 2))}, "gap must have shape"),
        ({"spacing": (1.0, 1.0)}, "spacing must be one cell size"),
        ({"spacing": 0.0}, "spacing dx must be positive"),
        ({"entrainment_speed": -1.0}, "entrainment speed must be positive"),
        ({"ends": (-1.0, 0.0)}, "pressures at the ends must be finite"),
        ({"sides": (0.0, np.inf)}, "pressures at the sides must be finite"),
        ({"inflow_content": 1.5}, "inflow_content must lie"),
        ({"inflow_content": 0.5, "ends": (1e5, 0.0)}, "inflow_content must be 1 where"),
        ({"viscosity": 0.0}, "viscosity eta0 must be positive"),
    ],
)
def test_invalid_input_is_refused(wrong, message):
    valid = {"gap": np.full(20, 1e-6), "spacing": 1e-5, "entrainment_speed": 1.0, "viscosity": 0.1}
    with pytest.raises(BadInput, match=message):
        film_between(**{**valid, **wrong})
