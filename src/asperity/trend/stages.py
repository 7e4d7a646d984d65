"""Stages of wear: a break in the trend of the contact resonance along time or roughness.

They are read from CRF, the damping of its line, or both, without a threshold of the load share. A
broken stick with a Bayesian break competes with smooth curves and with no change: on a smooth
curve, a stick alone would report a precise but false knee. The module knows no recordings;
docs/theory/indicators.md has the equations.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.arrays import Field, usual_float_errors
from asperity.core.coverage import PERCENT, QUANTILES
from asperity.core.displayed import Brief
from asperity.core.errors import BadInput, require_choice
from asperity.trend.change_points import (
    FEWEST_STAGE_POINTS,
    SeriesPoints,
    averaged_points,
    common_breaks,
    compare_models,
    probability_beyond_break,
    quantiles,
)
from asperity.trend.stage_models import IndicatorSeries, Outcome, weigh_explanations
from asperity.trend.stage_words import (
    Axis,
    IndicatorCourse,
    NoStage,
    StageKind,
    StageSource,
    describe_course,
    name_indicators,
    reason_for_no_stage,
    too_few_points,
)

Detector = Literal["bayesian"]

BEYOND_BREAK_FROM = 0.5  # probability of lying beyond the break, if there is one


@dataclass(frozen=True, slots=True, kw_only=True)
class StageErrors:
    """Standard deviations of the arguments of `split_stages`: a number or shape (recordings,) each.

    Repeats at one x share its error. Scatter beyond these is estimated from the series.
    """

    crf_hz: ArrayLike | None = None
    damping_ratio: ArrayLike | None = None
    x: ArrayLike | None = None


NO_ERRORS = StageErrors()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Stages(Brief):
    """Stages of wear in a series of CRFs, damping ratios, or both.

    Parameters
    ----------
    source : indicator that the stages were read from
    kind : "severe": load transfers to asperities (CRF rises or damping falls), from `split` on more
        slowly; the paper's normal and severe stages. "steepening": from `split` on faster; wear
        accelerates, no severe stage yet. "running-in": load transfers back, and at `split` the rate
        changes. "no distinct stage": a change that a smooth curve explains as well. "no change".
        "disagree": CRF and damping contradict each other, so at least one does not belong to the
        contact. "too few" points
    split, interval : the break, in units of x, and its interval; nan unless a stage was found
    probability : shape (recordings,), of being in the severe stage; 0 for running-in and
        steepening, nan where not determined. Weighs the broken stick against smooth curves, so it
        stays below 1 where no stage is distinct
    labels : "normal", "severe" (probably beyond the break, if there is one), "steady",
        "steepening", "running-in" or "none", one per recording
    evidence : BIC of each model relative to the best; 0 is the best, 6 or more is strong evidence
        against
    slopes : of CRF before and after the break [Hz per unit of x]; nan without CRF
    scatter_hz : standard deviation of CRF about the best model beyond the stated errors [Hz]; nan
        without CRF
    damping : ratio at the first point, at the break and at the last, by the stick; nan without
        damping
    verdict : the result in one sentence
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
        """True where a break was found."""
        return self.kind in ("severe", "steepening", "running-in")


@usual_float_errors
def split_stages(
    x: ArrayLike,
    crf_hz: ArrayLike,
    crfa: ArrayLike | None = None,
    *,
    damping_ratio: ArrayLike | None = None,
    errors: StageErrors = NO_ERRORS,
    source: StageSource = "crf",
    detector: Detector = "bayesian",
    unit: str = "",
) -> Stages:
    """Find the break between normal and severe wear along `x`, if there is one.

    Parameters
    ----------
    x : shape (recordings,), time or roughness, in any order; recordings at the same x are repeats
        of one test
    crf_hz : shape (recordings,) [Hz]; nan where no resonance was found
    crfa : shape (recordings,), a weak second channel: a sudden bend of its logarithm narrows the
        break of CRF but decides nothing
    damping_ratio : shape (recordings,), of the contact's line; nan where not determined. It falls
        as load transfers to asperities, provided that the damping of the rest of the machine is
        constant
    errors : standard deviations of CRF, damping ratio and x
    source : indicator to use: CRF, the damping ratio, or both with one common break
    detector : name in STAGE_DETECTORS
    unit : of x, for the verdict

    Raises
    ------
    BadInput
        for an unknown detector or source, a source without its values, shapes that differ, x that
        is not finite, damping ratios that are not positive, negative standard deviations.
    """
    if detector not in STAGE_DETECTORS:
        raise BadInput(
            f"stage detector must be one of {', '.join(STAGE_DETECTORS)}, got {detector!r}"
        )
    require_choice("source of stages", source, get_args(StageSource))
    x, crf_hz = np.asarray(x, dtype=float), np.asarray(crf_hz, dtype=float)
    damping = None if damping_ratio is None else np.asarray(damping_ratio, dtype=float)
    _require_one_length(x, crf_hz, crfa, damping)
    crf_std = _deviations("CRF deviation", errors.crf_hz, x.size)
    x_std = _deviations("x deviation", errors.x, x.size)
    series = [] if source == "damping" else [IndicatorSeries("crf", crf_hz, crf_std)]
    if source != "crf":
        series.append(
            _damping_series(
                damping, _deviations("damping deviation", errors.damping_ratio, x.size), source
            )
        )
    second = None if crfa is None or source == "damping" else np.asarray(crfa, dtype=float)
    return STAGE_DETECTORS[detector](x, x_std, series, second, unit)


