"""External spur gear pair: contacts along the line of action, with load sharing.

Geometry, speeds and radii are exact for rigid involutes. Load sharing follows ISO/TR 15144-1 for
unmodified profiles (1/3 to 2/3 with two pairs in contact, 1 with one); tip relief, tooth stiffness
and dynamic loads are not modelled.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal, get_args

import numpy as np
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MachineContact, require_count, rotation_hz

PathPoint = Literal["A", "AB", "B", "C", "D", "DE", "E"]
# Tolerance of the sum of profile shifts [modules], for rounded catalogue values
SHIFT_TOLERANCE = 0.002
# Basic rack [modules]; its straight flank ends one addendum below the reference line
ADDENDUM = 1.0
DEDENDUM = 1.25


@dataclass(frozen=True, kw_only=True)
class SpurGear:
    """Spur gear pair with driving pinion.

    Parameters
    ----------
    module : [m]
    teeth : numbers of teeth of pinion and wheel
    pressure_angle : pressure angle of the basic rack [rad]
    profile_shift : profile shift coefficients of pinion and wheel
    face_width : common face width [m]
    torque : torque on the pinion [N m]
    speed : speed of the pinion [rad/s]
    centre_distance : [m]; None: without backlash
    tip_diameters : of pinion and wheel [m]; None: one module above the shifted reference line

    Raises
    ------
    BadInput
        The teeth do not mesh, jam, interfere with the roots, are pointed, or undercut within the
        path of contact.

    Examples
    --------
    >>> import math
    >>> from asperity.machine import SpurGear
    >>> gear = SpurGear(
    ...     module=4.5e-3,
    ...     teeth=(16, 24),
    ...     pressure_angle=math.radians(20.0),
    ...     face_width=0.014,
    ...     torque=94.1,
    ...     speed=227.0,
    ... )
    >>> f"{gear.contact_ratio:.2f}"
    '1.55'
    """

    place: ClassVar[str] = "path_position_m"

    module: float
    teeth: tuple[int, int]
    pressure_angle: float
    face_width: float
    torque: float
    speed: float
    profile_shift: tuple[float, float] = (0.0, 0.0)
    centre_distance: float | None = None
    tip_diameters: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name, value, unit in (
            ("module", self.module, "m"),
            ("face_width", self.face_width, "m"),
            ("torque", self.torque, "N m"),
            ("speed", self.speed, "rad/s"),
        ):
            require_positive(name, value, unit)
        for count in self.teeth:
            require_count("teeth", count, 5)
        if not 10.0 <= math.degrees(self.pressure_angle) <= 35.0:
            degrees = math.degrees(self.pressure_angle)
            raise BadInput(
                f"pressure_angle must lie between 10 and 35 deg, got {degrees:g} deg; 20 deg is "
                "usual"
            )
        self._require_mesh()
        for body in (0, 1):
            self._require_sound_teeth(body)

    @property
    def transverse_module(self) -> float:
        """Module in the section across the axis [m]."""
        return self.module

    @property
    def transverse_pressure_angle(self) -> float:
        """Pressure angle of the basic rack in the section across the axis [rad]."""
        return self.pressure_angle

    @property
    def base_helix_angle(self) -> float:
        """Helix angle at the base cylinder [rad]; 0 without a helix."""
        return 0.0

    @property
    def overlap_ratio(self) -> float:
        """Overlap ratio of the face; 0 without a helix."""
        return 0.0

    @cached_property
    def reference_radii(self) -> tuple[float, float]:
        """Reference radii of pinion and wheel [m]."""
        first, second = (0.5 * self.transverse_module * count for count in self.teeth)
        return first, second

    @cached_property
    def base_radii(self) -> tuple[float, float]:
        """Base radii of pinion and wheel [m]."""
        first, second = (
            radius * math.cos(self.transverse_pressure_angle) for radius in self.reference_radii
        )
        return first, second

    @cached_property
    def tip_radii(self) -> tuple[float, float]:
        """Tip radii of pinion and wheel [m]."""
        if self.tip_diameters is not None:
            return self.tip_diameters[0] / 2.0, self.tip_diameters[1] / 2.0
        first, second = (
            radius + self.module * (ADDENDUM + shift)
            for radius, shift in zip(self.reference_radii, self.profile_shift, strict=True)
        )
        return first, second

    @cached_property
    def root_radii(self) -> tuple[float, float]:
        """Root radii of pinion and wheel by the basic rack [m]."""
        first, second = (
            radius - self.module * (DEDENDUM - shift)
            for radius, shift in zip(self.reference_radii, self.profile_shift, strict=True)
        )
        return first, second

    @cached_property
    def centres(self) -> float:
        """Centre distance [m]."""
        if self.centre_distance is not None:
            return self.centre_distance
        shift = 2.0 * sum(self.profile_shift) * math.tan(self.pressure_angle) / sum(self.teeth)
        target = involute(self.transverse_pressure_angle) + shift
        if target <= 0.0:
            total = sum(self.profile_shift)
            raise BadInput(
                f"the sum of profile_shift, {total:g}, leaves no room between the axes; raise it"
            )
        angle = float(
            scipy.optimize.brentq(lambda trial: involute(trial) - target, 1e-6, 1.5, xtol=1e-15)
        )
        return sum(self.base_radii) / math.cos(angle)

    @cached_property
    def working_angle(self) -> float:
        """Working pressure angle [rad]: cos = (r_b1 + r_b2)/a."""
        return math.acos(sum(self.base_radii) / self.centres)

    @cached_property
    def half_tooth_angles(self) -> tuple[float, float]:
        """Half the angles of the teeth of pinion and wheel at their base circles [rad]."""
        first, second = (
            (0.5 * math.pi + 2.0 * shift * math.tan(self.pressure_angle)) / count
            + involute(self.transverse_pressure_angle)
            for count, shift in zip(self.teeth, self.profile_shift, strict=True)
        )
        return first, second

    @property
    def base_pitch(self) -> float:
        """Base pitch 2π r_b1/z1 [m]."""
        return math.tau * self.base_radii[0] / self.teeth[0]

    @property
    def line_of_action(self) -> float:
        """Length between the base circles, T = a sin αw [m]."""
        return self.centres * math.sin(self.working_angle)

    @cached_property
    def path(self) -> dict[PathPoint, float]:
        """Points of the path of contact: distance from the pinion's base circle [m], in order.

        A: start; E: end; B to D: single-pair contact; C: pitch point, omitted if it is outside the
        path; AB and DE: halfway.
        """
        start, end = self._ends
        points: dict[PathPoint, float] = {
            "A": start,
            "B": end - self.base_pitch,
            "C": self.base_radii[0] * math.tan(self.working_angle),
            "D": start + self.base_pitch,
            "E": end,
        }
        points["AB"], points["DE"] = (
            (points["A"] + points["B"]) / 2.0,
            (points["D"] + points["E"]) / 2.0,
        )
        inside = (name for name in get_args(PathPoint) if start <= points[name] <= end)
        return dict(sorted(((name, points[name]) for name in inside), key=lambda entry: entry[1]))

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio."""
        start, end = self._ends
        return (end - start) / self.base_pitch

    @property
    def normal_force(self) -> float:
        """Total force along the line of action [N]."""
        return self.torque / self.base_radii[0]

    def share(self, distance: float) -> float:
        """Return the load share of the pair at a distance [m] from the pinion's base circle."""
        start, end = self._ends
        first = end - self.base_pitch
        last = start + self.base_pitch
        tolerance = 1e-9 * self.base_pitch
        if distance < first - tolerance:
            return 1.0 / 3.0 + (distance - start) / (first - start) / 3.0
        if distance > last + tolerance:
            return 1.0 / 3.0 + (end - distance) / (end - last) / 3.0
        return 1.0

    def rated_line_load(self, distance: float) -> float:
        """Return the line load [N/m] at a distance [m] by ISO/TR 15144-1, for ratings."""
        return self.share(distance) * self.normal_force / self.face_width

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (rigid teeth)
        """Return the contacts at the points of `path`."""
        return tuple(self.contact(name, distance) for name, distance in self.path.items())

    def contact(self, name: str, distance: float) -> MachineContact:
        """Return the contact at a distance s [m] from the pinion's base circle.

        u1 = ω1 s, u2 = ω2 (T - s), R = s (T - s)/T.
        """
        length = self.line_of_action
        slower = self.speed * self.teeth[0] / self.teeth[1]
        return MachineContact(
            name=name,
            bodies=("pinion", "wheel"),
            position=distance,
            load=self.share(distance) * self.normal_force,
            geometry="line",
            radius=distance * (length - distance) / length,
            length=self.face_width,
            surface_speeds=(self.speed * distance, slower * (length - distance)),
            overrolling_hz=(rotation_hz(self.speed), rotation_hz(slower)),
        )

    @property
    def frequencies(self) -> dict[str, float]:
        """Frequencies of mesh, both shafts and hunting tooth [Hz]."""
        first, second = self.teeth
        pinion = rotation_hz(self.speed)
        return {
            "mesh_hz": first * pinion,
            "pinion_hz": pinion,
            "wheel_hz": pinion * first / second,
            "hunting_tooth_hz": pinion * math.gcd(first, second) / second,
        }

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:  # noqa: ARG002 (rigid teeth)
        """Return the limits of the model, and a note on an unusual pitch point."""
        notes = [
            "Load sharing follows ISO/TR 15144-1 for unmodified teeth; tip relief, tooth stiffness "
            "and dynamic loads are not covered."
        ]
        pitch = self.path.get("C")
        if pitch is None:
            notes.append("The pitch point lies outside the path of contact.")
        elif self.share(pitch) < 1.0:
            notes.append(
                "At the pitch point C two pairs carry load: the nominal pressure for one pair is "
                "never reached there."
            )
        return tuple(notes)

    def title(self) -> str:
        """Return numbers of teeth and contact ratio."""
        first, second = self.teeth
        return f"Spur gear pair {first}/{second}, contact ratio {self.contact_ratio:.2f}"

    @cached_property
    def _ends(self) -> tuple[float, float]:
        (tip_1, tip_2) = self.tip_radii
        (base_1, base_2) = self.base_radii
        return self.line_of_action - math.sqrt(tip_2**2 - base_2**2), math.sqrt(
            tip_1**2 - base_1**2
        )

    def _require_mesh(self) -> None:
        millimetres = 1e3
        bases = sum(self.base_radii)
        if self.centres <= bases:
            raise BadInput(
                f"at centre_distance {self.centres * millimetres:g} mm the base circles overlap "
                f"and the teeth cannot mesh; it must be above {bases * millimetres:.4g} mm"
            )
        opening = (involute(self.working_angle) - involute(self.transverse_pressure_angle)) * sum(
            self.teeth
        )
        limit = opening / (2.0 * math.tan(self.pressure_angle))
        if sum(self.profile_shift) > limit + SHIFT_TOLERANCE:
            raise BadInput(
                f"the sum of profile_shift, {sum(self.profile_shift):.4g}, jams the teeth, as it "
                f"must be at most {limit:.4f} at this centre distance; lower it or raise "
                "centre_distance"
            )
        for name, tip, base in zip(
            ("pinion", "wheel"), self.tip_radii, self.base_radii, strict=True
        ):
            if tip <= base:
                raise BadInput(
                    f"tip_diameters: the {name}'s {2e3 * tip:g} mm lies inside its base circle; "
                    "raise it"
                )
        start, end = self._ends
        for name, other, interferes in (
            ("wheel", "pinion", start <= 0.0),
            ("pinion", "wheel", end >= self.line_of_action),
        ):
            if interferes:
                raise BadInput(
                    f"the {name}'s tip reaches below the {other}'s base circle and the teeth "
                    f"cannot mesh; lower the {name}'s tip diameter or raise the {other}'s profile "
                    "shift"
                )
        self._require_root_clearance()
        if not 1.0 <= self.contact_ratio < 2.0:
            cause, remedy = (
                ("the teeth lose contact", "raise the tip diameters or lower centre_distance")
                if self.contact_ratio < 1.0
                else (
                    "three pairs carry load, which the load sharing does not cover",
                    "lower the tip diameters",
                )
            )
            raise BadInput(
                f"the transverse contact ratio is {self.contact_ratio:.3f}: {cause}; {remedy}"
            )

    def _require_root_clearance(self) -> None:
        """Raise BadInput if tips of standard length interfere with the roots."""
        if self.tip_diameters is not None:
            return
        for body, (name, other) in enumerate((("pinion", "wheel"), ("wheel", "pinion"))):
            room = self.centres - self.tip_radii[body] - self.root_radii[1 - body]
            if room < 0.0:
                raise BadInput(
                    f"the {name}'s tips interfere with the {other}'s roots by {-1e3 * room:.3f} "
                    f"mm; give tip_diameters reduced by {-2e3 * room:.3f} mm, or lower "
                    "profile_shift"
                )

    def _require_sound_teeth(self, body: int) -> None:
        name = ("pinion", "wheel")[body]
        tip = self.tip_radii[body]
        base = self.base_radii[body]
        shift = self.profile_shift[body]
        half = self.half_tooth_angles[body] - involute(math.acos(base / tip))
        if half <= 0.0:
            raise BadInput(
                f"the {name}'s teeth end in a point inside their tip circle of {2e3 * tip:g} mm; "
                "lower its tip diameter or its profile shift"
            )
        start, end = self._ends
        used = math.hypot(base, start if body == 0 else self.line_of_action - end)
        depth = (ADDENDUM - shift) * self.module
        pitch, angle = self.reference_radii[body], self.transverse_pressure_angle
        cut = _undercut_radius(depth, pitch, angle)
        if cut > used:
            least = ADDENDUM - pitch * math.sin(angle) ** 2 / self.module
            raise BadInput(
                f"the {name}'s teeth are undercut up to a radius of {1e3 * cut:.3f} mm, but "
                f"contact starts at {1e3 * used:.3f} mm; raise its profile shift to {least:.3f}, "
                "or its number of teeth"
            )


def involute(angle: float) -> float:
    """Return the involute of an angle [rad]."""
    return math.tan(angle) - angle


def _undercut_radius(depth: float, pitch: float, angle: float) -> float:
    """Return the radius [m] up to which the rack's corner cuts the involute away; 0 for none.

    The corner, at `depth` below the pitch line [m], moves on a trochoid; the undercut ends where it
    intersects the involute. `pitch` is the reference radius [m].
    """
    base = pitch * math.cos(angle)
    if depth <= pitch * math.sin(angle) ** 2:
        return 0.0
    # travel of the rack from the position with the flank at the pitch point; the gear turns by
    # travel/pitch; the flank forms the tooth down to the base circle, at -pitch tan(angle)
    travel = np.linspace(-2.0 * pitch, -pitch * math.tan(angle), 4000)
    across = travel + depth * math.tan(angle)
    up = pitch - depth
    radius = np.hypot(across, up)
    corner = np.arctan2(across, up) - travel / pitch  # polar angles on the gear
    at_radius = np.arccos(np.minimum(base / radius, 1.0))
    flank = involute(angle) - (np.tan(at_radius) - at_radius)
    return float(np.max(radius[(radius > base) & (corner < flank)], initial=base))
