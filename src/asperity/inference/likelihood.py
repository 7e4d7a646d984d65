"""How probable what was heard is, by a law, with or without a term for what the law itself gets wrong.

Without the term, a frequency is off by its measurement and the emulator, whose error all operating
points of a contact have in common in part, and those at one place wholly. With it, the law is off
too, in frequency, damping and height each by a size of its own that is not known: three are as
probable. A spring's law is a function of the force it bears, and so is half of its error's
variance: points under the same force are off by the same. The other half is each place's own: what
was run at nearly one load, speed and temperature is off by the same. The law's exponent of the
load is off besides. CRFA has a gain that nobody knows, for all recordings in common.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.inference.forward import ChannelPrediction
from asperity.inference.observations import OperatingPoint, point_similarity

SIZES = (0.005, 0.02, 0.08)  # of the law's error, relative to CRF: 3, 12 and 60 % of a load share
WEIGHTS: Mapping[str, float] = {
    "crf": 1.0,
    "damping": 5.0,
    "crfa": 10.0,
}  # the same in ln ζ and ln CRFA
OWN = 0.5  # share of the law's variance that is each place's own
ALONG = 1.0  # in ln force: how far the rest reaches
EXPONENT_STD = 0.03  # of the power of the load that CRF goes with: as far as 1/5 is from 1/6
COMMON = (
    0.25  # share of the emulator's variance that all operating points of a contact have in common
)
# of ln CRFA: an accelerometer and what excites it are free, and the height of one point says
# nothing
GAIN_STD = 30.0
EMULATED_HEIGHT_STD = 0.05  # of ln CRFA beyond what CAR's deviation makes: its process's own shape
AT_ONCE = 2**20  # numbers of covariances that are held at a time


def log_likelihood(
    shown: ChannelPrediction, points: Sequence[OperatingPoint], *, discrepancy: bool
) -> Field:
    """Logarithm of p(heard | unknowns), shape (n,); `shown` has a column for each of the points."""
    sizes = SIZES if discrepancy else (0.0,)
    whole = [log_at_sizes(shown, points, channel, sizes) for channel in WEIGHTS]
    return np.asarray(sum(np.logaddexp.reduce(logs, axis=0) - np.log(len(sizes)) for logs in whole))


def log_at_sizes(
    shown: ChannelPrediction,
    points: Sequence[OperatingPoint],
    channel: str,
    sizes: Sequence[float] = SIZES,
) -> Field:
    """The same of one channel, for each size of the law's error, shape (sizes, n)."""
    value, std = _heard(points, channel)
    mean, lever = getattr(shown, channel), shown.lever
    here = ~np.isnan(value) & ~np.isnan(mean).any(axis=0)
    logs = np.zeros((len(sizes), len(mean)))
    if not here.any():
        return logs
    near = point_similarity(points)[np.ix_(here, here)]
    for rows in _parts(len(mean), int(here.sum())):
        rest = value[here] - mean[rows][:, here]
        known = emulated_errors(channel, _deviation(shown, channel)[rows][:, here], near) + np.diag(
            std[here] ** 2
        )
        for number, size in enumerate(sizes):
            law = law_errors(channel, lever[rows][:, here], np.full(len(rows), size), near)
            logs[number, rows] = _log_normal(rest, known + law)
    return logs


class PredictiveMixture(NamedTuple):
    """What contacts would show: normal parts, one for each size of the law's error, shape (sizes, n, points) each.

    `log_share` is ln probability of each part, `std` is without what a measurement adds.
    """

    log_share: Field
    mean: Field
    std: Field

    def log_density(self, value: Field, measured: float) -> Field:
        """Logarithm of p of values that are measured with so much deviation; `value` goes with (n, points)."""
        spread = np.hypot(self.std, measured)
        level = self.log_share - np.log(spread) - 0.5 * np.log(2.0 * np.pi)
        parts = [
            one - 0.5 * ((value - mean) / std) ** 2
            for one, mean, std in zip(level, self.mean, spread, strict=True)
        ]
        peak = np.maximum.reduce(parts)
        return np.asarray(peak + np.log(sum(np.exp(one - peak) for one in parts)))


