"""Published film thickness fits for smooth, flooded, isothermal contacts, and their regimes.

Speed U = η₀ u/(E' R), load W = w/(E' R) or F/(E' R²), material G = α E', with u the mean speed and
R along rolling. Moes' load M = W (2U)^-1/2 (line) or W (2U)^-3/4, oil L = G (2U)^1/4, and film H =
(h/R) (2U)^-1/2.
"""

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput, require_positive
from asperity.lubricant import Lubricant, Thermal

Regime = Literal[
    "isoviscous-rigid", "isoviscous-elastic", "piezoviscous-rigid", "piezoviscous-elastic"
]
Place = Literal["central", "least"]
PEAK_TO_MIN_FILM = 1.2257  # rigid cylinder: film under the pressure peak over the minimum
MAX_FILM_PER_RADIUS = 0.05  # the parabola then misses 2.5 % of a circle's gap


@dataclass(frozen=True, slots=True)
class FilmNumbers:
    """Dimensionless numbers of a film.

    Speed U, load W and material G (Dowson, Higginson, Hamrock), load M and oil L (Moes).
    """

    speed: float
    load: float
    material: float
    moes_load: float
    moes_oil: float


@dataclass(frozen=True, slots=True)
class FilmFit:
    """A published fit: source, place, and film thickness [m].

    `incompressible` marks a central film for an incompressible oil; a compressible one is thinner
    by the density there.
    """

    source: str
    place: Place
    film: float
    incompressible: bool = False


class _Asymptotes(NamedTuple):
    """Moes' films in the four regimes."""

    isoviscous_rigid: float
    isoviscous_elastic: float
    piezoviscous_rigid: float
    piezoviscous_elastic: float


def film_numbers(conditions: ContactConditions, lubricant: Lubricant) -> FilmNumbers:
    """Return the dimensionless numbers that film thickness fits use.

    Examples
    --------
    >>> from asperity.case import case_template, load_case
    >>> from asperity.ehl import film_numbers
    >>> contact = load_case(case_template("line"))
    >>> numbers = film_numbers(contact.conditions, contact.lubricant)
    >>> f"M {numbers.moes_load:.0f}, L {numbers.moes_oil:.1f}"
    'M 10, L 9.2'
    """
    radius = conditions.radius_along_rolling
    modulus = conditions.pair.effective_modulus
    line = conditions.long
    material = float(lubricant.viscosity.log_slope(np.zeros(1))[0]) * modulus
    speed = lubricant.viscosity.eta0 * conditions.entrainment_speed / (modulus * radius)
    load = (
        conditions.line_load / (modulus * radius)
        if line
        else conditions.load / (modulus * radius**2)
    )
    return FilmNumbers(
        speed,
        load,
        material,
        moes_load=load * (2.0 * speed) ** (-0.5 if line else -0.75),
        moes_oil=material * (2.0 * speed) ** 0.25,
    )


def lubrication_regime(conditions: ContactConditions, lubricant: Lubricant) -> Regime:
    """Return the regime: elastic or rigid bodies, oil with or without pressure thickening.

    For an isoviscous oil the thicker film applies, for a piezoviscous one the thinner, and of both
    the thicker: each fit omits an effect, rigid bodies the widening of the contact, elastic ones
    their remaining curvature.

    Examples
    --------
    >>> from asperity.case import case_template, load_case
    >>> from asperity.ehl import lubrication_regime
    >>> contact = load_case(case_template("line"))
    >>> lubrication_regime(contact.conditions, contact.lubricant)
    'piezoviscous-elastic'
    """
    films = {regime: fit.film for regime, fit in least_films(conditions, lubricant).items()}
    thin = max(films["isoviscous-rigid"], films["isoviscous-elastic"])
    if min(films["piezoviscous-rigid"], films["piezoviscous-elastic"]) > thin:
        rigid = films["piezoviscous-rigid"] < films["piezoviscous-elastic"]
        return "piezoviscous-rigid" if rigid else "piezoviscous-elastic"
    return "isoviscous-rigid" if films["isoviscous-rigid"] == thin else "isoviscous-elastic"


