"""Likelihood of measurements by a spring law, with or without model discrepancy.

Without discrepancy, errors are those of measurement and emulator; the emulator's error is partly
common to all operating points and fully common to similar ones. With discrepancy, the law has an
error in frequency, damping, height and capacitance, each of unknown size (three equally probable
sizes). Half of its variance is a function of the spring's force; the other half is specific to an
operating point and common to similar ones. The law's exponent of the load is uncertain too. CRFA
has an unknown gain common to all recordings.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.inference.forward import ChannelPrediction
from asperity.inference.observations import ObservationPoint, point_similarity

SIZES = (0.005, 0.02, 0.08)  # of the law's error, relative to CRF: 3, 12 and 60 % of a load share
# size of the error in ln ζ, ln CRFA and ln capacitance, relative to that in ln CRF; the last
# allows for permittivity and stray capacitance, 1, 4 or 16 %
WEIGHTS: Mapping[str, float] = {"crf": 1.0, "damping": 5.0, "crfa": 10.0, "capacitance": 2.0}
ELECTRIC_SHARE = 0.1  # the same of the capacitance: permittivity and stray capacitance are common
POINT_SHARE = 0.5  # fraction of the law's variance specific to an operating point
FORCE_LENGTH = 1.0  # correlation length of the other part, in ln force
EXPONENT_STD = 0.03  # of the exponent of the load in CRF: the difference of 1/5 and 1/6
COMMON_SHARE = 0.25  # fraction of the emulator's variance common to all operating points
GAIN_STD = 30.0  # of ln CRFA: effectively flat, since sensor and excitation are unknown
EMULATED_HEIGHT_STD = 0.05  # of ln CRFA beyond the error from CAR: misfit of the emulator
CHUNK_SIZE = 2**20  # covariance entries held at a time


def log_likelihood(
    prediction: ChannelPrediction, points: Sequence[ObservationPoint], *, discrepancy: bool
) -> Field:
    """Return ln p(measurements | unknowns), shape (n,); `prediction` has a column per point."""
    sizes = SIZES if discrepancy else (0.0,)
    terms = [log_at_sizes(prediction, points, channel, sizes) for channel in WEIGHTS]
    return np.asarray(sum(np.logaddexp.reduce(logs, axis=0) - np.log(len(sizes)) for logs in terms))


def log_at_sizes(
    prediction: ChannelPrediction,
    points: Sequence[ObservationPoint],
    channel: str,
    sizes: Sequence[float] = SIZES,
) -> Field:
    """Return the log-likelihood of one channel for each size of the law's error, (sizes, n)."""
    value, std = measured_channel(points, channel)
    mean = getattr(prediction, channel)
    log_force = prediction.log_force
    observed = ~np.isnan(value) & ~np.isnan(mean).any(axis=0)
    logs = np.zeros((len(sizes), len(mean)))
    if not observed.any():
        return logs
    similarity = point_similarity(points)[np.ix_(observed, observed)]
    for rows in _row_blocks(len(mean), int(observed.sum())):
        residual = value[observed] - mean[rows][:, observed]
        emulator_error = emulated_errors(
            channel, _deviation(prediction, channel)[rows][:, observed], similarity
        ) + np.diag(std[observed] ** 2)
        for number, size in enumerate(sizes):
            law = law_errors(
                channel, log_force[rows][:, observed], np.full(len(rows), size), similarity
            )
            logs[number, rows] = _log_normal(residual, emulator_error + law)
    return logs


class PredictiveMixture(NamedTuple):
    """Predictive distribution of measurements, a normal mixture over sizes of the law's error.

    Arrays of shape (sizes, n, points): `log_share` is the ln probability of each component, `std`
    excludes the measurement error.
    """

    log_share: Field
    mean: Field
    std: Field

    def log_density(self, value: Field, measured: float) -> Field:
        """Return ln p of `value`, broadcast to (n, points), for a `measured` standard deviation."""
        spread = np.hypot(self.std, measured)
        level = self.log_share - np.log(spread) - 0.5 * np.log(2.0 * np.pi)
        parts = [
            offset - 0.5 * ((value - mean) / std) ** 2
            for offset, mean, std in zip(level, self.mean, spread, strict=True)
        ]
        peak = np.maximum.reduce(parts)
        return np.asarray(peak + np.log(sum(np.exp(part - peak) for part in parts)))


def predictive_mixture(
    prediction: ChannelPrediction,
    points: Sequence[ObservationPoint],
    channel: str,
    sizes: Sequence[float] = SIZES,
) -> PredictiveMixture:
    """Return the predictive distribution at all points, conditional on the measured points.

    Errors of law and emulator, and the sizes of the law's, are those of the likelihood,
    conditional on the measurements.
    """
    value, measured = measured_channel(points, channel)
    mean = getattr(prediction, channel)
    similarity = point_similarity(points)
    observed = ~np.isnan(value) & ~np.isnan(mean).any(axis=0)
    logs = log_at_sizes(prediction, points, channel, sizes)
    share = logs - np.logaddexp.reduce(logs, axis=0)
    expected = np.tile(mean, (len(sizes), 1, 1))
    std = np.empty((len(sizes), *mean.shape))
    for rows in _row_blocks(len(mean), len(points)):
        covariances = _block_errors(prediction, channel, rows, similarity, observed, sizes)
        for number, errors in enumerate(covariances):
            variance = np.einsum("nii->ni", errors).copy()
            if observed.any():
                residual = (value - mean[rows])[:, observed]
                shift, explained = _explained_errors(
                    errors, observed, residual, measured[observed] ** 2
                )
                expected[number, rows] += shift
                variance -= explained
            std[number, rows] = np.sqrt(np.maximum(variance, 0.0))
    return PredictiveMixture(np.broadcast_to(share[:, :, None], std.shape), expected, std)


