"""Deep-groove and angular-contact ball bearings: load and contact angle of each ball.

Rings are rigid (ISO 16281). The inner ring has a given tilt, or is free to tilt without moment.
Spin of the balls and gyroscopic moments are not modelled.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from asperity.contact.conditions import ElasticPair
from asperity.contact.hertz import elliptic_contact
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MachineContact
from asperity.machine.roller import require_load
from asperity.machine.rolling import (
    STEEL_DENSITY,
    RollingKinematics,
    centrifugal_notes,
    load_zone_notes,
)
from asperity.machine.stiffness import EXPONENT, BallRow, RingBalance

MAX_CONTACT_ANGLE = math.radians(60.0)
MAX_TILT = 0.02  # rad
# Thrust over radial load times tan α above which half of the balls are loaded (Sjövall's integrals)
HALF_ZONE = 1.22
OSCULATION = 0.52, 0.53  # groove radius over ball diameter, inner and outer ring (ISO 281)
RINGS = "inner ring", "outer ring"


@dataclass(frozen=True, kw_only=True)
class BallBearingBase(ABC):
    """Geometry, loads and equilibrium of ball bearings; subclasses define the rows of contacts."""

    place: ClassVar[str] = "cycle_angle"

    balls: int
    ball_diameter: float
    pitch_diameter: float
    speed: float
    radial_load: float = 0.0
    axial_load: float = 0.0
    osculation: tuple[float, float] = OSCULATION
    clearance: float = 0.0
    contact_angle: float = 0.0
    tilt: float | None = 0.0

    @property
    @abstractmethod
    def play(self) -> float:
        """Diametral clearance from which the free contact angle follows [m]."""

    @abstractmethod
    def _rows(self, stiffness: float) -> tuple[BallRow, ...]:
        """Return the rows of contacts between the rings."""

    @property
    def groove_distance(self) -> float:
        """Distance of the groove centres at zero clearance and load, A = r_i + r_e - D [m]."""
        return (sum(self.osculation) - 1.0) * self.ball_diameter

    @property
    def angles(self) -> Field:
        """Positions of the balls, from the direction of the radial load [rad]."""
        return 2.0 * np.pi * np.arange(self.balls) / self.balls

    def stiffness(self, pair: ElasticPair) -> float:
        """Return load over approach of both rings to the power 3/2, nominal angle [N/m^1.5]."""
        return float(sum(self._compliances(pair)) ** -EXPONENT)

    def _compliances(self, pair: ElasticPair) -> tuple[float, float]:
        """Return the approaches at both rings under 1 N, nominal angle [m]."""
        inner, outer = (
            elliptic_contact(1.0, radii, pair.reduced_modulus).approach
            for radii in self._radii(self.contact_angle)
        )
        assert inner is not None
        assert outer is not None
        return inner, outer

    def shifts(self, pair: ElasticPair) -> tuple[float, float, float]:
        """Return the displacements of the inner ring: radial and axial [m], tilt [rad].

        The axial one is measured from the middle of the axial play.
        """
        return self._in_si(self._balance(pair).shifts(self._initial_shifts(pair), self.play))

    def moment(self, pair: ElasticPair) -> float:
        """Return the tilting moment on the shaft [N m]; 0 if the ring is free to tilt."""
        if self.tilt is None:
            return 0.0
        radial, axial, tilt = self.shifts(pair)
        forces = self._forces(np.array([radial, axial, tilt * self._arm]), self.stiffness(pair))
        return float(forces[2]) * self._arm

    def _balance(self, pair: ElasticPair) -> RingBalance:
        return RingBalance(
            rows=self._rows(self.stiffness(pair)),
            radial_load=self.radial_load,
            axial_load=self.axial_load,
            approach=self._approach(pair),
            tilt=None if self.tilt is None else self.tilt * self._arm,
        )

    def _approach(self, pair: ElasticPair) -> float:
        """Return the approach of one ball under the larger load [m]."""
        load = max(self.radial_load, self.axial_load)
        return float((load / self.stiffness(pair)) ** (1.0 / EXPONENT))

    def _initial_shifts(self, pair: ElasticPair) -> Field:
        """Return shifts at which the balls touch [m]."""
        radial = max(self.play, 0.0) / 2.0 + self._approach(pair)
        axial = self.groove_distance * math.sqrt(1.0 - self._free_cosine**2)
        return np.array([radial, axial, 0.0])

    def stiffness_matrix(self, pair: ElasticPair) -> Field:
        """Return d(force)/d(shift) of the inner ring, shape (3, 3): radial, axial, tilt.

        Forces [N] and moment [N m] by shifts [m] and tilt [rad].
        """
        radial, axial, tilt = self.shifts(pair)
        displaced = np.array([radial, axial, tilt * self._arm])
        slopes = np.asarray(sum(row.tangent(displaced) for row in self._rows(self.stiffness(pair))))
        arms = np.array([1.0, 1.0, self._arm])
        return np.asarray(slopes * np.outer(arms, arms))

    @property
    def frequencies(self) -> dict[str, float]:
        """Frequencies of shaft, rings, ball and cage at the free contact angle [Hz]."""
        return self._kinematics(self.free_angle).frequencies

    @property
    def free_angle(self) -> float:
        """Contact angle under a vanishing thrust [rad]; nominal angle under radial load alone.

        Characteristic frequencies of a bearing are usually given for this angle.
        """
        return self.contact_angle if self.axial_load == 0.0 else math.acos(self._free_cosine)

    def _require_grooves(self) -> None:
        """Raise BadInput for grooves without a plausible osculation or contact angle."""
        for groove in self.osculation:
            if not 0.5 < groove <= 0.6:
                raise BadInput(
                    f"osculation must lie above 0.5 and be at most 0.6, got {groove:g}; 0.52 is "
                    "usual"
                )
        if not 0.0 <= self.contact_angle <= MAX_CONTACT_ANGLE:
            raise BadInput(
                "contact_angle must lie between 0 and 60 deg, got "
                f"{math.degrees(self.contact_angle):g} deg; correct it"
            )

    def _require_play(self) -> None:
        """Raise BadInput for an implausible clearance or tilt."""
        require_positive("ball_diameter", self.ball_diameter, "m")
        widest = 2.0 * self.groove_distance * (1.0 - math.cos(MAX_CONTACT_ANGLE))
        limit = max(widest - (self.play - self.clearance), 0.0)
        if self.clearance > limit:
            raise BadInput(
                f"clearance of {1e6 * self.clearance:g} um gives a contact angle above 60 deg in "
                f"these grooves; it must be at most {1e6 * limit:.1f} um, or the osculation larger"
            )
        if self.tilt is not None and not abs(self.tilt) <= MAX_TILT:
            raise BadInput(
                f"tilt must lie between -20 and 20 mrad, got {1e3 * self.tilt:g} mrad; bearings "
                "tolerate 1 or 2"
            )

    def _require_loads(self) -> None:
        """Raise BadInput for loads that load no ball."""
        for name in ("axial_load", "radial_load"):
            load = getattr(self, name)
            if not 0.0 <= load < math.inf:
                raise BadInput(f"{name} must not be negative, got {load:g} N; give its magnitude")
        if self.radial_load == self.axial_load == 0.0 <= self.clearance:
            raise BadInput(
                "radial_load and axial_load are both 0 N, no ball is loaded; give one of them"
            )
        load = math.hypot(self.radial_load, self.axial_load)
        require_load(load, self.clearance, self.ball_diameter, "ball")
        _ = self._kinematics(0.0)  # checks the number of balls, diameters and speed

    def _tilt_notes(self, pair: ElasticPair) -> Iterator[str]:
        """Yield a note on tilt and moment of the inner ring under combined loads."""
        if 0.0 in (self.radial_load, self.axial_load) and not self.tilt:
            return
        if self.tilt is None:
            tilted = 1e3 * self.shifts(pair)[2]
            yield (
                f"The inner ring is free and tilts by {tilted:.2f} mrad, without moment; a shaft "
                "that prevents the tilt changes loads and contact angles."
            )
        else:
            yield (
                f"The shaft holds the inner ring at a tilt of {1e3 * self.tilt:g} mrad, with a "
                f"moment of {abs(self.moment(pair)):.3g} N m; loads differ for a ring that is free "
                'to tilt (tilt = "free").'
            )

    def _in_si(self, shifts: Field) -> tuple[float, float, float]:
        return float(shifts[0]), float(shifts[1]), float(shifts[2]) / self._arm

    @property
    def _free_cosine(self) -> float:
        """Cosine of the free contact angle."""
        return min(1.0 - self.play / (2.0 * self.groove_distance), 1.0)

    @property
    def _arm(self) -> float:
        """Radius of the circle of the inner groove's centres, the arm of a tilt [m]."""
        inner = (self.osculation[0] - 0.5) * self.ball_diameter
        return self.pitch_diameter / 2.0 + inner * self._free_cosine

    def _forces(self, shifts: Field, stiffness: float) -> Field:
        """Return radial force, axial force and moment over `_arm` [N]."""
        return np.asarray(sum(row.forces(shifts) for row in self._rows(stiffness)))

    def _kinematics(self, angle: float) -> RollingKinematics:
        return RollingKinematics(
            count=self.balls,
            diameter=self.ball_diameter,
            pitch_diameter=self.pitch_diameter,
            speed=self.speed,
            contact_angle=angle,
        )

    def _radii(self, angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the effective radii (R_x, R_y) at the inner and the outer ring [m]."""
        inner, outer = self._kinematics(angle).radii
        across = [
            1.0 / (2.0 / self.ball_diameter - 1.0 / (f * self.ball_diameter))
            for f in self.osculation
        ]
        return (inner, across[0]), (outer, across[1])


@dataclass(frozen=True, kw_only=True)
class BallBearing(BallBearingBase):
    """Ball bearing with a rotating inner ring.

    Parameters
    ----------
    balls : number of balls
    ball_diameter, pitch_diameter : [m]
    radial_load, axial_load : [N]
    speed : speed of the inner ring [rad/s]
    osculation : groove radius over ball diameter, of inner and outer ring
    clearance : diametral clearance [m]; negative: preload. It determines the free contact angle
    contact_angle : free contact angle [rad], alternative to the clearance
    tilt : tilt of the inner ring imposed by the shaft [rad]; None: free to tilt

    Raises
    ------
    BadInput
        The balls do not fit or carry no load, the osculation is invalid, clearance and contact
        angle are both given, or the thrust does not hold an angular-contact bearing together.

    Examples
    --------
    >>> from asperity.contact.conditions import ElasticPair
    >>> from asperity.machine import BallBearing
    >>> steel = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
    >>> bearing = BallBearing(
    ...     balls=9, ball_diameter=7.94e-3, pitch_diameter=39.04e-3, speed=188.0, radial_load=1000.0
    ... )
    >>> f"{max(contact.load for contact in bearing.contacts(steel)):.0f} N"
    '487 N'
    """

    def __post_init__(self) -> None:
        self._require_grooves()
        if self.contact_angle > 0.0 and self.clearance != 0.0:
            equivalent = 2e6 * self.groove_distance * (1.0 - math.cos(self.contact_angle))
            raise BadInput(
                "clearance and contact_angle both define the internal geometry "
                f"({math.degrees(self.contact_angle):g} deg is a clearance of {equivalent:.1f} um "
                "in these grooves); give one of them"
            )
        self._require_play()
        if self.contact_angle > 0.0 and self.axial_load == 0.0:
            raise BadInput(self._separation(f"radial_load of {self.radial_load:g} N alone"))
        self._require_loads()

    def _separation(self, load: str) -> str:
        """Return the message that the load separates an angular-contact bearing."""
        required = HALF_ZONE * self.radial_load * math.tan(self.contact_angle)
        return (
            f"an angular-contact bearing comes apart under a {load}, as its rings support the "
            f"balls on one side only; give axial_load, of at least about {required:.3g} N to load "
            "half of the balls"
        )

    @cached_property
    def play(self) -> float:
        """Diametral clearance, given or from the contact angle [m]."""
        if self.contact_angle > 0.0:
            return 2.0 * self.groove_distance * (1.0 - math.cos(self.contact_angle))
        return self.clearance

    def loads(self, pair: ElasticPair) -> tuple[Field, Field]:
        """Return the loads [N] and contact angles [rad] of the balls.

        Raises
        ------
        BadInput
            The thrust does not hold an angular-contact bearing together.
        """
        return self._loads_at(self.angles, pair)

    def _loads_at(self, positions: Field, pair: ElasticPair) -> tuple[Field, Field]:
        """Return loads [N] and contact angles [rad] of balls at some positions [rad]."""
        radial, axial, tilt = self.shifts(pair)
        (row,) = self._rows(self.stiffness(pair))
        moved = np.array([radial, axial, tilt * self._arm])
        loads, angles = replace(row, positions=positions).loads(moved)
        if self.contact_angle > 0.0 and np.any(angles[loads > 0.0] <= 0.0):
            raise BadInput(
                self._separation(
                    f"thrust of {self.axial_load:g} N with {self.radial_load:g} N radial load"
                )
            )
        return loads, angles

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Return both contacts of each loaded ball."""
        return self.contacts_at(self.angles, pair)

    def contacts_at(self, positions: Field, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Return both contacts of loaded balls at some positions from the radial load [rad]."""
        contacts = []
        (loads, contact_angles) = self._loads_at(positions, pair)
        for number, (position, load, angle) in enumerate(
            zip(positions, loads, contact_angles, strict=True)
        ):
            kinematics = self._kinematics(float(angle))
            rings = zip(RINGS, self._radii(float(angle)), kinematics.overrolling_hz, strict=True)
            for ring, radii, passages in rings if load > 0.0 else ():
                contact = MachineContact(
                    name=f"ball {number}, {ring}",
                    bodies=(ring, "ball"),
                    position=float(position),
                    load=float(load),
                    geometry="elliptic",
                    radius=radii,
                    length=None,
                    surface_speeds=(kinematics.surface_speed, kinematics.surface_speed),
                    overrolling_hz=passages,
                )
                contacts.append(contact)
        return tuple(contacts)

    @property
    def cage_speed(self) -> float:
        """Speed of the cage at the free contact angle [rad/s]."""
        return self._kinematics(self.free_angle).cage_speed

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, the tilt and the largest contact angle."""
        contacts = self.contacts(pair)
        loads, angles = self.loads(pair)
        notes = ["Rings are rigid; spin of the balls is not covered."]
        notes += self._tilt_notes(pair)
        loaded = int(np.count_nonzero(loads))
        if self.contact_angle > 0.0 and self.radial_load > 0.0 and loaded < self.balls // 2:
            notes.append(
                f"The thrust loads {loaded} of {self.balls} balls; angular-contact bearings are "
                "usually preloaded so that at least half of the balls are loaded."
            )
        largest = float(angles[np.argmax(loads)])
        if largest > 1e-6:
            notes.append(
                f"The most loaded ball has a contact angle of {math.degrees(largest):.2f} deg."
            )
        mass = STEEL_DENSITY * math.pi / 6.0 * self.ball_diameter**3
        centrifugal = centrifugal_notes(self._kinematics(largest).centrifugal_load(mass), contacts)
        return (*notes, *load_zone_notes(loads.tolist(), "ball"), *centrifugal)

    def title(self) -> str:
        """Return type and number of balls."""
        kind = "Angular-contact" if self.contact_angle > 0.0 else "Deep-groove"
        return f"{kind} ball bearing, {self.balls} balls"

    def _rows(self, stiffness: float) -> tuple[BallRow, ...]:
        return (BallRow(self.angles, self.groove_distance, self.play, stiffness),)
