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


class _Bics(NamedTuple):
    """BIC of all explanations: by the series that break, and by the names of unbroken models."""

    broken: dict[tuple[bool, ...], float]
    unbroken: dict[tuple[str, ...], float]

    @property
    def constant(self) -> float:
        """BIC of no change in any series."""
        return next(bic for names, bic in self.unbroken.items() if set(names) == {CONSTANT})

    @property
    def smooth(self) -> float:
        """BIC of the best change without a break."""
        return min(bic for names, bic in self.unbroken.items() if set(names) != {CONSTANT})


def _all_bics(comparisons: list[ModelComparison]) -> _Bics:
    unbroken_bics = [
        {name: value for name, value in comparison.bic.items() if name != STICK}
        for comparison in comparisons
    ]
    unbroken = {
        names: sum(bic[name] for bic, name in zip(unbroken_bics, names, strict=True))
        for names in product(*unbroken_bics)
    }
    patterns = product((True, False), repeat=len(comparisons))
    return _Bics(
        {
            pattern: _break_bic(comparisons, unbroken_bics, pattern)
            for pattern in patterns
            if any(pattern)
        },
        unbroken,
    )


def weigh_explanations(
    comparisons: list[ModelComparison], crfa: Field | None, x: Field, x_std: Field
) -> Outcome:
    """Weigh all explanations: a common break in some series, the best own model in the others."""
    bics = _all_bics(comparisons)
    breaks = comparisons[0].breaks
    best = min(bics.constant, bics.smooth, *bics.broken.values())
    broken = {pattern: value - best for pattern, value in bics.broken.items()}
    weights = {pattern: float(np.exp(-0.5 * value)) for pattern, value in broken.items()}
    unbroken = np.array([*bics.unbroken.values()]) - best
    unbroken_weight = float(np.sum(np.exp(-0.5 * unbroken)))
    log_bend = np.zeros(breaks.size) if crfa is None else sudden_bend(x, crfa, x_std, breaks)
    outcome = Outcome(
        comparisons=comparisons,
        density=_break_density(comparisons, weights, log_bend),
        has_break=min(broken, key=lambda pattern: broken[pattern]),
        break_probability=sum(weights.values()) / (sum(weights.values()) + unbroken_weight),
        evidence=_relative(comparisons[0].bic),
        broken=min(broken.values()),
        smooth=bics.smooth - best,
        constant=bics.constant - best,
        separate=np.inf,
    )
    if len(comparisons) > 1:
        outcome = _of_both_series(outcome, broken, best)
    return outcome


def _of_both_series(
    outcome: Outcome, broken: dict[tuple[bool, ...], float], best: float
) -> Outcome:
    """Return the outcome with the evidence for breaks in both series, together or apart."""
    separate = sum(comparison.bic[STICK] for comparison in outcome.comparisons) - best
    names = ("break in both", "break in the CRF alone", "break in the damping alone")
    evidence = dict(zip(names, broken.values(), strict=True)) | {
        "breaks apart": separate,
        "smooth curves": outcome.smooth,
        CONSTANT: outcome.constant,
    }
    return outcome._replace(evidence=_relative(evidence), separate=separate)


def _relative(bics: dict[str, float]) -> dict[str, float]:
    """Return the BIC of each model relative to the best."""
    best = min(bics.values())
    return {name: value - best for name, value in bics.items()}


def _break_density(
    comparisons: list[ModelComparison], weights: dict[tuple[bool, ...], float], log_bend: Field
) -> Field:
    """Return the posterior density of the common break, over weighted patterns of broken series."""
    density = np.zeros(log_bend.size)
    for pattern, weight in weights.items():
        log_break = log_bend + sum(
            log_sum(comparison.fits[STICK].marginal)
            for comparison, has_break in zip(comparisons, pattern, strict=True)
            if has_break
        )
        pattern_density = np.exp(log_break - np.max(log_break))
        density += weight * pattern_density / np.sum(pattern_density)
    return density / np.sum(density)


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
