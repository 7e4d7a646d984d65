"""Detection of a moved sensor: the transfer from contact to sensor changes at a recording.

`separation` fits one transfer to all recordings; here the evidence for another one from some
recording on is computed. docs/theory/indicators.md has the equations.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.line_fit import JointFit
from asperity.resonance.spectrum_model import (
    WEAK_INFORMATION,
    SpectrumBlocks,
    model_shares,
    relative_columns,
)

FEWEST_RECORDINGS_PER_PART = 6  # before and after a move
STEP_STDS = (0.03, 0.1, 0.3, 1.0)  # prior standard deviations of the change between splines
LEAST_STEP_STD = 0.1  # of the common transfer, so that a flat one may still bend
EVIDENCE_REQUIRED = 50.0  # ln evidence of a step beyond that of a drift
# a step displaced by this part of the series must lose at least this share of the evidence
ASIDE, SHARP = 20, 0.12
SIGNIFICANT_INFORMATION = 1e-6  # relative to the largest eigenvalue


class _Changes(NamedTuple):
    """Score and information of the transfer, by recording and with the common transfer held."""

    score: Field  # (recordings, coefficients)
    information: Field  # (recordings, coefficients, coefficients)
    common_score: Field
    common_covariance: Field
    priors: list[Field]  # of the change

    def evidence(self, course: Field) -> float:
        """Return the ln evidence of a change proportional to `course` (recordings,)."""
        total = np.einsum("n,ncd->cd", course, self.information)
        covariance = self.common_covariance
        score = course @ self.score - total @ covariance @ self.common_score
        information = (
            np.einsum("n,ncd->cd", course**2, self.information) - total @ covariance @ total
        )
        return max(_evidence(score, information, prior) for prior in self.priors)

    def evidence_of_step(self, first: int) -> float:
        """Return the ln evidence of a change from a recording on."""
        return self.evidence(1.0 * (np.arange(len(self.score)) >= first))

    def evidence_of_drift(self) -> float:
        """Return the ln evidence of a linear or parabolic change, 0 for none."""
        t = np.linspace(-1.0, 1.0, len(self.score))
        return max(self.evidence(t), self.evidence(t**2), 0.0)


def first_moved_recording(blocks: SpectrumBlocks, joint: JointFit) -> int | None:
    """Return the first recording after a change of the transfer, or None.

    Computes the ln evidence of a change of its coefficients from some recording on, Gaussian with
    the most likely step standard deviation, over no change: from score and information at the fit,
    with each recording's own parameters and the common transfer eliminated. Both are divided by the
    scatter beyond chance, so that a machine that does not repeat itself is not taken for a moved
    sensor. A step must beat a drift, and steps nearby; this excludes drifting modes and misfit that
    depends on the line's frequency.
    """
    count = blocks.density.shape[0]
    if count < 2 * FEWEST_RECORDINGS_PER_PART or not joint.parameters.transfer.coefficients.size:
        return None
    changes = _changes(blocks, joint)
    best = max(
        range(FEWEST_RECORDINGS_PER_PART, count - FEWEST_RECORDINGS_PER_PART + 1),
        key=changes.evidence_of_step,
    )
    offset = max(count // ASIDE, 1)
    nearby = max(changes.evidence_of_step(best - offset), changes.evidence_of_step(best + offset))
    evidence = changes.evidence_of_step(best)
    significant = evidence > EVIDENCE_REQUIRED + changes.evidence_of_drift()
    sharp = nearby < (1.0 - SHARP) * evidence
    return best if significant and sharp else None


def _changes(blocks: SpectrumBlocks, joint: JointFit) -> _Changes:
    """Return score and information over the scatter beyond chance, and the common transfer."""
    transfer = joint.parameters.transfer
    score, information = _by_recording(blocks, joint)
    dispersion = max(_dispersion(score, information), 1.0)
    score, information = score / dispersion, information / dispersion
    prior_information = transfer.stiffness(max(LEAST_STEP_STD, joint.step_std))
    return _Changes(
        score,
        information,
        score.sum(axis=0) - prior_information @ transfer.coefficients,
        np.linalg.solve(
            information.sum(axis=0) + prior_information, np.eye(transfer.coefficients.size)
        ),
        [transfer.stiffness(step_std) for step_std in STEP_STDS],
    )


def _by_recording(blocks: SpectrumBlocks, joint: JointFit) -> tuple[Field, Field]:
    """Return each recording's score and information of the transfer, own parameters eliminated."""
    parameters = joint.parameters
    relative, expected = model_shares(blocks, joint.parameters)
    weighted_residual = blocks.weight * (blocks.density / expected - 1.0)
    size = parameters.transfer.coefficients.size
    recordings = weighted_residual.shape[0]
    score = np.zeros((recordings, size))
    information = np.zeros((recordings, size, size))
    for row, (shares, weight) in enumerate(zip(relative, blocks.weight, strict=True)):
        single = parameters._replace(own=parameters.own[[row]])
        transfer = shares[0][:, None] * relative_columns(blocks.centre, single)[0]
        weighted = weight[:, None] * transfer
        coupling = shares @ weighted
        block = (shares * weight) @ shares.T + WEAK_INFORMATION * np.eye(len(shares))
        score[row] = weighted_residual[row] @ transfer
        information[row] = transfer.T @ weighted - coupling.T @ np.linalg.solve(block, coupling)
    return score, information


def _dispersion(score: Field, information: Field) -> float:
    """Return the median over recordings of the score's variance over its expectation."""
    ratios = []
    for own_score, own_information in zip(score, information, strict=True):
        values, vectors = np.linalg.eigh(own_information)
        counted = values > SIGNIFICANT_INFORMATION * values[-1]
        ratios.append(float(np.mean((own_score @ vectors[:, counted]) ** 2 / values[counted])))
    return float(np.median(ratios))


def _evidence(score: Field, information: Field, prior: Field) -> float:
    """Return the ln evidence (Laplace) of a change with prior information `prior`."""
    posterior = information + prior
    gain = 0.5 * float(score @ np.linalg.solve(posterior, score))
    return gain + 0.5 * float(np.linalg.slogdet(prior)[1] - np.linalg.slogdet(posterior)[1])
