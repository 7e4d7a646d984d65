"""Parameters of a roughness profile, ISO 21920-2."""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.surface.bearing import bearing_curve, core_heights

SECTIONS = 5  # section lengths per evaluation length, default of ISO 21920-3
_DISCRIMINATION = 0.1  # smallest height of a peak or pit, over Rz


@dataclass(frozen=True, slots=True)
class ProfileParameters:
    """Parameters of ISO 21920-2 about the mean of the valid points.

    `ra`, `rq` arithmetic and root mean square height [m]; `rsk`, `rku` skewness and kurtosis;
    `rp`, `rv`, `rz` mean peak height, mean pit depth and their sum, means over five section lengths
    [m]; `rt` total height [m]; `rsm` mean spacing of profile elements [m], nan for fewer than two;
    `rdq` root mean square slope, from neighbouring points; `rk`, `rpk`, `rvk` core height, reduced
    peak height and pit depth [m]; `rmr1`, `rmr2` material ratios of the core.
    """

    ra: float
    rq: float
    rsk: float
    rku: float
    rp: float
    rv: float
    rz: float
    rt: float
    rsm: float
    rdq: float
    rk: float
    rpk: float
    rvk: float
    rmr1: float
    rmr2: float


def profile_parameters(heights: Field, spacing: float) -> ProfileParameters:
    """Compute the parameters of a levelled, optionally filtered, profile.

    Parameters
    ----------
    heights : shape (n,) [m], nan for missing points
    spacing : distance of the points [m]

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.surface import profile_parameters
    >>> x = np.arange(5000) * 1e-6
    >>> p = profile_parameters(1e-6 * np.sin(2.0 * np.pi * x / 0.25e-3), spacing=1e-6)
    >>> f"Ra {p.ra * 1e6:.3f} um, Rsm {p.rsm * 1e3:.3f} mm"
    'Ra 0.637 um, Rsm 0.250 mm'
    """
    z = heights - np.nanmean(heights)
    rq = float(np.sqrt(np.nanmean(z**2)))
    sections = [section[np.isfinite(section)] for section in np.array_split(z, SECTIONS)]
    sections = [section for section in sections if section.size]
    rp = float(np.mean([section.max() for section in sections]))
    rv = float(np.mean([-section.min() for section in sections]))
    core = core_heights(bearing_curve(z))
    return ProfileParameters(
        ra=float(np.nanmean(np.abs(z))),
        rq=rq,
        rsk=float(np.nanmean(z**3)) / rq**3 if rq else float("nan"),
        rku=float(np.nanmean(z**4)) / rq**4 if rq else float("nan"),
        rp=rp,
        rv=rv,
        rz=rp + rv,
        rt=float(np.nanmax(z) - np.nanmin(z)),
        rsm=_mean_spacing(z[np.isfinite(z)], _DISCRIMINATION * (rp + rv)) * spacing,
        rdq=float(np.sqrt(np.nanmean(np.diff(z) ** 2))) / spacing,
        rk=core.core,
        rpk=core.peaks,
        rvk=core.pits,
        rmr1=core.upper,
        rmr2=core.lower,
    )


def _mean_spacing(z: Field, threshold: float) -> float:
    """Return Rsm in points: mean distance of the mean-line crossings from a pit to a peak."""
    side = np.where(z > threshold, 1, np.where(z < -threshold, -1, 0))
    marked = np.flatnonzero(side)
    rises = np.flatnonzero((side[marked[:-1]] < 0) & (side[marked[1:]] > 0))
    crossings = []
    for pit, peak in zip(marked[rises], marked[rises + 1], strict=True):
        last = pit + int(np.flatnonzero(z[pit:peak] <= 0.0)[-1])
        crossings.append(last - z[last] / (z[last + 1] - z[last]))
    return float(np.mean(np.diff(crossings))) if len(crossings) > 1 else float("nan")
