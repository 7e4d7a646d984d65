"""Lubricant with one law of each family."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from asperity.core.documents import Table
from asperity.lubricant.density import DensityLaw
from asperity.lubricant.friction import BairWiner, FrictionLaw
from asperity.lubricant.laws import LawFamily, describe_law, make_law
from asperity.lubricant.rheology import RheologyLaw
from asperity.lubricant.viscosity import ViscosityLaw


@dataclass(frozen=True, slots=True, kw_only=True)
class Lubricant:
    """Oil: pressure-viscosity, pressure-density, shear-thinning and friction laws."""

    viscosity: ViscosityLaw
    density: DensityLaw
    rheology: RheologyLaw
    friction: FrictionLaw = field(default_factory=BairWiner)


_FAMILIES: tuple[LawFamily, ...] = ("viscosity", "density", "rheology", "friction")


def describe_lubricant(lubricant: Lubricant) -> dict[str, dict[str, object]]:
    """Return name and parameters [SI] of each law, for run files; BadInput for unknown laws."""
    return {family: describe_law(family, getattr(lubricant, family)) for family in _FAMILIES}


def make_lubricant(description: Mapping[str, Table]) -> Lubricant:
    """Create an oil from the result of `describe_lubricant`."""
    return Lubricant(
        **{
            family: make_law(family, description[family])
            for family in _FAMILIES
            if family in description
        }
    )
