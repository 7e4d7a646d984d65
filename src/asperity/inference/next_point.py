"""Which load and speed to run next: where what would be heard tells most, by what is known now."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import logsumexp

from asperity.arrays import Field
from asperity.inference.forward import LAWS, Forward
from asperity.inference.observations import Point
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.posterior import Draws
from asperity.inference.priors import Unknown
from asperity.inference.settings import LOAD, SPEED, Setting

ACROSS = 5  # loads and speeds that are asked
CONTACTS = 400  # possible ones that a point is to tell apart
HEARD = 4  # times each of them is heard
USUAL_STD = 2e-3  # relative, of a frequency to be heard
USUAL_DAMPING_STD = 0.05
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
        axes.append([float(Unknown("", entry).to_si(np.array(entry.value(s)))) for s in np.linspace(0.0, 1.0, across)])
    return tuple((load, speed) for load in axes[0] for speed in axes[1])


def expected_information(
    forward: Forward, draws: Draws, candidates: tuple[tuple[float, float], ...], *, seed: int
) -> list[NextPoint]:
    """What one more recording at each candidate is expected to tell of all unknowns together, in bits.

    By nested Monte Carlo: the mean of ln p(heard | contact) - ln p(heard) over possible contacts and what they would
    show, with errors of measurement, emulator and law; times the probability that there is a line to be heard.
    """
    rng = np.random.default_rng([seed, 6])
    rows = rng.choice(len(draws.z), min(CONTACTS, len(draws.z)), replace=False)
    known = [point for point in forward.points if not np.isnan(point.crf.value)]
    temperature = known[0].temperature_k if known else None
    std = float(np.median([point.crf.std for point in known])) if known else USUAL_STD
    points = tuple(Point(load, speed, temperature) for load, speed in candidates)
    there = replace(forward, points=points)
    crf, crf_std, damping, damping_std = (np.empty((len(rows), len(points))) for _ in range(4))
    heard = np.ones(crf.shape, dtype=bool)
    for number, law in enumerate(LAWS):
        of_law = draws.law[rows] == number
        if of_law.any():
            emulated = there.emulated(draws.z[rows[of_law]], there.outputs(law, heights=False))
            shown = there.shown_by(draws.z[rows[of_law]], law, emulated, heights=False)
            if CLR in emulated:
                heard[of_law] = OUTPUTS[CLR].back(emulated[CLR][0]) > SILENT
            crf[of_law], crf_std[of_law] = shown.crf, shown.crf_std
            damping[of_law], damping_std[of_law] = shown.damping, shown.damping_std
    of_crf, of_damping = (draws.sizes[key][rows][:, None] for key in ("crf", "damping"))
    channels = [(crf, np.sqrt(crf_std**2 + std**2 + of_crf**2))]
    channels.append((damping, np.sqrt(damping_std**2 + USUAL_DAMPING_STD**2 + of_damping**2)))
    gains = [
        _information([(mean[:, number], spread[:, number]) for mean, spread in channels], rng)
        for number in range(len(points))
    ]
    shares = heard.mean(axis=0)
    return [
        NextPoint(load, speed, float(share * gain))
        for (load, speed), gain, share in zip(candidates, gains, shares, strict=True)
    ]


def _information(channels: list[tuple[Field, Field]], rng: np.random.Generator) -> float:
    """Mutual information, in bits, of a contact's number and what it shows, of independent normal channels."""
    count = len(channels[0][0])
    total = np.zeros((HEARD, count, count))
    own = np.zeros((HEARD, count))
    for mean, spread in channels:
        heard = mean + spread * rng.standard_normal((HEARD, count))
        own += -0.5 * ((heard - mean) / spread) ** 2 - np.log(spread)
        total += -0.5 * ((heard[:, :, None] - mean) / spread) ** 2 - np.log(spread)
    marginal = logsumexp(total, axis=2) - np.log(count)
    return max(float(np.mean(own - marginal) / np.log(2.0)), 0.0)