def _block_errors(
    prediction: ChannelPrediction,
    channel: str,
    rows: Field,
    similarity: Field,
    observed: Mask,
    sizes: Sequence[float],
) -> Iterator[Field]:
    """Yield the covariance of all errors of rows for each size, relative to `observed` points."""
    log_force = prediction.log_force[rows]
    pivot = log_force[:, observed].mean(axis=1, keepdims=True) if observed.any() else log_force
    emulated = emulated_errors(channel, _deviation(prediction, channel)[rows], similarity)
    for size in sizes:
        yield emulated + law_errors(channel, log_force, np.full(len(rows), size), similarity, pivot)


def _explained_errors(
    errors: Field, observed: Mask, residual: Field, noise: Field
) -> tuple[Field, Field]:
    """Return the mean and the variance of errors at all points, given `observed` residuals."""
    across = errors[:, observed]
    weights = np.linalg.solve(across[:, :, observed] + np.diag(noise), across)
    return (
        np.asarray(np.einsum("nh,nhp->np", residual, weights)),
        np.asarray(np.einsum("nhp,nhp->np", across, weights)),
    )


def measured_channel(points: Sequence[ObservationPoint], channel: str) -> tuple[Field, Field]:
    """Return values and standard deviations of a channel at points."""
    entries = [getattr(point, channel) for point in points]
    return np.array([entry.value for entry in entries]), np.array([entry.std for entry in entries])


def _row_blocks(count: int, points: int) -> list[Field]:
    """Return blocks of rows whose covariances fit in memory."""
    return np.array_split(np.arange(count), max(1, count * points**2 // CHUNK_SIZE))


def law_errors(
    channel: str, log_force: Field, size: Field, similarity: Field, pivot: Field | None = None
) -> Field:
    """Return the covariance of the law's errors at operating points, (n, points, points).

    Parameters
    ----------
    channel : "crf", "damping", "crfa" or "capacitance"
    log_force : (n, points)
    size : (n,), relative to CRF; 0 for an exact law
    similarity : of the points, see `point_similarity`
    pivot : ln force at which the exponent has no effect; by default the mean of the points
    """
    correlations = (
        1.0 - ELECTRIC_SHARE + ELECTRIC_SHARE * similarity
        if channel == "capacitance"
        else law_correlations(log_force, similarity)
    )
    errors = (WEIGHTS[channel] * size[:, None, None]) ** 2 * correlations
    if channel == "crf":
        pivot = log_force.mean(axis=1, keepdims=True) if pivot is None else pivot
        exponent_error = EXPONENT_STD * (log_force - pivot) * (size[:, None] > 0.0)
        errors += exponent_error[:, :, None] * exponent_error[:, None, :]
    return np.asarray(errors)


def law_correlations(log_force: Field, similarity: Field) -> Field:
    """Return correlations of the law's errors without its exponent, (n, points, points)."""
    difference = log_force[:, :, None] - log_force[:, None, :]
    return np.asarray(
        (1.0 - POINT_SHARE) * np.exp(-0.5 * (difference / FORCE_LENGTH) ** 2)
        + POINT_SHARE * similarity
    )


def emulated_errors(channel: str, std: Field, similarity: Field) -> Field:
    """Return the covariance of the emulator's errors of deviation `std` (n, points)."""
    errors = std[:, :, None] * std[:, None, :] * (COMMON_SHARE + (1.0 - COMMON_SHARE) * similarity)
    return np.asarray(errors + GAIN_STD**2 if channel == "crfa" else errors)


def _deviation(prediction: ChannelPrediction, channel: str) -> Field:
    std = getattr(prediction, f"{channel}_std")
    return np.asarray(np.hypot(std, EMULATED_HEIGHT_STD) if channel == "crfa" else std)


def _log_normal(residual: Field, covariance: Field) -> Field:
    """Return ln of the zero-mean normal density at residuals (n, points)."""
    lower = np.linalg.cholesky(covariance)
    white = np.empty_like(residual)
    for i in range(residual.shape[1]):
        explained = np.einsum("nj,nj->n", lower[:, i, :i], white[:, :i])
        white[:, i] = (residual[:, i] - explained) / lower[:, i, i]
    spread = np.log(np.einsum("nii->ni", lower)).sum(axis=1)
    return np.asarray(
        -0.5 * np.sum(white**2, axis=1) - spread - 0.5 * residual.shape[1] * np.log(2.0 * np.pi)
    )
