"""Which load and speed to run next: where what would be heard tells most, by what is known now."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logsumexp

from asperity.core.arrays import Field
from asperity.inference.forward import LAWS, Forward
from asperity.inference.likelihood import SIZES, PredictiveMixture, predictive_mixture
from asperity.inference.observations import OperatingPoint
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.posterior import Draws
from asperity.inference.priors import Unknown
from asperity.inference.settings import LOAD, SPEED, Setting

ACROSS = 5  # loads and speeds that are asked
CONTACTS = 400  # possible ones that a point is to tell apart
USUAL: Mapping[str, float] = {
    "crf": 2e-3,
    "damping": 0.05,
}  # relative deviations of what is to be heard
SILENT = 0.01  # CLR below which asperities alone make no line that anybody hears


@dataclass(frozen=True, slots=True)
class NextPoint:
    """A load [N] and an entrainment speed [m/s], and what is expected to be learned there."""

    load_n: float
    entrainment_m_s: float
    information_bits: float

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "load_n": self.load_n,
            "entrainment_m_s": self.entrainment_m_s,
            "information_bits": self.information_bits,
        }


def candidate_points(setting: Setting, across: int = ACROSS) -> tuple[tuple[float, float], ...]:
    """Loads and speeds that the case permits, on a grid from end to end."""
    axes = []
    for key in (LOAD, SPEED):
        entry = next(entry for entry in setting.operating if entry.key == key)
        axes.append(
            [
                float(Unknown("", entry).to_si(np.array(entry.value(s))))
                for s in np.linspace(0.0, 1.0, across)
            ]
        )
    return tuple((load, speed) for load in axes[0] for speed in axes[1])


class PredictedRecordings(NamedTuple):
    """What possible contacts would show at operating points, by all that was heard; arrays of (..., contacts, points).

    `channels` are ln CRF and ln ζ, `heard` is whether there is a line.
    """

    channels: Mapping[str, PredictiveMixture]
    heard: Field


def predict_recordings(
    forward: Forward, draws: Draws, places: Sequence[OperatingPoint]
) -> PredictedRecordings:
    """What contacts of the posterior would show at places: of the errors there is known what was heard of them."""
    known = tuple(point for point in forward.points if not np.isnan(point.crf.value))
    there = replace(forward, points=(*known, *places))
    shape = len(SIZES), len(draws.z), len(places)
    channels = {key: PredictiveMixture(*(np.empty(shape) for _ in range(3))) for key in USUAL}
    heard = np.ones(shape[1:], dtype=bool)
    for number, law in enumerate(LAWS):
        of_law = draws.law == number
        if not of_law.any():
            continue
        emulated = there.emulated(draws.z[of_law], there.outputs(law, heights=False))
        shown = there.shown_by(draws.z[of_law], law, emulated, heights=False)
        if CLR in emulated:
            heard[of_law] = OUTPUTS[CLR].back(emulated[CLR][0][:, len(known) :]) > SILENT
        for key, whole in channels.items():
            for array, own in zip(whole, predictive_mixture(shown, there.points, key), strict=True):
                array[:, of_law] = own[:, :, len(known) :]
    return PredictedRecordings(channels, heard)


def expected_information(
    forward: Forward, draws: Draws, candidates: tuple[tuple[float, float], ...], *, seed: int
) -> list[NextPoint]:
    """What one more recording at each candidate is expected to tell of all unknowns together, in bits.

    By nested Monte Carlo: the mean of ln p(heard | contact) - ln p(heard) over possible contacts
    and what they would show, with errors of measurement, emulator and law; times the probability
    that there is a line to be heard. What was heard says of each contact how far emulator and law
    are off there: that is no news, nor is it how large the law's error is.
    """
    rng = np.random.default_rng([seed, 6])
    rows = rng.choice(len(draws.z), min(CONTACTS, len(draws.z)), replace=False)
    known = [point for point in forward.points if not np.isnan(point.crf.value)]
    temperature = known[0].temperature_k if known else None
    measured = dict(USUAL)
    if known:
        measured["crf"] = float(np.median([point.crf.std for point in known]))
    places = [OperatingPoint(load, speed, temperature) for load, speed in candidates]
    shown = predict_recordings(forward, draws.taken(rows), places)
    chances = {
        key: (rng.random(len(rows)), rng.standard_normal(len(rows))) for key in USUAL
    }  # the same everywhere
    gains = [
        _information(
            [
                (at_place(one, number), measured[key], chances[key])
                for key, one in shown.channels.items()
            ]
        )
        for number in range(len(places))
    ]
    shares = shown.heard.mean(axis=0)
    return [
        NextPoint(load, speed, float(share * gain))
        for (load, speed), gain, share in zip(candidates, gains, shares, strict=True)
    ]


def at_place(whole: PredictiveMixture, place: int) -> PredictiveMixture:
    """At one of the points: (sizes, contacts)."""
    return PredictiveMixture(*(array[:, :, place] for array in whole))


def _information(channels: Sequence[tuple[PredictiveMixture, float, tuple[Field, Field]]]) -> float:
    """Mutual information, in bits, of a contact's number and what it shows, of independent channels.

    Each is what contacts would show, what a measurement adds, and chance: uniform and normal
    numbers, one a contact.
    """
    count = channels[0][0].mean.shape[1]
    total = np.zeros((count, count))
    for one, measured, (uniform, normal) in channels:
        size = (
            np.sum(np.cumsum(np.exp(one.log_share[:-1]), axis=0) < uniform, axis=0),
            np.arange(count),
        )
        heard = one.mean[size] + np.hypot(one.std[size], measured) * normal
        total += one.log_density(heard[:, None], measured)
    told = np.diag(total) - (logsumexp(total, axis=1) - np.log(count))
    return max(float(np.mean(told) / np.log(2.0)), 0.0)