def central_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Return the central film [m] of an incompressible oil, by a fit for all regimes.

    Line: Moes; others: Nijenbanning, Venner and Moes (1994), for contacts no narrower across
    rolling than along it. In the rigid regimes it is the film under the pressure peak, 1.2257 times
    the minimum film of a cylinder.
    """
    numbers = film_numbers(conditions, lubricant)
    films = _asymptotes(conditions, numbers)
    blend = _moes if conditions.long else _nijenbanning
    unit = conditions.radius_along_rolling * (2.0 * numbers.speed) ** 0.5
    return float(blend(films, _ratio(conditions)) * unit)


def require_thin_film(conditions: ContactConditions, lubricant: Lubricant | None) -> None:
    """Raise BadInput without entrainment, or for a film not thin against the smaller radius.

    Reynolds' equation and the parabola in place of a circle hold for thin films: at the edge of the
    pressure, x² = 2 R h, the parabola misses the share h/(2 R) of a circle's gap.
    """
    if lubricant is None:
        return
    require_positive("entrainment speed", conditions.entrainment_speed, "m/s")
    radius = min(conditions.radius_along_rolling, conditions.radius_across_rolling)
    if (film := central_film(conditions, lubricant)) > MAX_FILM_PER_RADIUS * radius:
        raise BadInput(
            f"a film of {film * 1e3:.3g} mm is not thin against the radius of "
            f"{radius * 1e3:.3g} mm, so that lubrication theory does not hold; raise the load, or "
            "lower speed or viscosity"
        )


def least_film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Return the minimum film [m] by the fit of the contact's regime, the basis of film ratios."""
    return least_films(conditions, lubricant)[lubrication_regime(conditions, lubricant)].film


def least_films(conditions: ContactConditions, lubricant: Lubricant) -> dict[Regime, FilmFit]:
    """Return the fit of the minimum film in each regime."""
    numbers = film_numbers(conditions, lubricant)
    radius = conditions.radius_along_rolling
    films = (_line_films if conditions.long else _point_films)(conditions, numbers)
    return {
        regime: FilmFit(source, "least", film * radius) for regime, (source, film) in films.items()
    }


def _line_films(_: ContactConditions, numbers: FilmNumbers) -> dict[Regime, tuple[str, float]]:
    """Return sources and minimum films h/R of a line contact."""
    u = numbers.speed
    w = numbers.load
    g = numbers.material
    return {
        "isoviscous-rigid": ("Martin (1916)", 4.898 * u / w),
        "isoviscous-elastic": ("Herrebrugh (1968)", 3.10 * u**0.6 * w**-0.2),
        "piezoviscous-rigid": ("Blok (1952)", 1.664 * (g * u) ** (2.0 / 3.0)),
        "piezoviscous-elastic": ("Dowson (1968)", 2.65 * g**0.54 * u**0.7 * w**-0.13),
    }


def _point_films(
    conditions: ContactConditions, numbers: FilmNumbers
) -> dict[Regime, tuple[str, float]]:
    """Return sources and minimum films h/R of a point or elliptic contact."""
    u = numbers.speed
    w = numbers.load
    g = numbers.material
    side = 1.0 / _ratio(conditions)
    axes = _axes(conditions)
    across = 1.0 / (1.0 + 2.0 / (3.0 * side))
    rigid = 128.0 * side * (across * (0.131 * np.arctan(side / 2.0) + 1.683) * u / w) ** 2
    soft = 7.43 * u**0.65 * w**-0.21 * (1.0 - 0.85 * np.exp(-0.31 * axes))
    hard = 3.63 * u**0.68 * g**0.49 * w**-0.073 * (1.0 - np.exp(-0.68 * axes))
    stiff = _asymptotes(conditions, numbers).piezoviscous_rigid * (2.0 * u) ** 0.5
    return {
        "isoviscous-rigid": ("Brewe, Hamrock and Taylor (1979)", float(rigid)),
        "isoviscous-elastic": ("Hamrock and Dowson, soft (1978)", float(soft)),
        "piezoviscous-rigid": ("Nijenbanning, Venner and Moes (1994), rigid", stiff),
        "piezoviscous-elastic": ("Hamrock and Dowson (1977)", float(hard)),
    }


def film_fits(conditions: ContactConditions, lubricant: Lubricant) -> tuple[FilmFit, ...]:
    """Return the fits valid in the contact's regime, thickest film first.

    Hamrock and Dowson's central film of soft contacts (1978) is left out: the solved film of balls
    is 10 % below to 18 % above it (M 20 to 700), 2 to 8 % below the fit for all regimes.
    It is empty for a contact narrower across rolling than along it, which none of these covers.
    """
    if _ratio(conditions) > 1.0:
        return ()
    regime = lubrication_regime(conditions, lubricant)
    numbers = film_numbers(conditions, lubricant)
    line = conditions.long
    radius = conditions.radius_along_rolling
    spanning = "Moes" if line else "Nijenbanning, Venner and Moes (1994)"
    fits = [
        FilmFit(spanning, "central", central_film(conditions, lubricant), incompressible=True),
        least_films(conditions, lubricant)[regime],
    ]
    u = numbers.speed
    w = numbers.load
    g = numbers.material
    axes = _axes(conditions)
    if not line and regime == "piezoviscous-elastic":
        film = 2.69 * u**0.67 * g**0.53 * w**-0.067 * (1.0 - 0.61 * np.exp(-0.73 * axes))
        fits.append(FilmFit("Hamrock and Dowson (1977)", "central", float(film) * radius))
    return tuple(sorted(fits, key=lambda fit: -fit.film))


