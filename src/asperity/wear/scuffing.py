"""Scuffing: above a limit of load or heat, removal is multiplied and part of it transfers.

Criteria: surface temperature above a limit (Blok 1937), or pressure times shear where the bodies
touch. Assumptions of this implementation: the criterion is applied per cell and position, and a
cell recovers once it is below the limit again.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from asperity.core.arrays import Mask
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.wear.mechanism import Change, Passage, Patch

STEP = 0.1  # largest scuffing depth in a jump, relative to the body's Sq or the film
LEAST = 1e-8  # lower bound of that reference height [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scuffing(Parametric):
    """Removal times `factor` where a limit is exceeded; subclasses define the limit.

    The contact changes once scuffing has removed a tenth of the body's Sq (or of the film, if
    larger) anywhere: scuffing is limited to that depth in a jump, and the next jump is no longer
    than that depth takes. `transfer` is the fraction of the scuffed volume that adheres to the
    other body. Removal is assumed proportional to asperity pressure: a cell's share of scuffed load
    is the share of its removal that is multiplied.
    """

    needs_temperature: ClassVar[bool] = False

    factor: float = 1e3
    transfer: float = 0.5

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        if not self.factor >= 1.0:
            raise BadInput(f"scuffing factor must be 1 or more, got {self.factor:g}; 1000 is usual")
        if not 0.0 <= self.transfer <= 1.0:
            raise BadInput(
                f"scuffing transfer must lie between 0 and 1, got {self.transfer:g}; it is a share"
            )

    def __call__(self, passage: Passage) -> Change:
        """Return the removal in excess of the wear law."""
        load = np.zeros(passage.grid.cells)
        scuffed = np.zeros(passage.grid.cells)
        for patch in passage.patches:
            load += patch.asperity_pressure
            scuffed += np.where(self.exceeds_limit(patch), patch.asperity_pressure, 0.0)
        share = np.divide(scuffed, load, out=np.zeros_like(load), where=load > 0.0)
        loss = (self.factor - 1.0) * share * passage.removed
        limit = STEP * max(float(np.std(passage.heights)), passage.loaded_film, LEAST)
        deepest = float(loss.max())
        loss *= min(1.0, limit / deepest) if deepest > 0.0 else 1.0
        facts = {
            "load_share": float(scuffed.sum() / load.sum()) if load.any() else 0.0,
            "volume_m3": float(loss.sum() * np.prod(passage.grid.spacing)),
        }
        longest = max(passage.jump * limit / deepest, 1.0) if deepest > 0.0 else np.inf
        return Change(
            heights_change=-loss, facts=facts, transferred=self.transfer * loss, longest=longest
        )

    def exceeds_limit(self, patch: Patch) -> Mask:
        """Return the mask of touching cells above the limit."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class TemperatureScuffing(Scuffing):
    """Scuffing where the surface temperature rise exceeds a limit."""

    needs_temperature: ClassVar[bool] = True

    limit: Annotated[float, Parameter("K", positive="scuffing limit")]

    def exceeds_limit(self, patch: Patch) -> Mask:
        """Return the mask of touching cells above the limit."""
        if patch.temperature is None:
            raise BadInput(
                "scuffing by temperature needs the flash temperature, which is not known for this "
                "contact; leave it out"
            )
        return (patch.temperature > self.limit) & (patch.asperity_pressure > 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureShearScuffing(Scuffing):
    """Scuffing where pressure times shear of touching asperities exceeds a limit."""

    limit: Annotated[float, Parameter("Pa^2", positive="scuffing limit")]

    def exceeds_limit(self, patch: Patch) -> Mask:
        """Return the mask of touching cells whose pressure times shear is above the limit."""
        return (patch.asperity_pressure > 0.0) & (
            patch.asperity_pressure * np.abs(patch.shear) > self.limit
        )


SCUFFING: dict[str, type[Scuffing]] = {
    "temperature": TemperatureScuffing,
    "pressure-shear": PressureShearScuffing,
}
