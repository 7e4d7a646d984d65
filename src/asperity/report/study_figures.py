"""The figures of a wear study: the paper's Figs 5 to 8 and 13, ours with the printed numbers in them.

Each function takes what was computed and a medium, and returns a matplotlib Figure. A page gets titles and wide type;
paper gets the column widths of journals, and leaves the words to a caption.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import cycle
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from asperity.arrays import Field
from asperity.paper import PAPER_ANCHORS, RIG_SPLIT_UM, SPLIT_ANCHOR, rig_prediction
from asperity.report.figures import (
    BLUE,
    CAVITY_COLOUR,
    CAVITY_STRIPE,
    CONTACT_COLOUR,
    GAP_COLOUR,
    GREEN,
    GREY,
    MICRO,
    OIL_COLOUR,
    STYLE,
    VERMILION,
    contact_colours,
    mark_hertz_zone,
    show_map,
)

if TYPE_CHECKING:
    from asperity.paper import Anchor
    from asperity.results import Run
    from asperity.study import WearCurve
    from asperity.wear import Stages

SPLIT_COLOUR, SPLIT_STRIP = "#8a5a00", "#f2e3c6"
SPLIT_STROKES: tuple[Any, ...] = ("-.", (0, (6, 1.5, 1, 1.5, 1, 1.5)), (0, (1, 1)))
MOST_MARKERS = 20  # on a curve
ACROSS = 4  # maps in a row
SQ_LABEL = "composite roughness Sq [µm]"


@dataclass(frozen=True)
class Medium:
    """Where a figure is looked at: widths of one and of two columns [inches], whether it says its own title."""

    single: float
    double: float
    titled: bool
    style: dict[str, Any] = field(default_factory=dict)

    def width(self, panels: int) -> float:
        """Of a figure with so many panels in a row [inches]."""
        return self.double if panels > 2 else self.single

    @property
    def line_height(self) -> float:
        """Of a line of type [inches]."""
        return float({**STYLE, **self.style}["font.size"]) / 72.0 * 1.35

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """The look of figures made or written inside."""
        look: dict[Any, Any] = {**STYLE, **self.style}
        with matplotlib.rc_context(look):
            yield

    def title(self, axes: Axes, text: str, letter: str = "") -> None:
        """A title; on paper its letter alone, which the caption refers to."""
        axes.set_title(text if self.titled else letter)


ON_PAGE = Medium(4.8, 9.6, titled=True)
ON_PAPER = Medium(
    84.0 / 25.4,
    174.0 / 25.4,
    titled=False,
    style={
        "font.size": 8.0,
        "axes.titlesize": 8.0,
        "xtick.labelsize": 7.5,
        "ytick.labelsize": 7.5,
        "legend.fontsize": 7.5,
        "legend.handlelength": 1.7,
        "legend.columnspacing": 1.2,
        "axes.linewidth": 0.6,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "lines.linewidth": 1.1,
        "hatch.linewidth": 0.4,
        "pdf.fonttype": 42,  # type that can be searched and edited, as publishers ask
    },
)


# Maps of a few levels: Figs 5 and 6 ----------------------------------------------------------------------------------


def surfaces(runs: "Sequence[Run]", medium: Medium) -> Figure:
    """Roughness of a few levels in one colour scale: the paper's Fig 5."""
    reach = max(float(np.percentile(np.abs(run.solution.surface.heights), 99.5)) for run in runs) * MICRO or 1.0
    with medium.drawing():
        figure, panels = _map_sheet(runs, medium, "surfaces")
        for run, axes, letter in zip(runs, panels, "abcdefgh", strict=False):
            heights = run.solution.surface.heights * MICRO
            image = show_map(axes, heights, run.solution, cmap="cividis", vmin=-reach, vmax=reach)
            axes.set_title(f"({letter}) Sq {_um(run)} µm", fontweight="normal")
        _label_outer(panels)
        figure.colorbar(
            image, ax=panels, location="bottom", shrink=0.5, aspect=40, extend="both", label="height, material up [µm]"
        )
    return figure


