"""A vibration as if its shaft had turned evenly: resampled at constant angle, by tacho pulses or a speed channel.

What turns at which multiple of the shaft's speed is left to `machine`.
"""

from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

FINER = (
    2  # samples in place of one before the spline, which is good to a third of the rate it is given
)
FEWEST_PULSES = 4
# of the mean speed: what turned more slowly is left out, or samples would have to be ever finer
SLOWEST = 0.25
LEVELS = (
    0.25,
    0.75,
)  # of a tacho's range: it has to pass both to count, so that its noise makes no pulses
# times the median interval, or a share of it so small, between pulses: these are no shaft's
UNEVEN = 4.0


class Turning(NamedTuple):
    """The shaft's angle [turns], shape (samples,), nan where it is not known; `speed_hz` in the mean."""

    turns: Field
    speed_hz: float


def turning_by_pulses(pulses: Field, rate_hz: float, per_turn: float = 1.0) -> Turning:
    """The angle by the rising edges of a tacho, each at its place between two samples; smooth in between.

    Raises
    ------
    BadInput
        for fewer than four pulses, pulses that come at no shaft's intervals, or pulses per turn that are not positive.
    """
    require_positive("pulses per turn", per_turn)
    edges = _rising(pulses)
    if edges.size < FEWEST_PULSES:
        raise BadInput(
            f"the tacho shows {edges.size} pulses, and {FEWEST_PULSES} are needed; name another channel"
        )
    between = np.diff(edges) / np.median(np.diff(edges))
    if between.min() < 1.0 / UNEVEN or between.max() > UNEVEN:
        raise BadInput(
            f"the tacho's pulses come at {between.min():.2g} to {between.max():.2g} times their median interval, as no "
            "shaft turns; name another channel"
        )
    angle = scipy.interpolate.PchipInterpolator(
        edges, np.arange(edges.size) / per_turn, extrapolate=False
    )
    turns = angle(np.arange(pulses.size))
    return Turning(turns, float((edges.size - 1) / per_turn / (edges[-1] - edges[0]) * rate_hz))


def turning_by_speed(speed_hz: Field, rate_hz: float) -> Turning:
    """The angle by a channel of the shaft's speed [Hz], on the same samples.

    Raises
    ------
    BadInput
        for a shaft that turns back or stands still.
    """
    if not np.all(speed_hz > 0.0):
        raise BadInput("the shaft stands still or turns back for a time; leave its channel out")
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (speed_hz[1:] + speed_hz[:-1]))]) / rate_hz
    return Turning(turns, float(turns[-1] / (turns.size - 1) * rate_hz))


def steadied(values: Field, turning: Turning, rate_hz: float) -> tuple[Field, float]:
    """The values as if the shaft had turned at its mean speed all the time, and how many of them there are a second.

    Sampled so finely that nothing folds back where the shaft turned slowest. Raises BadInput for a
    shaft that turned at less than a quarter of its mean speed for a time.
    """
    known = np.flatnonzero(np.isfinite(turning.turns))
    turns = turning.turns[known]
    step = turning.speed_hz / rate_hz
    slowest = float(np.diff(turns).min())
    if slowest < SLOWEST * step:
        raise BadInput(
            f"the shaft turned at less than {SLOWEST:g} of its mean speed for a time; its orders are not followed"
        )
    at = np.interp(np.arange(turns[0], turns[-1], slowest), turns, known.astype(float))
    finer = scipy.signal.resample_poly(values, FINER, 1)
    even = scipy.ndimage.map_coordinates(finer, [FINER * at], order=3, mode="mirror")
    return np.asarray(even), rate_hz * step / slowest


def _rising(pulses: Field) -> Field:
    """Places of rising edges, in samples, between which the signal has gone low again."""
    low, high = (
        float(np.nanmin(pulses)),
        float(np.nanmax(pulses)),
    )  # a pulse may be two samples of ten thousand
    middle, (under, over) = 0.5 * (low + high), (low + level * (high - low) for level in LEVELS)
    state = np.where(pulses > over, 1, np.where(pulses < under, -1, 0))
    told = np.flatnonzero(state)
    ends = told[1:][(state[told[1:]] == 1) & (state[told[:-1]] == -1)]
    found = []
    for end in ends:
        first = end
        while pulses[first - 1] > middle:
            first -= 1
        rise = pulses[first] - pulses[first - 1]
        found.append(first - (pulses[first] - middle) / rise if rise > 0.0 else float(first))
    return np.array(found)
