"""Posterior of a common break in one or two indicator series, weighed against unbroken models."""

from itertools import product
from typing import Literal, NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.trend.change_points import CONSTANT, STICK, ModelComparison, log_sum, sudden_bend

Indicator = Literal["crf", "damping"]


class IndicatorSeries(NamedTuple):
    """Indicator (recordings,) that rises as load transfers to asperities; nan where not known."""

    indicator: Indicator
    values: Field
    std: Field


class Outcome(NamedTuple):
    """Comparison of all explanations of the series, and the posterior of the break.

    `broken`, `smooth`, `constant` and `separate` are the BIC, relative to the best, of models with
    a common break, without a break, without a change, and with a separate break in each series
    (infinite for a single one).
    """

    comparisons: list[ModelComparison]
    density: Field  # of the break, (breaks,)
    has_break: tuple[bool, ...]  # which series break, in the best model with a break
    break_probability: float
    evidence: dict[str, float]
    broken: float
    smooth: float
    constant: float
    separate: float


def weigh_explanations(
    comparisons: list[ModelComparison], crfa: Field | None, x: Field, x_std: Field
) -> Outcome:
    """Weigh all explanations: a common break in some series, the best own model in the others."""
    breaks, count = comparisons[0].breaks, len(comparisons)
    unbroken_bics = [
        {name: value for name, value in comparison.bic.items() if name != STICK}
        for comparison in comparisons
    ]
    unbroken = {
        names: sum(bic[name] for bic, name in zip(unbroken_bics, names, strict=True))
        for names in product(*unbroken_bics)
    }
    patterns = [pattern for pattern in product((True, False), repeat=count) if any(pattern)]
    broken = {pattern: _break_bic(comparisons, unbroken_bics, pattern) for pattern in patterns}
    constant = unbroken[(CONSTANT,) * count]
    smooth = min(bic for names, bic in unbroken.items() if set(names) != {CONSTANT})
    best = min(constant, smooth, *broken.values())
    weights = {pattern: float(np.exp(-0.5 * (value - best))) for pattern, value in broken.items()}
    unbroken_weight = float(np.sum(np.exp(-0.5 * (np.array([*unbroken.values()]) - best))))
    log_bend = np.zeros(breaks.size) if crfa is None else sudden_bend(x, crfa, x_std, breaks)
    density = np.zeros(breaks.size)
    for pattern, weight in weights.items():
        log_break = log_bend + sum(
            log_sum(comparison.fits[STICK].marginal)
            for comparison, has_break in zip(comparisons, pattern, strict=True)
            if has_break
        )
        own = np.exp(log_break - np.max(log_break))
        density += weight * own / np.sum(own)
    separate = np.inf
    evidence = {name: value - best for name, value in comparisons[0].bic.items()}
    if count > 1:
        named = zip(
            ("break in both", "break in the CRF alone", "break in the damping alone"),
            patterns,
            strict=True,
        )
        evidence = {name: broken[pattern] - best for name, pattern in named}
        separate = sum(comparison.bic[STICK] for comparison in comparisons) - best
        evidence |= {
            "breaks apart": separate,
            "smooth curves": smooth - best,
            CONSTANT: constant - best,
        }
    return Outcome(
        comparisons=comparisons,
        density=density / np.sum(density),
        has_break=min(patterns, key=lambda pattern: broken[pattern]),
        break_probability=sum(weights.values()) / (sum(weights.values()) + unbroken_weight),
        evidence={name: value - min(evidence.values()) for name, value in evidence.items()},
        broken=min(broken.values()) - best,
        smooth=smooth - best,
        constant=constant - best,
        separate=separate,
    )


def _break_bic(
    comparisons: list[ModelComparison],
    unbroken_bics: list[dict[str, float]],
    pattern: tuple[bool, ...],
) -> float:
    """Return the BIC of a common break in the series of `pattern`, the others unbroken."""
    if not all(pattern):
        return sum(
            comparison.bic[STICK] if has_break else min(bic.values())
            for comparison, bic, has_break in zip(comparisons, unbroken_bics, pattern, strict=True)
        )
    penalties = sum(
        comparison.bic[STICK] + 2.0 * float(np.max(comparison.fits[STICK].best))
        for comparison in comparisons
    )
    # the break is one parameter, not one per series
    saved = (len(comparisons) - 1) * float(
        np.log(max(comparison.points.x.size for comparison in comparisons))
    )
    log_likelihood = sum(comparison.fits[STICK].best for comparison in comparisons)
    return penalties - saved - 2.0 * float(np.max(log_likelihood))


def own_break(comparison: ModelComparison) -> float:
    """Return the most likely break of one series alone."""
    return float(comparison.breaks[int(np.argmax(comparison.fits[STICK].best))])
