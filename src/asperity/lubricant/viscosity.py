"""Pressure-viscosity laws of oils."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric

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


VISCOSITY_LAWS: dict[str, type[ViscosityLaw]] = {"barus": Barus, "roelands": Roelands}


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
