"""A roller along its length: load, pressure and film from end to end."""

from matplotlib.figure import Figure

from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes
from asperity.report.style import BLUE, GREEN, GREY, VERMILION, Medium
from asperity.results import UNDETERMINED, Run
from asperity.solution import AxialDistribution, EndValue


def doubted(key: str, figure: EndValue | None) -> str:
    """A figure of a roller's ends with its error bar, or that it is not determined."""
    if figure is None:
        return "beyond the grid"
    return UNDETERMINED if figure.value is None else quantity(key).text(figure.value, figure.bar)


def along_length(run: Run, along: AxialDistribution) -> Exhibit:
    """Load per length and largest pressure, beside Hertz's of an even load, and the smallest gap of each line."""
    hertz = run.solution.conditions.hertz.p_max
    places, oiled = display("y_m", along.y), run.solution.lubricant is not None

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 4.6), layout="constrained")
        load, pressure, gap = figure.subplots(3, 1, sharex=True)
        load.set_title("Along the roller")
        load.plot(
            places,
            display("line_load_n_per_m", along.line_load),
            color=VERMILION,
            label="load per length",
        )
        load.axhline(
            display("line_load_n_per_m", along.load / along.length), color="black", linestyle="--"
        )
        load.set(ylabel=quantity("line_load_n_per_m").label, ylim=(0.0, None))
        pressure.plot(
            places, display("pressure", along.pressure), color=BLUE, label="largest pressure"
        )
        if oiled:
            pressure.plot(
                places,
                display("pressure", along.dome),
                color=GREY,
                linestyle=":",
                label="before the spike",
            )
        pressure.axhline(
            display("pressure", hertz),
            color="black",
            linestyle="--",
            label="of an even load (Hertz)",
        )
        pressure.set(ylabel=quantity("pressure").label, ylim=(0.0, None))
        thin = display("gap", along.gap)
        gap.plot(places, thin, color=GREEN, linestyle="-.", label="smallest gap")
        name_axes(
            gap,
            "y_m",
            ylabel=quantity("gap").label,
            ylim=(0.0, 1.6 * float(thin[thin.size // 2]) or 1.0),
        )
        keys = [
            key for axes in (load, pressure, gap) for key in axes.get_legend_handles_labels()[0]
        ]
        legend_below(figure, 2, handles=keys)
        return figure

    edge = doubted("edge_pressure_pa", along.edge_pressure)
    film = f"; film at the ends {doubted('end_film_m', along.end_film)}" if oiled else ""
    spike = (
        "Pressures at the ends are those before the oil's spike, which grows with the cells. "
        if oiled
        else ""
    )
    loaded = quantity("loaded_share").text(along.loaded_share)
    return Exhibit(
        "along",
        draw,
        "Load per length, largest pressure and smallest gap of every line of cells along rolling. Edge pressure "
        f"{edge}{film}; {loaded} of the length carry load. {spike}Both bodies are half-spaces: that a real roller "
        "ends in a free surface, softer than they are, is not modelled. The gap's axis ends above the middle's.",
        "Curves along the roller's length: load per length and pressure, with those of an even load dashed, and below "
        f"them the smallest gap. Edge pressure {edge}.",
    )
