"""How shear thins the oil: one frozen law a class."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import Parameter, Parametric


class RheologyLaw(Protocol):
    """What the solver asks of a rheology."""

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """Effective over Newtonian viscosity, and d(ln of it)/d(ln shear), at the shear stress η Δu/h [Pa]."""


@dataclass(frozen=True, slots=True)
class Newtonian:
    """Shear stress proportional to shear rate; the effective viscosity is the viscosity itself."""

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """1 and 0."""
        return np.ones_like(shear), np.zeros_like(shear)


@dataclass(frozen=True, slots=True)
class ReeEyring(Parametric):
    """Viscosity that falls once shear passes a stress: 1/η* = (1/η)(τ₀/τ₁) sinh(τ₁/τ₀). Source: the paper's Eq 9.

    τ₁ is the shear stress on the surface that sliding alone would cause, τ₁ = τ₀ asinh(η Δu/(τ₀
    h)): the part of the pressure gradient is left out, so that η* = η asinh(S)/S with S = η Δu/(τ₀
    h). In pure rolling the oil is Newtonian.
    """

    tau0: Annotated[float, Parameter("Pa", "τ₀", "Eyring stress tau0")]  # where thinning sets in

    def thinning(self, shear: Field) -> tuple[Field, Field]:
        """asinh(S)/S and S/(√(1 + S²) asinh S) - 1."""
        ratio = np.maximum(shear / self.tau0, 1e-6)  # below it both are 1 and 0 to twelve digits
        stress = np.arcsinh(ratio)
        return stress / ratio, ratio / (np.hypot(1.0, ratio) * stress) - 1.0


RHEOLOGY_LAWS: dict[str, type[RheologyLaw]] = {"newtonian": Newtonian, "ree-eyring": ReeEyring}
