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

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.inference.forward import ForwardModel, Law
from asperity.inference.kalman_filter import (
    DRIFT,
    FIRST_ERROR,
    KNOTS,
    PARAMETERS,
    SHARE,
    ChannelTable,
    DriftParameters,
    KalmanState,
)
from asperity.inference.likelihood import EMULATED_HEIGHT_STD
from asperity.inference.observations import LogMeasurement, point_similarity
from asperity.inference.outputs import CLR
from asperity.inference.priors import Unknown, si
from asperity.inference.settings import OPERATING, TEMPERATURE
from asperity.inference.visits import CHANNELS, SeriesMeasurement, VisitSeries

DRIFT_STD = 0.3  # of the initial drift, in shares of the range over the series
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
        allowed = [unknown.key for unknown in self.forward.setting.contact]
        if self.drifting not in allowed:
            raise BadInput(
                f"the drifting quantity must be among {', '.join(allowed)}, got {self.drifting!r}"
            )

    @property
    def column(self) -> int:
        """Index of the drifting unknown."""
        return [unknown.key for unknown in self.forward.setting.unknowns].index(self.drifting)

    @property
    def unknown(self) -> Unknown:
        """The drifting unknown."""
        return self.forward.setting.unknowns[self.column]

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
        base = self.forward.predict(z, self.law, deviations=False)
        slopes = {}
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
        table = _channel_table(self, z)
        return CourseLikelihood(
            *(self._filter(table, changing=changing).log for changing in (False, True))
        )

    def filter_series(self, z: Field, *, changing: bool) -> FilteredState:
        """Return the filtered state of contacts (n, dims) at the last visit."""
        return self._filter(_channel_table(self, z), changing=changing)

    def _filter(self, table: ChannelTable, *, changing: bool) -> FilteredState:
        points = len(self.forward.points)
        state = KalmanState.initial(
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
        retained = [SHARE, DRIFT, FIRST_ERROR + self.series.main_point]
        return FilteredState(
            state.log, state.mean[:, retained], state.covariance[:, retained][:, :, retained], path
        )


def _channel_table(model: DriftModel, z: Field) -> ChannelTable:
    """Tabulate the emulator's means; its deviations are those at the initial share."""
    forward = model.forward
    column = model.column
    unknown = model.unknown
    contacts = z[:, : forward.dims]
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
    return ChannelTable(
        tables,
        errors,
        initial.log_force - initial.log_force.mean(axis=1, keepdims=True),
        unknown.share(contacts[:, column]),
        DriftParameters.from_normal(z[:, forward.dims :]),
    )


def _stepped(forward: ForwardModel, axis: int) -> tuple[ForwardModel, Field]:
    """Return the model one step away in load (0), speed (1) or temperature (2), and the steps.

    Steps are taken towards the middle of the range.
    """
    key = (*OPERATING, TEMPERATURE)[axis]
    entry = next(entry for entry in forward.setting.operating if entry.key == key)
    low, high = (si(end, entry.unit) for end in (entry.low, entry.high))
    name = ("load_n", "entrainment_m_s", "temperature_k")[axis]
    steps = np.empty(len(forward.points))
    points = []
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


def tabulated(forward: ForwardModel, z: Field, column: int, point: int) -> tuple[Field, Field]:
    """Tabulate CLR on its scale along the drifting range, (n, knots), and its deviation, (n,)."""
    local = ForwardModel(forward.setting, forward.emulator, forward.points[point : point + 1])
    contacts = z[:, : forward.dims]
    knots = forward.setting.unknowns[column].at_share(np.linspace(0.0, 1.0, KNOTS))
    mean, _ = local.emulate(along_range(contacts, column, knots), [CLR], deviations=False)[CLR]
    _, std = local.emulate(contacts, [CLR])[CLR]
    return _by_knots(mean)[:, 0], std[:, 0]
