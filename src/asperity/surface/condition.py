"""From what an instrument gave to roughness: turn, drop outliers, remove the form, filter.

The map keeps its pixels and its missing cells; putting it onto a contact grid is left to
`asperity.surface.prepare`. Every step says in one sentence what it did.
"""

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, require_positive
from asperity.surface.model import MeasuredSurface, length_text

Form = Literal["none", "plane", "quadratic", "cubic", "quartic", "cylinder"]
Outliers = Literal["keep", "remove"]

_DEGREES: dict[str, int] = {"none": 0, "plane": 1, "quadratic": 2, "cubic": 3, "quartic": 4}
_OUTLYING = 10.0  # robust standard deviations off the median of the neighbours; 1 in 1e23 by chance
_NEIGHBOURS = 5  # cells a side of the neighbourhood
_POINTS_TO_FIT = 20_000  # of a cylinder: five parameters need no more
SIGMA_OVER_CUTOFF = (
    np.sqrt(np.log(2.0) / 2.0) / np.pi
)  # ISO 16610: a Gaussian that passes half there


def condition_surface(
    measured: MeasuredSurface,
    *,
    form: Form = "quadratic",
    turn: bool = False,
    outliers: Outliers = "keep",
    s_filter: float | None = None,
    l_filter: float | None = None,
) -> tuple[MeasuredSurface, tuple[str, ...]]:
    """Roughness about a zero mean on the pixels of the measurement, and what was done, a sentence each.

    Parameters
    ----------
    measured : what the instrument gave
    form : what to remove by least squares, see `level`
    turn : mount the surface a quarter turn counter-clockwise, so that what ran along x runs along y
    outliers : "remove" makes a missing cell of every height that stands off its neighbourhood; "keep" only counts them
    s_filter, l_filter : nesting indices [m] of the Gaussian filters of ISO 16610-61 (of a profile, ISO 16610-21):
        waves shorter than the first and longer than the second are removed, half of those just there

    Raises
    ------
    BadInput
        for an unknown option, or filters that the map cannot show.
    """
    if outliers not in get_args(Outliers):
        raise BadInput(f"outliers must be one of {', '.join(get_args(Outliers))}, got {outliers!r}")
    steps = []
    if turn:
        measured = measured.turned()
        steps.append("turned by 90 degrees: what the file has along x runs along y")
    outlying = find_outliers(measured)
    count = int(np.count_nonzero(outlying))
    if count and outliers == "remove":
        measured = replace(measured, heights=np.where(outlying, np.nan, measured.heights))
        steps.append(
            f"removed {count} outliers, more than {_OUTLYING:g} robust deviations off their neighbours"
        )
    elif count:
        steps.append(
            f"kept {count} heights more than {_OUTLYING:g} robust deviations off their neighbours; "
            "outliers = remove drops them"
        )
    measured, levelling = level(measured, form)
    steps.append(levelling)
    shortest = 2.0 * max(measured.grid.spacing)
    for name, cutoff in (("s_filter", s_filter), ("l_filter", l_filter)):
        if cutoff is not None and not shortest <= require_positive(name, cutoff, "m"):
            raise BadInput(
                f"{name} must be at least 2 pixels, {length_text(shortest)}, got {length_text(cutoff)}; leave it out"
            )
    if s_filter is not None and l_filter is not None and not s_filter < l_filter:
        raise BadInput(
            f"s_filter must be shorter than l_filter, got {length_text(s_filter)} and {length_text(l_filter)}; "
            "swap them"
        )
    for which, cutoff in (("shorter", s_filter), ("longer", l_filter)):
        if cutoff is None:
            continue
        before, heights = measured.sq, _low_pass(measured, cutoff)
        if which == "longer":
            heights = measured.heights - heights
            heights -= np.nanmean(heights)
        measured = replace(measured, heights=heights)
        steps.append(
            f"removed waves {which} than {length_text(cutoff)} by the Gaussian filter of ISO 16610 "
            f"(Sq {length_text(before)} before, {length_text(measured.sq)} after)"
        )
    return measured, tuple(steps)


def level(measured: MeasuredSurface, form: Form) -> tuple[MeasuredSurface, str]:
    """Remove the least-squares form and the mean; returns the levelled map and what was done.

    Missing cells take no part and stay missing. `form`: "none" (the mean only), a polynomial of
    the first to fourth degree ("plane", "quadratic", "cubic", "quartic"), or "cylinder", of any
    axis and tilt.

    Raises
    ------
    BadInput
        for a form that is not in that list, or fewer valid cells than the form has terms.
    """
    if form not in get_args(Form):
        raise BadInput(f"form must be one of {', '.join(get_args(Form))}, got {form!r}")
    known = np.isfinite(measured.heights)
    if np.count_nonzero(known) < 15:
        raise BadInput(
            f"{measured.name} has too few valid heights to remove a {form} form; use form none or measure again"
        )
    offset = np.mean(
        measured.heights[known]
    )  # some files carry centimetres of it; least squares should not
    heights = measured.heights - offset
    detail = ""
    if form == "cylinder":
        shape, radius = _cylinder(measured, heights, known)
        detail = f" of {length_text(abs(radius))} radius{'' if radius > 0.0 else ', hollow'},"
    else:
        shape = _polynomial(heights, known, _DEGREES[form])
    left = heights - shape
    levelled = replace(measured, heights=left - np.mean(left[known]))
    if form == "none":
        return levelled, "removed the mean height and no form"
    height = length_text(float(np.ptp(shape)))
    sq = f"Sq {length_text(measured.sq)} before, {length_text(levelled.sq)} after"
    return (
        levelled,
        f"removed a {form} form{detail} of {height} peak to valley from the whole map ({sq})",
    )


