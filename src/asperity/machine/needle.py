"""Needle roller bearing: slender rollers without ribs, with a cage or as a full complement.

Load zone and contacts are those of a cylindrical roller bearing.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

from asperity.contact.conditions import ElasticPair
from asperity.core.errors import BadInput, require_choice
from asperity.machine.roller import CylindricalRollerBearing

RollerGuidance = Literal["cage", "full-complement"]
SLENDERNESS = 3.0, 10.0  # length over diameter of needle rollers (ISO 5593)


@dataclass(frozen=True, kw_only=True)
class NeedleRollerBearing(CylindricalRollerBearing):
    """Needle roller bearing with a rotating inner ring or shaft.

    Parameters
    ----------
    guidance : "cage", or "full-complement" for rollers that touch each other
    rollers, roller_diameter, roller_length, pitch_diameter, radial_load, speed, clearance, profile,
    slices : as in `CylindricalRollerBearing`; the rollers are 3 to 10 times as long as thick

    Raises
    ------
    BadInput
        as `CylindricalRollerBearing`; the rollers are not slender, or a full complement has room
        for another roller.

    Examples
    --------
    >>> from asperity.machine import NeedleRollerBearing
    >>> bearing = NeedleRollerBearing(
    ...     rollers=28,
    ...     roller_diameter=2.5e-3,
    ...     roller_length=12.8e-3,
    ...     pitch_diameter=22.5e-3,
    ...     radial_load=2000.0,
    ...     speed=300.0,
    ...     guidance="full-complement",
    ... )
    >>> f"{bearing.neighbour_sliding_speed:.2f} m/s, {bearing.gap * 1e6:.0f} um"
    '3.33 m/s, 19 um'
    """

    type_name: ClassVar[str] = "Needle roller bearing"

    guidance: RollerGuidance = "cage"

    def __post_init__(self) -> None:
        require_choice("guidance", self.guidance, get_args(RollerGuidance))
        super().__post_init__()
        low, high = SLENDERNESS
        slenderness = self.roller_length / self.roller_diameter
        if slenderness < low * (1.0 - 1e-9):
            raise BadInput(
                f"roller_length is {slenderness:.3g} times roller_diameter, needle rollers have "
                f"{low:g} to {high:g} times; use the kind cylindrical-roller-bearing"
            )
        if slenderness > high * (1.0 + 1e-9):
            raise BadInput(
                f"roller_length is {slenderness:.3g} times roller_diameter, needle rollers have "
                f"{low:g} to {high:g} times; shorten them, or state each row of rollers as a "
                "bearing of its own"
            )
        ratio = self.roller_diameter / self.pitch_diameter
        spare = int(math.pi / math.asin(ratio) * (1.0 - 1e-12)) - self.rollers
        if self.guidance == "full-complement" and spare > 0:
            raise BadInput(
                f"a full complement of {self.rollers} rollers leaves room for {spare} more on the "
                f'pitch_diameter; raise rollers, or state guidance = "cage"'
            )

    @property
    def gap(self) -> float:
        """Gap between neighbouring rollers, evenly spaced [m]: d_m sin(π/Z) - D."""
        return self.pitch_diameter * math.sin(math.pi / self.rollers) - self.roller_diameter

    @property
    def neighbour_sliding_speed(self) -> float | None:
        """Sliding speed of touching neighbours [m/s]; None with a cage.

        Both surfaces move at the roller's surface speed in opposite directions: 2 u.
        """
        if self.guidance == "cage":
            return None
        return 2.0 * self.kinematics.surface_speed

    @property
    def unloading_tilt(self) -> float:
        """Tilt of a ring at which one end of the most loaded roller loses contact [rad].

        The ends approach by 2 δ and 0 instead of δ: 2 δ/L, without the profile.
        """
        approach = self.shift - self.clearance / 2.0
        return 2.0 * approach / self.roller_length

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, and the differences from cylindrical roller bearings."""
        notes = [
            *super().notes(pair),
            "Needle rollers have no ribs: they carry no axial load and skew more easily. A drawn "
            "cup takes the shape of its housing.",
            f"A tilt of {1e3 * self.unloading_tilt:.2g} mrad unloads one end of the most loaded "
            "roller: slender rollers need a stiff, aligned shaft, or a profile.",
            "Thin rollers have small effective radii and thin films; the rated friction torque is "
            "that of cylindrical rollers with a cage, needle rollers have more.",
        ]
        sliding = self.neighbour_sliding_speed
        if sliding is not None:
            notes.append(
                f"The rollers touch each other and slide at {sliding:.3g} m/s, twice their surface "
                "speed; friction and heat between them are not covered."
            )
        return tuple(notes)
