"""Conditioning of a measured map: rotation, outliers, form removal and filters.

The map keeps its pixels and missing cells; `asperity.surface.prepare` resamples it onto a contact
grid. Each step is reported in one sentence.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.surface.model import MeasuredSurface, length_text

Form = Literal["none", "plane", "quadratic", "cubic", "quartic", "cylinder"]
Outliers = Literal["keep", "remove"]

_DEGREES: dict[str, int] = {"none": 0, "plane": 1, "quadratic": 2, "cubic": 3, "quartic": 4}
_OUTLIER_THRESHOLD = 10.0  # robust standard deviations from the neighbours' median; chance 1e-23
_NEIGHBOURHOOD = 5  # cells along each side
_MAX_FIT_POINTS = 20_000  # enough for the five parameters of a cylinder
# ISO 16610: standard deviation of the Gaussian with 50 % transmission at the cut-off
SIGMA_OVER_CUTOFF = np.sqrt(np.log(2.0) / 2.0) / np.pi


@dataclass(frozen=True, slots=True, kw_only=True)
class SurfaceConditioning:
    """Settings of the conditioning of a measured map.

    Parameters
    ----------
    form : form to remove by least squares, see `level`
    turn : rotate by 90 degrees counter-clockwise, so that x of the file runs along y
    outliers : "remove" marks outliers as missing cells; "keep" only counts them
    s_filter, l_filter : nesting indices [m] of the Gaussian filters of ISO 16610-61 (of a profile,
        ISO 16610-21), which remove shorter and longer waves; 50 % transmission at the index

    Raises
    ------
    BadInput
        An option is unknown, or `s_filter` is not shorter than `l_filter`.
    """

    form: Form = "quadratic"
    turn: bool = False
    outliers: Outliers = "keep"
    s_filter: float | None = None
    l_filter: float | None = None

    def __post_init__(self) -> None:
        require_choice("outliers", self.outliers, get_args(Outliers))
        require_choice("form", self.form, get_args(Form))
        for name in ("s_filter", "l_filter"):
            if (cutoff := getattr(self, name)) is not None:
                require_positive(name, cutoff, "m")
        shorter = self.s_filter
        longer = self.l_filter
        if shorter is not None and longer is not None and not shorter < longer:
            raise BadInput(
                f"s_filter must be shorter than l_filter, got {length_text(shorter)} and "
                f"{length_text(longer)}; swap them"
            )


DEFAULT_CONDITIONING = SurfaceConditioning()


def condition_surface(
    measured: MeasuredSurface, settings: SurfaceConditioning = DEFAULT_CONDITIONING
) -> tuple[MeasuredSurface, tuple[str, ...]]:
    """Return the roughness about a zero mean on the measured pixels, and a sentence for each step.

    Raises
    ------
    BadInput
        A filter is shorter than two pixels, or too few heights are valid.
    """
    steps = []
    if settings.turn:
        measured = measured.turned()
        steps.append("turned the map by 90 degrees: x of the file runs along y")
    outlying = find_outliers(measured)
    count = int(np.count_nonzero(outlying))
    criterion = f"more than {_OUTLIER_THRESHOLD:g} robust deviations from their neighbours"
    if count and settings.outliers == "remove":
        measured = replace(measured, heights=np.where(outlying, np.nan, measured.heights))
        steps.append(f"removed {count} outliers, {criterion}")
    elif count:
        steps.append(f"kept {count} heights {criterion}; outliers = remove drops them")
    measured, levelling = level(measured, settings.form)
    measured, filtering = _filter_waves(measured, settings)
    return measured, (*steps, levelling, *filtering)


def _filter_waves(
    measured: MeasuredSurface, settings: SurfaceConditioning
) -> tuple[MeasuredSurface, list[str]]:
    steps = []
    shortest = 2.0 * max(measured.grid.spacing)
    for name, cutoff in (("s_filter", settings.s_filter), ("l_filter", settings.l_filter)):
        if cutoff is not None and cutoff < shortest:
            raise BadInput(
                f"{name} must be at least 2 pixels, {length_text(shortest)}, got "
                f"{length_text(cutoff)}; leave it out"
            )
    for removed, cutoff in (("shorter", settings.s_filter), ("longer", settings.l_filter)):
        if cutoff is None:
            continue
        before = measured.sq
        heights = _low_pass(measured, cutoff)
        if removed == "longer":
            heights = measured.heights - heights
            heights -= np.nanmean(heights)
        measured = replace(measured, heights=heights)
        steps.append(
            f"removed waves {removed} than {length_text(cutoff)} by the Gaussian filter of ISO "
            f"16610 (Sq {length_text(before)} before, {length_text(measured.sq)} after)"
        )
    return measured, steps


def level(measured: MeasuredSurface, form: Form) -> tuple[MeasuredSurface, str]:
    """Remove the least-squares form and the mean; return the levelled map and a sentence.

    Missing cells are ignored and stay missing. `form` is "none" (the mean only), a polynomial of
    the first to fourth degree ("plane", "quadratic", "cubic", "quartic"), or "cylinder" with any
    axis and tilt.

    Raises
    ------
    BadInput
        The form is unknown, or fewer cells are valid than the form has terms.
    """
    require_choice("form", form, get_args(Form))
    finite = np.isfinite(measured.heights)
    if np.count_nonzero(finite) < 15:
        raise BadInput(
            f"{measured.name} has too few valid heights to remove a {form} form; use form none or "
            "measure again"
        )
    offset = np.median(measured.heights[finite])  # centimetres in some files: bad for least squares
    heights = measured.heights - offset
    detail = ""
    if form == "cylinder":
        shape, radius = _cylinder(measured, heights, finite)
        detail = f" of {length_text(abs(radius))} radius{'' if radius > 0.0 else ', hollow'},"
    else:
        shape = _polynomial(heights, finite, _DEGREES[form])
    residual = heights - shape
    levelled = replace(measured, heights=residual - np.mean(residual[finite]))
    if form == "none":
        return levelled, "removed the mean height and no form"
    height = length_text(float(np.ptp(shape)))
    sq = f"Sq {length_text(measured.sq)} before, {length_text(levelled.sq)} after"
    return (
        levelled,
        f"removed a {form} form{detail} of {height} peak to valley from the whole map ({sq})",
    )


def _polynomial(heights: Field, finite: Mask, degree: int) -> Field:
    x, y = np.meshgrid(*(np.linspace(-1.0, 1.0, n) for n in heights.shape), indexing="ij")
    powers = [(i, total - i) for total in range(degree + 1) for i in range(total, -1, -1)]
    terms = np.stack([x**i * y**j for i, j in powers], axis=-1)
    coefficients, *_ = np.linalg.lstsq(terms[finite], heights[finite], rcond=None)
    return np.asarray(terms @ coefficients)


def _cylinder(measured: MeasuredSurface, heights: Field, finite: Mask) -> tuple[Field, float]:
    """Fit a cylinder by least squares of height; return its heights and radius [m] (hollow: < 0).

    At the distance w from the axis the height is z0 + t v - sqrt(1 + t^2) (R - sqrt(R^2 - w^2)),
    where v runs along the axis in the plane and t is its tilt.
    """
    grid = measured.grid
    scale = max(grid.extent) / 2.0
    x, y = np.meshgrid(grid.x / scale, grid.y / scale, indexing="ij")
    coarse = np.flatnonzero(finite)[:: max(1, np.count_nonzero(finite) // _MAX_FIT_POINTS)]
    at_x = x.flat[coarse]
    at_y = y.flat[coarse]
    z = heights.flat[coarse] / scale

    start = _cylinder_guess(at_x, at_y, z, measured.uniform)
    # the axis of a cylinder cannot be fitted to a profile
    free = [0, 1, 2, 3, 4] if measured.is_map else [0, 1, 4]

    def parameters(free_values: Field) -> Field:
        values = start.copy()
        values[free] = free_values
        return values

    def residuals(free_values: Field) -> Field:
        return np.asarray(_cylinder_heights(parameters(free_values), at_x, at_y) - z)

    nearest = scipy.optimize.least_squares(
        residuals, start[free], x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    best = parameters(nearest.x)
    curvature = float(best[4])
    return scale * _cylinder_heights(best, x, y), scale / curvature if curvature else np.inf


def _cylinder_heights(p: Field, x: Field, y: Field) -> Field:
    z0, slope, tilt, angle, curvature = p
    across = x * np.cos(angle) + y * np.sin(angle)
    along = y * np.cos(angle) - x * np.sin(angle)
    # w = across - w0, w0 = slope/curvature, in a form that holds for a plane (curvature 0)
    flat = np.sqrt(np.maximum(1.0 - slope**2, 1e-12))
    round_ = np.sqrt(np.maximum(1.0 - (slope - curvature * across) ** 2, 1e-12))
    bow = across * (2.0 * slope - curvature * across) / (flat + round_)
    return np.asarray(z0 + tilt * along + np.sqrt(1.0 + tilt**2) * bow)


def _cylinder_guess(x: Field, y: Field, z: Field, uniform: int | None) -> Field:
    """Return parameters of the cylinder from the principal curvature of a quadratic fit."""
    c = _fit_quadratic(x, y, z, uniform)
    gradient = np.array([c[1, 0], c[0, 1]])
    bends, axes = np.linalg.eigh(np.array([[2.0 * c[2, 0], c[1, 1]], [c[1, 1], 2.0 * c[0, 2]]]))
    steep = int(np.argmax(np.abs(bends)))
    direction = axes[:, steep]
    angle = float(np.arctan2(direction[1], direction[0]))
    slope = gradient @ direction
    tilt = gradient @ np.array([-direction[1], direction[0]])
    return np.array([c[0, 0], np.clip(slope, -0.9, 0.9), tilt, angle, -bends[steep]])


def _fit_quadratic(
    x: Field, y: Field, z: Field, uniform: int | None
) -> dict[tuple[int, int], float]:
    """Return the coefficients of z by the powers of x and y; 0 along a uniform axis."""
    quadratic = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    powers = [power for power in quadratic if uniform is None or power[uniform] == 0]
    fitted, *_ = np.linalg.lstsq(np.stack([x**i * y**j for i, j in powers], axis=-1), z, rcond=None)
    return dict.fromkeys(quadratic, 0.0) | dict(zip(powers, fitted, strict=True))


def find_outliers(measured: MeasuredSurface) -> Mask:
    """Return the mask of cells whose height is far from the median of their neighbours.

    Differences are measured in their robust standard deviation over the map.
    """
    finite = np.isfinite(measured.heights)
    heights = np.where(finite, measured.heights, np.nanmedian(measured.heights))
    size = [1 if axis == measured.uniform else _NEIGHBOURHOOD for axis in range(2)]
    difference = np.abs(
        measured.heights - scipy.ndimage.median_filter(heights, size=size, mode="nearest")
    )
    deviation = 1.4826 * float(np.nanmedian(difference))
    return (
        np.asarray(finite & (np.nan_to_num(difference) > _OUTLIER_THRESHOLD * deviation))
        if deviation > 0.0
        else finite & False
    )


def _low_pass(measured: MeasuredSurface, cutoff: float) -> Field:
    """Return the waviness: the Gaussian mean over valid cells, truncated at the edges."""
    finite = np.isfinite(measured.heights)
    weighted = np.where(finite, measured.heights, 0.0)
    weights = finite.astype(np.float64)
    for axis, pixel in enumerate(measured.grid.spacing):
        if axis != measured.uniform:
            sigma = SIGMA_OVER_CUTOFF * cutoff / pixel
            weighted, weights = (
                scipy.ndimage.gaussian_filter1d(field, sigma, axis=axis, mode="constant")
                for field in (weighted, weights)
            )
    return np.where(finite, weighted / np.where(finite, weights, 1.0), np.nan)
