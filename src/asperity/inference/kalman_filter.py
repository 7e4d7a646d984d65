"""Kalman filter of contacts in which one unknown drifts, on a table of their predicted channels."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from asperity.core.arrays import Field
from asperity.inference.likelihood import EXPONENT_STD, GAIN_STD, SIZES, WEIGHTS, law_correlations
from asperity.inference.visits import CHANNELS, SeriesMeasurement

KNOTS = 17  # of the table along the range of the drifting unknown
# change of the drift over the series: median, standard deviation of its logarithm
DIFFUSION, DIFFUSION_SPREAD = 0.1, 1.0
# relative scatter of CRF between visits beyond its standard deviation: median, spread of its log
SCATTER, SCATTER_SPREAD = 1e-3, 1.0
# correlation of this scatter between consecutive, evenly spaced visits, and its probabilities,
# those used for stages of a series
CORRELATIONS = (0.0, 0.4, 0.65, 0.85)
CORRELATION_PROBABILITIES = (0.7, 0.1, 0.1, 0.1)
PARAMETERS = 6  # of a drift: the law's error in three channels, diffusion, scatter, correlation
ITERATIONS = 2  # of an update, since the table is nonlinear
# indices of the state; errors of channels at points follow
SHARE, DRIFT, EXPONENT, GAIN, SLOW_SCATTER, FIRST_ERROR = range(6)


class DriftParameters(NamedTuple):
    """Unknowns of a drift, shape (n,) each; `sizes` are the law's errors relative to CRF."""

    sizes: Mapping[str, Field]
    diffusion: Field
    scatter: Field
    correlation: Field

    @classmethod
    def from_normal(cls, z: Field) -> "DriftParameters":
        """Convert standard normal numbers (n, PARAMETERS)."""
        sizes = np.array(SIZES)[
            np.minimum((len(SIZES) * ndtr(z[:, :3])).astype(int), len(SIZES) - 1)
        ]
        thresholds = np.cumsum(CORRELATION_PROBABILITIES)[:-1]
        return cls(
            dict(zip(CHANNELS, sizes.T, strict=True)),
            DIFFUSION * np.exp(DIFFUSION_SPREAD * z[:, 3]),
            SCATTER * np.exp(SCATTER_SPREAD * z[:, 4]),
            np.array(CORRELATIONS)[np.searchsorted(thresholds, ndtr(z[:, 5]))],
        )


class ChannelTable(NamedTuple):
    """Predicted channels along the range of the drifting unknown, (n, points, knots)."""

    channels: Mapping[str, Field]
    errors: Mapping[str, Field]  # covariance of the emulator's errors, (n, points, points)
    log_force: Field  # derivative with respect to the law's exponent, (n, points), mean 0
    share: Field  # initial share of the range, (n,)
    parameters: DriftParameters

    def interpolate(self, channel: str, point: int, share: Field) -> tuple[Field, Field]:
        """Return value and slope at shares of the range; constant beyond its ends."""
        return between_knots(self.channels[channel][:, point], share)


def between_knots(table: Field, share: Field) -> tuple[Field, Field]:
    """Interpolate tables (n, knots) over 0 to 1 at shares (n,) or (n, m): values and slopes."""
    last = table.shape[1] - 1
    position = np.clip(share, 0.0, 1.0) * last
    index = np.minimum(position.astype(int), last - 1)
    rows = np.arange(len(table)).reshape(-1, *[1] * (share.ndim - 1))
    low = table[rows, index]
    high = table[rows, index + 1]
    inside = (share >= 0.0) & (share <= 1.0)
    return low + (position - index) * (high - low), np.where(inside, last * (high - low), 0.0)


@dataclass(frozen=True)
class _MeasuredStates:
    """States besides the share on which a measurement depends: errors, slopes, exponent and gain.

    `slope_factors` and `log_force` are the derivatives with respect to slopes and exponent.
    """

    channel: str
    error: int
    slopes: list[int]
    slope_factors: Field
    log_force: Field
    noise: Field  # variance

    def expected(self, from_share: Field, mean: Field) -> Field:
        """Add the means of these states to the value expected from the share."""
        value = from_share + mean[:, self.error] + mean[:, self.slopes] @ self.slope_factors
        if self.channel == "crf":
            return value + self.log_force * mean[:, EXPONENT] + mean[:, SLOW_SCATTER]
        return value + mean[:, GAIN] if self.channel == "crfa" else value

    def covariance_of_errors(self, covariance: Field) -> Field:
        """Return the covariance of their sum with every state."""
        across = covariance[:, self.error] + covariance[:, :, self.slopes] @ self.slope_factors
        if self.channel == "crf":
            across += (
                self.log_force[:, None] * covariance[:, EXPONENT] + covariance[:, SLOW_SCATTER]
            )
        elif self.channel == "crfa":
            across += covariance[:, GAIN]
        return across

    def variance(self, from_share: Field, across: Field) -> Field:
        """Return the variance of the measurement, whose covariance with the state is `across`."""
        total = (
            from_share
            + across[:, self.error]
            + across[:, self.slopes] @ self.slope_factors
            + self.noise
        )
        if self.channel == "crf":
            total += self.log_force * across[:, EXPONENT] + across[:, SLOW_SCATTER]
        elif self.channel == "crfa":
            total += across[:, GAIN]
        return total


