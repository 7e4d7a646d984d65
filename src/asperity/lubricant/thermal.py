"""Thermal properties of a contact: temperature-viscosity laws, conductivities and the two solids.

docs/case-file.md gives the reasons for the defaults.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.lubricant.friction import ZERO_CELSIUS

AMBIENT = 313.15  # 40 °C [K]
ROELANDS_ZERO = 138.0  # reference temperature of Roelands' law [K]


class WarmthLaw(Protocol):
    """Interface of a temperature-viscosity law."""

    def factor(self, viscosity: Field, temperature: Field, ambient: float) -> Field:
        """Return viscosity at `temperature` over that at `ambient` [K], at the same pressure.

        `viscosity` is that at the ambient temperature [Pa s].
        """


@dataclass(frozen=True, slots=True)
class ExponentialWarmth(Parametric):
    """Exponential law η(p, T) = η(p, T₀) exp(-β (T - T₀)). Source: Reynolds (1886).

    Default of β: an ISO VG 100 mineral oil has 100 mm²/s at 40 °C and 11 at 100 °C, ln(100/11)/60 K
    = 0.037/K.
    """

    beta: Annotated[float, Parameter("1/K", "β", "temperature coefficient beta")] = 0.037

    def factor(self, viscosity: Field, temperature: Field, ambient: float) -> Field:
        """Return exp(-β (T - T₀))."""
        return np.broadcast_to(np.exp(-self.beta * (temperature - ambient)), viscosity.shape).copy()


@dataclass(frozen=True, slots=True)
class RoelandsWarmth(Parametric):
    """Roelands' law: ln η + 9.67 scales with ((T - 138)/(T₀ - 138))^-S₀, T in kelvin.

    Source: Roelands (1966). S₀ of mineral oils lies between 1 and 1.5.
    """

    s0: Annotated[float, Parameter("", "S₀", "Roelands' exponent s0")]

    def factor(self, viscosity: Field, temperature: Field, ambient: float) -> Field:
        """Return exp((ln η + 9.67)(((T - 138)/(T₀ - 138))^-S₀ - 1))."""
        ratio = np.maximum(temperature - ROELANDS_ZERO, 1.0) / (ambient - ROELANDS_ZERO)
        return np.asarray(np.exp((np.log(viscosity) + 9.67) * (ratio**-self.s0 - 1.0)))


WARMTH_LAWS: dict[str, type[WarmthLaw]] = {
    "exponential": ExponentialWarmth,
    "roelands": RoelandsWarmth,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid(Parametric):
    """Thermal properties of a body; default: 45 steel.

    Density is the paper's; the others are handbook values of plain carbon steels, which vary by
    10 %.
    """

    conductivity: Annotated[float, Parameter("W/m/K", "k", "thermal conductivity")] = 46.0
    density: Annotated[float, Parameter("kg/m^3", "ρ", "density")] = 7800.0
    heat_capacity: Annotated[float, Parameter("J/kg/K", "c", "heat capacity")] = 460.0

    @property
    def diffusivity(self) -> float:
        """Diffusivity κ = k/(ρ c) [m^2/s]."""
        return self.conductivity / (self.density * self.heat_capacity)

    @property
    def effusivity(self) -> float:
        """Effusivity B = sqrt(k ρ c) [J/m^2/K/s^0.5]."""
        return math.sqrt(self.conductivity * self.density * self.heat_capacity)


@dataclass(frozen=True, slots=True, kw_only=True)
class Thermal(Parametric):
    """Thermal settings of a contact.

    Parameters
    ----------
    ambient : temperature of the oil supply, at which viscosity and rheology are given [K]
    bulk : temperatures of the two bodies away from the contact [K]; None: ambient
    oil_conductivity : thermal conductivity of the film [W/m/K]
    warmth : temperature-viscosity law
    solids : the two bodies
    feedback : couple film temperature to viscosity, friction and film thickness (thermal EHL)
    inlet_heating : compute inlet shear heating; None: where it matters

    Raises
    ------
    BadInput
        A temperature is below -60 °C or above 500 °C, or the conductivity is not positive.
    """

    ambient: Annotated[float, Parameter("K", "T₀")] = AMBIENT
    bulk: Annotated[tuple[float, float] | None, Parameter("K")] = None
    oil_conductivity: Annotated[float, Parameter("W/m/K", positive="conductivity of the oil")] = (
        0.14
    )
    warmth: WarmthLaw = ExponentialWarmth()
    solids: tuple[Solid, Solid] = (Solid(), Solid())
    feedback: bool = False
    inlet_heating: bool | None = None

    @property
    def bulk_rise(self) -> tuple[float, float]:
        """Temperatures of the two bodies away from the contact, above ambient [K]."""
        bulk_1, bulk_2 = self.bulk or (self.ambient, self.ambient)
        return bulk_1 - self.ambient, bulk_2 - self.ambient

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        for temperature in (self.ambient, *(self.bulk or ())):
            if not 213.15 <= temperature <= 773.15:
                raise BadInput(
                    "temperature must lie between -60 and 500 degC, 213.15 and 773.15 K, "
                    f"got {temperature - ZERO_CELSIUS:g} degC, {temperature:g} K; correct it"
                )
