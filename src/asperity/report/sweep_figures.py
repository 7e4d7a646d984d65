"""The figures of any study: each output against each swept quantity, and maps over two of them.

Swept quantities are shown in the unit they were written in, outputs in display units.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator

from asperity.arrays import Field
from asperity.case import Case, split_amount
from asperity.errors import BadInput
from asperity.report.figures import BLUE, GREY
from asperity.report.study_figures import Medium, stay_near
from asperity.study import as_written

if TYPE_CHECKING:
    import pandas

    from asperity.study import StudyPlan


LEVEL = 0.90  # of the intervals
MOST_VALUES = 12  # of a swept quantity that has a mean each, however few cases share one
BINS = 8  # of one with more
MOST_DRAWN = 1500  # dots as drawings; more are a picture
MOST_WRITTEN = 8  # values a side of a map whose cells hold their number
ACROSS = 4
SAME = 1e-9  # relative difference that is rounding
CHOICES = ("law", "kind", "file")  # keys that say what a table is
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


def outputs_of(table: "pandas.DataFrame") -> list[Output]:
    """The outputs that a study's table holds and that vary in it; CRF and CRFA once where the presets have theirs."""
    shown = []
    for output in OUTPUTS:
        if output.column in ("crf_hz", "crfa") and "crf_sound_hz" in table:
            continue
        if output.column in table and _varies(table[output.column].to_numpy(dtype=float)):
            shown.append(output)
    return shown


def _varies(values: Field) -> bool:
    """Whether numbers differ by more than their last digits."""
    known = values[np.isfinite(values)]
    return known.size > 0 and float(np.ptp(known)) > SAME * float(np.abs(known).max())


@dataclass(frozen=True)
class Axis:
    """A swept quantity over the rows of a table: numbers, or the places of names."""

    key: str
    label: str
    values: Field  # (rows,)
    names: tuple[str, ...] = ()  # of the places, where it is no number
    logarithmic: bool = False

    @property
    def places(self) -> Field:
        """The different values, in order."""
        return np.unique(self.values)

    @property
    def binned(self) -> bool:
        """Whether means are those of groups of neighbours: of samples no two are alike."""
        return self.places.size > max(MOST_VALUES, 0.5 * self.values.size)

    def written(self, value: float) -> str:
        """A value as people read it."""
        return self.names[int(value)] if self.names else f"{value:.4g}".replace("-", "−")


def axis_of(plan: "StudyPlan", table: "pandas.DataFrame", key: str) -> Axis:
    """A swept key over the rows of a study's table, in the unit that its first value was written in."""
    own = _own_value(plan.case, key)
    written = [plan.cases[number].overrides.get(key, own) for number in table["number"]]
    short = key.rpartition(".")[2]
    name = NAMES.get(short, short.replace("_", " "))
    try:
        numbers, unit = _numbers(written)
    except BadInput:
        texts = [as_written(value) for value in written]
        shown = {text: _short(value) for text, value in zip(texts, written, strict=True)}
        if len(set(shown.values())) < len(shown):
            shown = {text: text for text in shown}
        order = list(shown)
        values = np.array([order.index(text) for text in texts], dtype=float)
        return Axis(key, name, values, tuple(shown.values()))
    label = f"{name} [{UNITS.get(unit, unit)}]" if unit else name
    return Axis(key, label, numbers, logarithmic=_crowds_low(np.unique(numbers)))


def _short(value: Any) -> str:
    """A table by what it chooses, a file by its name."""
    if isinstance(value, Mapping):
        value = next((value[key] for key in CHOICES if key in value), value)
    return as_written(value).rpartition("/")[2]


def _own_value(case: Case, key: str) -> Any:
    """What a case says of a key that a point leaves alone."""
    value: Any = tomllib.loads(case.text)
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return "not set" if value is None else value


def _numbers(written: Sequence[Any]) -> tuple[Field, str]:
    """Values in the first one's unit; BadInput where one is no number or an uneven pair."""
    single = []
    for value in written:
        entries = list(value) if isinstance(value, list | tuple) else [value]
        if any(entry != entries[0] for entry in entries):
            raise BadInput(f"{value} is no single number")
        single.append(entries[0])
    unit = split_amount(single[0])[1]
    return np.array([float(split_amount(value, unit)[0]) for value in single]), unit


