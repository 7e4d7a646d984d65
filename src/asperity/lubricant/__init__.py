"""The oil: one family of laws a file, and the lubricant made of one of each."""

from dataclasses import dataclass, field

from asperity.lubricant.density import DENSITY_LAWS, DensityLaw, DowsonHigginson, Incompressible
from asperity.lubricant.friction import (
    FRICTION_LAWS,
    BairWiner,
    EyringShear,
    FrictionLaw,
    LinearBairWiner,
    NewtonianShear,
    ShearedFilm,
)
from asperity.lubricant.rheology import RHEOLOGY_LAWS, Newtonian, ReeEyring, RheologyLaw
from asperity.lubricant.thermal import WARMTH_LAWS, ExponentialWarmth, RoelandsWarmth, Solid, Thermal, WarmthLaw
from asperity.lubricant.viscosity import VISCOSITY_LAWS, Barus, Roelands, ViscosityLaw

__all__ = [
    "DENSITY_LAWS",
    "FRICTION_LAWS",
    "RHEOLOGY_LAWS",
    "VISCOSITY_LAWS",
    "WARMTH_LAWS",
    "BairWiner",
    "Barus",
    "DensityLaw",
    "DowsonHigginson",
    "ExponentialWarmth",
    "EyringShear",
    "FrictionLaw",
    "Incompressible",
    "LinearBairWiner",
    "Lubricant",
    "Newtonian",
    "NewtonianShear",
    "ReeEyring",
    "RheologyLaw",
    "Roelands",
    "RoelandsWarmth",
    "ShearedFilm",
    "Solid",
    "Thermal",
    "ViscosityLaw",
    "WarmthLaw",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lubricant:
    """An oil: how viscosity and density change with pressure, how shear thins it, and what shearing it costs."""

    viscosity: ViscosityLaw
    density: DensityLaw
    rheology: RheologyLaw
    friction: FrictionLaw = field(default_factory=BairWiner)