def _require_one_length(x: Field, *series: ArrayLike | None) -> None:
    shapes = [np.shape(values) for values in (x, *series) if values is not None]
    if x.ndim != 1 or len(set(shapes)) > 1:
        raise BadInput(
            "x, CRF, CRFA and damping must be one-dimensional and of one length, got shapes "
            f"{', '.join(map(str, shapes))}"
        )
    if x.size == 0:
        raise BadInput("stages need recordings, got none")
    if not np.isfinite(x).all():
        raise BadInput("x must be finite for every recording; leave out those where it is not")


def _deviations(name: str, value: ArrayLike | None, recordings: int) -> Field:
    array = np.asarray(0.0 if value is None else value, dtype=float)
    if array.shape not in ((), (recordings,)):
        raise BadInput(
            f"{name} must be one number or {recordings}, one per recording, got shape {array.shape}"
        )
    deviations = np.broadcast_to(array, recordings)
    if np.any(deviations[np.isfinite(deviations)] < 0.0):
        raise BadInput(
            f"{name} must be 0 or more, got {np.nanmin(deviations):g}; give standard deviations"
        )
    return np.where(np.isfinite(deviations), deviations, 0.0)


def _damping_series(ratio: Field | None, std: Field, source: StageSource) -> IndicatorSeries:
    """Return damping ratios as -ln ζ, with their relative errors."""
    if ratio is None:
        raise BadInput(
            f"source {source} needs damping ratios, got none; give damping_ratio, or use source crf"
        )
    if np.any(ratio <= 0.0):
        raise BadInput(
            f"damping ratios must be positive, got {np.nanmin(ratio):g}; leave those recordings out"
        )
    return IndicatorSeries("damping", -np.log(ratio), std / ratio)


def _bayesian(
    x: Field, x_std: Field, series: Sequence[IndicatorSeries], crfa: Field | None, unit: str
) -> Stages:
    """Compare a broken stick with saturating curves, a straight line and a constant, by BIC."""
    source: StageSource = "both" if len(series) > 1 else series[0].indicator
    axis = Axis(float(np.min(x)), max(float(np.ptp(x)), np.finfo(float).tiny), unit)
    x, x_std = (x - axis.start) / axis.extent, x_std / axis.extent
    unknown = np.full(x.size, np.nan)
    all_points = [_known_points(indicator, x, x_std) for indicator in series]
    breaks, verdict = _possible_breaks(series, all_points)
    if verdict:
        return _without_stage(source, NoStage("too few", False, verdict), unknown, None)
    outcome = weigh_explanations(
        [compare_models(points, breaks) for points in all_points], crfa, x, x_std
    )
    position = quantiles(breaks, outcome.density, QUANTILES)
    courses = _courses(outcome, series, position[1], axis)
    after = probability_beyond_break(x, x_std, breaks, outcome.density)
    severe = after * _severe_probability(outcome, courses)
    no_stage = reason_for_no_stage(outcome, courses, series, all_points[0], axis)
    if no_stage is not None:
        probability = severe if no_stage.probability_known else unknown
        return _without_stage(source, no_stage, probability, outcome)
    return _with_stage(source, outcome, courses, axis, position, (after, severe))


