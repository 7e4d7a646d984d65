"""Interval of the friction coefficient: oil, heat, cells, surfaces."""

import dataclasses
import math

import numpy as np
import pytest
import scipy

from asperity.case import load_case
from asperity.cli.contact import short_table
from asperity.core.quantities import quantity
from asperity.lubricant import (
    Barus,
    DowsonHigginson,
    EyringShear,
    Lubricant,
    Newtonian,
    NewtonianShear,
    OilSheet,
    Roelands,
    ShearedFilm,
    describe_lubricant,
    make_lubricant,
)
from asperity.results import FrictionInterval, solve_case, traction_curve, uncertainty_rows
from asperity.results.friction_interval import friction_interval
from asperity.solution import friction
from asperity.solution.traction import LAW_ERROR, STRESS_FACTOR

MTM = """
[contact]
geometry = "point"
radius = "9.525 mm"
load = "31 N"
entrainment_speed = "2 m/s"
slip = 0.5
roughness = "standing"
[material]
name = "through-hardened bearing steel"
[lubricant]
base = "pao"
viscosity_40 = "30.5 cSt"
viscosity_100 = "5.8 cSt"
density_15 = "826 kg/m^3"
alpha_estimate = "gold"
temperature = "80 degC"
rheology = { law = "ree-eyring", tau0 = "6 MPa" }
friction = { law = "ree-eyring", tau0 = "6 MPa" }
[surface]
kind = "flat"
[solver]
surfaces = 1
"""


@pytest.fixture(scope="module")
def run():
    return solve_case(load_case(MTM).with_overrides({"grid.cells": [96, 96]}))


@pytest.mark.parametrize(
    ("temperature", "measured"), [("40 degC", 0.035), ("80 degC", 0.02), ("120 degC", 0.015)]
)
def test_traction_of_a_pao_lies_in_the_interval_by_its_data_sheet(temperature, measured):
    """Values of ball-on-disc tests at .95 GPa and slip .5, as an audit stated them."""
    case = load_case(MTM).with_overrides(
        {"lubricant.temperature": temperature, "thermal.feedback": True, "grid.cells": [96, 96]}
    )
    interval = solve_case(case).friction_interval
    assert interval.low < measured < interval.high
    assert interval.value == pytest.approx(measured, rel=0.4)  # by a factor of 2 to 3 before


def test_the_oils_part_covers_viscosity_and_stress(run):
    """Parts of a smooth contact by changed laws, on the same pressure and gap."""
    solution, rubbing = run.solution, run.friction
    oil = solution.lubricant
    exponent = math.hypot(oil.alpha_error, LAW_ERROR)

    @dataclasses.dataclass(frozen=True)
    class Thickened(type(oil.viscosity)):
        factor: float = 1.0

        def __call__(self, pressure):
            return self.eta0 * (super().__call__(pressure) / self.eta0) ** self.factor

    def coefficient(factor=1.0, tau0=6e6):
        law = Thickened(*dataclasses.astuple(oil.viscosity), factor=factor)
        changed = dataclasses.replace(oil, viscosity=law, friction=EyringShear(tau0))
        return friction(dataclasses.replace(solution, lubricant=changed)).coefficient

    below, above = (
        math.hypot(
            coefficient(1.0 + side * exponent) - rubbing.coefficient,
            coefficient(tau0=6e6 * STRESS_FACTOR**side) - rubbing.coefficient,
        )
        for side in (-1.0, 1.0)
    )
    assert rubbing.oil_below == pytest.approx(min(below, rubbing.oil_part), rel=1e-9)
    assert rubbing.oil_above == pytest.approx(above, rel=1e-9)


def test_the_law_error_is_that_of_roelands_for_squalane():
    """Bair's (2006) free-volume correlation at 40 °C, with Roelands' law of the same alpha*."""
    stiffness, volume = 8.658e9 * math.exp(-6.332e-3 * 313.15), 0.6568

    def measured(pressure):
        ratio = 1.0 - np.log(1.0 + pressure / stiffness * 12.29) / 12.29
        return 4.710 * volume * (1.0 / (ratio - volume) - 1.0 / (1.0 - volume))

    pressure = np.linspace(0.0, 4e9, 400_001)
    alpha = 1.0 / np.trapezoid(np.exp(-measured(pressure)), pressure)
    assert alpha == pytest.approx(18.1e-9, rel=0.005)

    def blok(slope):
        return 1.0 / np.trapezoid(0.0157 / Roelands(0.0157, slope)(pressure), pressure)

    slope = scipy.optimize.brentq(lambda slope: blok(slope) - alpha, 17e-9, 22e-9)
    law = Roelands(0.0157, slope)
    for high in (0.4e9, 0.6e9, 0.8e9, 1e9):
        error = np.log(law(np.array(high)) / 0.0157) / measured(high) - 1.0
        assert 0.1 < error < 1.2 * LAW_ERROR


