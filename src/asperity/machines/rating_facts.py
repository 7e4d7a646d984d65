"""Source, formula and validity of each rating."""

from typing import NamedTuple


class RatingFacts(NamedTuple):
    """Source, formula and validity of one rating."""

    standard: str
    formula: str
    validity: str


_LIFE = "ISO/TS 16281:2008"
_MICROPITTING = "ISO/TR 15144-1:2014"
_TEETH = (
    "unmodified spur gears in mineral or PAO oil, tested at modules of 3 to 11 mm, "
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
    "modified_life_s": RatingFacts(
        "ISO 281:2007", "L_10m = a_ISO L₁₀r at the stated speed", "90 % survive"
    ),
    "mesh_friction": RatingFacts(
        _MICROPITTING,
        "μ = 0.045 (F_bt/(b v_ΣC ρ_C))^0.2 η_oil^-0.05 · 2.2 (Ra/ρ_C)^0.25 X_L "
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
