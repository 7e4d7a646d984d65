"""Exhibits of a solved contact: maps, section along rolling, height distribution, convergence."""

from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.contact.hertz import line_pressure
from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.ehl import ContactSolution, ContactState, Convergence, hertz_zone
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes, one_panel
from asperity.report.maps import (
    contact_colours,
    contact_keys,
    map_drawer,
    map_figure,
    mark_hertz_zone,
    show_map,
)
from asperity.report.style import (
    BLUE,
    CONTACT_COLOUR,
    FILM_COLOURS,
    GREEN,
    GREY,
    HEIGHT_COLOURS,
    STRESS_COLOURS,
    VERMILION,
    Medium,
    Style,
)
from asperity.results import Run


class Solved(Protocol):
    """Solved contact with its state: a run, or a solution beside its state."""

    @property
    def solution(self) -> ContactSolution:
        """Fields of the contact."""
        ...

    @property
    def state(self) -> ContactState:
        """Numbers of the contact."""
        ...


_AT_ONE_INSTANT = {True: " at one instant of the running contact", False: ""}


def contact_map(run: Run) -> Exhibit:
    """Map asperity contact, oil film and cavitated film (Fig 6 of the paper)."""
    solution = run.solution
    zone = hertz_zone(solution.conditions, solution.grid)
    car = float(np.mean(solution.in_contact[zone]))  # the run's may be a mean over time
    cavitated_share = run.sharing.cavitated
    contact, cavitated, film = (
        quantity("share").text(share)
        for share in (car, cavitated_share, 1.0 - car - cavitated_share)
    )
    dry = solution.lubricant is None

    def draw(medium: Medium) -> Figure:
        figure, axes = map_figure(medium, solution.grid.extent)
        show_map(axes, contact_colours(solution), solution)
        mark_hertz_zone(axes, solution, "black")
        moment = "" if run.running is None else ", one instant"
        axes.set_title(f"Asperity contact on {contact} of the Hertz zone{moment}")
        others = (f"open gap {film}",) if dry else (f"oil film {film}", f"cavitated {cavitated}")
        keys = contact_keys(f"asperity contact {contact}", *others)
        figure.legend(handles=keys, loc="lower center", ncols=2, borderaxespad=0.2)
        return figure

    return Exhibit(
        "contact",
        draw,
        f"Contact state{_AT_ONE_INSTANT[run.running is not None]}, shares of the Hertz zone. "
        "Contact: gap of at most "
        f"{quantity('contact_film_m').text(solution.options.contact_film)}. "
        "Dashed: the Hertz zone; oil enters from the left.",
        f"Map of the contact: asperities touch on {contact} of the Hertz zone, "
        + ("the rest is open." if dry else f"oil fills {film}, {cavitated} is cavitated."),
    )


def film_map(run: Solved) -> Exhibit:
    """Map the gap between the deformed surfaces; colours end at the 99th percentile."""
    solution, state = run.solution, run.state
    zone = hertz_zone(solution.conditions, solution.grid)
    top = display("gap", float(np.percentile(solution.gap[zone], 99.0))) or 1.0
    title = "Gap between the surfaces" if solution.lubricant is None else "Film thickness"
    return Exhibit(
        "film",
        map_drawer(
            solution,
            "gap",
            solution.gap,
            title,
            extend="max",
            cmap=FILM_COLOURS,
            vmin=0.0,
            vmax=top,
        ),
        "Gap between the deformed surfaces. Colours end at the 99th percentile in the Hertz zone.",
        f"Map of the film thickness: mean {quantity('h_mean_m').text(state.h_mean)} in the Hertz "
        f"zone, minimum {quantity('h_min_m').text(state.h_min)}.",
    )


