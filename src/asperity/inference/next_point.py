"""Choice of the next operating point by expected information gain."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from asperity.core.arrays import Field
from asperity.core.documents import JsonObject
from asperity.inference.forward import LAWS, ForwardModel
from asperity.inference.likelihood import SIZES, PredictiveMixture, predictive_mixture
from asperity.inference.observations import ObservationPoint
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.posterior import Draws
from asperity.inference.priors import Unknown
from asperity.inference.settings import LOAD, SPEED, Setting

GRID_SIZE = 5  # candidate loads and speeds along each axis
CONTACTS = 400  # posterior draws used for the expected information
TYPICAL_STD: Mapping[str, float] = {"crf": 2e-3, "damping": 0.05}  # relative, of a measurement
MIN_CLR = 0.01  # CLR below which no resonance of the asperities is detected


@dataclass(frozen=True, slots=True)
class NextPoint:
    """A load [N], an entrainment speed [m/s] and the expected information gain there."""

    load_n: float
    entrainment_m_s: float
    information_bits: float

    def scalars(self) -> JsonObject:
        """Return the JSON output."""
        return {
            "load_n": self.load_n,
            "entrainment_m_s": self.entrainment_m_s,
            "information_bits": self.information_bits,
        }


def candidate_points(setting: Setting, count: int = GRID_SIZE) -> tuple[tuple[float, float], ...]:
    """Return a grid of loads and speeds over the ranges of the case."""
    axes = []
    for key in (LOAD, SPEED):
        entry = next(entry for entry in setting.operating if entry.key == key)
        axes.append(
            [
                float(Unknown("", entry).to_si(np.array(entry.value(s))))
                for s in np.linspace(0.0, 1.0, count)
            ]
        )
    return tuple((load, speed) for load in axes[0] for speed in axes[1])


class PredictedRecordings(NamedTuple):
    """Predicted measurements of posterior draws at operating points, (..., contacts, points).

    `channels` are ln CRF and ln ζ; `detectable` is True where a resonance is expected.
    """

    channels: Mapping[str, PredictiveMixture]
    detectable: Field


def predict_recordings(
    forward: ForwardModel, draws: Draws, points: Sequence[ObservationPoint]
) -> PredictedRecordings:
    """Predict measurements of posterior draws at points, with errors conditional on the data."""
    recorded = tuple(point for point in forward.points if not np.isnan(point.crf.value))
    extended = replace(forward, points=(*recorded, *points))
    shape = len(SIZES), len(draws.z), len(points)
    channels = {key: PredictiveMixture(*(np.empty(shape) for _ in range(3))) for key in TYPICAL_STD}
    detectable = np.ones(shape[1:], dtype=bool)
    for number, law in enumerate(LAWS):
        of_law = draws.law == number
        if not of_law.any():
            continue
        emulated = extended.emulate(draws.z[of_law], extended.required_outputs(law, heights=False))
        prediction = extended.predict_from(draws.z[of_law], law, emulated, heights=False)
        if CLR in emulated:
            detectable[of_law] = OUTPUTS[CLR].back(emulated[CLR][0][:, len(recorded) :]) > MIN_CLR
        for key, mixture in channels.items():
            by_law = predictive_mixture(prediction, extended.points, key)
            for array, values in zip(mixture, by_law, strict=True):
                array[:, of_law] = values[:, :, len(recorded) :]
    return PredictedRecordings(channels, detectable)


def expected_information(
    forward: ForwardModel, draws: Draws, candidates: tuple[tuple[float, float], ...], *, seed: int
) -> list[NextPoint]:
    """Return the expected information gain of one recording at each candidate, in bits.

    Nested Monte Carlo: the mean of ln p(measurement | contact) - ln p(measurement) over posterior
    draws and simulated measurements, times the probability of a detectable resonance. Errors of
    emulator and law are conditional on past measurements and do not count as information.
    """
    rng = np.random.default_rng([seed, 6])
    rows = rng.choice(len(draws.z), min(CONTACTS, len(draws.z)), replace=False)
    recorded = [point for point in forward.points if not np.isnan(point.crf.value)]
    temperature = recorded[0].temperature_k if recorded else None
    measured = dict(TYPICAL_STD)
    if recorded:
        measured["crf"] = float(np.median([point.crf.std for point in recorded]))
    points = [ObservationPoint(load, speed, temperature) for load, speed in candidates]
    predicted = predict_recordings(forward, draws.select_rows(rows), points)
    # common random numbers for all candidates
    random = {key: (rng.random(len(rows)), rng.standard_normal(len(rows))) for key in TYPICAL_STD}
    gains = [
        _mutual_information(
            [
                (at_point(mixture, number), measured[key], random[key])
                for key, mixture in predicted.channels.items()
            ]
        )
        for number in range(len(points))
    ]
    shares = predicted.detectable.mean(axis=0)
    return [
        NextPoint(load, speed, float(share * gain))
        for (load, speed), gain, share in zip(candidates, gains, shares, strict=True)
    ]


def at_point(mixture: PredictiveMixture, index: int) -> PredictiveMixture:
    """Return the mixture at one of the points, (sizes, contacts)."""
    return PredictiveMixture(*(array[:, :, index] for array in mixture))


def _mutual_information(
    channels: Sequence[tuple[PredictiveMixture, float, tuple[Field, Field]]],
) -> float:
    """Return the mutual information of contact and measurement over independent channels, in bits.

    Each channel is a predictive mixture, the measurement's standard deviation, and uniform and
    normal random numbers, one per contact.
    """
    count = channels[0][0].mean.shape[1]
    total = np.zeros((count, count))
    for mixture, measured, (uniform, normal) in channels:
        component = (
            np.sum(np.cumsum(np.exp(mixture.log_share[:-1]), axis=0) < uniform, axis=0),
            np.arange(count),
        )
        simulated = mixture.mean[component] + np.hypot(mixture.std[component], measured) * normal
        total += mixture.log_density(simulated[:, None], measured)
    gain = np.diag(total) - (logsumexp(total, axis=1) - np.log(count))
    return max(float(np.mean(gain) / np.log(2.0)), 0.0)
