"""Damped Fisher scoring: the one loop behind every likelihood fit, and the fit of one spectrum by it.

The Fisher information stands in for the curvature, with Marquardt's damping. Sources: Whittle
(1953); Levin, IEEE Trans. Inf. Theory 11 (1965).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from asperity.core.arrays import Field, Mask

State = TypeVar("State")
Model = Callable[
    [Field], tuple[Field, Field]
]  # parameters -> expected density (lines,), slopes (lines, parameters)

FIRST_DAMPING = 1e-3
MOST_STEPS = 200
LEAST_GAIN = 1e-8  # in units of ln likelihood, whatever the damping


def damped_scoring(
    start: State,
    propose: Callable[[State, Field], tuple[Mask, Callable[[Mask], State]] | None],
    *,
    steps: int,
    least: float,
    most: float,
    fits: int = 1,
) -> tuple[State, bool]:
    """Where scoring ends, and whether it settled there: no step promises anything, or none helps at `most` damping.

    Parameters
    ----------
    propose : from a state and dampings (fits,), which of the fits a step makes likelier, and the state with those
        steps taken; None where no step promises anything
    least, most : bounds of the damping: a fifth of it after a step that helped, four times as much after one that did
        not
    """
    state, damping = start, np.full(fits, FIRST_DAMPING)
    for _ in range(steps):
        proposal = propose(state, damping)
        if proposal is None:
            return state, True
        better, accept = proposal
        if np.any(better):
            state = accept(better)
        elif np.all(damping > most):
            return state, True
        damping = np.where(better, np.maximum(damping / 5.0, least), damping * 4.0)
    return state, False


@dataclass(frozen=True, slots=True)
class Data:
    """Ordinates (lines,) and how many independent ones each is worth."""

    density: Field
    weight: float


@dataclass(frozen=True, slots=True)
class Bounds:
    """Least and greatest of each parameter."""

    lower: Field
    upper: Field


@dataclass(frozen=True, slots=True)
class Fit:
    """Where the scoring ended: parameters, their standard deviations, -log likelihood (up to a constant), settled."""

    parameters: Field
    std: Field
    cost: float
    settled: bool


class _Point(NamedTuple):
    """Parameters with cost and score; the information of those that are free, and what damps it."""

    theta: Field
    cost: float
    score: Field
    free: Mask
    information: Field
    diagonal: Field


def fit_spectrum(model: Model, start: Field, bounds: Bounds, data: Data) -> Fit:
    """Minimise sum w (ln P + I/P) of exponential ordinates within bounds, F = sum w dP dPᵀ/P^2.

    A parameter that pushes against its bound rests there.
    """

    def point(theta: Field, expected: Field, slopes: Field, cost: float) -> _Point:
        relative = slopes / expected[:, None]
        score = data.weight * relative.T @ (data.density / expected - 1.0)
        information = data.weight * relative.T @ relative
        free = ~(
            ((theta <= bounds.lower) & (score <= 0.0)) | ((theta >= bounds.upper) & (score >= 0.0))
        )
        inner = information[np.ix_(free, free)]
        return _Point(
            theta, cost, score[free], free, inner, np.diag(inner) + 1e-12 * np.trace(inner)
        )

    def propose(at: _Point, damping: Field) -> tuple[Mask, Callable[[Mask], _Point]] | None:
        if np.sum(at.score**2 / at.diagonal) < LEAST_GAIN:
            return None
        step = np.zeros_like(at.theta)
        step[at.free] = np.linalg.solve(at.information + damping * np.diag(at.diagonal), at.score)
        trial = np.clip(at.theta + step, bounds.lower, bounds.upper)
        expected, slopes = model(trial)
        cost = whittle_cost(expected, data)
        return np.array([cost < at.cost]), lambda _: point(trial, expected, slopes, cost)

    first = np.clip(start, bounds.lower, bounds.upper)
    expected, slopes = model(first)
    at = point(first, expected, slopes, whittle_cost(expected, data))
    at, settled = damped_scoring(at, propose, steps=MOST_STEPS, least=1e-9, most=1e8)
    std = np.zeros_like(at.theta)
    std[at.free] = np.sqrt(np.abs(np.diag(np.linalg.pinv(at.information, hermitian=True))))
    return Fit(at.theta, std, at.cost, settled)


def whittle_cost(expected: Field, data: Data) -> float:
    """-ln likelihood of exponential ordinates, up to a constant."""
    if not np.all(expected > 0.0):
        return float("inf")
    return float(data.weight * np.sum(np.log(expected) + data.density / expected))