def _polynomial(heights: Field, known: Mask, degree: int) -> Field:
    x, y = np.meshgrid(*(np.linspace(-1.0, 1.0, n) for n in heights.shape), indexing="ij")
    powers = [(i, total - i) for total in range(degree + 1) for i in range(total, -1, -1)]
    terms = np.stack([x**i * y**j for i, j in powers], axis=-1)
    coefficients, *_ = np.linalg.lstsq(terms[known], heights[known], rcond=None)
    return np.asarray(terms @ coefficients)


def _cylinder(measured: MeasuredSurface, heights: Field, known: Mask) -> tuple[Field, float]:
    """The cylinder nearest in height, and its radius [m], negative where it is hollow.

    Across its axis, at distance w from it, the height is z0 + t v - sqrt(1 + t^2) (R - sqrt(R^2 -
    w^2)), where v runs along the axis in the plane and t is its tilt.
    """
    grid = measured.grid
    scale = max(grid.extent) / 2.0
    x, y = np.meshgrid(grid.x / scale, grid.y / scale, indexing="ij")
    coarse = np.flatnonzero(known)[:: max(1, np.count_nonzero(known) // _POINTS_TO_FIT)]
    at_x, at_y, z = x.flat[coarse], y.flat[coarse], heights.flat[coarse] / scale

    def shape(p: Field, x: Field, y: Field) -> Field:
        z0, slope, tilt, angle, curvature = p
        across, along = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
        # w = across - w0 with w0 = slope/curvature; written so that a plane (curvature 0) is no
        # special case
        flat = np.sqrt(np.maximum(1.0 - slope**2, 1e-12))
        round_ = np.sqrt(np.maximum(1.0 - (slope - curvature * across) ** 2, 1e-12))
        bow = across * (2.0 * slope - curvature * across) / (flat + round_)
        return np.asarray(z0 + tilt * along + np.sqrt(1.0 + tilt**2) * bow)

    quadratic = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    powers = [
        power for power in quadratic if measured.uniform is None or power[measured.uniform] == 0
    ]
    fitted, *_ = np.linalg.lstsq(
        np.stack([at_x**i * at_y**j for i, j in powers], axis=-1), z, rcond=None
    )
    c = dict.fromkeys(quadratic, 0.0) | dict(zip(powers, fitted, strict=True))
    gradient = np.array([c[1, 0], c[0, 1]])
    bends, axes = np.linalg.eigh(np.array([[2.0 * c[2, 0], c[1, 1]], [c[1, 1], 2.0 * c[0, 2]]]))
    steep = int(np.argmax(np.abs(bends)))
    direction = axes[:, steep]
    angle = float(np.arctan2(direction[1], direction[0]))
    slope, tilt = gradient @ direction, gradient @ np.array([-direction[1], direction[0]])
    start = np.array([c[0, 0], np.clip(slope, -0.9, 0.9), tilt, angle, -bends[steep]])

    # the profile of a cylinder says nothing of its axis
    free = [0, 1, 2, 3, 4] if measured.uniform is None else [0, 1, 4]

    def parameters(freed: Field) -> Field:
        values = start.copy()
        values[free] = freed
        return values

    def misfit(freed: Field) -> Field:
        return np.asarray(shape(parameters(freed), at_x, at_y) - z)

    nearest = scipy.optimize.least_squares(
        misfit, start[free], x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    best = parameters(nearest.x)
    curvature = float(best[4])
    return scale * shape(best, x, y), scale / curvature if curvature else np.inf


def find_outliers(measured: MeasuredSurface) -> Mask:
    """Cells whose height is far off the median of their neighbours, in robust deviations of all such differences."""
    known = np.isfinite(measured.heights)
    heights = np.where(known, measured.heights, np.nanmedian(measured.heights))
    size = [1 if axis == measured.uniform else _NEIGHBOURS for axis in range(2)]
    off = np.abs(measured.heights - scipy.ndimage.median_filter(heights, size=size, mode="nearest"))
    deviation = 1.4826 * float(np.nanmedian(off))
    return (
        np.asarray(known & (np.nan_to_num(off) > _OUTLYING * deviation))
        if deviation > 0.0
        else known & False
    )


def _low_pass(measured: MeasuredSurface, cutoff: float) -> Field:
    """The waviness: a Gaussian mean over the cells that are known, at the edges over those inside."""
    known = np.isfinite(measured.heights)
    weighted, weights = np.where(known, measured.heights, 0.0), known.astype(np.float64)
    for axis, pixel in enumerate(measured.grid.spacing):
        if axis != measured.uniform:
            sigma = SIGMA_OVER_CUTOFF * cutoff / pixel
            weighted, weights = (
                scipy.ndimage.gaussian_filter1d(field, sigma, axis=axis, mode="constant")
                for field in (weighted, weights)
            )
    return np.where(known, weighted / np.where(known, weights, 1.0), np.nan)
