"""Lubricant with one law of each family."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import cast

from asperity.core.documents import Table
from asperity.lubricant.density import DensityLaw
from asperity.lubricant.friction import BairWiner, FrictionLaw
from asperity.lubricant.laws import LawFamily, describe_law, make_law
from asperity.lubricant.rheology import RheologyLaw
from asperity.lubricant.viscosity import ViscosityLaw

STATED_ALPHA_ERROR = 0.1  # coefficients of one oil measured in several ways differ as much


@dataclass(frozen=True, slots=True, kw_only=True)
class Lubricant:
    """Oil: pressure-viscosity, pressure-density, shear-thinning and friction laws.

    `alpha_error` is half of the 90 % interval of the pressure-viscosity coefficient, relative.
    """

    viscosity: ViscosityLaw
    density: DensityLaw
    rheology: RheologyLaw
    friction: FrictionLaw = field(default_factory=BairWiner)
    alpha_error: float = STATED_ALPHA_ERROR


_FAMILIES: tuple[LawFamily, ...] = ("viscosity", "density", "rheology", "friction")


def describe_lubricant(lubricant: Lubricant) -> dict[str, dict[str, object]]:
    """Return name and parameters [SI] of each law, for run files; BadInput for unknown laws."""
    laws: dict[str, dict[str, object]] = {
        family: describe_law(family, getattr(lubricant, family)) for family in _FAMILIES
    }
    return laws | {"uncertainty": {"alpha_error": lubricant.alpha_error}}


def make_lubricant(description: Mapping[str, Table]) -> Lubricant:
    """Create an oil from the result of `describe_lubricant`."""
    laws = {
        family: make_law(family, description[family])
        for family in _FAMILIES
        if family in description
    }
    uncertainty = description.get("uncertainty", {})
    error = cast(float, uncertainty.get("alpha_error", STATED_ALPHA_ERROR))
    return Lubricant(**laws, alpha_error=error)
