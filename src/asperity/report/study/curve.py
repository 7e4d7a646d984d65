"""Exhibits of a wear study: the paper's Figs 7, 8 and 13, ours with the printed numbers in them."""

from collections.abc import Iterator, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from asperity.core.arrays import Field
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
from asperity.report.style import BLUE, GREEN, GREY, SPLIT_COLOUR, VERMILION, Medium
from asperity.study import StudyOverview, WearCurve
from asperity.trend import Stages

SPLIT_STROKES: tuple[Any, ...] = ("-.", (0, (6, 1.5, 1, 1.5, 1, 1.5)), (0, (1, 1)))
MOST_MARKERS = 20  # on a curve
SHARES = (("clr", "-o", VERMILION), ("car", "--s", BLUE), ("car_domain", "-.^", GREEN))


def curve_exhibits(study: StudyOverview, curve: WearCurve) -> Iterator[Exhibit]:
    """What is shown of a wear curve, in the order of the page."""
    yield shares(study, curve)
    resonant = [
        preset for preset in curve.stages if np.isfinite(curve.mean(f"crf_{preset}_hz")).any()
    ]
    if resonant:
        if study.papers:
            yield rig(curve, resonant[0])
        yield resonance(study, curve)


def shares(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """CLR and both CARs over Sq, with the interval of their means, each seed, and the anchors: the paper's Fig 7."""
    anchors = study.anchors
    printed = set(anchors) <= set(PAPER_ANCHORS)

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(0.9 * medium.single)
        for key, stroke, colour in SHARES:
            draw_mean(axes, curve, key, stroke, colour, quantity(key).short)
        _draw_anchors(
            axes, anchors, ("car", "car_domain"), "D", "CAR, printed" if printed else "CAR, given"
        )
        _draw_anchors(
            axes, anchors, ("clr",), "P", "CLR from rig's CRF" if printed else "CLR, given"
        )
        name_axes(axes, "sq_m", "share")
        axes.set_ylim(0.0, max(100.0, axes.get_ylim()[1]))
        medium.title(axes, "Load and area share of asperities")
        key_below(figure, axes, columns=2)
        return figure

    anchored = " Hollow marks: what should be met, with its tolerance." if anchors else ""
    if study.papers:
        anchored = (
            " Diamonds: CAR as printed, which does not say of which area; crosses: CLR behind the CRF printed for "
            "the rig's smoothest and roughest ring. Their bars are tolerances of ours."
        )
    ends = (
        f"{quantity(key).short} from {first_to_last(key, curve.mean(key))}" for key, *_ in SHARES
    )
    return Exhibit(
        "shares",
        draw,
        "Share of the load on asperities (CLR), and of the area: contact cells over all cells of the Hertz "
        "zone (CAR), contact area of the domain over the Hertz area (CAR of the domain). "
        f"{surfaces_in_words(study)}{anchored}",
        f"CLR and CAR against Sq from {first_to_last('sq_m', curve.sq)}: {', '.join(ends)}.",
    )


def first_to_last(key: str, values: Field) -> str:
    """Where a curve begins and where it ends."""
    return f"{quantity(key).number(values[0])} to {quantity(key).text(values[-1])}"


def surfaces_in_words(study: StudyOverview) -> str:
    """What curves, bands and dots of a figure are."""
    surfaces = surfaces_a_point(study)
    return f"Means over {surfaces} a level with the 90 % interval of the mean; dots are single surfaces."


def surfaces_a_point(study: StudyOverview) -> str:
    """How many surfaces each point has, in words."""
    count = study.result.plan.realisations
    return f"{count} surfaces" if count > 1 else "one surface"


def resonance(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """CRF and CRFA over Sq by each vibration preset, with stages and anchors: the paper's Fig 8."""
    presets, anchors = list(curve.stages), study.anchors

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, 0.62 * medium.double), layout="constrained")
        grid = figure.subplots(2, len(presets), sharex=True, sharey="row", squeeze=False)
        for preset, letters, (above, below) in zip(presets, ("ac", "bd"), grid.T, strict=False):
            _draw_preset(above, below, curve, anchors, preset)
            medium.title(above, f"Vibration preset: {preset}", f"({letters[0]}) preset {preset}")
            medium.title(below, "", f"({letters[1]}) preset {preset}")
        grid[0, 0].set_ylabel(quantity("crf_hz").label)
        grid[1, 0].set_ylabel(quantity("crfa").label)
        known = [anchor.value for anchor in anchors if anchor.quantity in _CRF]
        stay_near(
            grid[0, 0],
            np.concatenate([known, *(curve.by_case(f"crf_{preset}_hz")[1] for preset in presets)]),
        )
        stay_near(
            grid[1, 0], np.concatenate([curve.by_case(f"crfa_{preset}")[1] for preset in presets])
        )
        grid[1, 0].set_ylim(bottom=0.0)
        key_below(figure, *grid.flat, columns=4)
        return figure

    stages = " ".join(
        f"Preset {name}: {in_print(stages.verdict)}" for name, stages in curve.stages.items()
    )
    return Exhibit(
        "resonance",
        draw,
        "Contact resonance frequency (CRF) and its height in the spectrum (CRFA), by the two vibration presets "
        "on the same contacts: sound, and as the paper prints it. A shaded strip is where the split lies with "
        f"90 %. {surfaces_in_words(study)} {stages}",
        f"CRF and CRFA against Sq. {stages}",
    )


