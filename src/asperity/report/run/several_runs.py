"""Exhibits of several runs: load and area shares, resonance and friction over roughness."""

from collections.abc import Sequence

from matplotlib.axes import Axes

from asperity.core.coverage import PERCENT
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit, Numbers, capitalised
from asperity.report.drawing import display, name_axes, one_panel
from asperity.report.style import BLUE, VERMILION

Points = Sequence[Numbers]  # the scalars of each run


def shares_against_roughness(points: Points) -> Exhibit:
    """Draw CLR and CAR over Sq."""

    @one_panel(3.3, legend_columns=1)
    def draw(axes: Axes) -> None:
        _draw(axes, points, "clr", "-o", VERMILION)
        _draw(axes, points, "car", "--s", BLUE)
        name_axes(axes, "sq_m", "share", title="Asperity load and area share", ylim=(0.0, 100.0))

    return Exhibit(
        "shares-against-roughness",
        draw,
        "Asperity load share (CLR) and contact area ratio of the Hertz zone (CAR), one surface "
        "each." + _unconverged_note(points),
        _values_text(points, "clr", "car"),
    )


def resonance_against_roughness(points: Points, full_load_crf_hz: float | None) -> Exhibit:
    """Draw CRF over Sq with its total interval."""
    line = quantity("crf_hz")

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        _draw(axes, points, "crf_hz", "-o", VERMILION, f"{line.short}, {PERCENT} interval")
        _draw_intervals(axes, points, "crf_hz", VERMILION)
        if full_load_crf_hz is not None:
            label = "CRF at full load"
            axes.axhline(full_load_crf_hz, color="black", linestyle=":", linewidth=1.0, label=label)
        axes.set(ylabel=line.label, title=capitalised(line.name))

    return Exhibit(
        "resonance-against-roughness",
        draw,
        f"Contact resonance frequency with its total {PERCENT} interval, from the record, the grid "
        "and, if several were solved, the surfaces." + _unconverged_note(points),
        _values_text(points, "crf_hz"),
    )


def friction_against_roughness(points: Points) -> Exhibit:
    """Draw the friction coefficient over Sq with the parts of asperities and oil."""

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        _draw(axes, points, "friction_coefficient", "-o", "black")
        _draw_intervals(axes, points, "friction_coefficient", "black")
        _draw(axes, points, "friction_asperity_part", "--s", VERMILION)
        _draw(axes, points, "friction_oil_part", ":^", BLUE)
        axes.set(ylabel=quantity("friction_coefficient").label, title="Friction", ylim=(0.0, None))

    return Exhibit(
        "friction-against-roughness",
        draw,
        f"Friction coefficient with its {PERCENT} interval, and the parts of asperities and oil.",
        _values_text(points, "friction_coefficient"),
    )


def _draw(axes: Axes, points: Points, key: str, style: str, colour: str, label: str = "") -> None:
    """Draw a scalar over Sq, with hollow markers for runs that did not converge."""
    determined = sorted(
        (point for point in points if point[key] is not None),
        key=lambda point: float(point["sq_m"]),
    )
    sq, values = ([display(name, point[name]) for point in determined] for name in ("sq_m", key))
    axes.plot(sq, values, style, color=colour, markersize=6, label=label or quantity(key).title)
    unconverged = [i for i, point in enumerate(determined) if not point["converged"]]
    axes.plot(
        sq,
        values,
        style[-1],
        color=colour,
        markerfacecolor="white",
        markersize=6,
        markevery=unconverged,
    )
    all_sq = [display("sq_m", point["sq_m"]) for point in points]
    margin = max(0.06 * (max(all_sq) - min(all_sq)), 0.1 * max(all_sq)) or 0.5
    name_axes(axes, "sq_m", xlim=(min(all_sq) - margin, max(all_sq) + margin))


def _draw_intervals(axes: Axes, points: Points, key: str, colour: str) -> None:
    """Draw the intervals of a scalar over Sq."""
    for point in points:
        value, low, high = (point[name] for name in (key, *quantity(key).ends))
        if value is not None and low is not None and high is not None:
            sq = display("sq_m", point["sq_m"])
            bars = [[max(value - low, 0.0)], [max(high - value, 0.0)]]
            axes.errorbar(sq, value, bars, color=colour, capsize=5, linewidth=1.0, zorder=1)


def _unconverged_note(points: Points) -> str:
    converged = all(point["converged"] for point in points)
    return "" if converged else " Hollow markers are runs that did not converge."


def _values_text(points: Points, *keys: str) -> str:
    """Return the values at each Sq as text."""
    texts = (
        f"at {quantity('sq_m').text(point['sq_m'])} "
        f"{' and '.join(quantity(key).named(point[key]) for key in keys)}"
        for point in points
    )
    return f"{' and '.join(quantity(key).name for key in keys)} over Sq: {'; '.join(texts)}."
