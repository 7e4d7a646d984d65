"""Exhibits of a wear study: Figs 7, 8 and 13 of the paper, with its published values."""

from collections.abc import Iterator, Sequence
from itertools import cycle

import numpy as np
import pandas
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT
from asperity.core.quantities import in_print, quantity
from asperity.paper import (
    PAPER_ANCHORS,
    RIG_SPLIT_UM,
    SPLIT_ANCHOR,
    Anchor,
    rig_deviation,
    rig_prediction,
)
from asperity.report.base import Exhibit
from asperity.report.drawing import display, draw_intervals, legend_below, mark_split, name_axes
from asperity.report.style import BLUE, GREEN, GREY, SPLIT_COLOUR, VERMILION, Medium, Style
from asperity.study import StudyOverview, WearCurve
from asperity.trend import Stages

SPLIT_STYLES = ("-.", (0.0, (6.0, 1.5, 1.0, 1.5, 1.0, 1.5)), (0.0, (1.0, 1.0)))
BOTH = " with both vibration presets: sound, and as printed in the paper"
MAX_MARKERS = 20  # on a curve
SHARES = (("clr", "-o", VERMILION), ("car", "--s", BLUE), ("car_domain", "-.^", GREEN))


def curve_exhibits(study: StudyOverview, curve: WearCurve) -> Iterator[Exhibit]:
    """Yield the exhibits of a wear curve in the order of the page."""
    yield shares(study, curve)
    resonant = _resonant(curve)
    if resonant:
        if study.papers:
            yield rig(curve, resonant[0])
        yield resonance(study, curve)


def _resonant(curve: WearCurve) -> list[str]:
    """Return the vibration presets with a resonance, which alone have something to show."""
    return [preset for preset in curve.stages if np.isfinite(curve.mean(f"crf_{preset}_hz")).any()]


