"""An oil as its data sheet has it, and what it is at a temperature: as given, else estimated.

Out of a data sheet come viscosity, density and pressure-viscosity coefficient; how shear thins the
oil is on none.
"""

import math
import re
from dataclasses import dataclass, field
from typing import Literal, get_args

from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.lubricant.density import DowsonHigginson
from asperity.lubricant.friction import FREEZING, BairWiner, FrictionLaw
from asperity.lubricant.model import Lubricant
from asperity.lubricant.pressure_viscosity import ESTIMATORS, Base, Estimator
from asperity.lubricant.rheology import Newtonian, RheologyLaw
from asperity.lubricant.viscosity import Barus, Roelands
from asperity.lubricant.walther import (
    HOT,
    LEAST_OF_INDEX,
    MM2,
    THINNEST,
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

GRADES = {  # ISO 3448: viscosity in the middle of a grade at 40 °C [mm^2/s]
    **{2: 2.2, 3: 3.2, 5: 4.6, 7: 6.8},
    **{
        grade: float(grade)
        for grade in (10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460, 680, 1000, 1500, 2200, 3200)
    },
}
GRADE_WIDTH = 0.1  # of a grade, either way
MINERAL_INDEX = 95.0  # of a mineral oil whose sheet does not say
INDEX_SCATTER = 5.0  # between a stated index and that of both viscosities
COLDEST, HOTTEST = FREEZING - 20.0, FREEZING + 150.0
AT_15 = FREEZING + 15.0
EXPANSION = 0.7  # [kg/m^3/K]


@dataclass(frozen=True, slots=True, kw_only=True)
class OilSheet:
    """An oil by its data sheet.

    Parameters
    ----------
    grade : ISO viscosity grade such as "VG 100"
    viscosity_40, viscosity_100 : kinematic viscosities at 40 and 100 °C [m^2/s]
    viscosity_index : in place of `viscosity_100`; mineral oils without either are taken as 95
    density_15 : density at 15 °C [kg/m^3]; of mineral oils estimated by ISO/TR 15144-1
    base : "mineral", "pao", "ester" or "polyglycol"
    alpha : pressure-viscosity coefficient at the temperature that will be asked for [1/Pa]
    alpha_estimate : a name of `ESTIMATORS`, in place of alpha; mineral oils take "roelands"
    measured : for an oil of the table of measured ones, its name

    Raises
    ------
    BadInput
        for what contradicts itself, falls with temperature the wrong way, or is missing and cannot be estimated.
    """

    grade: str | None = None
    viscosity_40: float | None = None
    viscosity_100: float | None = None
    viscosity_index: float | None = None
    density_15: float | None = None
    base: Base = "mineral"
    alpha: float | None = None
    alpha_estimate: str | None = None
    measured: str | None = None
    walther: Walther = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_choice("base", self.base, get_args(Base))
        for name, unit in _UNITS.items():
            value = getattr(self, name)
            if value is not None:
                require_positive(name, value, unit)
        self._require_origin_of_alpha()
        if self.density_15 is None and self.base != "mineral":
            raise BadInput(
                f"density_15 is missing; give it: that of base {self.base} cannot be estimated as a mineral oil's is"
            )
        warm, hot = self.at_40, self.at_100
        if hot >= warm:
            raise BadInput(
                f"viscosity_100 must be below viscosity_40, got {hot / MM2:.4g} mm^2/s at 100 degC and "
                f"{warm / MM2:.4g} mm^2/s at 40 degC; correct one of them"
            )
        object.__setattr__(self, "walther", Walther.through((WARM, warm), (HOT, hot)))
        self._require_one_index()

    def _require_origin_of_alpha(self) -> None:
        if self.alpha is not None and self.alpha_estimate is not None:
            raise BadInput("alpha and alpha_estimate are both given; leave one of them out")
        if self.alpha_estimate is not None:
            require_choice("alpha_estimate", self.alpha_estimate, ESTIMATORS)
        if self.alpha is None and self.alpha_estimate is None and self.base != "mineral":
            raise BadInput(
                f"alpha is missing, which base {self.base} has to state: the estimates are of mineral oils; "
                'give alpha, or alpha_estimate = "gold", with doubt'
            )

    @property
    def at_15(self) -> float:
        """Density at 15 °C [kg/m³]: as given, or 43.37 log₁₀ ν₄₀ + 805.5, ν₄₀ in mm²/s (ISO/TR 15144-1, mineral)."""
        return (
            43.37 * math.log10(self.at_40 / MM2) + 805.5
            if self.density_15 is None
            else self.density_15
        )

    @property
    def at_40(self) -> float:
        """Kinematic viscosity at 40 °C [m²/s]: as given, which has to lie in the grade, or the grade's middle."""
        if self.grade is None:
            if self.viscosity_40 is None:
                raise BadInput('viscosity_40 is missing; give it, or a grade such as "VG 100"')
            return self.viscosity_40
        middle = _middle(self.grade)
        if self.viscosity_40 is None:
            return middle
        if abs(self.viscosity_40 / middle - 1.0) > GRADE_WIDTH + 1e-9:
            raise BadInput(
                f"viscosity_40 of {self.viscosity_40 / MM2:.4g} mm^2/s is not {self.grade}, which lies within 10 % of "
                f"{middle / MM2:g} mm^2/s; correct it or leave grade out"
            )
        return self.viscosity_40

    @property
    def index(self) -> float | None:
        """The viscosity index: of both viscosities, else as given, else a mineral oil's; None where none is defined."""
        if self.viscosity_100 is not None:
            return (
                viscosity_index(self.at_40, self.viscosity_100)
                if self.viscosity_100 >= LEAST_OF_INDEX
                else None
            )
        if self.viscosity_index is None and self.base != "mineral":
            raise BadInput(
                f"viscosity_100 is missing; give it, or viscosity_index: oils of base {self.base} differ"
            )
        return MINERAL_INDEX if self.viscosity_index is None else self.viscosity_index

    @property
    def at_100(self) -> float:
        """Kinematic viscosity at 100 °C [m²/s]: as given, or of the viscosity index."""
        if self.viscosity_100 is None:
            assert self.index is not None
            try:
                return viscosity_100_of(self.at_40, self.index)
            except BadInput:
                if self.viscosity_index is not None:
                    raise
                raise BadInput(
                    f"viscosity_100 is missing; give it: the index of {MINERAL_INDEX:g} that mineral oils are taken "
                    f"for does not reach oils of {self.at_40 / MM2:.3g} mm^2/s at 40 degC"
                ) from None
        return self.viscosity_100

    def _require_one_index(self) -> None:
        """A sheet states viscosity_100 and viscosity_index at times: they have to be those of one oil."""
        if self.viscosity_index is None or self.index is None:
            return
        if abs(self.index - self.viscosity_index) > INDEX_SCATTER:
            raise BadInput(
                f"viscosity_index of {self.viscosity_index:g} is not that of viscosity_40 and viscosity_100, which is "
                f"{self.index:.0f}; correct one of the three, or leave the index out"
            )

    def density(self, temperature: float) -> float:
        """ρ = ρ₁₅ - 0.7 (T - 288.15 K) [kg/m³] at a temperature [K]. Source: ISO/TR 15144-1."""
        return self.at_15 - EXPANSION * (temperature - AT_15)

    def kinematic_viscosity(self, temperature: float) -> float:
        """ν [m²/s] at a temperature [K], by ASTM D341; BadInput outside -20 to 150 °C or below 0.21 mm²/s."""
        if not COLDEST <= temperature <= HOTTEST:
            raise BadInput(
                f"temperature must lie between -20 and 150 degC for an oil by its data sheet, got "
                f"{temperature - FREEZING:.4g} degC; correct it, or state viscosity and density laws measured there"
            )
        nu = self.walther(temperature)
        if nu < THINNEST:
            raise BadInput(
                f"temperature of {temperature - FREEZING:.4g} degC leaves the oil {nu / MM2:.2g} mm^2/s thick, below "
                "the 0.21 mm^2/s where ASTM D341 ends; take a thicker oil or a lower temperature"
            )
        return nu

    def viscosity(self, temperature: float) -> float:
        """η = ν ρ [Pa s] at a temperature [K]."""
        return self.kinematic_viscosity(temperature) * self.density(temperature)

    def pressure_viscosity(self, temperature: float) -> float:
        """Alpha [1/Pa] at a temperature [K]: as given, or estimated; BadInput for an oil too thin for the estimate."""
        if self.alpha is not None:
            return self.alpha
        return self.estimator(self, temperature)

    @property
    def estimator(self) -> Estimator:
        """What estimates alpha where it is not given."""
        return ESTIMATORS[self.alpha_estimate or "roelands"]

    def lubricant(
        self,
        temperature: float,
        *,
        thickening: Thickening = "roelands",
        rheology: RheologyLaw | None = None,
        friction: FrictionLaw | None = None,
    ) -> Lubricant:
        """The oil at a temperature [K] as the solvers take it: density by Dowson and Higginson, Newtonian unless said.

        Raises BadInput for a temperature outside -20 to 150 °C, or an oil too thin there for the
        estimate of alpha.
        """
        law = {"roelands": Roelands, "barus": Barus}[thickening]
        return Lubricant(
            viscosity=law(self.viscosity(temperature), self.pressure_viscosity(temperature)),
            density=DowsonHigginson(self.density(temperature)),
            rheology=rheology or Newtonian(),
            friction=friction or BairWiner(),
        )


def _middle(grade: str) -> float:
    """Kinematic viscosity at 40 °C in the middle of a grade [m²/s]. Source: ISO 3448."""
    number = re.fullmatch(r"\s*(?:ISO[\s-]*)?VG[\s-]*(\d+)\s*", grade, re.IGNORECASE)
    if number is None or int(number[1]) not in GRADES:
        raise BadInput(
            f'grade must be an ISO viscosity grade such as "VG 100", of {", ".join(map(str, GRADES))}, got "{grade}"; '
            "an oil of another kind has viscosity_40 and viscosity_100"
        )
    return GRADES[int(number[1])] / 1e6  # not times 1e-6: 100 mm^2/s shall be 1e-4
