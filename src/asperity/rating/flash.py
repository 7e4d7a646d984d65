"""Flash temperature by Blok's closed form, and the temperature at which a gear oil's film is taken to scuff.

ISO/TS 6336-20 (ISO/TR 13989-1) judges the sum of bulk and flash temperature against a limit of the
oil's FZG test.
"""

import math

from asperity.core.errors import BadInput

HERTZ_HEAT = 1.1115  # of the largest rise, for heat of Hertz' shape
UNIFORM_HEAT = 2.0 / math.sqrt(math.pi)  # for even heat, as ISO/TR 15144-1 has it
STEEL_EFFUSIVITY = (
    13756.0  # sqrt(k ρ c) [J/(m² K s^0.5)]: the standards' B_M of 435 N/(mm^0.5 m^0.5 s^0.5 K)
)
STAGES = 1, 13  # FZG load stages of A/8.3/90


def flash_rise(
    friction: float,
    line_load: float,
    half_width: float,
    speeds: tuple[float, float],
    effusivities: tuple[float, float] = (STEEL_EFFUSIVITY, STEEL_EFFUSIVITY),
    *,
    shape: float = HERTZ_HEAT,
) -> float:
    """Largest rise of the surfaces in a fast line contact [K].

    c μ w' |u1 - u2|/((B1 sqrt u1 + B2 sqrt u2) sqrt(2 a)), of Peclet numbers above 5 and surfaces
    that move the same way. Source: H. Blok (1937), A. Cameron (1966); c is 1.1115 for heat of
    Hertz' shape, 2/sqrt(π) for even heat.

    Parameters
    ----------
    friction : coefficient
    line_load : [N/m]
    half_width : Hertz' a [m]
    speeds : of the surfaces in the contact's frame [m/s]
    effusivities : sqrt(k ρ c) of both bodies [J/(m² K s^0.5)]
    shape : c

    Raises
    ------
    BadInput
        for surfaces that run against each other.
    """
    first, second = speeds
    if min(first, second) < 0.0 or first == second == 0.0:
        raise BadInput(
            f"Blok's flash temperature is of surfaces that run the same way, got {first:g} and {second:g} m/s"
        )
    taken_up = effusivities[0] * math.sqrt(first) + effusivities[1] * math.sqrt(second)
    return (
        shape
        * friction
        * line_load
        * abs(first - second)
        / (taken_up * math.sqrt(2.0 * half_width))
    )


def scuffing_temperature(stage: float, oil_factor: float, structure: float = 1.0) -> float:
    """θ_S of an oil by its FZG scuffing test [degC]: 80 + (0.85 + 1.4 X_W) X_L S². Source: ISO/TR 13989-1:2000.

    Parameters
    ----------
    stage : the load stage S that the oil failed in A/8.3/90
    oil_factor : X_L = (η_oil/mPa s)^-0.05, times 0.8 for a PAO
    structure : X_W, 1 for case-hardened steel of usual structure

    Raises
    ------
    BadInput
        for a stage that the test has not.
    """
    if not STAGES[0] <= stage <= STAGES[1]:
        raise BadInput(
            f"scuffing_stage must be an FZG load stage from {STAGES[0]} to {STAGES[1]}, got {stage:g}"
        )
    return 80.0 + (0.85 + 1.4 * structure) * oil_factor * stage**2
