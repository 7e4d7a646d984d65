"""Oils by their data sheet: viscosity, density and pressure-viscosity coefficient at a temperature.

Values that a sheet does not state are estimated. No data sheet states shear thinning.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Literal, get_args

from asperity.core.coverage import NORMAL_FACTOR
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.lubricant.density import DowsonHigginson
from asperity.lubricant.friction import ZERO_CELSIUS, BairWiner, FrictionLaw
from asperity.lubricant.model import STATED_ALPHA_ERROR, Lubricant
from asperity.lubricant.pressure_viscosity import ESTIMATORS, BaseOil, Estimator
from asperity.lubricant.rheology import Newtonian, RheologyLaw
from asperity.lubricant.viscosity import Barus, Roelands
from asperity.lubricant.walther import (
    HOT,
    MIN_VISCOSITY,
    MIN_VISCOSITY_OF_INDEX,
    MM2,
    WARM,
    Walther,
    viscosity_100_of,
    viscosity_index,
)

Thickening = Literal["roelands", "barus"]
_UNITS = {
    "viscosity_40": "m^2/s",
    "viscosity_100": "m^2/s",
    "density_15": "kg/m^3",
    "alpha": "1/Pa",
}

GRADES = {  # ISO 3448: mid-point viscosity of a grade at 40 °C [mm^2/s]
    **{2: 2.2, 3: 3.2, 5: 4.6, 7: 6.8},
    **{
        grade: float(grade)
        for grade in (10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460, 680, 1000, 1500, 2200, 3200)
    },
}
GRADE_WIDTH = 0.1  # relative, to either side of the mid-point
MINERAL_INDEX = 95.0  # default for mineral oils
INDEX_TOLERANCE = 5.0  # between the stated index and that of both viscosities
COLDEST = ZERO_CELSIUS - 20.0
HOTTEST = ZERO_CELSIUS + 150.0
AT_15 = ZERO_CELSIUS + 15.0
EXPANSION = 0.7  # [kg/m^3/K]


@dataclass(frozen=True, slots=True, kw_only=True)
class OilSheet:
    """Oil by its data sheet.

    Parameters
    ----------
    grade : ISO viscosity grade such as "VG 100"
    viscosity_40, viscosity_100 : kinematic viscosities at 40 and 100 °C [m^2/s]
    viscosity_index : alternative to `viscosity_100`; default for mineral oils: 95
    density_15 : density at 15 °C [kg/m^3]; default for mineral oils: estimate of ISO/TR 15144-1
    base : "mineral", "pao", "ester" or "polyglycol"
    alpha : pressure-viscosity coefficient at the operating temperature [1/Pa]
    alpha_estimate : name in `ESTIMATORS`, instead of alpha; default for mineral oils: "roelands"
    measured : name of the oil in the table of measured oils, if any

    Raises
    ------
    BadInput
        Values contradict each other, viscosity does not fall with temperature, or a missing value
        cannot be estimated.

    Examples
    --------
    >>> from asperity.lubricant import OilSheet, oil_facts
    >>> oil = OilSheet(grade="ISO VG 46")
    >>> viscosity_100 = oil_facts(oil, temperature=313.15)[2]
    >>> viscosity_100.key, viscosity_100.origin
    ('oil_viscosity_100_m2_s', 'computed')
    """

    grade: str | None = None
    viscosity_40: float | None = None
    viscosity_100: float | None = None
    viscosity_index: float | None = None
    density_15: float | None = None
    base: BaseOil = "mineral"
    alpha: float | None = None
    alpha_estimate: str | None = None
    measured: str | None = None
    walther: Walther = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_choice("base", self.base, get_args(BaseOil))
        for name, unit in _UNITS.items():
            value = getattr(self, name)
            if value is not None:
                require_positive(name, value, unit)
        self._require_origin_of_alpha()
        if self.density_15 is None and self.base != "mineral":
            raise BadInput(
                f"density_15 is missing; give it, as the density of base {self.base} cannot be "
                "estimated like that of a mineral oil"
            )
        warm, hot = self.at_40, self.at_100
        if hot >= warm:
            raise BadInput(
                f"viscosity_100 must be below viscosity_40, got {hot / MM2:.4g} mm^2/s at 100 degC "
                f"and {warm / MM2:.4g} mm^2/s at 40 degC; correct one of them"
            )
        object.__setattr__(self, "walther", Walther.through((WARM, warm), (HOT, hot)))
        self._require_consistent_index()

    def _require_origin_of_alpha(self) -> None:
        if self.alpha is not None and self.alpha_estimate is not None:
            raise BadInput("alpha and alpha_estimate are both given; leave one of them out")
        if self.alpha_estimate is not None:
            require_choice("alpha_estimate", self.alpha_estimate, ESTIMATORS)
        if self.alpha is None and self.alpha_estimate is None and self.base != "mineral":
            raise BadInput(
                f"alpha is missing and is required for base {self.base}, as the estimates hold for "
                'mineral oils; give alpha, or alpha_estimate = "gold", which is uncertain'
            )

    @property
    def at_15(self) -> float:
        """Density at 15 °C [kg/m³]: given, or 43.37 log₁₀ ν₄₀ + 805.5, ν₄₀ in mm²/s.

        Source of the estimate: ISO/TR 15144-1, mineral oils.
        """
        return (
            43.37 * math.log10(self.at_40 / MM2) + 805.5
            if self.density_15 is None
            else self.density_15
        )

    @property
    def at_40(self) -> float:
        """Kinematic viscosity at 40 °C [m²/s]: given, within the grade, or its mid-point."""
        if self.grade is None:
            if self.viscosity_40 is None:
                raise BadInput('viscosity_40 is missing; give it, or a grade such as "VG 100"')
            return self.viscosity_40
        mid_point = _mid_point(self.grade)
        if self.viscosity_40 is None:
            return mid_point
        if abs(self.viscosity_40 / mid_point - 1.0) > GRADE_WIDTH + 1e-9:
            raise BadInput(
                f"viscosity_40 of {self.viscosity_40 / MM2:.4g} mm^2/s is not {self.grade}, which "
                f"lies within 10 % of {mid_point / MM2:g} mm^2/s; correct it or leave grade out"
            )
        return self.viscosity_40

    @property
    def index(self) -> float | None:
        """Viscosity index: of both viscosities, given, or 95 (mineral); None if undefined."""
        if self.viscosity_100 is not None:
            return (
                viscosity_index(self.at_40, self.viscosity_100)
                if self.viscosity_100 >= MIN_VISCOSITY_OF_INDEX
                else None
            )
        if self.viscosity_index is None and self.base != "mineral":
            raise BadInput(
                "viscosity_100 is missing; give it, or viscosity_index, which has no default for "
                f"base {self.base}"
            )
        return MINERAL_INDEX if self.viscosity_index is None else self.viscosity_index

    @property
    def at_100(self) -> float:
        """Kinematic viscosity at 100 °C [m²/s]: given, or from the viscosity index."""
        if self.viscosity_100 is None:
            assert self.index is not None
            try:
                return viscosity_100_of(self.at_40, self.index)
            except BadInput:
                if self.viscosity_index is not None:
                    raise
                raise BadInput(
                    "viscosity_100 is missing; give it, as the default viscosity index of "
                    f"{MINERAL_INDEX:g} is impossible for oils of {self.at_40 / MM2:.3g} mm^2/s at "
                    "40 degC"
                ) from None
        return self.viscosity_100

    def _require_consistent_index(self) -> None:
        """Raise BadInput if viscosity_index contradicts both viscosities."""
        if self.viscosity_index is None or self.index is None:
            return
        if abs(self.index - self.viscosity_index) > INDEX_TOLERANCE:
            raise BadInput(
                f"viscosity_index of {self.viscosity_index:g} contradicts viscosity_40 and "
                f"viscosity_100, whose index is {self.index:.0f}; correct one of the three, or "
                "leave the index out"
            )

    def density(self, temperature: float) -> float:
        """Return ρ = ρ₁₅ - 0.7 (T - 288.15 K) [kg/m³] at a temperature [K] (ISO/TR 15144-1)."""
        return self.at_15 - EXPANSION * (temperature - AT_15)

    def kinematic_viscosity(self, temperature: float) -> float:
        """Return ν [m²/s] at a temperature [K] by ASTM D341.

        Raises BadInput outside -20 to 150 °C or below 0.21 mm²/s.
        """
        if not COLDEST <= temperature <= HOTTEST:
            raise BadInput(
                "temperature must lie between -20 and 150 degC for an oil by its data sheet, got "
                f"{temperature - ZERO_CELSIUS:.4g} degC; correct it, or state viscosity and "
                "density laws measured there"
            )
        nu = self.walther(temperature)
        if nu < MIN_VISCOSITY:
            raise BadInput(
                f"at {temperature - ZERO_CELSIUS:.4g} degC the viscosity of the oil is "
                f"{nu / MM2:.2g} mm^2/s, below the limit of ASTM D341 of 0.21 mm^2/s; use a "
                "thicker oil or a lower temperature"
            )
        return nu

    def viscosity(self, temperature: float) -> float:
        """Return η = ν ρ [Pa s] at a temperature [K]."""
        return self.kinematic_viscosity(temperature) * self.density(temperature)

    def pressure_viscosity(self, temperature: float) -> float:
        """Return alpha [1/Pa] at a temperature [K], the slope at ambient pressure.

        It is given or estimated.

        Raises BadInput for an oil too thin for the estimate.
        """
        if self.alpha is not None:
            return self.alpha
        return self.estimator(self, temperature)

    @property
    def alpha_error(self) -> float:
        """Half of the interval of alpha, relative."""
        if self.alpha is not None:
            return STATED_ALPHA_ERROR
        return 0.5 * NORMAL_FACTOR * self.estimator.spread_of(self.base)

    @property
    def estimator(self) -> Estimator:
        """Estimator of alpha."""
        return ESTIMATORS[self.alpha_estimate or "roelands"]

    def lubricant(
        self,
        temperature: float,
        *,
        thickening: Thickening = "roelands",
        rheology: RheologyLaw | None = None,
        friction: FrictionLaw | None = None,
    ) -> Lubricant:
        """Return the lubricant at a temperature [K]; density by Dowson and Higginson.

        Defaults: Newtonian rheology and the friction law of Bair and Winer. Raises BadInput for a
        temperature outside -20 to 150 °C, or an oil too thin there for the estimate of alpha.
        """
        law = {"roelands": Roelands, "barus": Barus}[thickening]
        return Lubricant(
            viscosity=law(self.viscosity(temperature), self.pressure_viscosity(temperature)),
            density=DowsonHigginson(self.density(temperature)),
            rheology=rheology or Newtonian(),
            friction=friction or BairWiner(),
            alpha_error=self.alpha_error,
        )


def _mid_point(grade: str) -> float:
    """Return the mid-point kinematic viscosity of a grade at 40 °C [m²/s] (ISO 3448)."""
    number = re.fullmatch(r"\s*(?:ISO[\s-]*)?VG[\s-]*(\d+)\s*", grade, re.IGNORECASE)
    if number is None or int(number[1]) not in GRADES:
        raise BadInput(
            'grade must be an ISO viscosity grade such as "VG 100", of '
            f'{", ".join(map(str, GRADES))}, got "{grade}"; give viscosity_40 and '
            "viscosity_100 for other oils"
        )
    return GRADES[int(number[1])] / 1e6  # times 1e-6 would round: 100 mm^2/s must give 1e-4
