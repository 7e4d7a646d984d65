"""Estimators of the pressure-viscosity coefficient from data sheets, with their validity.

All give the slope of ln η at ambient pressure, on which the laws of viscosity, film and friction
are based. Gold's and ISO's published values are effective ones in the contact, a quarter lower.
Spreads are twice the root-mean-square deviation from four measured mineral oils of high viscosity
index (`measured`), at the worst of 30, 60 and 100 °C. docs/theory/oils.md has the table.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from asperity.core.errors import BadInput
from asperity.lubricant.walther import MM2, Walther

BaseOil = Literal["mineral", "pao", "ester", "polyglycol"]

ROELANDS_Z = 0.65  # mineral oils: 0.6 to 0.68
ROELANDS_P0 = 1.96e8  # [Pa]
AT_38 = 311.15  # temperature of the viscosity in ISO/TR 15144-1 [K]
_GOLD: dict[BaseOil, tuple[float, float]] = {
    "mineral": (9.904, 0.1390),
    "pao": (7.382, 0.1335),
    "ester": (6.605, 0.1360),
    "polyglycol": (5.489, 0.1485),
}
_ISO: dict[BaseOil, tuple[float, float]] = {
    "mineral": (26.57, 0.1348),
    "pao": (14.66, 0.0507),
    "polyglycol": (13.92, 0.1572),
}
EFFECTIVE = 0.75  # an effective value in the contact over the slope at ambient pressure
OTHER_BASES = 0.4  # assumed spread: that of Gold for mineral oils, and 0.2 between sources


class OilProperties(Protocol):
    """Interface of an oil for the estimators; temperatures in kelvin."""

    @property
    def base(self) -> BaseOil:
        """Base oil."""

    @property
    def walther(self) -> Walther:
        """Kinematic viscosity as a function of temperature."""

    def density(self, temperature: float) -> float:
        """Return the density [kg/m^3]."""

    def viscosity(self, temperature: float) -> float:
        """Return the dynamic viscosity [Pa s]."""


def _roelands(oil: OilProperties, temperature: float) -> float:
    return float(ROELANDS_Z * (math.log(oil.viscosity(temperature)) + 9.67) / ROELANDS_P0)


def _so_klaus(oil: OilProperties, temperature: float) -> float:
    log = math.log10(oil.walther(temperature) / MM2)
    b = oil.walther.b
    rho = oil.density(temperature) / 1e3  # g/cm^3
    tail = 3.999 * log**3.0975 * rho**0.1162
    return float(1e-8 * (1.216 + 4.143 * log**3.0627 + 2.848e-4 * b**5.1903 * log**1.5976 - tail))


def _wooster(oil: OilProperties, temperature: float) -> float:
    return 1e-8 * (0.6 + 0.965 * math.log10(oil.viscosity(temperature) * 1e3))


def _gold(oil: OilProperties, temperature: float) -> float:
    s, t = _GOLD[oil.base]
    return float(1e-9 * s * (oil.walther(temperature) / MM2) ** t)


def _iso(oil: OilProperties, temperature: float) -> float:
    k, s = _ISO[oil.base]
    rounded = temperature - 0.15  # absolute zero is -273 °C in the standard
    return float(
        1e-9 * k * oil.viscosity(AT_38) ** s * (1.0 + 516.0 * (1.0 / rounded - 1.0 / 311.0))
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator:
    """Published estimator of the pressure-viscosity coefficient alpha [1/Pa].

    Parameters
    ----------
    title : citation
    law : published alpha of an oil at a temperature [K]
    spread : two relative standard deviations of mineral oils of high viscosity index
    min_viscosity : lower limit of validity, kinematic [m^2/s]
    bases : base oils with known constants
    share : published alpha over the slope at ambient pressure
    """

    title: str
    law: Callable[[OilProperties, float], float]
    spread: float
    min_viscosity: float
    bases: tuple[BaseOil, ...] = ("mineral",)
    share: float = 1.0

    def spread_of(self, base: BaseOil) -> float:
        """Return two relative standard deviations for a base oil."""
        return self.spread if base == "mineral" else OTHER_BASES

    def __call__(self, oil: OilProperties, temperature: float) -> float:
        """Return the slope at ambient pressure [1/Pa]; BadInput outside the range of validity.

        The estimate is also invalid where it falls with decreasing temperature.
        """
        if oil.base not in self.bases:
            others = [name for name, other in ESTIMATORS.items() if oil.base in other.bases]
            raise BadInput(
                f"{self.title} has no constants for base {oil.base!r}; give alpha, or use "
                f"alpha_estimate = {' or '.join(others)}"
            )
        nu = oil.walther(temperature)
        if nu < self.min_viscosity:
            raise BadInput(
                f"{self.title} holds above {self.min_viscosity / MM2:g} mm^2/s, but the oil has "
                f"{nu / MM2:.3g} mm^2/s at {temperature - 273.15:.4g} degC; give alpha"
            )
        alpha = self.law(oil, temperature)
        if self.law(oil, temperature + 1.0) > alpha:
            raise BadInput(
                f"{self.title} is invalid at {temperature - 273.15:.4g} degC ({nu / MM2:.3g} "
                "mm^2/s), where its alpha falls with decreasing temperature; give alpha, or use "
                "another alpha_estimate"
            )
        return alpha / self.share


ESTIMATORS: dict[str, Estimator] = {
    "roelands": Estimator(
        title=f"Roelands with Z {ROELANDS_Z}",
        law=_roelands,
        spread=0.2,
        min_viscosity=2.0 * MM2,
    ),
    "so-klaus": Estimator(
        title="So and Klaus (1980)",
        law=_so_klaus,
        spread=0.5,
        min_viscosity=1.0 * MM2,
    ),
    "wooster": Estimator(
        title="Wooster",
        law=_wooster,
        spread=0.25,
        min_viscosity=2.0 * MM2,
    ),
    "gold": Estimator(
        title="Gold",
        law=_gold,
        spread=0.35,
        min_viscosity=2.0 * MM2,
        bases=tuple(_GOLD),
        share=EFFECTIVE,
    ),
    "iso": Estimator(
        title="ISO/TR 15144-1",
        law=_iso,
        spread=0.3,
        min_viscosity=2.0 * MM2,
        bases=tuple(_ISO),
        share=EFFECTIVE,
    ),
}
