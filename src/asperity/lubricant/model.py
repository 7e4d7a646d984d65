"""An oil, made of one law of each family."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from asperity.lubricant.density import DensityLaw
from asperity.lubricant.friction import BairWiner, FrictionLaw
from asperity.lubricant.laws import LawFamily, describe_law, make_law
from asperity.lubricant.rheology import RheologyLaw
from asperity.lubricant.viscosity import ViscosityLaw


@dataclass(frozen=True, slots=True, kw_only=True)
class Lubricant:
    """An oil: how viscosity and density change with pressure, how shear thins it, and what shearing it costs."""

    viscosity: ViscosityLaw
    density: DensityLaw
    rheology: RheologyLaw
    friction: FrictionLaw = field(default_factory=BairWiner)


_FAMILIES: tuple[LawFamily, ...] = ("viscosity", "density", "rheology", "friction")


def describe_lubricant(lubricant: Lubricant) -> dict[str, dict[str, Any]]:
    """Name and parameters [SI] of each law, as run files keep them; BadInput for one that is not in its table."""
    return {family: describe_law(family, getattr(lubricant, family)) for family in _FAMILIES}


def make_lubricant(description: Mapping[str, Mapping[str, Any]]) -> Lubricant:
    """The oil that `describe_lubricant` describes."""
    return Lubricant(
        **{
            family: make_law(family, description[family])
            for family in _FAMILIES
            if family in description
        }
    )
