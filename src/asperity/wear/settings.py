"""Wear model of a case: law, coefficients, mechanisms and the length of jumps."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from asperity.core.errors import BadInput, require_positive
from asperity.wear.debris import PLOUGHING
from asperity.wear.fatigue import FATIGUE
from asperity.wear.laws import RemovalLaw, WearCoefficient
from asperity.wear.mechanism import Mechanism
from asperity.wear.scuffing import SCUFFING

# mechanisms that roughen: by key of [wear], their laws by name
MECHANISMS: dict[str, Mapping[str, type[Mechanism]]] = {
    "fatigue": FATIGUE,
    "ploughing": PLOUGHING,
    "scuffing": SCUFFING,
}
DECAY = 80.0  # decay exponent of the shortest wave over `step`: a factor e^4 at the default 0.05


@dataclass(frozen=True, kw_only=True)
class WearModel:
    """Wear model of both bodies.

    Parameters
    ----------
    law : wear law
    coefficients : k of each body in that law
    flattening : keep the plastic flattening by the pressure cap
    mechanisms : mechanisms that roughen, by key of MECHANISMS, in the order of their application
    overrolling : over-rolling frequency of a point of each body [1/s]; None: bodies of equal
        radius, 2R each
    patches : positions of the tracks per jump; None: one per Hertz half-width, at least 4
    step : largest depth removed in a jump, relative to the composite Sq; 1/80 of the largest decay
        exponent of the shortest wave
    """

    law: RemovalLaw
    coefficients: tuple[WearCoefficient, WearCoefficient]
    flattening: bool = False
    mechanisms: Mapping[str, Mechanism] = field(default_factory=dict)
    overrolling: tuple[float, float] | None = None
    patches: int | None = None
    step: float = 0.05

    def __post_init__(self) -> None:
        for rate in self.overrolling or ():
            require_positive("overrolling", rate, "Hz")
        if self.patches is not None and not 1 <= self.patches <= 1000:
            raise BadInput(
                f"patches must be 1 to 1000, got {self.patches}; "
                "leave it out for one per half-width"
            )
        if not 0.0 < self.step <= 0.5:
            raise BadInput(
                f"step must be above 0 and at most 0.5 of Sq, got {self.step:g}; "
                "the default is 0.05"
            )

    @property
    def decay(self) -> float:
        """Largest decay exponent of the shortest wave in a jump."""
        return DECAY * self.step

    @property
    def needs_temperature(self) -> bool:
        """True if the law or a mechanism needs surface temperatures."""
        return self.law.needs_temperature or any(
            mechanism.needs_temperature for mechanism in self.mechanisms.values()
        )

    @property
    def only_removal(self) -> bool:
        """True if only the wear law acts: the result then depends on k times time alone."""
        return not self.flattening and not self.mechanisms
