"""Rating of rolling bearings by ISO 281 and ISO/TS 16281: viscosity ratio, life factor and life.

Roughness enters statistically, through the failed bearings behind the standards; results of solved
contacts are not used.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

RollingElement = Literal["ball", "roller"]

BRANCH_SPEED = 1000.0  # r/min; the reference viscosity has another law below
MAX_KAPPA = 4.0  # upper limit of the viscosity ratio in the rating
MIN_KAPPA = 0.1  # no rating below this viscosity ratio
MAX_LIFE_FACTOR = 50.0
SLOW_TORQUE = 160e-7  # of the oil, over f0 D³, below about 2000 mm²/s r/min
ROLLER_REDUCTION = 0.83  # λν of radial roller bearings, ISO/TS 16281
STRAIGHT_EDGE = 0.01, 1.985  # constants of the edge factor of straight rollers, ISO/TS 16281


class _Factor(NamedTuple):
    """Constants of (1 - (c1 - c2/κ^e)^g (e_C C_u/P)^h)^-k, ISO 281:2007, 9.3.3.

    c2 and e have values for κ below 0.4, below 1 and above.
    """

    c1: float
    c2: tuple[float, float, float]
    g: float
    h: float
    k: float


_POWERS = 0.054381, 0.19087, 0.071739
_FACTORS: dict[RollingElement, _Factor] = {
    "ball": _Factor(2.5671, (2.2649, 1.9987, 1.9987), 0.83, 1.0 / 3.0, 9.3),
    "roller": _Factor(1.5859, (1.3993, 1.2348, 1.2348), 1.0, 0.4, 9.185),
}


def reference_viscosity(speed: float, pitch_diameter: float) -> float:
    """Return the reference viscosity ν1 [m²/s] at a speed [rad/s] and pitch diameter [m].

    45 000 n^-0.83 D^-0.5, above 1000 r/min 4500 (n D)^-0.5, in mm²/s, r/min and mm (ISO 281). The
    branches differ by 2.3 % at 1000 r/min.

    Examples
    --------
    >>> from asperity.rating import reference_viscosity
    >>> f"{reference_viscosity(speed=314.16, pitch_diameter=0.039) * 1e6:.1f} mm2/s"
    '13.2 mm2/s'
    """
    rpm = speed * 30.0 / math.pi
    diameter = 1e3 * pitch_diameter
    law = 45000.0 * rpm**-0.83 if rpm < BRANCH_SPEED else 4500.0 * rpm**-0.5
    return float(1e-6 * law / math.sqrt(diameter))


def life_factor(element: RollingElement, kappa: float, contamination: float) -> float | None:
    """Return the life modification factor a_ISO of a radial bearing; None below κ = 0.1.

    a_ISO = 0.1 (1 - (c1 - c2/κ^e)^g (e_C C_u/P)^h)^-k, at most 50, with κ limited to 4. Source: ISO
    281:2007.

    Parameters
    ----------
    element : "ball" or "roller"
    kappa : viscosity ratio κ
    contamination : e_C C_u/P

    Raises
    ------
    BadInput
        The contamination is negative.

    Examples
    --------
    >>> from asperity.rating import life_factor
    >>> f"{life_factor('ball', kappa=1.5, contamination=0.2):.2f}"
    '10.92'
    >>> print(life_factor("ball", kappa=0.05, contamination=0.2))
    None
    """
    if contamination < 0.0:
        raise BadInput(
            "contamination times fatigue load limit over load must not be negative, got "
            f"{contamination:g}"
        )
    if kappa < MIN_KAPPA:
        return None
    kappa, law = min(kappa, MAX_KAPPA), _FACTORS[element]
    branch = 0 if kappa < 0.4 else 1 if kappa < 1.0 else 2
    lubrication = max(law.c1 - law.c2[branch] / kappa ** _POWERS[branch], 0.0)
    bracket = 1.0 - lubrication**law.g * contamination**law.h
    if bracket <= 0.0:
        return MAX_LIFE_FACTOR
    return float(min(0.1 * bracket**-law.k, MAX_LIFE_FACTOR))


def reliability_factor(reliability: float) -> float:
    """Return the life factor a1 of a reliability: 0.95 (ln S/ln 0.9)^(2/3) + 0.05.

    The Weibull distribution with a minimum life behind table 12 of ISO 281:2007, which it
    reproduces to its digits.

    Examples
    --------
    >>> from asperity.rating import reliability_factor
    >>> round(reliability_factor(0.99), 2)
    0.25
    """
    return float(0.95 * (math.log(reliability) / math.log(0.9)) ** (2.0 / 3.0) + 0.05)


def palmgren_torque(
    pitch_diameter: float, speed: float, viscosity: float, load: float, static_rating: float | None
) -> float:
    """Return the friction torque of a bearing in an oil bath by Palmgren's formulas [N m].

    M0 = 1e-7 f0 (ν n)^(2/3) D³, at least 160e-7 f0 D³, and M1 = f1 P D, in N, mm, mm²/s and r/min.
    Deep-groove balls: f0 2, f1 0.0005 (P/C0)^0.55; cylindrical rollers: f0 2.2, f1 0.0003. Source:
    T. A. Harris, Rolling Bearing Analysis, from memory; makers' figures scatter by half.

    Parameters
    ----------
    pitch_diameter : [m]
    speed : of the rotating ring [rad/s]
    viscosity : kinematic, at the oil's temperature [m²/s]
    load : equivalent load P [N]
    static_rating : C0 of a ball bearing [N]; None for cylindrical rollers

    Examples
    --------
    >>> from asperity.rating import palmgren_torque
    >>> torque = palmgren_torque(0.046, 314.16, 32e-6, 1000.0, static_rating=11300.0)
    >>> f"{torque * 1e3:.0f} N mm"
    '47 N mm'
    """
    diameter = 1e3 * pitch_diameter
    product = 1e6 * viscosity * speed * 30.0 / math.pi
    of_oil, of_load = 2.2, 3e-4
    if static_rating is not None:
        of_oil, of_load = 2.0, 5e-4 * (load / static_rating) ** 0.55
    viscous = max(1e-7 * product ** (2.0 / 3.0), SLOW_TORQUE) * of_oil * diameter**3
    return float(1e-3 * (viscous + of_load * load * diameter))


class BallRaceway(NamedTuple):
    """Geometry of a ball bearing for its life: γ, osculations, nominal contact angle [rad]."""

    ratio: float
    osculation: tuple[float, float]
    contact_angle: float


def ball_life(loads: Field, rating: float, raceway: BallRaceway) -> float:
    """Return the basic reference rating life of a single-row radial ball bearing [revolutions].

    The inner ring rotates. Source: ISO/TS 16281:2008, 4.3.

    Parameters
    ----------
    loads : loads of all balls [N]
    rating : basic dynamic load rating C [N]
    raceway : geometry of the bearing
    """
    require_positive("dynamic_load_rating", rating, "N")
    inner, outer = raceway.osculation
    grooves = (inner / outer * (2.0 * outer - 1.0) / (2.0 * inner - 1.0)) ** 0.41
    factor = 1.044 * ((1.0 - raceway.ratio) / (1.0 + raceway.ratio)) ** 1.72 * grooves
    per_ball = rating / (loads.size * math.cos(raceway.contact_angle) ** 0.7)
    rotating = per_ball / 0.407 * (1.0 + factor ** (10.0 / 3.0)) ** 0.3
    stationary = per_ball / 0.389 * (1.0 + factor ** (-10.0 / 3.0)) ** 0.3
    damage = (_mean(loads, 3.0) / rotating) ** (10.0 / 3.0) + (
        _mean(loads, 10.0 / 3.0) / stationary
    ) ** (10.0 / 3.0)
    return float(1e6 * damage**-0.9)


def roller_life(loads: Field, rating: float, ratio: float, *, straight: bool) -> float:
    """Return the basic reference rating life of a single-row radial roller bearing [revolutions].

    The inner ring rotates. Source: ISO/TS 16281:2008, 5.3.

    Parameters
    ----------
    loads : loads of all slices [N], shape (rollers, slices)
    rating : basic dynamic load rating C [N]
    ratio : γ, roller diameter over pitch diameter
    straight : rollers without a profile, whose slice loads are multiplied by 1 - 0.01/ln(1.985
        |x|), x from -1/2 to 1/2 along a roller

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.rating import roller_life
    >>> loads = np.full((2, 30), 200.0)
    >>> f"{roller_life(loads, rating=4000.0, ratio=0.2, straight=False):.0f}"
    '1291333'
    """
    require_positive("dynamic_load_rating", rating, "N")
    rollers, slices = loads.shape
    factor = 1.038 * ((1.0 - ratio) / (1.0 + ratio)) ** (143.0 / 108.0)
    per_slice = rating / ROLLER_REDUCTION / rollers * slices ** (-7.0 / 9.0)
    rotating = per_slice / 0.378 * (1.0 + factor**4.5) ** (2.0 / 9.0)
    stationary = per_slice / 0.364 * (1.0 + factor**-4.5) ** (2.0 / 9.0)
    weighted = loads * (edge_factors(slices) if straight else 1.0)
    damage = (_mean(weighted, 4.0) / rotating) ** 4.5 + (_mean(weighted, 4.5) / stationary) ** 4.5
    return float(1e6 * np.sum(damage) ** (-8.0 / 9.0))


def edge_factors(slices: int) -> Field:
    """Return the edge factors of a straight roller, 1 - 0.01/ln(1.985 |(2k - n - 1)/(2n - 2)|)."""
    number = np.arange(1, slices + 1)
    distance = np.abs((2.0 * number - slices - 1.0) / (2.0 * slices - 2.0))
    middle = distance == 0.0  # odd number of slices; the limit of the factor is 1
    return np.where(
        middle,
        1.0,
        1.0 - STRAIGHT_EDGE[0] / np.log(STRAIGHT_EDGE[1] * np.where(middle, 0.1, distance)),
    )


def _mean(loads: Field, power: float) -> Field:
    """Return the power mean over the rolling elements."""
    return np.asarray(np.mean(loads**power, axis=0) ** (1.0 / power))
