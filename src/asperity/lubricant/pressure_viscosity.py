"""How viscosity answers to pressure, estimated from what a data sheet has: named estimators, each with its validity.

Estimators of an alpha at ambient pressure lie higher than those of an effective one in the
contact; which it is stands beside each. Spreads are two root mean squares against measured mineral
oils (`measured`): the four of high viscosity index at the worst of 30, 60 and 100 °C.
docs/theory/oils.md has the table.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

from asperity.core.errors import BadInput
from asperity.lubricant.walther import MM2, Walther

Base = Literal["mineral", "pao", "ester", "polyglycol"]

ROELANDS_Z = 0.65  # of mineral oils: 0.6 to 0.68
ROELANDS_P0 = 1.96e8  # [Pa]
AT_38 = 311.15  # where ISO/TR 15144-1 takes the viscosity [K]
_GOLD: dict[Base, tuple[float, float]] = {
    "mineral": (9.904, 0.1390),
    "pao": (7.382, 0.1335),
    "ester": (6.605, 0.1360),
    "polyglycol": (5.489, 0.1485),
}
_ISO: dict[Base, tuple[float, float]] = {
    "mineral": (26.57, 0.1348),
    "pao": (14.66, 0.0507),
    "polyglycol": (13.92, 0.1572),
}
AMBIENT_SLOPE = "slope at ambient pressure"
EFFECTIVE = "effective value in the contact, some 25 % below the slope at ambient pressure"


class KnownOil(Protocol):
    """What an estimator asks of an oil; temperatures in kelvin."""

    @property
    def base(self) -> Base:
        """What it is made of."""

    @property
    def walther(self) -> Walther:
        """Its viscosity over temperature."""

    def density(self, temperature: float) -> float:
        """Density [kg/m^3]."""

    def viscosity(self, temperature: float) -> float:
        """Dynamic viscosity [Pa s]."""


def _roelands(oil: KnownOil, temperature: float) -> float:
    return float(ROELANDS_Z * (math.log(oil.viscosity(temperature)) + 9.67) / ROELANDS_P0)


def _so_klaus(oil: KnownOil, temperature: float) -> float:
    log, b = math.log10(oil.walther(temperature) / MM2), oil.walther.b
    rho = oil.density(temperature) / 1e3  # g/cm^3
    tail = 3.999 * log**3.0975 * rho**0.1162
    return float(1e-8 * (1.216 + 4.143 * log**3.0627 + 2.848e-4 * b**5.1903 * log**1.5976 - tail))


def _wooster(oil: KnownOil, temperature: float) -> float:
    return 1e-8 * (0.6 + 0.965 * math.log10(oil.viscosity(temperature) * 1e3))


def _gold(oil: KnownOil, temperature: float) -> float:
    s, t = _GOLD[oil.base]
    return float(1e-9 * s * (oil.walther(temperature) / MM2) ** t)


def _iso(oil: KnownOil, temperature: float) -> float:
    k, s = _ISO[oil.base]
    rounded = temperature - 0.15  # the standard counts from -273 °C
    return float(
        1e-9 * k * oil.viscosity(AT_38) ** s * (1.0 + 516.0 * (1.0 / rounded - 1.0 / 311.0))
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator:
    """A published estimate of the pressure-viscosity coefficient alpha [1/Pa].

    Parameters
    ----------
    title : how it is cited
    law : alpha of an oil at a temperature [K]
    definition : which alpha it is
    spread : two standard deviations of mineral oils of high viscosity index around it, relative
    thinnest : kinematic viscosity below which it is not meant [m^2/s]
    bases : what it has constants for
    """

    title: str
    law: Callable[[KnownOil, float], float]
    definition: str
    spread: float
    thinnest: float
    bases: tuple[Base, ...] = ("mineral",)

    def __call__(self, oil: KnownOil, temperature: float) -> float:
        """Alpha [1/Pa]; BadInput for an oil that it is not meant for, or so cold that its alpha falls."""
        if oil.base not in self.bases:
            others = [name for name, other in ESTIMATORS.items() if oil.base in other.bases]
            raise BadInput(
                f"{self.title} has no constants for base {oil.base!r}; give alpha, or take "
                f"alpha_estimate = {' or '.join(others)}"
            )
        nu = oil.walther(temperature)
        if nu < self.thinnest:
            raise BadInput(
                f"{self.title} holds from {self.thinnest / MM2:g} mm^2/s upwards, and the oil has {nu / MM2:.3g} "
                f"mm^2/s at {temperature - 273.15:.4g} degC; give alpha"
            )
        alpha = self.law(oil, temperature)
        if self.law(oil, temperature + 1.0) > alpha:
            raise BadInput(
                f"{self.title} falls off again in oil as cold and thick as {nu / MM2:.3g} mm^2/s at "
                f"{temperature - 273.15:.4g} degC, where alpha has to rise; give alpha, or take another alpha_estimate"
            )
        return alpha


ESTIMATORS: dict[str, Estimator] = {
    "roelands": Estimator(
        title=f"Roelands with Z {ROELANDS_Z}",
        law=_roelands,
        definition=AMBIENT_SLOPE,
        spread=0.2,
        thinnest=2.0 * MM2,
    ),
    "so-klaus": Estimator(
        title="So and Klaus (1980)",
        law=_so_klaus,
        definition=AMBIENT_SLOPE,
        spread=0.5,
        thinnest=1.0 * MM2,
    ),
    "wooster": Estimator(
        title="Wooster", law=_wooster, definition=AMBIENT_SLOPE, spread=0.25, thinnest=2.0 * MM2
    ),
    "gold": Estimator(
        title="Gold",
        law=_gold,
        definition=EFFECTIVE,
        spread=0.45,
        thinnest=2.0 * MM2,
        bases=tuple(_GOLD),
    ),
    "iso": Estimator(
        title="ISO/TR 15144-1",
        law=_iso,
        definition=EFFECTIVE,
        spread=0.4,
        thinnest=2.0 * MM2,
        bases=tuple(_ISO),
    ),
}
