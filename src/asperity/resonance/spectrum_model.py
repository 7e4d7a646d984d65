"""Model of the spectra of a series: a base shared by all recordings, and one line in each.

P_i(f) = g_i B(f) + A_i L(f; f_i, ζ_i) T(f)/T(f_i), with its -ln likelihood, score and information.
`separation` fits it; docs/theory/indicators.md has the equations.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.resonance import line_and_slopes, line_shape
from asperity.resonance.transfer import Transfer

# prior of the damping ratio: its median, and the standard deviation of its logarithm
PRIOR_DAMPING, PRIOR_DAMPING_STD = 0.02, 1.0
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.3
# prior information of every parameter, so that a line of zero height has a defined location
WEAK_INFORMATION = 1e-4


class SpectrumBlocks(NamedTuple):
    """Spectra averaged over blocks of lines: density and number of independent ordinates.

    Both have shape (recordings, blocks).
    """

    centre: Field  # (blocks,)
    density: Field
    weight: Field


class ModelParameters(NamedTuple):
    """Parameters of the model: own, base and transfer.

    `own` holds ln A_i, ln f_i, ln ζ_i, ln g_i of each recording, (recordings, 4); `base` is ln B,
    (blocks,); `transfer` the path from contact to sensor.
    """

    own: Field
    base: Field
    transfer: Transfer = Transfer()


def line_densities_and_slopes(
    centre: Field, parameters: ModelParameters
) -> tuple[Field, Field, Field]:
    """Return A L T(f)/T(f_i) and its derivatives by ln f_i and ln ζ_i, (recordings, blocks)."""
    f0, damping = (np.exp(parameters.own[:, column, None]) for column in (1, 2))
    line, by_f0, by_damping = line_and_slopes(centre[None, :], f0, damping)
    amplitude = _amplitudes(centre, parameters)
    steepness = parameters.transfer.steepness(f0[:, 0])[:, None]
    return amplitude * line, amplitude * (by_f0 - steepness * line), amplitude * by_damping


def line_densities(centre: Field, parameters: ModelParameters) -> Field:
    """Return A L T(f)/T(f_i), (recordings, blocks)."""
    f0, damping = (np.exp(parameters.own[:, column, None]) for column in (1, 2))
    return np.asarray(_amplitudes(centre, parameters) * line_shape(centre[None, :], f0, damping))


def _amplitudes(centre: Field, parameters: ModelParameters) -> Field:
    """Return A T(f)/T(f_i), (recordings, blocks)."""
    transfer = parameters.transfer
    reference = transfer.columns(np.exp(parameters.own[:, 1])) @ transfer.coefficients
    return np.asarray(
        np.exp(
            parameters.own[:, 0, None]
            + transfer.columns(centre) @ transfer.coefficients
            - reference[:, None]
        )
    )


def relative_columns(centre: Field, parameters: ModelParameters) -> Field:
    """Return the transfer's columns less those at the lines, (recordings, blocks, coefficients)."""
    reference = parameters.transfer.columns(np.exp(parameters.own[:, 1]))
    return np.asarray(parameters.transfer.columns(centre)[None] - reference[:, None])


class JointScoringPoint(NamedTuple):
    """Cost, score and information at one scoring step, by own, base and transfer parameters."""

    cost: float
    own_score: Field  # (recordings, 4)
    own_information: Field  # (recordings, 4, 4)
    base_score: Field  # (blocks,)
    base_information: Field  # (blocks,)
    coupling: Field  # (recordings, 4, blocks)
    transfer_score: Field  # (coefficients,)
    transfer_information: Field  # (coefficients, coefficients)
    transfer_own: Field  # (recordings, 4, coefficients)
    transfer_coupling: Field  # (coefficients, blocks)


def expected_density(blocks: SpectrumBlocks, parameters: ModelParameters) -> Field:
    """Return the expected density of each block, (recordings, blocks)."""
    return np.asarray(
        line_densities(blocks.centre, parameters)
        + np.exp(parameters.own[:, 3, None] + parameters.base)
    )


def whittle_costs(blocks: SpectrumBlocks, expected: Field) -> Field:
    """Return -ln likelihood of each recording."""
    return np.asarray(
        np.sum(blocks.weight * (np.log(expected) + blocks.density / expected), axis=1)
    )


def recording_costs(blocks: SpectrumBlocks, parameters: ModelParameters) -> Field:
    """Return -ln likelihood of each recording, priors included."""
    return np.asarray(
        whittle_costs(blocks, expected_density(blocks, parameters)) + _prior(parameters.own)
    )


def _prior(values: Field) -> Field:
    return np.asarray(0.5 * ((values[:, 2] - np.log(PRIOR_DAMPING)) / PRIOR_DAMPING_STD) ** 2)