def contact_maps(runs: "Sequence[Run]", medium: Medium) -> Figure:
    """Where asperities touch, oil fills the gap and oil has ruptured, with CAR and CLR of each: the paper's Fig 6."""
    lubricated = any(run.solution.lubricant is not None for run in runs)
    with medium.drawing():
        figure, panels = _map_sheet(runs, medium, "maps")
        for run, axes, letter in zip(runs, panels, "abcdefgh", strict=False):
            show_map(axes, contact_colours(run.solution), run.solution)
            mark_hertz_zone(axes, run.solution, "black")
            state = run.state
            areas = f"CAR of Hertz zone {_percent(state.car)}\nCAR of domain {_percent(state.car_domain)}"
            title = f"({letter}) Sq {_um(run)} µm: CLR {_percent(state.clr)}\n{areas}"
            axes.set_title(title, fontweight="normal", fontsize="small")
        _label_outer(panels)
        keys: list[Patch | Line2D] = [Patch(color=CONTACT_COLOUR, label="asperity contact")]
        if lubricated:
            keys.append(Patch(color=OIL_COLOUR, label="oil film"))
            keys.append(Patch(facecolor=CAVITY_COLOUR, edgecolor=CAVITY_STRIPE, hatch="////", label="ruptured oil"))
        else:
            keys.append(Patch(color=GAP_COLOUR, label="open gap"))
        keys.append(Line2D([], [], color="black", linestyle=(0, (4, 3)), linewidth=1.0, label="Hertz zone"))
        figure.legend(handles=keys, loc="outside lower center", ncols=4 if len(runs) > 2 else 2)
    return figure


