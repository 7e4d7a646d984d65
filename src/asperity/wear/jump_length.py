"""Length of a jump over many over-rollings, and the depth that it removes.

Where the bodies touch everywhere, a wave of height A e^(iqx) carries a pressure of E* q A/2 and
wears at k times that: A decays as exp(-k E* q s/2), with s the sliding distance. An explicit step
longer than the decay of the shortest wave would invert such waves and amplify them. The depth of
a jump is therefore integrated exactly for such waves, by the factor (1 - exp(-z))/z,
z = k E* q s/2, on every wave of the map, and a jump is limited to a few such decays: where the
contact is partial, waves decay more slowly and the depth is smoothed too much. The factor is a
mean of Cauchy densities, so it preserves the mean and adds no material. Because the grid
truncates its spectrum, it undershoots 0 by some thousandths, which are clipped.
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
    """Exposure of one body to the contact.

    `k` [1/Pa] is its wear coefficient by pressure, `overrolling` the over-rolling frequency of a
    point [1/s], `width` that of the contact along rolling [m], `sliding_speed` [m/s]; `body` holds
    its own speed. A body that stands still is always in the contact.
    """

    k: float
    body: Body
    overrolling: float
    width: float
    sliding_speed: float

    @property
    def is_stationary(self) -> bool:
        """True if the body does not move."""
        return self.body.speed == 0.0

    @property
    def contact_time_share(self) -> float:
        """Fraction of time that a point spends in the contact."""
        return 1.0 if self.is_stationary else self.overrolling * self.width / abs(self.body.speed)

    def depth_rate_factor(self, length: float) -> float:
        """Return the factor from the mean rate over a track of `length` [m] to depth per second.

        A passage takes the track's length over the speed; the mean over positions is its mean.
        """
        return 1.0 if self.is_stationary else self.overrolling * length / abs(self.body.speed)

    def decay_exponent(
        self, wavenumber: Field | float, seconds: float, reduced_modulus: float
    ) -> Field | float:
        """Return z of a wave [1/m] after `seconds`, where the bodies touch everywhere."""
        return (
            0.5
            * self.k
            * reduced_modulus
            * wavenumber
            * self.sliding_speed
            * self.contact_time_share
            * seconds
        )


def longest_jump(
    exposures: tuple[Exposure, Exposure],
    rates: tuple[Field, Field],
    height: float,
    decay_exponent: float,
    spacing: tuple[float, float],
    reduced_modulus: float,
) -> float:
    """Return the longest jump [s] allowed by the depth and decay limits; infinite without wear.

    No point loses more than `height` [m], and the shortest wave decays by at most
    exp(-`decay_exponent`).
    """
    steepest = math.pi * math.hypot(1.0 / spacing[0], 1.0 / spacing[1])
    decays = max(
        float(exposure.decay_exponent(steepest, 1.0, reduced_modulus)) for exposure in exposures
    )
    fastest = max(float(rate.max()) for rate in rates)
    return min(
        math.inf if part <= 0.0 else most / part
        for most, part in ((height, fastest), (decay_exponent, decays))
    )


def removed_depth(
    rate: Field, seconds: float, exposure: Exposure, grid: Grid, reduced_modulus: float
) -> Field:
    """Return the depth removed in a jump [m] from the initial rate [m/s]: 0 or more, same mean."""
    if not rate.any():
        return np.zeros_like(rate)
    waves = [2.0 * np.pi * scipy.fft.fftfreq(grid.cells[0], grid.spacing[0])]
    waves.append(2.0 * np.pi * scipy.fft.rfftfreq(grid.cells[1], grid.spacing[1]))
    z = np.asarray(
        exposure.decay_exponent(np.hypot(waves[0][:, None], waves[1]), seconds, reduced_modulus)
    )
    factor = np.where(z > 0.0, -np.expm1(-z) / np.where(z > 0.0, z, 1.0), 1.0)
    depth = scipy.fft.irfft2(scipy.fft.rfft2(rate * seconds) * factor, s=rate.shape)
    # clip the undershoot below 0 and restore the mean
    depth = np.maximum(depth, 0.0)
    if is_uniform_along(rate):
        depth = np.broadcast_to(depth.mean(axis=0), depth.shape)
    return np.asarray(depth * (rate.mean() * seconds / depth.mean()))


def is_uniform_along(heights: Field) -> bool:
    """Return True if a track is uniform along rolling, and so wears uniformly at any position."""
    return bool(np.all(heights == heights[:1]))
