"""Exhibit of a roller along its length: load, pressure and film."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes
from asperity.report.style import BLUE, GREEN, GREY, VERMILION, Medium
from asperity.results import UNDETERMINED, Run
from asperity.solution import AxialDistribution, EndValue


def end_value_text(key: str, end: EndValue | None) -> str:
    """Return a value at a roller's ends with its error bar, or why there is none."""
    if end is None:
        return "outside the grid"
    return UNDETERMINED if end.value is None else quantity(key).text(end.value, end.bar)


def along_length(run: Run, along: AxialDistribution) -> Exhibit:
    """Draw line load, maximum pressure and minimum gap along a roller."""
    hertz = run.solution.conditions.hertz.p_max
    lubricated = run.solution.lubricant is not None

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 4.6), layout="constrained")
        load, pressure, gap = figure.subplots(3, 1, sharex=True)
        load.set_title("Along the roller")
        _draw_line_load(load, along)
        _draw_pressure(pressure, along, hertz, spike=lubricated)
        _draw_gap(gap, along)
        keys = [
            key for axes in (load, pressure, gap) for key in axes.get_legend_handles_labels()[0]
        ]
        legend_below(figure, 2, handles=keys)
        return figure

    edge = end_value_text("edge_pressure_pa", along.edge_pressure)
    film = (
        f"; film at the ends {end_value_text('end_film_m', along.end_film)}" if lubricated else ""
    )
    spike_note = (
        "Edge pressures exclude the outlet spike, which grows with grid refinement. "
        if lubricated
        else ""
    )
    loaded = quantity("loaded_share").text(along.loaded_share)
    return Exhibit(
        "along",
        draw,
        "Line load, maximum pressure and minimum gap of each line of cells along rolling. Edge "
        f"pressure {edge}{film}; {loaded} of the length carry load. {spike_note}Both bodies are "
        "half-spaces; the free end face of a real roller, which is softer, is not modelled.",
        "Curves along the roller: line load and pressure, with those of a uniform load dashed, and "
        f"below them the minimum gap. Edge pressure {edge}.",
    )


def _draw_line_load(axes: Axes, along: AxialDistribution) -> None:
    y = display("y_m", along.y)
    load = display("line_load_n_per_m", along.line_load)
    axes.plot(y, load, color=VERMILION, label="line load")
    mean = display("line_load_n_per_m", along.load / along.length)
    axes.axhline(mean, color="black", linestyle="--")
    axes.set(ylabel=quantity("line_load_n_per_m").label, ylim=(0.0, None))


def _draw_pressure(axes: Axes, along: AxialDistribution, hertz: float, *, spike: bool) -> None:
    y, pressure, dome = (
        display(key, values)
        for key, values in (
            ("y_m", along.y),
            ("pressure", along.pressure),
            ("pressure", along.dome),
        )
    )
    axes.plot(y, pressure, color=BLUE, label="maximum pressure")
    if spike:
        axes.plot(y, dome, color=GREY, linestyle=":", label="before the spike")
    uniform = display("pressure", hertz)
    axes.axhline(uniform, color="black", linestyle="--", label="Hertz, uniform load")
    axes.set(ylabel=quantity("pressure").label, ylim=(0.0, None))


def _draw_gap(axes: Axes, along: AxialDistribution) -> None:
    gap = display("gap", along.gap)
    axes.plot(display("y_m", along.y), gap, color=GREEN, linestyle="-.", label="minimum gap")
    top = 1.6 * float(gap[gap.size // 2]) or 1.0
    name_axes(axes, "y_m", ylabel=quantity("gap").label, ylim=(0.0, top))