def _crowds_low(places: Field) -> bool:
    """Whether most values stand near the lower end, as on a logarithmic scale."""
    low, high = float(places[0]), float(places[-1])
    return low > 0.0 and high >= 4.0 * low and float(np.median(places)) - low < 0.35 * (high - low)


# Against one quantity ------------------------------------------------------------------------------------------------


def against(table: "pandas.DataFrame", axis: Axis, outputs: Sequence[Output], medium: Medium) -> Figure:
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
            x, mean, low, high = means(axis.values[known], values[known], binned=axis.binned)
            joined = "none" if axis.names else "-"
            reach = np.array([mean - low, high - mean])
            axes.errorbar(
                x, mean, np.where(np.isfinite(reach), reach, 0.0), fmt="o", linestyle=joined, color=BLUE, capsize=2,
                markersize=3.5, elinewidth=0.9,
            )  # fmt: skip
            stay_near(axes, values[known])
            axes.set_title(output.label, fontweight="normal", fontsize="small")
            _scale(axes, axis)
        _name_lowest(panels, axis.label)
        keys = [
            Line2D([], [], color=GREY, marker=".", linestyle="none", alpha=0.7, label="case"),
            Line2D(
                [], [], color=BLUE, marker="o", markersize=3.5, label=f"mean, {LEVEL:.0%} interval".replace("%", " %")
            ),
        ]
        figure.legend(handles=keys, loc="outside lower center", ncols=2)
    return figure


def means(x: Field, values: Field, *, binned: bool) -> tuple[Field, Field, Field, Field]:
    """Means over cases with one x, or over near ones, and Student's interval of each mean: x, mean, low, high."""
    from scipy.stats import t

    group = np.unique(x, return_inverse=True)[1]
    if binned:
        group = np.searchsorted(np.quantile(x, np.linspace(0.0, 1.0, BINS + 1)[1:-1]), x, side="right")
    rows = []
    for number in np.unique(group):
        some = values[group == number]
        mean = float(some.mean())
        reach = np.nan
        if some.size > 1:
            reach = float(t.ppf(0.5 + LEVEL / 2.0, some.size - 1) * some.std(ddof=1) / np.sqrt(some.size))
        rows.append((float(x[group == number].mean()), mean, mean - reach, mean + reach))
    columns = np.array(rows).reshape(-1, 4).T
    return columns[0], columns[1], columns[2], columns[3]


def _scale(axes: Axes, axis: Axis) -> None:
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


def over_two(table: "pandas.DataFrame", pair: tuple[Axis, Axis], outputs: Sequence[Output], medium: Medium) -> Figure:
    """Means over two swept quantities as maps, a colour scale for each output; what has no value is hatched."""
    across, up = pair
    columns, rows = across.places, up.places
    with medium.drawing():
        figure, panels = _sheet(len(outputs), medium, shape=1.15, key=1.0)
        for output, axes in zip(outputs, panels, strict=True):
            cells = np.full((rows.size, columns.size), np.nan)
            values = table[output.column].to_numpy(dtype=float) * output.scale
            for j, row in enumerate(rows):
                for i, column in enumerate(columns):
                    here = values[(across.values == column) & (up.values == row) & np.isfinite(values)]
                    if here.size:
                        cells[j, i] = here.mean()
            axes.patch.set(hatch="////", edgecolor="#9ca3af", facecolor="white")
            image = axes.imshow(cells, origin="lower", cmap="cividis", aspect="auto", interpolation="none")
            if max(rows.size, columns.size) <= MOST_WRITTEN:
                _write_cells(axes, cells, image.norm(cells))
            _tick(axes.xaxis, across)
            _tick(axes.yaxis, up)
            axes.spines[:].set_visible(False)
            axes.set_title(output.label, fontweight="normal", fontsize="small")
            figure.colorbar(image, ax=axes, location="bottom", aspect=18, pad=0.04)
        figure.supxlabel(across.label, fontsize="medium")
        figure.supylabel(up.label, fontsize="medium")
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


def _tick(side: Any, axis: Axis) -> None:
    """The values at cell centres, thinned out where they are many."""
    places = axis.places
    step = -(-places.size // 6)
    side.set_ticks(np.arange(places.size)[::step], [axis.written(value) for value in places[::step]])
