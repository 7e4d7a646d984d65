"""How a contact wears, as a case states it: law, coefficients, mechanisms, and how time is cut into jumps."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from asperity.core.errors import BadInput, require_positive
from asperity.wear.debris import PLOUGHING
from asperity.wear.fatigue import FATIGUE
from asperity.wear.laws import Coefficient, RemovalLaw
from asperity.wear.mechanism import Mechanism
from asperity.wear.scuffing import SCUFFING

MECHANISMS: dict[
    str, Mapping[str, type[Mechanism]]
] = {  # what roughens: by key of [wear], its laws by name
    "fatigue": FATIGUE,
    "ploughing": PLOUGHING,
    "scuffing": SCUFFING,
}
DECAY = 80.0  # of the shortest wave, over the step: a factor e^4 at the usual 0.05


@dataclass(frozen=True, kw_only=True)
class WearModel:
    """How both bodies wear.

    Parameters
    ----------
    law : of removal
    coefficients : k of each body in that law
    flattening : whether what the pressure cap presses flat stays so
    mechanisms : what roughens, by its key in MECHANISMS, in the order in which it is asked
    overrolling : how often a point of each body passes the contact [1/s]; None: bodies of equal radius, 2R each
    patches : positions of the tracks that a jump is the mean of; None: one every Hertz half-width, and at least 4
    step : depth that a jump takes off anywhere over the Sq of both, at most; and an eightieth of the decay of the
        shortest wave in it
    """

    law: RemovalLaw
    coefficients: tuple[Coefficient, Coefficient]
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
                f"patches must be 1 to 1000, got {self.patches}; leave it out for one every half-width"
            )
        if not 0.0 < self.step <= 0.5:
            raise BadInput(
                f"step must lie above 0 and up to 0.5 of Sq, got {self.step:g}; 0.05 is usual"
            )

    @property
    def decay(self) -> float:
        """Of the shortest wave in a jump, as the exponent, at most."""
        return DECAY * self.step

    @property
    def needs_temperature(self) -> bool:
        """Whether law or mechanisms ask for the temperature of the surfaces."""
        return self.law.needs_temperature or any(
            one.needs_temperature for one in self.mechanisms.values()
        )

    @property
    def removal_alone(self) -> bool:
        """Whether nothing but the law of removal acts: then all depends on k times time alone."""
        return not self.flattening and not self.mechanisms
