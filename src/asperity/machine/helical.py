"""External helical gear pair: slices across the face, each a spur gear pair in mesh.

The line of contact crosses the plane of action at the base helix angle βb. A slice at a point of
the path of contact has the speeds of the transverse section and, normal to the line, the radius
R/cos βb. The load of all lines of contact is divided among the slices in proportion to their
stiffness, so that it balances the torque at any time. The stiffness along the path is that which
gives a spur gear pair the load sharing of ISO/TR 15144-1.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.machine.element import MachineContact
from asperity.machine.gear import SpurGear

HELIX_ANGLES = 1.0, 45.0  # [deg]
MESH_STEPS = 512  # of a mesh cycle
WIDE = 2.0  # total contact ratio above which ISO/TR 15144-1 divides the load evenly
BUTTRESSING = 0.3  # rise of the buttressing factor at the ends of the path, overlap ratio from 1
BUTTRESSED = 0.2  # its reach from the ends, over sin βb and the distance of the pitch point
END_STIFFNESS = 0.5  # of a slice at the ends of the path, over that in single contact


@dataclass(frozen=True, kw_only=True)
class HelicalGear(SpurGear):
    """Helical gear pair with driving pinion.

    Parameters
    ----------
    helix_angle : at the reference cylinder [rad], of either hand
    module, pressure_angle, profile_shift : of the normal section
    teeth, face_width, torque, speed, centre_distance, tip_diameters : as in `SpurGear`

    Raises
    ------
    BadInput
        as `SpurGear`; the helix angle is not between 1 and 45 deg.

    Examples
    --------
    >>> import math
    >>> from asperity.machine import HelicalGear
    >>> gear = HelicalGear(
    ...     module=2e-3,
    ...     teeth=(20, 30),
    ...     pressure_angle=math.radians(20.0),
    ...     helix_angle=math.radians(15.0),
    ...     face_width=0.02,
    ...     torque=50.0,
    ...     speed=150.0,
    ... )
    >>> f"{gear.contact_ratio:.2f} + {gear.overlap_ratio:.2f}"
    '1.53 + 0.82'
    """

    helix_angle: float

    def __post_init__(self) -> None:
        low, high = HELIX_ANGLES
        degrees = math.degrees(self.helix_angle)
        if not low <= degrees <= high:
            remedy = (
                f"below {low:g} deg use a spur gear"
                if 0.0 <= degrees < low
                else "give it without its hand"
            )
            raise BadInput(
                f"helix_angle must lie between {low:g} and {high:g} deg, got {degrees:g} deg; "
                f"{remedy}"
            )
        super().__post_init__()

    @property
    def transverse_module(self) -> float:
        """Module in the section across the axis, m/cos β [m]."""
        return self.module / math.cos(self.helix_angle)

    @property
    def transverse_pressure_angle(self) -> float:
        """Pressure angle in the section across the axis: tan αt = tan α/cos β [rad]."""
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @property
    def base_helix_angle(self) -> float:
        """Helix angle at the base cylinder: sin βb = sin β cos α [rad]."""
        return math.asin(math.sin(self.helix_angle) * math.cos(self.pressure_angle))

    @property
    def overlap_ratio(self) -> float:
        """Overlap ratio b tan βb/p_b of the face."""
        return self.face_width * math.tan(self.base_helix_angle) / self.base_pitch

    @property
    def axial_force(self) -> float:
        """Axial force on each gear [N]."""
        return self.normal_force * math.tan(self.base_helix_angle)

    @property
    def line_length(self) -> float:
        """Length of the longest line of contact of a pair of teeth [m]."""
        across = self.face_width / math.cos(self.base_helix_angle)
        along = self.contact_ratio * self.base_pitch / math.sin(self.base_helix_angle)
        return min(across, along)

    def line_load(self, distance: Field | float, start: Field | float) -> Field:
        """Return the load per length [N/m] at distances from the pinion's base circle.

        Parameters
        ----------
        distance : of the slice, 0 outside the path of contact [m]
        start : distance at which the line of contact of a pair begins, at one end of the face [m]
        """
        stiffness = np.interp(distance, *self._stiffness_points, left=0.0, right=0.0)
        return np.asarray(
            stiffness * self.normal_force / (self.face_width * self._mean_stiffness(start))
        )

    def share(self, distance: float) -> float:
        """Return the largest load of the slice at a distance [m], in a mesh cycle.

        As a fraction of that of a spur pair, which alone carries the load: torque/(r_b1 b).
        """
        passage = min(self.overlap_ratio, 1.0) * self.base_pitch
        starts = distance - np.linspace(0.0, passage, MESH_STEPS)
        largest = float(np.max(self.line_load(distance, starts)))
        return largest * self.face_width / self.normal_force

    def rated_line_load(self, distance: float) -> float:
        """Return the line load [N/m] at a distance [m] by ISO/TR 15144-1, for ratings.

        The load sharing factor is that of a spur pair, or 1/ε for a total contact ratio above 2,
        times the buttressing factor, which rises at the ends of the path.
        """
        shared = (
            1.0 / self.contact_ratio
            if self.contact_ratio + self.overlap_ratio > WIDE
            else super().share(distance)
        )
        force = self.normal_force / math.cos(self.base_helix_angle)
        return shared * self._buttressing(distance) * force / self.face_width

    def contact(self, name: str, distance: float) -> MachineContact:
        """Return the contact of the slice at a distance s [m], at its largest load in a mesh cycle.

        The load is that of the longest line of contact, if the slice's load acts all along it.
        """
        spur = super().contact(name, distance)
        assert not isinstance(spur.radius, tuple)
        return replace(
            spur,
            load=self.share(distance) * self.normal_force / self.face_width * self.line_length,
            radius=spur.radius / math.cos(self.base_helix_angle),
            length=self.line_length,
        )

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:  # noqa: ARG002 (rigid teeth)
        """Return the limits of the model."""
        notes = [
            "Each contact is a slice of the face at its largest load in a mesh cycle. Slices share "
            "the load in proportion to a stiffness by ISO/TR 15144-1 for unmodified teeth; "
            "support by neighbouring slices, tip relief, misalignment and dynamic loads are not "
            "covered.",
            f"The helix loads each shaft with an axial force of {self.axial_force:.4g} N.",
        ]
        if "C" not in self.path:
            notes.append("The pitch point lies outside the path of contact.")
        return tuple(notes)

    def title(self) -> str:
        """Return numbers of teeth, helix angle, and contact and overlap ratio."""
        first, second = self.teeth
        return (
            f"Helical gear pair {first}/{second}, helix angle "
            f"{math.degrees(self.helix_angle):.3g} deg, contact ratio {self.contact_ratio:.2f}, "
            f"overlap ratio {self.overlap_ratio:.2f}"
        )

    def _buttressing(self, distance: float) -> float:
        """Return the buttressing factor of ISO/TR 13989-1 at a distance [m]."""
        pitch_point = self.base_radii[0] * math.tan(self.working_angle)
        reach = BUTTRESSED * math.sin(self.base_helix_angle) * pitch_point
        from_end = min(distance - self.path["A"], self.path["E"] - distance)
        rise = BUTTRESSING * min(self.overlap_ratio, 1.0)
        return 1.0 + rise * max(0.0, 1.0 - from_end / reach)

    @cached_property
    def _stiffness_points(self) -> tuple[Field, Field]:
        """Distances A, B, D, E [m] and the relative stiffness of a slice there."""
        points = self.path
        distances = np.array([points["A"], points["B"], points["D"], points["E"]])
        return distances, np.array([END_STIFFNESS, 1.0, 1.0, END_STIFFNESS])

    @cached_property
    def _stiffness_integral(self) -> "scipy.interpolate.BSpline":
        return scipy.interpolate.make_interp_spline(*self._stiffness_points, k=1).antiderivative()

    def _mean_stiffness(self, start: Field | float) -> Field:
        """Return the stiffness of all lines of contact, averaged across the face."""
        (first, *_, last), _ = self._stiffness_points
        width = self.overlap_ratio * self.base_pitch
        pairs = np.arange(-math.ceil((last - first + width) / self.base_pitch), 1 + 1)
        offset = np.mod(np.asarray(start)[..., None] - first, self.base_pitch)
        begin = first + offset + pairs * self.base_pitch
        integral = self._stiffness_integral
        covered = integral(np.clip(begin + width, first, last)) - integral(
            np.clip(begin, first, last)
        )
        return np.asarray(covered.sum(axis=-1) / width)
