"""Shear-thinning laws of oils."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric


class RheologyLaw(Protocol):
    """Interface of a shear-thinning law."""

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """Return effective over Newtonian viscosity, and its log-log slope, at η Δu/h [Pa]."""


@dataclass(frozen=True, slots=True)
class Newtonian:
    """Newtonian oil: the effective viscosity is the viscosity itself."""

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """Return 1 and 0."""
        return np.ones_like(shear), np.zeros_like(shear)


@dataclass(frozen=True, slots=True)
class ReeEyring(Parametric):
    """Ree-Eyring law 1/η* = (1/η)(τ₀/τ₁) sinh(τ₁/τ₀). Source: the paper's Eq 9.

    τ₁ = τ₀ asinh(η Δu/(τ₀ h)) is the surface shear stress by sliding alone, without the pressure
    gradient, so that η* = η asinh(S)/S with S = η Δu/(τ₀ h). In pure rolling the oil is Newtonian.
    """

    tau0: Annotated[float, Parameter("Pa", "τ₀", "Eyring stress tau0")]  # onset of shear thinning

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """Return asinh(S)/S and S/(√(1 + S²) asinh S) - 1."""
        ratio = np.maximum(shear / self.tau0, 1e-6)  # below, they are 1 and 0 to twelve digits
        stress = np.arcsinh(ratio)
        return stress / ratio, ratio / (np.hypot(1.0, ratio) * stress) - 1.0


@dataclass(frozen=True, slots=True)
class Carreau(Parametric):
    """Carreau's law η* = η (1 + (η γ'/G)²)^((n - 1)/2) with γ' = Δu/h.

    G is the stress at which shear thinning begins. Source: P. J. Carreau, Trans. Soc. Rheol. 16
    (1972) 99, with stress as variable as in S. Bair, High-Pressure Rheology for Quantitative
    Elastohydrodynamics (2007).
    """

    stress: Annotated[float, Parameter("Pa", "G", "stress of shear thinning")]
    n: Annotated[float, Parameter("", "n", "exponent n")]

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        require_thinning(self.n)

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """Return (1 + S²)^((n - 1)/2) and (n - 1) S²/(1 + S²), S = η γ'/G."""
        squared = (shear / self.stress) ** 2
        power = self.n - 1.0
        return (1.0 + squared) ** (0.5 * power), power * squared / (1.0 + squared)


def require_thinning(n: float) -> None:
    """Raise BadInput for an exponent of Carreau's law above 1."""
    if n > 1.0:
        raise BadInput(f"n of Carreau's law must be at most 1, got {n:g}; 1 is Newtonian")


RHEOLOGY_LAWS: dict[str, type[RheologyLaw]] = {
    "newtonian": Newtonian,
    "ree-eyring": ReeEyring,
    "carreau": Carreau,
}
