"""Stages of wear: where along time or roughness the contact resonance changes its pace, or that it does not.

Told by CRF, by the damping of its line, or by both together. A broken stick with a Bayesian break
stands against smooth curves and against no change at all: on a smooth curve a stick alone reports
a precise false knee. Knows nothing of recordings; docs/theory/indicators.md has the equations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise, product
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice
from asperity.core.quantities import with_deviation
from asperity.trend.change_points import (
    CONSTANT,
    FEWEST_PLACES,
    STICK,
    Compared,
    after_break,
    common_breaks,
    compared,
    log_sum,
    places_of,
    quantiles,
    sudden_bend,
)

Detector = Literal["bayesian"]
StageKind = Literal[
    "severe", "steepening", "running-in", "no distinct stage", "no change", "disagree", "too few"
]
Indicator = Literal["crf", "damping"]
StageSource = Literal["crf", "damping", "both"]

STRONG_EVIDENCE = 6.0  # BIC difference, "strong": Kass and Raftery, J. Am. Stat. Assoc. 90 (1995)
SEVERE_FROM = 0.5  # probability
SOURCE_NAMES: dict[str, str] = {"crf": "CRF", "damping": "damping", "both": "CRF and damping"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Stages:
    """What a series of CRFs, of damping ratios, or of both says about stages of wear.

    Parameters
    ----------
    source : what it was read from
    kind : "severe", asperities take load over, CRF rising or damping falling, and from `split` on more slowly, as the
        curve flattens: the paper's normal and severe stage. "steepening", from `split` on faster: wear that gathers
        pace, and no severe stage yet. "running-in", it goes the other way, and then does so at another pace. "no
        distinct stage", it changes, but a smooth curve explains it as well. "no change". "disagree", CRF and damping
        change against each other: one of them, or both, is not the contact's. "too few" places to tell
    split, interval : the break, in units of x, and its 90 % interval; nan unless a stage was found
    probability : shape (recordings,), of being in the severe stage; 0 where the break belongs to running-in or the
        curve steepens, nan where it cannot be told. Weighs the broken stick against the smooth curves, so that it
        stays below 1 where no stage is distinct
    labels : "normal", "severe" (probability 0.5 or more), "steady", "steepening", "running-in" or "none", one a
        recording
    evidence : BIC of each model less that of the best; 0 is the best, 6 more is strong evidence against
    slopes : of CRF before and after the break [Hz per unit of x]; nan where CRF has none
    scatter_hz : standard deviation of CRF about the best model beyond the errors given [Hz]; nan without CRF
    damping : ratio at the first place, at the break and at the last, by the stick; nan where damping has none
    verdict : all of this in one sentence
    """

    source: StageSource = "crf"
    kind: StageKind
    split: float = np.nan
    interval: tuple[float, float] = (np.nan, np.nan)
    probability: Field
    labels: tuple[str, ...]
    evidence: dict[str, float]
    slopes: tuple[float, float] = (np.nan, np.nan)
    scatter_hz: float
    damping: tuple[float, float, float] = (np.nan, np.nan, np.nan)
    verdict: str

    @property
    def found(self) -> bool:
        """Whether there is a break to speak of."""
        return self.kind in ("severe", "steepening", "running-in")


def split_stages(
    x: ArrayLike,
    crf_hz: ArrayLike,
    crfa: ArrayLike | None = None,
    *,
    crf_std_hz: ArrayLike | None = None,
    damping_ratio: ArrayLike | None = None,
    damping_std: ArrayLike | None = None,
    x_std: ArrayLike | None = None,
    source: StageSource = "crf",
    detector: Detector = "bayesian",
    unit: str = "",
) -> Stages:
    """Find the break between normal and severe wear along `x`, if there is one.

    Parameters
    ----------
    x : shape (recordings,), time or roughness, in any order; recordings at the same x are repeats of one test
    crf_hz : shape (recordings,) [Hz]; nan where none was found
    crfa : shape (recordings,), a weak second channel: a sudden bend of its logarithm narrows the break of CRF, and
        decides nothing
    damping_ratio : shape (recordings,), of the contact's line; nan where it is not determined. It falls as asperities
        take the load over, whatever the rest of the machine damps, as long as that stays the same
    crf_std_hz, damping_std, x_std : standard deviations, one for all or shape (recordings,); repeats at one x share
        its error. Scatter beyond them is estimated
    source : what the stage is read from: CRF, the damping ratio, or both with one break between them
    detector : name in STAGE_DETECTORS
    unit : of x, for the sentence

    Raises
    ------
    BadInput
        for an unknown detector or source, a source without its numbers, shapes that differ, x that is not finite,
        damping ratios that are not positive, negative deviations.
    """
    if detector not in STAGE_DETECTORS:
        raise BadInput(
            f"stage detector must be one of {', '.join(STAGE_DETECTORS)}, got {detector!r}"
        )
    require_choice("source of stages", source, get_args(StageSource))
    x, crf_hz = np.asarray(x, dtype=float), np.asarray(crf_hz, dtype=float)
    damping = None if damping_ratio is None else np.asarray(damping_ratio, dtype=float)
    lengths = [np.shape(values) for values in (x, crf_hz, crfa, damping) if values is not None]
    if x.ndim != 1 or len(set(lengths)) > 1:
        raise BadInput(
            f"x, CRF, CRFA and damping must be rows of one length, got shapes {', '.join(map(str, lengths))}"
        )
    if x.size == 0:
        raise BadInput("stages need recordings, got none")
    if not np.isfinite(x).all():
        raise BadInput(
            "x must be finite for every recording, got some that is not; leave those recordings out"
        )
    crf_std = _deviations("CRF deviation", crf_std_hz, x.size)
    x_error = _deviations("x deviation", x_std, x.size)
    series = [] if source == "damping" else [_Series("crf", crf_hz, crf_std)]
    if source != "crf":
        series.append(
            _narrowing(damping, _deviations("damping deviation", damping_std, x.size), source)
        )
    second = None if crfa is None or source == "damping" else np.asarray(crfa, dtype=float)
    return STAGE_DETECTORS[detector](x, x_error, series, second, unit)


def _deviations(name: str, value: ArrayLike | None, recordings: int) -> Field:
    given = np.asarray(0.0 if value is None else value, dtype=float)
    if given.shape not in ((), (recordings,)):
        raise BadInput(
            f"{name} must be one number or {recordings}, one a recording, got shape {given.shape}"
        )
    deviations = np.broadcast_to(given, recordings)
    if np.any(deviations[np.isfinite(deviations)] < 0.0):
        raise BadInput(
            f"{name} must be 0 or more, got {np.nanmin(deviations):g}; give standard deviations"
        )
    return np.where(np.isfinite(deviations), deviations, 0.0)


class _Series(NamedTuple):
    """What a stage is read from, (recordings,): rises as asperities take the load over; nan where it is not known."""

    indicator: Indicator
    values: Field
    std: Field


def _narrowing(ratio: Field | None, std: Field, source: StageSource) -> _Series:
    """Damping ratios as -ln ζ, whose errors are the relative ones."""
    if ratio is None:
        raise BadInput(
            f"source {source} needs damping ratios, got none; give damping_ratio, or take source crf"
        )
    if np.any(ratio <= 0.0):
        raise BadInput(
            f"damping ratios must be positive, got {np.nanmin(ratio):g}; leave those recordings out"
        )
    return _Series("damping", -np.log(ratio), std / ratio)


class _Outcome(NamedTuple):
    """The series compared, the posterior of their break, and how the ways to explain them stand."""

    each: list[Compared]
    density: Field  # of the break, (breaks,)
    sticks: tuple[bool, ...]  # which series break, by the best of the models with a break
    share: float  # probability of the models with a break
    evidence: dict[str, float]
    broken: float  # BIC above the best: of models with a break ...
    smooth: float  # ... without one
    constant: float  # ... in which nothing changes
    apart: (
        float  # ... in which each series breaks at a place of its own; of one series alone infinite
    )


def _bayesian(
    x: Field, x_std: Field, series: Sequence[_Series], crfa: Field | None, unit: str
) -> Stages:
    """Broken stick against saturating curves, a straight line and a constant, by BIC."""
    source: StageSource = "both" if len(series) > 1 else series[0].indicator
    start, reach = float(np.min(x)), max(float(np.ptp(x)), np.finfo(float).tiny)
    x, x_std = (
        (x - start) / reach,
        x_std / reach,
    )  # so that no unit of x is too small for the algebra
    without = partial(_without_stage, source)
    unknown = np.full(x.size, np.nan)
    all_places = []
    for one in series:
        known = np.isfinite(one.values)
        places = places_of(x[known], one.values[known], one.std[known], x_std[known])
        if places.x.size < FEWEST_PLACES:
            return without("too few", _too_few(one.indicator, places.x.size), {}, unknown, np.nan)
        all_places.append(places)
    breaks = common_breaks(all_places)
    if not breaks[0] < breaks[-1]:
        return without(
            "too few",
            "Not determined: CRF and damping are known at different places.",
            {},
            unknown,
            np.nan,
        )
    outcome = _outcome([compared(places, breaks) for places in all_places], crfa, x, x_std)
    scatter = outcome.each[0].scatter if source != "damping" else np.nan
    after = after_break(x, x_std, breaks, outcome.density)
    low, split, high = quantiles(breaks, outcome.density, (0.05, 0.5, 0.95))
    bent = outcome.broken < min(
        outcome.smooth, outcome.constant
    )  # else no series is taken to break
    courses = [
        _course(
            one, outcome.each[number], split, bent and outcome.sticks[number], (start, reach), unit
        )
        for number, one in enumerate(series)
    ]
    signs = {course.sign for course in courses} - {0}
    flattens = all(
        course.flattens for course, stick in zip(courses, outcome.sticks, strict=True) if stick
    )
    severe = after * (outcome.share if 1 in signs and flattens else 0.0)
    first, last = (
        start + reach * float(places.x[end])
        for places, end in ((all_places[0], 0), (all_places[0], -1))
    )
    over = f"{first:.4g} to {last:.4g} {unit}".rstrip()
    thing = SOURCE_NAMES[source]
    if outcome.constant - min(outcome.smooth, outcome.broken) < STRONG_EVIDENCE:
        means = " and ".join(course.mean for course in courses)
        return without(
            "no change", f"No change: {means} over {over}.", outcome.evidence, severe, scatter
        )
    if len(signs) > 1:
        sentence = f"CRF and damping disagree: {courses[0].way} and {courses[1].way} over {over}"
        reason = "asperities that take load over raise CRF and let damping fall: one of them is not the contact's."
        return without("disagree", f"{sentence}; {reason}", outcome.evidence, unknown, scatter)
    if outcome.broken - outcome.apart >= STRONG_EVIDENCE:
        own = [start + reach * _own_break(found) for found in outcome.each]
        verdict = _no_common(series, own, outcome.broken - outcome.apart, over)
        return without("no distinct stage", verdict, outcome.evidence, unknown, scatter)
    if outcome.smooth - outcome.broken < STRONG_EVIDENCE:
        verdict = (
            f"No distinct stage: {thing} {'change' if source == 'both' else 'changes'} over {over}, but a smooth curve "
            f"explains it {'better' if outcome.smooth < outcome.broken else 'as well'} (BIC of a break "
            f"{outcome.broken - outcome.smooth:+.1f} against it, {-STRONG_EVIDENCE:.0f} needed)."
        )
        return without("no distinct stage", verdict, outcome.evidence, severe, scatter)
    kind: StageKind = "running-in" if signs != {1} else "severe" if flattens else "steepening"
    lead, names = _NAMES[kind]
    low, split, high = (start + reach * place for place in (low, split, high))
    where = f"{split:.4g} ({low:.4g} to {high:.4g}, 90 %) {unit}".rstrip()
    return Stages(
        source=source,
        kind=kind,
        split=split,
        interval=(low, high),
        probability=severe,
        labels=tuple(names[int(p >= SEVERE_FROM)] for p in after),
        evidence=outcome.evidence,
        slopes=courses[0].slopes if source != "damping" else (np.nan, np.nan),
        scatter_hz=scatter,
        damping=courses[-1].levels if source != "crf" else (np.nan, np.nan, np.nan),
        verdict=f"{lead} {where}{_by(source, outcome.sticks)}: {', '.join(course.words for course in courses)}.",
    )


_NAMES: dict[StageKind, tuple[str, tuple[str, str]]] = {
    "severe": ("Severe wear from", ("normal", "severe")),
    "steepening": ("Wear gathers pace from", ("steady", "steepening")),
    "running-in": ("Running-in until", ("running-in", "steady")),
}


def _no_common(series: Sequence[_Series], own: Sequence[float], against: float, over: str) -> str:
    """The verdict where each indicator breaks at a place of its own."""
    places = " and ".join(
        f"{SOURCE_NAMES[one.indicator]} at {place:.3g}"
        for one, place in zip(series, own, strict=True)
    )
    sentence = f"No common stage over {over}: {places} change their pace, and one break does not explain both"
    return f"{sentence} (BIC {against:+.1f} against it)."


def _too_few(indicator: Indicator, places: int) -> str:
    if indicator == "crf":
        return f"Too few to tell: a stage needs CRFs at {FEWEST_PLACES} different places, got {places}."
    return f"Not determined: a stage by damping needs it at {FEWEST_PLACES} different places, got {places}."


def _by(source: StageSource, sticks: tuple[bool, ...]) -> str:
    """What the stage is read from, where that is not CRF alone."""
    if source == "both" and not all(sticks):
        return f" by CRF and damping, in the {'damping' if sticks[1] else 'CRF'} alone"
    return "" if source == "crf" else f" by {SOURCE_NAMES[source]}"


def _outcome(each: list[Compared], crfa: Field | None, x: Field, x_std: Field) -> _Outcome:
    """Every way to explain the series, some of them broken at one place and each other one by a model of its own."""
    breaks, count = each[0].breaks, len(each)
    others = [{name: value for name, value in one.bic.items() if name != STICK} for one in each]
    unbroken = {
        names: sum(bic[name] for bic, name in zip(others, names, strict=True))
        for names in product(*others)
    }
    ways = [way for way in product((True, False), repeat=count) if any(way)]
    broken = {way: _bic_of_break(each, others, way) for way in ways}
    constant = unbroken[(CONSTANT,) * count]
    smooth = min(bic for names, bic in unbroken.items() if set(names) != {CONSTANT})
    least = min(constant, smooth, *broken.values())
    weights = {way: float(np.exp(-0.5 * (value - least))) for way, value in broken.items()}
    rest = float(np.sum(np.exp(-0.5 * (np.array([*unbroken.values()]) - least))))
    extra = np.zeros(breaks.size) if crfa is None else sudden_bend(x, crfa, x_std, breaks)
    density = np.zeros(breaks.size)
    for way, weight in weights.items():
        log_break = extra + sum(
            log_sum(one.fits[STICK].marginal) for one, stick in zip(each, way, strict=True) if stick
        )
        own = np.exp(log_break - np.max(log_break))
        density += weight * own / np.sum(own)
    apart, evidence = np.inf, {name: value - least for name, value in each[0].bic.items()}
    if count > 1:
        named = zip(
            ("break in both", "break in the CRF alone", "break in the damping alone"),
            ways,
            strict=True,
        )
        evidence = {name: broken[way] - least for name, way in named}
        apart = sum(one.bic[STICK] for one in each) - least
        evidence |= {
            "breaks apart": apart,
            "smooth curves": smooth - least,
            CONSTANT: constant - least,
        }
    return _Outcome(
        each=each,
        density=density / np.sum(density),
        sticks=min(ways, key=lambda way: broken[way]),
        share=sum(weights.values()) / (sum(weights.values()) + rest),
        evidence={name: value - min(evidence.values()) for name, value in evidence.items()},
        broken=min(broken.values()) - least,
        smooth=smooth - least,
        constant=constant - least,
        apart=apart,
    )


def _bic_of_break(
    each: list[Compared], others: list[dict[str, float]], way: tuple[bool, ...]
) -> float:
    """Of a break in the series that `way` marks, at one place; of the rest the best model without one."""
    if not all(way):
        return sum(
            one.bic[STICK] if stick else min(bic.values())
            for one, bic, stick in zip(each, others, way, strict=True)
        )
    alone = sum(
        one.bic[STICK] + 2.0 * float(np.max(one.fits[STICK].best)) for one in each
    )  # what parameters cost
    shared = (len(each) - 1) * float(
        np.log(max(one.places.x.size for one in each))
    )  # there is one break
    return alone - shared - 2.0 * float(np.max(sum(one.fits[STICK].best for one in each)))


def _own_break(one: Compared) -> float:
    """Where a series' own stick breaks most likely."""
    return float(one.breaks[int(np.argmax(one.fits[STICK].best))])


