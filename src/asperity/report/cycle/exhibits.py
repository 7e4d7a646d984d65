"""Exhibits of a cycle: conditions, films, load share and friction over time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.coverage import PERCENT
from asperity.core.quantities import quantity
from asperity.report.base import Exhibit
from asperity.report.drawing import display, name_axes, plain_log_labels
from asperity.report.style import BLUE, GREY, VERMILION, Medium
from asperity.simulation import CycleResult

TIME = "cycle_time_s"
LABELS = {"flash_temperature_max_k": "flash [K]"}  # shorter than their quantity's
OF_INSTANTS = ("clr", "friction_coefficient", "flash_temperature_max_k")


def over_cycle(result: CycleResult) -> Exhibit:
    """Draw load, speeds, films and, of rough bodies, load share and friction over a cycle."""
    drawn = [key for key in OF_INSTANTS if _has(result, key)]

    def draw(medium: Medium) -> Figure:
        count = 3 + len(drawn)
        figure = Figure(figsize=(medium.double, 1.45 * count + 0.5), layout="constrained")
        panels = figure.subplots(count, 1, sharex=True)
        _conditions(panels[0], panels[1], result)
        _films(panels[2], result)
        for key, axes in zip(drawn, panels[3:], strict=True):
            _of_instants(axes, result, key)
        panels[0].set_xlim(0.0, float(display(TIME, np.array([result.cycle.period]))[0]))
        name_axes(panels[-1], TIME)
        return figure

    bars = f" Bars: {PERCENT} intervals." if drawn else ""
    return Exhibit(
        "cycle",
        draw,
        "Contact over a cycle. Lines of the film: smooth bodies in time, with squeeze; circles: "
        f"the steady film if the instant lasted.{bars}",
        "Load, speeds, films, load share and friction over a cycle",
    )


def _has(result: CycleResult, key: str) -> bool:
    return any(np.isfinite(instant.numbers.get(key, np.nan)) for instant in result.solved)


def _conditions(of_load: Axes, of_speeds: Axes, result: CycleResult) -> None:
    """Draw the load, and the speeds of entrainment and sliding."""
    shown = display(TIME, result.film.times)
    states = [result.cycle.state(float(moment)) for moment in result.film.times]
    loads = np.array([state.load for state in states])
    of_load.plot(shown, display("load_n", loads), color=BLUE)
    of_load.set_ylabel(quantity("load_n").label)
    for key, colour, style in (
        ("entrainment_speed_m_s", BLUE, "-"),
        ("sliding_speed_m_s", VERMILION, "--"),
    ):
        values = np.array([getattr(state, key.removesuffix("_m_s")) for state in states])
        of_speeds.plot(
            shown,
            display(key, values),
            style,
            color=colour,
            label=quantity(key).name,
        )
    of_speeds.set_ylabel("speed [m/s]")
    of_speeds.axhline(0.0, color=GREY, linewidth=0.6)
    low, high = of_speeds.get_ylim()
    of_speeds.set_ylim(low, high + 0.35 * (high - low))  # room for the legend
    of_speeds.legend(ncols=2, loc="upper left")


def _films(axes: Axes, result: CycleResult) -> None:
    """Draw both films in time, and the steady ones as circles."""
    shown, moments = display(TIME, result.film.times), display(TIME, result.steady_times)
    for index, (key, values, colour) in enumerate(
        (
            ("h_central_m", result.film.h_central, BLUE),
            ("h_min_m", result.film.h_min, VERMILION),
        )
    ):
        axes.semilogy(
            shown,
            display(key, values),
            color=colour,
            label=quantity(key).name,
        )
        steady = np.array([films[index] for films in result.steady])
        axes.plot(
            moments,
            display(key, steady),
            "o",
            color=colour,
            fillstyle="none",
            markersize=4,
        )
    axes.set_ylabel(quantity("film_thickness_m").label)
    plain_log_labels(axes)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * (high / low) ** 0.35)  # room for the legend
    axes.legend(ncols=2, loc="upper left")


def _of_instants(axes: Axes, result: CycleResult, key: str) -> None:
    """Draw a number of the rough contact with its intervals."""
    known = [instant for instant in result.solved if np.isfinite(instant.numbers.get(key, np.nan))]
    moments = display(TIME, np.array([instant.time for instant in known]))
    values = np.array([instant.numbers[key] for instant in known])
    axes.plot(
        moments,
        display(key, values),
        "-s",
        color=BLUE,
        markersize=3.5,
        linewidth=0.8,
    )
    for instant, moment in zip(known, moments, strict=True):
        low, high = instant.interval(key)
        if low is None or high is None:
            continue
        ends = display(key, np.array([low, high]))
        axes.plot([moment, moment], ends, color=BLUE)
    axes.set_ylabel(LABELS.get(key, quantity(key).label))
    axes.set_ylim(bottom=0.0)


def cycle_exhibits(result: CycleResult) -> list[Exhibit]:
    """Return the exhibits of a cycle's report."""
    return [over_cycle(result)]