def pressure_map(run: Solved) -> Exhibit:
    """Map the total pressure of oil and asperities."""
    solution = run.solution
    pressure = quantity("pressure")
    largest = pressure.text(float(solution.pressure.max()))
    capped = ""
    if solution.p_cap is not None and solution.lubricant is not None:  # not part of CLR
        share = quantity("capped_oil_load_ratio").text(run.state.capped_oil_load_ratio)
        capped = (
            f" Cells at the hardness without contact carry {share} of the load, not part of CLR."
        )
    title = f"Pressure, maximum {largest}"
    return Exhibit(
        "pressure",
        map_drawer(solution, "pressure", solution.pressure, title, cmap=STRESS_COLOURS, vmin=0.0),
        f"Total pressure of oil and asperities.{capped}",
        f"Map of the pressure: at most {largest}; Hertz (smooth, dry): "
        f"{pressure.text(solution.conditions.hertz.p_max)}.",
    )


def centre_line(run: Solved) -> Exhibit:
    """Draw pressure and gap along rolling in the row of cells nearest y = 0."""
    solution = run.solution

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 4.0), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.1, 1.0))
        row = int(np.argmin(np.abs(solution.grid.y)))
        upper.set_title(f"Section along rolling, y = {quantity('y_m').text(solution.grid.y[row])}")
        _draw_pressure_section(upper, solution, row)
        _draw_gap_section(lower, solution, row)
        left = max(solution.grid.lower[0], -2.5 * solution.conditions.hertz.half_widths[0])
        lower.set_xlim(display("x_m", left), display("x_m", solution.grid.upper[0]))
        keys = [key for axes in (upper, lower) for key in axes.get_legend_handles_labels()[0]]
        legend_below(figure, 3, handles=keys)
        return figure

    return Exhibit(
        "centre-line",
        draw,
        "Pressure and gap along rolling through the middle. The axis of the gap ends at the "
        "largest gap near the Hertz zone.",
        "Curves along rolling: pressure with the dashed Hertz ellipse, and below it the gap with "
        "contact marked.",
    )


def _draw_pressure_section(axes: Axes, solution: ContactSolution, row: int) -> None:
    x = display("x_m", solution.grid.x)
    hertz = solution.conditions.hertz
    pressure = solution.pressure[:, row]
    smooth = line_pressure(solution.grid.x, hertz.half_widths[0], hertz.p_max)
    axes.plot(
        x, display("pressure", pressure), color=BLUE, linewidth=1.1, label="pressure p, solved"
    )
    axes.plot(x, display("pressure", smooth), "--", color="black", label="p, Hertz (smooth, dry)")
    if solution.p_cap is not None and pressure.max() > 0.5 * solution.p_cap:
        axes.axhline(
            display("pressure", solution.p_cap), color=VERMILION, linestyle=":", label="hardness"
        )
    axes.set(ylabel=quantity("pressure").label, ylim=(0.0, None))


def _draw_gap_section(axes: Axes, solution: ContactSolution, row: int) -> None:
    x = display("x_m", solution.grid.x)
    gap = display("gap", solution.gap[:, row])
    inside = np.abs(solution.grid.x) <= 1.2 * solution.conditions.hertz.half_widths[0]
    top = 1.15 * float(gap[inside].max()) or 1.0
    axes.plot(x, gap, color=GREEN, linestyle="-.", linewidth=1.1, label="gap h")
    axes.fill_between(
        x,
        0.0,
        0.06 * top,
        where=solution.in_contact[:, row],
        color=CONTACT_COLOUR,
        edgecolor="black",
        linewidth=0.3,
        step="mid",
        label="asperity contact",
    )
    name_axes(axes, "x_m", ylabel=quantity("gap").label, ylim=(0.0, top))


def roughness_map(run: Run) -> Exhibit:
    """Map the composite roughness before deformation."""
    solution, sq = run.solution, quantity("sq_m")
    heights = solution.surface.heights
    title = f"Composite roughness, {sq.named(solution.surface.sq)}"
    limit = display("surface_height", float(np.percentile(np.abs(heights), 99.5))) or 1.0
    colours: Style = {"extend": "both", "cmap": HEIGHT_COLOURS, "vmin": -limit, "vmax": limit}
    return Exhibit(
        "roughness",
        map_drawer(solution, "surface_height", heights, title, **colours),
        "Composite roughness of both surfaces before deformation; positive heights are material.",
        f"Map of the roughness heights, {sq.named(run.state.sq)}.",
    )