class _Course(NamedTuple):
    """How a series goes: 1 where asperities take load over, -1 where they hand it back, 0 where nothing changes."""

    sign: int
    flattens: bool  # rises, and then does so more slowly
    mean: str
    way: str
    words: str
    slopes: tuple[float, float]
    levels: tuple[float, float, float]


def _course(
    one: _Series, found: Compared, split: float, stick: bool, scale: tuple[float, float], unit: str
) -> _Course:
    """A series by its stick at the break, in words; `scale` is the start and the reach of x."""
    places, reach = found.places, scale[1]
    nearest = int(np.argmin(np.abs(found.breaks - split)))
    fit = found.fits[STICK]
    base, before, change = fit.linear[nearest, int(np.argmax(fit.marginal[nearest]))]
    slopes = (float(before), float(before + change))
    ends = (split - places.x[0], places.x[-1] - split)
    rise = slopes[0] * ends[0] + slopes[1] * ends[1]
    changes = stick or found.bic[CONSTANT] - min(found.bic.values()) >= STRONG_EVIDENCE
    flattens = bool(slopes[0] > 0.0 and slopes[1] < slopes[0])
    sign = (1 if rise > 0.0 else -1) if changes else 0
    mean, error = float(np.mean(places.y)), float(np.std(places.y, ddof=1))
    if one.indicator == "crf":
        per = f" Hz per {unit}" if unit else " Hz per unit of x"
        first, behind = (
            f"{'rises' if slope > 0.0 else 'falls'} by {abs(slope) / reach:.3g}" for slope in slopes
        )
        return _Course(
            sign=sign,
            flattens=flattens,
            mean=f"CRF holds at {mean:.0f} ± {error:.0f} Hz",
            way=f"CRF {'rises' if sign > 0 else 'falls'}",
            words=f"CRF {first}{per} before and {behind} after"
            if changes
            else "CRF does not change",
            slopes=(slopes[0] / reach, slopes[1] / reach),
            levels=(np.nan, np.nan, np.nan),
        )
    at = (base, base + slopes[0] * ends[0], base + rise)
    levels = tuple(float(np.exp(-value)) for value in at)
    ratios = [f"{level:.3g}" for level in levels]
    goes = ["falls" if b < a else "rises" for a, b in pairwise(levels)]
    on = "" if goes[0] == goes[1] else f"{goes[1]} "
    return _Course(
        sign=sign,
        flattens=flattens,
        mean=f"damping holds at {with_deviation(float(np.exp(-mean)), error * float(np.exp(-mean)))}",
        way=f"damping {'falls' if sign > 0 else 'rises'}",
        words=f"damping {goes[0]} from {ratios[0]} to {ratios[1]} before and {on}to {ratios[2]} after"
        if changes
        else "damping does not change",
        slopes=(np.nan, np.nan),
        levels=(levels[0], levels[1], levels[2]),
    )


STAGE_DETECTORS: dict[
    Detector, Callable[[Field, Field, Sequence[_Series], Field | None, str], Stages]
] = {"bayesian": _bayesian}


def _without_stage(
    source: StageSource,
    kind: StageKind,
    verdict: str,
    evidence: dict[str, float],
    probability: Field,
    scatter: float,
) -> Stages:
    return Stages(
        source=source,
        kind=kind,
        probability=probability,
        labels=("none",) * probability.size,
        evidence=evidence,
        scatter_hz=scatter,
        verdict=verdict,
    )
