"""Exhibits of a wear history: curves over hours, resonance, surfaces before and after."""

from collections.abc import Sequence
from textwrap import fill
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT
from asperity.core.quantities import quantity
from asperity.paper import CRF_ENDS_HZ, SAMPLES_SQ_UM
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes, one_panel, panels_in_rows
from asperity.report.style import BLUE, DASHED, GREEN, GREY, VERMILION, Medium, Style
from asperity.simulation import WearHistory
from asperity.surface import Surface, bearing_curve

COLOURS = (BLUE, VERMILION, GREEN)
STYLES = ("-", "--", ":")
PANELS: Sequence[tuple[str, tuple[str, ...]]] = (  # quantity of the axis, and of its curves
    ("sq_m", ("sq_m", "sq_1_m", "sq_2_m")),
    ("sk_m", ("sk_m", "spk_m", "svk_m")),
    ("ssk", ("ssk",)),
    ("sku", ("sku",)),
    ("share", ("clr", "car")),
    ("film_thickness_m", ("h_mean_m", "h_central_m")),
    ("friction_coefficient", ("friction_coefficient",)),
    ("flash_temperature_max_k", ("flash_temperature_max_k",)),
    ("worn_depth_m", ("worn_depth_1_m", "worn_depth_2_m")),
    ("crfa", ("crfa",)),
    ("capacitance_f", ("capacitance_f",)),
)
MAX_LABEL = 24  # characters of a line of a panel's axis label
NAMES = ("First body", "Second body")


class WornTrack(NamedTuple):
    """Track of a body before and after wear."""

    name: str
    before: Surface
    after: Surface


def worn_tracks(history: WearHistory) -> tuple[WornTrack, ...]:
    """Return the tracks of the bodies that are rough or have worn."""
    before = history.initial_surfaces
    after = history.final_surfaces
    pairs = ((before.first, after.first), (before.second, after.second))
    return tuple(
        WornTrack(name, *pair)
        for name, pair in zip(NAMES, pairs, strict=True)
        if any(np.ptp(surface.heights) for surface in pair)
    )


