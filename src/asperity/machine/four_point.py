"""Four-point contact ball bearing: arched rings, each ball with up to four contacts.

Two opposite contacts of a ball, left on one ring and right on the other, carry the same load. They
are a row of an angular-contact bearing; the other two form its mirror image. The loads of both rows
on a ball are superposed; where both are loaded, they differ by up to 0.5 % from the balance of a
ball on four contacts, because contact angles change under load.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ElasticPair
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.machine.ball import RINGS, BallBearingBase
from asperity.machine.element import MachineContact, rotation_hz
from asperity.machine.rolling import (
    STEEL_DENSITY,
    RollingKinematics,
    centrifugal_notes,
    load_zone_notes,
)
from asperity.machine.stiffness import BallRow

MIN_CONTACT_ANGLE = math.radians(10.0)
SIDES = ("left", "right"), ("right", "left")  # contacts of both rows, at inner and outer ring


@dataclass(frozen=True, kw_only=True)
class FourPointBearing(BallBearingBase):
    """Four-point contact ball bearing with a rotating inner ring.

    Each raceway consists of two arcs. A thrust loads the left arc of the inner and the right arc of
    the outer ring; under a radial load all four carry, and under both the equilibrium decides.

    A ball with two loaded contacts rolls as in an angular-contact bearing. One with four cannot
    roll at all of them. It is assumed to turn about an axis parallel to the bearing's, at the speed
    ω_b, with the speed ω_c of the cage for which the mean sliding at each ring, weighted with the
    loads, is zero: with c = cos α, its weighted mean c_m at a ring, and γ = D c_m/d_m,

    - ω_c = ω_i (1/γ_i - 1)/(1/γ_i + 1/γ_o) and ω_b = ω_c (1/γ_o + 1).

    The surfaces slide at the centre of a contact by

    - Δu = (D/2)(c_m - c)(ω_i - ω_c + ω_b) at the inner ring,
    - Δu = (D/2)(c_m - c)(ω_b - ω_c) at the outer ring,

    the difference of the contact's `surface_speeds`. About the normals they spin at
    (ω_i - ω_c + ω_b) sin α and (ω_b - ω_c) sin α, see `spin_speeds`; the solution of a contact
    does not contain this.

    Parameters
    ----------
    balls, ball_diameter, pitch_diameter, speed, osculation, tilt : as in `BallBearing`
    contact_angle : resting angle (shim angle) of a ball on both arcs of a ring [rad]
    radial_load, axial_load : [N]; either may be 0
    clearance : diametral clearance [m]; negative: preload

    Raises
    ------
    BadInput
        The balls do not fit or carry no load, or contact angle or osculation are invalid.

    Examples
    --------
    >>> from asperity.contact.conditions import ElasticPair
    >>> from asperity.machine import FourPointBearing
    >>> steel = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
    >>> bearing = FourPointBearing(
    ...     balls=12, ball_diameter=12e-3, pitch_diameter=60e-3, speed=157.0, radial_load=2000.0
    ... )
    >>> [f"{contact.name}: {contact.load:.0f} N" for contact in bearing.contacts(steel)[:2]]
    ['ball 0, left inner ring: 441 N', 'ball 0, right outer ring: 441 N']
    """

    contact_angle: float = math.radians(35.0)

    def __post_init__(self) -> None:
        self._require_grooves()
        if self.contact_angle < MIN_CONTACT_ANGLE:
            raise BadInput(
                "contact_angle must lie between 10 and 60 deg, got "
                f"{math.degrees(self.contact_angle):g} deg; below, both arcs of a ring are one "
                "groove: use the kind ball-bearing"
            )
        self._require_play()
        self._require_loads()

    @cached_property
    def play(self) -> float:
        """Diametral clearance of a ball bearing with the same free contact angle [m].

        2 A (1 - cos α) + s: the arcs' centres of a row are A cos α - s/2 apart, across the axis.
        """
        return 2.0 * self.groove_distance * (1.0 - math.cos(self.contact_angle)) + self.clearance

    @property
    def axial_play(self) -> float:
        """Axial clearance between both directions [m]: 2 A (sin α_f - sin α), α_f free angle."""
        free = math.sqrt(1.0 - self._free_cosine**2)
        return 2.0 * self.groove_distance * (free - math.sin(self.contact_angle))

    def loads(self, pair: ElasticPair) -> tuple[Field, Field]:
        """Return loads [N] and contact angles [rad] of both rows, each of shape (2, balls).

        The first row carries the thrust; each load acts on two opposite contacts.
        """
        shifts = self._displacement(pair)
        rows = [row.loads(shifts) for row in self._rows(self.stiffness(pair))]
        return np.stack([loads for loads, _ in rows]), np.stack([angles for _, angles in rows])

    def contact_angles(self, pair: ElasticPair) -> Field:
        """Return the contact angles at both rings [rad], shape (2 rings, 2 rows, balls).

        They are equal at both rings for two loaded contacts. A ball with four divides the
        displacement of the rings in the ratio of the compliances of its contacts.
        """
        loads, angles = self.loads(pair)
        shifts = self._displacement(pair)
        across = shifts[0] * np.cos(self.angles) - self.clearance / 2.0
        along = shifts[1] + shifts[2] * np.cos(self.angles)
        compliances = np.array(self._compliances(pair))
        by_ring = []
        for groove, share in zip(
            self.osculation,
            compliances / compliances.sum(),
            strict=True,
        ):
            arm = (groove - 0.5) * self.ball_diameter
            sine, cosine = (arm * f(self.contact_angle) for f in (math.sin, math.cos))
            by_ring.append(
                [
                    np.arctan2(sine + side * share * along, cosine + share * across)
                    for side in (1, -1)
                ]
            )
        return np.where(np.all(loads > 0.0, axis=0), np.array(by_ring), angles)

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Return the loaded contacts of each ball."""
        return tuple(contact for contact, _ in self._contacts_with_spin(pair))

    def spin_speeds(self, pair: ElasticPair) -> dict[str, float]:
        """Return the spin of the contacts of balls with four loaded contacts [rad/s], by name."""
        return {
            contact.name: spin
            for contact, spin in self._contacts_with_spin(pair)
            if spin is not None
        }

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, the balls with four contacts, spin and contact angle."""
        loads, angles = self.loads(pair)
        contacts = self.contacts(pair)
        notes = ["Rings are rigid. Spin of the contacts is stated, not part of their solution."]
        notes += self._tilt_notes(pair)
        notes += self._spin_notes(pair)
        row, ball = np.unravel_index(np.argmax(loads), loads.shape)
        largest = float(angles[row, ball])
        notes.append(
            f"The most loaded ball has a contact angle of {math.degrees(largest):.2f} deg."
        )
        notes += self._overlap_notes(contacts[int(np.argmax([c.load for c in contacts]))], pair)
        mass = STEEL_DENSITY * math.pi / 6.0 * self.ball_diameter**3
        centrifugal = centrifugal_notes(self._kinematics(largest).centrifugal_load(mass), contacts)
        zone = load_zone_notes(loads.sum(axis=0).tolist(), "ball") if self.radial_load else ()
        return (*notes, *zone, *centrifugal)

    def title(self) -> str:
        """Return type and number of balls."""
        return f"Four-point contact ball bearing, {self.balls} balls"

    def _rows(self, stiffness: float) -> tuple[BallRow, ...]:
        offset = self.groove_distance * math.sin(self.contact_angle)
        return tuple(
            BallRow(
                self.angles,
                self.groove_distance,
                self.play,
                stiffness,
                side,
                offset,
            )
            for side in (1.0, -1.0)
        )

    def _initial_shifts(self, pair: ElasticPair) -> Field:
        """Return shifts at which the balls touch [m]."""
        radial = max(self.clearance, 0.0) / 2.0 + self._approach(pair)
        return np.array([radial, max(self.axial_play, 0.0) / 2.0, 0.0])

    def _displacement(self, pair: ElasticPair) -> Field:
        radial, axial, tilt = self.shifts(pair)
        return np.array([radial, axial, tilt * self._arm])

    def _contacts_with_spin(
        self, pair: ElasticPair
    ) -> Iterator[tuple[MachineContact, float | None]]:
        """Yield each loaded contact with its spin [rad/s]; None for balls with two contacts."""
        loads, _ = self.loads(pair)
        angles = self.contact_angles(pair)
        for ball in np.flatnonzero(loads.sum(axis=0)):
            motion = self._motion(loads[:, ball], angles[:, :, ball])
            for row, ring in ((row, ring) for row in (0, 1) for ring in (0, 1)):
                load, angle = float(loads[row, ball]), float(angles[ring, row, ball])
                if load > 0.0:
                    name = f"{SIDES[row][ring]} {RINGS[ring]}"
                    contact = MachineContact(
                        name=f"ball {ball}, {name}",
                        bodies=(name, "ball"),
                        position=float(self.angles[ball]),
                        load=load,
                        geometry="elliptic",
                        radius=self._radii(angle)[ring],
                        length=None,
                        surface_speeds=motion.surface_speeds(ring, angle),
                        overrolling_hz=motion.overrolling_hz(ring),
                    )
                    yield contact, motion.spin(ring, angle)

    def _motion(self, loads: Field, angles: Field) -> "_BallMotion":
        """Return the motion of a ball with the loads (rows) and contact angles (rings, rows)."""
        if np.any(loads == 0.0):
            return _BallMotion(self._kinematics(float(angles[0, np.argmax(loads)])))
        inner, outer = np.cos(angles) @ loads / loads.sum()
        return _BallMotion(self._kinematics(self.contact_angle), (float(inner), float(outer)))

    def _spin_notes(self, pair: ElasticPair) -> Iterator[str]:
        """Yield a note on the balls with four loaded contacts, and the fastest spin."""
        loads, _ = self.loads(pair)
        four = int(np.count_nonzero(np.all(loads > 0.0, axis=0)))
        loaded = int(np.count_nonzero(loads.sum(axis=0)))
        if four == 0:
            yield "Each loaded ball has two contacts and rolls as in an angular-contact bearing."
            return
        spinning = [
            (abs(spin) * contact.hertz(pair).half_widths[1], abs(spin), contact.name)
            for contact, spin in self._contacts_with_spin(pair)
            if spin is not None
        ]
        sliding, spin, name = max(spinning)
        yield (
            f"Of {loaded} loaded balls {four} have four loaded contacts and turn about an axis "
            f"parallel to the bearing's. They spin by up to {spin:.3g} rad/s at {name}, which "
            f"slides by {sliding:.2g} m/s at the ends of the contact ellipse."
        )

    def _overlap_notes(self, contact: MachineContact, pair: ElasticPair) -> Iterator[str]:
        """Yield a note if the contact ellipse of a ball reaches the middle of the raceway."""
        half = contact.hertz(pair).half_widths[1]
        room = self.contact_angle * self.ball_diameter / 2.0
        if half > room:
            yield (
                f"The contact ellipse at {contact.name} is {2e3 * half:.2f} mm long and passes the "
                f"middle of the raceway, {1e3 * room:.2f} mm from its centre; the load is too high "
                "for separate contacts."
            )


class _BallMotion(NamedTuple):
    """Motion of a ball in the frame of the cage.

    `cosines` are the mean cosines of the contact angles at both rings, for a ball that turns about
    an axis parallel to the bearing's. Without them it rolls without sliding, about an inclined
    axis, with the contact angle of `kinematics`.
    """

    kinematics: RollingKinematics
    cosines: tuple[float, float] | None = None

    @property
    def cage_speed(self) -> float:
        """Speed of the cage [rad/s]."""
        if self.cosines is None:
            return self.kinematics.cage_speed
        inner, outer = self._inverse_ratios
        return self.kinematics.speed * (inner - 1.0) / (inner + outer)

    @property
    def ball_speed(self) -> float:
        """Speed of the ball about its axis [rad/s]."""
        if self.cosines is None:
            return self.kinematics.spin
        return self.cage_speed * (self._inverse_ratios[1] + 1.0)

    @property
    def _inverse_ratios(self) -> tuple[float, float]:
        """1/γ of both rings."""
        assert self.cosines is not None
        inner, outer = self.cosines
        ratio = self.kinematics.pitch_diameter / self.kinematics.diameter
        return ratio / inner, ratio / outer

    def ring_speed(self, ring: int) -> float:
        """Return the speed of a ring relative to the cage [rad/s]."""
        return self.kinematics.speed - self.cage_speed if ring == 0 else self.cage_speed

    def surface_speeds(self, ring: int, angle: float) -> tuple[float, float]:
        """Return the speeds of ring and ball at the centre of a contact [m/s]."""
        if self.cosines is None:
            return self.kinematics.surface_speed, self.kinematics.surface_speed
        across = self.kinematics.diameter * math.cos(angle)
        arm = (self.kinematics.pitch_diameter + (-across if ring == 0 else across)) / 2.0
        return self.ring_speed(ring) * arm, self.ball_speed * across / 2.0

    def spin(self, ring: int, angle: float) -> float | None:
        """Return the relative speed of ring and ball about the normal of a contact [rad/s]."""
        if self.cosines is None:
            return None
        relative = self.ball_speed + (1.0 if ring == 0 else -1.0) * self.ring_speed(ring)
        return relative * math.sin(angle)

    def overrolling_hz(self, ring: int) -> tuple[float, float]:
        """Return the rates at which points of ring and ball pass a contact [Hz]."""
        passages = self.kinematics.count * self.ring_speed(ring)
        return rotation_hz(passages), rotation_hz(self.ball_speed)