_CRF = ("crf_sound_hz", "crf_paper_hz")


def _draw_preset(
    above: Axes, below: Axes, curve: WearCurve, anchors: Sequence[Anchor], preset: str
) -> None:
    printed = set(anchors) <= set(PAPER_ANCHORS)
    splits = [anchor for anchor in anchors if anchor.quantity == SPLIT_ANCHOR]
    for axes in (above, below):
        _mark_stages(axes, curve, preset, named=axes is above)
        for split, stroke in zip(splits, cycle(SPLIT_STROKES), strict=False):
            label = f"{'printed ' if printed else ''}{split.name}"
            axes.axvline(split.value, color="black", linestyle=stroke, linewidth=0.9, label=label)
    draw_mean(above, curve, f"crf_{preset}_hz", "-o", VERMILION, quantity("crf_hz").short)
    _draw_full_load(above, curve)
    _draw_anchors(above, anchors, _CRF, "D", "CRF of the rig, printed" if printed else "CRF, given")
    draw_mean(below, curve, f"crfa_{preset}", "--s", BLUE, quantity("crfa").short)
    name_axes(below, "sq_m")


def rig(curve: WearCurve, preset: str) -> Exhibit:
    """The rig's twelve rings with what is printed of their CRF, beside what the study predicts: the paper's Fig 13."""
    key = f"crf_{preset}_hz"

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(0.9 * medium.single)
        first, *others = list(curve.stages)
        axes.axvspan(*RIG_SPLIT_UM, color="#dfe3e8", linewidth=0, zorder=0, label="printed split")
        draw_mean(axes, curve, f"crf_{first}_hz", "-", BLUE, f"ours, preset {first}", seeds=False)
        for other in others:
            sq, label = display("sq_m", curve.sq), f"ours, preset {other}"
            axes.plot(
                sq, curve.mean(f"crf_{other}_hz"), "--", color=GREEN, linewidth=1.0, label=label
            )
        rings = rig_prediction(curve, f"crf_{first}_hz")
        sq, ours, low, std = (
            rings[column].to_numpy() for column in ("sq_um", "crf_hz", "low", "sq_std_um")
        )
        ring: Any = {
            "color": BLUE,
            "markerfacecolor": "white",
            "markersize": 4,
            "label": "ours at a ring's Sq",
        }
        draw_intervals(axes, sq, ours, ours - low, "o", xerr=std, **ring)
        known = rings[rings["printed_hz"].notna()]
        ring = {"color": "black", "markersize": 4.5, "label": "rings, CRF printed", "zorder": 4}
        draw_intervals(
            axes, known["sq_um"], known["printed_hz"], None, "D", xerr=known["sq_std_um"], **ring
        )
        _draw_full_load(axes, curve)
        name_axes(axes, "sq_m", ylabel=quantity("crf_hz").label)
        stay_near(axes, np.concatenate([curve.by_case(f"crf_{first}_hz")[1], known["printed_hz"]]))
        medium.title(axes, "The rig's rings and our prediction")
        key_below(figure, axes, columns=2, seeds=False)
        return figure

    return Exhibit(
        "rig",
        draw,
        "The rig's twelve rings. Filled: CRF as printed, of the smoothest and the roughest ring; the ten "
        "others are drawn in the paper without numbers. Hollow: the study's CRF at each ring's Sq, with "
        "the interval over seeds and the printed error of Sq. Strip: between these rings the paper's wear "
        f"turns severe. {_deviations(rig_deviation(curve, key))}",
        "CRF of the rig's rings as printed beside the study's prediction at their Sq.",
    )


