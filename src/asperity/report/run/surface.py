"""Figure of a measured surface: map, profile, bearing curve, radial and directional spectrum."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.report.drawing import display, name_axes
from asperity.report.run.contact import draw_height_distribution
from asperity.report.style import BLUE, DASHED, GREEN, GREY, ON_PAGE, VERMILION, write_figure
from asperity.surface import (
    MeasuredSurface,
    SurfaceDescription,
    SurfaceSpectrum,
    bearing_curve,
    distinct_heights,
    surface_spectrum,
)


def surface_map(description: SurfaceDescription, path: Path) -> Path:
    """Write a PNG of a levelled surface: map, profile, bearing curve and spectra.

    Raises
    ------
    BadInput
        for a path that does not end in .png or is not writable.
    """
    if path.suffix.lower() != ".png":
        raise BadInput(f"the map is written as PNG, got {path.name}; name a file that ends in .png")
    return write_figure(_surface_figure(description), path, dpi=130)


@ON_PAGE.drawing()
def _surface_figure(description: SurfaceDescription) -> Figure:
    levelled = description.levelled
    spectrum = surface_spectrum(description.levelled)
    figure = Figure(figsize=(11.0, 7.4), layout="constrained")
    layout = figure.add_gridspec(2, 3, height_ratios=(1.25, 1.0))
    if levelled.is_map:
        _draw_levelled_map(figure, figure.add_subplot(layout[0, :2]), levelled)
        _draw_lay(figure.add_subplot(layout[0, 2], projection="polar"), spectrum)
        left = figure.add_subplot(layout[1, 0])
        title = "Profile through the middle, along x"
        _draw_profile(left, levelled, title)
    else:
        _draw_profile(figure.add_subplot(layout[0, :]), levelled, "Levelled profile")
        left = figure.add_subplot(layout[1, 0])
        rms = f"{description.profile_letter}q"
        draw_height_distribution(left, levelled.profile, rms)
    curve, radial = (figure.add_subplot(layout[1, column]) for column in (1, 2))
    _draw_bearing_curve(curve, description)
    _draw_radial_spectrum(radial, spectrum, profile=not levelled.is_map)
    title = f"{description.path.name}: {_size_text(description)}"
    figure.suptitle(title, x=0.01, ha="left", parse_math=False)
    return figure


def _size_text(description: SurfaceDescription) -> str:
    """Return Sq or Rq, the number of pixels or points and their spacing as text."""
    levelled = description.levelled
    pixel = quantity("cell_m")
    sq = quantity("sq_m").text(description.parameters.sq)
    (dx, dy) = levelled.grid.spacing
    if levelled.is_map:
        nx, ny = levelled.grid.cells
        return f"Sq {sq}, {nx} × {ny} pixels of {pixel.number(dx)} × {pixel.text(dy)}"
    points = f"{levelled.profile.size} points every {pixel.text(min(dx, dy))}"
    return f"profile, {description.profile_letter}q {sq}, {points}"


def _draw_levelled_map(figure: Figure, axes: Axes, levelled: MeasuredSurface) -> None:
    heights = display("surface_height", levelled.heights)
    width, height = display("y_m", np.array(levelled.grid.extent))
    limit = float(np.nanpercentile(np.abs(heights), 99.5)) or 1.0
    axes.set_facecolor("#d946ef")  # missing pixels; not a colour of the scale
    image = axes.imshow(
        heights.T,
        origin="lower",
        extent=(0.0, width, 0.0, height),
        cmap="cividis",
        vmin=-limit,
        vmax=limit,
        interpolation="none" if max(heights.shape) < 600 else "antialiased",
    )
    missing = (
        f", {quantity('share').text(levelled.missing)} not measured (pink)"
        if levelled.missing
        else ""
    )
    axes.set(
        title=f"Levelled heights{missing}",
        xlabel=quantity("surface_x_m").axis,
        ylabel=quantity("y_m").axis,
    )
    figure.colorbar(image, ax=axes, label=quantity("height_m").axis, extend="both", shrink=0.9)


def _draw_profile(axes: Axes, levelled: MeasuredSurface, title: str) -> None:
    profile = display("height_m", levelled.profile)
    spacing = display("surface_x_m", levelled.grid.spacing[1 if levelled.uniform == 0 else 0])
    axes.plot((np.arange(profile.size) + 0.5) * spacing, profile, color=BLUE, linewidth=0.8)
    axes.axhline(0.0, color=GREY, linewidth=0.8, linestyle=DASHED)
    name_axes(axes, "surface_x_m", "height_m", title=title)
    axes.set_xlim(0.0, profile.size * spacing)


def _draw_bearing_curve(axes: Axes, description: SurfaceDescription) -> None:
    curve = bearing_curve(distinct_heights(description.levelled))
    parameters = description.parameters
    sq = quantity("sk_m")
    prefix = "S" if description.profile is None else description.profile_letter
    axes.plot(display("material_ratio", curve.share), display("height_m", curve.height), color=BLUE)
    top, bottom = (
        display("height_m", curve.height_at(share)) for share in (parameters.smr1, parameters.smr2)
    )
    axes.axhspan(bottom, top, color="#e5e7eb", linewidth=0)
    core, peaks, pits = (
        sq.text(height) for height in (parameters.sk, parameters.spk, parameters.svk)
    )
    axes.text(
        0.97,
        0.96,
        f"{prefix}k {core} (shaded)\n{prefix}pk {peaks}, {prefix}vk {pits}",
        transform=axes.transAxes,
        ha="right",
        va="top",
        fontsize=8.5,
    )
    inner = [display("height_m", curve.height_at(share)) for share in (0.999, 0.001)]
    if inner[0] < inner[1]:  # outliers would compress the rest of the curve
        axes.set_ylim(
            inner[0] - 0.1 * (inner[1] - inner[0]), inner[1] + 0.4 * (inner[1] - inner[0])
        )
    name_axes(axes, "material_ratio", "height_m", title="Bearing curve")
    axes.set_xlim(0.0, 100.0)


def _draw_radial_spectrum(axes: Axes, spectrum: SurfaceSpectrum, *, profile: bool) -> None:
    positive = spectrum.density > 0.0
    if not positive.any():
        axes.text(0.5, 0.5, "perfectly smooth", transform=axes.transAxes, ha="center")
    else:
        wavelength = display("wavelength_m", 2.0 * np.pi / spectrum.wavenumber[positive])
        density = spectrum.density[positive]
        axes.loglog(wavelength, density, color=VERMILION, marker=".", markersize=4)
        axes.invert_xaxis()
    title = "Spectrum of the profile" if profile else "Spectrum, all directions"
    name_axes(
        axes,
        "wavelength_m",
        "profile_power_density" if profile else "surface_power_density",
        title=title,
    )


def _draw_lay(axes: Axes, spectrum: SurfaceSpectrum) -> None:
    angles = np.concatenate([spectrum.lay, spectrum.lay + np.pi, spectrum.lay[:1]])
    share = display("share", np.concatenate([spectrum.share, spectrum.share, spectrum.share[:1]]))
    axes.plot(angles, share, color=GREEN)
    axes.fill(angles, share, color=GREEN, alpha=0.2)
    axes.set_title("Lay: share of Sq² in ridges\nalong this direction [% per 5°]")
    axes.tick_params(labelsize=8)
