"""Fit of the lines of recordings, on one sensor or several, with base and transfer held."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.resonance.likelihood_fit import fisher_scoring
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


def fit_common_lines(sensors: Sequence[SensorData]) -> CommonLines:
    """Fit every recording's own parameters by damped scoring, bases and transfers held."""
    lower, upper = parameter_bounds(sensors[0].blocks)
    count, size = len(sensors), 2 + 2 * len(sensors)
    double_counted_prior = (count - 1.0) * PRIOR_DAMPING_STD**-2  # the prior counts once

    def cost_at(own: Field) -> Field:
        costs = [
            recording_costs(data.blocks, data.parameters._replace(own=own_values))
            for data, own_values in zip(sensors, own, strict=True)
        ]
        return np.asarray(
            np.sum(costs, axis=0)
            - 0.5 * double_counted_prior * (own[0, :, 2] - np.log(PRIOR_DAMPING)) ** 2
        )

    def evaluate(
        own: Field, cost: Field
    ) -> tuple[Field, Field, list[LineScoringPoint], Field, Field]:
        points = [
            line_scoring_point(data.blocks, data.parameters._replace(own=own_values))
            for data, own_values in zip(sensors, own, strict=True)
        ]
        score, information = np.zeros((own.shape[1], size)), np.zeros((own.shape[1], size, size))
        for sensor, point in enumerate(points):
            indices = np.array(parameter_indices(sensor))
            score[:, indices] += point.score
            information[:, indices[:, None], indices] += point.information
        score[:, 2] += double_counted_prior * (own[0, :, 2] - np.log(PRIOR_DAMPING))
        information[:, 2, 2] -= double_counted_prior
        return own, cost, points, score, information

    def propose(
        state: tuple[Field, Field, list[LineScoringPoint], Field, Field], damping: Field
    ) -> (
        tuple[Mask, Callable[[Mask], tuple[Field, Field, list[LineScoringPoint], Field, Field]]]
        | None
    ):
        own, cost, _, score, information = state
        diagonal = np.einsum("npp->np", information)
        damped = information + (damping[:, None] * diagonal)[:, :, None] * np.eye(size)
        step = np.linalg.solve(damped, score[..., None])[..., 0]
        if np.max(np.sum(step * score, axis=1)) < 2.0 * SMALLEST_GAIN:
            return None
        by_sensor = np.stack([step[:, parameter_indices(sensor)] for sensor in range(count)])
        trial = np.clip(own + np.clip(by_sensor, -LARGEST_STEP, LARGEST_STEP), lower, upper)
        trial_cost = cost_at(trial)
        return trial_cost < cost, lambda better: evaluate(
            np.where(better[:, None], trial, own), np.where(better, trial_cost, cost)
        )

    own = np.stack([np.clip(data.parameters.own, lower, upper) for data in sensors])
    state = evaluate(own, cost_at(own))
    state, _ = fisher_scoring(
        state, propose, steps=MOST_STEPS, least_damping=1e-7, most_damping=1e6, fits=own.shape[1]
    )
    own, cost, points, _, information = state
    inverse = np.linalg.inv(information)
    transfer_effect: list[Field] = [
        inverse[:, :, parameter_indices(sensor)]
        @ point.transfer_coupling(data.blocks.centre, data.parameters._replace(own=own_values))
        for sensor, (point, data, own_values) in enumerate(zip(points, sensors, own, strict=True))
    ]
    return CommonLines(own, cost, inverse, points, transfer_effect)


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