def _prior_variance(
    table: ChannelTable, drift_std: float, points: int, shape: tuple[int, ...]
) -> Field:
    """Return the prior variance of each state, without the errors of channels."""
    variance = np.zeros(shape)
    variance[:, DRIFT], variance[:, EXPONENT], variance[:, GAIN] = (
        drift_std**2,
        EXPONENT_STD**2,
        GAIN_STD**2,
    )
    parameters = table.parameters
    variance[:, SLOW_SCATTER] = parameters.scatter**2 * (parameters.correlation > 0.0)
    variance[:, FIRST_ERROR + len(CHANNELS) * points :] = 1.0
    return variance


@dataclass
class KalmanState:
    """Means and covariances of all contacts' states, and the log-likelihood so far."""

    mean: Field
    covariance: Field
    log: Field
    slope_scatter: Mapping[tuple[str, int], Field]  # one standard normal state each, at the end

    @classmethod
    def initial(
        cls,
        table: ChannelTable,
        similarity: Field,
        drift: tuple[float, float],
        slope_scatter: Mapping[tuple[str, int], Field],
    ) -> "KalmanState":
        """Return the prior state: the share is the contact's, all else is uncertain."""
        count = len(table.share)
        points = len(similarity)
        states = FIRST_ERROR + len(CHANNELS) * points + len(slope_scatter)
        mean = np.zeros((count, states))
        mean[:, SHARE], mean[:, DRIFT] = table.share, drift[0]
        covariance = np.zeros((*mean.shape, mean.shape[1]))
        diagonal = np.arange(mean.shape[1])
        covariance[:, diagonal, diagonal] = _prior_variance(table, drift[1], points, mean.shape)
        for number, channel in enumerate(CHANNELS):
            block = slice(FIRST_ERROR + number * points, FIRST_ERROR + (number + 1) * points)
            size = WEIGHTS[channel] * table.parameters.sizes[channel]
            correlations = law_correlations(table.log_force, similarity)
            covariance[:, block, block] += (
                table.errors[channel] + size[:, None, None] ** 2 * correlations
            )
        return cls(mean, covariance, np.zeros(count), slope_scatter)

    def advance(
        self, time: float, diffusion: Field, parameters: DriftParameters, visits: int
    ) -> None:
        """Predict the state after `time`: integrated Wiener process, decaying slow scatter."""
        decay = parameters.correlation ** (time * visits)
        self.mean[:, SLOW_SCATTER] *= decay
        self.covariance[:, SLOW_SCATTER] *= decay[:, None]
        self.covariance[:, :, SLOW_SCATTER] *= decay[:, None]
        self.covariance[:, SLOW_SCATTER, SLOW_SCATTER] += (
            parameters.scatter**2 * (parameters.correlation > 0.0) * (1.0 - decay**2)
        )
        self.mean[:, SHARE] += time * self.mean[:, DRIFT]
        self.covariance[:, SHARE] += time * self.covariance[:, DRIFT]
        self.covariance[:, :, SHARE] += time * self.covariance[:, :, DRIFT]
        self.covariance[:, SHARE, SHARE] += diffusion**2 * time**3 / 3.0
        for row, column in ((SHARE, DRIFT), (DRIFT, SHARE)):
            self.covariance[:, row, column] += diffusion**2 * time**2 / 2.0
        self.covariance[:, DRIFT, DRIFT] += diffusion**2 * time

    def update(self, entry: SeriesMeasurement, table: ChannelTable, points: int) -> None:
        """Update the state and the log-likelihood with one measurement."""
        states = self._measured_states(entry, table, points)
        from_errors = states.covariance_of_errors(self.covariance)
        share = self.mean[:, SHARE]
        for iteration in range(ITERATIONS):
            value, slope = table.interpolate(entry.channel, entry.point, share)
            expected = states.expected(value + slope * (self.mean[:, SHARE] - share), self.mean)
            across = slope[:, None] * self.covariance[:, SHARE] + from_errors
            total = states.variance(slope * across[:, SHARE], across)
            residual = entry.measured.value - expected
            if iteration == 0:
                log = -0.5 * (residual**2 / total + np.log(2.0 * np.pi * total))
            share = self.mean[:, SHARE] + across[:, SHARE] / total * residual
        self.log += log
        gain = across / total[:, None]
        self.mean += gain * residual[:, None]
        self.covariance -= gain[:, :, None] * across[:, None, :]

    def _measured_states(
        self, entry: SeriesMeasurement, table: ChannelTable, points: int
    ) -> "_MeasuredStates":
        """Return the states besides the share on which a measurement depends."""
        channel = entry.channel
        parameters = table.parameters
        noise = entry.measured.std**2 + (WEIGHTS[channel] * parameters.scatter) ** 2
        if channel == "crf":  # correlated scatter is in the state
            noise = np.where(parameters.correlation > 0.0, entry.measured.std**2, noise)
        error = FIRST_ERROR + CHANNELS.index(channel) * points + entry.point
        slopes, factors = self._slope_states(entry)
        log_force = table.log_force[:, entry.point]
        return _MeasuredStates(channel, error, slopes, factors, log_force, noise)

    def _slope_states(self, entry: SeriesMeasurement) -> tuple[list[int], Field]:
        """Return the slope states that affect a measurement off its nominal point, and factors."""
        first = self.mean.shape[1] - len(self.slope_scatter)
        affected = [
            (first + number, entry.offset[axis] * scatter[entry.point])
            for number, ((channel, axis), scatter) in enumerate(self.slope_scatter.items())
            if channel == entry.channel and entry.offset[axis]
        ]
        return [state for state, _ in affected], np.array([factor for _, factor in affected])
