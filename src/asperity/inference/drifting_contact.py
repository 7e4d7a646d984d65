"""A contact in which one unknown drifts: each draw is filtered through the series of measurements.

A particle is a contact with constant unknowns except for the drifting one. A Kalman filter on a
table of the emulator follows the drift, so that the course is integrated out analytically and
particles are drawn from the constant unknowns alone.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.inference.forward import ForwardModel, Law
from asperity.inference.likelihood import (
    EMULATED_HEIGHT_STD,
    EXPONENT_STD,
    GAIN_STD,
    SIZES,
    WEIGHTS,
    law_correlations,
)
from asperity.inference.observations import LogMeasurement, point_similarity
from asperity.inference.outputs import CLR
from asperity.inference.priors import si
from asperity.inference.settings import OPERATING, TEMPERATURE
from asperity.inference.visits import CHANNELS, SeriesMeasurement, VisitSeries

KNOTS = 17  # of the table along the range of the drifting unknown
DRIFT_STD = 0.3  # of the initial drift, in shares of the range over the series
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
SLOPE_DRAWS = 256  # prior draws for the slopes over operating conditions
SLOPE_STEPS = (0.02, 0.02, 2.0)  # in ln load, ln speed and temperature [K]


class CourseLikelihood(NamedTuple):
    """Log-likelihood of all measurements for constant and for changing contacts, shape (n,)."""

    steady: Field
    changing: Field


class FilteredState(NamedTuple):
    """State at the last visit: share of the range, drift over the series, error of CRF.

    The error is that at the main operating point. `mean` (n, 3), `covariance` (n, 3, 3); `path`
    (n, visits) is the filtered share at each visit, `log` the log-likelihood (n,).
    """

    log: Field
    mean: Field
    covariance: Field
    path: Field


class DriftParameters(NamedTuple):
    """Unknowns of a drift, shape (n,) each; `sizes` are the law's errors relative to CRF."""

    sizes: Mapping[str, Field]
    diffusion: Field
    scatter: Field
    correlation: Field

    @classmethod
    def from_normal(cls, z: Field) -> "DriftParameters":
        """Convert standard normal numbers (n, PARAMETERS)."""
        own = np.array(SIZES)[np.minimum((len(SIZES) * ndtr(z[:, :3])).astype(int), len(SIZES) - 1)]
        thresholds = np.cumsum(CORRELATION_PROBABILITIES)[:-1]
        return cls(
            dict(zip(CHANNELS, own.T, strict=True)),
            DIFFUSION * np.exp(DIFFUSION_SPREAD * z[:, 3]),
            SCATTER * np.exp(SCATTER_SPREAD * z[:, 4]),
            np.array(CORRELATIONS)[np.searchsorted(thresholds, ndtr(z[:, 5]))],
        )


