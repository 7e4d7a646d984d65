"""Residuals of the joint fit, and the systematic errors of line parameters that follow from them.

A machine does not repeat itself exactly, and splines do not follow its structure exactly.
docs/theory/indicators.md has the equations.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.resonance.line_fit import JointFit
from asperity.resonance.spectrum_model import WEAK_INFORMATION, SpectrumBlocks, model_shares

SHARED_FROM = 0.1  # share of the shared spectrum in a block above which its residual is used
COVERAGE_REQUIRED = 0.8  # of a parameter's influence, by a recording's usable blocks
TINY = 1e-100


class ResidualStatistics(NamedTuple):
    """Deviations of recordings from the shared spectrum, (recordings, blocks) each.

    `model_error` (blocks,) is the squared relative residual beyond chance, averaged over the
    recordings with weights by the power of their lines.
    """

    counted: Mask  # where the shared spectrum dominates
    relative_change: Field
    chance_variance: Field
    model_error: Field


def residual_statistics(
    blocks: SpectrumBlocks, joint: JointFit, rows: list[int]
) -> ResidualStatistics:
    """Return the residual statistics of some recordings."""
    relative, expected = model_shares(blocks, joint.parameters)
    shared = relative[rows, 3]
    counted = (shared > SHARED_FROM) & (blocks.weight[rows] > 0.0)
    share = np.where(counted, shared, 1.0)
    relative_change = np.where(counted, (blocks.density / expected - 1.0)[rows] / share, 0.0)
    chance_variance = np.where(
        counted, 1.0 / (np.maximum(blocks.weight[rows], 1.0) * share**2), 0.0
    )
    line_weight = relative[rows, 0] ** 2 * (blocks.weight[rows] > 0.0)
    excess = (blocks.density / expected - 1.0)[rows] ** 2 - 1.0 / np.maximum(
        blocks.weight[rows], 1.0
    )
    model_error = np.sum(line_weight * excess, axis=0) / np.maximum(
        np.sum(line_weight, axis=0), TINY
    )
    return ResidualStatistics(counted, relative_change, chance_variance, model_error)


class SystematicErrors(NamedTuple):
    """Standard deviations (recordings, 4) beyond chance.

    `misfit` is caused by changes of the machine between recordings, `model_error` by structure that
    the splines do not follow.
    """

    misfit: Field
    model_error: Field

    @property
    def std(self) -> Field:
        """Both combined."""
        return np.asarray(np.hypot(self.misfit, self.model_error))


def systematic_errors(
    blocks: SpectrumBlocks, joint: JointFit, statistics: ResidualStatistics
) -> SystematicErrors:
    """Return the systematic errors of each recording's own parameters."""
    relative, _ = model_shares(blocks, joint.parameters)
    weighted = relative * blocks.weight[:, None]
    # derivative of each own parameter by a relative change of each block
    influence = np.linalg.solve(
        weighted @ relative.swapaxes(1, 2) + WEAK_INFORMATION * np.eye(4), weighted
    )
    spacing = joint.parameters.transfer.spacing_hz
    return SystematicErrors(
        _misfit_std(influence * relative[:, None, 3], statistics),
        _model_error_std(blocks.centre, relative[:, 0] ** 2, influence, spacing, statistics),
    )


def _misfit_std(sensitivity: Field, statistics: ResidualStatistics) -> Field:
    """Return the error caused by changes of the machine between recordings.

    `sensitivity` is the derivative of each parameter by relative changes a_b of the blocks. It is
    applied to the residuals r_jb of the recordings j whose own line is far; the squares are
    averaged, less what chance explains.
    """
    squares = sensitivity**2
    parameter_error = (sensitivity @ statistics.relative_change.T) ** 2
    expected_from_chance = squares @ statistics.chance_variance.T
    covered = squares @ statistics.counted.T.astype(float)
    # recordings must cover nearly all of the influence; weights fall with their chance variance
    covers = covered > COVERAGE_REQUIRED * np.sum(squares, axis=2)[:, :, None]
    weights = covers / np.maximum(expected_from_chance, TINY) ** 2
    variance = np.sum((parameter_error - expected_from_chance) * weights, axis=2) / np.maximum(
        np.sum(weights, axis=2), TINY
    )
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _model_error_std(
    centre: Field,
    line_power: Field,
    influence: Field,
    spacing_hz: float,
    statistics: ResidualStatistics,
) -> Field:
    """Return the error caused by structure that the splines of the transfer do not follow.

    Residuals under a line show the size of the model error there. The part absorbed by the fit is
    taken to be as large, with a correlation that falls to zero at a spline's spacing.
    """
    variance = np.maximum(
        line_power @ statistics.model_error / np.maximum(line_power.sum(axis=1), TINY), 0.0
    )
    sensitivity = np.sum(
        influence @ _block_correlation(centre.tobytes(), spacing_hz) * influence, axis=2
    )
    return np.asarray(np.sqrt(variance[:, None] * np.maximum(sensitivity, 0.0)))


@lru_cache(maxsize=4)
def _block_correlation(centres: bytes, spacing_hz: float) -> Field:
    """Return the assumed correlation of model errors between blocks; cached for a series."""
    centre = np.frombuffer(centres)
    correlation = np.maximum(1.0 - np.abs(centre[:, None] - centre) / spacing_hz, 0.0)
    correlation.flags.writeable = False
    return correlation


def relative_residual(blocks: SpectrumBlocks, expected: Field) -> Field:
    """Return the relative rms residual of each recording's spectrum beyond chance."""
    counted = blocks.weight > 0.0
    deviation = blocks.density / expected - 1.0
    excess = np.sum(
        counted * (deviation**2 - 1.0 / np.maximum(blocks.weight, 1.0)), axis=1
    ) / np.sum(counted, axis=1)
    return np.asarray(np.sqrt(np.maximum(excess, 0.0)))
