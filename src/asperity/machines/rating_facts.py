"""A rating with its source, formula and validity."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from asperity.case import Case, MachineCase


class RatingFacts(NamedTuple):
    """Source, formula and validity of one rating."""

    standard: str
    formula: str
    validity: str


_LIFE = "ISO/TS 16281:2008"
_MICROPITTING = "ISO/TR 15144-1:2014"
_TEETH = (
    "unmodified spur and helical gears in mineral or PAO oil, tested at modules of 3 to 11 mm, "
    "working pressure angles to 25 deg, above 2 m/s at the pitch line; dynamic factors, "
    "tip relief and coatings are taken as 1"
)
_STRESS = "elastic half-space; the asperities do not move, residual stress is neglected"
FACTS: dict[str, RatingFacts] = {
    "reference_viscosity_m2_s": RatingFacts(
        "ISO 281:2007, 9.3",
        "ν₁ = 45 000 n^-0.83 D_pw^-0.5 below 1000 r/min, 4500 (n D_pw)^-0.5 from there "
        "[mm²/s, r/min, mm]",
        "usual raceway roughness, included statistically",
    ),
    "viscosity_ratio": RatingFacts(
        "ISO 281:2007, 9.3",
        "κ = ν/ν₁ at the oil's temperature",
        "0.1 to 4; compare the solved film ratio",
    ),
    "reference_life": RatingFacts(
        _LIFE,
        "L₁₀r from the loads of every rolling element, or slice, and C",
        "90 % survive; rigid rings, inner ring turning",
    ),
    "equivalent_load_n": RatingFacts(
        _LIFE,
        "P_ref = C (10⁶/L₁₀r)^(1/3), of rollers ^(3/10)",
        "the load of equal life by ISO 281",
    ),
    "life_factor": RatingFacts(
        "ISO 281:2007, 9.3.3",
        "a_ISO = 0.1 (1 - (c₁ - c₂/κ^e)^g (e_C C_u/P)^h)^-k, at most 50, "
        "P the larger of P_ref and the radial load",
        "κ of 0.1 to 4; one factor for the whole bearing, also of rollers, where ISO/TS 16281 uses "
        "one per slice. Roughness enters through κ, not through the solved film",
    ),
    "reliability_factor": RatingFacts(
        "ISO 281:2007, 9.2",
        "a₁ = 0.95 (ln S/ln 0.9)^(2/3) + 0.05",
        "S from 0.9, where a₁ is 1, to 0.9995",
    ),
    "modified_life_s": RatingFacts(
        "ISO 281:2007",
        "L_nm = a₁ a_ISO L₁₀r at the stated speed",
        "the stated reliability, by default 90 %",
    ),
    "spectrum_life_s": RatingFacts(
        "ISO 281:2007; Palmgren 1924, Miner 1945",
        "1/L = Σ share/L_nm of every entry of the spectrum",
        "damage adds up without regard to its order; κ follows the speed of each entry",
    ),
    "rated_friction_torque_n_m": RatingFacts(
        "Palmgren; Harris, Rolling Bearing Analysis",
        "1e-7 f₀ (ν n)^(2/3) D_pw³ + f₁ P D_pw [mm²/s, r/min, mm]; balls: f₀ 2, f₁ 0.0005 "
        "(P/C₀)^0.55; rollers: 2.2, 0.0003",
        "oil bath, without seals; makers' figures scatter by half",
    ),
    "mesh_friction": RatingFacts(
        _MICROPITTING,
        "μ = 0.045 (K_Bγ F_bt/(b v_ΣC ρ_C))^0.2 η_oil^-0.05 · 2.2 (Ra/ρ_C)^0.25 X_L "
        "[N, mm, m/s, mPa s, µm]",
        f"{_TEETH}; roughness enters as Ra, by default Sq/√π of two equal flanks",
    ),
    "rated_bulk_k": RatingFacts(
        _MICROPITTING,
        "θ_M = θ_oil + 7400 (P μ H_v/(a b))^0.72 X_S/1.2 [kW, mm]",
        f"{_TEETH}; or as given",
    ),
    "rated_flash_k": RatingFacts(
        _MICROPITTING,
        "θ_fl = 2/√π μ w′ |u₁ - u₂|/((B₁√u₁ + B₂√u₂)√(2a)), Blok's for uniform heat",
        "Peclet numbers u a/2κ above 1, within 6 % of the fast-moving limit; with the mean μ "
        "above, not the solved friction",
    ),
    "rated_film": RatingFacts(
        _MICROPITTING,
        "λ_GF = h/Ra, h = 1600 ρ G^0.6 U^0.7 W^-0.13 S^0.22 [mm, µm]",
        f"{_TEETH}; with Ra, not Sq: for equal Gaussian flanks 1.8 times the film ratio Λ",
    ),
    "micropitting_safety": RatingFacts(
        f"{_MICROPITTING} (ISO/TS 6336-22:2018)",
        "S_λ = smallest λ_GF/λ_GFP",
        "risk is high below 1, low from 2; λ_GFP is from a test of this oil",
    ),
    "permissible_film": RatingFacts(
        f"{_MICROPITTING} (ISO/TS 6336-22:2018)",
        "λ_GFP = 1.4 times the smallest λ_GF of the test gears C-GF at the failure stage",
        "FVA 54: 8.3 m/s, 90 °C, Ra 0.5 µm; case-carburised steel (W_W = 1)",
    ),
    "scuffing_limit_k": RatingFacts(
        "ISO/TR 13989-1:2000 (ISO/TS 6336-20)",
        "θ_S = 80 °C + (0.85 + 1.4 X_W) X_L S², S the stage of A/8.3/90",
        "X_W = 1; valid only for an oil tested in A/8.3/90",
    ),
    "scuffing_margin_k": RatingFacts(
        "ISO/TR 13989-1:2000 (ISO/TS 6336-20)",
        "θ_S - (θ_M + largest θ_fl)",
        "safe from about 50 K; the solved flash temperature (with asperities) is not used",
    ),
    "dang_van_pa": RatingFacts(
        "Dang Van et al. 1989",
        "max over time and lines of τ + a σ_h, below a tenth of the half-width",
        _STRESS,
    ),
    "dang_van_shallow_pa": RatingFacts(
        "Dang Van et al. 1989",
        "the same above that depth",
        f"{_STRESS}; grows as cells get finer",
    ),
    "dang_van_smooth_pa": RatingFacts(
        "Dang Van et al. 1989", "the same below the Hertz contact with the solved friction", _STRESS
    ),
    "dang_van_safety": RatingFacts("Dang Van et al. 1989", "τ₋₁ over the core value", _STRESS),
}


@dataclass(frozen=True)
class Rating:
    """A rating: its quantity key, and its values by contact; "" is the whole machine.

    `reason` states why values are missing, `beyond` what lies outside the scope of the standard.
    """

    key: str
    values: Mapping[str, float | None]
    reason: str = ""
    beyond: str = ""

    @property
    def standard(self) -> str:
        """Standard that defines the rating."""
        return FACTS[self.key].standard

    @property
    def formula(self) -> str:
        """Formula of the rating."""
        return FACTS[self.key].formula

    @property
    def validity(self) -> str:
        """Scope of the rating, and simplifications made here."""
        return FACTS[self.key].validity

    @property
    def machine_value(self) -> float | None:
        """Value of the whole machine; None if it is by contact or missing."""
        return self.values.get("")

    def to_dict(self) -> dict[str, object]:
        """Return the JSON output of the rating."""
        value: dict[str, object] = (
            {"value": self.machine_value}
            if set(self.values) <= {""}
            else {"values": dict(self.values)}
        )
        facts = {"standard": self.standard, "formula": self.formula, "validity": self.validity}
        return {"key": self.key, **value, **facts, "reason": self.reason, "beyond": self.beyond}


def missing_ratings(keys: Sequence[str], reason: str) -> tuple[Rating, ...]:
    """Return ratings without values, for one reason."""
    return tuple(machine_rating(key, None, reason) for key in keys)


def machine_rating(key: str, value: float | None, reason: str = "") -> Rating:
    """Return a rating of the whole machine."""
    return Rating(key, {"": value}, reason if value is None else "")


def rated_case(case: MachineCase) -> Case | None:
    """Return the case of a contact, for oil and roughness; None if it states too little."""
    moving = [contact for contact in case.contacts if not contact.stands_still]
    if not case.complete or not moving:
        return None
    stated = case.case(moving[0])
    return None if stated.lubricant is None else stated