def predictive_mixture(
    shown: ChannelPrediction,
    points: Sequence[OperatingPoint],
    channel: str,
    sizes: Sequence[float] = SIZES,
) -> PredictiveMixture:
    """What contacts would show at all points, by what was heard at some of them.

    The errors of law and emulator are those that the likelihood counts, given what they were where
    something was heard; so are the sizes of the law's.
    """
    value, measured = _heard(points, channel)
    mean, lever, near = getattr(shown, channel), shown.lever, point_similarity(points)
    here = ~np.isnan(value) & ~np.isnan(mean).any(axis=0)
    logs = log_at_sizes(shown, points, channel, sizes)
    share = logs - np.logaddexp.reduce(logs, axis=0)
    expected, std = np.tile(mean, (len(sizes), 1, 1)), np.empty((len(sizes), *mean.shape))
    for rows in _parts(len(mean), len(points)):
        pivot = lever[rows][:, here].mean(axis=1, keepdims=True) if here.any() else lever[rows]
        emulated = emulated_errors(channel, _deviation(shown, channel)[rows], near)
        for number, size in enumerate(sizes):
            errors = emulated + law_errors(
                channel, lever[rows], np.full(len(rows), size), near, pivot
            )
            variance = np.einsum("nii->ni", errors).copy()
            if here.any():
                across = errors[:, here]
                taught = np.linalg.solve(across[:, :, here] + np.diag(measured[here] ** 2), across)
                expected[number, rows] += np.einsum(
                    "nh,nhp->np", value[here] - mean[rows][:, here], taught
                )
                variance -= np.einsum("nhp,nhp->np", across, taught)
            std[number, rows] = np.sqrt(np.maximum(variance, 0.0))
    return PredictiveMixture(np.broadcast_to(share[:, :, None], std.shape), expected, std)


def _heard(points: Sequence[OperatingPoint], channel: str) -> tuple[Field, Field]:
    """Values and deviations of a channel at points."""
    heard = [getattr(point, channel) for point in points]
    return np.array([one.value for one in heard]), np.array([one.std for one in heard])


def _parts(count: int, points: int) -> list[Field]:
    """Rows of which covariances are held at a time."""
    return np.array_split(np.arange(count), max(1, count * points**2 // AT_ONCE))


def law_errors(
    channel: str, lever: Field, size: Field, near: Field, pivot: Field | None = None
) -> Field:
    """Covariance of the law's errors at operating points, (n, points, points); `lever` is ln force, (n, points).

    `size` (n,) is relative to CRF; where it is 0, the law is exact. `near` is the points'
    likeness. At `pivot` (ln force) an exponent that is off changes nothing; by default it is the
    points' mean.
    """
    errors = (WEIGHTS[channel] * size[:, None, None]) ** 2 * law_correlations(lever, near)
    if channel == "crf":
        pivot = lever.mean(axis=1, keepdims=True) if pivot is None else pivot
        steep = EXPONENT_STD * (lever - pivot) * (size[:, None] > 0.0)
        errors += steep[:, :, None] * steep[:, None, :]
    return np.asarray(errors)


def law_correlations(lever: Field, near: Field) -> Field:
    """Of the law's errors at operating points, but for its exponent, (n, points, points)."""
    apart = lever[:, :, None] - lever[:, None, :]
    return np.asarray((1.0 - OWN) * np.exp(-0.5 * (apart / ALONG) ** 2) + OWN * near)


def emulated_errors(channel: str, std: Field, near: Field) -> Field:
    """Covariance of the emulator's errors by their deviations (n, points), and of a height with its free gain."""
    errors = std[:, :, None] * std[:, None, :] * (COMMON + (1.0 - COMMON) * near)
    return np.asarray(errors + GAIN_STD**2 if channel == "crfa" else errors)


def _deviation(shown: ChannelPrediction, channel: str) -> Field:
    std = getattr(shown, f"{channel}_std")
    return np.asarray(np.hypot(std, EMULATED_HEIGHT_STD) if channel == "crfa" else std)


def _log_normal(rest: Field, covariance: Field) -> Field:
    """Logarithms of normal densities of residuals (n, points) of no mean."""
    lower = np.linalg.cholesky(covariance)
    white = np.empty_like(rest)
    for place in range(rest.shape[1]):
        before = np.einsum("nj,nj->n", lower[:, place, :place], white[:, :place])
        white[:, place] = (rest[:, place] - before) / lower[:, place, place]
    spread = np.log(np.einsum("nii->ni", lower)).sum(axis=1)
    return np.asarray(
        -0.5 * np.sum(white**2, axis=1) - spread - 0.5 * rest.shape[1] * np.log(2.0 * np.pi)
    )