def test_newtonian_friction_can_be_as_low_as_that_of_a_typical_oil(run):
    oil = dataclasses.replace(run.solution.lubricant, friction=NewtonianShear())
    rubbing = friction(dataclasses.replace(run.solution, lubricant=oil))
    film = ShearedFilm(
        rate=run.solution.conditions.sliding_speed / run.solution.gap,
        viscosity=oil.viscosity(run.solution.pressure),
        pressure=run.solution.pressure,
        temperature=np.full(run.solution.grid.cells, 313.0),
        transit=1e-6,
    )
    typical = EyringShear(5e6)(film)[~run.solution.cavitated].sum() / run.solution.pressure.sum()
    assert rubbing.coefficient - rubbing.oil_below <= typical * (1.0 + 1e-9)


def test_alpha_is_less_certain_estimated_than_stated():
    stated = OilSheet(grade="VG 100", alpha=2e-8).lubricant(333.15)
    mineral = OilSheet(grade="VG 100").lubricant(333.15)
    pao = OilSheet(
        viscosity_40=3e-5, viscosity_100=6e-6, density_15=826.0, base="pao", alpha_estimate="gold"
    ).lubricant(333.15)
    assert stated.alpha_error < mineral.alpha_error < pao.alpha_error
    for oil in (stated, mineral, pao):
        assert make_lubricant(describe_lubricant(oil)) == oil


def test_pure_rolling_has_no_friction_and_no_interval():
    case = load_case(MTM).with_overrides({"contact.slip": 0.0, "grid.cells": [64, 64]})
    run = solve_case(case)
    interval = run.friction_interval
    assert (interval.low, interval.value, interval.high) == (0.0, 0.0, 0.0)
    assert quantity("friction_coefficient").text_in(run.scalars()) == "0.0000"
    printed = [line for line in short_table(run) if line.endswith("  none: pure rolling")]
    assert [line.strip().partition(",")[0][:16] for line in printed] == [
        "friction coeffic",
        "maximum flash te",
    ]
    assert not any(name.startswith("µ") for name, _ in uncertainty_rows(run.error, interval))


def test_the_cold_film_lowers_the_interval_only(run):
    rubbing = run.friction
    assert rubbing.heat_below > 0.0
    interval = run.friction_interval
    assert interval.low == pytest.approx(
        max(
            0.0,
            rubbing.coefficient
            - math.hypot(rubbing.oil_below, rubbing.heat_below, interval.numerical),
        )
    )
    warm = solve_case(run.case.with_overrides({"thermal.feedback": True}))
    assert warm.friction.heat_below == 0.0
    assert interval.low < warm.friction.coefficient < rubbing.coefficient


def test_the_error_of_the_load_share_moves_friction_towards_boundary_friction():
    case = load_case(MTM).with_overrides(
        {
            "surface": {"kind": "gaussian", "sq": "0.1 um", "correlation_length": "25 um"},
            "contact.entrainment_speed": "0.2 m/s",
            "grid.cells": [96, 96],
        }
    )
    run = solve_case(case, strict=False)
    share = run.solution.convergence.error.clr
    traction = run.friction.oil_part / (1.0 - run.state.clr)
    moved = abs(case.boundary_friction - traction) * share
    assert run.friction_interval.numerical >= moved > 0.0
    unknown = dict(run.own_scalars) | {"friction_error": None}
    assert friction_interval([unknown]).low is None


def test_several_surfaces_widen_the_interval(run):
    row = dict(run.own_scalars)
    other = row | {"friction_coefficient": row["friction_coefficient"] + 0.01}
    single, both = friction_interval([row]), friction_interval([row, other])
    assert both.value == pytest.approx(single.value + 0.005)
    assert both.high - both.value > single.high - single.value


def test_curves_have_intervals(run):
    curve = traction_curve(run.case, slips=[0.0, 0.5])
    first, last = curve.points
    assert first.friction_coefficient_low == first.friction_coefficient_high == 0.0
    assert last.friction_coefficient_low == pytest.approx(run.friction_interval.low, rel=1e-6)
    assert FrictionInterval.of_oil(run.friction).text in curve.verdict()


def test_barus_and_laws_without_alpha_have_the_same_doubt():
    """The doubt refers to ln(eta/eta0) of any law."""
    oil = Lubricant(
        viscosity=Barus(0.1, 1e-8), density=DowsonHigginson(880.0), rheology=Newtonian()
    )
    assert oil.alpha_error == 0.1


def test_dry_contacts_have_boundary_friction_without_doubt():
    flat = {"lubricant": "none", "contact.slip": 0.1, "grid.cells": [64, 64]}
    run = solve_case(load_case(MTM).with_overrides(flat))
    interval = run.friction_interval
    assert interval.low == interval.value == interval.high
    assert interval.value == pytest.approx(run.case.boundary_friction)


def test_rows_of_an_earlier_version_have_no_interval(run):
    row = {key: value for key, value in run.own_scalars.items() if "oil_below" not in key}
    interval = friction_interval([row])
    assert interval.low is None
    assert interval.value == pytest.approx(run.friction.coefficient)
