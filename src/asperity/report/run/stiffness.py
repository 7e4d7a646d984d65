"""Stiffness and damping of a run's contact over frequency."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes
from asperity.report.style import BLUE, GREY, VERMILION, Medium
from asperity.results import DynamicCurve, Run


def stiffness_over_frequency(run: Run) -> Exhibit:
    """K and c of the solved contact over frequency, in both limits of its yielded cells, its resonance marked.

    Raises
    ------
    BadInput
        for a run that was not asked for it.
    """
    curve, own = run.dynamic_curve, run.own_resonance
    if curve is None:
        raise BadInput(
            "there is no stiffness over frequency to draw; set solver.dynamic of the case"
        )

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 1.05 * medium.single), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        _draw(above, curve, "dynamic_stiffness")
        _draw(below, curve, "dynamic_damping")
        below.axhline(0.0, color="black", linewidth=0.6)
        above.axhline(
            display("dynamic_stiffness", curve.elastic.slow),
            color=BLUE,
            linestyle=":",
            linewidth=0.9,
            label="so slow that the film follows",
        )
        if own is not None:
            style = {"marker": "D", "color": VERMILION, "linestyle": "none", "markersize": 5}
            for axes, key, value in (
                (above, "dynamic_stiffness", own.elastic.stiffness),
                (below, "dynamic_damping", own.elastic.damping),
            ):
                axes.plot(
                    own.elastic.frequency_hz,
                    display(key, value),
                    label="where the mass resonates",
                    **style,
                )
        above.set_title("Stiffness and damping of the solved contact")
        name_axes(below, "dynamic_frequency")
        below.set_xscale("log")
        below.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        handles, labels = above.get_legend_handles_labels()
        legend_below(figure, 2, handles=handles, labels=labels)
        return figure

    said = ""
    if own is not None:
        parts = (
            quantity(key).named(getattr(own.elastic, name))
            for key, name in (
                ("contact_stiffness_n_m", "stiffness"),
                ("contact_damping_ratio", "damping_ratio"),
            )
        )
        said = f" At {quantity('contact_resonance_hz').text(own.elastic.frequency_hz)}: {', '.join(parts)}."
    return Exhibit(
        "stiffness-over-frequency",
        draw,
        "Force over approach of the contact when it is shaken a little, k + iωc, of the first surface. Elastic: what "
        "yielded once stays flat, as on tracks that come round again; flowing: virgin roughness. Below zero the "
        f"entraining motion feeds the oscillation.{said}",
        f"Dynamic stiffness and damping of the contact over frequency.{said}",
    )


def _draw(axes: Axes, curve: DynamicCurve, key: str) -> None:
    name = key.removeprefix("dynamic_")
    for branch, label, colour, stroke in (
        (curve.elastic, "yielded cells elastic", BLUE, "-o"),
        (curve.virgin, "yielded cells flowing", GREY, "--s"),
    ):
        axes.plot(
            curve.frequency_hz,
            display(key, getattr(branch, name)),
            stroke,
            color=colour,
            markersize=3,
            label=label,
        )
    axes.set_ylabel(quantity(key).axis)
