"""Pressure-viscosity laws of oils."""

import math
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.lubricant.density import tait_volume

LEAST_FREE = 0.02  # free volume over that at ambient pressure; the oil is glassy far above
MOST_GLASSY = 0.8  # distance below the glass transition, over C₂; the law has a pole at 1
LN10 = math.log(10.0)
MAX_EXPONENT = 400.0  # of an exponential law; the oil is glassy far below, and e^709 overflows


class ViscosityLaw(Protocol):
    """Interface of a pressure-viscosity law."""

    @property
    def eta0(self) -> float:
        """Viscosity at ambient pressure [Pa s]."""

    def __call__(self, pressure: Field) -> Field:
        """Return the viscosity [Pa s] at a pressure [Pa]."""

    def log_slope(self, pressure: Field) -> Field:
        """Return d(ln eta)/dp [1/Pa] at a pressure [Pa]."""


@dataclass(frozen=True, slots=True)
class Barus(Parametric):
    """Barus' law η = η₀ exp(α p). Source: the paper's Eq 10.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.lubricant import Barus
    >>> Barus(eta0=0.1, alpha=20e-9)(np.array([0.0, 0.1e9])).round(3)
    array([0.1  , 0.739])
    """

    eta0: Annotated[float, Parameter("Pa s", "η₀", "viscosity eta0")]  # at ambient pressure
    alpha: Annotated[float, Parameter("1/Pa", "α", "pressure-viscosity coefficient alpha")]

    def __call__(self, pressure: Field) -> Field:
        """Return η(p) [Pa s]."""
        return np.asarray(self.eta0 * np.exp(np.minimum(self.alpha * pressure, MAX_EXPONENT)))

    def log_slope(self, pressure: Field) -> Field:
        """Return d(ln η)/dp = α [1/Pa]."""
        return np.full_like(pressure, self.alpha)


@dataclass(frozen=True, slots=True)
class Roelands(Parametric):
    """Roelands' law η = η₀ exp((ln η₀ + 9.67) ((1 + p/p₀)^z − 1)), z = α p₀/(ln η₀ + 9.67).

    Source: Roelands (1966), isothermal form with α matched at ambient pressure.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.lubricant import Roelands
    >>> Roelands(eta0=0.1, alpha=20e-9)(np.array([0.0, 0.1e9, 1e9])).round(3)
    array([1.0000000e-01, 6.0900000e-01, 1.5004778e+04])
    """

    eta0: Annotated[float, Parameter("Pa s", "η₀", "viscosity eta0")]  # at ambient pressure
    alpha: Annotated[
        float, Parameter("1/Pa", "α", "pressure-viscosity coefficient alpha")
    ]  # at ambient pressure
    p0: Annotated[float, Parameter("Pa", "p₀", "Roelands' reference pressure p0")] = 1.96e8

    @property
    def _scale(self) -> float:
        return float(np.log(self.eta0) + 9.67)

    @property
    def exponent(self) -> float:
        """Exponent z."""
        return self.alpha * self.p0 / self._scale

    def __call__(self, pressure: Field) -> Field:
        """Return η(p) [Pa s]."""
        exponent = self._scale * ((1.0 + pressure / self.p0) ** self.exponent - 1.0)
        return np.asarray(self.eta0 * np.exp(np.minimum(exponent, MAX_EXPONENT)))

    def log_slope(self, pressure: Field) -> Field:
        """Return d(ln η)/dp [1/Pa]."""
        return self.alpha * (1.0 + pressure / self.p0) ** (self.exponent - 1.0)


@dataclass(frozen=True, slots=True)
class Doolittle(Parametric):
    """Doolittle's free volume, η = η₀ exp(B R₀ (1/(V/V₀ - R₀) - 1/(1 - R₀))), V by Tait's equation.

    R₀ is the occupied volume over V₀ at ambient pressure; the volume is that of `density.Tait`.
    Source: A. K. Doolittle, J. Appl. Phys. 22 (1951) 1471; S. Bair, High-Pressure Rheology for
    Quantitative Elastohydrodynamics (2007).

    Examples
    --------
    Squalane at 40 °C (S. Bair, 2006, from memory); its reciprocal asymptotic isoviscous pressure is
    18.1 1/GPa:

    >>> import numpy as np
    >>> from asperity.lubricant import Doolittle
    >>> squalane = Doolittle(0.0157, b=4.71, r0=0.6568, k0=1.192e9, k0_prime=11.29)
    >>> squalane(np.array([0.2e9, 0.4e9])).round(2)
    array([0.41, 4.69])
    """

    eta0: Annotated[float, Parameter("Pa s", "η₀", "viscosity eta0")]  # at ambient pressure
    b: Annotated[float, Parameter("", "B", "Doolittle's parameter b")]
    r0: Annotated[float, Parameter("", "R₀", "occupied volume r0")]  # over that of the oil
    k0: Annotated[float, Parameter("Pa", "K₀", "bulk modulus k0")]  # at ambient pressure
    k0_prime: Annotated[float, Parameter("", "K₀'", "slope k0_prime of the bulk modulus")]

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        if not self.r0 < 1.0:
            raise BadInput(
                f"r0 must be below 1, the oil's volume at ambient pressure, got {self.r0:g}; "
                "correct it"
            )

    def _free(self, pressure: Field) -> tuple[Field, Field]:
        """Return the free volume over V₀, and its derivative; it stays above `LEAST_FREE`."""
        volume, slope = tait_volume(pressure, self.k0, self.k0_prime)
        return np.maximum(volume - self.r0, LEAST_FREE * (1.0 - self.r0)), slope

    def __call__(self, pressure: Field) -> Field:
        """Return η(p) [Pa s]."""
        free, _ = self._free(pressure)
        exponent = self.b * self.r0 * (1.0 / free - 1.0 / (1.0 - self.r0))
        return np.asarray(self.eta0 * np.exp(np.minimum(exponent, MAX_EXPONENT)))

    def log_slope(self, pressure: Field) -> Field:
        """Return d(ln η)/dp [1/Pa]."""
        free, slope = self._free(pressure)
        return np.asarray(-self.b * self.r0 * slope / free**2)