def _ratio(conditions: ContactConditions) -> float:
    """Return Rx/Ry; 0 for a line contact."""
    return conditions.radius_along_rolling / conditions.radius_across_rolling


def _axes(conditions: ContactConditions) -> float:
    """Return the width of the Hertz contact across rolling over that along it."""
    a, b = conditions.hertz.half_widths
    return b / a


def _asymptotes(conditions: ContactConditions, numbers: FilmNumbers) -> _Asymptotes:
    """Return the films of the four regimes."""
    m, l = numbers.moes_load, numbers.moes_oil  # noqa: E741
    if conditions.long:
        return _Asymptotes(
            3.0 / m, 2.621 * m**-0.2, 1.287 * l ** (2.0 / 3.0), 1.311 * m**-0.125 * l**0.75
        )
    ratio = _ratio(conditions)
    shape = 1.0 + 0.006 * np.log(ratio) + 0.63 * ratio ** (4.0 / 7.0)
    films = (
        145.0 * (1.0 + 0.796 * ratio ** (14.0 / 15.0)) ** (-15.0 / 7.0) / ratio * m**-2.0,
        3.18 * shape ** (-14.0 / 25.0) * ratio ** (-1.0 / 15.0) * m ** (-2.0 / 15.0),
        1.29 * (1.0 + 0.691 * ratio) ** (-2.0 / 3.0) * l ** (2.0 / 3.0),
        1.48 * shape ** (-7.0 / 20.0) * ratio ** (-1.0 / 24.0) * m ** (-1.0 / 12.0) * l**0.75,
    )
    return _Asymptotes(*map(float, films))


def _moes(films: _Asymptotes, _: float) -> float:
    """Return the central film H of a line contact from its asymptotes."""
    rigid, elastic, stiff_rigid, stiff = films
    s = (7.0 + 8.0 * np.exp(-2.0 * elastic / rigid)) / 5.0
    thin = (rigid ** (7.0 / 3.0) + elastic ** (7.0 / 3.0)) ** (3.0 * s / 7.0)
    thick = (stiff_rigid**-3.5 + stiff**-3.5) ** (-2.0 * s / 7.0) if stiff else 0.0
    return float((thin + thick) ** (1.0 / s))


def _nijenbanning(films: _Asymptotes, ratio: float) -> float:
    """Return the central film H of a point or elliptic contact from its asymptotes."""
    rigid, elastic, stiff_rigid, stiff = films
    thin = rigid**1.5 + (elastic**-4.0 + (1.8 / ratio) ** -4.0) ** (-3.0 / 8.0)
    if not stiff:
        return float(thin ** (2.0 / 3.0))
    s = 1.5 * (1.0 + np.exp(-1.2 * elastic / stiff))
    thick = (stiff_rigid**-8.0 + stiff**-8.0) ** (-s / 8.0)
    return float((thin ** (2.0 * s / 3.0) + thick) ** (1.0 / s))


def inlet_heating_factor(
    conditions: ContactConditions, lubricant: Lubricant, thermal: Thermal
) -> float:
    """Return the film with inlet shear heating over the isothermal film, by a fit; 1 at rest.

    φ = (1 - 13.2 (p_h/E') L^0.42)/(1 + 0.213 (1 + 2.23 S^0.83) L^0.64) with the thermal loading
    parameter L = η₀ β u²/k and the slide-to-roll ratio S. β = -d(ln η)/dT at the oil's temperature.
    Source: P. K. Gupta, H. S. Cheng, D. Zhu, N. H. Forster, J. B. Schrand, Tribol. Trans. 35 (1992)
    269.

    Examples
    --------
    >>> from asperity.case import case_template, load_case
    >>> from asperity.ehl import inlet_heating_factor
    >>> case = load_case(case_template("point"))
    >>> f"{inlet_heating_factor(case.conditions, case.lubricant, case.thermal):.3f}"
    '0.984'
    """
    eta0 = np.array([lubricant.viscosity.eta0])
    step = 0.01  # [K], each way
    warm, cold = (
        float(thermal.warmth.factor(eta0, np.array([thermal.ambient + rise]), thermal.ambient)[0])
        for rise in (step, -step)
    )
    slope = float(np.log(cold / warm)) / (2.0 * step)
    speed = conditions.entrainment_speed
    if speed == 0.0:
        return 1.0
    loading = lubricant.viscosity.eta0 * slope * speed**2 / thermal.oil_conductivity
    pressure = conditions.hertz.p_max / conditions.pair.effective_modulus
    sliding = 1.0 + 2.23 * abs(conditions.slide_to_roll) ** 0.83
    return float((1.0 - 13.2 * pressure * loading**0.42) / (1.0 + 0.213 * sliding * loading**0.64))
