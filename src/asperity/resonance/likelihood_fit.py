"""Damped Fisher scoring, used by every likelihood fit, and the fit of a single spectrum.

The Fisher information replaces the Hessian, with Marquardt's damping. Sources: Whittle (1953);
Levin, IEEE Trans. Inf. Theory 11 (1965).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from asperity.core.arrays import Field, Mask

State = TypeVar("State")
# fits that a step improves, and the state with those steps taken; None: no step promises a gain
Proposal = tuple[Mask, Callable[[Mask], State]] | None
# parameters -> expected density (lines,), slopes (lines, parameters)
DensityModel = Callable[[Field], tuple[Field, Field]]

FIRST_DAMPING = 1e-3
MOST_STEPS = 200
SMALLEST_GAIN = 1e-8  # expected gain of ln likelihood below which the fit has converged


def fisher_scoring(
    start: State,
    propose: Callable[[State, Field], Proposal[State]],
    *,
    steps: int,
    least_damping: float,
    most_damping: float,
    fits: int = 1,
) -> tuple[State, bool]:
    """Iterate damped scoring steps; return the final state and whether it converged.

    It has converged when no step promises a gain, or none helps at the largest damping.

    Parameters
    ----------
    propose : from a state and dampings (fits,), the proposed step
    steps : maximum number of steps
    least_damping, most_damping : bounds of the damping, which is divided by 5 after a successful
        step and multiplied by 4 after a rejected one
    fits : number of independent fits
    """
    state = start
    damping = np.full(fits, FIRST_DAMPING)
    for _ in range(steps):
        proposal = propose(state, damping)
        if proposal is None:
            return state, True
        better, accept = proposal
        if np.any(better):
            state = accept(better)
        elif np.all(damping > most_damping):
            return state, True
        damping = np.where(better, np.maximum(damping / 5.0, least_damping), damping * 4.0)
    return state, False


@dataclass(frozen=True, slots=True)
class Data:
    """Periodogram ordinates (lines,), and the number of independent ones that each stands for."""

    density: Field
    weight: float


@dataclass(frozen=True, slots=True)
class ParameterBounds:
    """Lower and upper bounds of the parameters."""

    lower: Field
    upper: Field


@dataclass(frozen=True, slots=True)
class SpectrumFit:
    """Fitted parameters, their standard deviations, and -ln likelihood up to a constant."""

    parameters: Field
    std: Field
    cost: float
    converged: bool


class _ScoringPoint(NamedTuple):
    """Parameters with cost and score; information and damping diagonal of the free parameters."""

    theta: Field
    cost: float
    score: Field
    free: Mask
    information: Field
    diagonal: Field


@dataclass(frozen=True, slots=True)
class _Likelihood:
    """Likelihood of exponential ordinates by the parameters of a model, within bounds."""

    model: DensityModel
    bounds: ParameterBounds
    data: Data

    def scoring_point(
        self, theta: Field, expected: Field, slopes: Field, cost: float
    ) -> _ScoringPoint:
        """Return score and information; a parameter whose score points beyond its bound is held."""
        relative = slopes / expected[:, None]
        score = self.data.weight * relative.T @ (self.data.density / expected - 1.0)
        information = self.data.weight * relative.T @ relative
        free = ~(
            ((theta <= self.bounds.lower) & (score <= 0.0))
            | ((theta >= self.bounds.upper) & (score >= 0.0))
        )
        inner = information[np.ix_(free, free)]
        return _ScoringPoint(
            theta, cost, score[free], free, inner, np.diag(inner) + 1e-12 * np.trace(inner)
        )

    def propose(self, current: _ScoringPoint, damping: Field) -> Proposal[_ScoringPoint]:
        """Return the damped step from a scoring point."""
        if np.sum(current.score**2 / current.diagonal) < SMALLEST_GAIN:
            return None
        step = np.zeros_like(current.theta)
        step[current.free] = np.linalg.solve(
            current.information + damping * np.diag(current.diagonal), current.score
        )
        trial = np.clip(current.theta + step, self.bounds.lower, self.bounds.upper)
        expected, slopes = self.model(trial)
        cost = whittle_cost(expected, self.data)
        return np.array([cost < current.cost]), lambda _: self.scoring_point(
            trial, expected, slopes, cost
        )


def fit_spectrum(
    model: DensityModel, start: Field, bounds: ParameterBounds, data: Data
) -> SpectrumFit:
    """Minimise sum w (ln P + I/P) of exponential ordinates within bounds, F = sum w dP dPᵀ/P^2."""
    likelihood = _Likelihood(model, bounds, data)
    first = np.clip(start, bounds.lower, bounds.upper)
    expected, slopes = model(first)
    current, converged = fisher_scoring(
        likelihood.scoring_point(first, expected, slopes, whittle_cost(expected, data)),
        likelihood.propose,
        steps=MOST_STEPS,
        least_damping=1e-9,
        most_damping=1e8,
    )
    std = np.zeros_like(current.theta)
    std[current.free] = np.sqrt(
        np.abs(np.diag(np.linalg.pinv(current.information, hermitian=True)))
    )
    return SpectrumFit(current.theta, std, current.cost, converged)


def whittle_cost(expected: Field, data: Data) -> float:
    """Return -ln likelihood of exponential ordinates, up to a constant."""
    if not np.all(expected > 0.0):
        return float("inf")
    return float(data.weight * np.sum(np.log(expected) + data.density / expected))
