"""Exhibit of the contact's stiffness and damping over frequency."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, legend_below, name_axes
from asperity.report.style import BLUE, GREY, VERMILION, Medium
from asperity.results import DynamicCurve, Run
from asperity.solution import DynamicStiffness


def stiffness_over_frequency(run: Run) -> Exhibit:
    """Draw stiffness and damping over frequency for elastic and flowing yielded cells.

    Raises
    ------
    BadInput
        for a run without a dynamic curve.
    """
    curve = run.dynamic_curve
    resonance = run.own_resonance
    if curve is None:
        raise BadInput(
            "the run has no stiffness over frequency; set solver.dynamic in the case and solve "
            "again"
        )

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(medium.single, 1.05 * medium.single), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True)
        _draw(upper, curve, "dynamic_stiffness")
        _draw(lower, curve, "dynamic_damping")
        lower.axhline(0.0, color="black", linewidth=0.6)
        upper.axhline(
            display("dynamic_stiffness", curve.elastic.slow),
            color=BLUE,
            linestyle=":",
            linewidth=0.9,
            label="quasi-static limit",
        )
        if resonance is not None:
            _mark_resonance(upper, resonance.elastic, "dynamic_stiffness")
            _mark_resonance(lower, resonance.elastic, "dynamic_damping")
        upper.set_title("Stiffness and damping of the solved contact")
        name_axes(lower, "dynamic_frequency")
        lower.set_xscale("log")
        lower.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        handles, labels = upper.get_legend_handles_labels()
        legend_below(figure, 2, handles=handles, labels=labels)
        return figure

    at_resonance = ""
    if resonance is not None:
        parts = (
            quantity(key).named(getattr(resonance.elastic, name))
            for key, name in (
                ("contact_stiffness_n_m", "stiffness"),
                ("contact_damping_ratio", "damping_ratio"),
            )
        )
        frequency = quantity("contact_resonance_hz").text(resonance.elastic.frequency_hz)
        at_resonance = f" At {frequency}: {', '.join(parts)}."
    return Exhibit(
        "stiffness-over-frequency",
        draw,
        "Dynamic stiffness k + iωc of the contact, the ratio of force to approach for small "
        "oscillations, of the first surface. Yielded cells elastic: surfaces that have run in; "
        "flowing: virgin roughness. Negative damping: entrainment feeds the "
        f"oscillation.{at_resonance}",
        f"Dynamic stiffness and damping of the contact over frequency.{at_resonance}",
    )


def _draw(axes: Axes, curve: DynamicCurve, key: str) -> None:
    name = key.removeprefix("dynamic_")
    for branch, label, colour, line_style in (
        (curve.elastic, "yielded cells elastic", BLUE, "-o"),
        (curve.virgin, "yielded cells flowing", GREY, "--s"),
    ):
        axes.plot(
            curve.frequency_hz,
            display(key, getattr(branch, name)),
            line_style,
            color=colour,
            markersize=3,
            label=label,
        )
    axes.set_ylabel(quantity(key).axis)


def _mark_resonance(axes: Axes, resonance: DynamicStiffness, key: str) -> None:
    axes.plot(
        resonance.frequency_hz,
        display(key, getattr(resonance, key.removeprefix("dynamic_"))),
        marker="D",
        color=VERMILION,
        linestyle="none",
        markersize=5,
        label="resonance of the mass",
    )
