"""Deep-groove and angular-contact ball bearings: load and contact angle of each ball.

Rings are rigid (ISO 16281). The inner ring has a given tilt, or is free to tilt without moment.
Spin of the balls and gyroscopic moments are not modelled.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.contact.hertz import elliptic_contact
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, require_positive
from asperity.machine.element import MachineContact
from asperity.machine.roller import require_load
from asperity.machine.rolling import (
    STEEL_DENSITY,
    RollingKinematics,
    centrifugal_notes,
    double_until,
    load_zone_notes,
)
from asperity.machine.stiffness import EXPONENT, tangent_stiffness

MAX_CONTACT_ANGLE = math.radians(60.0)
MAX_TILT = 0.02  # rad
# Thrust over radial load times tan α above which half of the balls are loaded (Sjövall's integrals)
HALF_ZONE = 1.22
OSCULATION = 0.52, 0.53  # groove radius over ball diameter, inner and outer ring (ISO 281)
RINGS = "inner ring", "outer ring"


@dataclass(frozen=True, kw_only=True)
class BallBearing:
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

    def __post_init__(self) -> None:
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
        if self.contact_angle > 0.0 and self.clearance != 0.0:
            equivalent = 2e6 * self.groove_distance * (1.0 - math.cos(self.contact_angle))
            raise BadInput(
                "clearance and contact_angle both define the internal geometry "
                f"({math.degrees(self.contact_angle):g} deg is a clearance of {equivalent:.1f} um "
                "in these grooves); give one of them"
            )
        self._require_shape()
        if not 0.0 <= self.axial_load < math.inf:
            raise BadInput(
                f"axial_load must not be negative, got {self.axial_load:g} N; give its magnitude"
            )
        if not 0.0 <= self.radial_load < math.inf:
            raise BadInput(
                f"radial_load must not be negative, got {self.radial_load:g} N; give its magnitude"
            )
        if self.radial_load == self.axial_load == 0.0 <= self.clearance:
            raise BadInput(
                "radial_load and axial_load are both 0 N, no ball is loaded; give one of them"
            )
        if self.contact_angle > 0.0 and self.axial_load == 0.0:
            raise BadInput(self._separation(f"radial_load of {self.radial_load:g} N alone"))
        require_load(
            math.hypot(self.radial_load, self.axial_load),
            self.clearance,
            self.ball_diameter,
            "ball",
        )
        _ = self._kinematics(0.0)

    def _require_shape(self) -> None:
        require_positive("ball_diameter", self.ball_diameter, "m")
        limit = 2.0 * self.groove_distance * (1.0 - math.cos(MAX_CONTACT_ANGLE))
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

    def _separation(self, load: str) -> str:
        """Return the message that the load separates an angular-contact bearing."""
        required = HALF_ZONE * self.radial_load * math.tan(self.contact_angle)
        return (
            f"an angular-contact bearing comes apart under a {load}, as its rings support the "
            f"balls on one side only; give axial_load, of at least about {required:.3g} N to load "
            "half of the balls"
        )

    @property
    def groove_distance(self) -> float:
        """Distance of the groove centres at zero clearance and load, A = r_i + r_e - D [m]."""
        return (sum(self.osculation) - 1.0) * self.ball_diameter

    @cached_property
    def play(self) -> float:
        """Diametral clearance, given or from the contact angle [m]."""
        if self.contact_angle > 0.0:
            return 2.0 * self.groove_distance * (1.0 - math.cos(self.contact_angle))
        return self.clearance

    @property
    def angles(self) -> Field:
        """Positions of the balls, from the direction of the radial load [rad]."""
        return 2.0 * np.pi * np.arange(self.balls) / self.balls

    def stiffness(self, pair: ElasticPair) -> float:
        """Return load over approach of both rings to the power 3/2, nominal angle [N/m^1.5]."""
        approach = 0.0
        for radii in self._radii(self.contact_angle):
            of_contact = elliptic_contact(1.0, radii, pair.reduced_modulus).approach
            assert of_contact is not None
            approach += of_contact
        return float(approach**-EXPONENT)

    def shifts(self, pair: ElasticPair) -> tuple[float, float, float]:
        """Return the displacements of the inner ring: radial and axial [m], tilt [rad].

        The axial one is measured from the middle of the axial play.
        """
        if self.radial_load == self.axial_load == 0.0:
            return 0.0, 0.0, self.tilt or 0.0
        stiffness = self.stiffness(pair)
        elastic = (max(self.radial_load, self.axial_load) / stiffness) ** (1.0 / EXPONENT)
        if not self.tilt and (self.axial_load == 0.0 or self.radial_load == 0.0):
            return self._under_one_load(stiffness, elastic)
        return self._in_si(elastic * self._equilibrium(stiffness, elastic))

    def moment(self, pair: ElasticPair) -> float:
        """Return the tilting moment on the shaft [N m]; 0 if the ring is free to tilt."""
        if self.tilt is None:
            return 0.0
        radial, axial, tilt = self.shifts(pair)
        forces = self._forces(np.array([radial, axial, tilt * self._arm]), self.stiffness(pair))
        return float(forces[2]) * self._arm

    def _equilibrium(self, stiffness: float, elastic: float) -> Field:
        """Return the shifts over `elastic` that minimise the potential energy under both loads.

        The minimum is unique: approaches are distances less a constant, so that they and their
        power 5/2 are convex in the shifts. An imposed tilt is not an unknown.
        """
        balance = _Balance(self, stiffness, elastic)
        minimum = scipy.optimize.minimize(
            balance.energy,
            self._initial_shifts(elastic)[: balance.free],
            jac=balance.residual,
            hess=balance.tangent,
            method="trust-exact",
            options={"gtol": 1e-8, "maxiter": 2000},
        ).x
        polished = scipy.optimize.root(balance.residual, minimum, options={"xtol": 1e-13}).x
        errors = [float(np.max(np.abs(balance.residual(s)))) for s in (minimum, polished)]
        if min(errors) < 1e-8:
            return balance.with_tilt(np.asarray(polished if errors[1] < errors[0] else minimum))
        raise AsperityError(
            f"no equilibrium was found under a radial load of {self.radial_load:g} N and an axial "
            f"load of {self.axial_load:g} N; leave a small axial load out, or check ball_diameter "
            "and osculation"
        )

    def _initial_shifts(self, elastic: float) -> Field:
        """Return shifts over `elastic` at which the balls touch."""
        radial = (max(self.play, 0.0) / 2.0 + elastic) / elastic
        axial = self.groove_distance * math.sqrt(1.0 - self._free_cosine**2) / elastic
        return np.array([radial, axial, 0.0])

    def _stiffnesses(self, shifts: Field, stiffness: float, elastic: float) -> Field:
        """Return the tangent stiffness, in larger loads per `approach`, shape (3, 3)."""
        loads, angles = self._balls(elastic * shifts, stiffness)
        slopes = tangent_stiffness(loads, angles, self.angles, stiffness, self.groove_distance)
        return np.asarray(slopes * elastic / max(self.radial_load, self.axial_load))

    def stiffness_matrix(self, pair: ElasticPair) -> Field:
        """Return d(force)/d(shift) of the inner ring, shape (3, 3): radial, axial, tilt.

        Forces [N] and moment [N m] by shifts [m] and tilt [rad].
        """
        loads, angles = self.loads(pair)
        slopes = tangent_stiffness(
            loads, angles, self.angles, self.stiffness(pair), self.groove_distance
        )
        arms = np.array([1.0, 1.0, self._arm])
        return np.asarray(slopes * np.outer(arms, arms))

    def _under_one_load(self, stiffness: float, elastic: float) -> tuple[float, float, float]:
        """Return the shifts under a radial or an axial load alone, along one axis only."""
        axis, load = (0, self.radial_load) if self.axial_load == 0.0 else (1, self.axial_load)

        def along_axis(shift: float) -> Field:
            return np.array([shift if index == axis else 0.0 for index in range(3)])

        def excess(shift: float) -> float:
            return float(self._forces(along_axis(shift), stiffness)[axis]) - load

        upper = double_until(elastic + abs(self.play), lambda shift: excess(shift) > 0.0)
        shift = float(scipy.optimize.brentq(excess, 0.0, upper, xtol=1e-18, rtol=1e-14))
        return self._in_si(along_axis(shift))

    def _in_si(self, shifts: Field) -> tuple[float, float, float]:
        return float(shifts[0]), float(shifts[1]), float(shifts[2]) / self._arm

    def loads(self, pair: ElasticPair) -> tuple[Field, Field]:
        """Return the loads [N] and contact angles [rad] of the balls.

        Raises
        ------
        BadInput
            The thrust does not hold an angular-contact bearing together.
        """
        radial, axial, tilt = self.shifts(pair)
        loads, angles = self._balls(
            np.array([radial, axial, tilt * self._arm]), self.stiffness(pair)
        )
        if self.contact_angle > 0.0 and np.any(angles[loads > 0.0] <= 0.0):
            raise BadInput(
                self._separation(
                    f"thrust of {self.axial_load:g} N with {self.radial_load:g} N radial load"
                )
            )
        return loads, angles

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Return both contacts of each loaded ball."""
        contacts = []
        (loads, contact_angles) = self.loads(pair)
        for number, (position, load, angle) in enumerate(
            zip(self.angles, loads, contact_angles, strict=True)
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
    def frequencies(self) -> dict[str, float]:
        """Frequencies of shaft, rings, ball and cage at the free contact angle [Hz]."""
        return self._kinematics(self.free_angle).frequencies

    @property
    def free_angle(self) -> float:
        """Contact angle under a vanishing thrust [rad]; 0 under radial load alone.

        Characteristic frequencies of a bearing are usually given for this angle.
        """
        return self.contact_angle if self.axial_load == 0.0 else math.acos(self._free_cosine)

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, the tilt and the largest contact angle."""
        contacts = self.contacts(pair)
        loads, angles = self.loads(pair)
        notes = ["Rings are rigid; spin of the balls is not covered."]
        notes += self._tilt_notes(pair)
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

    def _tilt_notes(self, pair: ElasticPair) -> Iterator[str]:
        """Yield notes on tilt and moment of the inner ring, if relevant, and on the load zone."""
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
        loaded = int(np.count_nonzero(self.loads(pair)[0]))
        if self.contact_angle > 0.0 and loaded < self.balls // 2:
            yield (
                f"The thrust loads {loaded} of {self.balls} balls; angular-contact bearings are "
                "usually preloaded so that at least half of the balls are loaded."
            )

    @property
    def _free_cosine(self) -> float:
        """Cosine of the free contact angle."""
        return min(1.0 - self.play / (2.0 * self.groove_distance), 1.0)

    @property
    def _arm(self) -> float:
        """Radius of the circle of the inner groove's centres, the arm of a tilt [m]."""
        inner = (self.osculation[0] - 0.5) * self.ball_diameter
        return self.pitch_diameter / 2.0 + inner * self._free_cosine

    def _balls(self, shifts: Field, stiffness: float) -> tuple[Field, Field]:
        """Return loads and contact angles for shifts of the inner ring (third: tilt · `_arm`)."""
        across = self.groove_distance - self.play / 2.0 + shifts[0] * np.cos(self.angles)
        along = shifts[1] + shifts[2] * np.cos(self.angles)
        elastic = np.maximum(np.hypot(across, along) - self.groove_distance, 0.0)
        return stiffness * elastic**EXPONENT, np.arctan2(along, across)

    def _forces(self, shifts: Field, stiffness: float) -> Field:
        """Return radial force, axial force and moment over `_arm` [N]."""
        loads, angles = self._balls(shifts, stiffness)
        axial = loads * np.sin(angles)
        cosines = np.cos(self.angles)
        return np.array([(loads * np.cos(angles)) @ cosines, axial.sum(), axial @ cosines])

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


class _Balance(NamedTuple):
    """Balance of a bearing's balls with both loads; shifts are in units of `approach` [m]."""

    bearing: BallBearing
    stiffness: float
    approach: float  # of one ball under the larger load

    @property
    def free(self) -> int:
        """Number of free shifts: an imposed tilt is not an unknown."""
        return 3 if self.bearing.tilt is None else 2

    @property
    def applied(self) -> Field:
        """Applied forces along the free shifts [N]."""
        return np.array([self.bearing.radial_load, self.bearing.axial_load, 0.0])[: self.free]

    @property
    def force(self) -> float:
        """The larger of both loads [N]."""
        return max(self.bearing.radial_load, self.bearing.axial_load)

    def with_tilt(self, free_shifts: Field) -> Field:
        """Return all three shifts: the free ones, and the imposed tilt if there is one."""
        tilt = (self.bearing.tilt or 0.0) * self.bearing._arm / self.approach
        return np.concatenate([free_shifts, np.array([0.0, 0.0, tilt])[self.free :]])

    def energy(self, shifts: Field) -> float:
        """Return the potential energy, per approach and the larger load."""
        loads, _ = self.bearing._balls(self.approach * self.with_tilt(shifts), self.stiffness)
        approaches = (loads / self.stiffness) ** (1.0 / EXPONENT)
        return float(0.4 * loads @ approaches / self.approach - self.applied @ shifts) / self.force

    def residual(self, shifts: Field) -> Field:
        """Return the unbalanced forces, per the larger load."""
        forces = self.bearing._forces(self.approach * self.with_tilt(shifts), self.stiffness)
        return np.asarray((forces[: self.free] - self.applied) / self.force)

    def tangent(self, shifts: Field) -> Field:
        """Return the tangent stiffness of the free shifts."""
        stiffnesses = self.bearing._stiffnesses(
            self.with_tilt(shifts), self.stiffness, self.approach
        )
        return stiffnesses[: self.free, : self.free]
