"""Fit of the lines of recordings, on one sensor or several, with base and transfer held."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.likelihood_fit import Proposal, fisher_scoring
from asperity.resonance.spectrum_model import (
    PRIOR_DAMPING,
    PRIOR_DAMPING_STD,
    LineScoringPoint,
    ModelParameters,
    SpectrumBlocks,
    line_scoring_point,
    parameter_bounds,
    recording_costs,
)

LARGEST_STEP = np.array([1.0, 0.03, 0.5, 1.0])  # of ln A, ln f, ln ζ, ln g
MOST_STEPS = 60
SMALLEST_GAIN = 1e-3  # expected gain of ln likelihood below which the fit has converged
STEP_STDS = (0.3, 1e-4)  # between splines of the transfer: initial and smallest


class JointFit(NamedTuple):
    """Result of the joint fit: parameters, -ln likelihood, standard deviations of own parameters.

    `transfer_covariance` is the covariance of the transfer's coefficients, `step_std` the prior
    standard deviation of their differences.
    """

    parameters: ModelParameters
    cost: float
    std: Field  # (recordings, 4)
    transfer_covariance: Field
    step_std: float = STEP_STDS[0]


class SensorData(NamedTuple):
    """Spectra of one sensor, the initial parameters, and the covariance of its transfer."""

    blocks: SpectrumBlocks
    parameters: ModelParameters
    transfer_covariance: Field


class CommonLines(NamedTuple):
    """Fitted lines, each with one frequency and damping on all sensors.

    `own` (sensors, recordings, 4) is as in `ModelParameters`; `inverse` (recordings, n, n) is the
    inverse information of a recording's parameters, those of a sensor at `parameter_indices`;
    `cost` (recordings,); by sensor `points`, and `transfer_effect` (recordings, n, coefficients),
    the derivative of the parameters by the coefficients of its transfer.
    """

    own: Field
    cost: Field
    inverse: Field
    points: list[LineScoringPoint]
    transfer_effect: list[Field]


def parameter_indices(sensor: int) -> list[int]:
    """Return the indices of ln A, ln f, ln ζ, ln g of a sensor; f and ζ are common to all."""
    return [0, 1, 2, 3] if sensor == 0 else [2 + 2 * sensor, 1, 2, 3 + 2 * sensor]


class _ScoringPoint(NamedTuple):
    """Own parameters of all sensors, with the score and information of each recording."""

    own: Field  # (sensors, recordings, 4)
    cost: Field  # (recordings,)
    by_sensor: list[LineScoringPoint]
    score: Field  # (recordings, n)
    information: Field  # (recordings, n, n)


@dataclass(frozen=True, slots=True)
class _Likelihood:
    """Likelihood of lines common to all sensors, bases and transfers held."""

    sensors: Sequence[SensorData]
    lower: Field
    upper: Field

    @property
    def size(self) -> int:
        """Number of parameters of a recording."""
        return 2 + 2 * len(self.sensors)

    @property
    def repeated_prior(self) -> float:
        """Information of the damping's prior beyond the one that counts."""
        return float((len(self.sensors) - 1.0) * PRIOR_DAMPING_STD**-2)

    def costs(self, own: Field) -> Field:
        """Return -ln likelihood of each recording."""
        costs = [
            recording_costs(data.blocks, data.parameters._replace(own=own_values))
            for data, own_values in zip(self.sensors, own, strict=True)
        ]
        return np.asarray(
            np.sum(costs, axis=0)
            - 0.5 * self.repeated_prior * (own[0, :, 2] - np.log(PRIOR_DAMPING)) ** 2
        )

    def scoring_point(self, own: Field, cost: Field) -> _ScoringPoint:
        """Return score and information, summed over the sensors."""
        points = [
            line_scoring_point(data.blocks, data.parameters._replace(own=own_values))
            for data, own_values in zip(self.sensors, own, strict=True)
        ]
        score = np.zeros((own.shape[1], self.size))
        information = np.zeros((own.shape[1], self.size, self.size))
        for sensor, point in enumerate(points):
            indices = np.array(parameter_indices(sensor))
            score[:, indices] += point.score
            information[:, indices[:, None], indices] += point.information
        score[:, 2] += self.repeated_prior * (own[0, :, 2] - np.log(PRIOR_DAMPING))
        information[:, 2, 2] -= self.repeated_prior
        return _ScoringPoint(own, cost, points, score, information)

    def propose(self, point: _ScoringPoint, damping: Field) -> Proposal[_ScoringPoint]:
        """Return the damped steps of all recordings."""
        diagonal = np.einsum("npp->np", point.information)
        damped = point.information + (damping[:, None] * diagonal)[:, :, None] * np.eye(self.size)
        step = np.linalg.solve(damped, point.score[..., None])[..., 0]
        if np.max(np.sum(step * point.score, axis=1)) < 2.0 * SMALLEST_GAIN:
            return None
        by_sensor = np.stack(
            [step[:, parameter_indices(sensor)] for sensor in range(len(self.sensors))]
        )
        limited = np.clip(by_sensor, -LARGEST_STEP, LARGEST_STEP)
        trial = np.clip(point.own + limited, self.lower, self.upper)
        trial_cost = self.costs(trial)
        return trial_cost < point.cost, lambda better: self.scoring_point(
            np.where(better[:, None], trial, point.own), np.where(better, trial_cost, point.cost)
        )


def fit_common_lines(sensors: Sequence[SensorData]) -> CommonLines:
    """Fit every recording's own parameters by damped scoring, bases and transfers held."""
    likelihood = _Likelihood(sensors, *parameter_bounds(sensors[0].blocks))
    start = np.stack(
        [np.clip(data.parameters.own, likelihood.lower, likelihood.upper) for data in sensors]
    )
    fitted, _ = fisher_scoring(
        likelihood.scoring_point(start, likelihood.costs(start)),
        likelihood.propose,
        steps=MOST_STEPS,
        least_damping=1e-7,
        most_damping=1e6,
        fits=start.shape[1],
    )
    inverse = np.linalg.inv(fitted.information)
    transfer_effect: list[Field] = [
        inverse[:, :, parameter_indices(sensor)]
        @ point.transfer_coupling(data.blocks.centre, data.parameters._replace(own=own_values))
        for sensor, (point, data, own_values) in enumerate(
            zip(fitted.by_sensor, sensors, fitted.own, strict=True)
        )
    ]
    return CommonLines(fitted.own, fitted.cost, inverse, fitted.by_sensor, transfer_effect)


def fit_lines(
    blocks: SpectrumBlocks, start: ModelParameters, transfer_covariance: Field
) -> JointFit:
    """Fit the lines of one sensor, base and transfer held."""
    fitted = fit_common_lines([SensorData(blocks, start, transfer_covariance)])
    (transfer_effect,) = fitted.transfer_effect
    variance = np.einsum("npp->np", fitted.inverse) + np.sum(
        transfer_effect @ transfer_covariance * transfer_effect, axis=2
    )
    return JointFit(
        start._replace(own=fitted.own[0]),
        float(np.sum(fitted.cost)),
        np.sqrt(variance),
        transfer_covariance,
    )
