"""[rating] of a case file with a machine: further data that rating standards need."""

from typing import Annotated, Literal

from asperity.case.messages import Section
from asperity.case.units import OPTIONAL, Force, Length, Number, Pressure, amount_in
from asperity.core.errors import BadInput

OF_BEARINGS = ("dynamic_load_rating", "fatigue_load_limit", "contamination")
OF_GEARS = ("scuffing_stage", "permissible_film", "roughness_ra", "bulk_temperature", "oil_supply")


class RatingSection(Section):
    """[rating]."""

    dynamic_load_rating: Annotated[Force | None, OPTIONAL] = None  # C of a bearing
    fatigue_load_limit: Annotated[Force | None, OPTIONAL] = None  # C_u
    contamination: Annotated[Number | None, OPTIONAL] = None  # e_C of ISO 281, 0 to 1
    scuffing_stage: Annotated[Number | None, OPTIONAL] = (
        None  # FZG load stage of A/8.3/90 in which the oil fails
    )
    permissible_film: Annotated[Number | None, OPTIONAL] = None  # λ_GFP of the oil, from a test
    roughness_ra: Annotated[Length | None, OPTIONAL] = (
        None  # mean Ra of both flanks; left out: by the composite Sq
    )
    bulk_temperature: Annotated[Annotated[float, amount_in("K")] | None, OPTIONAL] = (
        None  # of the teeth
    )
    oil_supply: Literal["dip", "spray"] = "dip"
    fatigue_limits: Annotated[tuple[Pressure, Pressure] | None, OPTIONAL] = (
        None  # reversed torsion, reversed bending
    )

    def require_applicable(self, machine: str) -> None:
        """Raise BadInput for keys that do not apply to this kind of machine."""
        inapplicable: tuple[str, ...] = () if machine == "spur-gear" else OF_GEARS
        inapplicable += () if machine.endswith("-bearing") else OF_BEARINGS
        for key in inapplicable:
            if key in self.model_fields_set:
                raise BadInput(f"rating.{key} does not apply to a {machine}; leave it out")
        if self.contamination is not None and not 0.0 <= self.contamination <= 1.0:
            raise BadInput(
                f"rating.contamination must lie between 0 and 1, got {self.contamination:g}; "
                "correct it"
            )
