"""Exhibits of an inference: marginals, pairs, predictions, next recording, design changes."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR, PERCENT, QUANTILES
from asperity.core.quantities import quantity
from asperity.inference import KEY_QUANTITIES, Design, Inference, ObservationPoint
from asperity.report.base import Exhibit
from asperity.report.drawing import legend_below, panels_in_rows
from asperity.report.style import BLUE, GREY, VERMILION, Medium, Style

BINS = 30
MAX_DRAWS = 700  # in a scatter plot
PANEL_SIZE = 2.4  # inches
MAX_PAIRS = 3
MAX_LABEL = 28  # characters


def marginals(inference: Inference) -> Exhibit:
    """Draw the prior and posterior distribution of each quantity."""
    posterior, prior, exact = (
        inference.values(draws) for draws in (inference.draws, inference.prior, inference.exact)
    )

    def draw(medium: Medium) -> Figure:
        size = medium.double, PANEL_SIZE * -(-len(posterior) // 4)
        figure = Figure(figsize=size, layout="constrained")
        for number, (axes, key) in enumerate(
            zip(panels_in_rows(figure, len(posterior)), posterior, strict=True)
        ):
            _marginal(axes, key, (prior[key], posterior[key], exact[key]), labelled=not number)
        legend_below(figure, 3)
        return figure

    return Exhibit(
        "marginals",
        draw,
        "Prior (grey) and posterior (blue) of each quantity at load and speed of the case. Dashed: "
        "posterior without the error of the stiffness laws. If blue equals grey, the recordings "
        "contain no information.",
        "Prior and posterior distribution of every quantity",
    )


def _marginal(axes: Axes, key: str, draws: tuple[Field, Field, Field], *, labelled: bool) -> None:
    entry = quantity(key)
    prior, posterior, exact = (entry.factor * values for values in draws)
    low, high = np.quantile(np.concatenate([prior, posterior]), (0.005, 0.995))
    edges = [float(edge) for edge in np.linspace(low, high, BINS + 1)]
    names = ("prior", "posterior", "posterior, exact laws") if labelled else ("", "", "")
    axes.hist(prior, edges, density=True, color=GREY, alpha=0.35, label=names[0] or None)
    axes.hist(posterior, edges, density=True, color=BLUE, alpha=0.65, label=names[1] or None)
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
        if len(entry.label) <= MAX_LABEL
        else f"{entry.name} [{entry.display}]".replace(" along rolling", "")
    )
    axes.set(xlabel=label, yticks=[], xlim=(low, high))
    axes.locator_params(axis="x", nbins=4)


def pairs(inference: Inference) -> Exhibit:
    """Draw CLR over Sq, and the most correlated pairs of unknowns."""
    posterior = inference.values(inference.draws)
    prior = inference.values(inference.prior)
    selected = _most_correlated(posterior, [unknown.key for unknown in inference.setting.unknowns])

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, PANEL_SIZE + 0.3), layout="constrained")
        for number, (axes, (first, second)) in enumerate(
            zip(panels_in_rows(figure, len(selected)), selected, strict=True)
        ):
            x = quantity(first)
            y = quantity(second)
            for values, colour, name in ((prior, GREY, "prior"), (posterior, BLUE, "posterior")):
                axes.plot(
                    x.factor * values[first][:MAX_DRAWS],
                    y.factor * values[second][:MAX_DRAWS],
                    ".",
                    markersize=2.0,
                    color=colour,
                    alpha=0.5,
                    label=None if number else name,
                    rasterized=True,
                )
            axes.set(xlabel=x.label, ylabel=y.label)
        legend_below(figure, 2, markerscale=4)
        return figure

    return Exhibit(
        "pairs",
        draw,
        "Draws of prior and posterior: asperity load share and roughness, and the most correlated "
        "pairs of unknowns. In a narrow band, only a combination of the two is known.",
        "Draws of prior and posterior in pairs of quantities",
    )


def _most_correlated(values: dict[str, Field], keys: Sequence[str]) -> list[tuple[str, str]]:
    first_pair = [(KEY_QUANTITIES[1], KEY_QUANTITIES[0])] if KEY_QUANTITIES[1] in values else []
    logs = np.log(np.maximum(np.array([values[key] for key in keys]), 1e-300))
    correlation = np.abs(np.corrcoef(logs))
    all_pairs = [(correlation[i, j], keys[i], keys[j]) for i in range(len(keys)) for j in range(i)]
    ranked = sorted(all_pairs, key=lambda entry: -float(np.nan_to_num(entry[0])))
    return [*first_pair, *((first, second) for _, first, second in ranked)][:MAX_PAIRS]


def predicted(inference: Inference) -> Exhibit:
    """Draw observed and posterior predictive CRF at each operating point."""
    observed = [
        (index, point)
        for index, point in enumerate(inference.forward.points)
        if not np.isnan(point.crf.value)
    ]
    predictions = np.exp(inference.posterior_predictive())

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(3.4)
        for number, (index, _) in enumerate(observed):
            low, middle, high = np.quantile(predictions[:, index], QUANTILES)
            style: Style = {"linewidth": 7, "alpha": 0.35, "solid_capstyle": "butt"}
            label = None if number else f"predicted, {PERCENT}"
            axes.plot([number, number], [low, high], color=BLUE, label=label, **style)
            axes.plot(number, middle, "_", color=BLUE, markersize=12)
        x = np.arange(len(observed))
        (values, stds) = _observed_crf(observed)
        style = {"color": VERMILION, "markersize": 4, "capsize": 3, "label": "observed"}
        axes.errorbar(x, values, NORMAL_FACTOR * stds, fmt="o", **style)
        names = [f"{point.load_n:.4g} N\n{point.entrainment_m_s:.3g} m/s" for _, point in observed]
        axes.set_xticks(x, names, fontsize=7.5)
        axes.set(ylabel=quantity("crf_hz").label, xlim=(-0.6, len(observed) - 0.4))
        legend_below(figure, 2)
        return figure

    return Exhibit(
        "predicted",
        draw,
        f"CRF observed at each operating point (repeats combined, {PERCENT} interval) and "
        "predicted from the posterior of all recordings. The model does not explain points outside "
        "their bar.",
        "Contact resonance frequency at each operating point, observed and predicted",
    )


def _observed_crf(observed: Sequence[tuple[int, ObservationPoint]]) -> tuple[Field, Field]:
    """Return the observed CRF [Hz] at each operating point and its standard deviation."""
    values = np.array([np.exp(point.crf.value) for _, point in observed])
    return values, np.array([point.crf.std for _, point in observed]) * values


def next_recording(inference: Inference) -> Exhibit:
    """Draw the expected information of one more recording over load and speed."""
    candidates = inference.candidates
    loads = sorted({candidate.load_n for candidate in candidates})
    speeds = sorted({candidate.entrainment_m_s for candidate in candidates})
    expected = {
        (candidate.load_n, candidate.entrainment_m_s): candidate.information_bits
        for candidate in candidates
    }

    def draw(medium: Medium) -> Figure:
        figure, axes = medium.panel(3.4)
        bits = np.array([[expected[load, speed] for load in loads] for speed in speeds])
        contours = axes.contourf(loads, speeds, bits, 12, cmap="cividis")
        figure.colorbar(contours, ax=axes, label="expected information [bits]")
        recorded = [
            (point.load_n, point.entrainment_m_s)
            for point in inference.forward.points
            if point.names
        ]
        if recorded:
            axes.plot(
                *np.array(recorded).T, "o", color="white", markeredgecolor="black", label="recorded"
            )
        best = inference.next_point
        axes.plot(
            best.load_n,
            best.entrainment_m_s,
            "*",
            color=VERMILION,
            markeredgecolor="white",
            markersize=15,
            clip_on=False,
            zorder=5,
            label="recommended next",
        )
        axes.set(
            xlabel=quantity("load_n").axis,
            ylabel=quantity("entrainment_speed_m_s").axis,
            yscale="log",
            xscale="log",
        )
        axis_values = ((axes.xaxis, loads), (axes.yaxis, speeds))
        for axis, values in axis_values:
            axis.set_ticks(values, [f"{value:.3g}" for value in values])
            axis.set_ticks([], minor=True)
        legend_below(figure, 2)
        return figure

    return Exhibit(
        "next-point",
        draw,
        "Expected information gain from one more recording about all unknowns, over the loads "
        "and speeds that the case permits.",
        "Expected information gain over load and speed, with recorded points and the recommended "
        "next one",
    )


def design_changes(design: Design) -> Exhibit:
    """Draw the probability of a CLR below the limit over each design quantity."""

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, PANEL_SIZE + 0.2), layout="constrained")
        for axes, lever in zip(
            panels_in_rows(figure, len(design.levers), sharey=True), design.levers, strict=True
        ):
            entry = quantity(lever.key)
            axes.plot(entry.factor * lever.values, 100.0 * lever.chances, color=BLUE)
            axes.axhline(95.0, color="black", linestyle="--", linewidth=0.8)
            if lever.bound is not None:
                axes.axvline(entry.factor * lever.bound, color=VERMILION)
            axes.set(
                xlabel=entry.label if len(entry.label) <= MAX_LABEL else entry.name, ylim=(-3, 103)
            )
        figure.supylabel("probability [%]", fontsize="medium")
        return figure

    return Exhibit(
        "levers",
        draw,
        f"Probability that CLR stays below {quantity('clr').text(design.clr)} if one quantity is "
        "changed, over the posterior. Dashed: 95 %.",
        "Probability of a low asperity load share over roughness, viscosity, load and speed",
    )
