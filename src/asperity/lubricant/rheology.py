"""Shear-thinning laws of oils."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
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


RHEOLOGY_LAWS: dict[str, type[RheologyLaw]] = {"newtonian": Newtonian, "ree-eyring": ReeEyring}