@dataclass(frozen=True, slots=True)
class Yasutomi(Parametric):
    """Improved Yasutomi law, log₁₀(η/η_g) = -C₁ D F/(C₂ + D F), D = T - T_g(p).

    T_g = T_g0 + A₁ ln(1 + A₂ p) is the glass transition, F = (1 + b₁ p)^b₂ the relative thermal
    expansivity of the free volume. Source: S. Bair, C. Mary, N. Bouscharain, P. Vergne, Tribol.
    Lett. 55 (2014); form from memory.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.lubricant import Yasutomi
    >>> oil = Yasutomi(
    ...     temperature=313.15,
    ...     glass_temperature=190.0,
    ...     a1=190.0,
    ...     a2=0.72e-9,
    ...     b1=5e-9,
    ...     b2=-0.5,
    ...     c1=11.0,
    ...     c2=27.0,
    ...     eta_glass=1e7,
    ... )
    >>> f"{oil.eta0:.4f} Pa s, {1e9 * oil.log_slope(np.zeros(1))[0]:.1f} 1/GPa"
    '0.0095 Pa s, 13.5 1/GPa'
    """

    temperature: Annotated[float, Parameter("K", "T", "temperature")]
    glass_temperature: Annotated[float, Parameter("K", "T_g0", "glass_temperature")]
    a1: Annotated[float, Parameter("K", "A₁", "a1")]
    a2: Annotated[float, Parameter("1/Pa", "A₂", "a2")]
    b1: Annotated[float, Parameter("1/Pa", "b₁", "b1")]
    b2: Annotated[float, Parameter("", "b₂")]
    c1: Annotated[float, Parameter("", "C₁", "c1")] = 16.04
    c2: Annotated[float, Parameter("K", "C₂", "c2")] = 18.18
    eta_glass: Annotated[float, Parameter("Pa s", "η_g", "viscosity eta_glass")] = 1e12

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        if not self.temperature > self.glass_temperature:
            raise BadInput(
                f"temperature must be above glass_temperature, {self.glass_temperature:g} K, got "
                f"{self.temperature:g} K; correct it"
            )

    @property
    def eta0(self) -> float:
        """Viscosity at ambient pressure [Pa s]."""
        return float(self(np.zeros(1))[0])

    def _distance(self, pressure: Field) -> tuple[Field, Field]:
        """Return D F [K] and its derivative; it stays above -`MOST_GLASSY` C₂."""
        growth, shrinkage = 1.0 + self.a2 * pressure, 1.0 + self.b1 * pressure
        above = self.temperature - self.glass_temperature - self.a1 * np.log(growth)
        factor = shrinkage**self.b2
        distance = above * factor
        slope = distance * self.b2 * self.b1 / shrinkage - factor * self.a1 * self.a2 / growth
        return np.maximum(distance, -MOST_GLASSY * self.c2), slope

    def __call__(self, pressure: Field) -> Field:
        """Return η(p) [Pa s]."""
        distance, _ = self._distance(pressure)
        exponent = -LN10 * self.c1 * distance / (self.c2 + distance)
        return np.asarray(self.eta_glass * np.exp(np.minimum(exponent, MAX_EXPONENT)))

    def log_slope(self, pressure: Field) -> Field:
        """Return d(ln η)/dp [1/Pa]."""
        distance, slope = self._distance(pressure)
        return np.asarray(-LN10 * self.c1 * self.c2 * slope / (self.c2 + distance) ** 2)


VISCOSITY_LAWS: dict[str, type[ViscosityLaw]] = {
    "barus": Barus,
    "roelands": Roelands,
    "doolittle": Doolittle,
    "yasutomi": Yasutomi,
}


def require_liquid(law: ViscosityLaw, pressure: float) -> None:
    """Raise BadInput if the viscosity overflows at a pressure.

    Parameters
    ----------
    law : pressure-viscosity law
    pressure : largest pressure of a contact [Pa]

    Raises
    ------
    BadInput
        The coefficient at ambient pressure times the pressure exceeds 400.
    """
    slope = float(law.log_slope(np.zeros(1))[0])
    if not slope * pressure <= MAX_EXPONENT:
        raise BadInput(
            f"a pressure-viscosity coefficient of {slope * 1e9:.3g} 1/GPa thickens the oil by "
            f"exp({slope * pressure:.3g}) at the Hertz pressure of {pressure / 1e9:.3g} GPa, above "
            f"the limit of exp({MAX_EXPONENT:g}); check its unit"
        )
