"""Exhibits of a tracked series: trend, load share, waterfall, one spectrum with its fit and the lines taken out."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import in_print, quantity
from asperity.monitoring import BASELINE, LEVEL_LEAST, Track, TrackedRecording
from asperity.report.base import Exhibit
from asperity.report.drawing import (
    display,
    draw_intervals,
    legend_below,
    mark_split,
    name_axes,
    neighbours,
    one_panel,
    plain_powers,
)
from asperity.report.style import BAND_COLOUR, BLUE, DASHED, GREEN, GREY, VERMILION, Medium
from asperity.trend import INTERVAL_FACTOR, Stages

STEADIED = 1e-3  # of a CRF: what conditions explain of it is drawn from there on
MARKS = "osv^Dp*hXP<>"
MOST_ROWS = 400  # of a waterfall; more recordings are thinned out
SEVERITY = LinearSegmentedColormap.from_list("severity", ["#0072b2", "#e69f00", "#d55e00"])
UNITS = {"um": "µm"} | {unit: unit for unit in ("h", "s", "min", "d", "mm", "nm", "m", "km")}


def x_label(track: Track) -> str:
    """The axis of the series: sq_um as Sq [µm], time_h as time [h]."""
    name, separator, unit = track.x_name.rpartition("_")
    if separator and unit in UNITS:
        return f"{'Sq' if name == 'sq' else name.replace('_', ' ')} [{UNITS[unit]}]"
    return {"recording": "number"}.get(track.x_name, track.x_name)


def crfa_label(track: Track) -> str:
    """CRFA with its unit, or the recordings' own."""
    crfa = quantity("crfa")
    return crfa.label if track.comparable else f"{crfa.short} [unit²/Hz, not comparable]"


