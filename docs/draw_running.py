"""Draw the figures on running roughness: `python docs/draw_running.py`.

The tables in docs/measured come from `python -m benchmarks.load_share` and
`python -m benchmarks.anchors --curves`.
"""

from pathlib import Path

import numpy as np
import pandas
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.paper import PAPER_ANCHORS
from asperity.report.style import BLUE, DASHED, GREEN, GREY, ON_PAGE, VERMILION, write_figure

DOCS = Path(__file__).parent
LOAD_SHARE, LEVELS = (DOCS / "measured" / name for name in ("load-share.csv", "paper-levels.csv"))
SOLVED = (  # column, label, colour, marker, and shift along the film ratio for legible intervals
    ("snapshot", "snapshot, mixed", GREY, "s", 0.02),
    ("running", "running, mixed", BLUE, "o", 0.0),
    ("conserving", "running, conserving", GREEN, "^", -0.02),
)
LAWS = (
    ("masjedi_khonsari", "Masjedi and Khonsari", DASHED),
    ("olver_spikes", "Olver and Spikes", ":"),
)
STUDIES = (("standing", GREY), ("running", BLUE))
PANELS = (
    ("car_domain", 100.0, "CAR of the domain [%]"),
    ("clr", 100.0, "CLR [%]"),
    ("crf_sound_hz", 1.0, "CRF [Hz]"),
    ("crfa_sound", 1e3, "CRFA [1e-3 (m/s²)²/Hz]"),
)


@ON_PAGE.drawing()
def load_share(path: Path = LOAD_SHARE) -> Figure:
    """Draw load share over film ratio, a panel for each slope."""
    table = pandas.read_csv(path)
    drawn = Figure(figsize=(ON_PAGE.double, 3.6), layout="constrained")
    ratios = sorted(table["lengths_per_sq"].unique())
    for axes, ratio in zip(drawn.subplots(1, len(ratios), sharey=True), ratios, strict=True):
        rows = table[table["lengths_per_sq"] == ratio]
        x = rows["film_ratio"]
        for key, label, colour, marker, shift in SOLVED:
            middle, low, high = (rows[key + end] for end in ("", "_low", "_high"))
            span = np.nan_to_num(np.maximum([middle - low, high - middle], 0.0))
            style = {"color": colour, "marker": marker, "markersize": 5.0, "clip_on": False}
            axes.errorbar(x + shift, middle, span, capsize=2.0, label=label, **style)
        for key, label, stroke in LAWS:
            axes.plot(x, rows[key], color=VERMILION, linestyle=stroke, label=label)
        axes.set_title(f"l/Sq {ratio:.0f}, Sdq {rows['sdq'].mean():.3f}")
        axes.set_xlabel("film ratio Λ")
        axes.set_ylim(0.0, 1.0)
    first: Axes = drawn.axes[0]
    first.set_ylabel("CLR")
    drawn.legend(*first.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return drawn


@ON_PAGE.drawing()
def levels(path: Path = LEVELS) -> Figure:
    """Draw the quantities of the paper's Figures 6 to 8 over Sq, running and standing."""
    table = pandas.read_csv(path)
    drawn = Figure(figsize=(ON_PAGE.double, 6.0), layout="constrained")
    for axes, (key, factor, label) in zip(drawn.subplots(2, 2).flat, PANELS, strict=True):
        for study, colour in STUDIES:
            rows = table[table["study"] == study]
            middle, low, high = (factor * rows[key + end] for end in ("", "_low", "_high"))
            axes.fill_between(rows["sq_um"], low, high, color=colour, alpha=0.2, linewidth=0)
            axes.plot(rows["sq_um"], middle, color=colour, label=f"{study} roughness")
        published = [
            (1e6 * anchor.sq, factor * anchor.value)
            for anchor in PAPER_ANCHORS
            if anchor.quantity == key and anchor.sq is not None and anchor.since is None
        ]
        if published:
            axes.plot(*zip(*published, strict=True), "x", color=VERMILION, label="paper")
        axes.set_xlabel("Sq [um]")
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0 if key != "crf_sound_hz" else None)
    drawn.axes[1].legend(loc="lower right")
    drawn.align_ylabels()
    return drawn


if __name__ == "__main__":
    write_figure(load_share(), DOCS / "images" / "load-share-laws.png")
    write_figure(levels(), DOCS / "images" / "paper-running.png")
