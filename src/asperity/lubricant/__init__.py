"""The oil: one family of laws a file, and the lubricant made of one of each."""

from dataclasses import dataclass

from asperity.lubricant.density import DENSITY_LAWS, DensityLaw, DowsonHigginson, Incompressible
from asperity.lubricant.rheology import RHEOLOGY_LAWS, Newtonian, ReeEyring, RheologyLaw
from asperity.lubricant.viscosity import VISCOSITY_LAWS, Barus, Roelands, ViscosityLaw

__all__ = [
    "DENSITY_LAWS",
    "RHEOLOGY_LAWS",
    "VISCOSITY_LAWS",
    "Barus",
    "DensityLaw",
    "DowsonHigginson",
    "Incompressible",
    "Lubricant",
    "Newtonian",
    "ReeEyring",
    "RheologyLaw",
    "Roelands",
    "ViscosityLaw",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lubricant:
    """An oil: how its viscosity and density change with pressure, and how shear thins it."""

    viscosity: ViscosityLaw
    density: DensityLaw
    rheology: RheologyLaw
