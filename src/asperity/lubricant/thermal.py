"""How heat changes and crosses a contact: an oil's viscosity over temperature, conductivities, the two solids.

Every default has its reason in docs/case-file.md.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.lubricant.friction import FREEZING

AMBIENT = 313.15  # 40 °C [K]
ROELANDS_ZERO = 138.0  # temperature that Roelands counts from [K]


class WarmthLaw(Protocol):
    """What the thermal model asks of an oil's viscosity."""

    def factor(self, viscosity: Field, temperature: Field, ambient: float) -> Field:
        """Viscosity at `temperature` over that at `ambient` [K], at one pressure; `viscosity` is the latter [Pa s]."""


@dataclass(frozen=True, slots=True)
class ExponentialWarmth(Parametric):
    """Viscosity that falls at one rate at every pressure: η(p, T) = η(p, T₀) exp(-β (T - T₀)). Source: Reynolds (1886).

    An ISO VG 100 mineral oil falls from 100 to 11 mm²/s between 40 and 100 °C: ln(100/11)/60 K =
    0.037/K.
    """

    beta: Annotated[float, Parameter("1/K", "β", "temperature coefficient beta")] = 0.037

    def factor(self, viscosity: Field, temperature: Field, ambient: float) -> Field:
        """exp(-β (T - T₀))."""
        return np.broadcast_to(np.exp(-self.beta * (temperature - ambient)), viscosity.shape).copy()


@dataclass(frozen=True, slots=True)
class RoelandsWarmth(Parametric):
    """Viscosity that falls faster the thicker it is: ln η + 9.67 goes as ((T - 138)/(T₀ - 138))^-S₀, T in kelvin.

    Source: Roelands (1966). S₀ of mineral oils lies between 1 and 1.5.
    """

    s0: Annotated[float, Parameter("", "S₀", "Roelands' exponent s0")]

    def factor(self, viscosity: Field, temperature: Field, ambient: float) -> Field:
        """exp((ln η + 9.67)(((T - 138)/(T₀ - 138))^-S₀ - 1))."""
        warmer = np.maximum(temperature - ROELANDS_ZERO, 1.0) / (ambient - ROELANDS_ZERO)
        return np.asarray(np.exp((np.log(viscosity) + 9.67) * (warmer**-self.s0 - 1.0)))


WARMTH_LAWS: dict[str, type[WarmthLaw]] = {
    "exponential": ExponentialWarmth,
    "roelands": RoelandsWarmth,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid(Parametric):
    """A body that takes up heat: conductivity, density and heat capacity; default 45 steel.

    Density is the paper's; the others are handbook values of plain carbon steels, which lie within
    10 % of them.
    """

    conductivity: Annotated[float, Parameter("W/m/K", "k", "thermal conductivity")] = 46.0
    density: Annotated[float, Parameter("kg/m^3", "ρ", "density")] = 7800.0
    heat_capacity: Annotated[float, Parameter("J/kg/K", "c", "heat capacity")] = 460.0

    @property
    def diffusivity(self) -> float:
        """κ = k/(ρ c) [m^2/s]."""
        return self.conductivity / (self.density * self.heat_capacity)

    @property
    def effusivity(self) -> float:
        """B = sqrt(k ρ c) [J/m^2/K/s^0.5]."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Thermal(Parametric):
    """The thermal side of a contact.

    Parameters
    ----------
    ambient : temperature of the oil where its viscosity and rheology are stated, and of the supply
    bulk : temperatures of the two bodies away from the contact; None: ambient
    oil_conductivity : of the film
    warmth : how temperature thins the oil
    solids : the two bodies
    feedback : whether the film's temperature acts back on viscosity, friction and film (thermal mixed lubrication)

    Raises
    ------
    BadInput
        for a temperature below -60 °C or above 500 °C, or a conductivity that is not positive.
    """

    ambient: Annotated[float, Parameter("K", "T₀")] = AMBIENT
    bulk: Annotated[tuple[float, float] | None, Parameter("K")] = None
    oil_conductivity: Annotated[float, Parameter("W/m/K", positive="conductivity of the oil")] = (
        0.14
    )
    warmth: WarmthLaw = ExponentialWarmth()
    solids: tuple[Solid, Solid] = (Solid(), Solid())
    feedback: bool = False

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        for temperature in (self.ambient, *(self.bulk or ())):
            if not 213.15 <= temperature <= 773.15:
                raise BadInput(
                    "temperature must lie between -60 and 500 degC, 213.15 and 773.15 K, "
                    f"got {temperature - FREEZING:g} degC, {temperature:g} K; correct it"
                )
