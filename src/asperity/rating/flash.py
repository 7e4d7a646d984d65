"""Blok's flash temperature, and the scuffing temperature of gear oils.

ISO/TS 6336-20 (ISO/TR 13989-1) compares the sum of bulk and flash temperature with the scuffing
temperature of the oil's FZG test.
"""

import math

from asperity.core.errors import BadInput

HERTZ_HEAT = 1.1115  # factor for a Hertzian heat distribution
UNIFORM_HEAT = 2.0 / math.sqrt(math.pi)  # factor for a uniform heat distribution, ISO/TR 15144-1
# sqrt(k ρ c) [J/(m² K s^0.5)]: the standards' B_M of 435 N/(mm^0.5 m^0.5 s^0.5 K)
STEEL_EFFUSIVITY = 13756.0
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
    """Return the maximum temperature rise of the surfaces in a fast line contact [K].

    c μ w' |u1 - u2|/((B1 sqrt u1 + B2 sqrt u2) sqrt(2 a)), for Peclet numbers above 5 and surfaces
    that move in the same direction. Source: H. Blok (1937), A. Cameron (1966); c is 1.1115 for a
    Hertzian, 2/sqrt(π) for a uniform heat distribution.

    Parameters
    ----------
    friction : coefficient of friction μ
    line_load : w' [N/m]
    half_width : Hertzian half-width a [m]
    speeds : speeds of the surfaces in the frame of the contact [m/s]
    effusivities : sqrt(k ρ c) of both bodies [J/(m² K s^0.5)]
    shape : c

    Raises
    ------
    BadInput
        The surfaces move in opposite directions, or both are at rest.
    """
    first, second = speeds
    if min(first, second) < 0.0 or first == second == 0.0:
        raise BadInput(
            "Blok's flash temperature needs surfaces that move in the same direction, got "
            f"{first:g} and {second:g} m/s"
        )
    absorption = effusivities[0] * math.sqrt(first) + effusivities[1] * math.sqrt(second)
    return (
        shape
        * friction
        * line_load
        * abs(first - second)
        / (absorption * math.sqrt(2.0 * half_width))
    )


def scuffing_temperature(stage: float, oil_factor: float, structure: float = 1.0) -> float:
    """Return the scuffing temperature θ_S of an oil from its FZG test [degC].

    θ_S = 80 + (0.85 + 1.4 X_W) X_L S². Source: ISO/TR 13989-1:2000.

    Parameters
    ----------
    stage : failure load stage S in A/8.3/90
    oil_factor : X_L = (η_oil/mPa s)^-0.05, times 0.8 for a PAO
    structure : X_W, 1 for case-hardened steel of normal structure

    Raises
    ------
    BadInput
        The stage is not one of the test.

    Examples
    --------
    >>> from asperity.rating import scuffing_temperature
    >>> f"{scuffing_temperature(stage=12, oil_factor=1.0):.0f} degC"
    '404 degC'
    """
    if not STAGES[0] <= stage <= STAGES[1]:
        raise BadInput(
            f"scuffing_stage must be an FZG load stage from {STAGES[0]} to {STAGES[1]}, got "
            f"{stage:g}"
        )
    return 80.0 + (0.85 + 1.4 * structure) * oil_factor * stage**2
