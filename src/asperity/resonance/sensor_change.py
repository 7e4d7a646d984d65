"""Where a series' sensor was moved: what lies between contact and sensor is another from some recording on.

One transfer is fitted to all by `separation`; here is asked whether another one behind a recording
would explain what that leaves. What is made of it is left to `series`. docs/theory/indicators.md
has the equations.
"""

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.separation import Joint
from asperity.resonance.spectrum_model import LOOSE, Blocks, away, shares_of

LEAST_PART = 6  # recordings before a move and behind it
PACES = (0.03, 0.1, 0.3, 1.0)  # of what a move changes, from spline to spline
USUAL_PACE = 0.1  # of the transfer that all share, at least: what is held level may yet bend
MOVED = 50.0  # ln evidence of a step, beyond that of a drift, from which a sensor was moved
ASIDE, SHARP = (
    20,
    0.12,
)  # a step this part of a series aside loses at least this share of the evidence
DETERMINED = 1e-6  # of the greatest, information that counts


def moved_at(blocks: Blocks, joint: Joint) -> int | None:
    """The first recording behind a change of the transfer, None where one does for all.

    ln evidence of a change of its coefficients from some recording on, Gaussian with the likeliest
    pace, over none: by score and information at the fit, each recording's own parameters and the
    common transfer eliminated. Both are divided by what scatter is beyond chance, so that a
    machine which does not repeat itself has not been moved. A step has to beat a drift, and to be
    told from one elsewhere: so modes that drift, or misfit that goes with the line's place, are
    none.
    """
    count = blocks.density.shape[0]
    passed = joint.parameters.transfer
    if count < 2 * LEAST_PART or not passed.coefficients.size:
        return None
    score, information = _by_recording(blocks, joint)
    beyond = max(_dispersion(score, information), 1.0)
    score, information = score / beyond, information / beyond
    usual = passed.stiffness(max(USUAL_PACE, joint.pace))
    looser = np.linalg.solve(information.sum(axis=0) + usual, np.eye(passed.coefficients.size))
    drawn = score.sum(axis=0) - usual @ passed.coefficients
    stiff = [passed.stiffness(pace) for pace in PACES]

    def evidence(course: Field) -> float:
        """Ln evidence of a change that goes with `course` (recordings,), over none."""
        together = np.einsum("n,ncd->cd", course, information)
        changed = course @ score - together @ looser @ drawn
        told = np.einsum("n,ncd->cd", course**2, information) - together @ looser @ together
        return max(_evidence(changed, told, before) for before in stiff)

    numbers = np.arange(count)

    def step(first: int) -> float:
        return evidence(1.0 * (numbers >= first))

    best = max(range(LEAST_PART, count - LEAST_PART + 1), key=step)
    along = np.linspace(-1.0, 1.0, count)
    drift = max(evidence(along), evidence(along**2), 0.0)
    aside = max(count // ASIDE, 1)
    blunt = max(step(best - aside), step(best + aside))
    reached = step(best)
    return best if reached > MOVED + drift and blunt < (1.0 - SHARP) * reached else None


def _by_recording(blocks: Blocks, joint: Joint) -> tuple[Field, Field]:
    """Score and information of each recording in the transfer's coefficients, its own parameters eliminated."""
    at = joint.parameters
    relative, expected = shares_of(blocks, joint.parameters)
    off = blocks.weight * (blocks.density / expected - 1.0)
    size = at.transfer.coefficients.size
    score, information = np.zeros((off.shape[0], size)), np.zeros((off.shape[0], size, size))
    for row, (shares, weight) in enumerate(zip(relative, blocks.weight, strict=True)):
        passed = shares[0][:, None] * away(blocks.centre, at._replace(own=at.own[[row]]))[0]
        weighted = weight[:, None] * passed
        coupling = shares @ weighted
        own = (shares * weight) @ shares.T + LOOSE * np.eye(len(shares))
        score[row] = off[row] @ passed
        information[row] = passed.T @ weighted - coupling.T @ np.linalg.solve(own, coupling)
    return score, information


def _dispersion(score: Field, information: Field) -> float:
    """Variance of the scores over what chance brings, of the middle recording."""
    found = []
    for one, told in zip(score, information, strict=True):
        values, vectors = np.linalg.eigh(told)
        counts = values > DETERMINED * values[-1]
        found.append(float(np.mean((one @ vectors[:, counts]) ** 2 / values[counts])))
    return float(np.median(found))


def _evidence(score: Field, information: Field, stiff: Field) -> float:
    """Ln evidence of a change over none (Laplace), whose information before the data is `stiff`."""
    behind = information + stiff
    gain = 0.5 * float(score @ np.linalg.solve(behind, score))
    return gain + 0.5 * float(np.linalg.slogdet(stiff)[1] - np.linalg.slogdet(behind)[1])