def _known_points(series: IndicatorSeries, x: Field, x_std: Field) -> SeriesPoints:
    finite = np.isfinite(series.values)
    return averaged_points(x[finite], series.values[finite], series.std[finite], x_std[finite])


def _possible_breaks(
    series: Sequence[IndicatorSeries], all_points: Sequence[SeriesPoints]
) -> tuple[Field, str]:
    """Return the breaks that all series can have, or the verdict where there are too few points."""
    for indicator, points in zip(series, all_points, strict=True):
        if points.x.size < FEWEST_STAGE_POINTS:
            return np.empty(0), too_few_points(indicator.indicator, points.x.size)
    breaks = common_breaks(all_points)
    if not breaks[0] < breaks[-1]:
        return breaks, "Not determined: CRF and damping are known at different x."
    return breaks, ""


def _courses(
    outcome: Outcome, series: Sequence[IndicatorSeries], split: float, axis: Axis
) -> list[IndicatorCourse]:
    """Return the course of each indicator, with a break where the best model has one."""
    any_break = outcome.broken < min(outcome.smooth, outcome.constant)
    return [
        describe_course(indicator, comparison, split, any_break and has_break, axis)
        for indicator, comparison, has_break in zip(
            series, outcome.comparisons, outcome.has_break, strict=True
        )
    ]


def _severe_probability(outcome: Outcome, courses: Sequence[IndicatorCourse]) -> float:
    """Return the probability of a break beyond which the severe stage may lie."""
    rises = any(course.sign == 1 for course in courses)
    flattens = _flattens(courses, outcome.has_break)
    return outcome.break_probability if rises and flattens else 0.0


def _flattens(courses: Sequence[IndicatorCourse], has_break: Sequence[bool]) -> bool:
    """Return whether every indicator with a break changes more slowly after it."""
    return all(course.flattens for course, breaks in zip(courses, has_break, strict=True) if breaks)


def _with_stage(
    source: StageSource,
    outcome: Outcome,
    courses: Sequence[IndicatorCourse],
    axis: Axis,
    position: tuple[float, float, float],
    probabilities: tuple[Field, Field],
) -> Stages:
    """Return stages from the break's quantiles, and probabilities of being after it and severe."""
    kind: StageKind = "running-in"
    if {course.sign for course in courses} - {0} == {1}:
        kind = "severe" if _flattens(courses, outcome.has_break) else "steepening"
    lead, names = _NAMES[kind]
    low, split, high = (axis.x_at(scaled) for scaled in position)
    where = f"{split:.4g} {axis.unit}".rstrip() + f" ({PERCENT} interval {low:.4g} to {high:.4g})"
    words = ", ".join(course.words for course in courses)
    after, severe = probabilities
    return Stages(
        source=source,
        kind=kind,
        split=split,
        interval=(low, high),
        probability=severe,
        labels=tuple(names[int(p >= BEYOND_BREAK_FROM)] for p in after),
        evidence=outcome.evidence,
        slopes=courses[0].slopes if source != "damping" else (np.nan, np.nan),
        scatter_hz=_scatter(source, outcome),
        damping=courses[-1].levels if source != "crf" else (np.nan, np.nan, np.nan),
        verdict=f"{lead} {where}{name_indicators(source, outcome.has_break)}: {words}.",
    )


_NAMES: dict[StageKind, tuple[str, tuple[str, str]]] = {
    "severe": ("Severe wear from", ("normal", "severe")),
    "steepening": ("Wear accelerates from", ("steady", "steepening")),
    "running-in": ("Running-in until", ("running-in", "steady")),
}


STAGE_DETECTORS: dict[
    Detector, Callable[[Field, Field, Sequence[IndicatorSeries], Field | None, str], Stages]
] = {"bayesian": _bayesian}


def _without_stage(
    source: StageSource, reason: NoStage, probability: Field, outcome: Outcome | None
) -> Stages:
    return Stages(
        source=source,
        kind=reason.kind,
        probability=probability,
        labels=("none",) * probability.size,
        evidence={} if outcome is None else outcome.evidence,
        scatter_hz=np.nan if outcome is None else _scatter(source, outcome),
        verdict=reason.verdict,
    )


def _scatter(source: StageSource, outcome: Outcome) -> float:
    """Return the scatter of CRF [Hz]; nan without CRF."""
    return outcome.comparisons[0].scatter if source != "damping" else np.nan
