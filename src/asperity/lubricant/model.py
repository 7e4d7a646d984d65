"""An oil, made of one law of each family."""

from dataclasses import dataclass, field

from asperity.lubricant.density import DensityLaw
from asperity.lubricant.friction import BairWiner, FrictionLaw
from asperity.lubricant.rheology import RheologyLaw
from asperity.lubricant.viscosity import ViscosityLaw


@dataclass(frozen=True, slots=True, kw_only=True)
class Lubricant:
    """An oil: how viscosity and density change with pressure, how shear thins it, and what shearing it costs."""

    viscosity: ViscosityLaw
    density: DensityLaw
    rheology: RheologyLaw
    friction: FrictionLaw = field(default_factory=BairWiner)
