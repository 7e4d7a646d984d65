"""Exhibits of an inference: marginals, pairs, what it would show against what was heard, what to run next."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.inference import KEY_QUANTITIES, Design, Inference
from asperity.report.base import Exhibit
from asperity.report.drawing import legend_below, panels_in_rows
from asperity.report.style import BLUE, GREY, VERMILION, Medium

BINS = 30
SHOWN = 700  # draws in a cloud
SIDE = 2.4  # inches, of a panel
MOST_PAIRS = 3
LONGEST = 28  # letters of a label


def marginals(found: Inference) -> Exhibit:
    """Each quantity before and after."""
    after, before, exact = (
        found.values(draws) for draws in (found.draws, found.prior, found.exact)
    )

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, SIDE * -(-len(after) // 4)), layout="constrained")
        for number, (axes, key) in enumerate(
            zip(panels_in_rows(figure, len(after)), after, strict=True)
        ):
            _marginal(axes, key, (before[key], after[key], exact[key]), named=not number)
        legend_below(figure, 3)
        return figure

    return Exhibit(
        "marginals",
        draw,
        "What was known of each quantity before (grey) and is now (blue), at the case's own load and speed; dashed: if "
        "the laws of the spring had no error. Where blue lies on grey, nothing was learned.",
        "Distributions of every quantity before and after the recordings",
    )


def _marginal(axes: Axes, key: str, draws: tuple[Field, Field, Field], *, named: bool) -> None:
    entry = quantity(key)
    before, after, exact = (entry.factor * values for values in draws)
    low, high = np.quantile(np.concatenate([before, after]), (0.005, 0.995))
    edges = [float(edge) for edge in np.linspace(low, high, BINS + 1)]
    names = ("before", "after", "after, laws exact") if named else ("", "", "")
    axes.hist(before, edges, density=True, color=GREY, alpha=0.35, label=names[0] or None)
    axes.hist(after, edges, density=True, color=BLUE, alpha=0.65, label=names[1] or None)
    axes.hist(
        exact,
        edges,
        density=True,
        histtype="step",
        color="black",
        linestyle="--",
        label=names[2] or None,
    )
    label = (
        entry.label
        if len(entry.label) <= LONGEST
        else f"{entry.name} [{entry.display}]".replace(" along rolling", "")
    )
    axes.set(xlabel=label, yticks=[], xlim=(low, high))
    axes.locator_params(axis="x", nbins=4)


def pairs(found: Inference) -> Exhibit:
    """CLR and Sq, and the unknowns that stand in for one another most."""
    after, before = found.values(found.draws), found.values(found.prior)
    shown = _most_alike(after, [unknown.key for unknown in found.setting.unknowns])

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, SIDE + 0.3), layout="constrained")
        for number, (axes, (first, second)) in enumerate(
            zip(panels_in_rows(figure, len(shown)), shown, strict=True)
        ):
            one, other = quantity(first), quantity(second)
            for values, colour, name in ((before, GREY, "before"), (after, BLUE, "after")):
                axes.plot(
                    one.factor * values[first][:SHOWN],
                    other.factor * values[second][:SHOWN],
                    ".",
                    markersize=2.0,
                    color=colour,
                    alpha=0.5,
                    label=None if number else name,
                    rasterized=True,
                )
            axes.set(xlabel=one.label, ylabel=other.label)
        legend_below(figure, 2, markerscale=4)
        return figure

    return Exhibit(
        "pairs",
        draw,
        "Possible contacts, a point each: load share and roughness, and the pairs of unknowns that stand in for one "
        "another most. A narrow band is a combination that is known where neither of the two is.",
        "Clouds of possible contacts before and after the recordings, in pairs of quantities",
    )


def _most_alike(values: dict[str, Field], keys: Sequence[str]) -> list[tuple[str, str]]:
    chosen = [(KEY_QUANTITIES[1], KEY_QUANTITIES[0])] if KEY_QUANTITIES[1] in values else []
    alike = np.abs(np.corrcoef(np.log(np.maximum(np.array([values[key] for key in keys]), 1e-300))))
    both = [(alike[i, j], keys[i], keys[j]) for i in range(len(keys)) for j in range(i)]
    ranked = sorted(both, key=lambda entry: -float(np.nan_to_num(entry[0])))
    return [*chosen, *((first, second) for _, first, second in ranked)][:MOST_PAIRS]


def predicted(found: Inference) -> Exhibit:
    """CRF at each operating point: heard, and what possible contacts would show."""
    heard = [
        (place, point)
        for place, point in enumerate(found.forward.points)
        if not np.isnan(point.crf.value)
    ]
    again = np.exp(found.posterior_predictive())

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(3.4)
        at = np.arange(len(heard))
        for number, (place, _) in enumerate(heard):
            low, middle, high = np.quantile(again[:, place], (0.05, 0.5, 0.95))
            axes.plot(
                [number, number],
                [low, high],
                color=BLUE,
                linewidth=7,
                alpha=0.35,
                solid_capstyle="butt",
                label=None if number else "90 % of possible contacts",
            )
            axes.plot(number, middle, "_", color=BLUE, markersize=12)
        values = np.array([np.exp(point.crf.value) for _, point in heard])
        stds = np.array([point.crf.std for _, point in heard]) * values
        axes.errorbar(
            at,
            values,
            1.645 * stds,
            fmt="o",
            color=VERMILION,
            markersize=4,
            capsize=3,
            label="heard",
        )
        names = [f"{point.load_n:.4g} N\n{point.entrainment_m_s:.3g} m/s" for _, point in heard]
        axes.set_xticks(at, names, fontsize=7.5)
        axes.set(ylabel=quantity("crf_hz").label, xlim=(-0.6, len(heard) - 0.4))
        legend_below(figure, 2)
        return figure

    return Exhibit(
        "predicted",
        draw,
        "CRF heard at each operating point (repeats together, 90 %), and what contacts would show that are possible by "
        "all of them. Points outside their bar are what no contact explains.",
        "Contact resonance heard at each operating point, beside what possible contacts would show",
    )


def following(found: Inference) -> Exhibit:
    """Bits that one more recording is expected to tell, over load and speed."""
    loads = sorted({one.load_n for one in found.candidates})
    speeds = sorted({one.entrainment_m_s for one in found.candidates})
    expected = {(one.load_n, one.entrainment_m_s): one.information_bits for one in found.candidates}

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(3.4)
        told = np.array([[expected[load, speed] for load in loads] for speed in speeds])
        drawn = axes.contourf(loads, speeds, told, 12, cmap="cividis")
        figure.colorbar(drawn, ax=axes, label="expected information [bits]")
        run = [
            (point.load_n, point.entrainment_m_s) for point in found.forward.points if point.names
        ]
        if run:
            axes.plot(
                *np.array(run).T, "o", color="white", markeredgecolor="black", label="recorded"
            )
        best = found.next_point
        axes.plot(
            best.load_n,
            best.entrainment_m_s,
            "*",
            color=VERMILION,
            markeredgecolor="white",
            markersize=15,
            clip_on=False,
            zorder=5,
            label="to run next",
        )
        axes.set(
            xlabel=quantity("load_n").axis,
            ylabel=quantity("entrainment_speed_m_s").axis,
            yscale="log",
            xscale="log",
        )
        ends = ((axes.xaxis, loads), (axes.yaxis, speeds))
        for axis, values in ends:
            axis.set_ticks(values, [f"{value:.3g}" for value in values])
            axis.set_ticks([], minor=True)
        legend_below(figure, 2)
        return figure

    return Exhibit(
        "next-point",
        draw,
        "What one more recording is expected to tell of all unknowns together, over the loads and speeds that the case "
        "permits.",
        "Expected information over load and speed, with the points recorded and the one to run next",
    )


def levers(design: Design) -> Exhibit:
    """The chance that the load share stays below the value, over each quantity that can be chosen."""

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, SIDE + 0.2), layout="constrained")
        for axes, lever in zip(
            panels_in_rows(figure, len(design.levers), sharey=True), design.levers, strict=True
        ):
            entry = quantity(lever.key)
            axes.plot(entry.factor * lever.values, 100.0 * lever.chances, color=BLUE)
            axes.axhline(95.0, color="black", linestyle="--", linewidth=0.8)
            if lever.bound is not None:
                axes.axvline(entry.factor * lever.bound, color=VERMILION)
            axes.set(
                xlabel=entry.label if len(entry.label) <= LONGEST else entry.name, ylim=(-3, 103)
            )
        figure.supylabel("probability [%]", fontsize="medium")
        return figure

    return Exhibit(
        "levers",
        draw,
        f"Probability that CLR stays below {quantity('clr').text(design.clr)} when one quantity alone is chosen "
        "otherwise, over all contacts that are possible. Dashed: 95 %.",
        "Probability of a low load share over roughness, viscosity, load and speed",
    )
