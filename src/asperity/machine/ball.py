"""A ball bearing under radial and axial load: every ball's load and contact angle, deep groove or angular contact.

Rings are rigid (ISO 16281): the shaft holds the inner one at a tilt, or lets it tilt until it
bears no moment. Spin of the balls and gyroscopic moments are not covered.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.contact.hertz import elliptic_contact
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, require_positive
from asperity.machine.element import MachineContact
from asperity.machine.roller import require_carried
from asperity.machine.rolling import (
    STEEL_DENSITY,
    RollingKinematics,
    centrifugal_notes,
    grown,
    load_zone_notes,
)

EXPONENT = 1.5
STEEPEST = math.radians(60.0)  # contact angle
LARGEST_TILT = 0.02  # rad
# thrust from which half of the balls bear over radial load times tan α: Sjövall's integrals
HALF_ZONE = 1.22
OSCULATION = 0.52, 0.53  # groove radius over ball diameter, of inner and outer ring: ISO 281's
RINGS = "inner ring", "outer ring"


@dataclass(frozen=True, kw_only=True)
class BallBearing:
    """A ball bearing, its inner ring turning.

    Parameters
    ----------
    balls : how many
    ball_diameter, pitch_diameter : [m]
    radial_load, axial_load : [N]
    speed : of the inner ring [rad/s]
    osculation : groove radius over ball diameter, of inner and outer ring
    clearance : diametral [m]; negative: preload. It decides the free contact angle
    contact_angle : free contact angle [rad], in place of the clearance
    tilt : of the inner ring, as its shaft holds it [rad]; None: free, until it bears no moment

    Raises
    ------
    BadInput
        for balls that do not fit or none of which carries, grooves that the ball does not fit, a clearance beside a
        contact angle that it contradicts, or an angular-contact bearing without the thrust that holds it together.
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
                    f"osculation must lie above 0.5 and at most at 0.6, got {groove:g}; 0.52 is usual"
                )
        if not 0.0 <= self.contact_angle <= math.radians(60.0):
            raise BadInput(
                f"contact_angle must lie between 0 and 60 deg, got {math.degrees(self.contact_angle):g} deg; correct it"
            )
        if self.contact_angle > 0.0 and self.clearance != 0.0:
            own = 2e6 * self.groove_distance * (1.0 - math.cos(self.contact_angle))
            raise BadInput(
                f"clearance and contact_angle say the same thing: {math.degrees(self.contact_angle):g} deg is a "
                f"clearance of {own:.1f} um in these grooves; leave one of them out"
            )
        self._require_shape()
        if not 0.0 <= self.axial_load < math.inf:
            raise BadInput(
                f"axial_load must not be negative, got {self.axial_load:g} N; leave out its sign"
            )
        if not 0.0 <= self.radial_load < math.inf:
            raise BadInput(
                f"radial_load must not be negative, got {self.radial_load:g} N; leave out its sign"
            )
        if self.radial_load == self.axial_load == 0.0 <= self.clearance:
            raise BadInput(
                "radial_load and axial_load are both 0 N, no ball carries; give one of them"
            )
        if self.contact_angle > 0.0 and self.axial_load == 0.0:
            raise BadInput(self._apart(f"radial_load of {self.radial_load:g} N alone"))
        require_carried(
            math.hypot(self.radial_load, self.axial_load),
            self.clearance,
            self.ball_diameter,
            "ball",
        )
        _ = self._kinematics(0.0)

    def _require_shape(self) -> None:
        require_positive("ball_diameter", self.ball_diameter, "m")
        widest = 2.0 * self.groove_distance * (1.0 - math.cos(STEEPEST))
        if self.clearance > widest:
            raise BadInput(
                f"clearance of {1e6 * self.clearance:g} um lets the balls of these grooves bear at more than 60 deg; "
                f"it must be at most {1e6 * widest:.1f} um, or the osculation wider"
            )
        if self.tilt is not None and not abs(self.tilt) <= LARGEST_TILT:
            raise BadInput(
                f"tilt must lie between -20 and 20 mrad, got {1e3 * self.tilt:g} mrad; bearings bear 1 or 2"
            )

    def _apart(self, under: str) -> str:
        """That an angular-contact bearing comes apart, and what would hold it."""
        needed = HALF_ZONE * self.radial_load * math.tan(self.contact_angle)
        return (
            f"an angular-contact bearing comes apart under a {under}: its rings hold the balls on one side only; "
            f"give axial_load, which half of the balls bear from about {needed:.3g} N"
        )

    @property
    def groove_distance(self) -> float:
        """Between the centres of the two grooves where the ball is just held, A = r_i + r_e - D [m]."""
        return (sum(self.osculation) - 1.0) * self.ball_diameter

    @cached_property
    def play(self) -> float:
        """Diametral clearance, given or that of the contact angle [m]."""
        if self.contact_angle > 0.0:
            return 2.0 * self.groove_distance * (1.0 - math.cos(self.contact_angle))
        return self.clearance

    @property
    def angles(self) -> Field:
        """Where the balls are, from the direction of the radial load [rad]."""
        return 2.0 * np.pi * np.arange(self.balls) / self.balls

    def stiffness(self, pair: ElasticPair) -> float:
        """Load over the power 3/2 of the approach of both rings [N/m^1.5], at the nominal contact angle."""
        approach = 0.0
        for radii in self._radii(self.contact_angle):
            found = elliptic_contact(1.0, radii, pair.reduced_modulus).approach
            assert found is not None
            approach += found
        return float(approach**-EXPONENT)

    def shifts(self, pair: ElasticPair) -> tuple[float, float, float]:
        """Of the inner ring, where the balls carry the load: radial and axial [m], tilt [rad].

        The axial one counts from the middle of the axial play.
        """
        if self.radial_load == self.axial_load == 0.0:
            return 0.0, 0.0, self.tilt or 0.0
        stiffness = self.stiffness(pair)
        elastic = (max(self.radial_load, self.axial_load) / stiffness) ** (1.0 / EXPONENT)
        if not self.tilt and (self.axial_load == 0.0 or self.radial_load == 0.0):
            return self._under_one_load(stiffness, elastic)
        return self._moved(elastic * self._balanced(stiffness, elastic))

    def moment(self, pair: ElasticPair) -> float:
        """What the shaft bears of the inner ring's tilting [N m]; 0 where the ring is free to tilt."""
        if self.tilt is None:
            return 0.0
        radial, axial, tilt = self.shifts(pair)
        forces = self._forces(np.array([radial, axial, tilt * self._arm]), self.stiffness(pair))
        return float(forces[2]) * self._arm

    def _balanced(self, stiffness: float, elastic: float) -> Field:
        """Shifts over `elastic` under both loads: the least of a convex energy, so that there is one balance.

        Balls' approaches are distances less a constant, convex in the shifts, and so is their
        power 5/2. A tilt that the shaft holds is no unknown.
        """
        free = 3 if self.tilt is None else 2
        held = np.array([0.0, 0.0, (self.tilt or 0.0) * self._arm / elastic])
        wanted = np.array([self.radial_load, self.axial_load, 0.0])[:free]
        force = max(self.radial_load, self.axial_load)

        def whole(shifts: Field) -> Field:
            return np.concatenate([shifts, held[free:]])

        def energy(shifts: Field) -> float:
            loads, _ = self._balls(elastic * whole(shifts), stiffness)
            approaches = (loads / stiffness) ** (1.0 / EXPONENT)
            return float(0.4 * loads @ approaches / elastic - wanted @ shifts) / force

        def excess(shifts: Field) -> Field:
            return np.asarray(
                (self._forces(elastic * whole(shifts), stiffness)[:free] - wanted) / force
            )

        pressed = (max(self.play, 0.0) / 2.0 + elastic) / elastic
        aside = self.groove_distance * math.sqrt(1.0 - self._held_cosine**2) / elastic
        manner: Any = {
            "jac": excess,
            "hess": lambda shifts: self._stiffnesses(whole(shifts), stiffness, elastic)[
                :free, :free
            ],
            "method": "trust-exact",
            "options": {"gtol": 1e-8, "maxiter": 2000},
        }
        found = scipy.optimize.minimize(energy, np.array([pressed, aside, 0.0])[:free], **manner).x
        polished = scipy.optimize.root(excess, found, options={"xtol": 1e-13}).x
        best = min((found, polished), key=lambda shifts: float(np.max(np.abs(excess(shifts)))))
        if np.max(np.abs(excess(best))) < 1e-8:
            return whole(np.asarray(best))
        raise AsperityError(
            f"no balance was found under a radial load of {self.radial_load:g} N and an axial one of "
            f"{self.axial_load:g} N; leave a small axial load out, or check ball_diameter and osculation"
        )

    def _stiffnesses(self, shifts: Field, stiffness: float, elastic: float) -> Field:
        """Slopes of the forces by the shifts, in units of `elastic` and of the larger load, shape (3, 3)."""
        loads, angles = self._balls(elastic * shifts, stiffness)
        approaches = (loads / stiffness) ** (1.0 / EXPONENT)
        place, across, along = np.cos(self.angles), np.cos(angles), np.sin(angles)
        pressing = np.stack([across * place, along, along * place])
        turning = np.stack([-along * place, across, across * place])
        stiff = (
            EXPONENT * stiffness * np.sqrt(approaches),
            loads / (self.groove_distance + approaches),
        )
        slopes = (pressing * stiff[0]) @ pressing.T + (turning * stiff[1]) @ turning.T
        return np.asarray(slopes * elastic / max(self.radial_load, self.axial_load))

    def _under_one_load(self, stiffness: float, elastic: float) -> tuple[float, float, float]:
        """Shifts under a radial or an axial load alone, where the ring goes one way only."""
        axis, load = (0, self.radial_load) if self.axial_load == 0.0 else (1, self.axial_load)

        def at(shift: float) -> Field:
            return np.array([shift if place == axis else 0.0 for place in range(3)])

        def excess(shift: float) -> float:
            return float(self._forces(at(shift), stiffness)[axis]) - load

        enough = grown(elastic + abs(self.play), lambda shift: excess(shift) > 0.0)
        return self._moved(
            at(float(scipy.optimize.brentq(excess, 0.0, enough, xtol=1e-18, rtol=1e-14)))
        )

    def _moved(self, shifts: Field) -> tuple[float, float, float]:
        return float(shifts[0]), float(shifts[1]), float(shifts[2]) / self._arm

    def loads(self, pair: ElasticPair) -> tuple[Field, Field]:
        """On every ball [N], and its contact angle [rad].

        Raises
        ------
        BadInput
            for an angular-contact bearing whose thrust does not hold its balls.
        """
        radial, axial, tilt = self.shifts(pair)
        loads, angles = self._balls(
            np.array([radial, axial, tilt * self._arm]), self.stiffness(pair)
        )
        if self.contact_angle > 0.0 and np.any(angles[loads > 0.0] <= 0.0):
            raise BadInput(
                self._apart(f"thrust of {self.axial_load:g} N beside {self.radial_load:g} N across")
            )
        return loads, angles

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Both contacts of every loaded ball."""
        found, (loads, contact_angles) = [], self.loads(pair)
        for number, (place, load, angle) in enumerate(
            zip(self.angles, loads, contact_angles, strict=True)
        ):
            kinematics = self._kinematics(float(angle))
            rings = zip(RINGS, self._radii(float(angle)), kinematics.overrolling_hz, strict=True)
            for ring, radii, passages in rings if load > 0.0 else ():
                contact = MachineContact(
                    name=f"ball {number}, {ring}",
                    bodies=(ring, "ball"),
                    position=float(place),
                    load=float(load),
                    geometry="elliptic",
                    radius=radii,
                    length=None,
                    surface_speeds=(kinematics.surface_speed, kinematics.surface_speed),
                    overrolling_hz=passages,
                )
                found.append(contact)
        return tuple(found)

    @property
    def frequencies(self) -> dict[str, float]:
        """Of shaft, rings, ball and cage, at the free contact angle [Hz]."""
        return self._kinematics(self.free_angle).frequencies

    @property
    def free_angle(self) -> float:
        """Contact angle at which the grooves just hold the balls under thrust [rad]; 0 under radial load alone.

        Loads change it a little; a bearing's characteristic frequencies are usually given for this
        one.
        """
        return self.contact_angle if self.axial_load == 0.0 else math.acos(self._held_cosine)

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """What the model leaves out, and where it does not hold."""
        contacts = self.contacts(pair)
        loads, angles = self.loads(pair)
        said = ["Rings are rigid; spin of the balls is not covered."]
        said += self._tilting(pair)
        largest = float(angles[np.argmax(loads)])
        if largest > 1e-6:
            said.append(
                f"The most loaded ball bears at a contact angle of {math.degrees(largest):.2f} deg."
            )
        mass = STEEL_DENSITY * math.pi / 6.0 * self.ball_diameter**3
        centrifugal = centrifugal_notes(self._kinematics(largest).centrifugal_load(mass), contacts)
        return (*said, *load_zone_notes(loads.tolist(), "ball"), *centrifugal)

    def title(self) -> str:
        """Balls and kind."""
        kind = "Angular-contact" if self.contact_angle > 0.0 else "Deep-groove"
        return f"{kind} ball bearing, {self.balls} balls"

    def _tilting(self, pair: ElasticPair) -> Iterator[str]:
        """How the inner ring is held where that makes a difference, and with what moment."""
        if 0.0 in (self.radial_load, self.axial_load) and not self.tilt:
            return
        if self.tilt is None:
            tilted = 1e3 * self.shifts(pair)[2]
            yield (
                f"The inner ring is free and tilts by {tilted:.2f} mrad, until it bears no moment; a shaft that holds "
                "it upright changes loads and contact angles."
            )
        else:
            yield (
                f"The shaft holds the inner ring at a tilt of {1e3 * self.tilt:g} mrad, with a moment of "
                f'{abs(self.moment(pair)):.3g} N m; a ring that is free to tilt (tilt = "free") is loaded otherwise.'
            )
        bearing = int(np.count_nonzero(self.loads(pair)[0]))
        if self.contact_angle > 0.0 and bearing < self.balls // 2:
            yield (
                f"The thrust holds {bearing} of {self.balls} balls; angular-contact bearings are mounted so that half "
                "of them bear or more."
            )

    @property
    def _held_cosine(self) -> float:
        """Of the contact angle at which the grooves just hold the balls."""
        return min(1.0 - self.play / (2.0 * self.groove_distance), 1.0)

    @property
    def _arm(self) -> float:
        """Radius of the circle of the inner groove's centres, on which a tilt acts [m]."""
        inner = (self.osculation[0] - 0.5) * self.ball_diameter
        return self.pitch_diameter / 2.0 + inner * self._held_cosine

    def _balls(self, shifts: Field, stiffness: float) -> tuple[Field, Field]:
        """Loads and contact angles where the inner ring is shifted so; the third shift is the tilt at `_arm`."""
        across = self.groove_distance - self.play / 2.0 + shifts[0] * np.cos(self.angles)
        along = shifts[1] + shifts[2] * np.cos(self.angles)
        elastic = np.maximum(np.hypot(across, along) - self.groove_distance, 0.0)
        return stiffness * elastic**EXPONENT, np.arctan2(along, across)

    def _forces(self, shifts: Field, stiffness: float) -> Field:
        """Radial and axial force, and the moment over `_arm` [N]."""
        loads, angles = self._balls(shifts, stiffness)
        axial, place = loads * np.sin(angles), np.cos(self.angles)
        return np.array([(loads * np.cos(angles)) @ place, axial.sum(), axial @ place])

    def _kinematics(self, angle: float) -> RollingKinematics:
        return RollingKinematics(
            count=self.balls,
            diameter=self.ball_diameter,
            pitch_diameter=self.pitch_diameter,
            speed=self.speed,
            contact_angle=angle,
        )

    def _radii(self, angle: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """(R_x, R_y) at the inner and the outer ring [m]."""
        inner, outer = self._kinematics(angle).radii
        across = [
            1.0 / (2.0 / self.ball_diameter - 1.0 / (f * self.ball_diameter))
            for f in self.osculation
        ]
        return (inner, across[0]), (outer, across[1])
