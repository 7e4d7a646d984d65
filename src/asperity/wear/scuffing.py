"""Scuffing: where load or heat passes a limit, removal jumps, and part of what comes off sticks to the other body.

Criteria: surface temperature above a limit (Blok 1937), or pressure times shear where bodies
touch. Ours: that it is decided cell by cell and position by position, and that a cell heals once
it is below the limit again.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from asperity.core.arrays import Mask
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.wear.mechanism import Change, Passage, Patch

STEP = 0.1  # of a body's Sq or film, that scuffing takes in a jump at most
LEAST = 1e-8  # that Sq, or the film where it is more, is taken to be at least for it [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scuffing(Parametric):
    """Removal times `factor` where a limit is passed, which subclasses tell.

    Once it has taken a tenth of the body's Sq (of the film, where that is more) anywhere the
    contact is another: in that jump it takes no more, and the next is no longer than it would take
    for as much. `transfer` is the share of what scuffing takes off that sticks to the other body.
    Removal is taken to be in proportion to the asperity pressure: a cell's share of scuffed load
    is the share of its removal that jumps.
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
        """What is taken off beyond the law of removal."""
        load = np.zeros(passage.grid.cells)
        scuffed = np.zeros(passage.grid.cells)
        for patch in passage.patches:
            load += patch.asperity_pressure
            scuffed += np.where(self.passed(patch), patch.asperity_pressure, 0.0)
        share = np.divide(scuffed, load, out=np.zeros_like(load), where=load > 0.0)
        taken = (self.factor - 1.0) * share * passage.removed
        most = STEP * max(float(np.std(passage.heights)), passage.film_inside, LEAST)
        deepest = float(taken.max())
        taken *= min(1.0, most / deepest) if deepest > 0.0 else 1.0
        facts = {
            "load_share": float(scuffed.sum() / load.sum()) if load.any() else 0.0,
            "volume_m3": float(taken.sum() * np.prod(passage.grid.spacing)),
        }
        longest = max(passage.jump * most / deepest, 1.0) if deepest > 0.0 else np.inf
        return Change(
            heights_change=-taken, facts=facts, transferred=self.transfer * taken, longest=longest
        )

    def passed(self, patch: Patch) -> Mask:
        """Which cells touch and lie beyond the limit."""
        raise NotImplementedError


@dataclass(frozen=True, slots=True, kw_only=True)
class HotScuffing(Scuffing):
    """Where the surface is hotter than a limit above ambient."""

    needs_temperature: ClassVar[bool] = True

    limit: Annotated[float, Parameter("K", positive="scuffing limit")]

    def passed(self, patch: Patch) -> Mask:
        """Touching cells above the limit."""
        if patch.temperature is None:
            raise BadInput(
                "scuffing by temperature needs the flash temperature, which the contact has not; leave it out"
            )
        return (patch.temperature > self.limit) & (patch.asperity_pressure > 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadedScuffing(Scuffing):
    """Where pressure times shear of touching asperities passes a limit."""

    limit: Annotated[float, Parameter("Pa^2", positive="scuffing limit")]

    def passed(self, patch: Patch) -> Mask:
        """Touching cells whose pressure times shear is above the limit."""
        return (patch.asperity_pressure > 0.0) & (
            patch.asperity_pressure * np.abs(patch.shear) > self.limit
        )


SCUFFING: dict[str, type[Scuffing]] = {"temperature": HotScuffing, "pressure-shear": LoadedScuffing}
