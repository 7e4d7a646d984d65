"""What every machine hands on: its contacts, each as the contact solver takes it, and its frequencies."""

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

from asperity.contact.conditions import ContactConditions, ElasticPair, Geometry
from asperity.contact.hertz import HertzContact
from asperity.core.errors import BadInput

ROUNDING = 1e-12  # between speeds that are the same
STILL = 1e-6  # entrainment over the faster surface, below which no oil is drawn in


@dataclass(frozen=True, kw_only=True)
class MachineContact:
    """One contact of a machine, at one place or instant of its cycle.

    Parameters
    ----------
    name : what it is called, such as "roller 0, inner ring"
    bodies : the two bodies, in the order of the speeds
    position : where in the machine's cycle: along the line of action [m], or an angle [rad]
    load : normal load on the whole contact [N]
    geometry, radius, length : as `ContactConditions` has them [m]
    surface_speeds : of the two surfaces in the frame in which the contact stands still [m/s], with sign
    overrolling_hz : how often a point of each surface passes such a contact [Hz]
    heaviest_line_load : load per length where it is largest [N/m]; by default load over length
    """

    name: str
    bodies: tuple[str, str]
    position: float
    load: float
    geometry: Geometry
    radius: float | tuple[float, float]
    length: float | None
    surface_speeds: tuple[float, float]
    overrolling_hz: tuple[float, float]
    heaviest_line_load: float | None = None

    @property
    def line_load(self) -> float | None:
        """Load per length that the contact is solved for, the heaviest [N/m]; None for a point or an ellipse."""
        if self.length is None:
            return None
        return (
            self.load / self.length if self.heaviest_line_load is None else self.heaviest_line_load
        )

    @property
    def entrainment_speed(self) -> float:
        """Mean of the two surface speeds [m/s]; negative where oil enters from the other side."""
        return (self.surface_speeds[0] + self.surface_speeds[1]) / 2.0

    @property
    def slide_to_roll(self) -> float | None:
        """(u1 - u2) over the entrainment speed, with its sign; None where no oil is drawn in."""
        if self.stands_still:
            return None
        first, second = self.surface_speeds
        sliding = 0.0 if math.isclose(first, second, rel_tol=ROUNDING) else first - second
        return sliding / self.entrainment_speed

    @property
    def stands_still(self) -> bool:
        """Whether the surfaces draw no oil in, so that there is no steady film."""
        return abs(self.entrainment_speed) <= STILL * max(map(abs, self.surface_speeds))

    def conditions(self, pair: ElasticPair, hardness: float | None = None) -> ContactConditions:
        """The contact as the solver takes it: seen from the side on which oil enters, under its heaviest line load.

        Raises BadInput where the surfaces draw no oil in.
        """
        if self.stands_still:
            raise BadInput(
                f"{self.name}: the surfaces draw no oil in here, there is no steady film; leave it out"
            )
        first, second = self.surface_speeds
        side = math.copysign(1.0, self.entrainment_speed)
        return self._conditions(pair, (side * first, side * second), hardness)

    def hertz(self, pair: ElasticPair) -> HertzContact:
        """The smooth, dry, elastic contact under the heaviest line load, moving or not."""
        return self._conditions(pair, (1.0, 1.0), None).hertz

    def _conditions(
        self, pair: ElasticPair, surface_speeds: tuple[float, float], hardness: float | None
    ) -> ContactConditions:
        return ContactConditions(
            pair=pair,
            geometry=self.geometry,
            radius=self.radius,
            length=self.length,
            load=self.load
            if self.length is None or self.line_load is None
            else self.line_load * self.length,
            surface_speeds=surface_speeds,
            hardness=hardness,
        )


class Machine(Protocol):
    """What all machines can say of themselves. `place` is the quantity that positions are, by its key."""

    place: ClassVar[str]

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Every contact that carries load, along the machine's cycle."""

    @property
    def frequencies(self) -> dict[str, float]:
        """Characteristic frequencies by name [Hz]."""

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """What a reader of its contacts has to know, a sentence each; what is not covered among them."""

    def title(self) -> str:
        """The machine in a few words."""


def turns(speed: float) -> float:
    """Revolutions a second of an angular speed [rad/s]."""
    return speed / (2.0 * math.pi)


def require_count(name: str, value: int, least: int) -> None:
    """BadInput for fewer than `least`."""
    if value < least:
        raise BadInput(f"{name} must be at least {least}, got {value}; correct it")
