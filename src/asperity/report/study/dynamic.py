"""Exhibits of dynamic stiffness and damping in a wear study, and their correlation with CLR."""

from collections.abc import Iterator

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure

from asperity.core.quantities import quantity, with_deviation
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, panels_in_rows
from asperity.report.study.curve import (
    draw_mean,
    first_to_last,
    legend_note,
    legend_of_panels,
    limit_to_data,
)
from asperity.report.style import BLUE, GREEN, GREY, Medium, Style
from asperity.study import StudyOverview, WearCurve

ELASTIC = "contact_damping_ratio"
VIRGIN = "contact_damping_ratio_virgin"
STIFFNESS = "contact_stiffness_n_m"
BY_LAW = "crf_sound_hz"


def dynamic_exhibits(study: StudyOverview, curve: WearCurve) -> Iterator[Exhibit]:
    """Yield the exhibits of dynamic stiffness and damping, if the study computed them."""
    if ELASTIC in curve.table and np.isfinite(curve.mean(ELASTIC)).any():
        yield damping_over_roughness(study, curve)
        yield clr_correlations(study, curve)


def damping_over_roughness(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """Draw the damping ratio and dynamic stiffness of the contact over Sq."""

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 1.25 * medium.single), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        draw_mean(upper, curve, ELASTIC, "-o", GREEN, "yielded cells elastic")
        if VIRGIN in curve.table:
            draw_mean(upper, curve, VIRGIN, "--s", GREY, "yielded cells flowing")
        upper.axhline(0.0, color="black", linewidth=0.6)
        upper.set_ylabel(f"damping ratio {quantity(ELASTIC).label}")
        draw_mean(lower, curve, STIFFNESS, "-o", BLUE, "stiffness, yielded cells elastic")
        name_axes(lower, "sq_m", ylabel=quantity(STIFFNESS).label)
        for axes, keys in ((upper, [ELASTIC, VIRGIN]), (lower, [STIFFNESS])):
            limit_to_data(
                axes,
                np.concatenate(
                    [display(key, curve.by_case(key)[1]) for key in keys if key in curve.table]
                ),
            )
        medium.title(upper, "Dynamic damping and stiffness of the contact")
        legend_of_panels(figure, upper, lower, columns=2)
        return figure

    span = first_to_last(ELASTIC, curve.mean(ELASTIC))
    return Exhibit(
        "damping",
        draw,
        "Damping ratio of the contact and its stiffness k at resonance, both computed from the "
        "solved contact without the laws of the paper. Yielded cells elastic: surfaces that have "
        f"run in; flowing: virgin roughness. {legend_note(study)}",
        f"Damping ratio of the contact over Sq, {span}, and its dynamic stiffness.",
    )


def clr_correlations(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """Draw CLR of every contact over CRF by law, dynamic stiffness and damping."""
    rows = study.used
    keys = [key for key in (BY_LAW, STIFFNESS, ELASTIC) if key in curve.table]
    ranks = {key: rank_correlation(rows, key) for key in keys}

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, 0.42 * medium.double), layout="constrained")
        panels = panels_in_rows(figure, len(keys), sharey=True)
        for axes, key, letter in zip(panels, keys, "abc", strict=False):
            dots = _draw_correlation(axes, rows, key)
            title = _title(ranks[key])
            medium.title(axes, title, f"({letter}) {title}")
        panels[0].set_ylabel(quantity("clr").label)
        figure.colorbar(dots, ax=panels, label=quantity("sq_m").label, pad=0.01)
        return figure

    text = "; ".join(f"{quantity(key).short}: {_number(rank)}" for key, rank in ranks.items())
    return Exhibit(
        "load-share-correlations",
        draw,
        "Asperity load share of each contact over quantities that a recording can show; colour: "
        f"Sq. Rank correlation: {text}. CRF is computed from CLR by the empirical law of the "
        "paper, so its correlation tests nothing; stiffness and damping come from the solved "
        "contacts.",
        "Asperity load share over CRF by law, dynamic stiffness and damping. Rank correlations: "
        f"{text}.",
    )


def _draw_correlation(axes: Axes, rows: pandas.DataFrame, key: str) -> PathCollection:
    """Draw CLR over a quantity of each contact, coloured by Sq."""
    x, clr, sq = (
        display(name, rows[column].to_numpy(dtype=float))
        for name, column in ((key, key), ("clr", "clr"), ("sq_m", "surface.sq"))
    )
    finite = np.isfinite(x)
    style: Style = {"cmap": "cividis", "s": 14, "edgecolors": "white", "linewidths": 0.3}
    colour = sq[finite]
    dots = axes.scatter(x[finite], clr[finite], c=colour, vmin=colour.min(initial=0.0), **style)
    axes.set_xlabel(quantity(key).label)
    if key == ELASTIC and np.all(x[finite] > 0.0):
        axes.set_xscale("log")
    return dots


def rank_correlation(rows: pandas.DataFrame, key: str) -> float:
    """Return Spearman's rank correlation of CLR and a column; nan if either does not vary."""
    pairs = rows[["clr", key]].dropna()
    return float(pairs.corr(method="spearman").to_numpy()[0, 1]) if len(pairs) > 2 else float("nan")


def _number(rank: float) -> str:
    return with_deviation(rank, None, "+.2f") if np.isfinite(rank) else "none"


def _title(rank: float) -> str:
    return f"rank correlation {_number(rank)}"
