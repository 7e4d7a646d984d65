"""[rating] of a case file with a machine: further data that rating standards need."""

from typing import Annotated, Literal

from asperity.case.messages import Section
from asperity.case.units import OPTIONAL, Force, Length, Number, Pressure, amount_in
from asperity.core.errors import BadInput

OF_BEARINGS = (
    "dynamic_load_rating",
    "fatigue_load_limit",
    "contamination",
    "reliability",
    "spectrum",
)
OF_GEARS = (
    "scuffing_stage",
    "micropitting_stage",
    "permissible_film",
    "roughness_ra",
    "bulk_temperature",
    "oil_supply",
)
STAGES = 5, 10  # of the micropitting test
SHARES_TOLERANCE = 1e-3
RELIABILITIES = 0.9, 0.9995  # of ISO 281, table 12


class SpectrumEntry(Section):
    """[[rating.spectrum]]: share of the time at factors of the stated load and speed."""

    share: Number
    load: Number
    speed: Number = 1.0


class RatingSection(Section):
    """[rating]."""

    dynamic_load_rating: Annotated[Force | None, OPTIONAL] = None  # C of a bearing
    fatigue_load_limit: Annotated[Force | None, OPTIONAL] = None  # C_u
    contamination: Annotated[Number | None, OPTIONAL] = None  # e_C of ISO 281, 0 to 1
    reliability: Number = 0.9  # share of bearings that survive the life
    spectrum: Annotated[tuple[SpectrumEntry, ...] | None, OPTIONAL] = None
    scuffing_stage: Annotated[Number | None, OPTIONAL] = (
        None  # FZG load stage of A/8.3/90 in which the oil fails
    )
    micropitting_stage: Annotated[Number | None, OPTIONAL] = (
        None  # FZG load stage of C-GF/8.3/90 in which the oil fails, 5 to 10
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
        inapplicable: tuple[str, ...] = () if machine.endswith("-gear") else OF_GEARS
        inapplicable += () if machine.endswith("-bearing") else OF_BEARINGS
        for key in inapplicable:
            if key in self.model_fields_set:
                raise BadInput(f"rating.{key} does not apply to a {machine}; leave it out")
        self._require_plausible()

    def _require_plausible(self) -> None:
        low, high = RELIABILITIES
        if not low <= self.reliability <= high:
            raise BadInput(
                f"rating.reliability must lie between {low:g} and {high:g}, got "
                f"{self.reliability:g}; 0.9 is that of the basic life"
            )
        spectrum = self.spectrum or ()
        for entry in spectrum:
            if min(entry.share, entry.load, entry.speed) <= 0.0:
                raise BadInput(
                    "rating.spectrum must have positive share, load and speed, got "
                    f"{min(entry.share, entry.load, entry.speed):g}; leave idle time out"
                )
        total = sum(entry.share for entry in spectrum)
        if spectrum and abs(total - 1.0) > SHARES_TOLERANCE:
            raise BadInput(
                f"the shares of rating.spectrum must add up to 1, got {total:.4g}; correct them"
            )
        low_stage, high_stage = STAGES
        if self.micropitting_stage is not None and not (
            low_stage <= self.micropitting_stage <= high_stage
            and float(self.micropitting_stage).is_integer()
        ):
            raise BadInput(
                f"rating.micropitting_stage must be a load stage from {low_stage} to "
                f"{high_stage}, got {self.micropitting_stage:g}; correct it"
            )
        if self.micropitting_stage is not None and self.permissible_film is not None:
            raise BadInput(
                "rating.micropitting_stage and rating.permissible_film both state the oil's limit; "
                "give one of them"
            )
        if self.contamination is not None and not 0.0 <= self.contamination <= 1.0:
            raise BadInput(
                "rating.contamination must be e_C of ISO 281, from 0 (severe contamination) to 1 "
                f"(clean), got {self.contamination:g}"
            )
