"""Exhibits of a wear study that shook its contacts: damping and stiffness over Sq, and what tells the load share."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas
from matplotlib.figure import Figure

from asperity.core.quantities import quantity, with_deviation
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, panels_in_rows
from asperity.report.study.curve import (
    draw_mean,
    first_to_last,
    key_below,
    stay_near,
    surfaces_in_words,
)
from asperity.report.style import BLUE, GREEN, GREY, Medium
from asperity.study import StudyOverview, WearCurve

ELASTIC, VIRGIN, STIFFNESS = (
    "contact_damping_ratio",
    "contact_damping_ratio_virgin",
    "contact_stiffness_n_m",
)
BY_LAW = "crf_sound_hz"


def shaken_exhibits(study: StudyOverview, curve: WearCurve) -> Iterator[Exhibit]:
    """What is shown of contacts that were shaken; nothing where none was."""
    if ELASTIC in curve.table and np.isfinite(curve.mean(ELASTIC)).any():
        yield over_roughness(study, curve)
        yield told_by(study, curve)


def over_roughness(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """Damping ratio and dynamic stiffness of the contact itself over Sq."""

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 1.25 * medium.single), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        draw_mean(above, curve, ELASTIC, "-o", GREEN, "yielded cells elastic")
        if VIRGIN in curve.table:
            draw_mean(above, curve, VIRGIN, "--s", GREY, "yielded cells flowing")
        above.axhline(0.0, color="black", linewidth=0.6)
        above.set_ylabel(f"damping ratio {quantity(ELASTIC).label}")
        draw_mean(below, curve, STIFFNESS, "-o", BLUE, "stiffness, yielded cells elastic")
        name_axes(below, "sq_m", ylabel=quantity(STIFFNESS).label)
        for axes, keys in ((above, [ELASTIC, VIRGIN]), (below, [STIFFNESS])):
            stay_near(
                axes,
                np.concatenate(
                    [display(key, curve.by_case(key)[1]) for key in keys if key in curve.table]
                ),
            )
        medium.title(above, "Damping and stiffness of the contact itself")
        key_below(figure, above, below, columns=2)
        return figure

    ends = first_to_last(ELASTIC, curve.mean(ELASTIC))
    return Exhibit(
        "damping",
        draw,
        "Damping ratio of the oil in the contact, and the contact's own stiffness k where the mass resonates on it, at "
        "the root of k over the mass; no law of the paper's is in either. Elastic: tracks that come round again, what "
        f"yielded once stays flat; flowing: virgin roughness. {surfaces_in_words(study)}",
        f"Damping ratio of the contact against Sq, {ends}, and its own stiffness.",
    )


def told_by(study: StudyOverview, curve: WearCurve) -> Exhibit:
    """The load share of every contact over CRF by law, over its own stiffness, and over its damping."""
    keys = [key for key in (BY_LAW, STIFFNESS, ELASTIC) if key in curve.table]
    rows = study.used
    ranks = {key: rank_correlation(rows, key) for key in keys}

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.double, 0.42 * medium.double), layout="constrained")
        panels = panels_in_rows(figure, len(keys), sharey=True)
        style: Any = {"cmap": "cividis", "s": 14, "edgecolors": "white", "linewidths": 0.3}
        for axes, key, letter in zip(panels, keys, "abc", strict=False):
            x, y = (
                display(key, rows[key].to_numpy(dtype=float)),
                display("clr", rows["clr"].to_numpy(dtype=float)),
            )
            known = np.isfinite(x)
            sq = display("sq_m", rows["surface.sq"].to_numpy(dtype=float))[known]
            dots = axes.scatter(x[known], y[known], c=sq, vmin=sq.min(initial=0.0), **style)
            axes.set_xlabel(quantity(key).label)
            if key == ELASTIC and np.all(x[known] > 0.0):
                axes.set_xscale("log")
            medium.title(axes, _title(ranks[key]), f"({letter}) {_title(ranks[key])}")
        panels[0].set_ylabel(quantity("clr").label)
        figure.colorbar(dots, ax=panels, label=quantity("sq_m").label, pad=0.01)
        return figure

    in_words = "; ".join(f"{quantity(key).short}: {_number(rank)}" for key, rank in ranks.items())
    return Exhibit(
        "told",
        draw,
        "Load share of each contact over what a recording may show of it; colour is Sq. Rank correlation (±1 tells "
        f"all, 0 nothing): {in_words}. CRF follows from CLR by the paper's empirical law, so that it says nothing of "
        "whether a contact does that; stiffness, whose root is the frequency, and damping are read off the solved "
        "contacts.",
        f"Load share against CRF by law, the contact's own stiffness, and its damping. Rank correlations: {in_words}.",
    )


def rank_correlation(rows: pandas.DataFrame, key: str) -> float:
    """Spearman's, of the load share and another column, over the cases that have both; nan where one does not vary."""
    both = rows[["clr", key]].dropna()
    return float(both.corr(method="spearman").to_numpy()[0, 1]) if len(both) > 2 else float("nan")


def _number(rank: float) -> str:
    return with_deviation(rank, None, "+.2f") if np.isfinite(rank) else "none"


def _title(rank: float) -> str:
    return f"rank correlation {_number(rank)}"
