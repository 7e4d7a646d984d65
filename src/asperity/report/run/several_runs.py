"""Exhibits of several runs: shares, resonance and friction against their roughness."""

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.axes import Axes

from asperity.core.quantities import quantity
from asperity.report.base import Exhibit, capitalised
from asperity.report.drawing import display, name_axes, one_panel
from asperity.report.style import BLUE, VERMILION

Points = Sequence[Mapping[str, Any]]  # the scalars of each run


def shares_against_roughness(points: Points) -> Exhibit:
    """CLR and CAR against Sq."""

    @one_panel(3.3, key=1)
    def draw(axes: Axes) -> None:
        _draw(axes, points, "clr", "-o", VERMILION)
        _draw(axes, points, "car", "--s", BLUE)
        name_axes(
            axes, "sq_m", "share", title="Load and area share of asperities", ylim=(0.0, 100.0)
        )

    return Exhibit(
        "shares-against-roughness",
        draw,
        "Share of the load (CLR) and of the Hertz zone (CAR) that asperities take, one surface each."
        + _unfinished(points),
        _values(points, "clr", "car"),
    )


def resonance_against_roughness(points: Points, full_load_crf_hz: float | None) -> Exhibit:
    """CRF against Sq, with its whole 90 % interval."""
    line = quantity("crf_hz")

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        _draw(axes, points, "crf_hz", "-o", VERMILION, f"{line.short}, 90 % interval")
        for point in points:
            crf, low, high = (point[key] for key in ("crf_hz", "crf_low_hz", "crf_high_hz"))
            if crf is not None and low is not None and high is not None:
                place, reach = (
                    display("sq_m", point["sq_m"]),
                    [[max(crf - low, 0.0)], [max(high - crf, 0.0)]],
                )
                axes.errorbar(
                    place, crf, reach, color=VERMILION, capsize=5, linewidth=1.0, zorder=1
                )
        if full_load_crf_hz is not None:
            label = "asperities carry all the load"
            axes.axhline(full_load_crf_hz, color="black", linestyle=":", linewidth=1.0, label=label)
        axes.set(ylabel=line.label, title=capitalised(line.name))

    return Exhibit(
        "resonance-against-roughness",
        draw,
        "Contact resonance frequency with its whole 90 % interval: record, cells and, of several, surfaces."
        + _unfinished(points),
        _values(points, "crf_hz"),
    )


def friction_against_roughness(points: Points) -> Exhibit:
    """Friction coefficient against Sq: asperities' and oil's parts."""

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        _draw(axes, points, "friction_coefficient", "-o", "black")
        _draw(axes, points, "friction_asperity_part", "--s", VERMILION)
        _draw(axes, points, "friction_oil_part", ":^", BLUE)
        axes.set(ylabel=quantity("friction_coefficient").label, title="Friction", ylim=(0.0, None))

    return Exhibit(
        "friction-against-roughness",
        draw,
        "Friction coefficient, and what asperities and oil contribute to it.",
        _values(points, "friction_coefficient"),
    )


def _draw(axes: Axes, points: Points, key: str, stroke: str, colour: str, label: str = "") -> None:
    """One curve of a scalar against Sq; hollow markers where the solve did not converge."""
    known = sorted(
        (point for point in points if point[key] is not None),
        key=lambda point: float(point["sq_m"]),
    )
    sq, values = ([display(name, point[name]) for point in known] for name in ("sq_m", key))
    axes.plot(sq, values, stroke, color=colour, markersize=6, label=label or quantity(key).title)
    doubtful = [i for i, point in enumerate(known) if not point["converged"]]
    axes.plot(
        sq,
        values,
        stroke[-1],
        color=colour,
        markerfacecolor="white",
        markersize=6,
        markevery=doubtful,
    )
    every = [display("sq_m", point["sq_m"]) for point in points]
    margin = max(0.06 * (max(every) - min(every)), 0.1 * max(every)) or 0.5
    name_axes(axes, "sq_m", xlim=(min(every) - margin, max(every) + margin))


def _unfinished(points: Points) -> str:
    converged = all(point["converged"] for point in points)
    return "" if converged else " Hollow markers are runs that did not converge."


def _values(points: Points, *keys: str) -> str:
    """The points of the curves in words."""
    texts = (
        f"at {quantity('sq_m').text(point['sq_m'])} {' and '.join(quantity(key).named(point[key]) for key in keys)}"
        for point in points
    )
    return f"{' and '.join(quantity(key).name for key in keys)} against Sq: {'; '.join(texts)}."
