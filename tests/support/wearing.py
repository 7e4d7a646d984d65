"""A small roller on a ring for tests of wear: a case file, and the case with overrides."""

from asperity import load_case
from asperity.case import Case

CASE = """
[contact]
geometry = "line"
radius = "5.4 mm"
length = "10 mm"
load = "500 N"
entrainment_speed = "1.91 m/s"
slip = 0.2
roughness = "standing"
[material]
youngs_modulus = "200 GPa"
poisson_ratio = 0.3
hardness = "2 GPa"
[lubricant]
viscosity = { law = "barus", eta0 = "0.096 Pa s", alpha = "18.2 1/GPa" }
density = { law = "dowson-higginson", rho0 = "0.88 g/cm^3" }
rheology = { law = "newtonian" }
[surface]
kind = "gaussian"
sq = "1 um"
correlation_length = ["30 um", "30 um"]
seed = 7
[grid]
cells = [32, 16]
x = [-2.2, 1.9]
y = [-1.0, 1.0]
[vibration]
mass = "0.1 kg"
damping_ratio = 0.02
[wear]
k = "1e-16 1/Pa"
overrolling = ["50 Hz", "5 Hz"]
"""
_POINT = CASE.replace('length = "10 mm"\n', "").replace('"line"', '"point"')
POINT = _POINT.replace("y = [-1.0, 1.0]", "y = [-1.6, 1.6]")
FEW = {"wear.patches": 4}
DRY = {"lubricant": "none", "material.hardness": "none"}


def worn_case(overrides: dict[str, object] | None = None, text: str = CASE) -> Case:
    """Return the case with overrides."""
    return load_case(text, name="case.toml").with_overrides(overrides or {})