def shares(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """Draw CLR and both CARs over Sq with seeds, intervals and anchors (Fig 7 of the paper)."""
    anchors = study.anchors
    paper = set(anchors) <= set(PAPER_ANCHORS)

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(0.9 * medium.single)
        for key, line_style, colour in SHARES:
            draw_mean(axes, curve, key, line_style, colour, quantity(key).short)
        _draw_anchors(
            axes, anchors, ("car", "car_domain"), "D", "CAR, printed" if paper else "CAR, given"
        )
        _draw_anchors(axes, anchors, ("clr",), "P", "CLR from rig's CRF" if paper else "CLR, given")
        name_axes(axes, "sq_m", "share")
        axes.set_ylim(0.0, max(100.0, axes.get_ylim()[1]))
        medium.title(axes, "Asperity load and area share")
        legend_of_panels(figure, axes, columns=2)
        return figure

    anchor_note = " Hollow markers: anchors with their tolerance." if anchors else ""
    if study.papers:
        anchor_note = (
            " Diamonds: CAR as published (the paper does not define its area); crosses: CLR from "
            "the published CRF of the smoothest and the roughest ring. Bars: tolerances set by "
            "asperity."
        )
    ranges = (
        f"{quantity(key).short} from {first_to_last(key, curve.mean(key))}" for key, *_ in SHARES
    )
    return Exhibit(
        "shares",
        draw,
        "Asperity load share (CLR), contact area ratio in the Hertz zone (CAR), and total contact "
        f"area divided by the Hertz area (CAR of the domain). {legend_note(study)}{anchor_note}",
        f"CLR and CAR over Sq from {first_to_last('sq_m', curve.sq)}: {', '.join(ranges)}.",
    )


def first_to_last(key: str, values: Field) -> str:
    """Return the first and last value of a curve as text."""
    return f"{quantity(key).number(values[0])} to {quantity(key).text(values[-1])}"


def legend_note(study: StudyOverview) -> str:
    """Explain curves, bands and dots of a figure."""
    count = surface_count(study)
    return (
        f"Means over {count} per level with {PERCENT} intervals of the mean; dots: single surfaces."
    )


def surface_count(study: StudyOverview) -> str:
    """Return the number of surfaces of each point as text."""
    count = study.result.plan.realisations
    return f"{count} surfaces" if count > 1 else "one surface"


def resonance(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """Draw CRF and CRFA over Sq for each preset with stages and anchors (Fig 8 of the paper)."""
    presets = _resonant(curve)
    anchors = study.anchors

    def draw(medium: Medium) -> Figure:
        width = medium.width(len(presets) + 1)
        figure = Figure(figsize=(width, 0.62 * medium.double), layout="constrained")
        grid = figure.subplots(2, len(presets), sharex=True, sharey="row", squeeze=False)
        for preset, letters, (upper, lower) in zip(presets, ("ac", "bd"), grid.T, strict=False):
            _draw_preset(upper, lower, curve, anchors, preset)
            medium.title(upper, f"Vibration preset: {preset}", f"({letters[0]}) preset {preset}")
            medium.title(lower, "", f"({letters[1]}) preset {preset}")
        _limit_rows(grid[0, 0], grid[1, 0], curve, anchors)
        legend_of_panels(figure, *grid.flat, columns=2 * len(presets))
        return figure

    stages = " ".join(f"Preset {name}: {in_print(curve.stages[name].verdict)}" for name in presets)
    return Exhibit(
        "resonance",
        draw,
        "Contact resonance frequency (CRF) and amplitude (CRFA) of the same contacts"
        f"{BOTH if len(presets) > 1 else ''}. Shaded: {PERCENT} interval of the "
        f"split. {legend_note(study)} {stages}",
        f"CRF and CRFA over Sq. {stages}",
    )


def _limit_rows(upper: Axes, lower: Axes, curve: WearCurve, anchors: Sequence[Anchor]) -> None:
    """Label the axes of CRF and CRFA; limit them to their values and to the anchors."""
    upper.set_ylabel(quantity("crf_hz").label)
    lower.set_ylabel(quantity("crfa").label)
    anchor_values = [anchor.value for anchor in anchors if anchor.quantity in _CRF]
    crf, crfa = (
        [curve.by_case(key.format(preset))[1] for preset in curve.stages]
        for key in ("crf_{}_hz", "crfa_{}")
    )
    limit_to_data(upper, np.concatenate([anchor_values, *crf]))
    limit_to_data(lower, np.concatenate(crfa))
    lower.set_ylim(bottom=0.0)


_CRF = ("crf_sound_hz", "crf_paper_hz")


def _draw_preset(
    upper: Axes, lower: Axes, curve: WearCurve, anchors: Sequence[Anchor], preset: str
) -> None:
    paper = set(anchors) <= set(PAPER_ANCHORS)
    splits = [anchor for anchor in anchors if anchor.quantity == SPLIT_ANCHOR]
    for axes in (upper, lower):
        _mark_stages(axes, curve, preset, named=axes is upper)
        for split, style in zip(splits, cycle(SPLIT_STYLES), strict=False):
            label = f"{'printed ' if paper else ''}{split.name}"
            axes.axvline(split.value, color="black", linestyle=style, linewidth=0.9, label=label)
    draw_mean(upper, curve, f"crf_{preset}_hz", "-o", VERMILION, quantity("crf_hz").short)
    _draw_full_load(upper, curve)
    _draw_anchors(upper, anchors, _CRF, "D", "CRF of the rig, printed" if paper else "CRF, given")
    draw_mean(lower, curve, f"crfa_{preset}", "--s", BLUE, quantity("crfa").short)
    name_axes(lower, "sq_m")


def rig(curve: WearCurve, preset: str) -> Exhibit:
    """Draw the published CRF of the rig's rings and the study's prediction (the paper's Fig 13)."""
    key = f"crf_{preset}_hz"

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(0.9 * medium.single)
        axes.axvspan(*RIG_SPLIT_UM, color="#dfe3e8", linewidth=0, zorder=0, label="printed split")
        first, *others = list(curve.stages)
        label = f"study, preset {first}"
        draw_mean(axes, curve, f"crf_{first}_hz", "-", BLUE, label, seeds=False)
        for other in others:
            sq = display("sq_m", curve.sq)
            crf = curve.mean(f"crf_{other}_hz")
            label = f"study, preset {other}"
            axes.plot(sq, crf, "--", color=GREEN, linewidth=1.0, label=label)
        rings_hz = _draw_rings(axes, rig_prediction(curve, f"crf_{first}_hz"))
        _draw_full_load(axes, curve)
        name_axes(axes, "sq_m", ylabel=quantity("crf_hz").label)
        limit_to_data(axes, np.concatenate([curve.by_case(f"crf_{first}_hz")[1], rings_hz]))
        medium.title(axes, "Rings of the rig, measured and predicted")
        legend_of_panels(figure, axes, columns=2, seeds=False)
        return figure

    return Exhibit(
        "rig",
        draw,
        "The twelve rings of the rig. Filled symbols: published CRF of the smoothest and the "
        "roughest ring; the paper draws the other ten without numbers. Hollow symbols: the study's "
        "CRF at each ring's Sq, with the interval over seeds and the published error of Sq. Shaded "
        f"band: onset of severe wear in the paper. {_deviations(rig_deviation(curve, key))}",
        "Published CRF of the rig's rings, and the study's prediction at their Sq.",
    )


def _draw_rings(axes: Axes, rings: pandas.DataFrame) -> Field:
    """Draw predicted and published CRF of the rings; return the published values [Hz]."""
    sq, predicted, low, std = (
        rings[column].to_numpy() for column in ("sq_um", "crf_hz", "low", "sq_std_um")
    )
    style: Style = {"color": BLUE, "markerfacecolor": "white", "markersize": 4, "xerr": std}
    label = "study at a ring's Sq"
    draw_intervals(axes, sq, predicted, predicted - low, "o", label=label, **style)
    measured = rings[rings["printed_hz"].notna()]
    style = {"color": "black", "markersize": 4.5, "zorder": 4, "xerr": measured["sq_std_um"]}
    label = "rings, published CRF"
    rings_hz = measured["printed_hz"].to_numpy()
    draw_intervals(axes, measured["sq_um"], rings_hz, None, "D", label=label, **style)
    return np.asarray(rings_hz)


def _deviations(rms_hz: dict[str, float]) -> str:
    if not np.isfinite(rms_hz["ends"]):
        return "The study does not cover all rings."
    return (
        f"RMS deviation: {rms_hz['ends']:.0f} Hz from the two printed values; over all twelve Sq, "
        f"{rms_hz['knee']:.0f} Hz from a bent line through them, {rms_hz['smooth']:.0f} Hz from a "
        "saturating curve."
    )


def draw_mean(
    axes: Axes,
    curve: WearCurve,
    key: str,
    line_style: str,
    colour: str,
    label: str,
    *,
    seeds: bool = True,
) -> None:
    """Draw the mean over seeds, its interval as a band and each seed as a faint dot."""
    sq = display("sq_m", curve.sq)
    if seeds:
        case_sq, values = curve.by_case(key)
        style: Style = {"alpha": 0.5, "markersize": 4.5, "markeredgewidth": 0, "zorder": 1}
        axes.plot(display("sq_m", case_sq), display(key, values), ".", color=colour, **style)
    axes.update_datalim(
        [(end, 0.0) for end in sq[[0, -1]]], updatey=False
    )  # include levels without a value
    axes.fill_between(
        sq, *display(key, curve.interval(key)).T, color=colour, alpha=0.22, linewidth=0, zorder=1
    )
    axes.plot(
        sq,
        display(key, curve.mean(key)),
        line_style,
        color=colour,
        markersize=3.5,
        markevery=-(-sq.size // MAX_MARKERS),
        label=label,
        zorder=2,
    )


def _draw_anchors(
    axes: Axes, anchors: Sequence[Anchor], keys: Sequence[str], marker: str, label: str
) -> None:
    """Draw the anchors of these quantities with tolerances, except changes between two Sq."""
    distinct = {}
    for anchor in anchors:
        if anchor.quantity in keys and anchor.sq is not None and anchor.since is None:
            distinct[anchor.sq, anchor.value] = anchor
    for number, anchor in enumerate(distinct.values()):
        assert anchor.sq is not None
        value, tolerance = (
            display(anchor.quantity, value) for value in (anchor.value, anchor.tolerance)
        )
        style: Style = {"color": "black", "markersize": 5, "markerfacecolor": "white", "zorder": 4}
        style["label"] = "_" if number else label
        draw_intervals(axes, display("sq_m", anchor.sq), value, tolerance, marker, **style)


def limit_to_data(axes: Axes, values: Field) -> None:
    """Limit the y axis to the values: intervals of two seeds can be ten times as wide."""
    if not values.size:
        return
    lowest = float(values.min())
    highest = float(values.max())
    margin = 0.3 * (highest - lowest)
    bottom, top = axes.get_ylim()
    if margin > 0.0:
        axes.set_ylim(max(bottom, lowest - margin), min(top, highest + margin))


def _draw_full_load(axes: Axes, curve: WearCurve) -> None:
    values = curve.table["full_load_crf_hz"].dropna().unique()
    if values.size == 1:  # omit the line if cases differ
        axes.axhline(
            float(values[0]),
            color="black",
            linestyle=":",
            linewidth=1.0,
            label="CRF at full load",
            zorder=1,
        )


def stage_names(stages: Stages) -> tuple[str, str]:
    """Return the names of the stages before and after a split."""
    return ("normal", "severe") if stages.kind == "severe" else ("running-in", "steady")


def _mark_stages(axes: Axes, curve: WearCurve, preset: str, *, named: bool) -> None:
    """Mark the split with its interval and name the stages, or state that there is none."""
    stages = curve.stages[preset]
    low, high = display("sq_m", curve.sq[[0, -1]])
    names: dict[str, float] = {stages.kind: 0.5 * (low + high)}
    mark_split(axes, stages, f"split, {PERCENT}")
    if stages.found:
        before, after = stage_names(stages)
        names = {before: 0.5 * (low + stages.split), after: 0.5 * (stages.split + high)}
    for name, middle in names.items() if named else ():
        axes.annotate(
            name,
            (middle, 0.04),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="bottom",
            color=SPLIT_COLOUR,
            style="italic",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5},
            zorder=5,
        )


def legend_of_panels(figure: Figure, *panels: Axes, columns: int, seeds: bool = True) -> None:
    """Add one legend for all panels below them, with entries for bands and dots."""
    keys: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            keys.setdefault(label, handle)
    keys[f"{PERCENT} interval of the mean"] = Patch(color=GREY, alpha=0.3, linewidth=0)
    if seeds:
        keys["single seeds"] = Line2D(
            [], [], color=GREY, marker=".", linestyle="none", alpha=0.6, markersize=4
        )
    legend_below(figure, columns, handles=list(keys.values()), labels=list(keys))
