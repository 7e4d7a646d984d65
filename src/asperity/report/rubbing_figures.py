"""The figures of friction, heat and stress in a report: maps, a cut along rolling, and what lies below the surface.

Each function takes results in SI and returns a matplotlib Figure; display units begin here and end here.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from asperity.arrays import Field
from asperity.ehl import ContactSolution, FlashTemperature, Friction, SubsurfaceStress, hertz_stress
from asperity.report.figures import (
    BLUE,
    GIGA,
    GREEN,
    MICRO,
    VERMILION,
    WIDTH,
    colour_bar,
    draw_against_roughness,
    map_figure,
    mark_hertz_zone,
    show_map,
    styled,
)

MEGA = 1e-6  # Pa -> MPa
DEEP = 1.6  # half-widths: how far the section reaches down, and to both sides
SECTION_ROWS = 160


@styled()
def traction_map(solution: ContactSolution, rubbing: Friction) -> Figure:
    """Shear stress on the surfaces; colours go with its root, or the oil's could not be seen beside the asperities'."""
    figure, axes = map_figure(solution.grid.extent)
    values = np.abs(rubbing.shear) * MEGA
    top = float(values.max()) or 1.0
    norm = PowerNorm(0.5, 0.0, top)
    image = show_map(axes, values, solution, cmap="magma", norm=norm)
    mark_hertz_zone(axes, solution, "white")
    axes.set_title(f"Shear stress, friction coefficient {rubbing.coefficient:.4f}")
    bar = colour_bar(figure, axes, image, "shear stress [MPa]")
    bar.set_ticks([float(f"{share * top:.2g}") for share in (0.0, 0.04, 0.16, 0.36, 0.64, 0.98)])
    return figure


@styled()
def temperature_map(solution: ContactSolution, heat: FlashTemperature) -> Figure:
    """The hotter of the two surfaces."""
    figure, axes = map_figure(solution.grid.extent)
    image = show_map(axes, np.maximum(heat.surface_1, heat.surface_2), solution, cmap="inferno")
    mark_hertz_zone(axes, solution, "white")
    axes.set_title(f"Flash temperature, at most {heat.max_k:.1f} K")
    colour_bar(figure, axes, image, "hotter surface above ambient [K]")
    return figure


@styled()
def temperature_line(solution: ContactSolution, heat: FlashTemperature) -> Figure:
    """Both surfaces and the film along rolling, through the hottest cell."""
    hotter = np.maximum(heat.surface_1, heat.surface_2)
    row = int(np.unravel_index(hotter.argmax(), hotter.shape)[1])
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    x, half_width = solution.grid.x * MICRO, solution.conditions.hertz.half_widths[0] * MICRO
    first, second = solution.conditions.surface_speeds
    axes.plot(x, heat.surface_1[:, row], color=VERMILION, label=f"surface 1, {first:.3g} m/s".replace("-", "−"))
    axes.plot(x, heat.surface_2[:, row], "--", color=BLUE, label=f"surface 2, {second:.3g} m/s".replace("-", "−"))
    if solution.lubricant is not None:
        axes.plot(x, heat.film[:, row], ":", color=GREEN, label="film, mean over its thickness")
    for side in (-half_width, half_width):
        axes.axvline(side, color="black", linestyle=(0, (4, 3)), linewidth=0.8)
    axes.set(xlabel="x along rolling [µm]", ylabel="above ambient [K]")
    axes.set_title(f"Temperatures along rolling at y = {solution.grid.y[row] * MICRO:.1f} µm".replace("-", "−"))
    axes.set_xlim(max(x[0], -2.5 * half_width), x[-1])
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled()
def stress_map(solution: ContactSolution, stress: SubsurfaceStress) -> Figure:
    """The largest von Mises stress below every cell, at whatever depth."""
    figure, axes = map_figure(solution.grid.extent)
    image = show_map(axes, stress.largest * GIGA, solution, cmap="viridis", vmin=0.0)
    mark_hertz_zone(axes, solution, "white")
    axes.set_title(f"Largest von Mises stress below, {stress.peak.value * GIGA:.2f} GPa")
    colour_bar(figure, axes, image, "largest von Mises stress below [GPa]")
    return figure


@styled()
def stress_section(solution: ContactSolution, stress: SubsurfaceStress) -> Figure:
    """Von Mises stress in the plane along rolling that holds its largest value; depth and x to the same scale."""
    peak, x, dx = stress.peak, stress.grid.x, stress.grid.spacing[0]
    reach = DEEP * solution.conditions.hertz.half_widths[0]
    seen = (x >= min(-reach, peak.x - reach / 4.0)) & (x <= max(reach, peak.x + reach / 4.0))
    left, right, bottom = x[seen][0] - dx / 2.0, x[seen][-1] + dx / 2.0, min(reach, float(stress.depths[-1]))
    shown = _at_even_depths(stress.von_mises[seen, stress.row], stress.depths, bottom)
    figure, axes = map_figure((right - left, bottom))
    corners = (left * MICRO, right * MICRO, bottom * MICRO, 0.0)
    image = axes.imshow(
        shown.T * GIGA, extent=corners, cmap="viridis", vmin=0.0, interpolation="none", aspect="equal", origin="upper"
    )
    axes.plot(
        peak.x * MICRO, peak.depth * MICRO, "o", color="white", markerfacecolor="none", markersize=9, clip_on=False
    )
    axes.set(xlabel="x along rolling [µm]", ylabel="depth [µm]")
    axes.spines[:].set_visible(False)
    axes.set_title(f"Section at y = {peak.y * MICRO:.1f} µm, peak {peak.depth * MICRO:.2f} µm deep".replace("-", "−"))
    colour_bar(figure, axes, image, "von Mises stress [GPa]")
    return figure


def _at_even_depths(values: Field, depths: Field, bottom: float) -> Field:
    """Stresses at even depths, straight lines between those known, shape (nx, rows)."""
    even = (np.arange(SECTION_ROWS) + 0.5) * bottom / SECTION_ROWS
    return np.stack([np.interp(even, depths, column) for column in values])


@styled()
def stress_over_depth(solution: ContactSolution, stress: SubsurfaceStress) -> Figure:
    """The largest von Mises stress of each depth, with that below Hertz's contact."""
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    depths = stress.depths * MICRO
    below = depths > 0.0
    solved = stress.von_mises.max(axis=(0, 1)) * GIGA
    smooth = hertz_stress(solution.conditions, stress.depths, body=stress.body).von_mises.max(axis=(0, 1)) * GIGA
    axes.semilogx(depths[below], solved[below], "-o", color=BLUE, markersize=3.5, label="solved")
    axes.semilogx(depths[below], smooth[below], "--", color="black", label="Hertz (smooth, dry, no friction)")
    if not below.all():
        axes.axhline(solved[~below][0], color=GREEN, linestyle=":", label="solved, on the surface")
    axes.plot(
        max(stress.peak.depth * MICRO, depths[below][0]), stress.peak.value * GIGA, "o", color=VERMILION,
        markerfacecolor="none", markersize=9, label="largest",
    )  # fmt: skip
    axes.set(xlabel="depth [µm]", ylabel="von Mises stress [GPa]", ylim=(0.0, None))
    axes.set_title("Largest stress at each depth")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled()
def friction_against_roughness(points: Sequence[Mapping[str, Any]]) -> Figure:
    """Friction coefficient of several runs, given as their scalars, against Sq: asperities' and oil's parts."""
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    draw_against_roughness(axes, points, "friction_coefficient", "friction coefficient", 1.0, "-o", "black")
    draw_against_roughness(axes, points, "friction_asperity_part", "asperities' part", 1.0, "--s", VERMILION)
    draw_against_roughness(axes, points, "friction_oil_part", "oil's part", 1.0, ":^", BLUE)
    axes.set(ylabel="shear force over load", title="Friction", ylim=(0.0, None))
    figure.legend(loc="outside lower center", ncols=3)
    return figure
