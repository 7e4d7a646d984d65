"""Exhibits of friction, heat and stress: maps, a cut along rolling, and what lies below the surface."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, one_panel
from asperity.report.maps import colour_bar, drawn_map, map_figure
from asperity.report.style import BLUE, DASHED, GREEN, VERMILION, Medium
from asperity.results import Run
from asperity.solution import FlashTemperature, Friction, hertz_stress

DEEP = 1.6  # half-widths: how far the section reaches down, and to both sides
SECTION_ROWS = 160


def traction_map(run: Run, friction: Friction) -> Exhibit:
    """Shear stress on the surfaces; colours go with its root, or the oil's could not be seen beside the asperities'."""
    values, coefficient = (
        np.abs(friction.shear),
        quantity("friction_coefficient").text(friction.coefficient),
    )
    top = float(display("shear", values).max()) or 1.0
    ticks = [float(f"{share * top:.2g}") for share in (0.0, 0.04, 0.16, 0.36, 0.64, 0.98)]
    title, norm = (
        f"Shear stress (colours by its square root), friction {coefficient}",
        PowerNorm(0.5, 0.0, top),
    )
    speed = quantity("sliding_speed_m_s").text(run.solution.conditions.sliding_speed)
    return Exhibit(
        "traction",
        drawn_map(run.solution, "shear", values, title, ticks=ticks, cmap="magma", norm=norm),
        f"Shear stress of sliding at {speed} on both surfaces: {friction.boundary_friction:g} times the pressure where "
        f"they touch (friction {quantity('friction_asperity_part').text(friction.asperity_part)}), the oil's own "
        f"elsewhere ({quantity('friction_oil_part').text(friction.oil_part)}).",
        f"Map of the shear stress: friction coefficient {coefficient}.",
    )


def temperature_map(run: Run, friction: Friction, heat: FlashTemperature) -> Exhibit:
    """The hotter of the two surfaces."""
    largest = quantity("flash_temperature_max_k").text(heat.max_k)
    hotter, title = (
        np.maximum(heat.surface_1, heat.surface_2),
        f"Flash temperature, at most {largest}",
    )
    whole, first, second = map(
        quantity("friction_power_w").text, (friction.power, heat.heat_1_w, heat.heat_2_w)
    )
    return Exhibit(
        "temperature",
        drawn_map(run.solution, "surface_temperature", hotter, title, cmap="inferno"),
        f"Temperature of the hotter surface. Friction makes {whole}; {first} flow into body 1 and {second} into body "
        "2.",
        f"Map of the flash temperature: at most {largest} above the body.",
    )


def temperature_line(run: Run, heat: FlashTemperature) -> Exhibit:
    """Both surfaces and the film along rolling, through the hottest cell."""
    solution = run.solution

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        hotter = np.maximum(heat.surface_1, heat.surface_2)
        row = int(np.unravel_index(hotter.argmax(), hotter.shape)[1])
        x, half_width = (
            display("x_m", solution.grid.x),
            display("x_m", solution.conditions.hertz.half_widths[0]),
        )
        first, second = (
            quantity("surface_speed_m_s").text(speed)
            for speed in solution.conditions.surface_speeds
        )
        axes.plot(x, heat.surface_1[:, row], color=VERMILION, label=f"surface 1, {first}")
        axes.plot(x, heat.surface_2[:, row], "--", color=BLUE, label=f"surface 2, {second}")
        if solution.lubricant is not None:
            axes.plot(x, heat.film[:, row], ":", color=GREEN, label="film, mean over its thickness")
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
        "Temperatures along rolling through the hottest cell. The slower surface stays longer in the heat; the "
        "film can be hotter than both, as the heat is made within it.",
        "Curves of both surfaces' temperatures along rolling; the film's largest rise is "
        f"{quantity('film_temperature_max_k').text(heat.film_max_k)}.",
    )


def stress_map(run: Run) -> Exhibit:
    """The largest von Mises stress below every cell, at whatever depth."""
    title = f"Largest von Mises stress below, {quantity('von_mises_max_pa').text(run.stress.peak.value)}"
    return Exhibit(
        "stress",
        drawn_map(
            run.solution, "von_mises_stress_pa", run.stress.largest, title, cmap="viridis", vmin=0.0
        ),
        "The largest von Mises stress below each cell, of sixteen depths in body 1. Pressure and "
        "friction load an elastic, smooth half-space: above its yield stress the material would flow.",
        f"Map of the largest von Mises stress below the surface: {_peak(run)}.",
    )


def stress_section(run: Run) -> Exhibit:
    """Von Mises stress in the plane along rolling that holds its largest value; depth and x to the same scale."""
    stress, peak = run.stress, run.stress.peak

    def draw(medium: Medium) -> Figure:
        x, dx, reach = (
            stress.grid.x,
            stress.grid.spacing[0],
            DEEP * run.solution.conditions.hertz.half_widths[0],
        )
        seen = (x >= min(-reach, peak.x - reach / 4.0)) & (x <= max(reach, peak.x + reach / 4.0))
        left, right, bottom = (
            x[seen][0] - dx / 2.0,
            x[seen][-1] + dx / 2.0,
            min(reach, float(stress.depths[-1])),
        )
        even = (np.arange(SECTION_ROWS) + 0.5) * bottom / SECTION_ROWS
        values = np.stack(
            [
                np.interp(even, stress.depths, column)
                for column in stress.von_mises[seen, stress.row]
            ]
        )
        figure, axes = map_figure(medium, (right - left, bottom))
        image = axes.imshow(
            display("von_mises_stress_pa", values.T),
            extent=display("x_m", np.array([left, right, bottom, 0.0])),
            cmap="viridis",
            vmin=0.0,
            interpolation="none",
            aspect="equal",
            origin="upper",
        )
        axes.plot(
            display("x_m", peak.x),
            display("depth_m", peak.depth),
            "o",
            color="white",
            markerfacecolor="none",
            markersize=9,
            clip_on=False,
        )
        name_axes(axes, "x_m", "depth_m")
        axes.spines[:].set_visible(False)
        depth = quantity("von_mises_depth_m").text(peak.depth)
        axes.set_title(f"Section at y = {quantity('y_m').text(peak.y)}, peak {depth} deep")
        colour_bar(figure, axes, image, "von_mises_stress_pa")
        return figure

    return Exhibit(
        "stress-section",
        draw,
        "Von Mises stress below the surface, in the plane along rolling that holds the largest: "
        f"{_peak(run)} (circle).",
        f"Section of the von Mises stress along rolling and depth: largest {_peak(run)}.",
    )


def stress_over_depth(run: Run) -> Exhibit:
    """The largest von Mises stress of each depth, with that below Hertz's contact."""
    solution, stress = run.solution, run.stress

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        depths = display("depth_m", stress.depths)
        below = depths > 0.0
        smooth = hertz_stress(solution.conditions, stress.depths, body=stress.body)
        solved, hertz = (
            display("von_mises_stress_pa", each.von_mises.max(axis=(0, 1)))
            for each in (stress, smooth)
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
                solved[~below][0], color=GREEN, linestyle=":", label="solved, on the surface"
            )
        depth, value = (
            display("depth_m", stress.peak.depth),
            display("von_mises_stress_pa", stress.peak.value),
        )
        circle: Any = {
            "color": VERMILION,
            "markerfacecolor": "none",
            "markersize": 9,
            "label": "largest",
        }
        axes.plot(max(depth, depths[below][0]), value, "o", **circle)
        name_axes(
            axes,
            "depth_m",
            "von_mises_stress_pa",
            ylim=(0.0, None),
            title="Largest stress at each depth",
        )

    dx, dy = (quantity("cell_m").number(side) for side in solution.grid.spacing)
    return Exhibit(
        "stress-over-depth",
        draw,
        "The largest von Mises stress at each depth. Asperities raise it near the surface; at their edges it grows "
        f"with a finer grid (here {dx} × {dy} {quantity('cell_m').display}), from a tenth of the half-width down it "
        "does not.",
        f"Curve of the largest von Mises stress over depth beside that of Hertz's contact: {_peak(run)}.",
    )


def _peak(run: Run) -> str:
    value, depth = quantity("von_mises_max_pa"), quantity("von_mises_depth_m")
    return f"{value.text(run.stress.peak.value)}, {depth.text(run.stress.peak.depth)} deep"