@dataclass(frozen=True)
class DriftModel:
    """Likelihood of a series for a contact in which one unknown drifts.

    Parameters
    ----------
    forward : at the operating points of the series
    series : the measurements and their times
    law : of the spring
    drifting : key of the unknown that changes
    drift : mean and standard deviation of the initial drift, in shares of the unknown's range over
        the series
    """

    forward: ForwardModel
    series: VisitSeries
    law: Law
    drifting: str
    drift: tuple[float, float] = (0.0, DRIFT_STD)

    def __post_init__(self) -> None:
        known = [unknown.key for unknown in self.forward.setting.contact]
        if self.drifting not in known:
            raise BadInput(
                f"the drifting quantity must be among {', '.join(known)}, got {self.drifting!r}"
            )

    @property
    def column(self) -> int:
        """Index of the drifting unknown."""
        return [unknown.key for unknown in self.forward.setting.unknowns].index(self.drifting)

    @property
    def dims(self) -> int:
        """Number of unknowns of a contact and its drift."""
        return self.forward.dims + PARAMETERS

    @property
    def measurements(self) -> tuple[SeriesMeasurement, ...]:
        """Measurements translated to their nominal operating points, by the mean prior slope.

        `slope_scatter` is the deviation of the slopes, an error common to all measurements.
        """
        return self._translated[0]

    @property
    def slope_scatter(self) -> Mapping[tuple[str, int], Field]:
        """Standard deviation (points,) of slopes by channel and axis: load, speed, temperature."""
        return self._translated[1]

    @cached_property
    def _translated(
        self,
    ) -> tuple[tuple[SeriesMeasurement, ...], Mapping[tuple[str, int], Field]]:
        offsets = np.array([entry.offset for entry in self.series.measurements])
        z = np.random.default_rng(0).standard_normal((SLOPE_DRAWS, self.forward.dims))
        base, slopes = self.forward.predict(z, self.law, deviations=False), {}
        for axis in np.flatnonzero(np.any(offsets != 0.0, axis=0)):
            forward, steps = _stepped(self.forward, int(axis))
            stepped = forward.predict(z, self.law, deviations=False)
            slopes[int(axis)] = {
                key: (getattr(stepped, key) - getattr(base, key)) / steps for key in CHANNELS
            }
        measurements = []
        for entry in self.series.measurements:
            change = sum(
                entry.offset[axis] * float(np.mean(slope[entry.channel][:, entry.point]))
                for axis, slope in slopes.items()
            )
            measurements.append(
                entry._replace(
                    measured=LogMeasurement(entry.measured.value - change, entry.measured.std)
                )
            )
        slope_scatter = {
            (key, axis): slope[key].std(axis=0)
            for axis, slope in slopes.items()
            for key in CHANNELS
        }
        return tuple(measurements), slope_scatter

    def __call__(self, z: Field) -> CourseLikelihood:
        """Return the log-likelihood of contacts (n, dims), constant and changing."""
        table = ChannelTable.from_contacts(self, z)
        return CourseLikelihood(
            *(self._filter(table, changing=changing).log for changing in (False, True))
        )

    def filter_series(self, z: Field, *, changing: bool) -> FilteredState:
        """Return the filtered state of contacts (n, dims) at the last visit."""
        return self._filter(ChannelTable.from_contacts(self, z), changing=changing)

    def _filter(self, table: "ChannelTable", *, changing: bool) -> FilteredState:
        points = len(self.forward.points)
        state = _KalmanState.initial(
            table,
            point_similarity(self.forward.points),
            self.drift if changing else (0.0, 0.0),
            self.slope_scatter,
        )
        diffusion = table.parameters.diffusion if changing else np.zeros(len(table.share))
        path = np.empty((len(table.share), len(self.series.x)))
        time = 0.0
        for entry in self.measurements:
            if entry.time > time:
                state.advance(
                    entry.time - time, diffusion, table.parameters, len(self.series.x) - 1
                )
                time = entry.time
            state.update(entry, table, points)
            path[:, entry.visit] = state.mean[:, SHARE]
        kept = [SHARE, DRIFT, FIRST_ERROR + self.series.main_point]
        return FilteredState(
            state.log, state.mean[:, kept], state.covariance[:, kept][:, :, kept], path
        )


