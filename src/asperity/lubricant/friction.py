"""Friction laws: the shear stress of the oil film.

`rheology` holds the laws of shear thinning in the Reynolds equation; the paper also uses different
laws there (Eq 9) and for friction (Eq 14).
"""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import Parameter, Parametric
from asperity.lubricant.rheology import Carreau, require_thinning

ZERO_CELSIUS = 273.15  # 0 °C [K]


@dataclass(frozen=True, slots=True, kw_only=True)
class ShearedFilm:
    """Sheared oil film; fields of shape (nx, ny), x along rolling.

    `rate` shear rate, not negative [1/s]; `viscosity` at the local pressure and temperature [Pa s];
    `pressure` [Pa]; `temperature` [K]; `transit` time from cell to cell at the entrainment speed
    [s].
    """

    rate: Field
    viscosity: Field
    pressure: Field
    temperature: Field
    transit: float


class FrictionLaw(Protocol):
    """Interface of a friction law."""

    def __call__(self, film: ShearedFilm) -> Field:
        """Return the shear stress [Pa], shape (nx, ny), not negative."""


@dataclass(frozen=True, slots=True)
class NewtonianShear:
    """Newtonian shear stress τ = η γ'; real oils deviate from a few megapascals on."""

    def __call__(self, film: ShearedFilm) -> Field:
        """Return τ [Pa]."""
        return np.asarray(film.viscosity * film.rate)


@dataclass(frozen=True, slots=True)
class EyringShear(Parametric):
    """Eyring shear stress τ = τ₀ asinh(η γ'/τ₀)."""

    tau0: Annotated[float, Parameter("Pa", "τ₀", "Eyring stress tau0")]

    def __call__(self, film: ShearedFilm) -> Field:
        """Return τ [Pa]."""
        return np.asarray(self.tau0 * np.arcsinh(film.viscosity * film.rate / self.tau0))


@dataclass(frozen=True, slots=True)
class BairWiner(Parametric):
    """Limiting shear stress, γ' = (dτ/dt)/G - (τ_L/η) ln(1 - τ/τ_L). Source: the paper's Eq 14.

    dτ/dt follows oil that moves through the contact at the entrainment speed. G and τ_L are
    Dyson's for mineral oils, G = 1.2 p/(2.52 + 0.024 T) - 1e8 with T in degrees Celsius and G and
    p in pascals, and τ_L = 0.25 G; below about 0.3 GPa, where they are negative, τ_L is `floor`.
    Source: A. Dyson, Phil. Trans. R. Soc. A 266 (1970) 1, as used by Zhu and Hu, Tribol. Trans. 44
    (2001) 383; quoted from memory, not verified.
    """

    # τ_L of mineral oils at ambient pressure: 1 to 5 MPa
    floor: Annotated[float, Parameter("Pa", "least limit", "floor of the limiting stress")] = 2e6
    ratio: Annotated[float, Parameter("", "τ_L/G", "ratio of limiting stress to modulus")] = 0.25

    def limits(self, pressure: Field, temperature: Field) -> tuple[Field, Field]:
        """Return τ_L and G [Pa] at a pressure [Pa] and a temperature [K]."""
        modulus = (
            1.2 * pressure / (2.52 + 0.024 * np.maximum(temperature - ZERO_CELSIUS, 0.0)) - 1e8
        )
        limit = np.maximum(self.ratio * modulus, self.floor)
        return limit, limit / self.ratio

    def __call__(self, film: ShearedFilm) -> Field:
        """Return τ [Pa]."""
        return _stress_along_flow(film, *self.limits(film.pressure, film.temperature))


@dataclass(frozen=True, slots=True)
class LinearBairWiner(Parametric):
    """Bair-Winer law with τ_L = (τ_L0 + ξ p) exp(-b (T - 313 K)) and G = τ_L/ratio.

    Use it with measured limits; ξ of mineral oils lies between 0.03 and 0.1.
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
        """Return τ_L and G [Pa] at a pressure [Pa] and a temperature [K]."""
        factor = np.exp(-(self.softening or 0.0) * (temperature - ZERO_CELSIUS - 40.0))
        limit = (self.tau_l0 + self.slope * pressure) * factor
        return limit, limit / self.ratio

    def __call__(self, film: ShearedFilm) -> Field:
        """Return τ [Pa]."""
        return _stress_along_flow(film, *self.limits(film.pressure, film.temperature))


@dataclass(frozen=True, slots=True)
class CarreauShear(Parametric):
    """Carreau's law τ = η γ' (1 + (η γ'/G)²)^((n - 1)/2), at most Λ p with a limit.

    Source: as `rheology.Carreau`. Λ of hydrocarbons lies between 0.05 and 0.1.
    """

    stress: Annotated[float, Parameter("Pa", "G", "stress of shear thinning")]
    n: Annotated[float, Parameter("", "n", "exponent n")]
    limit: Annotated[float | None, Parameter("", "Λ", "limit of the stress over the pressure")] = (
        None
    )

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        require_thinning(self.n)

    def __call__(self, film: ShearedFilm) -> Field:
        """Return τ [Pa]."""
        shear = film.viscosity * film.rate
        stress = shear * Carreau(self.stress, self.n).thinning(shear)[0]
        if self.limit is None:
            return np.asarray(stress)
        return np.minimum(stress, self.limit * np.maximum(film.pressure, 0.0))


def _stress_along_flow(film: ShearedFilm, limit: Field, modulus: Field) -> Field:
    from asperity.kernels.shear_stress import march_shear_stress  # numba, for solved films only

    stress = np.empty_like(film.pressure)
    march_shear_stress(film.rate, film.viscosity, limit, modulus, film.transit, stress)
    return stress


FRICTION_LAWS: dict[str, type[FrictionLaw]] = {
    "bair-winer": BairWiner,
    "bair-winer-linear": LinearBairWiner,
    "ree-eyring": EyringShear,
    "carreau": CarreauShear,
    "newtonian": NewtonianShear,
}
