"""Cams with flat-faced or roller follower: contacts from the nose to the base circle.

The lift is harmonic or a table. `machine.cycles` has the whole revolution.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MIN_ENTRAINMENT, MachineContact, rotation_hz
from asperity.machine.lift import LiftLaw, TabulatedLift, lift_law

FINE_STEPS = 360  # of the lift, between which no edge hides
ANGLES = 9  # number of contacts from the nose to the start of the lift
USUAL_PRESSURE_ANGLE = 30.0  # usual upper limit [deg]


@dataclass(frozen=True, kw_only=True)
class Cam(ABC):
    """Cam; base of all followers. Its lift is harmonic, s = (L/2)(1 + cos(π θ/β)), or a table.

    Parameters
    ----------
    base_radius : radius of the base circle [m]
    lift : maximum lift L [m]
    half_angle : β, from the nose to the start of the lift [rad]; π with a flat follower: an
        eccentric disc
    lift_table : pairs of angle [rad], from any origin, and lift [m], in place of both
    width : width of the contact [m]
    speed : speed of the cam [rad/s]
    spring_load : spring load on the base circle [N]
    spring_rate : [N/m]
    follower_mass : [kg]

    Raises
    ------
    BadInput
        The nose is undercut, or the follower lifts off.
    """

    place: ClassVar[str] = "cycle_angle"

    base_radius: float
    lift: float | None = None
    half_angle: float | None = None
    lift_table: tuple[tuple[float, float], ...] | None = None
    width: float
    speed: float
    spring_load: float
    spring_rate: float = 0.0
    follower_mass: float = 0.0

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("base_radius", self.base_radius, "m"),
            ("lift", self.law.largest, "m"),
            ("width", self.width, "m"),
            ("speed", self.speed, "rad/s"),
            ("spring_load", self.spring_load, "N"),
        ):
            require_positive(name, value, unit)
        if self.half_angle is not None and not 0.0 < self.half_angle <= math.pi:
            degrees = math.degrees(self.half_angle)
            raise BadInput(
                f"half_angle must lie above 0 and be at most 180 deg, got {degrees:g} deg; correct "
                "it"
            )
        self._require_shape()
        for angle in self._fine_angles:
            if self.follower_force(angle) <= 0.0:
                raise BadInput(
                    f"the follower lifts off at {math.degrees(angle):.0f} deg from the nose, where "
                    f"its force is {self.follower_force(angle):.3g} N; raise spring_load or "
                    "spring_rate, or lower speed"
                )

    @cached_property
    def law(self) -> LiftLaw:
        """Lift over the angle from the nose."""
        return lift_law(self.lift, self.half_angle, self.lift_table)

    @property
    def angles(self) -> tuple[float, ...]:
        """Angles of the contacts, from the nose [rad]: one flank, or both if they differ."""
        first, last = self.law.ends
        flanks = [last] if self.law.symmetric else [first, last]
        steps = [number / (ANGLES - 1) for number in range(ANGLES)]
        return tuple(sorted({flank * step + 0.0 for flank in flanks for step in steps}))

    @cached_property
    def _fine_angles(self) -> tuple[float, ...]:
        """Angles at which shape and force are checked [rad]."""
        first, last = self.law.ends
        fine = (first + (last - first) * step / FINE_STEPS for step in range(FINE_STEPS + 1))
        return tuple(sorted({*fine, *self.angles}, key=abs))

    def lift_at(self, angle: float) -> float:
        """Return the lift s [m]."""
        return self.law(angle)

    def follower_force(self, angle: float) -> float:
        """Return the force of spring and inertia along the follower's path [N]."""
        inertia = self.follower_mass * self.speed**2 * self._lift_bend(angle)
        return self.spring_load + self.spring_rate * self.lift_at(angle) + inertia

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (rigid valve train)
        """Return the contacts at `angles`."""
        return tuple(self.contact(angle) for angle in self.angles)

    @abstractmethod
    def contact(self, angle: float) -> MachineContact:
        """Return the contact at an angle from the nose [rad], also on the base circle."""

    @property
    def frequencies(self) -> dict[str, float]:
        """Rotational frequency of the cam [Hz]."""
        return {"cam_hz": rotation_hz(self.speed)}

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, and angles of opposing speeds and no entrainment."""
        contacts = self.contacts(pair)
        notes = [
            "Each angle is treated as steady; `asperity cycle` solves the revolution in time, with "
            "squeeze."
        ]
        if isinstance(self.law, TabulatedLift):
            notes.append(
                f"The table of {len(self.law.table)} lifts is smoothed by "
                f"{1e6 * self.law.rounding:.2g} um root mean square; its curvature is that of the "
                "spline."
            )
        opposing = [
            contact.name
            for contact in contacts
            if contact.surface_speeds[1] < -MIN_ENTRAINMENT * abs(contact.surface_speeds[0])
        ]
        if opposing:
            notes.append(
                f"Cam and follower move in opposite directions from {opposing[0]} to "
                f"{opposing[-1]}."
            )
        signs = [contact.entrainment_speed > 0.0 for contact in contacts]
        notes += [
            f"Between {first.name} and {second.name} entrainment passes zero: no steady film there."
            for first, second, before, after in zip(
                contacts, contacts[1:], signs, signs[1:], strict=False
            )
            if before != after
        ]
        return tuple(notes)

    @abstractmethod
    def title(self) -> str:
        """Return the name of the machine."""

    @abstractmethod
    def _require_shape(self) -> None:
        """Raise BadInput for an undercut nose."""

    def _lift_slope(self, angle: float) -> float:
        """Return s' [m]."""
        return self.law(angle, 1)

    def _lift_bend(self, angle: float) -> float:
        """Return s'' [m]."""
        return self.law(angle, 2)


