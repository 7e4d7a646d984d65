"""Agreement of several sensors: which lines are the same, and which errors they have in common."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.core.signals import Spectrum
from asperity.resonance.line_fit import CommonLines, JointFit, SensorData
from asperity.resonance.resonance import Resonance
from asperity.resonance.series import has_no_vibration
from asperity.resonance.spectrum_model import model_shares

# two lines differ if their distance exceeds both so many standard deviations and so many widths
DIFFERENT_DEVIATIONS = 3.0
DIFFERENT_WIDTHS = 0.25

SpectraBySensor = Mapping[str, Sequence[Spectrum | None]]  # one per recording, None if missing
MasksBySensor = Mapping[str, Sequence[Mask | None]]


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorLines:
    """The contact resonance of each recording from several sensors.

    `resonances` has one per recording, its height that on the first sensor, nan where that does not
    detect it; `detected_on` the names of the sensors that detect its line; `alone` the results of
    each sensor's own series, None where it has no spectrum. `common` is the share of the sensors'
    errors that is common to them, nan where it cannot be estimated. `moved` lists recordings from
    which a sensor's transfer differs, by number, and the sensor.
    """

    resonances: tuple[Resonance, ...]
    detected_on: tuple[tuple[str, ...], ...]
    alone: Mapping[str, tuple[Resonance | None, ...]]
    common: float
    moved: tuple[tuple[int, str], ...] = ()


class Agreement(NamedTuple):
    """Agreement of sensors, estimated from a series.

    `common` is the share of errors that two sensors have in common, `widening` the factor by which
    their lines differ more than their deviations state, `established` the sensors that mostly
    detected the line of others.
    """

    common: Mapping[tuple[str, str], float]
    widening: float
    established: tuple[str, ...]


class SensorFit(NamedTuple):
    """Recordings fitted on the same sensors: data, common lines, costs of the templates."""

    names: list[str]
    numbers: list[int]
    sensors: list[SensorData]
    lines: CommonLines
    template_costs: Field  # -ln likelihood of a line at each template, all sensors together

    def joint(self, sensor: int) -> JointFit:
        """Return the fit of one sensor."""
        data = self.sensors[sensor]
        values = self.lines.own[sensor]
        parameters = data.parameters._replace(own=values)
        return JointFit(parameters, 0.0, np.full_like(values, np.nan), data.transfer_covariance)


def recordings_with_vibration(
    spectra: SpectraBySensor, band_hz: tuple[float, float]
) -> dict[str, list[int]]:
    """Return the numbers of the recordings in which each sensor has vibration in the band."""
    return {
        name: [
            number
            for number, spectrum in enumerate(series)
            if spectrum is not None and not has_no_vibration(spectrum, band_hz)
        ]
        for name, series in spectra.items()
    }


def lines_differ(line: Resonance, other: Resonance) -> bool:
    """Return whether two lines are at different frequencies."""
    distance = abs(line.crf_hz - other.crf_hz)
    width = 2.0 * max(line.damping_ratio * line.crf_hz, other.damping_ratio * other.crf_hz)
    return distance > max(
        DIFFERENT_DEVIATIONS * float(np.hypot(line.crf_std, other.crf_std)),
        DIFFERENT_WIDTHS * width,
    )


def common_error_matrix(names: Sequence[str], common: Mapping[tuple[str, str], float]) -> Field:
    """Return the shares of common errors, (sensors, sensors), with a zero diagonal."""
    shares = np.zeros((len(names), len(names)))
    for (i, first), (j, second) in combinations(enumerate(names), 2):
        shares[i, j] = shares[j, i] = common.get((first, second), common.get((second, first), 1.0))
    return shares


def common_error_share(pair: tuple[str, str], fits: Sequence[SensorFit]) -> float:
    """Return the correlation of two sensors' residuals near their line, plus its standard error."""
    product = 0.0
    weights = 0.0
    squares = 0.0
    powers = np.zeros(2)
    for fit in fits:
        if not set(pair) <= set(fit.names):
            continue
        sensitivities, residuals = zip(*(_residuals(fit, name) for name in pair), strict=True)
        weight = sensitivities[0] * sensitivities[1]
        product += float(np.sum(weight * residuals[0] * residuals[1]))
        powers += [np.sum(weight * residual**2) for residual in residuals]
        weights += float(np.sum(weight))
        squares += float(np.sum(weight**2))
    if not np.all(powers > 0.0):
        return np.nan
    return float(np.clip(product / np.sqrt(np.prod(powers)) + np.sqrt(squares) / weights, 0.0, 1.0))


def _residuals(fit: SensorFit, name: str) -> tuple[Field, Field]:
    """Return the sensitivity of one sensor's spectra to frequency, and their residuals."""
    sensor = fit.names.index(name)
    blocks = fit.sensors[sensor].blocks
    relative, expected = model_shares(blocks, fit.joint(sensor).parameters)
    weight = np.sqrt(blocks.weight)
    return weight * np.abs(relative[:, 1]), weight * (blocks.density / expected - 1.0)