def _deviations(off: dict[str, float]) -> str:
    if not np.isfinite(off["ends"]):
        return "The study does not reach over all rings."
    return (
        f"Root mean square of ours less theirs: {off['ends']:.0f} Hz over the two printed values; over all twelve Sq "
        f"{off['knee']:.0f} Hz from a bent line between those, {off['smooth']:.0f} Hz from a saturating one."
    )


def draw_mean(
    axes: Axes,
    curve: WearCurve,
    key: str,
    stroke: str,
    colour: str,
    label: str,
    *,
    seeds: bool = True,
) -> None:
    """Mean over seeds with its interval as a band, each seed as a faint dot."""
    sq = display("sq_m", curve.sq)
    if seeds:
        at, each = curve.by_case(key)
        style: Any = {"alpha": 0.5, "markersize": 4.5, "markeredgewidth": 0, "zorder": 1}
        axes.plot(display("sq_m", at), display(key, each), ".", color=colour, **style)
    axes.update_datalim(
        [(end, 0.0) for end in sq[[0, -1]]], updatey=False
    )  # levels without a value, too
    axes.fill_between(
        sq, *display(key, curve.interval(key)).T, color=colour, alpha=0.22, linewidth=0, zorder=1
    )
    axes.plot(
        sq,
        display(key, curve.mean(key)),
        stroke,
        color=colour,
        markersize=3.5,
        markevery=-(-sq.size // MOST_MARKERS),
        label=label,
        zorder=2,
    )


def _draw_anchors(
    axes: Axes, anchors: Sequence[Anchor], keys: Sequence[str], marker: str, label: str
) -> None:
    """Numbers known of these quantities, with their tolerance; changes from one Sq to another have no place here."""
    places = {}
    for anchor in anchors:
        if anchor.quantity in keys and anchor.sq is not None and anchor.since is None:
            places[anchor.sq, anchor.value] = anchor
    for number, anchor in enumerate(places.values()):
        assert anchor.sq is not None
        value, tolerance = (
            display(anchor.quantity, value) for value in (anchor.value, anchor.tolerance)
        )
        style: Any = {"color": "black", "markersize": 5, "markerfacecolor": "white", "zorder": 4}
        style["label"] = "_" if number else label
        draw_intervals(axes, display("sq_m", anchor.sq), value, tolerance, marker, **style)


def stay_near(axes: Axes, values: Field) -> None:
    """Keep the scale to what was computed: the interval of two seeds can be ten times as wide as all values."""
    if not values.size:
        return
    lowest, highest = float(values.min()), float(values.max())
    margin = 0.3 * (highest - lowest)
    bottom, top = axes.get_ylim()
    if margin > 0.0:
        axes.set_ylim(max(bottom, lowest - margin), min(top, highest + margin))


def _draw_full_load(axes: Axes, curve: WearCurve) -> None:
    known = curve.table["full_load_crf_hz"].dropna().unique()
    if known.size == 1:  # of several, none is the one
        axes.axhline(
            float(known[0]),
            color="black",
            linestyle=":",
            linewidth=1.0,
            label="all load on asperities",
            zorder=1,
        )


def stage_names(stages: Stages) -> tuple[str, str]:
    """What the stages on either side of a split are called."""
    return ("normal", "severe") if stages.kind == "severe" else ("running-in", "steady")


def _mark_stages(axes: Axes, curve: WearCurve, preset: str, *, named: bool) -> None:
    """The split with its interval, and the names of the stages; where there is none, that."""
    stages = curve.stages[preset]
    low, high = display("sq_m", curve.sq[[0, -1]])
    names: dict[str, Any] = {stages.kind: 0.5 * (low + high)}
    mark_split(axes, stages, "split, 90 %")
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


def key_below(figure: Figure, *panels: Axes, columns: int, seeds: bool = True) -> None:
    """One key for all panels, below them; a name stands in it once, and faint dots and bands are explained."""
    keys: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            keys.setdefault(label, handle)
    keys["mean's 90 % interval"] = Patch(color=GREY, alpha=0.3, linewidth=0)
    if seeds:
        keys["single seeds"] = Line2D(
            [], [], color=GREY, marker=".", linestyle="none", alpha=0.6, markersize=4
        )
    legend_below(figure, columns, handles=list(keys.values()), labels=list(keys))
