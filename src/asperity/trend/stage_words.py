"""Words for stages of wear: the course of each indicator, and why a series shows no stage."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from asperity.core.quantities import with_deviation
from asperity.trend.change_points import (
    CONSTANT,
    FEWEST_STAGE_POINTS,
    STICK,
    ModelComparison,
    SeriesPoints,
)
from asperity.trend.stage_models import Indicator, IndicatorSeries, Outcome, own_break

StageKind = Literal[
    "severe", "steepening", "running-in", "no distinct stage", "no change", "disagree", "too few"
]
StageSource = Literal["crf", "damping", "both"]

STRONG_EVIDENCE = 6.0  # BIC difference, "strong": Kass and Raftery, J. Am. Stat. Assoc. 90 (1995)
SOURCE_NAMES: dict[str, str] = {"crf": "CRF", "damping": "damping", "both": "CRF and damping"}


class Axis(NamedTuple):
    """Scaling of x to 0..1, so that no unit is too small for the algebra; `unit` is for text."""

    start: float
    extent: float
    unit: str

    def x_at(self, scaled: float) -> float:
        """Return x for a scaled coordinate."""
        return self.start + self.extent * scaled

    def range_text(self, points: SeriesPoints) -> str:
        """Return the range of x in words."""
        first = self.x_at(float(points.x[0]))
        last = self.x_at(float(points.x[-1]))
        return f"{first:.4g} to {last:.4g} {self.unit}".rstrip()


class NoStage(NamedTuple):
    """Reason why no stage is reported, and whether the probability of severe wear is known."""

    kind: StageKind
    probability_known: bool
    verdict: str


def reason_for_no_stage(
    outcome: Outcome,
    courses: Sequence["IndicatorCourse"],
    series: Sequence[IndicatorSeries],
    points: SeriesPoints,
    axis: Axis,
) -> NoStage | None:
    """Return the reason why the series shows no stage, or None where it shows one."""
    over = axis.range_text(points)
    if outcome.constant - min(outcome.smooth, outcome.broken) < STRONG_EVIDENCE:
        means = " and ".join(course.mean for course in courses)
        return NoStage("no change", True, f"No change: {means} over {over}.")
    if len({course.sign for course in courses} - {0}) > 1:
        return NoStage(
            "disagree",
            False,
            f"CRF and damping disagree: {courses[0].way} and {courses[1].way} over {over}; load "
            "transfer to asperities raises CRF and lowers damping, so one of them does not belong "
            "to the contact.",
        )
    if outcome.broken - outcome.separate >= STRONG_EVIDENCE:
        verdict = _no_common_stage(outcome, series, axis, over)
        return NoStage("no distinct stage", False, verdict)
    if outcome.smooth - outcome.broken < STRONG_EVIDENCE:
        source = SOURCE_NAMES["both" if len(series) > 1 else series[0].indicator]
        changes = f"{source} {'change' if len(series) > 1 else 'changes'}"
        better = "better" if outcome.smooth < outcome.broken else "as well"
        return NoStage(
            "no distinct stage",
            True,
            f"No distinct stage: {changes} over {over}, but a smooth curve explains it {better} "
            f"(ΔBIC for a break {outcome.broken - outcome.smooth:+.1f}; {-STRONG_EVIDENCE:.0f} "
            "required).",
        )
    return None


def _no_common_stage(
    outcome: Outcome, series: Sequence[IndicatorSeries], axis: Axis, over: str
) -> str:
    breaks = " and ".join(
        f"{SOURCE_NAMES[indicator.indicator]} at {axis.x_at(own_break(comparison)):.3g}"
        for indicator, comparison in zip(series, outcome.comparisons, strict=True)
    )
    return (
        f"No common stage over {over}: the breaks of {breaks} are not explained by a common one "
        f"(ΔBIC {outcome.broken - outcome.separate:+.1f} against it)."
    )


def too_few_points(indicator: Indicator, points: int) -> str:
    """Return the verdict where an indicator is known at too few points."""
    words = {"crf": "CRF", "damping": "damping ratios"}[indicator]
    return (
        f"Too few points: a stage by {SOURCE_NAMES[indicator]} needs {words} at "
        f"{FEWEST_STAGE_POINTS} different x, got {points}."
    )


def name_indicators(source: StageSource, has_break: tuple[bool, ...]) -> str:
    """Name the indicators that the stage is read from, unless it is CRF alone."""
    if source == "both" and not all(has_break):
        return f" by CRF and damping, in the {'damping' if has_break[1] else 'CRF'} alone"
    return "" if source == "crf" else f" by {SOURCE_NAMES[source]}"


class IndicatorCourse(NamedTuple):
    """Course of one indicator by its stick, with the words for verdicts.

    `sign` is 1 where load transfers to asperities, -1 where it transfers back, 0 for no change.
    """

    sign: int
    flattens: bool  # rises, then rises more slowly or falls
    mean: str
    way: str
    words: str
    slopes: tuple[float, float]
    levels: tuple[float, float, float]


def describe_course(
    series: IndicatorSeries, comparison: ModelComparison, split: float, has_break: bool, axis: Axis
) -> IndicatorCourse:
    """Describe a series by its stick at the break `split`."""
    points = comparison.points
    fit = comparison.fits[STICK]
    nearest = int(np.argmin(np.abs(comparison.breaks - split)))
    base, before, change = fit.linear[nearest, int(np.argmax(fit.marginal[nearest]))]
    slopes = (float(before), float(before + change))
    lengths = (split - points.x[0], points.x[-1] - split)
    rise = slopes[0] * lengths[0] + slopes[1] * lengths[1]
    changes = (
        has_break or comparison.bic[CONSTANT] - min(comparison.bic.values()) >= STRONG_EVIDENCE
    )
    flattens = bool(slopes[0] > 0.0 and slopes[1] < slopes[0])
    sign = (1 if rise > 0.0 else -1) if changes else 0
    if series.indicator == "crf":
        per_x = (slopes[0] / axis.extent, slopes[1] / axis.extent)
        return _crf_course(points, sign, flattens, per_x, axis.unit)
    levels = (base, base + slopes[0] * lengths[0], base + rise)
    return _damping_course(points, sign, flattens, levels)


def _crf_course(
    points: SeriesPoints, sign: int, flattens: bool, slopes: tuple[float, float], unit: str
) -> IndicatorCourse:
    mean = float(np.mean(points.y))
    std = float(np.std(points.y, ddof=1))
    per = f"Hz per {unit}" if unit else "Hz per unit of x"
    before, after = (
        f"{'rises' if slope > 0.0 else 'falls'} by {abs(slope):.3g}" for slope in slopes
    )
    return IndicatorCourse(
        sign=sign,
        flattens=flattens,
        mean=f"CRF stays at {mean:.0f} ± {std:.0f} Hz",
        way=f"CRF {'rises' if sign > 0 else 'falls'}",
        words=f"CRF {before} {per} before the break and {after} after it"
        if sign
        else "CRF does not change",
        slopes=slopes,
        levels=(np.nan, np.nan, np.nan),
    )


def _damping_course(
    points: SeriesPoints, sign: int, flattens: bool, log_levels: tuple[float, float, float]
) -> IndicatorCourse:
    mean = float(np.mean(points.y))
    std = float(np.std(points.y, ddof=1))
    first, middle, last = (float(np.exp(-value)) for value in log_levels)
    trends = [
        "falls" if after < before else "rises" for before, after in pairwise((first, middle, last))
    ]
    then = "" if trends[0] == trends[1] else f"{trends[1]} "
    mean_ratio = with_deviation(float(np.exp(-mean)), std * float(np.exp(-mean)))
    return IndicatorCourse(
        sign=sign,
        flattens=flattens,
        mean=f"damping stays at {mean_ratio}",
        way=f"damping {'falls' if sign > 0 else 'rises'}",
        words=f"damping {trends[0]} from {first:.3g} to {middle:.3g} before the break and {then}to "
        f"{last:.3g} after it"
        if sign
        else "damping does not change",
        slopes=(np.nan, np.nan),
        levels=(first, middle, last),
    )
