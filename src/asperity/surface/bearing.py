"""Bearing (Abbott-Firestone) curve of maps and profiles, and its core, peak and pit heights.

Source: ISO 25178-2 and ISO 21920-2, material ratio curve and Sk (Rk) parameters.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, real_array

_POINTS = 10_001  # of the curve
_SECANT = 0.4  # share of the surface spanned by the flattest secant


@dataclass(frozen=True, slots=True)
class BearingCurve:
    """Bearing curve: `height` [m from the mean] against the `share` of the surface above it."""

    share: Field
    height: Field

    def material_ratio(self, height: float) -> float:
        """Return Smr(c) or Rmr(c), the share of the surface above `height` [m from the mean]."""
        return float(np.interp(-height, -self.height, self.share))

    def height_at(self, share: float) -> float:
        """Return Smc(p) or Rmc(p), the height [m from the mean] exceeded by `share`."""
        return float(np.interp(share, self.share, self.height))


class CoreHeights(NamedTuple):
    """Sk, Spk, Svk [m], Smr1 and Smr2; Rk, Rpk ... for a profile."""

    core: float
    peaks: float
    pits: float
    upper: float
    lower: float


def bearing_curve(heights: Field) -> BearingCurve:
    """Compute the bearing curve of heights [m] of any shape, about their mean; nan is ignored.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.surface import bearing_curve
    >>> curve = bearing_curve(np.random.default_rng(1).standard_normal((200, 200)) * 1e-6)
    >>> f"{np.interp(0.2, curve.share, curve.height) * 1e6:.2f} um at 20 % of the area"
    '0.83 um at 20 % of the area'
    """
    heights = real_array("heights", heights)
    finite = heights[np.isfinite(heights)]
    share = np.linspace(0.0, 1.0, _POINTS)
    ordered = np.sort(finite - finite.mean(), axis=None)  # np.quantile is fifty times slower
    return BearingCurve(
        share, np.interp((1.0 - share) * (finite.size - 1), np.arange(finite.size), ordered)
    )


def core_heights(curve: BearingCurve) -> CoreHeights:
    """Compute core, peak and pit heights.

    A line is fitted to the flattest 40 % of the curve; its values at 0 and 1 bound the core.
    """
    share, height = curve.share, curve.height
    span = round(_SECANT * (_POINTS - 1))
    first = int(np.argmin(height[:-span] - height[span:]))
    slope, top = np.polyfit(share[first : first + span + 1], height[first : first + span + 1], 1)
    bottom = top + slope
    upper = curve.material_ratio(top)
    lower = curve.material_ratio(bottom)
    peaks = np.trapezoid(np.maximum(height - top, 0.0), share)
    pits = np.trapezoid(np.maximum(bottom - height, 0.0), share)
    return CoreHeights(
        float(-slope),
        float(2.0 * peaks / upper) if upper > 0.0 else 0.0,
        float(2.0 * pits / (1.0 - lower)) if lower < 1.0 else 0.0,
        upper,
        lower,
    )
