"""A cam under a flat-faced follower: the contact from the nose to the base circle.

The lift is harmonic, as of an eccentric disc; the contact is taken as steady at each angle.
"""

import math
from dataclasses import dataclass

from asperity.conditions import ElasticPair
from asperity.errors import BadInput, require_positive
from asperity.machine.element import STILL, MachineContact, turns

PLACES = 9  # angles from the nose to where the lift begins


@dataclass(frozen=True, kw_only=True)
class FlatCam:
    """A cam of harmonic lift s = (L/2)(1 + cos(π θ/β)), θ from the nose, under a flat follower.

    Parameters
    ----------
    base_radius : [m]
    lift : largest, L [m]
    half_angle : β, from the nose to where the lift begins [rad]; π: an eccentric disc
    width : of the contact [m]
    speed : of the cam [rad/s]
    spring_load : of the follower on the base circle [N]
    spring_rate : [N/m]
    follower_mass : [kg]

    Raises
    ------
    BadInput
        for a nose that is sharper than a radius can be, or a follower that lifts off.
    """

    base_radius: float
    lift: float
    half_angle: float
    width: float
    speed: float
    spring_load: float
    spring_rate: float = 0.0
    follower_mass: float = 0.0

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("base_radius", self.base_radius, "m"),
            ("lift", self.lift, "m"),
            ("width", self.width, "m"),
            ("speed", self.speed, "rad/s"),
            ("spring_load", self.spring_load, "N"),
        ):
            require_positive(name, value, unit)
        if not 0.0 < self.half_angle <= math.pi:
            degrees = math.degrees(self.half_angle)
            raise BadInput(f"half_angle must lie above 0 and at most at 180 deg, got {degrees:g} deg; correct it")
        if self.radius_at(0.0) <= 0.0:
            curved = self._curvature(0.0) + self.lift
            raise BadInput(
                f"the cam's nose has a radius of {1e3 * self.radius_at(0.0):.3g} mm, it would be undercut; raise "
                f"base_radius above {-1e3 * curved:.3g} mm, or half_angle"
            )
        for angle in self.angles:
            if self.load_at(angle) <= 0.0:
                raise BadInput(
                    f"the follower lifts off at {math.degrees(angle):.0f} deg from the nose, its force is "
                    f"{self.load_at(angle):.3g} N; raise spring_load or spring_rate, or lower speed"
                )

    @property
    def angles(self) -> tuple[float, ...]:
        """Of the contacts, from the nose [rad]."""
        return tuple(self.half_angle * place / (PLACES - 1) for place in range(PLACES))

    def lift_at(self, angle: float) -> float:
        """S [m]."""
        return 0.5 * self.lift * (1.0 + math.cos(math.pi * angle / self.half_angle))

    def radius_at(self, angle: float) -> float:
        """Of curvature, r_b + s + s'' [m]."""
        return self.base_radius + self.lift_at(angle) + self._curvature(angle)

    def load_at(self, angle: float) -> float:
        """Spring and inertia of the follower [N]."""
        inertia = self.follower_mass * self.speed**2 * self._curvature(angle)
        return self.spring_load + self.spring_rate * self.lift_at(angle) + inertia

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (rigid valve train)
        """From the nose to where the lift begins; the other flank's are the same. u1 = ω ρ, u2 = ω s''."""
        return tuple(
            MachineContact(
                name=f"{math.degrees(angle):.4g} deg from the nose",
                bodies=("cam", "follower"),
                position=angle,
                load=self.load_at(angle),
                geometry="line",
                radius=self.radius_at(angle),
                length=self.width,
                surface_speeds=(self.speed * self.radius_at(angle), self.speed * self._curvature(angle)),
                overrolling_hz=(turns(self.speed), turns(self.speed)),
            )
            for angle in self.angles
        )

    @property
    def frequencies(self) -> dict[str, float]:
        """Of the cam [Hz]."""
        return {"cam_hz": turns(self.speed)}

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Where the surfaces run against each other, and where no oil is drawn in."""
        contacts = self.contacts(pair)
        said = ["Each angle is taken as steady; squeeze and what the film remembers are not covered."]
        against = [
            contact.name for contact in contacts if contact.surface_speeds[1] < -STILL * abs(contact.surface_speeds[0])
        ]
        if against:
            said.append(f"Cam and follower run against each other from {against[0]} to {against[-1]}.")
        signs = [contact.entrainment_speed > 0.0 for contact in contacts]
        said += [
            f"Between {first.name} and {second.name} entrainment passes zero: no steady film there."
            for first, second, before, after in zip(contacts, contacts[1:], signs, signs[1:], strict=False)
            if before != after
        ]
        return tuple(said)

    def title(self) -> str:
        """What it is."""
        return "Cam with flat follower"

    def _curvature(self, angle: float) -> float:
        """S'' [m]."""
        rate = math.pi / self.half_angle
        return -0.5 * self.lift * rate**2 * math.cos(rate * angle)
