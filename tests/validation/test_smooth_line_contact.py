"""The smooth lubricated line contact against a table and an independent solver.

The table is `../reference/smooth_line_contact.csv`, in micrometres or in units of R sqrt(2 eta0
u/(E' R)) (Moes). Its Roelands rows use Dowson and Higginson's density as first printed, (5.9e8 +
1.34 p)/(5.9e8 + p); with the rounded coefficients of the package, 0.6 and 1.7 1/GPa, central films
are 0.5 % thinner.
"""

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from benchmarks.search_contacts import POLYMER
from threadpoolctl import threadpool_limits

from asperity.case import load_case
from asperity.ehl import Options, solve_contact
from asperity.ehl.film_formulas import least_films
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state
from asperity.surface import flat_surface
from support.line import Oil, line_contact
from support.paper import ETA0, RADIUS, FirstPrinted, contact, grid

TABLE = Path(__file__).parents[1] / "reference" / "smooth_line_contact.csv"
ROWS = list(csv.DictReader(TABLE.read_text().splitlines()))
HERTZ = contact().hertz
A, P_H = HERTZ.half_widths[0], HERTZ.p_max
GAP = A**2 / RADIUS


def name(row):
    return f"{row['law']}{row['inlet']}"


def oil_of(row):
    alpha = float(row["alpha_1_per_gpa"]) * 1e-9
    if row["law"] == "barus":
        return Lubricant(
            viscosity=Barus(ETA0, alpha), density=DowsonHigginson(880.0), rheology=Newtonian()
        )
    return Lubricant(viscosity=Roelands(ETA0, alpha), density=FirstPrinted(), rheology=Newtonian())


def printed(row):
    unit = 1e-6
    if row["unit"] == "moes":
        speed, modulus = float(row["speed_m_per_s"]), contact().pair.effective_modulus
        unit = RADIUS * np.sqrt(2.0 * ETA0 * speed / (modulus * RADIUS))
    return float(row["h_min"]) * unit, float(row["h_central"]) * unit


@cache
def film(index, cells=256):
    """Return (h_min, h at x = 0, state) of the package."""
    row = ROWS[index]
    on = grid((cells, 8), (float(row["inlet"]), float(row["outlet"])))
    conditions = contact(speed=float(row["speed_m_per_s"]))
    solution = solve_contact(
        conditions, oil_of(row), flat_surface(on), options=Options(tolerance=1e-6)
    )
    state = contact_state(solution)
    return state.h_min, float(np.interp(0.0, on.x, solution.gap[:, 0])), state


@cache
def reference(index, nodes=501):
    """Return (h_min, h at x = 0) of the reference solver, with independent implementations of the
    laws.
    """
    row = ROWS[index]
    alpha, speed = float(row["alpha_1_per_gpa"]) * 1e-9, float(row["speed_m_per_s"])
    if row["law"] == "barus":
        c1, c2 = 0.6e-9 * P_H, 1.7e-9 * P_H
        thickening = (lambda p: alpha * P_H * p, lambda p: np.full_like(p, alpha * P_H))
    else:
        c1, c2 = 0.34 / 5.9e8 * P_H, P_H / 5.9e8
        scale, q = np.log(ETA0) + 9.67, P_H / 1.96e8
        z = alpha * 1.96e8 / scale
        thickening = (
            lambda p: scale * ((1.0 + q * p) ** z - 1.0),
            lambda p: scale * z * q * (1.0 + q * p) ** (z - 1.0),
        )
    oil = Oil(
        *thickening, lambda p: 1.0 + c1 * p / (1.0 + c2 * p), lambda p: c1 / (1.0 + c2 * p) ** 2
    )
    number = 12.0 * ETA0 * speed * RADIUS**2 / (A**3 * P_H)
    with threadpool_limits(1):  # threads slow down such small matrices
        solved = line_contact(float(row["inlet"]), float(row["outlet"]), nodes, number, oil)
    return solved.smallest * GAP, solved.central * GAP


@pytest.mark.parametrize("index", range(len(ROWS)), ids=lambda index: name(ROWS[index]))
def test_films_of_the_table(index):
    h_min, h_central = printed(ROWS[index])
    assert film(index)[0] == pytest.approx(h_min, rel=0.002)
    assert film(index)[1] == pytest.approx(h_central, rel=0.002)


@pytest.mark.parametrize("index", range(len(ROWS)), ids=lambda index: name(ROWS[index]))
def test_films_of_an_independent_solver(index):
    h_min, h_central = reference(index)
    assert film(index)[0] == pytest.approx(h_min, rel=0.0025)
    assert film(index)[1] == pytest.approx(h_central, rel=0.0025)


@pytest.mark.parametrize("index", [0, 2, 3, 6], ids=lambda index: name(ROWS[index]))
def test_the_reference_solver_agrees_with_the_table(index):
    """This makes the agreement between the two solvers meaningful."""
    h_min, h_central = printed(ROWS[index])
    assert reference(index)[0] == pytest.approx(h_min, rel=0.0025)
    assert reference(index)[1] == pytest.approx(h_central, rel=0.0025)


@pytest.mark.parametrize("index", [3, 6], ids=lambda index: name(ROWS[index]))
def test_the_central_film_converges_at_second_order(index):
    """Differences between grids decrease fourfold; with a first-order wedge they would halve."""
    coarse, middle, fine = (film(index, cells)[1] for cells in (64, 128, 256))
    assert abs(fine - middle) < abs(middle - coarse) / 2.8


def test_a_smooth_contact_with_a_film_has_no_touching_cells():
    state = film(3)[2]
    assert state.clr == state.car == 0.0
    assert state.lambda_ratio is None
    assert abs(state.load_error) < 1e-6


def test_the_film_agrees_with_dowson_and_higginson_within_ten_percent():
    """h_min/R = 2.65 G^0.54 U^0.7 W^-0.13 (1966) is a fit; the table is 5 % below it."""
    conditions = contact()
    modulus = conditions.pair.effective_modulus
    u, w = ETA0 * 1.91 / (modulus * RADIUS), 50e3 / (modulus * RADIUS)
    assert film(4)[0] == pytest.approx(
        2.65 * (20e-9 * modulus) ** 0.54 * u**0.7 * w**-0.13 * RADIUS, rel=0.1
    )


SURFACES = {
    "flat": 'kind = "flat"',
    "ground": 'kind = "ground"\nsq = "14 nm"\ngroove_width = "2 mm"\ngroove_length = "9 mm"\n'
    "direction_deg = 90\nseed = 41",
}


@pytest.mark.parametrize("surface", SURFACES)
def test_water_between_polymers_separates_them_under_hertz_pressure(tmp_path, surface):
    """M = 3700, L = 0.01: a film of 30 nm in a contact 36 mm wide, isoviscous and elastic."""
    path = tmp_path / "polymer.toml"
    path.write_text(POLYMER.format(surface=SURFACES[surface]))
    case = load_case(path)
    solution = solve_contact(case.conditions, case.lubricant, case.surface())
    fit = least_films(case.conditions, case.lubricant)["isoviscous-elastic"].film
    assert solution.convergence.iterations < 10
    assert not solution.in_contact.any()
    assert solution.pressure.max() == pytest.approx(case.conditions.hertz.p_max, rel=5e-3)
    load = solution.pressure.mean() * case.grid.extent[0] * case.conditions.line_length
    assert load == pytest.approx(case.conditions.load, rel=1e-4)
    assert solution.gap.min() == pytest.approx(fit, rel=0.05)
