"""Order tracking: resample a vibration at constant shaft angle, by a tacho or a speed channel.

`tacho` evaluates pulses. The orders of machine elements are in `machine`.
"""

from typing import NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput

OVERSAMPLING = 2  # before the spline, which is accurate up to a third of its sampling rate
MIN_SPEED = 0.25  # of the mean speed; slower turning would need ever finer samples


class Turning(NamedTuple):
    """Shaft angle [turns], shape (samples,), nan if unknown, and mean speed `speed_hz`.

    `remarks` are sentences on corrections.
    """

    turns: Field
    speed_hz: float
    remarks: tuple[str, ...] = ()


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