class ChannelTable(NamedTuple):
    """Predicted channels along the range of the drifting unknown, (n, points, knots)."""

    channels: Mapping[str, Field]
    errors: Mapping[str, Field]  # covariance of the emulator's errors, (n, points, points)
    log_force: Field  # derivative with respect to the law's exponent, (n, points), mean 0
    share: Field  # initial share of the range, (n,)
    parameters: DriftParameters

    @classmethod
    def from_contacts(cls, model: DriftModel, z: Field) -> "ChannelTable":
        """Tabulate the emulator's means; its deviations are those at the initial share."""
        forward, column = model.forward, model.column
        contacts, unknown = z[:, : forward.dims], forward.setting.unknowns[column]
        initial = forward.predict(contacts, model.law)
        along = along_range(contacts, column, unknown.at_share(np.linspace(0.0, 1.0, KNOTS)))
        prediction = forward.predict(along, model.law, deviations=False)
        tables = {key: _by_knots(getattr(prediction, key)) for key in CHANNELS}
        correlations = forward.correlations(contacts, model.law)
        heights = np.nan_to_num(initial.crfa_std)
        errors = {
            key: std[:, :, None] * std[:, None, :] * correlations[key]
            for key, std in (
                ("crf", initial.crf_std),
                ("damping", initial.damping_std),
                ("crfa", heights),
            )
        }
        diagonal = np.arange(heights.shape[1])
        errors["crfa"][:, diagonal, diagonal] += np.where(
            np.isnan(initial.crfa_std), 0.0, EMULATED_HEIGHT_STD**2
        )
        return cls(
            tables,
            errors,
            initial.log_force - initial.log_force.mean(axis=1, keepdims=True),
            unknown.share(contacts[:, column]),
            DriftParameters.from_normal(z[:, forward.dims :]),
        )

    def interpolate(self, channel: str, point: int, share: Field) -> tuple[Field, Field]:
        """Return value and slope at shares of the range; constant beyond its ends."""
        return between_knots(self.channels[channel][:, point], share)


def _stepped(forward: ForwardModel, axis: int) -> tuple[ForwardModel, Field]:
    """Return the model one step away in load (0), speed (1) or temperature (2), and the steps.

    Steps are taken towards the middle of the range.
    """
    key = (*OPERATING, TEMPERATURE)[axis]
    entry = next(entry for entry in forward.setting.operating if entry.key == key)
    low, high = (si(end, entry.unit) for end in (entry.low, entry.high))
    name = ("load_n", "entrainment_m_s", "temperature_k")[axis]
    steps, points = np.empty(len(forward.points)), []
    for number, point in enumerate(forward.points):
        value = getattr(point, name)
        steps[number] = SLOPE_STEPS[axis] if value < 0.5 * (low + high) else -SLOPE_STEPS[axis]
        stepped = value + steps[number] if axis == 2 else value * math.exp(steps[number])
        points.append(replace(point, **{name: stepped}))
    return replace(forward, points=tuple(points)), steps


def along_range(z: Field, column: int, knots: Field) -> Field:
    """Return contacts with one unknown at each of the knots, stacked: (knots n, dims)."""
    along = np.tile(z, (len(knots), 1))
    along[:, column] = np.repeat(knots, len(z))
    return along


def _by_knots(values: Field) -> Field:
    """Reshape from (knots n, points) to (n, points, knots)."""
    return np.ascontiguousarray(np.moveaxis(values.reshape(KNOTS, -1, values.shape[1]), 0, -1))


def between_knots(table: Field, share: Field) -> tuple[Field, Field]:
    """Interpolate tables (n, knots) over 0 to 1 at shares (n,) or (n, m): values and slopes."""
    last = table.shape[1] - 1
    position = np.clip(share, 0.0, 1.0) * last
    index = np.minimum(position.astype(int), last - 1)
    rows = np.arange(len(table)).reshape(-1, *[1] * (share.ndim - 1))
    low, high = table[rows, index], table[rows, index + 1]
    inside = (share >= 0.0) & (share <= 1.0)
    return low + (position - index) * (high - low), np.where(inside, last * (high - low), 0.0)


