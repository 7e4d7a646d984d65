"""Pressure-density laws of oils."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import Parameter, Parametric


class DensityLaw(Protocol):
    """Interface of a density law."""

    @property
    def rho0(self) -> float:
        """Density at ambient pressure [kg/m^3]."""

    def __call__(self, pressure: Field) -> Field:
        """Return the density [kg/m^3] at a pressure [Pa]."""

    def slope(self, pressure: Field) -> Field:
        """Return d(rho)/dp [kg/m^3/Pa] at a pressure [Pa]."""


@dataclass(frozen=True, slots=True)
class DowsonHigginson(Parametric):
    """Dowson-Higginson density ρ = ρ₀ (1 + 0.6e-9 p/(1 + 1.7e-9 p)). Source: the paper's Eq 8.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.lubricant import DowsonHigginson
    >>> DowsonHigginson(rho0=870.0)(np.array([0.0, 1e9])).round(1)
    array([ 870. , 1063.3])
    """

    rho0: Annotated[float, Parameter("kg/m^3", "ρ₀", "density rho0")]  # at ambient pressure

    def __call__(self, pressure: Field) -> Field:
        """Return ρ(p) [kg/m^3]."""
        return self.rho0 * (1.0 + 0.6e-9 * pressure / (1.0 + 1.7e-9 * pressure))

    def slope(self, pressure: Field) -> Field:
        """Return dρ/dp [kg/m^3/Pa]."""
        return self.rho0 * 0.6e-9 / (1.0 + 1.7e-9 * pressure) ** 2


@dataclass(frozen=True, slots=True)
class Incompressible(Parametric):
    """Constant density ρ = ρ₀.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.lubricant import Incompressible
    >>> Incompressible(rho0=870.0)(np.array([0.0, 1e9]))
    array([870., 870.])
    """

    rho0: Annotated[float, Parameter("kg/m^3", "ρ₀", "density rho0")]

    def __call__(self, pressure: Field) -> Field:
        """Return ρ [kg/m^3]."""
        return np.full_like(pressure, self.rho0)

    def slope(self, pressure: Field) -> Field:
        """Return dρ/dp = 0."""
        return np.zeros_like(pressure)


@dataclass(frozen=True, slots=True)
class Tait(Parametric):
    """Tait's equation V/V₀ = 1 - ln(1 + (1 + K₀') p/K₀)/(1 + K₀') at constant temperature.

    Valid up to (1 + K₀')(1 - V/V₀) of about 4. Source: J. H. Dymond, R. Malhotra, Int. J.
    Thermophys. 9 (1988) 941; in this form S. Bair, High-Pressure Rheology for Quantitative
    Elastohydrodynamics (2007).

    Examples
    --------
    Squalane at 40 °C (S. Bair, 2006, from memory):

    >>> import numpy as np
    >>> from asperity.lubricant import Tait
    >>> Tait(rho0=795.0, k0=1.192e9, k0_prime=11.29)(np.array([0.0, 1e9])).round(1)
    array([795. , 990.5])
    """

    rho0: Annotated[float, Parameter("kg/m^3", "ρ₀", "density rho0")]  # at ambient pressure
    k0: Annotated[float, Parameter("Pa", "K₀", "bulk modulus k0")]  # at ambient pressure
    k0_prime: Annotated[float, Parameter("", "K₀'", "slope k0_prime of the bulk modulus")]

    def volume(self, pressure: Field) -> Field:
        """Return V/V₀."""
        return tait_volume(pressure, self.k0, self.k0_prime)[0]

    def __call__(self, pressure: Field) -> Field:
        """Return ρ(p) [kg/m^3]."""
        return np.asarray(self.rho0 / self.volume(pressure))

    def slope(self, pressure: Field) -> Field:
        """Return dρ/dp [kg/m^3/Pa]."""
        volume, by_pressure = tait_volume(pressure, self.k0, self.k0_prime)
        return np.asarray(-self.rho0 * by_pressure / volume**2)


def tait_volume(pressure: Field, k0: float, k0_prime: float) -> tuple[Field, Field]:
    """Return V/V₀ by Tait's equation, and its derivative [1/Pa]."""
    stiffening = 1.0 + k0_prime
    growth = 1.0 + stiffening * pressure / k0
    return np.asarray(1.0 - np.log(growth) / stiffening), np.asarray(-1.0 / (k0 * growth))


DENSITY_LAWS: dict[str, type[DensityLaw]] = {
    "dowson-higginson": DowsonHigginson,
    "incompressible": Incompressible,
    "tait": Tait,
}
