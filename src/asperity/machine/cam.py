"""A cam under a flat-faced or a roller follower: the contact from the nose to the base circle.

The lift is harmonic; the contact is taken as steady at each angle.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Self

import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import STILL, MachineContact, turns

PLACES = 9  # angles from the nose to where the lift begins
STEEP = 30.0  # pressure angle that a guide is usually kept below [deg]


@dataclass(frozen=True, kw_only=True)
class Cam(ABC):
    """A cam of harmonic lift s = (L/2)(1 + cos(π θ/β)), θ from the nose, and what its followers have in common.

    Parameters
    ----------
    base_radius : [m]
    lift : largest, L [m]
    half_angle : β, from the nose to where the lift begins [rad]; π under a flat follower: an eccentric disc
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

    place: ClassVar[str] = "cycle_angle"

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
            raise BadInput(
                f"half_angle must lie above 0 and at most at 180 deg, got {degrees:g} deg; correct it"
            )
        self._require_shape()
        for angle in self.angles:
            if self.follower_force(angle) <= 0.0:
                raise BadInput(
                    f"the follower lifts off at {math.degrees(angle):.0f} deg from the nose, its force is "
                    f"{self.follower_force(angle):.3g} N; raise spring_load or spring_rate, or lower speed"
                )

    @property
    def angles(self) -> tuple[float, ...]:
        """Of the contacts, from the nose [rad]."""
        return tuple(self.half_angle * place / (PLACES - 1) for place in range(PLACES))

    def lift_at(self, angle: float) -> float:
        """S [m]."""
        return 0.5 * self.lift * (1.0 + math.cos(math.pi * angle / self.half_angle))

    def follower_force(self, angle: float) -> float:
        """Spring and inertia of the follower, along its own way [N]."""
        inertia = self.follower_mass * self.speed**2 * self._lift_bend(angle)
        return self.spring_load + self.spring_rate * self.lift_at(angle) + inertia

    @abstractmethod
    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """From the nose to where the lift begins; the other flank's are the same, but for signs."""

    @property
    def frequencies(self) -> dict[str, float]:
        """Of the cam [Hz]."""
        return {"cam_hz": turns(self.speed)}

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Where the surfaces run against each other, and where no oil is drawn in."""
        contacts = self.contacts(pair)
        said = [
            "Each angle is taken as steady; squeeze and what the film remembers are not covered."
        ]
        against = [
            contact.name
            for contact in contacts
            if contact.surface_speeds[1] < -STILL * abs(contact.surface_speeds[0])
        ]
        if against:
            said.append(
                f"Cam and follower run against each other from {against[0]} to {against[-1]}."
            )
        signs = [contact.entrainment_speed > 0.0 for contact in contacts]
        said += [
            f"Between {first.name} and {second.name} entrainment passes zero: no steady film there."
            for first, second, before, after in zip(
                contacts, contacts[1:], signs, signs[1:], strict=False
            )
            if before != after
        ]
        return tuple(said)

    @abstractmethod
    def title(self) -> str:
        """What it is."""

    @abstractmethod
    def _require_shape(self) -> None:
        """BadInput for a nose that would be undercut."""

    def _lift_slope(self, angle: float) -> float:
        """S' [m]."""
        rate = math.pi / self.half_angle
        return -0.5 * self.lift * rate * math.sin(rate * angle)

    def _lift_bend(self, angle: float) -> float:
        """S'' [m]."""
        rate = math.pi / self.half_angle
        return -0.5 * self.lift * rate**2 * math.cos(rate * angle)


@dataclass(frozen=True, kw_only=True)
class FlatCam(Cam):
    """A cam under a flat follower; parameters as of `Cam`."""

    def radius_at(self, angle: float) -> float:
        """Of curvature, r_b + s + s'' [m]."""
        return self.base_radius + self.lift_at(angle) + self._lift_bend(angle)

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (rigid valve train)
        """From the nose to where the lift begins; the other flank's are the same. u1 = ω ρ, u2 = ω s''."""
        return tuple(
            MachineContact(
                name=f"{math.degrees(angle):.4g} deg from the nose",
                bodies=("cam", "follower"),
                position=angle,
                load=self.follower_force(angle),
                geometry="line",
                radius=self.radius_at(angle),
                length=self.width,
                surface_speeds=(
                    self.speed * self.radius_at(angle),
                    self.speed * self._lift_bend(angle),
                ),
                overrolling_hz=(turns(self.speed), turns(self.speed)),
            )
            for angle in self.angles
        )

    def title(self) -> str:
        """What it is."""
        return "Cam with flat follower"

    def _require_shape(self) -> None:
        if self.radius_at(0.0) <= 0.0:
            curved = self._lift_bend(0.0) + self.lift
            raise BadInput(
                f"the cam's nose has a radius of {1e3 * self.radius_at(0.0):.3g} mm, it would be undercut; raise "
                f"base_radius above {-1e3 * curved:.3g} mm, or half_angle"
            )


