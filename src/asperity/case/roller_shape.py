"""contact.shape of a case file: the axial profile of a roller."""

import math
from dataclasses import replace
from typing import Annotated, Self

from pydantic import model_validator

from asperity.case.messages import Section
from asperity.case.units import OPTIONAL, Amount, Force, Length, amount_in, default_amount, plain
from asperity.contact.conditions import ElasticPair
from asperity.contact.rollers import RollerShape
from asperity.core.errors import BadInput

LOGARITHMS = ("design_load", "iso_diameter", "amplitude")
NONE = default_amount(0.0, "mm")


class ShapeSection(Section):
    """Axial profile of a roller; its logarithm is set by one of the first three keys."""

    design_load: Annotated[Force | None, OPTIONAL] = None  # with uniform pressure: Johns and Gohar
    iso_diameter: Annotated[Length | None, OPTIONAL] = None  # of the roller: ISO 16281's profile
    amplitude: Annotated[Length | None, OPTIONAL] = None
    end_drop: Annotated[Length | None, OPTIONAL] = None  # where the amplitude is given
    crown_radius: Annotated[Length | None, OPTIONAL] = None
    flat: Annotated[float, amount_in("m", 0.0)] = NONE
    chamfer: Annotated[float, amount_in("m", 0.0)] = NONE
    chamfer_angle: Annotated[float, amount_in("rad")] = Amount(math.pi / 4.0, "45 deg")
    tilt: Annotated[float, amount_in("rad", -math.inf)] = default_amount(0.0, "mrad")

    @model_validator(mode="after")
    def _one_logarithm(self) -> Self:
        names = [key for key in LOGARITHMS if getattr(self, key) is not None]
        if len(names) > 1:
            raise BadInput(
                f"has {names[0]} and {names[1]}, which both define the logarithmic profile; leave "
                "one of them out"
            )
        if self.end_drop is not None and self.amplitude is None:
            raise BadInput(
                "has an end_drop without an amplitude; state both, or design_load, which defines "
                "both"
            )
        if self.iso_diameter is not None and self.flat > 0.0:
            raise BadInput(
                "has a flat and an iso_diameter, which both define the straight middle; leave one "
                "of them out"
            )
        return self

    def shape(self, length: float, radius: float, pair: ElasticPair) -> RollerShape:
        """Return the profile of a roller of that length [m] and effective radius [m]."""
        base_shape = RollerShape(
            flat=plain(self.flat),
            crown_radius=plain(self.crown_radius),
            chamfer=plain(self.chamfer),
            chamfer_angle=plain(self.chamfer_angle),
            tilt=plain(self.tilt),
        )
        between = base_shape.between_chamfers(length)
        if self.design_load is not None:
            logarithmic = RollerShape.johns_gohar(
                plain(self.design_load), between, radius, pair.reduced_modulus
            )
        elif self.iso_diameter is not None:
            logarithmic = RollerShape.iso(plain(self.iso_diameter), between)
        elif self.amplitude is not None:
            logarithmic = RollerShape(
                amplitude=plain(self.amplitude), end_drop=plain(self.end_drop)
            )
        else:
            return base_shape
        flat = logarithmic.flat or base_shape.flat
        return replace(
            base_shape, amplitude=logarithmic.amplitude, end_drop=logarithmic.end_drop, flat=flat
        )
