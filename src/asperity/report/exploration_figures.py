"""Figures of what a wear study hangs on: the factors of a sensitivity study, and a calibration with its open ends.

Display units begin here and end here.
"""

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from asperity.errors import BadInput
from asperity.files import whole_file
from asperity.report.figures import BLUE, GREEN, GREY, MICRO, STYLE, VERMILION, styled
from asperity.study import SEED_FACTOR, CalibratedParameter, Calibration, Sensitivity, SensitivityOutcome

FORMATS = (".png", ".pdf")
DARK = 0.55  # share from which a cell's number is white
FARTHEST_MISS = 8.0  # tolerances: what is farther off stands at the edge, with an arrow
QUANTITIES: dict[str, tuple[str, float, str]] = {  # of an outcome: name, display factor, format of an effect
    "car": ("CAR [%]", 100.0, ".0f"),
    "clr": ("CLR [%]", 100.0, ".0f"),
    "crf_hz": ("CRF [Hz]", 1.0, ".0f"),
    "log10_crfa": ("log₁₀ CRFA", 1.0, ".2f"),
    "knee_m": ("knee [µm]", MICRO, ".2f"),
}
FACTORS = {
    "material.hardness": "pressure cap",
    "surface.correlation_length": "correlation length",
    "lubricant.viscosity.alpha": "pressure-viscosity α",
    "grid.x[0]": "inlet",
    "solver.contact_film": "contact threshold",
    "vibration.cutoff_exponent": "coupling exponent q",
    "vibration.cutoff_reference": "cut-off at CAR 1",
    SEED_FACTOR: "surface (seed)",
}


def write_figure(figure: Figure, path: Path) -> Path:
    """Write the figure as PNG or PDF, by its name, whole or not at all; BadInput for another ending."""
    if path.suffix not in FORMATS:
        raise BadInput(f"a figure must end in {' or '.join(FORMATS)}, got {path}")
    about: dict[str, Any] = {"Software": None} if path.suffix == ".png" else {"CreationDate": None}
    with whole_file(path) as part, matplotlib.rc_context({**STYLE, "pdf.fonttype": 42}):
        figure.savefig(part, format=path.suffix[1:], dpi=160, metadata=about)
    return path


@styled()
def sensitivity_figure(found: Sensitivity) -> Figure:
    """Factors over outcomes, dark where a factor moves an outcome most, with the size of its effect."""
    order = [str(name) for name in found.overall().index]
    outcomes, measure = found.outcomes, found.measure
    rows: dict[tuple[str, str], Any] = {
        (row["factor"], row["outcome"]): row for row in found.effects.to_dict("records")
    }
    share = np.array([[rows[factor, one.name]["share"] for one in outcomes] for factor in order])

    figure = Figure(figsize=(2.6 + 0.52 * len(outcomes), 1.55 + 0.34 * len(order)), layout="constrained")
    axes, side = figure.subplots(1, 2, width_ratios=(0.52 * len(outcomes), 1.3), sharey=True)
    axes.imshow(share, cmap="Blues", vmin=0.0, vmax=max(0.7, float(share.max())), aspect="auto")
    for row, factor in enumerate(order):
        for column, one in enumerate(outcomes):
            text = _effect(one, rows[factor, one.name][measure], found.method)
            colour = "white" if share[row, column] > DARK * max(0.7, float(share.max())) else "black"
            axes.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
    axes.set_yticks(range(len(order)), [FACTORS.get(name, name) for name in order])
    axes.set_xticks(range(len(outcomes)), [f"{MICRO * one.sq:g}" if np.isfinite(one.sq) else "" for one in outcomes])
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("Sq [µm]")
    _head(axes, outcomes)
    whole = found.overall()
    side.barh(range(len(order)), [100.0 * whole[name] for name in order], color=BLUE, height=0.7)
    side.tick_params(left=False, labelleft=False)
    side.set(xlabel="mean share [%]")
    what = "mean effect of crossing the range (Morris' μ*)" if found.method == "morris" else "total Sobol index"
    figure.suptitle(
        f"What moves the curves: {what}", x=0.01, ha="left", fontsize=STYLE["axes.titlesize"], fontweight="bold"
    )
    return figure


def _effect(outcome: SensitivityOutcome, value: float, method: str) -> str:
    if method == "sobol":
        return f"{value:.2f}"
    _, scale, shown = QUANTITIES[outcome.quantity]
    return f"{scale * value:{shown}}"


def _head(axes: Axes, outcomes: tuple[SensitivityOutcome, ...]) -> None:
    """Names of the quantities above their columns, a white line between them."""
    for quantity, (name, *_) in QUANTITIES.items():
        columns = [column for column, one in enumerate(outcomes) if one.quantity == quantity]
        if columns:
            middle, first = (columns[0] + columns[-1]) / 2.0, columns[0]
            axes.annotate(
                name, (middle, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 4), textcoords="offset points",
                ha="center", fontsize=8.5,
            )  # fmt: skip
            if first:
                axes.axvline(first - 0.5, color="white", linewidth=3)


@styled()
def calibration_figure(found: Calibration) -> Figure:
    """How far each anchor is missed before and after, what was found in which range, the curves with the anchors."""
    figure = Figure(figsize=(11.2, 4.3), layout="constrained")
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.0, 1.05, 1.1))
    _misses(left, found)
    _ranges(middle, found)
    _curves(right, found)
    return figure


