"""Rolling bearings rated as ISO 281 and ISO/TS 16281 have it: viscosity ratio, life factor, reference rating life.

Ratings already hold roughness, by statistics of bearings that failed: nothing of a solved contact
goes into them.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

RollingElement = Literal["ball", "roller"]

SLOW = 1000.0  # r/min, below which the reference viscosity has another law
MAX_COMPARED_VISCOSITY, MIN_VISCOSITY = (
    4.0,
    0.1,
)  # viscosity ratio beyond which nothing is gained, and below which nothing is rated
LARGEST_FACTOR = 50.0
ROLLER_REDUCTION = 0.83  # λν of radial roller bearings, ISO/TS 16281
STRAIGHT_EDGE = 0.01, 1.985  # of the factor on the load of a straight roller's slices, ISO/TS 16281


class _Factor(NamedTuple):
    """1 - (c1 - c2/κ^e)^g (e_C C_u/P)^h to the power -k, ISO 281:2007, 9.3.3; c2 and e by κ below 0.4, below 1."""

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
    """ν1 [m²/s] at a speed [rad/s] and pitch diameter [m]: 45 000 n^-0.83 D^-0.5, from 1000 r/min 4500 (n D)^-0.5.

    In mm²/s, r/min and mm, as ISO 281 prints it. Its two branches differ by 2.3 % where they meet.
    """
    turning, diameter = speed * 30.0 / math.pi, 1e3 * pitch_diameter
    law = 45000.0 * turning**-0.83 if turning < SLOW else 4500.0 * turning**-0.5
    return float(1e-6 * law / math.sqrt(diameter))


def life_factor(element: RollingElement, kappa: float, contamination: float) -> float | None:
    """a_ISO of a radial bearing, at most 50, of the viscosity ratio κ and e_C C_u/P; None below κ = 0.1.

    0.1 (1 - (c1 - c2/κ^e)^g (e_C C_u/P)^h)^-k. κ counts up to 4. Source: ISO 281:2007.

    Raises
    ------
    BadInput
        for a contamination that is negative.
    """
    if contamination < 0.0:
        raise BadInput(
            f"contamination times fatigue load limit over load must not be negative, got {contamination:g}"
        )
    if kappa < MIN_VISCOSITY:
        return None
    kappa, law = min(kappa, MAX_COMPARED_VISCOSITY), _FACTORS[element]
    range_of = 0 if kappa < 0.4 else 1 if kappa < 1.0 else 2
    lubricated = max(law.c1 - law.c2[range_of] / kappa ** _POWERS[range_of], 0.0)
    bracket = 1.0 - lubricated**law.g * contamination**law.h
    if bracket <= 0.0:
        return LARGEST_FACTOR
    return float(min(0.1 * bracket**-law.k, LARGEST_FACTOR))


class BallRaceway(NamedTuple):
    """What a ball bearing's life needs of its shape: γ, osculations of inner and outer ring, nominal contact angle."""

    ratio: float
    osculation: tuple[float, float]
    contact_angle: float


def ball_life(loads: Field, rating: float, raceway: BallRaceway) -> float:
    """Basic reference rating life of a single-row radial ball bearing [revolutions], its inner ring turning.

    Parameters
    ----------
    loads : on every ball [N]
    rating : basic dynamic load rating C [N]
    raceway : the bearing's shape

    Source: ISO/TS 16281:2008, 4.3.
    """
    require_positive("dynamic_load_rating", rating, "N")
    inner, outer = raceway.osculation
    grooves = (inner / outer * (2.0 * outer - 1.0) / (2.0 * inner - 1.0)) ** 0.41
    both = 1.044 * ((1.0 - raceway.ratio) / (1.0 + raceway.ratio)) ** 1.72 * grooves
    per_ball = rating / (loads.size * math.cos(raceway.contact_angle) ** 0.7)
    turning = per_ball / 0.407 * (1.0 + both ** (10.0 / 3.0)) ** 0.3
    standing = per_ball / 0.389 * (1.0 + both ** (-10.0 / 3.0)) ** 0.3
    worn = (_mean(loads, 3.0) / turning) ** (10.0 / 3.0) + (
        _mean(loads, 10.0 / 3.0) / standing
    ) ** (10.0 / 3.0)
    return float(1e6 * worn**-0.9)


def roller_life(loads: Field, rating: float, ratio: float, *, straight: bool) -> float:
    """Basic reference rating life of a single-row radial roller bearing [revolutions], its inner ring turning.

    Parameters
    ----------
    loads : on every slice of every roller [N], shape (rollers, slices)
    rating : basic dynamic load rating C [N]
    ratio : γ, roller's diameter over pitch diameter
    straight : rollers without a profile, whose outer slices are taken for more by 1 - 0.01/ln(1.985 |x|), x from -1/2
        to 1/2 along a roller

    Source: ISO/TS 16281:2008, 5.3.
    """
    require_positive("dynamic_load_rating", rating, "N")
    rollers, slices = loads.shape
    both = 1.038 * ((1.0 - ratio) / (1.0 + ratio)) ** (143.0 / 108.0)
    per_slice = rating / ROLLER_REDUCTION / rollers * slices ** (-7.0 / 9.0)
    turning = per_slice / 0.378 * (1.0 + both**4.5) ** (2.0 / 9.0)
    standing = per_slice / 0.364 * (1.0 + both**-4.5) ** (2.0 / 9.0)
    pressed = loads * (edge_factors(slices) if straight else 1.0)
    worn = (_mean(pressed, 4.0) / turning) ** 4.5 + (_mean(pressed, 4.5) / standing) ** 4.5
    return float(1e6 * np.sum(worn) ** (-8.0 / 9.0))


def edge_factors(slices: int) -> Field:
    """By which the slices of a straight roller count for more: 1 - 0.01/ln(1.985 |(2k - n - 1)/(2n - 2)|)."""
    number = np.arange(1, slices + 1)
    place = np.abs((2.0 * number - slices - 1.0) / (2.0 * slices - 2.0))
    middle = place == 0.0  # of an odd number: the factor's limit there is 1
    return np.where(
        middle,
        1.0,
        1.0 - STRAIGHT_EDGE[0] / np.log(STRAIGHT_EDGE[1] * np.where(middle, 0.1, place)),
    )


def _mean(loads: Field, power: float) -> Field:
    """Over the rolling elements."""
    return np.asarray(np.mean(loads**power, axis=0) ** (1.0 / power))