@dataclass(frozen=True, kw_only=True)
class FlatCam(Cam):
    """Cam with flat follower; parameters as for `Cam`."""

    def radius_at(self, angle: float) -> float:
        """Return the radius of curvature r_b + s + s'' [m]."""
        return self.base_radius + self.lift_at(angle) + self._lift_bend(angle)

    def contact(self, angle: float) -> MachineContact:
        """Return the contact at an angle [rad]: u1 = ω ρ, u2 = ω s''."""
        return MachineContact(
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
            overrolling_hz=(rotation_hz(self.speed), rotation_hz(self.speed)),
        )

    def title(self) -> str:
        """Return the name of the machine."""
        return "Cam with flat follower"

    def _require_shape(self) -> None:
        sharpest = min(self._fine_angles, key=self.radius_at)
        if self.radius_at(sharpest) <= 0.0:
            limit = -(self._lift_bend(sharpest) + self.lift_at(sharpest))
            where = "nose" if sharpest == 0.0 else f"flank, {math.degrees(sharpest):.0f} deg"
            raise BadInput(
                f"the cam's {where} is undercut, its radius is "
                f"{1e3 * self.radius_at(sharpest):.3g} mm; raise base_radius above "
                f"{1e3 * limit:.3g} mm, or stretch the lift"
            )


@dataclass(frozen=True)
class CamPoint:
    """Contact geometry of a roller follower, from the pitch curve ρ0(θ) of the roller's centre.

    `pressure_angle` φ between follower path and contact normal: tan φ = ρ0'/ρ0 [rad];
    `pitch_radius` radius of curvature of the pitch curve, (ρ0² + ρ0'²)^(3/2)/(ρ0² + 2 ρ0'² - ρ0
    ρ0'') [m]; `cam_radius` that of the cam, smaller by the roller's radius, negative if hollow [m];
    `path` length of the cam's profile passed per radian [m].
    """

    pressure_angle: float
    pitch_radius: float
    cam_radius: float
    path: float

    @classmethod
    def from_pitch_curve(
        cls, reach: float, slope: float, bend: float, roller_radius: float
    ) -> Self:
        """Compute the geometry from ρ0, ρ0' and ρ0'' [m]."""
        speed = math.hypot(reach, slope)
        curvature = (reach**2 + 2.0 * slope**2 - reach * bend) / speed**3
        ratio = 1.0 - roller_radius * curvature  # of the cam's path to the pitch curve's
        pitch_radius = math.inf if curvature == 0.0 else 1.0 / curvature
        return cls(
            math.atan2(slope, reach), pitch_radius, pitch_radius - roller_radius, speed * ratio
        )


