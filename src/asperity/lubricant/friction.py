"""The shear stress of the oil film, from which friction comes: one frozen, callable law a class.

What thins the film inside Reynolds' equation is `rheology`; the paper too takes one law there (Eq
9) and another for friction (Eq 14).
"""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import Parameter, Parametric

FREEZING = 273.15  # of water [K]


@dataclass(frozen=True, slots=True, kw_only=True)
class ShearedFilm:
    """A film on its way through the contact; fields of shape (nx, ny), x along rolling.

    `rate` of shear, not negative [1/s]; `viscosity` at the film's own pressure and temperature [Pa
    s]; `pressure` [Pa]; `temperature` [K]; `transit` the time that oil at the mean of the surface
    speeds takes from cell to cell [s].
    """

    rate: Field
    viscosity: Field
    pressure: Field
    temperature: Field
    transit: float


class FrictionLaw(Protocol):
    """What friction asks of an oil."""

    def __call__(self, film: ShearedFilm) -> Field:
        """Shear stress [Pa], shape (nx, ny), not negative."""


@dataclass(frozen=True, slots=True)
class NewtonianShear:
    """Shear stress without a limit: τ = η γ'. Real oils leave it at a few megapascals."""

    def __call__(self, film: ShearedFilm) -> Field:
        """τ [Pa]."""
        return np.asarray(film.viscosity * film.rate)


@dataclass(frozen=True, slots=True)
class EyringShear(Parametric):
    """Shear stress that grows with the logarithm of the rate: τ = τ₀ asinh(η γ'/τ₀)."""

    tau0: Annotated[float, Parameter("Pa", "τ₀", "Eyring stress tau0")]

    def __call__(self, film: ShearedFilm) -> Field:
        """τ [Pa]."""
        return np.asarray(self.tau0 * np.arcsinh(film.viscosity * film.rate / self.tau0))


@dataclass(frozen=True, slots=True)
class BairWiner(Parametric):
    """Shear stress with a limit: γ' = (dτ/dt)/G - (τ_L/η) ln(1 - τ/τ_L). Source: the paper's Eq 14.

    dτ/dt is that of oil carried through the contact at the mean of the surface speeds. Limits are
    Dyson's for mineral oils, G = 1.2 p/(2.52 + 0.024 T) - 1e8 with T in degrees Celsius and G and
    p in pascals, and τ_L = 0.25 G; they are negative below about 0.3 GPa, where `floor` stands for
    τ_L. Source of the limits: A. Dyson, Phil. Trans. R. Soc. A 266 (1970) 1, as used by Zhu and
    Hu, Tribol. Trans. 44 (2001) 383; recollected, not checked against either.
    """

    # τ_L of mineral oils at ambient: 1 to 5 MPa
    floor: Annotated[float, Parameter("Pa", "least limit", "floor of the limiting stress")] = 2e6
    ratio: Annotated[float, Parameter("", "τ_L/G", "ratio of limiting stress to modulus")] = 0.25

    def limits(self, pressure: Field, temperature: Field) -> tuple[Field, Field]:
        """τ_L and G [Pa] at a pressure [Pa] and a temperature [K]."""
        modulus = 1.2 * pressure / (2.52 + 0.024 * np.maximum(temperature - FREEZING, 0.0)) - 1e8
        limit = np.maximum(self.ratio * modulus, self.floor)
        return limit, limit / self.ratio

    def __call__(self, film: ShearedFilm) -> Field:
        """τ [Pa]."""
        return _carried(film, *self.limits(film.pressure, film.temperature))


@dataclass(frozen=True, slots=True)
class LinearBairWiner(Parametric):
    """Bair and Winer's law with a limit linear in pressure: τ_L = (τ_L0 + ξ p) exp(-b (T - 313 K)), G = τ_L/ratio.

    For measured limits: ξ of mineral oils lies between 0.03 and 0.1.
    """

    tau_l0: Annotated[
        float, Parameter("Pa", "τ_L0", "limiting stress tau_l0")
    ]  # at ambient pressure
    slope: Annotated[float, Parameter("", "ξ", "slope of the limiting stress")]
    softening: Annotated[
        float | None, Parameter("1/K", "b", "softening of the limiting stress")
    ] = None  # None: 0
    ratio: Annotated[float, Parameter("", "τ_L/G", "ratio of limiting stress to modulus")] = 0.25

    def limits(self, pressure: Field, temperature: Field) -> tuple[Field, Field]:
        """τ_L and G [Pa] at a pressure [Pa] and a temperature [K]."""
        softer = np.exp(-(self.softening or 0.0) * (temperature - FREEZING - 40.0))
        limit = (self.tau_l0 + self.slope * pressure) * softer
        return limit, limit / self.ratio

    def __call__(self, film: ShearedFilm) -> Field:
        """τ [Pa]."""
        return _carried(film, *self.limits(film.pressure, film.temperature))


def _carried(film: ShearedFilm, limit: Field, modulus: Field) -> Field:
    from asperity.kernels.shear_stress import march_shear_stress  # numba, for solved films only

    stress = np.empty_like(film.pressure)
    march_shear_stress(film.rate, film.viscosity, limit, modulus, film.transit, stress)
    return stress


FRICTION_LAWS: dict[str, type[FrictionLaw]] = {
    "bair-winer": BairWiner,
    "bair-winer-linear": LinearBairWiner,
    "ree-eyring": EyringShear,
    "newtonian": NewtonianShear,
}
