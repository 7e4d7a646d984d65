"""The bearing curve of Abbott and Firestone, of maps and profiles alike, and the core, peaks and pits read off it.

Source: ISO 25178-2 and ISO 21920-2, material ratio curve and Sk (Rk) parameters.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field

_POINTS = 10_001  # of the curve
_SECANT = 0.4  # share of the surface that the flattest secant spans


@dataclass(frozen=True, slots=True)
class BearingCurve:
    """`height` [m from the mean] over the `share` of the surface that lies above it, 0 to 1."""

    share: Field
    height: Field

    def material_ratio(self, height: float) -> float:
        """Smr(c), Rmr(c): the share of the surface above `height` [m from the mean]."""
        return float(np.interp(-height, -self.height, self.share))

    def height_at(self, share: float) -> float:
        """Smc(p), Rmc(p): the height [m from the mean] above which that share of the surface lies."""
        return float(np.interp(share, self.share, self.height))


class CoreHeights(NamedTuple):
    """Sk, Spk, Svk [m], Smr1 and Smr2; for a profile Rk and so on."""

    core: float
    peaks: float
    pits: float
    upper: float
    lower: float


def bearing_curve(heights: Field) -> BearingCurve:
    """The curve of heights of any shape [m]; NaN are left out, the mean is removed."""
    known = heights[np.isfinite(heights)]
    share = np.linspace(0.0, 1.0, _POINTS)
    ordered = np.sort(
        known - known.mean(), axis=None
    )  # once: numpy's quantile is fifty times slower for so many
    return BearingCurve(
        share, np.interp((1.0 - share) * (known.size - 1), np.arange(known.size), ordered)
    )


def core_heights(curve: BearingCurve) -> CoreHeights:
    """Core, peaks and pits: the flattest 40 % of the curve carry a line, whose ends at 0 and 1 bound the core."""
    share, height = curve.share, curve.height
    span = round(_SECANT * (_POINTS - 1))
    first = int(np.argmin(height[:-span] - height[span:]))
    slope, top = np.polyfit(share[first : first + span + 1], height[first : first + span + 1], 1)
    bottom = top + slope
    upper, lower = curve.material_ratio(top), curve.material_ratio(bottom)
    peaks = np.trapezoid(np.maximum(height - top, 0.0), share)
    pits = np.trapezoid(np.maximum(bottom - height, 0.0), share)
    return CoreHeights(
        float(-slope),
        float(2.0 * peaks / upper) if upper > 0.0 else 0.0,
        float(2.0 * pits / (1.0 - lower)) if lower < 1.0 else 0.0,
        upper,
        lower,
    )
