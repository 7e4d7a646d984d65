"""The figures of any study: each output against each swept quantity, and maps over two of them.

Swept quantities are shown in the unit they were written in, outputs in display units.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from asperity.arrays import Field
from asperity.report.figures import BLUE, GREY
from asperity.report.study_figures import Medium, stay_near
from asperity.study import MEAN_CONFIDENCE, SweptAxis, group_means, pair_means

if TYPE_CHECKING:
    import pandas

MOST_DRAWN = 1500  # dots as drawings; more are a picture
MOST_WRITTEN = 8  # values a side of a map whose cells hold their number
ACROSS = 4
NAMES = {
    "sq": "Sq",
    "alpha": "pressure-viscosity coefficient α",
    "eta0": "viscosity η0",
    "slip": "slide-to-roll ratio",
    "x": "domain along rolling (half-widths)",
}
UNITS = {"um": "µm", "degC": "°C", "Pa s": "Pa·s", "N s/m": "N·s/m", "g/cm^3": "g/cm³", "kg/m^3": "kg/m³"}


@dataclass(frozen=True, slots=True)
class Output:
    """A column of a study's table as people read it."""

    column: str
    name: str
    unit: str
    scale: float

    @property
    def label(self) -> str:
        """Name with unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


OUTPUTS = (
    Output("clr", "CLR", "%", 100.0),
    Output("car", "CAR, Hertz zone", "%", 100.0),
    Output("car_domain", "CAR, domain", "%", 100.0),
    Output("h_central_m", "central film", "µm", 1e6),
    Output("p_max_pa", "largest pressure", "GPa", 1e-9),
    Output("friction_coefficient", "friction", "", 1.0),
    Output("flash_temperature_max_k", "flash temperature", "K", 1.0),
    Output("von_mises_core_pa", "von Mises, core", "GPa", 1e-9),
    Output("crf_sound_hz", "CRF, sound", "Hz", 1.0),
    Output("crf_paper_hz", "CRF, paper", "Hz", 1.0),
    Output("crf_hz", "CRF", "Hz", 1.0),
    Output("crfa_sound", "CRFA, sound", "(m/s²)²/Hz", 1.0),
    Output("crfa_paper", "CRFA, paper", "(m/s²)²/Hz", 1.0),
    Output("crfa", "CRFA", "(m/s²)²/Hz", 1.0),
    Output("expected_crfa", "expected CRFA", "(m/s²)²/Hz", 1.0),
    Output("dynamic_load", "dynamic force over load", "", 1.0),
)


def axis_label(axis: SweptAxis) -> str:
    """What is swept, with the unit it was written in."""
    key = axis.key.rpartition(".")[2]
    name = NAMES.get(key, key.replace("_", " "))
    return f"{name} [{UNITS.get(axis.unit, axis.unit)}]" if axis.unit else name


def place_in_words(axis: SweptAxis, value: float) -> str:
    """A value of an axis as people read it."""
    return axis.names[int(value)] if axis.names else f"{value:.4g}".replace("-", "−")


# Against one quantity ------------------------------------------------------------------------------------------------


def against(table: "pandas.DataFrame", axis: SweptAxis, outputs: Sequence[Output], medium: Medium) -> Figure:
    """Every output against one swept quantity: each case, and means with their intervals."""
    with medium.drawing():
        figure, panels = _sheet(len(outputs), medium, shape=0.85, key=1.6)
        for output, axes in zip(outputs, panels, strict=True):
            values = table[output.column].to_numpy(dtype=float) * output.scale
            known = np.isfinite(values)
            axes.plot(
                axis.values[known],
                values[known],
                ".",
                color=GREY,
                alpha=0.6,
                markersize=4.5,
                markeredgewidth=0,
                rasterized=values.size > MOST_DRAWN,
            )
            x, mean, low, high = group_means(axis.values[known], values[known], binned=axis.binned)
            joined = "none" if axis.names else "-"
            reach = np.array([mean - low, high - mean])
            axes.errorbar(
                x, mean, np.where(np.isfinite(reach), reach, 0.0), fmt="o", linestyle=joined, color=BLUE, capsize=2,
                markersize=3.5, elinewidth=0.9,
            )  # fmt: skip
            stay_near(axes, values[known])
            axes.set_title(output.label, fontweight="normal", fontsize="small")
            _scale(axes, axis)
        _name_lowest(panels, axis_label(axis))
        keys = [
            Line2D([], [], color=GREY, marker=".", linestyle="none", alpha=0.7, label="case"),
            Line2D(
                [],
                [],
                color=BLUE,
                marker="o",
                markersize=3.5,
                label=f"mean, {100 * MEAN_CONFIDENCE:.0f} % interval",
            ),
        ]
        figure.legend(handles=keys, loc="outside lower center", ncols=2)
    return figure


def _scale(axes: Axes, axis: SweptAxis) -> None:
    if axis.names:
        places = np.arange(len(axis.names))
        axes.set_xticks(places, axis.names, rotation=30 if max(map(len, axis.names)) > 6 else 0)
        axes.set_xlim(-0.5, places[-1] + 0.5)
    elif axis.logarithmic:
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.set_xticks([], minor=True)


def _sheet(count: int, medium: Medium, *, shape: float, key: float) -> tuple[Figure, list[Axes]]:
    """So many equal panels, in rows."""
    across = min(ACROSS, count)
    down = -(-count // across)
    line, width = medium.line_height, medium.width(across)
    height = down * (width / across * shape + 1.0 * line) + (2.0 + key) * line
    figure = Figure(figsize=(width, height), layout="constrained")
    panels = list(figure.subplots(down, across, squeeze=False).flat)
    for spare in panels[count:]:
        spare.remove()
    return figure, panels[:count]


def _name_lowest(panels: Sequence[Axes], label: str) -> None:
    """The swept quantity under the lowest panel of each column."""
    for axes in panels[-min(ACROSS, len(panels)) :]:
        axes.set_xlabel(label)


# Over two quantities -------------------------------------------------------------------------------------------------


def over_two(
    table: "pandas.DataFrame", pair: tuple[SweptAxis, SweptAxis], outputs: Sequence[Output], medium: Medium
) -> Figure:
    """Means over two swept quantities as maps, a colour scale for each output; what has no value is hatched."""
    across, up = pair
    with medium.drawing():
        figure, panels = _sheet(len(outputs), medium, shape=1.15, key=1.0)
        for output, axes in zip(outputs, panels, strict=True):
            cells = pair_means(table[output.column].to_numpy(dtype=float) * output.scale, across, up)
            axes.patch.set(hatch="////", edgecolor="#9ca3af", facecolor="white")
            image = axes.imshow(cells, origin="lower", cmap="cividis", aspect="auto", interpolation="none")
            if max(cells.shape) <= MOST_WRITTEN:
                _write_cells(axes, cells, image.norm(cells))
            _tick(axes.xaxis, across)
            _tick(axes.yaxis, up)
            axes.spines[:].set_visible(False)
            axes.set_title(output.label, fontweight="normal", fontsize="small")
            figure.colorbar(image, ax=axes, location="bottom", aspect=18, pad=0.04)
        figure.supxlabel(axis_label(across), fontsize="medium")
        figure.supylabel(axis_label(up), fontsize="medium")
    return figure


def _write_cells(axes: Axes, cells: Field, shade: Any) -> None:
    spread = float(np.nanmax(cells) - np.nanmin(cells))
    decimals = max(0, 1 - int(np.floor(np.log10(spread)))) if spread > 0.0 else 0
    for (j, i), value in np.ndenumerate(cells):
        if np.isfinite(value):
            axes.text(
                i, j, f"{value:.{decimals}f}", ha="center", va="center", fontsize="x-small",
                color="black" if shade[j, i] > 0.5 else "white",
            )  # fmt: skip


def _tick(side: Any, axis: SweptAxis) -> None:
    """The values at cell centres, thinned out where they are many."""
    places = axis.places
    step = -(-places.size // 6)
    side.set_ticks(np.arange(places.size)[::step], [place_in_words(axis, value) for value in places[::step]])