def _map_sheet(runs: "Sequence[Run]", medium: Medium, kind: str) -> tuple[Figure, list[Axes]]:
    """Equal panels in rows, for the maps of the runs; axes left over are gone."""
    across = min(ACROSS, len(runs))
    down = -(-len(runs) // across)
    extent = runs[0].case.grid.extent
    line, width = medium.line_height, medium.width(across)
    panel = (width - 4.0 * line) / across - 0.6 * line
    above, below = {"surfaces": (1.4, 5.4), "maps": (3.0, 4.4)}[kind]  # lines of type
    height = down * (panel * min(max(extent[1] / extent[0], 0.15), 1.4) + above * line) + below * line
    figure = Figure(figsize=(width, height), layout="compressed")
    grid = figure.subplots(down, across, squeeze=False, sharex=True, sharey=True)
    panels = list(grid.flat)
    for spare in panels[len(runs) :]:
        spare.remove()
    return figure, panels[: len(runs)]


def _label_outer(panels: Sequence[Axes]) -> None:
    """Labels at the left and at the bottom only; a panel above a gap has the bottom too."""
    across = min(ACROSS, len(panels))
    for number, axes in enumerate(panels):
        lowest = number + across >= len(panels)
        axes.set_xlabel("x along rolling [µm]" if lowest else "")
        axes.set_ylabel("" if number % across else "y [µm]")
        axes.tick_params(labelbottom=lowest, labelleft=number % across == 0)


def _um(run: "Run") -> str:
    return f"{run.state.sq * MICRO:.3g}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


# Curves over Sq: Figs 7, 8 and 13 ------------------------------------------------------------------------------------


def shares(curve: "WearCurve", anchors: "Sequence[Anchor]", medium: Medium) -> Figure:
    """CLR and both CARs over Sq, with the interval of their means, each seed, and the anchors: the paper's Fig 7."""
    rows = (
        ("clr", "CLR, share of the load", "-o", VERMILION),
        ("car", "CAR of the Hertz zone", "--s", BLUE),
        ("car_domain", "CAR of the domain", "-.^", GREEN),
    )
    printed = set(anchors) <= set(PAPER_ANCHORS)
    with medium.drawing():
        figure = Figure(figsize=(medium.single, 0.9 * medium.single), layout="constrained")
        axes = figure.add_subplot()
        for column, label, stroke, colour in rows:
            _draw_mean(axes, curve, column, 100.0, stroke, colour, label)
        _draw_anchors(axes, anchors, ("car", "car_domain"), 100.0, "D", "CAR, printed" if printed else "CAR, given")
        _draw_anchors(axes, anchors, ("clr",), 100.0, "P", "CLR from rig's CRF" if printed else "CLR, given")
        axes.set(xlabel=SQ_LABEL, ylabel="taken by asperities [%]")
        axes.set_ylim(0.0, max(100.0, axes.get_ylim()[1]))
        medium.title(axes, "Load and area share of asperities")
        _key_below(figure, axes, ncols=2)
    return figure


def resonance(curve: "WearCurve", anchors: "Sequence[Anchor]", medium: Medium) -> Figure:
    """CRF and CRFA over Sq by each vibration preset, with stages and anchors: the paper's Fig 8."""
    presets, printed = list(curve.stages), set(anchors) <= set(PAPER_ANCHORS)
    splits = [anchor for anchor in anchors if anchor.quantity == SPLIT_ANCHOR]
    crf, said = ("crf_sound_hz", "crf_paper_hz"), "printed " if printed else ""
    with medium.drawing():
        figure = Figure(figsize=(medium.double, 0.62 * medium.double), layout="constrained")
        grid = figure.subplots(2, len(presets), sharex=True, sharey="row", squeeze=False)
        for number, preset in enumerate(presets):
            above, below = grid[:, number]
            for axes in (above, below):
                _mark_stages(axes, curve, preset, named=axes is above)
                for split, stroke in zip(splits, cycle(SPLIT_STROKES), strict=False):
                    axes.axvline(
                        split.value, color="black", linestyle=stroke, linewidth=0.9, label=f"{said}{split.name}"
                    )
            _draw_mean(above, curve, f"crf_{preset}_hz", 1.0, "-o", VERMILION, "CRF")
            _draw_full_load(above, curve)
            _draw_anchors(above, anchors, crf, 1.0, "D", "CRF of the rig, printed" if printed else "CRF, given")
            _draw_mean(below, curve, f"crfa_{preset}", 1.0, "--s", BLUE, "CRFA")
            below.set(xlabel=SQ_LABEL)
            medium.title(above, f"Vibration preset: {preset}", f"({'ab'[number]}) preset {preset}")
            medium.title(below, "", f"({'cd'[number]}) preset {preset}")
        grid[0, 0].set_ylabel("CRF [Hz]")
        grid[1, 0].set_ylabel("CRFA [(m/s²)²/Hz]")
        known = [anchor.value for anchor in anchors if anchor.quantity in crf]
        stay_near(grid[0, 0], np.concatenate([known, *(curve.by_case(f"crf_{preset}_hz")[1] for preset in presets)]))
        stay_near(grid[1, 0], np.concatenate([curve.by_case(f"crfa_{preset}")[1] for preset in presets]))
        grid[1, 0].set_ylim(bottom=0.0)
        _key_below(figure, *grid.flat, ncols=4)
    return figure


def rig(curve: "WearCurve", medium: Medium) -> Figure:
    """The rig's twelve rings with what is printed of their CRF, beside what the study predicts: the paper's Fig 13."""
    first, *others = list(curve.stages)
    with medium.drawing():
        figure = Figure(figsize=(medium.single, 0.9 * medium.single), layout="constrained")
        axes = figure.add_subplot()
        axes.axvspan(*RIG_SPLIT_UM, color="#dfe3e8", linewidth=0, zorder=0, label="printed split")
        _draw_mean(axes, curve, f"crf_{first}_hz", 1.0, "-", BLUE, f"ours, preset {first}", seeds=False)
        for preset in others:
            axes.plot(
                curve.sq * MICRO, curve.mean(f"crf_{preset}_hz"), "--", color=GREEN, linewidth=1.0,
                label=f"ours, preset {preset}",
            )  # fmt: skip
        rings = rig_prediction(curve, f"crf_{first}_hz")
        ours = rings["crf_hz"].to_numpy()
        axes.errorbar(
            rings["sq_um"], ours, _reach(ours - rings["low"].to_numpy()), rings["sq_std_um"], fmt="o", color=BLUE,
            markerfacecolor="white", markersize=4, capsize=2, elinewidth=0.9, label="ours at a ring's Sq",
        )  # fmt: skip
        known = rings[rings["printed_hz"].notna()]
        axes.errorbar(
            known["sq_um"], known["printed_hz"], xerr=known["sq_std_um"], fmt="D", color="black", markersize=4.5,
            capsize=2, elinewidth=0.9, label="rings, CRF printed", zorder=4,
        )  # fmt: skip
        _draw_full_load(axes, curve)
        axes.set(xlabel="Sq [µm]", ylabel="CRF [Hz]")
        stay_near(axes, np.concatenate([curve.by_case(f"crf_{first}_hz")[1], known["printed_hz"]]))
        medium.title(axes, "The rig's rings and our prediction")
        _key_below(figure, axes, ncols=2, seeds=False)
    return figure


def _draw_mean(
    axes: Axes,
    curve: "WearCurve",
    column: str,
    scale: float,
    stroke: str,
    colour: str,
    label: str,
    *,
    seeds: bool = True,
) -> None:
    """Mean over seeds with its interval as a band, each seed as a faint dot."""
    sq = curve.sq * MICRO
    if seeds:
        at, each = curve.by_case(column)
        axes.plot(at * MICRO, each * scale, ".", color=colour, alpha=0.5, markersize=4.5, markeredgewidth=0, zorder=1)
    axes.update_datalim([(end, 0.0) for end in sq[[0, -1]]], updatey=False)  # levels without a value, too
    low, high = (curve.interval(column) * scale).T
    axes.fill_between(sq, low, high, color=colour, alpha=0.22, linewidth=0, zorder=1)
    axes.plot(
        sq, curve.mean(column) * scale, stroke, color=colour, markersize=3.5, markevery=-(-sq.size // MOST_MARKERS),
        label=label, zorder=2,
    )  # fmt: skip


def _draw_anchors(
    axes: Axes, anchors: "Sequence[Anchor]", columns: Sequence[str], scale: float, marker: str, label: str
) -> None:
    """Numbers known of these columns, with their tolerance; changes from one Sq to another have no place here."""
    places = {}
    for anchor in anchors:
        if anchor.quantity in columns and anchor.sq is not None and anchor.since is None:
            places[anchor.sq, anchor.value] = anchor
    for number, anchor in enumerate(places.values()):
        assert anchor.sq is not None
        axes.errorbar(
            anchor.sq * MICRO, anchor.value * scale, anchor.tolerance * scale, fmt=marker, color="black", markersize=5,
            capsize=2, elinewidth=0.9, markerfacecolor="white", zorder=4, label="_" if number else label,
        )  # fmt: skip


def _reach(half_widths: Field) -> Field:
    """Lengths of error bars; none where there is no interval."""
    return np.where(np.isfinite(half_widths), half_widths, 0.0)


def stay_near(axes: Axes, values: Field) -> None:
    """Keep the scale to what was computed: the interval of two seeds can be ten times as wide as all values."""
    if not values.size:
        return
    lowest, highest = float(values.min()), float(values.max())
    margin = 0.3 * (highest - lowest)
    shown = axes.get_ylim()
    if margin > 0.0:
        axes.set_ylim(max(shown[0], lowest - margin), min(shown[1], highest + margin))


def _draw_full_load(axes: Axes, curve: "WearCurve") -> None:
    known = curve.table["full_load_crf_hz"].dropna().unique()
    if known.size == 1:  # of several, none is the one
        axes.axhline(
            float(known[0]), color="black", linestyle=":", linewidth=1.0, label="all load on asperities", zorder=1
        )


def stage_names(stages: "Stages") -> tuple[str, str]:
    """What the stages on either side of a split are called."""
    return ("normal", "severe") if stages.kind == "severe" else ("running-in", "steady")


def _mark_stages(axes: Axes, curve: "WearCurve", preset: str, *, named: bool) -> None:
    """The split with its interval, and the names of the stages; where there is none, that."""
    stages = curve.stages[preset]
    low, high = curve.sq[[0, -1]] * MICRO
    names: dict[str, Any] = {stages.kind: 0.5 * (low + high)}
    if stages.found:
        axes.axvspan(*stages.interval, color=SPLIT_STRIP, linewidth=0, zorder=0, label="split, 90 %")
        axes.axvline(stages.split, color=SPLIT_COLOUR, linewidth=1.0, zorder=0)
        before, after = stage_names(stages)
        names = {before: 0.5 * (low + stages.split), after: 0.5 * (stages.split + high)}
    for name, middle in names.items() if named else ():
        axes.annotate(
            name, (middle, 0.04), xycoords=("data", "axes fraction"), ha="center", va="bottom", color=SPLIT_COLOUR,
            style="italic", bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.5}, zorder=5,
        )  # fmt: skip


def _key_below(figure: Figure, *panels: Axes, ncols: int, seeds: bool = True) -> None:
    """One key for all panels, below them; a name stands in it once, and faint dots and bands are explained."""
    keys: dict[str, Any] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            keys.setdefault(label, handle)
    keys["mean's 90 % interval"] = Patch(color=GREY, alpha=0.3, linewidth=0)
    if seeds:
        keys["single seeds"] = Line2D([], [], color=GREY, marker=".", linestyle="none", alpha=0.6, markersize=4)
    figure.legend(list(keys.values()), list(keys), loc="outside lower center", ncols=ncols)