def height_distribution(run: Run) -> Exhibit:
    """Draw the distribution of heights and the Gaussian of equal Sq."""
    return Exhibit(
        "heights",
        one_panel(3.1, legend_columns=0)(
            lambda axes: draw_height_distribution(axes, run.solution.surface.heights)
        ),
        "Distribution of the heights in the map. Dashed: the Gaussian of equal Sq.",
        f"Histogram of the heights, {quantity('sq_m').named(run.state.sq)}, with a Gaussian curve.",
    )


def draw_height_distribution(axes: Axes, heights: Field, rms: str = "Sq") -> None:
    """Draw the distribution of heights [m], without missing values; `rms` labels its deviation."""
    deviations = heights[np.isfinite(heights)] - np.nanmean(heights)
    values = display("height_m", deviations)
    sq = float(values.std())
    name_axes(axes, "height_m", "height_density", title="Height distribution")
    if sq == 0.0:
        axes.text(0.5, 0.5, "perfectly smooth", transform=axes.transAxes, ha="center")
        return
    axes.hist(
        values, bins=80, range=(-4.5 * sq, 4.5 * sq), density=True, color="#9ec5dd", label="surface"
    )
    grid = np.linspace(-4.5 * sq, 4.5 * sq, 181)
    gauss = np.exp(-0.5 * (grid / sq) ** 2) / (sq * np.sqrt(2.0 * np.pi))
    axes.plot(
        grid,
        gauss,
        "--",
        color="black",
        label=f"Gaussian, {rms} {quantity('sq_m').text(float(deviations.std()))}",
    )
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])  # room for the legend
    axes.legend(loc="upper right")


def convergence_history(run: Run) -> Exhibit:
    """Draw residual, load error and change of each Newton step against the tolerance."""
    convergence = run.solution.convergence

    @one_panel(3.1, legend_columns=4)
    def draw(axes: Axes) -> None:
        _draw_residuals(axes, convergence)
        _mark_grids(axes, convergence)
        outcome = "converged" if convergence.converged else f"NOT CONVERGED ({convergence.status})"
        axes.set(xlabel="Newton step", ylabel="relative size [-]", title=f"Convergence: {outcome}")
        axes.set_xlim(0.5, len(convergence.history) + 0.5)

    return Exhibit(
        "convergence",
        draw,
        f"Convergence of the solver: {convergence.explain()}.",
        f"Residual, load error and change against the Newton step: {convergence.explain()}.",
    )


def _draw_residuals(axes: Axes, convergence: Convergence) -> None:
    history = convergence.history
    steps = np.arange(1, len(history) + 1)
    interval = max(len(history) // 60, 1)
    for name, line_style, colour in (
        ("residual", "-o", BLUE),
        ("load_error", "--s", VERMILION),
        ("change", ":^", GREEN),
    ):
        values = np.array([getattr(step, name) for step in history])
        positive = np.where(values > 0.0, values, np.nan)  # a log axis cannot show exact zeros
        style: Style = {"color": colour, "markersize": 3, "markevery": interval, "linewidth": 1.0}
        axes.semilogy(steps, positive, line_style, label=name.replace("_", " "), **style)
    style = {"color": "black", "linewidth": 0.8, "linestyle": (0, (6, 2))}
    axes.axhline(convergence.tolerance, label="tolerance", **style)


def _mark_grids(axes: Axes, convergence: Convergence) -> None:
    """Mark the first step on each grid."""
    history = convergence.history
    starts = [i for i, step in enumerate(history) if i == 0 or step.cells != history[i - 1].cells]
    dense = min(np.diff([*starts, len(history)])) < 0.16 * len(history)
    for start in starts:
        nx, ny = history[start].cells
        axes.axvline(start + 0.5, color=GREY, linewidth=0.6)
        axes.annotate(
            f"{nx} × {ny}",
            (start + 0.5, 0.0),
            (3, 3),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            fontsize=8,
            color="#374151",
            rotation=90 if dense else 0,
        )