def curves(history: WearHistory) -> Exhibit:
    """Draw roughness, shares, film, friction, temperature, wear depth and CRFA over hours."""
    table = history.table
    panels = [panel for panel in PANELS if bool(table[panel[1][0]].notna().any())]

    def draw(medium: Medium) -> Figure:
        rows = -(-len(panels) // 2)
        figure = Figure(figsize=(medium.double, 2.3 * rows), layout="constrained")
        for number, (side, keys) in enumerate(panels, 1):
            axes = figure.add_subplot(rows, 2, number)
            for key, colour, line_style in zip(keys, COLOURS, STYLES, strict=False):
                if key != keys[0] and not np.any(table[key].to_numpy(float)):
                    continue  # this body is smooth
                _draw_over_hours(axes, history, key, colour, line_style)
            if len(axes.get_lines()) > 1:
                low, high = axes.get_ylim()
                axes.set_ylim(low, high + 0.25 * (high - low))  # room for the legend
                axes.legend(loc="upper right", ncols=3)
            axes.set_ylabel(fill(quantity(side).label, MAX_LABEL))
            axes.set_xlabel(quantity("hours").axis)
        return figure

    return Exhibit(
        "over-hours",
        draw,
        f"One point per wear step. Band of CLR: {PERCENT} interval of the mean over the positions "
        f"of a step, without the error due to the cells.{_k_note(history)}",
        "Roughness parameters, load and area shares, film, friction, flash temperature, wear depth "
        "and CRFA over hours",
    )


def headline(history: WearHistory) -> Exhibit:
    """Draw the asperity load share over hours: the result of a wear simulation in one panel."""
    first, last = (float(history.table["clr"].iloc[row]) for row in (0, -1))
    share = quantity("clr")

    @one_panel(3.0, legend_columns=0)
    def draw(axes: Axes) -> None:
        _draw_over_hours(axes, history, "clr", VERMILION, "-o")
        title = f"{share.short} {share.number(first)} to {share.text(last)}"
        axes.set(xlabel=quantity("hours").axis, ylabel=share.axis, title=title, ylim=(0.0, None))
        axes.margins(x=0.02)  # whole markers at both ends
        axes.autoscale(axis="x")

    return Exhibit(
        "load-share",
        draw,
        f"Load carried by asperities over the hours. Band: {PERCENT} interval of the mean over the "
        f"positions of a step, without the error due to the cells.{_k_note(history)}",
        f"Asperity load share over hours, from {share.text(first)} to {share.text(last)}.",
    )


def _k_note(history: WearHistory) -> str:
    """Explain the light bands, if there are any."""
    if history.k_interval is None:
        return ""
    return " Light band: interval of the wear coefficient; it ends where it needs a longer history."


def _draw_over_hours(axes: Axes, history: WearHistory, key: str, colour: str, style: str) -> None:
    hours = history.table["hours"].to_numpy(float)
    factor = quantity(key).factor
    _, _, body = quantity(key).short.partition(" of body ")
    label = f"body {body}" if body else quantity(key).short
    axes.plot(hours, factor * history.table[key].to_numpy(float), style, color=colour, label=label)
    if key == "clr":
        low, high = (
            factor * history.table[end].to_numpy(float) for end in ("clr_mean_low", "clr_mean_high")
        )
        axes.fill_between(hours, low, high, color=colour, alpha=0.3, linewidth=0)
    band = history.interval_by_k(key)
    if band is not None:
        axes.fill_between(
            hours,
            factor * band["low"],
            factor * band["high"],
            color=colour,
            alpha=0.12,
            linewidth=0,
        )
    axes.set_xlim(0.0, hours[-1])


def resonance(history: WearHistory, *, papers: bool) -> Exhibit:
    """Draw CRF over hours and over Sq, with the published values if `papers`."""

    def draw(medium: Medium) -> Figure:
        table = history.table
        figure = Figure(figsize=(medium.double, 3.2), layout="constrained")
        left, right = panels_in_rows(figure, 2)
        hours = table["hours"].to_numpy(float)
        sq = display("sq_m", table["sq_m"].to_numpy(float))
        for axes, x, key in ((left, hours, "hours"), (right, sq, "sq_m")):
            _draw_crf(axes, x, key, history)
        new = table["crf_hz"].to_numpy(float)[:1]
        right.plot(sq[:1], new, "o", color=BLUE, markersize=4, label="new")
        stages = history.stages
        if stages is not None and stages.found:
            left.axvspan(
                *stages.interval,
                color=GREY,
                alpha=0.2,
                linewidth=0,
                label=f"stage break, {PERCENT}",
            )
            left.axvline(stages.split, color=GREY)
        if papers:
            _draw_paper_values(left, right)
        handles, names = [], []
        for axes in (left, right):
            for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
                if name not in names:
                    handles.append(handle)
                    names.append(name)
        legend_below(figure, 3, handles=handles, labels=names)
        return figure

    paper_note = (
        " Red: values of the paper, the CRF of the smoothest and the roughest ring (Figure 8 draws "
        "the others without numbers) and Sq of its twelve rings; 0.54 µm: new, 0.87 µm: ten hours."
        if papers
        else ""
    )
    return Exhibit(
        "resonance",
        draw,
        "Contact resonance of the mean contact over hours and over the composite roughness."
        f"{paper_note}",
        "CRF over hours and over Sq",
    )


def _draw_crf(axes: Axes, x: Field, key: str, history: WearHistory) -> None:
    """Draw the CRF with both intervals over `x`, the values of quantity `key`."""
    crf, low, high, mean_low, mean_high = (
        history.table[name].to_numpy(float)
        for name in (
            "crf_hz",
            "crf_low_hz",
            "crf_high_hz",
            "crf_mean_low_hz",
            "crf_mean_high_hz",
        )
    )
    style: Style = {"color": BLUE, "linewidth": 0}
    axes.fill_between(
        x, mean_low, mean_high, alpha=0.3, label=f"mean over positions, {PERCENT}", **style
    )
    if np.isfinite(low).any():
        axes.fill_between(
            x, low, high, alpha=0.1, label=f"with scatter and grid, {PERCENT}", **style
        )
    axes.plot(x, crf, color=BLUE, label="this contact")
    axes.set(xlabel=quantity(key).axis, ylabel=quantity("crf_hz").label)


def _draw_paper_values(left: Axes, right: Axes) -> None:
    """Draw the paper's CRF of the first and last ring, and Sq of all rings."""
    sq_limits = SAMPLES_SQ_UM[0], SAMPLES_SQ_UM[-1]
    right.plot(
        sq_limits,
        CRF_ENDS_HZ,
        "D",
        color=VERMILION,
        markersize=4.5,
        label="paper: first and last ring",
    )
    for end in CRF_ENDS_HZ:
        left.axhline(end, color=VERMILION, linestyle=DASHED, linewidth=0.9)
    bottom = right.get_ylim()[0]
    right.plot(
        SAMPLES_SQ_UM,
        np.full(len(SAMPLES_SQ_UM), bottom),
        "|",
        color=VERMILION,
        label="Sq of the rings",
    )


def surface_maps(track: WornTrack) -> Exhibit:
    """Map a track before and after wear, and the depth lost."""

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, 3.3), layout="constrained")
        new, after, lost = panels_in_rows(figure, 3, sharey=True)
        depth = track.before.heights - track.after.heights
        heights = track.before.heights, track.after.heights + depth.mean()
        factor = quantity("height_m").factor
        limit = factor * float(np.percentile(np.abs(np.stack(heights)), 99.5)) or 1.0
        scale: Style = {"cmap": "cividis", "vmin": -limit, "vmax": limit}
        _draw_heights(new, track, "new", heights[0], scale)
        image = _draw_heights(after, track, "after", heights[1], scale)
        figure.colorbar(image, ax=after, label=quantity("height_m").label, extend="both")
        scale = {"cmap": "inferno", "vmin": min(0.0, factor * float(depth.min()))}
        image = _draw_heights(lost, track, "lost", depth, scale)
        figure.colorbar(image, ax=lost, label=quantity("worn_depth_m").label, extend="both")
        new.set_ylabel(quantity("y_m").axis)
        return figure

    return Exhibit(
        f"surface-{track.name.split()[0].lower()}",
        draw,
        f"{track.name}: track new and worn on a common colour scale, each about its mean, and "
        "depth lost.",
        f"Maps of the {track.name.lower()}'s heights before and after, and of the depth lost",
    )


