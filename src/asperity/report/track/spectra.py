"""Spectra of a tracked series: the waterfall, and a typical recording with its fit."""

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.monitoring import Track, TrackedRecording
from asperity.report.base import Exhibit
from asperity.report.drawing import group_values, name_axes, one_panel
from asperity.report.style import BAND_COLOUR, BLUE, DASHED, GREY, VERMILION, Style
from asperity.report.track.exhibits import x_label
from asperity.resonance import CleanSpectrum

MAX_ROWS = 400  # of a waterfall; more recordings are thinned out


def waterfall(track: Track) -> Exhibit:
    """Draw the spectra of all recordings around the band, one per row, with their resonances.

    Raises
    ------
    BadInput
        for a series without a usable recording.
    """
    usable = [recording for recording in track.recordings if recording.clean is not None]
    if not usable:
        raise BadInput("no waterfall to draw: no recording is usable")
    rows = usable[:: -(-len(usable) // MAX_ROWS)]

    draw = one_panel(4.4, legend_columns=0)(partial(_draw_waterfall, track=track, rows=rows))
    return Exhibit(
        "waterfall",
        draw,
        "One spectrum per row, without lines of shafts and mains. Dashed: search band. Vertical "
        "ridges are structural modes of the machine.",
        "Waterfall of the spectra of all recordings around the band.",
    )


def _draw_waterfall(axes: Axes, track: Track, rows: list[TrackedRecording]) -> None:
    frequency, levels = _waterfall_levels(track, rows)
    limit = float(np.quantile(np.abs(levels), 0.995)) or 1.0
    image = axes.imshow(
        levels,
        aspect="auto",
        origin="lower",
        cmap="cividis",
        vmin=-0.6 * limit,
        vmax=limit,
        interpolation="none",
        extent=(frequency[0], frequency[-1], 0.5, len(rows) + 0.5),
    )
    _mark_resonances(axes, rows)
    for end in track.target.band_hz:
        axes.axvline(end, color="white", linewidth=0.9, linestyle=DASHED)
    label = f"recording at {x_label(track)}"
    name_axes(axes, "frequency_hz", title="Spectra of the series", ylabel=label)
    axes.set_xlim(frequency[0], frequency[-1])
    selected = sorted({*(part * len(rows) // 4 for part in range(4)), len(rows) - 1})
    labels = [f"{rows[index].x:.3g}" for index in selected]
    axes.set_yticks([index + 1 for index in selected], labels)
    axes.spines[:].set_visible(False)
    style: Style = {"location": "bottom", "shrink": 0.8}
    axes.figure.colorbar(image, ax=axes, label=quantity("level_db").axis, **style)


def _mark_resonances(axes: Axes, rows: list[TrackedRecording]) -> None:
    resonant = [
        (row.resonance.crf_hz, number) for number, row in enumerate(rows, 1) if row.resonance.found
    ]
    style: Style = {"markerfacecolor": "none", "markersize": 4.5, "markeredgewidth": 0.9}
    axes.plot(
        [crf for crf, _ in resonant],
        [number for _, number in resonant],
        "o",
        color="white",
        label=quantity("crf_hz").short,
        **style,
    )


def _waterfall_levels(track: Track, rows: list[TrackedRecording]) -> tuple[Field, Field]:
    """Return frequencies around the band and the levels of each row over its median [dB]."""
    frequency, inside = _band_frequencies(track)
    group_size = max(1, int(np.count_nonzero(inside)) // 480)
    density = np.array(
        [
            group_values(row.clean.spectrum.density[inside], group_size).mean(axis=1)
            for row in rows
            if row.clean is not None
        ]
    )
    levels = 10.0 * np.log10(np.maximum(density, 1e-300))
    levels -= np.median(levels, axis=1, keepdims=True)
    return group_values(frequency[inside], group_size).mean(axis=1), levels


def typical_recording(track: Track) -> TrackedRecording:
    """Return the recording with the median CRF uncertainty, or else the first usable one."""
    resonant = sorted(
        (recording for recording in track.recordings if recording.resonance.found),
        key=lambda recording: recording.resonance.crf_std,
    )
    if resonant:
        return resonant[len(resonant) // 2]
    return next(recording for recording in track.recordings if recording.clean is not None)


def spectrum_with_fit(track: Track, recording: TrackedRecording) -> Exhibit:
    """Draw a recording's spectrum around the band with its fit, CRF and removed lines.

    Raises
    ------
    BadInput
        for a recording without a spectrum.
    """
    spectrum = recording.reading.spectrum
    name = Path(recording.file).name
    resonance = recording.resonance
    if recording.clean is None or spectrum is None:
        raise BadInput(f"no spectrum of {recording.file} to draw: {resonance.reason}")
    draw = one_panel(4.4)(partial(_draw_spectrum, track=track, recording=recording))
    return Exhibit(
        "spectrum",
        draw,
        f"{name}, the recording with the median width of the CRF interval."
        if resonance.found
        else f"{name}: {resonance.reason}.",
        f"Spectrum of {name} with its fit and the removed lines.",
    )


def _draw_spectrum(axes: Axes, track: Track, recording: TrackedRecording) -> None:
    spectrum = recording.reading.spectrum
    clean = recording.clean
    assert spectrum is not None
    assert clean is not None
    frequency, inside = _band_frequencies(track)
    group_size = max(1, int(np.count_nonzero(inside)) // 700)
    f, recorded, cleaned = (
        group_values(values[inside], group_size)
        for values in (frequency, spectrum.density, clean.spectrum.density)
    )
    f, recorded, cleaned = f.mean(axis=1), recorded.max(axis=1), cleaned.mean(axis=1)
    style: Style = {"facecolor": BAND_COLOUR, "edgecolor": GREY, "linewidth": 0.7}
    axes.axvspan(*track.target.band_hz, label="search band", **style)
    axes.semilogy(f, recorded, color="#e3b9a0", linewidth=0.6, label="recorded (maximum)")
    axes.semilogy(f, cleaned, color=GREY, linewidth=0.8, label="lines removed (mean)")
    _mark_lines(axes, clean, (f[0], f[-1]))
    _draw_fit(axes, track, recording, f)
    unit = quantity("acceleration_density").display if track.comparable else spectrum.unit
    name_axes(axes, "frequency_hz", ylabel=f"density [{unit}]")
    axes.set_xlim(f[0], f[-1])


def _mark_lines(axes: Axes, clean: CleanSpectrum, limits: tuple[float, float]) -> None:
    """Mark the removed lines between two frequencies along the top edge."""
    low, high = limits
    lines = [line.frequency_hz for line in clean.removed if low <= line.frequency_hz <= high]
    axes.plot(
        lines,
        np.full(len(lines), 0.985),
        "|",
        color=VERMILION,
        markersize=5,
        markeredgewidth=0.6,
        transform=axes.get_xaxis_transform(),
        label=f"{len(lines)} removed lines (shafts, mains)",
    )


def _draw_fit(axes: Axes, track: Track, recording: TrackedRecording, frequency: Field) -> None:
    (low, high) = track.target.band_hz
    resonance = recording.resonance
    crf = quantity("crf_hz")
    curve = resonance.curve(frequency)
    inside = (frequency >= low) & (frequency <= high) & (curve > 0.0)
    if np.isfinite(curve[inside]).any():
        axes.semilogy(
            frequency[inside],
            curve[inside],
            color=BLUE,
            label="fit" if resonance.found else "fit, no resonance",
        )
    if resonance.found:
        axes.axvline(resonance.crf_hz, color=BLUE, linestyle="--", linewidth=1.0, label=crf.short)
    axes.set_title(
        f"Spectrum: {crf.named(resonance.crf_hz) if resonance.found else 'no resonance found'}"
    )


def _band_frequencies(track: Track) -> tuple[Field, Mask]:
    """Return the frequencies of the series and a mask of those in and around the band."""
    first = next(
        recording.reading.spectrum for recording in track.recordings if recording.clean is not None
    )
    assert first is not None
    low, high = track.target.band_hz
    margin = 0.3 * (high - low)
    frequency = first.frequency_hz
    return frequency, (frequency >= max(low - margin, 0.0)) & (frequency <= high + margin)
