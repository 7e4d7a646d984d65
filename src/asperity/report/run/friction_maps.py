"""Exhibits of friction, flash temperature and subsurface stress."""

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, one_panel
from asperity.report.maps import colour_bar, map_drawer, map_figure
from asperity.report.style import (
    BLUE,
    DASHED,
    GREEN,
    HEAT_COLOURS,
    STRESS_COLOURS,
    VERMILION,
    Medium,
    Style,
)
from asperity.results import FrictionInterval, Run
from asperity.solution import FlashTemperature, Friction, hertz_stress

SECTION_DEPTH = 1.6  # half-widths: extent of the section in depth and to both sides
SECTION_ROWS = 160


def traction_map(run: Run, friction: Friction) -> Exhibit:
    """Map the shear stress; a square-root colour scale keeps the oil's part visible."""
    values = np.abs(friction.shear)
    coefficient = FrictionInterval.of_oil(friction).text
    top = float(display("shear", values).max()) or 1.0
    ticks = [float(f"{share * top:.2g}") for share in (0.0, 0.04, 0.16, 0.36, 0.64, 0.98)]
    title = f"Shear stress (square-root scale), friction {coefficient}"
    norm = PowerNorm(0.5, 0.0, top)
    speed = quantity("sliding_speed_m_s").text(run.solution.conditions.sliding_speed)
    return Exhibit(
        "traction",
        map_drawer(
            run.solution, "shear", values, title, ticks=ticks, cmap=STRESS_COLOURS, norm=norm
        ),
        f"Shear stress on both surfaces at sliding speed {speed}. In asperity contact: "
        f"{friction.boundary_friction:g} times the pressure (friction part "
        f"{quantity('friction_asperity_part').text(friction.asperity_part)}); elsewhere: shear of "
        f"the oil ({quantity('friction_oil_part').text(friction.oil_part)}).",
        f"Map of the shear stress: friction coefficient {coefficient}.",
    )


def temperature_map(run: Run, friction: Friction, heat: FlashTemperature) -> Exhibit:
    """Map the temperature rise of the hotter surface."""
    largest = quantity("flash_temperature_max_k").text(heat.max_k)
    hotter = np.maximum(heat.surface_1, heat.surface_2)
    title = f"Flash temperature, maximum {largest}"
    total, first, second = map(
        quantity("friction_power_w").text, (friction.power, heat.heat_1_w, heat.heat_2_w)
    )
    return Exhibit(
        "temperature",
        map_drawer(run.solution, "surface_temperature", hotter, title, cmap=HEAT_COLOURS),
        f"Temperature of the hotter surface. Friction power {total}: {first} flow into body 1, "
        f"{second} into body 2.",
        f"Map of the flash temperature: maximum {largest} above the bulk of the body.",
    )


def temperature_line(run: Run, heat: FlashTemperature) -> Exhibit:
    """Draw the temperatures of both surfaces and the film along rolling at the hottest cell."""
    solution = run.solution

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        hotter = np.maximum(heat.surface_1, heat.surface_2)
        row = int(np.unravel_index(hotter.argmax(), hotter.shape)[1])
        x = display("x_m", solution.grid.x)
        half_width = display("x_m", solution.conditions.hertz.half_widths[0])
        first, second = (
            quantity("surface_speed_m_s").text(speed)
            for speed in solution.conditions.surface_speeds
        )
        axes.plot(x, heat.surface_1[:, row], color=VERMILION, label=f"surface 1, {first}")
        axes.plot(x, heat.surface_2[:, row], "--", color=BLUE, label=f"surface 2, {second}")
        if solution.lubricant is not None:
            axes.plot(x, heat.film[:, row], ":", color=GREEN, label="film, mean over thickness")
        for side in (-half_width, half_width):
            axes.axvline(side, color="black", linestyle=DASHED, linewidth=0.8)
        name_axes(axes, "x_m", "temperature_rise_k")
        axes.set_title(
            f"Temperatures along rolling at y = {quantity('y_m').text(solution.grid.y[row])}"
        )
        axes.set_xlim(max(x[0], -2.5 * half_width), x[-1])

    return Exhibit(
        "temperature-line",
        draw,
        "Temperatures along rolling through the hottest cell. The slower surface is heated for "
        "longer; the film, in which the heat is generated, can be hotter than both.",
        "Curves of both surface temperatures along rolling; maximum rise of the film "
        f"{quantity('film_temperature_max_k').text(heat.film_max_k)}.",
    )


def stress_map(run: Run) -> Exhibit:
    """Map the maximum over depth of the von Mises stress."""
    largest = quantity("von_mises_max_pa").text(run.stress.peak.value)
    title = f"Maximum von Mises stress over depth, {largest}"
    return Exhibit(
        "stress",
        map_drawer(
            run.solution,
            "von_mises_stress_pa",
            run.stress.largest,
            title,
            cmap=STRESS_COLOURS,
            vmin=0.0,
        ),
        "Maximum von Mises stress below each cell, over sixteen depths in body 1: an elastic, "
        "smooth "
        "half-space under pressure and friction. Above the yield stress the material would flow.",
        f"Map of the maximum von Mises stress below the surface: {_peak(run)}.",
    )


