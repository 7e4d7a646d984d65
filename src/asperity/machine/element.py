"""Common interface of machines: contacts, as input of the contact solver, and frequencies."""

import math
from dataclasses import dataclass
from typing import ClassVar, Protocol

from asperity.contact.conditions import ContactConditions, ElasticPair, Geometry
from asperity.contact.hertz import HertzContact
from asperity.core.errors import BadInput

SPEED_TOLERANCE = 1e-12  # relative difference of equal speeds
MIN_ENTRAINMENT = 1e-6  # entrainment over the faster surface speed, below which no film forms


@dataclass(frozen=True, kw_only=True)
class MachineContact:
    """Contact of a machine at one position of its cycle.

    Parameters
    ----------
    name : such as "roller 0, inner ring"
    bodies : the two bodies, in the order of the speeds
    position : position in the machine's cycle: along the line of action [m], or an angle [rad]
    load : normal load on the whole contact [N]
    geometry, radius, length : as in `ContactConditions` [m]
    surface_speeds : speeds of the two surfaces in the frame of the contact [m/s], with sign
    overrolling_hz : rate at which a point of each surface passes such a contact [Hz]
    max_line_load : maximum load per length [N/m]; default: load over length
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
    max_line_load: float | None = None

    @property
    def line_load(self) -> float | None:
        """Maximum load per length, used by the solver [N/m]; None for a point or an ellipse."""
        if self.length is None:
            return None
        return self.load / self.length if self.max_line_load is None else self.max_line_load

    @property
    def entrainment_speed(self) -> float:
        """Mean of the two surface speeds [m/s]; negative if oil enters from the other side."""
        return (self.surface_speeds[0] + self.surface_speeds[1]) / 2.0

    @property
    def slide_to_roll(self) -> float | None:
        """(u1 - u2) over the entrainment speed, with sign; None without entrainment."""
        if self.stands_still:
            return None
        first, second = self.surface_speeds
        sliding = 0.0 if math.isclose(first, second, rel_tol=SPEED_TOLERANCE) else first - second
        return sliding / self.entrainment_speed

    @property
    def stands_still(self) -> bool:
        """True without entrainment, so that there is no steady film."""
        return abs(self.entrainment_speed) <= MIN_ENTRAINMENT * max(map(abs, self.surface_speeds))

    def conditions(self, pair: ElasticPair, hardness: float | None = None) -> ContactConditions:
        """Return the input of the solver: x in the direction of entrainment, maximum line load.

        Raises BadInput without entrainment.
        """
        if self.stands_still:
            raise BadInput(
                f"{self.name}: there is no entrainment and no steady film; leave this contact out"
            )
        first, second = self.surface_speeds
        side = math.copysign(1.0, self.entrainment_speed)
        return self._conditions(pair, (side * first, side * second), hardness)

    def hertz(self, pair: ElasticPair) -> HertzContact:
        """Return the Hertz contact under the maximum line load, with or without entrainment."""
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
    """Interface of all machines; `place` is the key of the quantity of contact positions."""

    place: ClassVar[str]

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Return all contacts that carry load, along the machine's cycle."""

    @property
    def frequencies(self) -> dict[str, float]:
        """Characteristic frequencies by name [Hz]."""

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return notes on the contacts and the limits of the model, a sentence each."""

    def title(self) -> str:
        """Return a short description of the machine."""


def rotation_hz(speed: float) -> float:
    """Convert an angular speed [rad/s] to revolutions per second."""
    return speed / (2.0 * math.pi)


def require_count(name: str, value: int, minimum: int) -> None:
    """Raise BadInput for fewer than `minimum`."""
    if value < minimum:
        raise BadInput(f"{name} must be at least {minimum}, got {value}; correct it")