def trend(track: Track) -> Exhibit:
    """CRF with 90 % intervals over x, the break with its interval; below it the probability of the severe stage.

    Raises
    ------
    BadInput
        for a series in which no resonance was found.
    """
    resonant = [recording for recording in track.recordings if recording.resonance.found]
    if not resonant:
        raise BadInput("there is no trend to draw: no contact resonance was found")

    def draw(medium: Medium) -> Figure:
        figure = Figure(figsize=(0.95 * medium.double, 4.6), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
        _draw_crf(above, track, resonant)
        _draw_severity(below, track)
        legend_below(figure, 4 if medium.double > medium.single else 2)
        return figure

    split = track.stages is not None and track.stages.found
    return Exhibit(
        "trend",
        draw,
        f"{quantity('crf_hz').short} of each recording with its 90 % interval; blue normal, orange severe. "
        + ("The shaded strip is where the break lies with 90 %. " if split else "")
        + "Below: the probability of the severe stage.",
        f"Trend of the contact resonance over {x_label(track)}: {track.verdict()}",
    )


def _draw_crf(axes: Axes, track: Track, resonant: list[TrackedRecording]) -> None:
    mark_split(axes, track.stages, "break, 90 %")
    x, x_std = np.array([(recording.x, recording.x_std) for recording in resonant]).T
    crf, crf_std = np.array(
        [(recording.resonance.crf_hz, recording.resonance.crf_std) for recording in resonant]
    ).T
    sideways: Any = {"xerr": INTERVAL_FACTOR * x_std} if x_std.any() else {}
    style: Any = {"ecolor": GREY, "zorder": 1, "label": "90 % interval"}
    draw_intervals(axes, x, crf, INTERVAL_FACTOR * crf_std, "none", **sideways, **style)
    colours = SEVERITY(np.nan_to_num([recording.severe_probability for recording in resonant]))
    label = quantity("crf_hz").short
    axes.scatter(x, crf, c=colours, s=22, zorder=2, edgecolors="white", linewidths=0.4, label=label)
    resample_to_constant_speed = np.array([recording.crf_reference_hz for recording in resonant])
    moved = np.abs(resample_to_constant_speed - crf) > STEADIED * crf
    if moved.any():
        axes.plot(
            x[moved],
            resample_to_constant_speed[moved],
            "o",
            markersize=5,
            markerfacecolor="none",
            color=GREEN,
            zorder=3,
            label="at the first load, speed, temperature",
        )
    full = track.target.full_load_crf_hz
    if full is not None:
        axes.axhline(
            full, color="black", linestyle=":", linewidth=1.0, label="all load on asperities"
        )
    missing = [recording.x for recording in track.recordings if not recording.resonance.found]
    if missing:
        axes.plot(
            missing,
            np.full(len(missing), 0.02),
            "x",
            color=GREY,
            transform=axes.get_xaxis_transform(),
            label="not found, or not usable",
        )
    axes.set(ylabel=quantity("crf_hz").label, title="Contact resonance frequency")


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
    """CRFA over x, logarithmic, with 90 % intervals."""

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        resonant = [
            one for one in track.recordings if one.resonance.found and one.resonance.crfa > 0.0
        ]
        crfa = np.array([recording.resonance.crfa for recording in resonant])
        std = np.array([recording.resonance.crfa_std for recording in resonant])
        factor = (
            np.exp(INTERVAL_FACTOR * np.where(np.isfinite(std), std, 0.0) / crfa)
            if resonant
            else crfa
        )
        ends = [crfa - crfa / factor, crfa * factor - crfa]
        x = [recording.x for recording in resonant]
        _draw_intervals(
            axes, track, x, crfa, ends, "s", BLUE, f"{quantity('crfa').short} with 90 % interval"
        )
        axes.set(yscale="log", ylabel=crfa_label(track), title="Contact resonance amplitude")

    return Exhibit(
        "amplitude",
        draw,
        "Height of the fitted line at the CRF, without what lies below it.",
        "Trend of the contact resonance amplitude.",
    )


def damping(track: Track) -> Exhibit:
    """Damping ratio of the fitted line over x, with 90 % intervals and the break that it shows by itself."""
    stages = track.stages_by.get("damping")

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        known = [one for one in track.recordings if not one.damping_reason]
        ratio, std = (
            display("damping_ratio", np.array(part))
            for part in zip(*[one.damping for one in known], strict=True)
        )
        factor = np.exp(INTERVAL_FACTOR * std / ratio)
        ends = [ratio - ratio / factor, ratio * factor - ratio]
        x = [recording.x for recording in known]
        _draw_intervals(
            axes, track, x, ratio, ends, "^", GREEN, "damping ratio with 90 % interval", stages
        )
        unknown = [one.x for one in track.recordings if one.resonance.found and one.damping_reason]
        if unknown:
            axes.plot(
                unknown,
                np.full(len(unknown), 0.02),
                "x",
                color=GREY,
                transform=axes.get_xaxis_transform(),
                label="not determined",
            )
        axes.set(
            yscale="log",
            ylabel=quantity("damping_ratio").axis,
            title="Damping of the contact resonance",
        )
        plain_powers(axes)

    said = "" if stages is None else f" By it alone: {in_print(stages.verdict)}"
    return Exhibit(
        "damping",
        draw,
        "Half the width of the fitted line over its frequency. Where the rest of the machine damps the same "
        f"throughout, it falls as asperities take the load over from the oil.{said}",
        f"Trend of the damping ratio over {x_label(track)}.{said}",
    )


def levels(track: Track) -> Exhibit | None:
    """Level, velocity, kurtosis, bands, lines and envelope over x, each over its first; None with fewer than two."""
    courses = _courses(track)
    if not courses:
        return None

    @one_panel(4.2)
    def draw(axes: Axes) -> None:
        x = np.array([recording.x for recording in track.recordings])
        for number, (name, values) in enumerate(courses.items()):
            mark = MARKS[number % len(MARKS)]
            axes.plot(x, values, mark, markersize=4, linestyle=":", linewidth=0.8, label=name)
        axes.axhline(
            np.exp(LEVEL_LEAST),
            color=VERMILION,
            linestyle=DASHED,
            linewidth=1.0,
            label="least that alarms",
        )
        axes.set(
            yscale="log",
            xlabel=x_label(track),
            ylabel="over the first",
            title="Levels, bands, rates of faults",
        )
        plain_powers(axes)

    return Exhibit(
        "levels",
        draw,
        f"Each over the median of its first {BASELINE}. Lines are the rms at a rate and its next two harmonics; the "
        "envelope is how deep it is modulated there. None of it says anything of the contact by itself.",
        f"Levels over {x_label(track)}, relative to the first recordings.",
    )


def _courses(track: Track) -> dict[str, Field]:
    """By name, every level that at least two recordings have, relative to the first."""
    readings = [recording.reading for recording in track.recordings]
    heard: dict[str, list[float]] = {
        name: [
            np.nan if one.quality is None else float(getattr(one.quality, name)) for one in readings
        ]
        for name in ("rms", "kurtosis")
    }
    heard["velocity"] = [one.velocity for one in readings]
    for several, word in (("bands", "rms"), ("lines", "line"), ("depths", "envelope")):
        for name in dict.fromkeys(name for one in readings for name in getattr(one, several)):
            heard[f"{word} {name}"] = [getattr(one, several).get(name, np.nan) for one in readings]
    courses: dict[str, Field] = {}
    for name, values in heard.items():
        known = [value for value in values if value > 0.0]
        if len(known) > 1:
            courses[name] = np.array(
                [value if value > 0.0 else np.nan for value in values]
            ) / np.median(known[:BASELINE])
    return courses


def asperity_load_share(track: Track) -> Exhibit:
    """CLR read off the CRF, with 90 % intervals, over x."""

    @one_panel(3.1)
    def draw(axes: Axes) -> None:
        read = [recording for recording in track.recordings if np.isfinite(recording.clr)]
        clr = display("clr", np.array([recording.clr for recording in read]))
        low, high = display(
            "clr", np.array([recording.clr_interval for recording in read]).reshape(-1, 2)
        ).T
        x, label = (
            [recording.x for recording in read],
            f"{quantity('clr').short} as the model reads it",
        )
        _draw_intervals(axes, track, x, clr, [clr - low, high - clr], "o", VERMILION, label)
        axes.axhline(display("clr", 1.0), color="black", linestyle=":", linewidth=1.0)
        axes.set(ylabel=quantity("clr").label, title="Load share, read off the CRF")
        axes.set_ylim(bottom=0.0)

    return Exhibit(
        "load-share",
        draw,
        "CLR = (CRF/CRF at full load)⁶: the contact model's reading, not a measurement.",
        "Trend of the load share of asperities as the model reads it.",
    )


def _draw_intervals(
    axes: Axes,
    track: Track,
    x: list[float],
    values: Field,
    reach: list[Field],
    marker: str,
    colour: str,
    label: str,
    stages: Stages | None = None,
) -> None:
    """With the break of `stages`, or else the one that decides."""
    mark_split(axes, stages or track.stages, "break, 90 %")
    draw_intervals(
        axes, x, values, reach, marker, color=colour, ecolor=GREY, markersize=4, label=label
    )
    axes.set_xlabel(x_label(track))


def waterfall(track: Track) -> Exhibit:
    """The spectra of all recordings around the band, one a row, lines taken out, with the resonances found in them.

    Raises
    ------
    BadInput
        for a series without a spectrum.
    """
    usable = [recording for recording in track.recordings if recording.clean is not None]
    if not usable:
        raise BadInput("there is no waterfall to draw: no recording could be used")
    rows = usable[:: -(-len(usable) // MOST_ROWS)]

    @one_panel(4.4, key=0)
    def draw(axes: Axes) -> None:
        frequency, levels = _levels(track, rows)
        reach = float(np.quantile(np.abs(levels), 0.995)) or 1.0
        image = axes.imshow(
            levels,
            aspect="auto",
            origin="lower",
            cmap="cividis",
            vmin=-0.6 * reach,
            vmax=reach,
            interpolation="none",
            extent=(frequency[0], frequency[-1], 0.5, len(rows) + 0.5),
        )
        resonant = [
            (one.resonance.crf_hz, number)
            for number, one in enumerate(rows, 1)
            if one.resonance.found
        ]
        axes.plot(
            [crf for crf, _ in resonant],
            [number for _, number in resonant],
            "o",
            markerfacecolor="none",
            color="white",
            markersize=4.5,
            markeredgewidth=0.9,
            label=quantity("crf_hz").short,
        )
        for end in track.target.band_hz:
            axes.axvline(end, color="white", linewidth=0.9, linestyle=DASHED)
        name_axes(
            axes,
            "frequency_hz",
            title="Spectra of the series",
            ylabel=f"recording, by {x_label(track)}",
        )
        axes.set_xlim(frequency[0], frequency[-1])
        places = sorted({0, len(rows) // 4, len(rows) // 2, 3 * len(rows) // 4, len(rows) - 1})
        axes.set_yticks(
            [place + 1 for place in places], [f"{rows[place].x:.3g}" for place in places]
        )
        axes.spines[:].set_visible(False)
        style: Any = {"location": "bottom", "shrink": 0.8}
        axes.figure.colorbar(image, ax=axes, label=quantity("level_db").axis, **style)

    return Exhibit(
        "waterfall",
        draw,
        "Every spectrum is a row; lines of shafts and mains are taken out. Dashed: the band searched. What "
        "stays upright is the machine's structure.",
        "Waterfall of the spectra of all recordings around the band.",
    )


def _levels(track: Track, rows: list[TrackedRecording]) -> tuple[Field, Field]:
    """Frequencies around the band, and the level of each row over its median [dB]."""
    frequency, inside = _around(track)
    together = max(1, int(np.count_nonzero(inside)) // 480)
    density = np.array(
        [
            neighbours(row.clean.spectrum.density[inside], together).mean(axis=1)
            for row in rows
            if row.clean is not None
        ]
    )
    levels = 10.0 * np.log10(np.maximum(density, 1e-300))
    levels -= np.median(levels, axis=1, keepdims=True)
    return neighbours(frequency[inside], together).mean(axis=1), levels


def typical_recording(track: Track) -> TrackedRecording:
    """The recording whose CRF is known as well as most; of a series without any, the first that could be used."""
    resonant = sorted(
        (one for one in track.recordings if one.resonance.found),
        key=lambda one: one.resonance.crf_std,
    )
    if resonant:
        return resonant[len(resonant) // 2]
    return next(recording for recording in track.recordings if recording.clean is not None)


def spectrum_with_fit(track: Track, recording: TrackedRecording) -> Exhibit:
    """One recording's spectrum around the band: the fit, its CRF, and the lines of shafts and mains taken out.

    Raises
    ------
    BadInput
        for a recording without a spectrum.
    """
    spectrum, name, resonance = (
        recording.reading.spectrum,
        Path(recording.file).name,
        recording.resonance,
    )
    if recording.clean is None or spectrum is None:
        raise BadInput(f"{recording.file} has no spectrum to draw: {resonance.reason}")
    clean = recording.clean

    @one_panel(4.4)
    def draw(axes: Axes) -> None:
        frequency, inside = _around(track)
        together = max(1, int(np.count_nonzero(inside)) // 700)
        f = neighbours(frequency[inside], together).mean(axis=1)
        recorded = neighbours(spectrum.density[inside], together).max(axis=1)
        cleaned = neighbours(clean.spectrum.density[inside], together).mean(axis=1)
        axes.axvspan(
            *track.target.band_hz,
            facecolor=BAND_COLOUR,
            edgecolor=GREY,
            linewidth=0.7,
            label="band searched",
        )
        axes.semilogy(f, recorded, color="#e3b9a0", linewidth=0.6, label="as recorded (peaks)")
        axes.semilogy(f, cleaned, color=GREY, linewidth=0.8, label="lines taken out (mean)")
        lines = [line.frequency_hz for line in clean.removed if f[0] <= line.frequency_hz <= f[-1]]
        axes.plot(
            lines,
            np.full(len(lines), 0.985),
            "|",
            color=VERMILION,
            markersize=5,
            markeredgewidth=0.6,
            transform=axes.get_xaxis_transform(),
            label=f"{len(lines)} lines of shafts and mains",
        )
        _draw_fit(axes, track, recording, f)
        unit = quantity("acceleration_density").display if track.comparable else spectrum.unit
        name_axes(axes, "frequency_hz", ylabel=f"density [{unit}]")
        axes.set_xlim(f[0], f[-1])

    return Exhibit(
        "spectrum",
        draw,
        f"{name}, the recording of the middle interval width."
        if resonance.found
        else f"{name}: {resonance.reason}.",
        f"Spectrum of {name} with its fit and the lines taken out.",
    )


def _draw_fit(axes: Axes, track: Track, recording: TrackedRecording, frequency: Field) -> None:
    (low, high), resonance, crf = track.target.band_hz, recording.resonance, quantity("crf_hz")
    curve = resonance.curve(frequency)
    within = (frequency >= low) & (frequency <= high) & (curve > 0.0)
    if np.isfinite(curve[within]).any():
        axes.semilogy(
            frequency[within],
            curve[within],
            color=BLUE,
            label="fit" if resonance.found else "fit, no line",
        )
    if resonance.found:
        axes.axvline(resonance.crf_hz, color=BLUE, linestyle="--", linewidth=1.0, label=crf.short)
    axes.set_title(
        f"One spectrum: {crf.named(resonance.crf_hz) if resonance.found else 'no resonance found'}"
    )


def _around(track: Track) -> tuple[Field, Any]:
    """The frequencies of the series, and which of them lie in the band or near it."""
    first = next(
        recording.reading.spectrum for recording in track.recordings if recording.clean is not None
    )
    assert first is not None
    low, high = track.target.band_hz
    margin = 0.3 * (high - low)
    frequency = first.frequency_hz
    return frequency, (frequency >= max(low - margin, 0.0)) & (frequency <= high + margin)
