"""A new law is one class and one table entry; case file, run file and report support it."""

import json
from dataclasses import dataclass
from typing import Annotated, get_args

import numpy as np
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter
from asperity.lubricant import (
    FRICTION_LAWS,
    LAWS,
    VISCOSITY_LAWS,
    WARMTH_LAWS,
    LawFamily,
    NewtonianShear,
    law_name,
)
from asperity.report import write_report
from asperity.results import load_run, solve_case

CASE = """
[contact]
geometry = "line"
radius = "5.4 mm"
length = "10 mm"
load = "500 N"
entrainment_speed = "1.91 m/s"
slip = 0.2
[material]
youngs_modulus = "200 GPa"
poisson_ratio = 0.3
[lubricant]
viscosity = { law = "made-up", eta0 = "96 mPa s", z = 0.6, p_ref = "196 MPa", energy = "14 kJ/mol" }
density = { law = "incompressible", rho0 = "0.88 g/cm^3" }
rheology = { law = "newtonian" }
friction = { law = "made-up" }
[surface]
kind = "flat"
[grid]
cells = [64, 16]
x = [-4.5, 1.9]
y = [-1.6, 1.6]
"""


@dataclass(frozen=True, slots=True)
class MadeUp:
    """Roelands' law by its exponent, with an energy that has no effect."""

    eta0: Annotated[float, Parameter("Pa s", "η₀")]
    z: float
    p_ref: Annotated[float, Parameter("Pa", "p_ref")]
    energy: Annotated[float | None, Parameter("J/mol")] = None

    def __call__(self, pressure):
        scale = np.log(self.eta0) + 9.67
        return self.eta0 * np.exp(scale * ((1.0 + pressure / self.p_ref) ** self.z - 1.0))

    def log_slope(self, pressure):
        return (
            (np.log(self.eta0) + 9.67)
            * self.z
            / self.p_ref
            * (1.0 + pressure / self.p_ref) ** (self.z - 1.0)
        )


@dataclass(frozen=True, slots=True)
class MadeUpShear:
    """A Newtonian film with an additional parameter."""

    twist: Annotated[float, Parameter("rad/s", "ω")] = 2.0

    def __call__(self, film):
        return NewtonianShear()(film)


@pytest.fixture
def added_laws(monkeypatch):
    monkeypatch.setitem(VISCOSITY_LAWS, "made-up", MadeUp)
    monkeypatch.setitem(FRICTION_LAWS, "made-up", MadeUpShear)


@pytest.mark.usefixtures("added_laws")
def test_a_new_law_works_from_case_to_report(tmp_path):
    case = load_case(CASE)
    assert case.lubricant.viscosity == MadeUp(0.096, 0.6, 196e6, 14e3)
    assert load_case(case.text) == case
    run = solve_case(case)
    again = load_run(run.save(tmp_path / "run.nc"))
    assert again.solution.lubricant == case.lubricant
    assert json.loads(json.dumps(again.scalars(), allow_nan=False)) == run.scalars()
    page = write_report([run, again], tmp_path / "page.html").read_text("utf-8")
    assert "made-up, η₀ = 0.096 Pa s, z = 0.6, p_ref = 196 MPa, energy = 1.4e+04 J/mol" in page
    assert "made-up, ω = 2 rad/s" in page


@pytest.mark.usefixtures("added_laws")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lubricant.viscosity.z": "0.6 m"}, "lubricant.viscosity.z must be a valid number"),
        (
            {"lubricant.viscosity.p_ref": "196e6"},
            'p_ref must be a pressure such as "2 GPa", got the bare number',
        ),
        (
            {"lubricant.viscosity.energy": "3 m"},
            'energy must be a molar energy such as "49 kJ/mol", got "3 m"',
        ),
        ({"lubricant.viscosity.law": "made-dawn"}, 'did you mean "made-up"?'),
    ],
)
def test_invalid_parameters_of_a_new_law_are_refused(change, message):
    with pytest.raises(BadInput) as refused:
        load_case(CASE).with_overrides(change)
    assert message in str(refused.value)


def test_every_law_family_has_its_table():
    assert tuple(LAWS) == get_args(LawFamily)
    assert LAWS["viscosity"] is VISCOSITY_LAWS
    assert law_name("warmth", WARMTH_LAWS["exponential"]()) == "exponential"
    with pytest.raises(
        BadInput,
        match="NewtonianShear is not a viscosity law that can be stored; add it to its table",
    ):
        law_name("viscosity", NewtonianShear())
