"""The figure of friction curves: Stribeck's over speed, the traction curve over the slide-to-roll ratio.

Display units begin here and end here.
"""

from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from asperity.report.figures import BLUE, GREEN, GREY, MICRO, STYLE, VERMILION
from asperity.results import FrictionCurve

STROKES = ((BLUE, "-", "o"), (VERMILION, "--", "s"), (GREEN, "-.", "^"), (GREY, ":", "D"))


def friction_figure(curves: Sequence[FrictionCurve]) -> Figure:
    """Friction and temperature over speed or slip, for curves of one kind; of a single curve its parts too."""
    stribeck = curves[0].kind == "stribeck"
    label = "entrainment speed [m/s]" if stribeck else "slide-to-roll ratio [%]"
    title = "Stribeck curve" if stribeck else "Traction curve"
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2)
        single = len(curves) == 1
        for number, curve in enumerate(curves):
            x = [p.entrainment_speed_m_s if stribeck else 100.0 * p.slide_to_roll for p in curve.points]
            colour, stroke, marker = STROKES[number % len(STROKES)]
            name = "coefficient" if single else _name(curve)
            _draw(left, curve, x, "friction_coefficient", name, colour, stroke, marker)
            if single:
                _draw(left, curve, x, "asperity_part", "asperities", VERMILION, "--", "s")
                _draw(left, curve, x, "oil_part", "oil", GREEN, "-.", "^")
            _draw(
                right, curve, x, "flash_temperature_max_k", "hotter surface" if single else name, colour, stroke, marker
            )
            if single:
                _draw(right, curve, x, "film_temperature_max_k", "film", GREEN, "-.", "^")
        limits = {curve.boundary_friction for curve in curves}
        for limit in limits:
            left.axhline(limit, color="black", linewidth=0.8, linestyle=(0, (1, 2)))
            left.annotate(
                f"boundary friction {limit:g}", (0.99, limit), xycoords=("axes fraction", "data"),
                xytext=(0, 3), textcoords="offset points", ha="right", fontsize=8.5,
            )  # fmt: skip
        left.set(xlabel=label, ylabel="friction coefficient", title=f"{title}: friction{_what(curves)}")
        right.set(
            xlabel=label,
            ylabel="largest rise [K]" if single else "largest rise of a surface [K]",
            title=f"{title}: temperature{_what(curves)}",
        )
        for axes in (left, right):
            if stribeck:
                axes.set_xscale("log")
                axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axes.set_ylim(0.0, None)
        left.set_ylim(0.0, max(1.12 * max(limits), left.get_ylim()[1]))
        unfinished = any(not point.converged for curve in curves for point in curve.points)
        handles, labels = left.get_legend_handles_labels()
        left.legend(handles, labels, title="crosses: not converged" if unfinished else None, loc="best")
        right.legend(loc="best")
    return figure


def _what(curves: Sequence[FrictionCurve]) -> str:
    return f", {_name(curves[0])}" if len(curves) == 1 else ""


def _name(curve: FrictionCurve) -> str:
    return f"Sq {curve.sq * MICRO:.3g} µm" + (", heat fed back" if curve.feedback else "")


def _draw(
    axes: Axes, curve: FrictionCurve, x: list[float], quantity: str, name: str, colour: str, stroke: str, marker: str
) -> None:
    y = np.array([getattr(point, quantity) for point in curve.points])
    converged = np.array([point.converged for point in curve.points])
    at = np.array(x)
    axes.plot(at, np.where(converged, y, np.nan), stroke, marker=marker, markersize=4, color=colour, label=name)
    if not converged.all():
        axes.plot(at[~converged], y[~converged], "x", color=colour)
