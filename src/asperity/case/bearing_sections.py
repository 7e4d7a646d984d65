"""[machine] of a case file for rolling bearings."""

import math
from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator

from asperity.case.messages import Section
from asperity.case.units import (
    OPTIONAL,
    PAIRED,
    Amount,
    Count,
    Length,
    Number,
    amount_in,
    default_amount,
)
from asperity.machine import RollerGuidance, RollerProfile

Rotation: TypeAlias = Annotated[float, amount_in("rad/s")]
Angle: TypeAlias = Annotated[float, amount_in("rad")]
AnyLength: TypeAlias = Annotated[float, amount_in("m", -math.inf)]
ForceOrNone: TypeAlias = Annotated[float, amount_in("N", 0.0)]
AngleOrNone: TypeAlias = Annotated[float, amount_in("rad", 0.0)]
Tilt: TypeAlias = Annotated[
    Annotated[float, amount_in("rad", -math.inf)] | None,
    BeforeValidator(lambda value: None if value == "free" else value),
]


class CylindricalRollerBearingSection(Section):
    """[machine] kind = "cylindrical-roller-bearing"."""

    kind: Literal["cylindrical-roller-bearing"]
    rollers: Count
    roller_diameter: Length
    roller_length: Length
    pitch_diameter: Length
    clearance: AnyLength = default_amount(0.0, "um")
    radial_load: ForceOrNone
    speed: Rotation
    profile: RollerProfile = "straight"


class NeedleBearingSection(CylindricalRollerBearingSection):
    """[machine] kind = "needle-bearing"."""

    kind: Literal["needle-bearing"]  # type: ignore[assignment]
    guidance: RollerGuidance = "cage"


class TaperedRollerBearingSection(Section):
    """[machine] kind = "tapered-roller-bearing"."""

    kind: Literal["tapered-roller-bearing"]
    rollers: Count
    roller_diameter: Length
    roller_length: Length
    pitch_diameter: Length
    cup_angle: Angle
    cone_angle: Annotated[Angle | None, OPTIONAL] = None
    rib_angle: Annotated[Angle | None, OPTIONAL] = None
    radial_load: ForceOrNone = default_amount(0.0, "N")
    axial_load: Annotated[ForceOrNone | None, OPTIONAL] = None
    speed: Rotation
    profile: RollerProfile = "straight"


class BallBearingSection(Section):
    """[machine] kind = "ball-bearing"."""

    kind: Literal["ball-bearing"]
    balls: Count
    ball_diameter: Length
    pitch_diameter: Length
    contact_angle: AngleOrNone = default_amount(0.0, "deg")
    osculation: Annotated[tuple[Number, Number], PAIRED] = (0.52, 0.53)
    clearance: AnyLength = default_amount(0.0, "um")
    radial_load: ForceOrNone = default_amount(0.0, "N")
    axial_load: ForceOrNone = default_amount(0.0, "N")
    tilt: Tilt = default_amount(0.0, "mrad")
    speed: Rotation


class FourPointBearingSection(BallBearingSection):
    """[machine] kind = "four-point-bearing"."""

    kind: Literal["four-point-bearing"]  # type: ignore[assignment]
    contact_angle: Angle = Amount(math.radians(35.0), "35 deg")
