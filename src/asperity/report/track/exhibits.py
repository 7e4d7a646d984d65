"""Exhibits of a tracked series over x: trend, amplitude, damping, levels and load share."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR, PERCENT
from asperity.core.errors import BadInput
from asperity.core.quantities import column_label, in_print, quantity
from asperity.monitoring import BASELINE, Track, TrackedRecording
from asperity.report.base import Exhibit
from asperity.report.drawing import (
    display,
    draw_intervals,
    legend_below,
    mark_split,
    one_panel,
    plain_log_labels,
)
from asperity.report.style import BLUE, DASHED, GREEN, GREY, VERMILION, Medium, Style
from asperity.trend import ALARM_FACTOR, ALERT_FACTOR, Stages

MIN_CORRECTION = 1e-3  # of the CRF; smaller corrections for operating conditions are not drawn
MARKERS = "osv^Dp*hXP<>"
SEVERITY = LinearSegmentedColormap.from_list("severity", ["#0072b2", "#e69f00", "#d55e00"])


def x_label(track: Track) -> str:
    """Return the axis label of the series: sq_um as Sq [µm], time_h as time [h]."""
    return {"recording": "number"}.get(track.x_name, column_label(track.x_name))


def crfa_label(track: Track) -> str:
    """Return the label of CRFA with its unit, or with the unit of the recordings."""
    crfa = quantity("crfa")
    return crfa.label if track.comparable else f"{crfa.short} [unit²/Hz, not comparable]"


def trend(track: Track) -> Exhibit:
    """Draw the trend of the CRF with its break, and the probability of the severe stage.

    Raises
    ------
    BadInput
        for a series without any resonance.
    """
    resonant = [recording for recording in track.recordings if recording.resonance.found]
    if not resonant:
        raise BadInput("no trend to draw: no contact resonance was found")

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(0.95 * medium.double, 4.6), layout="constrained")
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
        _draw_crf(upper, track, resonant)
        _draw_severity(lower, track)
        legend_below(figure, 4 if medium.double > medium.single else 2)
        return figure

    split = track.stages is not None and track.stages.found
    return Exhibit(
        "trend",
        draw,
        f"{quantity('crf_hz').short} of each recording with its {PERCENT} interval; blue: normal, "
        "orange: severe. "
        + (f"Shaded: {PERCENT} interval of the break. " if split else "")
        + "Below: probability of the severe stage.",
        f"Trend of the contact resonance over {x_label(track)}: {track.verdict()}",
    )


def _draw_crf(axes: Axes, track: Track, resonant: list[TrackedRecording]) -> None:
    mark_split(axes, track.stages, f"break, {PERCENT}")
    x, x_std = np.array([(recording.x, recording.x_std) for recording in resonant]).T
    crf, crf_std = np.array(
        [(recording.resonance.crf_hz, recording.resonance.crf_std) for recording in resonant]
    ).T
    x_bars: Style = {"xerr": NORMAL_FACTOR * x_std} if x_std.any() else {}
    style: Style = {"ecolor": GREY, "zorder": 1, "label": f"{PERCENT} interval"}
    draw_intervals(axes, x, crf, NORMAL_FACTOR * crf_std, "none", **x_bars, **style)
    colours = SEVERITY(np.nan_to_num([recording.severe_probability for recording in resonant]))
    label = quantity("crf_hz").short
    axes.scatter(x, crf, c=colours, s=22, zorder=2, edgecolors="white", linewidths=0.4, label=label)
    _draw_references(axes, track, resonant)
    missing = [recording.x for recording in track.recordings if not recording.resonance.found]
    _mark_missing(axes, missing, "not found or not usable")
    axes.set(ylabel=quantity("crf_hz").label, title="Contact resonance frequency")


def _draw_references(axes: Axes, track: Track, resonant: list[TrackedRecording]) -> None:
    """Draw the CRF at reference conditions, where it differs, and the CRF at full load."""
    x, crf = np.array([(recording.x, recording.resonance.crf_hz) for recording in resonant]).T
    corrected = np.array([recording.crf_reference_hz for recording in resonant])
    differs = np.abs(corrected - crf) > MIN_CORRECTION * crf
    if differs.any():
        style: Style = {"markersize": 5, "markerfacecolor": "none", "color": GREEN, "zorder": 3}
        label = "corrected to reference conditions"
        axes.plot(x[differs], corrected[differs], "o", label=label, **style)
    full_load = track.target.full_load_crf_hz
    if full_load is not None:
        style = {"color": "black", "linestyle": ":", "linewidth": 1.0}
        axes.axhline(full_load, label="CRF at full load", **style)


def _mark_missing(axes: Axes, positions: list[float], label: str) -> None:
    """Mark recordings without a value along the lower edge."""
    if positions:
        along_edge = axes.get_xaxis_transform()
        height = np.full(len(positions), 0.02)
        axes.plot(positions, height, "x", color=GREY, transform=along_edge, label=label)


def _draw_severity(axes: Axes, track: Track) -> None:
    mark_split(axes, track.stages)
    severe = np.array(
        [(recording.x, recording.severe_probability) for recording in track.recordings]
    )
    axes.plot(*severe[np.isfinite(severe[:, 1])].T, "o", color=VERMILION, markersize=4)
    alarmed = [recording.x for recording in track.recordings if recording.state == "alarm"]
    if alarmed:
        axes.axvline(
            alarmed[0], color=VERMILION, linewidth=1.0, linestyle=DASHED, label="alarm raised"
        )
    axes.set(ylim=(-0.05, 1.12), xlabel=x_label(track), ylabel="severe", yticks=(0.0, 0.5, 1.0))


def amplitude(track: Track) -> Exhibit:
    """Draw CRFA over x with intervals."""

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        resonant = [
            recording
            for recording in track.recordings
            if recording.resonance.found and recording.resonance.crfa > 0.0
        ]
        crfa = np.array([recording.resonance.crfa for recording in resonant])
        std = np.array([recording.resonance.crfa_std for recording in resonant])
        factor = (
            np.exp(NORMAL_FACTOR * np.where(np.isfinite(std), std, 0.0) / crfa)
            if resonant
            else crfa
        )
        bars = [crfa - crfa / factor, crfa * factor - crfa]
        x = [recording.x for recording in resonant]
        label = f"{quantity('crfa').short} with {PERCENT} interval"
        _draw_trend(axes, track, x, (crfa, bars), marker="s", color=BLUE, label=label)
        axes.set(yscale="log", ylabel=crfa_label(track), title="Contact resonance amplitude")

    return Exhibit(
        "amplitude",
        draw,
        "Height of the fitted resonance at the CRF above the background.",
        "Trend of the contact resonance amplitude.",
    )


def damping(track: Track) -> Exhibit:
    """Draw the damping ratio over x with intervals and its own break."""
    stages = track.stages_by.get("damping")

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        determined = [recording for recording in track.recordings if not recording.damping_reason]
        ratio, std = (
            display("damping_ratio", np.array(part))
            for part in zip(*[recording.damping for recording in determined], strict=True)
        )
        factor = np.exp(NORMAL_FACTOR * std / ratio)
        bars = [ratio - ratio / factor, ratio * factor - ratio]
        x = [recording.x for recording in determined]
        style: Style = {
            "marker": "^",
            "color": GREEN,
            "label": f"damping ratio with {PERCENT} interval",
        }
        _draw_trend(axes, track, x, (ratio, bars), stages, **style)
        unknown = [
            recording.x
            for recording in track.recordings
            if recording.resonance.found and recording.damping_reason
        ]
        _mark_missing(axes, unknown, "not determined")
        axes.set(
            yscale="log",
            ylabel=quantity("damping_ratio").axis,
            title="Damping of the contact resonance",
        )
        plain_log_labels(axes)

    verdict = "" if stages is None else f" From damping alone: {in_print(stages.verdict)}"
    return Exhibit(
        "damping",
        draw,
        "Half the width of the fitted resonance over its frequency. If the damping of the rest of "
        f"the machine is constant, it falls as load moves from oil to asperities.{verdict}",
        f"Trend of the damping ratio over {x_label(track)}.{verdict}",
    )


def levels(track: Track) -> Exhibit | None:
    """Draw level indicators over x relative to their baseline; None with fewer than two values."""
    trends = _relative_levels(track)
    if not trends:
        return None

    @one_panel(4.2)
    def draw(axes: Axes) -> None:
        x = np.array([recording.x for recording in track.recordings])
        for number, (name, values) in enumerate(trends.items()):
            marker = MARKERS[number % len(MARKERS)]
            axes.plot(x, values, marker, markersize=4, linestyle=":", linewidth=0.8, label=name)
        for factor, style, label in (
            (ALERT_FACTOR, ":", "alert, if it lasts"),
            (ALARM_FACTOR, DASHED, "alarm, if it lasts"),
        ):
            axes.axhline(factor, color=VERMILION, linestyle=style, linewidth=1.0, label=label)
        axes.set(
            yscale="log",
            xlabel=x_label(track),
            ylabel="over baseline",
            title="Levels, bands and fault frequencies",
        )
        plain_log_labels(axes)

    return Exhibit(
        "levels",
        draw,
        f"All values relative to their baseline, the median of the first {BASELINE}. Line: rms at "
        "a fault frequency and two harmonics; envelope: modulation depth there. These levels "
        "alone do not indicate the state of the contact.",
        f"Levels over {x_label(track)}, relative to the baseline.",
    )


def _relative_levels(track: Track) -> dict[str, Field]:
    """Return each level that at least two recordings have, relative to its baseline."""
    readings = [recording.reading for recording in track.recordings]
    levels: dict[str, list[float]] = {
        name: [
            np.nan if reading.quality is None else float(getattr(reading.quality, name))
            for reading in readings
        ]
        for name in ("rms", "kurtosis")
    }
    levels["velocity"] = [reading.velocity for reading in readings]
    for group, label in (("bands", "rms"), ("lines", "line"), ("depths", "envelope")):
        for name in dict.fromkeys(name for reading in readings for name in getattr(reading, group)):
            levels[f"{label} {name}"] = [
                getattr(reading, group).get(name, np.nan) for reading in readings
            ]
    relative: dict[str, Field] = {}
    for name, values in levels.items():
        positive = [value for value in values if value > 0.0]
        if len(positive) > 1:
            relative[name] = np.array(
                [value if value > 0.0 else np.nan for value in values]
            ) / np.median(positive[:BASELINE])
    return relative


def asperity_load_share(track: Track) -> Exhibit:
    """Draw CLR from the CRF over x with intervals."""

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        determined = [recording for recording in track.recordings if np.isfinite(recording.clr)]
        clr = display("clr", np.array([recording.clr for recording in determined]))
        low, high = display(
            "clr", np.array([recording.clr_interval for recording in determined]).reshape(-1, 2)
        ).T
        x = [recording.x for recording in determined]
        style: Style = {
            "marker": "o",
            "color": VERMILION,
            "label": f"{quantity('clr').short} from the contact model",
        }
        _draw_trend(axes, track, x, (clr, [clr - low, high - clr]), **style)
        axes.axhline(display("clr", 1.0), color="black", linestyle=":", linewidth=1.0)
        axes.set(ylabel=quantity("clr").label, title="Asperity load share from the CRF")
        axes.set_ylim(bottom=0.0)

    return Exhibit(
        "load-share",
        draw,
        "CLR = (CRF/CRF at full load)⁶: computed with the contact model, not measured.",
        "Trend of the asperity load share computed with the contact model.",
    )


def _draw_trend(
    axes: Axes,
    track: Track,
    x: list[float],
    values_and_bars: tuple[Field, Sequence[Field]],
    stages: Stages | None = None,
    *,
    marker: str,
    **style: Any,
) -> None:
    """Draw values with intervals and the break of `stages` (default: the deciding one)."""
    mark_split(axes, stages or track.stages, f"break, {PERCENT}")
    values, bars = values_and_bars
    draw_intervals(axes, x, values, bars, marker, ecolor=GREY, markersize=4, **style)
    axes.set_xlabel(x_label(track))
