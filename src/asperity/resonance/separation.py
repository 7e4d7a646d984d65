"""Joint separation of a series: the spectrum that all recordings share, and one line in each.

P_i(f) = g_i B(f) + A_i L(f; f_i, ζ_i) T(f)/T(f_i) is fitted to all spectra at once, B free in every
block of lines. docs/theory/indicators.md has the equations.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.likelihood_fit import Proposal, fisher_scoring
from asperity.resonance.line_fit import (
    LARGEST_STEP,
    MOST_STEPS,
    SMALLEST_GAIN,
    STEP_STDS,
    JointFit,
    fit_lines,
)
from asperity.resonance.spectrum_model import (
    JointScoringPoint,
    ModelParameters,
    SpectrumBlocks,
    joint_scoring_point,
    line_densities,
    parameter_bounds,
    recording_costs,
)
from asperity.resonance.template_search import (
    TemplateModel,
    Templates,
    best_of,
    coarser,
    line_templates,
    search,
)
from asperity.resonance.transfer import Transfer, differences, unit_transfer

MAX_RECORDINGS_TOGETHER = 100  # the shared spectrum of a longer series is fitted to so many
BASE_QUANTILES = (0.1, 0.3, 0.5)  # over the recordings, as initial guesses of the base
BASE_FLOOR = 0.1  # smallest initial base, relative to the weakest line over it
# change of ln(step_std) below which it has converged, and the maximum number of updates
SAME_STEP_STD, MOST_STEP_STD_UPDATES = 0.1, 8


class Separation(NamedTuple):
    """The joint fit, the templates, and -ln likelihoods of a line at each template.

    `template_costs` has shape (recordings, templates); `reference_rows` are the recordings that the
    shared spectrum was fitted to.
    """

    joint: JointFit
    templates: Templates
    template_costs: Field
    reference_rows: list[int]


def _best_lines(blocks: SpectrumBlocks, base: Field, templates: Templates) -> Field:
    """Return ln A, ln f, ln ζ, ln g of the best line of each recording, the base held."""
    return best_of(*search(blocks, base, templates), templates)


def fit_to_shared(
    blocks: SpectrumBlocks,
    base: Field,
    transfer: Transfer,
    transfer_covariance: Field,
    templates: Templates,
    prepared_models: Iterable[TemplateModel],
) -> tuple[JointFit, Field]:
    """Fit lines with the shared base (ln B) and transfer held; return fit and template costs."""
    coarse = coarser(blocks)
    cost, values = search(
        coarse, np.exp(np.interp(coarse.centre, blocks.centre, base)), templates, prepared_models
    )
    return fit_lines(
        blocks,
        ModelParameters(best_of(cost, values, templates), base, transfer),
        transfer_covariance,
    ), cost


def _fit_base(blocks: SpectrumBlocks, values: Field, base: Field) -> Field:
    """Return the base that fits given lines and gains best, by Fisher scoring in ln B per block."""
    line = line_densities(blocks.centre, ModelParameters(values, base))
    gain = np.exp(values[:, 3, None])
    log_base = np.log(base)
    for _ in range(12):
        part = gain * np.exp(log_base)
        expected = part + line
        relative = part / expected
        score = np.sum(blocks.weight * relative * (blocks.density / expected - 1.0), axis=0)
        information = np.sum(blocks.weight * relative**2, axis=0)
        step = score / np.maximum(information, 1e-9 * np.max(information))
        log_base = log_base + np.clip(step, -1.0, 1.0)
    return np.asarray(np.exp(log_base))


def _first_base(blocks: SpectrumBlocks, quantile: float) -> Field:
    """Return a quantile over the recordings, normalised by their levels."""
    middle = np.exp(np.mean(np.log(np.maximum(blocks.density, 1e-300)), axis=0))
    gain = np.median(blocks.density / middle, axis=1)
    return np.asarray(np.quantile(blocks.density / gain[:, None], quantile, axis=0))


def separate(blocks: SpectrumBlocks) -> Separation:
    """Fit the shared spectrum to all recordings (of a long series to some), then every line."""
    coarse = coarser(blocks)
    templates = line_templates(coarse.centre)
    recordings = blocks.density.shape[0]
    reference_rows = list(range(recordings))
    if recordings > MAX_RECORDINGS_TOGETHER:
        reference_rows = [
            round(row) for row in np.linspace(0.0, recordings - 1.0, MAX_RECORDINGS_TOGETHER)
        ]
    joint = _fit_shared(_rows(blocks, reference_rows), _rows(coarse, reference_rows), templates)
    if recordings > len(reference_rows):
        fitted = joint.parameters
        values = _best_lines(
            coarse, np.exp(np.interp(coarse.centre, blocks.centre, fitted.base)), templates
        )
        values[reference_rows] = fitted.own
        joint = fit_lines(blocks, fitted._replace(own=values), joint.transfer_covariance)._replace(
            step_std=joint.step_std
        )
    template_costs, _ = search(
        coarse, np.exp(np.interp(coarse.centre, blocks.centre, joint.parameters.base)), templates
    )
    return Separation(joint, templates, template_costs, reference_rows)


def _rows(blocks: SpectrumBlocks, reference_rows: list[int]) -> SpectrumBlocks:
    return SpectrumBlocks(
        blocks.centre, blocks.density[reference_rows], blocks.weight[reference_rows]
    )


def _fit_shared(blocks: SpectrumBlocks, coarse: SpectrumBlocks, templates: Templates) -> JointFit:
    """Return the most likely separation, started from coarse blocks."""
    best = _relocate_lines(coarse, _best_coarse_fit(coarse, templates), templates)
    base = np.exp(np.interp(blocks.centre, coarse.centre, best.parameters.base))
    base = _fit_base(blocks, best.parameters.own, base)
    low, high = parameter_bounds(blocks)
    transfer = unit_transfer(float(np.exp(low[1])), float(np.exp(high[1])))
    return _fit_with_evidence(
        blocks,
        _with_positive_base(blocks, ModelParameters(best.parameters.own, np.log(base), transfer)),
    )


def _best_coarse_fit(coarse: SpectrumBlocks, templates: Templates) -> JointFit:
    """Return the most likely fit from several initial guesses of the base."""
    fits = []
    for quantile in BASE_QUANTILES:
        base = _first_base(coarse, quantile)
        for _ in range(8):
            values = _best_lines(coarse, base, templates)
            base = _fit_base(coarse, values, base)
        fits.append(_fit_jointly(coarse, ModelParameters(values, np.log(base))))
    return min(fits, key=lambda joint: joint.cost)


def _relocate_lines(coarse: SpectrumBlocks, best: JointFit, templates: Templates) -> JointFit:
    """Move recordings in a local maximum to their best templates, while that improves the fit."""
    for _ in range(3):
        base = best.parameters.base
        values = _best_lines(coarse, np.exp(base), templates)
        relocated = np.abs(values[:, 1] - best.parameters.own[:, 1]) > 0.01
        if not np.any(relocated):
            break
        start = ModelParameters(np.where(relocated[:, None], values, best.parameters.own), base)
        joint = _fit_jointly(coarse, start)
        if joint.cost >= best.cost - 1e-3:
            break
        best = joint
    return best


def _with_positive_base(blocks: SpectrumBlocks, parameters: ModelParameters) -> ModelParameters:
    """Return the parameters with a base that is nowhere zero under a line.

    In its logarithm, no step would lead away from zero.
    """
    line = line_densities(blocks.centre, parameters)
    smallest = np.min(line / np.exp(parameters.own[:, 3, None]), axis=0)
    return parameters._replace(base=np.maximum(parameters.base, np.log(BASE_FLOOR * smallest)))


def _eliminate_base(point: JointScoringPoint, damping: Field | float) -> tuple[Field, Field, Field]:
    """Return the damped information without the base, that of the base, and their coupling.

    It covers the own parameters and the transfer. Levels of g and B are fixed against one another
    by Σ ln g = 0.
    """
    recordings, parameters, _ = point.own_information.shape
    base_information = point.base_information * (1.0 + damping)
    size = recordings * parameters
    coupling = np.concatenate([point.coupling.reshape(size, -1), point.transfer_coupling])
    reduced = -(coupling / base_information) @ coupling.T
    diagonal = np.einsum("npp->np", point.own_information)
    for i in range(recordings):
        rows = slice(i * parameters, (i + 1) * parameters)
        reduced[rows, rows] += point.own_information[i] + damping * np.diag(diagonal[i])
    gauge = np.tile([0.0, 0.0, 0.0, 1.0], recordings)
    reduced[:size, :size] += float(np.mean(diagonal[:, 3])) * np.outer(gauge, gauge) / recordings
    own_transfer = point.transfer_own.reshape(size, -1)
    reduced[:size, size:] += own_transfer
    reduced[size:, :size] += own_transfer.T
    reduced[size:, size:] += point.transfer_information + damping * np.diag(
        np.diag(point.transfer_information)
    )
    return reduced, base_information, coupling


class _ScoringPoint(NamedTuple):
    parameters: ModelParameters
    joint: JointScoringPoint


@dataclass(frozen=True, slots=True)
class _Likelihood:
    """Likelihood of all parameters, with the prior information of the transfer."""

    blocks: SpectrumBlocks
    prior_information: Field
    lower: Field
    upper: Field

    def scoring_point(self, parameters: ModelParameters) -> _ScoringPoint:
        """Return cost, score and information at some parameters."""
        return _ScoringPoint(
            parameters, joint_scoring_point(self.blocks, parameters, self.prior_information)
        )

    def cost(self, parameters: ModelParameters) -> float:
        """Return -ln likelihood, priors included."""
        coefficients = parameters.transfer.coefficients
        transfer_cost = 0.5 * float(coefficients @ self.prior_information @ coefficients)
        return float(np.sum(recording_costs(self.blocks, parameters)) + transfer_cost)

    def limited_step(
        self, parameters: ModelParameters, step: Field, base_step: Field
    ) -> ModelParameters:
        """Return the parameters after a step of own and transfer parameters and of the base."""
        size = parameters.own.size
        transfer = parameters.transfer
        own_step = step[:size].reshape(parameters.own.shape)
        limited = np.clip(own_step, -LARGEST_STEP, LARGEST_STEP)
        coefficients = transfer.coefficients + np.clip(step[size:], -1.0, 1.0)
        return ModelParameters(
            np.clip(parameters.own + limited, self.lower, self.upper),
            parameters.base + np.clip(base_step, -2.0, 2.0),
            transfer._replace(coefficients=coefficients),
        )

    def propose(self, state: _ScoringPoint, damping: Field) -> Proposal[_ScoringPoint]:
        """Return the damped step; the base, whose blocks are uncoupled, is eliminated."""
        point = state.joint
        reduced, base_information, coupling = _eliminate_base(point, damping)
        score = np.concatenate([point.own_score.ravel(), point.transfer_score])
        step = np.linalg.solve(reduced, score - coupling @ (point.base_score / base_information))
        base_step = (point.base_score - coupling.T @ step) / base_information
        predicted = 0.5 * float(step @ score + base_step @ point.base_score)
        if predicted < SMALLEST_GAIN:
            return None
        trial = self.limited_step(state.parameters, step, base_step)
        return np.array([self.cost(trial) < point.cost]), lambda _: self.scoring_point(trial)


def _fit_jointly(
    blocks: SpectrumBlocks, start: ModelParameters, step_std: float = STEP_STDS[0]
) -> JointFit:
    """Fit all parameters by damped scoring."""
    likelihood = _Likelihood(blocks, start.transfer.stiffness(step_std), *parameter_bounds(blocks))
    start = start._replace(own=np.clip(start.own, likelihood.lower, likelihood.upper))
    (parameters, point), _ = fisher_scoring(
        likelihood.scoring_point(start),
        likelihood.propose,
        steps=MOST_STEPS,
        least_damping=1e-7,
        most_damping=1e6,
    )
    covariance = np.linalg.inv(_eliminate_base(point, 0.0)[0])
    size = parameters.own.size
    std = np.sqrt(np.diag(covariance)[:size]).reshape(parameters.own.shape)
    return JointFit(parameters, point.cost, std, covariance[size:, size:], step_std)


def _fit_with_evidence(blocks: SpectrumBlocks, start: ModelParameters) -> JointFit:
    """Fit with the most likely `step_std` of the transfer (MacKay's evidence approximation)."""
    step_std, smallest = STEP_STDS
    joint = _fit_jointly(blocks, start, step_std)
    for _ in range(MOST_STEP_STD_UPDATES):
        difference = differences(joint.transfer_covariance.shape[0] - 1)
        increments = difference @ joint.parameters.transfer.coefficients[1:]
        effective = (
            increments.size
            - float(np.trace(difference @ joint.transfer_covariance[1:, 1:] @ difference.T))
            / step_std**2
        )
        updated = max(float(np.sqrt(increments @ increments / max(effective, 1e-3))), smallest)
        if abs(np.log(updated / step_std)) < SAME_STEP_STD:
            break
        step_std = updated
        joint = _fit_jointly(blocks, joint.parameters, step_std)
    return joint