def model_shares(blocks: SpectrumBlocks, parameters: ModelParameters) -> tuple[Field, Field]:
    """Return relative derivatives (recordings, 4, blocks), and the expected density.

    They are those of the expected density by ln A, ln f, ln ζ and ln g, over the density itself.
    """
    line, by_f0, by_damping = line_densities_and_slopes(blocks.centre, parameters)
    shared = np.exp(parameters.own[:, 3, None] + parameters.base)
    expected = line + shared
    return np.stack([line, by_f0, by_damping, shared], axis=1) / expected[:, None], expected


class LineScoringPoint(NamedTuple):
    """Score and Fisher information of each recording's parameters; base and transfer held."""

    score: Field  # (recordings, 4)
    information: Field  # (recordings, 4, 4)
    # (recordings, 4, blocks): relative derivatives times the number of independent ordinates
    weighted: Field
    line: Field  # (recordings, blocks): the line's share

    def transfer_coupling(self, centre: Field, parameters: ModelParameters) -> Field:
        """Return the information shared with the transfer, (recordings, 4, coefficients)."""
        sensitivity = self.weighted * self.line[:, None]
        reference = parameters.transfer.columns(np.exp(parameters.own[:, 1]))
        return np.asarray(
            sensitivity @ parameters.transfer.columns(centre)
            - np.sum(sensitivity, axis=2)[..., None] * reference[:, None]
        )


def line_scoring_point(blocks: SpectrumBlocks, parameters: ModelParameters) -> LineScoringPoint:
    """Return score and Fisher information of each recording's parameters."""
    return _line_scoring(blocks, parameters, *model_shares(blocks, parameters))[0]


def _line_scoring(
    blocks: SpectrumBlocks, parameters: ModelParameters, relative: Field, expected: Field
) -> tuple[LineScoringPoint, Field]:
    """Return score and Fisher information of each recording, and the weighted residual."""
    weighted_residual = blocks.weight * (blocks.density / expected - 1.0)
    weighted = relative * blocks.weight[:, None]
    score = np.einsum("npb,nb->np", relative, weighted_residual)
    score[:, 2] -= (parameters.own[:, 2] - np.log(PRIOR_DAMPING)) / PRIOR_DAMPING_STD**2
    information = weighted @ relative.swapaxes(1, 2) + WEAK_INFORMATION * np.eye(4)
    information[:, 2, 2] += PRIOR_DAMPING_STD**-2
    return LineScoringPoint(score, information, weighted, relative[:, 0]), weighted_residual


def joint_scoring_point(
    blocks: SpectrumBlocks, parameters: ModelParameters, prior_information: Field
) -> JointScoringPoint:
    """Return cost, score and information; `prior_information` is that of the transfer."""
    relative, expected = model_shares(blocks, parameters)
    line_scoring, weighted_residual = _line_scoring(blocks, parameters, relative, expected)
    weighted = line_scoring.weighted
    shared_part = relative[:, 3]
    transfer_columns = relative[:, 0, :, None] * relative_columns(blocks.centre, parameters)
    coefficients = parameters.transfer.coefficients
    columns = transfer_columns.reshape(blocks.weight.size, coefficients.size)
    weights = blocks.weight.reshape(-1, 1)
    likelihood_cost = float(
        np.sum(blocks.weight * (np.log(expected) + blocks.density / expected))
        + np.sum(_prior(parameters.own))
    )
    return JointScoringPoint(
        cost=likelihood_cost + 0.5 * float(coefficients @ prior_information @ coefficients),
        own_score=line_scoring.score,
        own_information=line_scoring.information,
        base_score=np.sum(shared_part * weighted_residual, axis=0),
        base_information=np.sum(blocks.weight * shared_part**2, axis=0) + WEAK_INFORMATION,
        coupling=weighted * shared_part[:, None],
        transfer_score=weighted_residual.ravel() @ columns - prior_information @ coefficients,
        transfer_information=columns.T @ (weights * columns) + prior_information,
        transfer_own=np.matmul(weighted, transfer_columns),
        transfer_coupling=np.einsum(
            "nb,nbc->cb", blocks.weight * shared_part, transfer_columns, optimize=True
        ),
    )


def parameter_bounds(blocks: SpectrumBlocks) -> tuple[Field, Field]:
    """Return lower and upper bounds of ln A, ln f, ln ζ, ln g."""
    low = np.log(0.97 * blocks.centre[0])
    high = np.log(1.03 * blocks.centre[-1])
    return np.array([-60.0, low, np.log(LEAST_DAMPING), -60.0]), np.array(
        [60.0, high, np.log(MOST_DAMPING), 60.0]
    )