@dataclass
class _KalmanState:
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
    ) -> "_KalmanState":
        """Return the prior state: the share is the contact's, all else is uncertain."""
        count, points = len(table.share), len(similarity)
        before = FIRST_ERROR + len(CHANNELS) * points
        mean = np.zeros((count, before + len(slope_scatter)))
        mean[:, SHARE], mean[:, DRIFT] = table.share, drift[0]
        variance = np.zeros_like(mean)
        variance[:, DRIFT], variance[:, EXPONENT], variance[:, GAIN] = (
            drift[1] ** 2,
            EXPONENT_STD**2,
            GAIN_STD**2,
        )
        parameters = table.parameters
        variance[:, SLOW_SCATTER] = parameters.scatter**2 * (parameters.correlation > 0.0)
        variance[:, before:] = 1.0
        covariance = np.zeros((*mean.shape, mean.shape[1]))
        diagonal = np.arange(mean.shape[1])
        covariance[:, diagonal, diagonal] = variance
        for number, channel in enumerate(CHANNELS):
            own = slice(FIRST_ERROR + number * points, FIRST_ERROR + (number + 1) * points)
            size = WEIGHTS[channel] * parameters.sizes[channel]
            correlations = law_correlations(table.log_force, similarity)
            covariance[:, own, own] += (
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
        channel, point, parameters = entry.channel, entry.point, table.parameters
        error = FIRST_ERROR + CHANNELS.index(channel) * points + point
        noise = entry.measured.std**2 + (WEIGHTS[channel] * parameters.scatter) ** 2
        if channel == "crf":  # correlated scatter is in the state
            noise = np.where(parameters.correlation > 0.0, entry.measured.std**2, noise)
        slope_states, slope_factors = self._slope_states(entry)
        share = self.mean[:, SHARE]
        for iteration in range(ITERATIONS):
            value, slope = table.interpolate(channel, point, share)
            expected = (
                value
                + slope * (self.mean[:, SHARE] - share)
                + self.mean[:, error]
                + self.mean[:, slope_states] @ slope_factors
            )
            from_share = slope[:, None] * self.covariance[:, SHARE]
            from_errors = (
                self.covariance[:, error] + self.covariance[:, :, slope_states] @ slope_factors
            )
            if channel == "crf":
                from_errors += (
                    table.log_force[:, point, None] * self.covariance[:, EXPONENT]
                    + self.covariance[:, SLOW_SCATTER]
                )
                expected = (
                    expected
                    + table.log_force[:, point] * self.mean[:, EXPONENT]
                    + self.mean[:, SLOW_SCATTER]
                )
            elif channel == "crfa":
                from_errors += self.covariance[:, GAIN]
                expected = expected + self.mean[:, GAIN]
            across = from_share + from_errors
            total = (
                slope * across[:, SHARE]
                + across[:, error]
                + across[:, slope_states] @ slope_factors
                + noise
            )
            if channel == "crf":
                total += table.log_force[:, point] * across[:, EXPONENT] + across[:, SLOW_SCATTER]
            elif channel == "crfa":
                total += across[:, GAIN]
            residual = entry.measured.value - expected
            if iteration == 0:
                log = -0.5 * (residual**2 / total + np.log(2.0 * np.pi * total))
            share = self.mean[:, SHARE] + across[:, SHARE] / total * residual
        self.log += log
        gain = across / total[:, None]
        self.mean += gain * residual[:, None]
        self.covariance -= gain[:, :, None] * across[:, None, :]

    def _slope_states(self, entry: SeriesMeasurement) -> tuple[list[int], Field]:
        """Return the slope states that affect a measurement off its nominal point, and factors."""
        first = self.mean.shape[1] - len(self.slope_scatter)
        affected = [
            (first + number, entry.offset[axis] * scatter[entry.point])
            for number, ((channel, axis), scatter) in enumerate(self.slope_scatter.items())
            if channel == entry.channel and entry.offset[axis]
        ]
        return [state for state, _ in affected], np.array([factor for _, factor in affected])


def tabulated(forward: ForwardModel, z: Field, column: int, point: int) -> tuple[Field, Field]:
    """Tabulate CLR on its scale along the drifting range, (n, knots), and its deviation, (n,)."""
    local = ForwardModel(forward.setting, forward.emulator, forward.points[point : point + 1])
    contacts = z[:, : forward.dims]
    knots = forward.setting.unknowns[column].at_share(np.linspace(0.0, 1.0, KNOTS))
    mean, _ = local.emulate(along_range(contacts, column, knots), [CLR], deviations=False)[CLR]
    _, std = local.emulate(contacts, [CLR])[CLR]
    return _by_knots(mean)[:, 0], std[:, 0]
