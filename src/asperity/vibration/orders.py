"""Order tracking: resample a vibration at constant shaft angle, by tacho pulses or a speed channel.

The orders of machine elements are in `machine`.
"""

from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

OVERSAMPLING = 2  # before the spline, which is accurate up to a third of its sampling rate
MIN_PULSES = 4
MIN_SPEED = 0.25  # of the mean speed; slower turning would need ever finer samples
LEVELS = (0.25, 0.75)  # of a tacho's range; a pulse passes both, so that noise makes no pulses
MAX_INTERVAL_RATIO = 4.0  # of pulse intervals to their median, either way


class Turning(NamedTuple):
    """Shaft angle [turns], shape (samples,), nan if unknown, and mean speed `speed_hz`."""

    turns: Field
    speed_hz: float


def turning_by_pulses(pulses: Field, rate_hz: float, per_turn: float = 1.0) -> Turning:
    """Return the shaft angle from the rising edges of a tacho signal.

    Edges are located between samples and interpolated smoothly.

    Raises
    ------
    BadInput
        for fewer than four pulses, irregular pulse intervals, or pulses per turn that are not
        positive.
    """
    require_positive("pulses per turn", per_turn)
    edges = _rising(pulses)
    if edges.size < MIN_PULSES:
        raise BadInput(
            f"the tacho signal has {edges.size} pulses, but {MIN_PULSES} are required; use "
            "another channel"
        )
    intervals = np.diff(edges) / np.median(np.diff(edges))
    if intervals.min() < 1.0 / MAX_INTERVAL_RATIO or intervals.max() > MAX_INTERVAL_RATIO:
        raise BadInput(
            f"the tacho's pulse intervals are {intervals.min():.2g} to {intervals.max():.2g} "
            "times their median, which no shaft produces; use another channel"
        )
    angle = scipy.interpolate.PchipInterpolator(
        edges, np.arange(edges.size) / per_turn, extrapolate=False
    )
    turns = angle(np.arange(pulses.size))
    return Turning(turns, float((edges.size - 1) / per_turn / (edges[-1] - edges[0]) * rate_hz))


def turning_by_speed(speed_hz: Field, rate_hz: float) -> Turning:
    """Return the shaft angle from a channel of the shaft speed [Hz], on the same samples.

    Raises
    ------
    BadInput
        for a shaft that reverses or stops.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.vibration import turning_by_speed
    >>> turning = turning_by_speed(np.full(1000, 25.0), rate_hz=1000.0)
    >>> f"{turning.turns[-1]:.2f} turns, {turning.speed_hz:.1f} Hz"
    '24.98 turns, 25.0 Hz'
    """
    if not np.all(speed_hz > 0.0):
        raise BadInput("the shaft stops or reverses at times; omit its speed channel")
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (speed_hz[1:] + speed_hz[:-1]))]) / rate_hz
    return Turning(turns, float(turns[-1] / (turns.size - 1) * rate_hz))


def resample_to_constant_speed(
    values: Field, turning: Turning, rate_hz: float
) -> tuple[Field, float]:
    """Resample the values to constant shaft speed; return them with their sampling rate [Hz].

    The rate is high enough to avoid aliasing at the slowest turning.

    Raises
    ------
    BadInput
        if the shaft turns at less than a quarter of its mean speed at times.
    """
    finite = np.flatnonzero(np.isfinite(turning.turns))
    turns = turning.turns[finite]
    step = turning.speed_hz / rate_hz
    slowest = float(np.diff(turns).min())
    if slowest < MIN_SPEED * step:
        raise BadInput(
            f"the shaft turns at less than {MIN_SPEED:g} of its mean speed at times; order "
            "tracking is not possible"
        )
    positions = np.interp(np.arange(turns[0], turns[-1], slowest), turns, finite.astype(float))
    oversampled = scipy.signal.resample_poly(values, OVERSAMPLING, 1)
    resampled = scipy.ndimage.map_coordinates(
        oversampled, [OVERSAMPLING * positions], order=3, mode="mirror"
    )
    return np.asarray(resampled), rate_hz * step / slowest


def _rising(pulses: Field) -> Field:
    """Return the positions of rising edges [samples] between which the signal returns to low."""
    # the full range, since a pulse may last two samples of ten thousand
    low = float(np.nanmin(pulses))
    high = float(np.nanmax(pulses))
    middle = 0.5 * (low + high)
    (low_level, high_level) = (low + level * (high - low) for level in LEVELS)
    state = np.where(pulses > high_level, 1, np.where(pulses < low_level, -1, 0))
    decided = np.flatnonzero(state)
    edges = decided[1:][(state[decided[1:]] == 1) & (state[decided[:-1]] == -1)]
    crossings = []
    for edge in edges:
        first = edge
        while pulses[first - 1] > middle:
            first -= 1
        rise = pulses[first] - pulses[first - 1]
        crossings.append(first - (pulses[first] - middle) / rise if rise > 0.0 else float(first))
    return np.array(crossings)
