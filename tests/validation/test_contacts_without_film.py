"""Contacts without an oil film: at rest and dry, or smooth and too slow for a film."""

import math

import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput
from asperity.results import solve_case
from asperity.solution import contact_state, friction

CONTACT = """{lubricant}
[contact]
geometry = "line"
radius = "10 mm"
length = "10 mm"
load = "500 N"
entrainment_speed = "{speed}"
slip = 0.1
[material]
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[surface]
{surface}
[grid]
cells = [96, 48]
"""
OIL = """[lubricant]
viscosity = { law = "roelands", eta0 = "20 mPa s", alpha = "18 1/GPa" }
density = { law = "dowson-higginson", rho0 = "870 kg/m^3" }
rheology = "newtonian"
"""
DRY = 'lubricant = "none"'
ROUGH = 'kind = "gaussian"\nsq = "0.3 um"\ncorrelation_length = "20 um"'


@pytest.fixture
def case(tmp_path):
    def write(speed, lubricant=DRY, surface=ROUGH):
        path = tmp_path / "case.toml"
        body = CONTACT.format(
            lubricant=lubricant if lubricant == DRY else "", speed=speed, surface=surface
        )
        path.write_text(body + (lubricant if lubricant != DRY else ""))
        return load_case(path)

    return write


def test_a_dry_contact_at_rest_is_that_in_motion_without_friction_power(case):
    rest, moving = (solve_case(case(speed), surfaces=1) for speed in ("0 m/s", "1 m/s"))
    assert rest.state.clr == moving.state.clr == pytest.approx(1.0)
    assert rest.state.p_max == moving.state.p_max
    assert friction(rest.solution).power == 0.0
    numbers = [value for value in rest.scalars().values() if isinstance(value, float)]
    assert all(map(math.isfinite, numbers))
    assert rest.verdict().startswith("Dry contact: asperities carry")
    assert rest.case.conditions.slide_to_roll == 0.0


@pytest.mark.parametrize("speed", ["0 m/s", "-1 m/s"])
def test_a_lubricated_contact_needs_a_speed(case, speed):
    with pytest.raises(BadInput, match=r"contact\.entrainment_speed must be .*positive|negative"):
        case(speed, OIL)


def test_smooth_bodies_below_the_contact_film_touch_without_asperities(case):
    """A fitted film of 0.06 nm: solid contact at the contact film of 5 nm, whatever the grid."""
    run = solve_case(case("10 um/s", OIL, 'kind = "flat"'))
    assert contact_state(run.solution).clr > 0.9
    assert run.verdict().startswith("Boundary lubrication: solid contact carries")
    assert run.undetermined is None
    note = next(note for note in run.notes if "contact film" in note)
    assert "0.061 nm by the fit of its regime, is below the contact film of 5 nm" in note
    assert "asperit" not in run.verdict()
    assert not any("across the inlet" in note for note in run.notes)
