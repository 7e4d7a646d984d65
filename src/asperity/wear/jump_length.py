"""How far a jump over many over-rollings may go, and what it takes off.

Where bodies touch all over, a wave of height A e^(iqx) carries a pressure of E* q A/2 and wears at
k times it: A falls as exp(-k E* q s/2), s the way slid past it. A step that is longer than the
shortest wave's decay would turn such waves over instead, and feed them. So what a jump takes off
is integrated along it exactly for such waves, by the factor (1 - exp(-z))/z, z = k E* q s/2, on
every wave of the map, and no jump is longer than some such decays: where bodies touch in parts,
waves decay less, and what is spread along it is spread too far. The factor is a mean of Cauchy
densities, so that the mean is kept and nothing is added anywhere. Where the cells end its spectrum
it dips below 0 by some thousandths, which is cut off.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.wear.mechanism import Body


@dataclass(frozen=True, slots=True, kw_only=True)
class Exposure:
    """How one body meets the contact.

    `k` [1/Pa] is the coefficient of its wear by pressure, `overrolling` how often a point of it
    passes [1/s], `width` of the contact along rolling [m], `sliding_speed` [m/s]; `body` says its
    own speed. A body that stands still is always in the contact.
    """

    k: float
    body: Body
    overrolling: float
    width: float
    sliding_speed: float

    @property
    def stands(self) -> bool:
        """Whether the body does not move."""
        return self.body.speed == 0.0

    @property
    def share(self) -> float:
        """Of the time that a point is in the contact."""
        return 1.0 if self.stands else self.overrolling * self.width / abs(self.body.speed)

    def passages(self, length: float) -> float:
        """What a mean rate over positions along a track of that length [m] is multiplied with for depth a second.

        A passage takes the track's length over the speed, of which the mean is the mean over
        positions.
        """
        return 1.0 if self.stands else self.overrolling * length / abs(self.body.speed)

    def decay(
        self, wavenumber: Field | float, seconds: float, reduced_modulus: float
    ) -> Field | float:
        """Z of a wave [1/m] in so many seconds, where bodies touch all over."""
        return (
            0.5 * self.k * reduced_modulus * wavenumber * self.sliding_speed * self.share * seconds
        )


def longest_jump(
    exposures: tuple[Exposure, Exposure],
    rates: tuple[Field, Field],
    height: float,
    decay: float,
    spacing: tuple[float, float],
    reduced_modulus: float,
) -> float:
    """Seconds in which no point loses more than `height` [m], and the shortest wave decays by exp(-`decay`) at most.

    Infinite where nothing wears.
    """
    steepest = math.pi * math.hypot(1.0 / spacing[0], 1.0 / spacing[1])
    decays = max(float(exposure.decay(steepest, 1.0, reduced_modulus)) for exposure in exposures)
    fastest = max(float(rate.max()) for rate in rates)
    return min(
        math.inf if part <= 0.0 else most / part
        for most, part in ((height, fastest), (decay, decays))
    )


def taken_off(
    rate: Field, seconds: float, exposure: Exposure, grid: Grid, reduced_modulus: float
) -> Field:
    """Depth that a jump takes off [m], from the rate at its beginning [m/s]: 0 or more, its mean the rate's."""
    if not rate.any():
        return np.zeros_like(rate)
    waves = [2.0 * np.pi * scipy.fft.fftfreq(grid.cells[0], grid.spacing[0])]
    waves.append(2.0 * np.pi * scipy.fft.rfftfreq(grid.cells[1], grid.spacing[1]))
    z = np.asarray(exposure.decay(np.hypot(waves[0][:, None], waves[1]), seconds, reduced_modulus))
    factor = np.where(z > 0.0, -np.expm1(-z) / np.where(z > 0.0, z, 1.0), 1.0)
    depth = scipy.fft.irfft2(scipy.fft.rfft2(rate * seconds) * factor, s=rate.shape)
    # what dips below 0 is cut off, and the mean put back
    depth = np.maximum(depth, 0.0)
    if is_even(rate):
        depth = np.broadcast_to(depth.mean(axis=0), depth.shape)
    return np.asarray(depth * (rate.mean() * seconds / depth.mean()))


def is_even(heights: Field) -> bool:
    """Whether a track is the same all along: then what wears it is, whatever the position, wears it all along."""
    return bool(np.all(heights == heights[:1]))