@dataclass(frozen=True)
class CamPoint:
    """Where a roller follower touches its cam, of the pitch curve ρ0(θ) that the roller's centre runs on.

    `pressure_angle` φ between follower's way and contact normal: tan φ = ρ0'/ρ0 [rad];
    `pitch_radius`: of curvature of the pitch curve, (ρ0² + ρ0'²)^(3/2)/(ρ0² + 2 ρ0'² - ρ0 ρ0'');
    `cam_radius`: of the cam, less by the roller's, negative where it is hollow; `path` : of the
    cam passed a radian of its turn [m].
    """

    pressure_angle: float
    pitch_radius: float
    cam_radius: float
    path: float

    @classmethod
    def of(cls, reach: float, slope: float, bend: float, roller_radius: float) -> Self:
        """From ρ0, ρ0' and ρ0'' [m] at an angle."""
        across = math.hypot(reach, slope)
        curved = (reach**2 + 2.0 * slope**2 - reach * bend) / across**3
        bent = 1.0 - roller_radius * curved  # of the pitch curve's path, what the cam has
        pitch_radius = math.inf if curved == 0.0 else 1.0 / curved
        return cls(
            math.atan2(slope, reach), pitch_radius, pitch_radius - roller_radius, across * bent
        )


@dataclass(frozen=True, kw_only=True)
class RollerCam(Cam):
    """A cam under a roller on a follower that moves along a line through the cam's axis.

    Further parameters than those of `Cam`
    --------------------------------------
    roller_radius : [m]
    slip : slide-to-roll ratio of cam and roller; 0: the roller rolls
    """

    roller_radius: float
    slip: float = 0.0

    def __post_init__(self) -> None:
        require_positive("roller_radius", self.roller_radius, "m")
        if not -2.0 < self.slip < 2.0:
            raise BadInput(
                f"slip must lie between -2 and 2, got {self.slip:g}: beyond, cam and roller would run against each "
                "other; correct it"
            )
        super().__post_init__()

    def at(self, angle: float) -> CamPoint:
        """The contact's geometry."""
        reach = self.base_radius + self.roller_radius + self.lift_at(angle)
        return CamPoint.of(
            reach, self._lift_slope(angle), self._lift_bend(angle), self.roller_radius
        )

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (rigid valve train)
        """From the nose to where the lift begins. 1/R = 1/ρ + 1/r, F = follower's force/cos φ, u1 = ω times the path.

        The cam's way past the contact is a matter of its shape alone: a roller that slips is the
        slower for it.
        """
        found = []
        for angle in self.angles:
            point = self.at(angle)
            curvature = 1.0 / self.roller_radius + (
                0.0 if math.isinf(point.cam_radius) else 1.0 / point.cam_radius
            )
            speed = self.speed * point.path
            contact = MachineContact(
                name=f"{math.degrees(angle):.4g} deg from the nose",
                bodies=("cam", "roller"),
                position=angle,
                load=self.follower_force(angle) / math.cos(point.pressure_angle),
                geometry="line",
                radius=1.0 / curvature,
                length=self.width,
                surface_speeds=(speed, self._rolled * speed),
                overrolling_hz=(turns(self.speed), self.frequencies["roller_hz"]),
            )
            found.append(contact)
        return tuple(found)

    @property
    def frequencies(self) -> dict[str, float]:
        """Of the cam, and of the roller in the mean of a turn of it [Hz]."""
        way = 2.0 * float(
            scipy.integrate.quad(lambda angle: self.at(angle).path, 0.0, self.half_angle)[0]
        )
        way += 2.0 * (math.pi - self.half_angle) * self.base_radius
        return {
            "cam_hz": turns(self.speed),
            "roller_hz": turns(self.speed) * self._rolled * way / math.tau / self.roller_radius,
        }

    @property
    def _rolled(self) -> float:
        """The roller's surface speed over the cam's."""
        return (2.0 - self.slip) / (2.0 + self.slip)

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """What the model leaves out, and a guide that is pressed hard aside."""
        said = [
            "The follower's guide is without friction; the roller's own inertia and its bearing are not covered."
        ]
        if self.slip == 0.0:
            said.append("Cam and roller are taken to roll without slip.")
        steepest = max(math.degrees(abs(self.at(angle).pressure_angle)) for angle in self.angles)
        if steepest > STEEP:
            said.append(
                f"The pressure angle reaches {steepest:.0f} deg; above {STEEP:.0f} deg a guide may jam."
            )
        return (*super().notes(pair), *said)

    def title(self) -> str:
        """What it is."""
        return "Cam with roller follower"

    def _require_shape(self) -> None:
        sharpest = min(
            (radius for angle in self.angles if (radius := self.at(angle).pitch_radius) > 0.0),
            default=math.inf,
        )
        if sharpest <= self.roller_radius:
            raise BadInput(
                f"the roller's centre turns on {1e3 * sharpest:.3g} mm where the cam is sharpest, a roller of "
                f"{1e3 * self.roller_radius:.3g} mm undercuts it; lower roller_radius or lift, or raise base_radius or "
                "half_angle"
            )