def stress_section(run: Run) -> Exhibit:
    """Draw the von Mises stress in the plane along rolling that contains its maximum."""
    peak = run.stress.peak

    def draw(medium: Medium) -> Figure:
        values, (left, right, bottom, top) = _section(run)
        x = partial(display, "x_m")
        figure, axes = map_figure(medium, (right - left, bottom))
        image = axes.imshow(
            display("von_mises_stress_pa", values.T),
            extent=(x(left), x(right), x(bottom), x(top)),
            cmap=STRESS_COLOURS,
            vmin=0.0,
            interpolation="none",
            aspect="equal",
            origin="upper",
        )
        circle: Style = {"color": "white", "markerfacecolor": "none", "markersize": 9}
        axes.plot(x(peak.x), display("depth_m", peak.depth), "o", clip_on=False, **circle)
        name_axes(axes, "x_m", "depth_m")
        axes.spines[:].set_visible(False)
        depth = quantity("von_mises_depth_m").text(peak.depth)
        axes.set_title(f"Section at y = {quantity('y_m').text(peak.y)}, peak at depth {depth}")
        colour_bar(figure, axes, image, "von_mises_stress_pa")
        return figure

    return Exhibit(
        "stress-section",
        draw,
        "Von Mises stress in the plane along rolling that contains the maximum "
        f"(circle): {_peak(run)}.",
        f"Section of the von Mises stress along rolling and depth: maximum {_peak(run)}.",
    )


def _section(run: Run) -> tuple[Field, tuple[float, float, float, float]]:
    """Return the von Mises stress [Pa] of the section around its peak, shape (x, depth).

    Its limits are left, right, bottom and top [m].
    """
    stress = run.stress
    peak = run.stress.peak
    x = run.stress.grid.x
    dx = stress.grid.spacing[0]
    size = SECTION_DEPTH * run.solution.conditions.hertz.half_widths[0]
    inside = (x >= min(-size, peak.x - size / 4.0)) & (x <= max(size, peak.x + size / 4.0))
    left = x[inside][0] - dx / 2.0
    right = x[inside][-1] + dx / 2.0
    bottom = min(size, float(stress.depths[-1]))
    depths = (np.arange(SECTION_ROWS) + 0.5) * bottom / SECTION_ROWS
    columns = stress.von_mises[inside, stress.row]
    values = np.stack([np.interp(depths, stress.depths, column) for column in columns])
    return values, (left, right, bottom, 0.0)


def stress_over_depth(run: Run) -> Exhibit:
    """Draw the maximum von Mises stress at each depth, solved and for the Hertz contact."""
    solution, stress = run.solution, run.stress

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        depths = display("depth_m", stress.depths)
        below = depths > 0.0
        smooth = hertz_stress(solution.conditions, stress.depths, body=stress.body)
        solved, hertz = (
            display("von_mises_stress_pa", field.von_mises.max(axis=(0, 1)))
            for field in (stress, smooth)
        )
        axes.semilogx(
            depths[below], solved[below], "-o", color=BLUE, markersize=3.5, label="solved"
        )
        axes.semilogx(
            depths[below],
            hertz[below],
            "--",
            color="black",
            label="Hertz (smooth, dry, no friction)",
        )
        if not below.all():
            axes.axhline(
                solved[~below][0], color=GREEN, linestyle=":", label="solved, at the surface"
            )
        depth = display("depth_m", stress.peak.depth)
        value = display("von_mises_stress_pa", stress.peak.value)
        circle: Style = {
            "color": VERMILION,
            "markerfacecolor": "none",
            "markersize": 9,
            "label": "maximum",
        }
        axes.plot(max(depth, depths[below][0]), value, "o", **circle)
        name_axes(
            axes,
            "depth_m",
            "von_mises_stress_pa",
            ylim=(0.0, None),
            title="Maximum stress at each depth",
        )

    dx, dy = (quantity("cell_m").number(side) for side in solution.grid.spacing)
    return Exhibit(
        "stress-over-depth",
        draw,
        "Maximum von Mises stress at each depth. Asperities raise it near the surface, where it "
        f"grows with grid refinement (here {dx} × {dy} {quantity('cell_m').display}); below a "
        "tenth of the half-width it does not depend on the grid.",
        f"Curve of the maximum von Mises stress over depth, with the Hertz contact: {_peak(run)}.",
    )


def _peak(run: Run) -> str:
    value = quantity("von_mises_max_pa")
    depth = quantity("von_mises_depth_m")
    return f"{value.text(run.stress.peak.value)} at depth {depth.text(run.stress.peak.depth)}"