def _misses(axes: Axes, found: Calibration) -> None:
    names = [anchor.name for anchor in found.aimed_at]
    axes.axvspan(-1.0, 1.0, color="#dbeafe", linewidth=0)
    tables = (
        ("as given", found.start, GREY, "x"),
        ("calibrated", found.fit, BLUE, "o"),
        ("checked", found.check, VERMILION, "s"),
    )
    for number, (_, table, colour, marker) in enumerate(tables):
        rows: dict[str, Any] = {row["anchor"]: row for row in table.to_dict("records")}
        for place, name in enumerate(names):
            miss = rows[name]["miss"] / rows[name]["tolerance"]
            at = place + 0.2 * (number - 1)
            if not np.isfinite(miss):
                continue
            beyond = abs(miss) > FARTHEST_MISS
            side = float(np.sign(miss))
            marked = (">" if side > 0 else "<") if beyond else marker
            axes.plot(side * FARTHEST_MISS if beyond else miss, at, marked, color=colour, markersize=5)
            if beyond:
                axes.annotate(
                    f"{miss:.0f}", (side * FARTHEST_MISS, at), xytext=(-7 * side, 0), textcoords="offset points",
                    ha="right" if side > 0 else "left", va="center", fontsize=7.5, color=colour,
                )  # fmt: skip
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set(xlim=(-1.1 * FARTHEST_MISS, 1.1 * FARTHEST_MISS), ylim=(len(names) - 0.5, -0.5))
    axes.set(xlabel="miss [tolerances]", title="Anchors")
    axes.set_yticks(range(len(names)), [_wrapped(name) for name in names], fontsize=8)
    handles = [Line2D([], [], linestyle="", color=c, marker=m, markersize=5, label=label) for label, _, c, m in tables]
    axes.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.3, -0.34), ncols=3, columnspacing=1.0)


def _ranges(axes: Axes, found: Calibration) -> None:
    for place, one in enumerate(found.parameters):
        colour = BLUE if one.identifiable else GREY
        share = one.range.share(one.value)
        axes.plot((0.0, 1.0), (place, place), color="#e5e7eb", linewidth=9, solid_capstyle="butt")
        ends = [one.range.share(end) for end in (one.low, one.high)]
        axes.plot(ends, (place, place), color=colour, linewidth=3, solid_capstyle="butt")
        axes.plot(share, place, "o", color=colour, markersize=6)
        axes.annotate(
            _parameter(one), (0.0, place), xytext=(0, 8), textcoords="offset points", fontsize=8.5, color="black"
        )
        for end, value, align in ((0.0, one.range.low, "left"), (1.0, one.range.high, "right")):
            axes.annotate(
                f"{value:g}", (end, place), xytext=(0, -13), textcoords="offset points", ha=align, fontsize=7.5,
                color=GREY,
            )  # fmt: skip
    axes.set(xlim=(-0.02, 1.02), ylim=(len(found.parameters) - 0.4, -0.7), title="Free quantities in their ranges")
    axes.set_yticks([])
    axes.set_xticks([])
    axes.spines[:].set_visible(False)
    axes.annotate(
        "bar: one standard deviation; grey: not determined", (0.0, -0.02), xycoords="axes fraction", va="top",
        fontsize=8, color=GREY,
    )  # fmt: skip


def _parameter(one: CalibratedParameter) -> str:
    unit = f" {one.range.unit}" if one.range.unit else ""
    text = f"{FACTORS.get(one.range.key, one.range.key)}: {one.value:.3g}{unit}"
    return f"{text}, {100 * one.learnt:.0f} % learnt"


def _curves(axes: Axes, found: Calibration) -> None:
    sq = MICRO * found.check_curve.sq
    for quantity, name, colour, stroke, marker in (
        ("car_domain", "CAR of the domain", BLUE, "-", "o"),
        ("clr", "CLR", VERMILION, "--", "s"),
    ):
        low, high = 100.0 * found.check_curve.interval(quantity).T
        axes.fill_between(sq, low, high, color=colour, alpha=0.15, linewidth=0)
        axes.plot(
            sq, 100.0 * found.check_curve.mean(quantity), stroke, color=colour, marker=marker, markersize=4, label=name
        )
        axes.plot(
            MICRO * found.start_curve.sq, 100.0 * found.start_curve.mean(quantity), ":", color=colour, linewidth=1.0
        )
        for anchor in found.anchors:
            if anchor.quantity == quantity and anchor.since is None and anchor.sq is not None:
                axes.errorbar(
                    MICRO * anchor.sq, 100.0 * anchor.value, 100.0 * anchor.tolerance, fmt="D", color=GREEN,
                    markersize=4, capsize=2, zorder=5,
                )  # fmt: skip
    axes.plot([], [], ":", color=GREY, linewidth=1.0, label="as given")
    axes.plot([], [], "D", color=GREEN, markersize=4, label="anchors")
    axes.set(
        xlabel="composite roughness Sq [µm]", ylabel="share [%]", ylim=(0.0, 105.0), title="Checked on other surfaces"
    )
    axes.legend(loc="lower center", bbox_to_anchor=(0.45, -0.34), ncols=4, columnspacing=1.0)


def _wrapped(name: str) -> str:
    """Two lines of about equal length."""
    words = name.replace(" um", "\u00a0um").split(" ")
    cut = min(range(1, len(words) + 1), key=lambda i: abs(len(" ".join(words[:i])) - len(name) / 2))
    return "\n".join(part for part in (" ".join(words[:cut]), " ".join(words[cut:])) if part)