@dataclass(frozen=True, kw_only=True)
class RollerCam(Cam):
    """Cam with a roller follower that moves along a line through the cam's axis.

    Parameters in addition to those of `Cam`
    ----------------------------------------
    roller_radius : [m]
    slip : slide-to-roll ratio of cam and roller; 0: pure rolling
    """

    roller_radius: float
    slip: float = 0.0

    def __post_init__(self) -> None:
        require_positive("roller_radius", self.roller_radius, "m")
        if not -2.0 < self.slip < 2.0:
            raise BadInput(
                f"slip must lie between -2 and 2, got {self.slip:g}: beyond, cam and roller move "
                "in opposite directions; correct it"
            )
        super().__post_init__()

    def point_at(self, angle: float) -> CamPoint:
        """Return the contact geometry at an angle."""
        reach = self.base_radius + self.roller_radius + self.lift_at(angle)
        return CamPoint.from_pitch_curve(
            reach, self._lift_slope(angle), self._lift_bend(angle), self.roller_radius
        )

    def contact(self, angle: float) -> MachineContact:
        """Return the contact at an angle [rad].

        1/R = 1/ρ + 1/r, F = follower force/cos φ, u1 = ω times the path; slip changes only u2.
        """
        point = self.point_at(angle)
        curvature = 1.0 / self.roller_radius + (
            0.0 if math.isinf(point.cam_radius) else 1.0 / point.cam_radius
        )
        speed = self.speed * point.path
        return MachineContact(
            name=f"{math.degrees(angle):.4g} deg from the nose",
            bodies=("cam", "roller"),
            position=angle,
            load=self.follower_force(angle) / math.cos(point.pressure_angle),
            geometry="line",
            radius=1.0 / curvature,
            length=self.width,
            surface_speeds=(speed, self._speed_ratio * speed),
            overrolling_hz=(rotation_hz(self.speed), self.frequencies["roller_hz"]),
        )

    @cached_property
    def frequencies(self) -> dict[str, float]:
        """Rotational frequencies of the cam, and of the roller averaged over a cam turn [Hz]."""
        first, last = self.law.ends
        flanks = 2.0 if self.law.symmetric else 1.0
        path = flanks * float(
            scipy.integrate.quad(lambda angle: self.point_at(angle).path, first, last, limit=200)[0]
        )
        path += (math.tau - flanks * (last - first)) * self.base_radius
        return {
            "cam_hz": rotation_hz(self.speed),
            "roller_hz": rotation_hz(self.speed)
            * self._speed_ratio
            * path
            / math.tau
            / self.roller_radius,
        }

    @property
    def _speed_ratio(self) -> float:
        """Surface speed of the roller over that of the cam."""
        return (2.0 - self.slip) / (2.0 + self.slip)

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, and a note on a large pressure angle."""
        notes = [
            "The follower's guide is frictionless; inertia and bearing of the roller are not "
            "covered."
        ]
        if self.slip == 0.0:
            notes.append("Cam and roller are assumed to roll without slip.")
        largest = max(
            math.degrees(abs(self.point_at(angle).pressure_angle)) for angle in self.angles
        )
        if largest > USUAL_PRESSURE_ANGLE:
            notes.append(
                f"The pressure angle reaches {largest:.0f} deg; above {USUAL_PRESSURE_ANGLE:.0f} "
                "deg the guide may jam."
            )
        return (*super().notes(pair), *notes)

    def title(self) -> str:
        """Return the name of the machine."""
        return "Cam with roller follower"

    def _require_shape(self) -> None:
        sharpest = min(
            (
                radius
                for angle in self._fine_angles
                if (radius := self.point_at(angle).pitch_radius) > 0.0
            ),
            default=math.inf,
        )
        if sharpest <= self.roller_radius:
            raise BadInput(
                "the smallest radius of curvature of the roller's path is "
                f"{1e3 * sharpest:.3g} mm, and a roller of {1e3 * self.roller_radius:.3g} mm "
                "undercuts it; lower roller_radius or lift, or raise base_radius or half_angle"
            )
