"""Figures of friction curves: Stribeck curve over speed, traction curve over slide-to-roll."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT
from asperity.core.quantities import quantity
from asperity.report.drawing import display, name_axes
from asperity.report.style import BLUE, GREEN, GREY, ON_PAGE, VERMILION
from asperity.results import FrictionCurve, FrictionPoint

STYLES = ((BLUE, "-", "o"), (VERMILION, "--", "s"), (GREEN, "-.", "^"), (GREY, ":", "D"))
ABSCISSA = {"stribeck": "entrainment_speed_m_s", "traction": "slide_to_roll"}
PARTS = {  # components drawn for a single curve: quantity, label, line style
    "friction_coefficient": (
        ("asperity_part", "asperities", STYLES[1]),
        ("oil_part", "oil", STYLES[2]),
    ),
    "flash_temperature_max_k": (("film_temperature_max_k", "film", STYLES[2]),),
}


@ON_PAGE.drawing()
def friction_figure(curves: Sequence[FrictionCurve]) -> Figure:
    """Draw friction and temperature over speed or slip for curves of one kind.

    A single curve is drawn with its components.
    """
    kind = f"{curves[0].kind.capitalize()} curve"
    surface = f", {_name(curves[0])}" if len(curves) == 1 else ""
    figure = Figure(figsize=(ON_PAGE.double, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_panel(left, curves, "friction_coefficient", "coefficient")
    _draw_panel(right, curves, "flash_temperature_max_k", "hotter surface")
    limits = {curve.boundary_friction for curve in curves}
    for limit in limits:
        left.axhline(limit, color="black", linewidth=0.8, linestyle=(0, (1, 2)))
        left.annotate(
            f"boundary friction {limit:g}",
            (0.99, limit),
            xycoords=("axes fraction", "data"),
            xytext=(0, 3),
            textcoords="offset points",
            ha="right",
            fontsize=8.5,
        )
    left.set(ylabel=quantity("friction_coefficient").axis, title=f"{kind}: friction{surface}")
    right.set(ylabel=quantity("temperature_rise_k").axis, title=f"{kind}: temperature{surface}")
    left.set_ylim(0.0, max(1.12 * max(limits), left.get_ylim()[1]))
    unfinished = any(not point.converged for curve in curves for point in curve.points)
    left.legend(title="crosses: not converged" if unfinished else None, loc="best")
    right.legend(loc="best")
    return figure


def _draw_panel(axes: Axes, curves: Sequence[FrictionCurve], key: str, name: str) -> None:
    """Draw a quantity of every curve, and its components for a single curve."""
    single = len(curves) == 1
    for number, curve in enumerate(curves):
        _draw(axes, curve, key, name if single else _name(curve), *STYLES[number % len(STYLES)])
        _shade_interval(axes, curve, key, STYLES[number % len(STYLES)][0])
        for part, label, line_style in PARTS[key] if single else ():
            _draw(axes, curve, part, label, *line_style)
    abscissa = ABSCISSA[curves[0].kind]
    if abscissa == "entrainment_speed_m_s":
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(FuncFormatter(_two_or_five))
    name_axes(axes, abscissa)
    axes.set_ylim(0.0, None)


def _shade_interval(axes: Axes, curve: FrictionCurve, key: str, colour: str) -> None:
    """Shade the interval of a quantity that has one."""
    points = [point for point in curve.points if point.converged]
    ends = [[getattr(point, end, None) for point in points] for end in quantity(key).ends]
    if all(value is not None for end in ends for value in end):
        x = display(ABSCISSA[curve.kind], _column(points, ABSCISSA[curve.kind]))
        low, high = (np.array(end, float) for end in ends)
        label = f"{PERCENT} interval" if colour == STYLES[0][0] else None
        axes.fill_between(x, low, high, color=colour, alpha=0.15, linewidth=0.0, label=label)


def _two_or_five(value: float, _: object) -> str:
    """Label a minor tick of a logarithmic axis, if it is 2 or 5 times a power of ten."""
    text = f"{value:g}"
    return text if text.strip("0.").split("e")[0] in ("2", "5") else ""


def _column(points: Sequence[FrictionPoint], name: str) -> Field:
    return np.array([getattr(point, name) for point in points], float)


def _name(curve: FrictionCurve) -> str:
    return quantity("sq_m").named(curve.sq) + (", thermal feedback" if curve.feedback else "")


def _draw(
    axes: Axes, curve: FrictionCurve, name: str, label: str, colour: str, style: str, marker: str
) -> None:
    abscissa = ABSCISSA[curve.kind]
    x = display(abscissa, _column(curve.points, abscissa))
    y = _column(curve.points, name)
    converged = np.array([point.converged for point in curve.points])
    axes.plot(
        x,
        np.where(converged, y, np.nan),
        style,
        marker=marker,
        markersize=4,
        color=colour,
        label=label,
    )
    if not converged.all():
        axes.plot(x[~converged], y[~converged], "x", color=colour)