def _draw_heights(
    axes: Axes, track: WornTrack, name: str, heights: Field, scale: Style
) -> AxesImage:
    extent = track.before.grid.extent
    image = axes.imshow(
        display("height_m", heights).T,
        origin="lower",
        extent=(0.0, display("surface_x_m", extent[0]), 0.0, display("y_m", extent[1])),
        aspect="auto",
        interpolation="none",
        **scale,
    )
    axes.set(title=f"{track.name}, {name}", xlabel=quantity("surface_x_m").axis)
    return image


def profiles(tracks: Sequence[WornTrack]) -> Exhibit:
    """Draw the middle profile and the bearing curve of each track before and after wear."""

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, 2.7 * len(tracks) + 0.3), layout="constrained")
        panels = figure.subplots(len(tracks), 2, squeeze=False, width_ratios=(2, 1))
        for (profile, curve), track in zip(panels, tracks, strict=True):
            x = display("surface_x_m", track.before.grid.x - track.before.grid.lower[0])
            states = (("new", track.before, GREY), ("after", track.after, BLUE))
            for name, surface, colour in states:
                row = display("height_m", surface.heights[:, surface.heights.shape[1] // 2])
                profile.plot(x, row, color=colour, linewidth=1.0, label=name)
                bearing = bearing_curve(surface.heights)
                curve.plot(
                    display("material_ratio", bearing.share),
                    display("height_m", bearing.height),
                    color=colour,
                )
            title = f"{track.name}: profile along rolling"
            name_axes(profile, "surface_x_m", "height_m", title=title)
            profile.set_xlim(0.0, float(x[-1]))
            name_axes(curve, "material_ratio", "height_m", title="Bearing curve")
            curve.set_xlim(0.0, 100.0)
        legend_below(figure, 2, handles=panels[0][0].get_lines())
        return figure

    return Exhibit(
        "profiles",
        draw,
        "Profiles through the middle of each track, relative to its initial mean line, and bearing "
        "curves of all heights, each about its mean.",
        "Profiles and bearing curves of both bodies before and after",
    )
