"""Whether lines on several sensors are one, and what the errors of sensors have in common.

The lines are fitted by `separation`; what is made of them is left to `sensors`.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.resonance import Resonance
from asperity.resonance.separation import Heard, Joint, Lines
from asperity.resonance.spectrum_model import shares_of

APART, APART_WIDTHS = (
    3.0,
    0.25,
)  # deviations, and half-power widths, by both of which two lines are not one


class Agreement(NamedTuple):
    """How sensors agree, as a series has settled it.

    `common` is the share of their errors that two have in common, `wider` by how much their lines
    differ more than their deviations say, `established` who has mostly heard the line that others
    hear too.
    """

    common: Mapping[tuple[str, str], float]
    wider: float
    established: tuple[str, ...]


class Fit(NamedTuple):
    """Recordings fitted on the same sensors: what each hears of them, the lines, and how likely they are elsewhere."""

    names: list[str]
    numbers: list[int]
    heard: list[Heard]
    lines: Lines
    elsewhere: Field  # -ln likelihood of a line at each template, all sensors together

    def joint(self, sensor: int) -> Joint:
        """The fit as one sensor has it."""
        heard = self.heard[sensor]
        own = self.lines.own[sensor]
        return Joint(heard.at._replace(own=own), 0.0, np.full_like(own, np.nan), heard.doubt)


def differ(one: Resonance, other: Resonance) -> bool:
    """Whether two lines are not one."""
    apart = abs(one.crf_hz - other.crf_hz)
    width = 2.0 * max(one.damping_ratio * one.crf_hz, other.damping_ratio * other.crf_hz)
    return apart > max(APART * float(np.hypot(one.crf_std, other.crf_std)), APART_WIDTHS * width)


def shares_in_common(names: Sequence[str], common: Mapping[tuple[str, str], float]) -> Field:
    """The share of their errors that sensors have in common, (sensors, sensors); 0 with themselves."""
    shares = np.zeros((len(names), len(names)))
    for (i, first), (j, second) in combinations(enumerate(names), 2):
        shares[i, j] = shares[j, i] = common.get((first, second), common.get((second, first), 1.0))
    return shares


def in_common(pair: tuple[str, str], fits: Sequence[Fit]) -> float:
    """The correlation of what is left of two sensors' spectra where it moves their line, and its own deviation."""
    product, weights, squares, powers = 0.0, 0.0, 0.0, np.zeros(2)
    for fit in fits:
        if not set(pair) <= set(fit.names):
            continue
        felt, off = [], []
        for name in pair:
            sensor = fit.names.index(name)
            blocks, joint = fit.heard[sensor].blocks, fit.joint(sensor)
            relative, expected = shares_of(blocks, joint.parameters)
            felt.append(np.sqrt(blocks.weight) * np.abs(relative[:, 1]))
            off.append(np.sqrt(blocks.weight) * (blocks.density / expected - 1.0))
        both = felt[0] * felt[1]
        product += float(np.sum(both * off[0] * off[1]))
        powers += [np.sum(both * one**2) for one in off]
        weights += float(np.sum(both))
        squares += float(np.sum(both**2))
    if not np.all(powers > 0.0):
        return np.nan
    return float(np.clip(product / np.sqrt(np.prod(powers)) + np.sqrt(squares) / weights, 0.0, 1.0))
