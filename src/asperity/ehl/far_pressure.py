"""Pressure far from a bounded contact, which carries a share of a light load.

Far away the oil is isoviscous and the gap that of paraboloids. The pressure there, 12 η u x/h² over
3 + 2 Rx/Ry, falls so slowly that the load beyond a distance falls only with its inverse. Where the
film is so thick that the bodies stay rigid, all pressure has this form: it builds up over the
length sqrt(2 R h₀), often many Hertz zones, and the film falls as the inverse square of the load.
Source: P. L. Kapitza, Zh. Tekh. Fiz. 25 (1955) 747.
"""

import math

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.ehl.film_formulas import least_film, lubrication_regime
from asperity.lubricant import Lubricant

RIGID_SHARE, ELASTIC_SHARE = 0.013, 0.03  # load beyond a chosen grid: 2 to 3 % of the film
OUTLET_LENGTHS = 5.0  # behind the centre; the film ruptures within one
CELLS_IN_LENGTH = 6.0  # for 1 % of the film
CELLS_IN_LIGHT_ZONE = 16.0  # most across a Hertz zone that is small beside the grid
FILM_PER_LOAD = 0.75  # relative loss of an elastic contact's film per lost load, M 3 to 5
MAX_LOSS = 0.15  # of the film beyond the body, above which the grid ends with the body


def build_up_lengths(
    conditions: ContactConditions, lubricant: Lubricant | None
) -> tuple[float, float]:
    """Return the lengths of pressure build-up sqrt(2 R h) along x and y [m].

    Zero for line contacts and in other regimes than the isoviscous-rigid one.
    """
    bounded = conditions.geometry in ("point", "elliptic")
    if lubricant is None or not bounded:
        return 0.0, 0.0
    if lubrication_regime(conditions, lubricant) != "isoviscous-rigid":
        return 0.0, 0.0
    film = least_film(conditions, lubricant)
    along, across = (math.sqrt(2.0 * radius * film) for radius in _radii(conditions))
    return along, across


def flooded_reach(conditions: ContactConditions, lubricant: Lubricant) -> tuple[float, float]:
    """Return the distances along x and y [m] within which nearly all load is carried.

    Zero for line contacts. They end with the body where formulas, for endless paraboloids, owe
    more than 15 % of the film to the pressure beyond.
    """
    if conditions.geometry not in ("point", "elliptic"):
        return 0.0, 0.0
    first, second = _radii(conditions)
    rigid = build_up_lengths(conditions, lubricant)[0] > 0.0
    share = RIGID_SHARE if rigid else ELASTIC_SHARE
    along = _load_times_distance(conditions, lubricant) / (share * conditions.load)
    if loss_beyond_body(conditions, lubricant) > MAX_LOSS:
        along = min(along, first, math.sqrt(first * second))
    return along, along * math.sqrt(second / first)


def film_loss(conditions: ContactConditions, lubricant: Lubricant, grid: Grid) -> float:
    """Return the share of its film that a bounded contact loses by the ends of a grid."""
    if conditions.geometry not in ("point", "elliptic"):
        return 0.0
    first, second = _radii(conditions)
    return _loss(
        conditions, lubricant, min(-grid.lower[0], grid.upper[1] * math.sqrt(first / second))
    )


def loss_beyond_body(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Return the share of the film due to pressure beyond the radius of the body.

    Formulas and solutions take the body for an endless paraboloid.
    """
    if conditions.geometry not in ("point", "elliptic"):
        return 0.0
    first, second = _radii(conditions)
    return _loss(conditions, lubricant, min(first, math.sqrt(first * second)))


def rigid_pressure(x: Field, gap: Field) -> Field:
    """Return the pressure of rigid bodies up to a factor, ruptured behind the centre.

    `x` has shape (nx, 1), `gap`, with its film, (nx, ny).
    """
    return (-x).clip(min=0.0) / gap**2


def _loss(conditions: ContactConditions, lubricant: Lubricant, distance: float) -> float:
    """Return the share of the film lost without the pressure beyond a distance along x [m]."""
    if (along := build_up_lengths(conditions, lubricant)[0]) > 0.0:
        reach = distance / along
        return 1.0 - ((math.atan(reach) - reach / (1.0 + reach**2)) / (0.5 * math.pi)) ** 2
    lost = _load_times_distance(conditions, lubricant) / (distance * conditions.load)
    return min(1.0, FILM_PER_LOAD * lost)


def _load_times_distance(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Return the load beyond a distance along x, times this distance [N m]."""
    first, second = _radii(conditions)
    shape = 96.0 / (3.0 + 2.0 * first / second) * first * math.sqrt(first * second)
    return shape * lubricant.viscosity.eta0 * conditions.entrainment_speed


def _radii(conditions: ContactConditions) -> tuple[float, float]:
    return conditions.radius_along_rolling, conditions.radius_across_rolling
