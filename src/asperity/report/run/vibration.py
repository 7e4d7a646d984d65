"""Figures of the vibration model: spectrum of a run, Figs 3 and 4 and Table 1 of the paper."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.core.signals import Signal, Spectrum, power_spectrum
from asperity.coupling import Vibration, VibrationModel
from asperity.paper import Table1Row, continuous_crfa, expected_crfa
from asperity.report.base import Exhibit
from asperity.report.drawing import display, group_values, legend_below, name_axes, one_panel
from asperity.report.style import BAND_COLOUR, BLUE, GREEN, GREY, ON_PAGE, VERMILION
from asperity.resonance import Resonance
from asperity.vibration import mass_motion, white_noise

RATES = (10e3, 20e3, 50e3, 200e3)  # Hz
MAX_DURATION = 0.5  # seconds of a record that are drawn: more is a black bar
LOADS = (100.0, 200.0, 300.0, 400.0)
MOTION = {"displacement": BLUE, "velocity": GREEN, "acceleration": VERMILION}
HEIGHT, CUTOFF = 2e-6, 30.0  # of the first four rows of Table 1


def spectrum(vibration: Vibration, resonance_in_words: str) -> Exhibit:
    """Draw the acceleration spectrum around the search band with the fitted resonance.

    Raises
    ------
    BadInput
        for a contact without a spectrum: no asperity touches.
    """
    density = vibration.spectrum
    resonance = vibration.resonance
    if density is None:
        raise BadInput(f"no spectrum to draw: {resonance.reason}")
    (low, high) = vibration.band_hz
    line = quantity("crf_hz")
    margin = 0.35 * (high - low)

    @one_panel(3.5)
    def draw(axes: Axes) -> None:
        _draw_band(axes, density, (low - margin, high + margin), (low, high))
        title = (
            f"Contact resonance at {line.text(resonance.crf_hz)}"
            if resonance.found
            else "No resonance found"
        )
        axes.set_title(title)
        if resonance.found:
            _mark_resonance(axes, resonance, np.linspace(low, high, 600))
        axes.axvline(
            vibration.full_load_crf_hz,
            color="black",
            linestyle=":",
            linewidth=1.0,
            label="CRF at full load",
        )
        axes.set_xlim(low - margin, high + margin)

    entry = quantity("band_hz")
    band = f"{entry.number(low)} to {entry.text(high)}"
    full_load = entry.text(vibration.full_load_crf_hz)
    return Exhibit(
        "spectrum",
        draw,
        "Acceleration spectrum of a simulated record of "
        f"{quantity('duration_s').text(density.duration_s)}, resolution "
        f"{quantity('resolution_hz').text(density.resolution_hz)}: {resonance_in_words}. "
        f"Search band: {band}; CRF with all load on asperities: {full_load}.",
        f"Acceleration spectrum around the search band {band}: {resonance_in_words}.",
    )


def _draw_band(
    axes: Axes, density: Spectrum, limits: tuple[float, float], band: tuple[float, float]
) -> None:
    """Draw the spectrum between limits, averaged over neighbouring lines if there are many."""
    inside = (density.frequency_hz >= limits[0]) & (density.frequency_hz <= limits[1])
    lines_per_point = max(int(np.count_nonzero(inside)) // 400, 1)
    axes.axvspan(*band, facecolor=BAND_COLOUR, edgecolor=GREY, linewidth=0.7, label="search band")
    frequency, level = (
        group_values(values[inside], lines_per_point).mean(axis=1)
        for values in (density.frequency_hz, density.density)
    )
    name = "spectrum" if lines_per_point == 1 else f"spectrum, mean of {lines_per_point} lines"
    axes.semilogy(frequency, level, color=GREY, linewidth=0.7, label=name)
    name_axes(axes, "frequency_hz", "acceleration_density")


def _mark_resonance(axes: Axes, resonance: Resonance, frequency: Field) -> None:
    if np.isfinite(resonance.damping_ratio):  # the method "peak" fits no curve
        axes.semilogy(
            frequency, resonance.curve(frequency), color=VERMILION, label="fitted resonance"
        )
    crf = resonance.crf_hz
    half_width = 2.0 * resonance.crf_std
    if np.isfinite(half_width):
        axes.axvspan(crf - half_width, crf + half_width, color=BLUE, alpha=0.35, linewidth=0)
    label = "CRF ± 2 std" if np.isfinite(half_width) else "CRF"
    axes.axvline(crf, color=BLUE, linestyle="--", linewidth=1.0, label=label)


# Figs 3 and 4 of the paper
# ---------------------------------------------------------------------------------


@ON_PAGE.drawing()
def excitation_figure(vibration: Vibration, model: VibrationModel) -> Figure:
    """Draw white noise, the profile and their spectra (Fig 3 of the paper).

    Raises
    ------
    BadInput
        for a contact without touching asperities.
    """
    profile = vibration.profile
    if profile is None:
        raise BadInput(f"no profile to draw: {vibration.resonance.reason}")
    figure, (a, b, c, d) = _four_panels()
    noise = Signal(white_noise(profile.values.size, model.seed), profile.rate_hz, "m")
    _draw_record(a, noise, "noise_height_m", "(a) white noise, unscaled", GREY)
    _draw_spectrum(b, noise, "(b) spectrum of (a)", GREY)
    b.axhline(2.0 / profile.rate_hz, color="black", linestyle="--", linewidth=1.0, label="2 / rate")
    _draw_record(c, profile, "profile_height_m", f"(c) profile, {model.excitation.label}", BLUE)
    _draw_spectrum(d, profile, "(d) spectrum of (c)", BLUE)
    if vibration.oscillator is not None and vibration.expected is not None:
        f = vibration.expected.frequency_hz[1:]
        gain = vibration.oscillator.sampled_gain(f, profile.rate_hz)
        density = vibration.expected.density[1:] / gain
        d.loglog(f, density, "--", color="black", linewidth=1.0, label="closed form")
    d.set_ylim(1e-11 * float(np.max(power_spectrum(profile).density)), None)
    for axes in (b, d):
        axes.legend(loc="lower left")
    return figure


@ON_PAGE.drawing()
def response_figure(vibration: Vibration, model: VibrationModel) -> Figure:
    """Draw displacement, velocity, acceleration and its spectrum (Fig 4 of the paper).

    Raises
    ------
    BadInput
        for a contact without touching asperities.
    """
    profile = vibration.profile
    oscillator = vibration.oscillator
    density = vibration.spectrum
    if profile is None or oscillator is None or density is None or vibration.expected is None:
        raise BadInput(f"no response to draw: {vibration.resonance.reason}")
    motion = mass_motion(oscillator, profile, method=model.response, substeps=model.substeps)
    figure, (*records, d) = _four_panels()
    for axes, letter, (key, colour) in zip(records, "abc", MOTION.items(), strict=True):
        record = Signal(getattr(motion, key), profile.rate_hz, quantity(key).unit)
        _draw_record(axes, record, key, f"({letter}) {quantity(key).name}", colour)
    f0 = oscillator.natural_frequency_hz
    resonance = vibration.resonance
    inside = np.abs(density.frequency_hz / f0 - 1.0) < 0.1
    f = density.frequency_hz[inside]
    expected = vibration.expected.density[inside]
    d.plot(f, density.density[inside], color=GREY, linewidth=0.7, label="raw periodogram")
    d.plot(f, expected, color="black", linewidth=1.2, label="closed form")
    _mark_frequencies(d, resonance, f0)
    name_axes(d, "frequency_hz", "acceleration_density", title="(d) spectrum of the acceleration")
    d.set_ylim(0.0, None)
    d.legend(loc="upper right" if resonance.found and resonance.crf_hz < f0 else "upper left")
    return figure


def _mark_frequencies(axes: Axes, resonance: Resonance, f0: float) -> None:
    """Mark the fitted resonance, if found, and the natural frequency [Hz]."""
    if resonance.found:
        crf = quantity("crf_hz").named(resonance.crf_hz)
        label = f"{crf}, CRFA {quantity('crfa').number(resonance.crfa)}"
        axes.plot(resonance.crf_hz, resonance.crfa, "o", color=VERMILION, label=label)
    label = f"f0 {quantity('frequency_hz').text(f0)}"
    axes.axvline(f0, color=BLUE, linestyle=":", linewidth=1.2, label=label)


def _four_panels() -> tuple[Figure, Sequence[Axes]]:
    figure = Figure(figsize=(ON_PAGE.double, 5.6), layout="constrained")
    return figure, list(figure.subplots(2, 2).flat)


def _draw_record(axes: Axes, record: Signal, key: str, title: str, colour: str) -> None:
    values = display(key, record.values[: max(2, round(MAX_DURATION * record.rate_hz))])
    axes.plot(np.arange(values.size) / record.rate_hz, values, color=colour, linewidth=0.6)
    name_axes(axes, "record_time_s", key, title=title)
    axes.margins(x=0.0)


def _draw_spectrum(axes: Axes, record: Signal, title: str, colour: str) -> None:
    """Draw the spectrum, averaged over bins of equal width on a logarithmic axis."""
    density = power_spectrum(record)
    frequency = density.frequency_hz[2:]
    level = density.density[2:]
    edges = np.unique(np.searchsorted(frequency, np.geomspace(frequency[0], frequency[-1], 1200)))
    width = np.diff([*edges, frequency.size])
    binned = (np.add.reduceat(values, edges) / width for values in (frequency, level))
    axes.loglog(*binned, color=colour, linewidth=0.7, label="one record")
    name_axes(axes, "frequency_hz", "profile_density", title=title)


# Table 1 of the paper
# ---------------------------------------------------------------------------------


@ON_PAGE.drawing()
def table1_figure(rows: Sequence[Table1Row]) -> Figure:
    """Draw CRFA over load, height and cut-off: published values and simulated 5 to 95 % ranges."""
    parts = (
        (rows[:4], "load_n", "load_n", "load"),
        (rows[4:8], "height_m", "profile_height_m", "height"),
        (rows[8:], "cutoff_hz", "cutoff_hz", "cut-off"),
    )
    figure = Figure(figsize=(ON_PAGE.double, 3.9), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, (part, name, key, symbol) in zip(panels, parts, strict=True):
        x = display(key, np.array([getattr(row, name) for row in part]))
        median, low, high = (
            np.array([getattr(row, f"crfa{end}") for row in part]) for end in ("", "_low", "_high")
        )
        axes.errorbar(
            x,
            median,
            [median - low, high - median],
            fmt="o",
            color=BLUE,
            capsize=5,
            label="asperity: median, 5 to 95 % of single records",
        )
        axes.plot(
            x, [row.paper_crfa for row in part], "x", color=VERMILION, markersize=9, label="paper"
        )
        axes.set(xscale="log", yscale="log", title=f"median ~ {_power(symbol, x, median)}")
        name_axes(axes, key)
        _tick_at(axes, x)
    panels[0].set_ylabel(quantity("crfa").label)
    legend_below(figure, 2, handles=panels[0].get_legend_handles_labels()[0])
    return figure


@ON_PAGE.drawing()
def trend_over_load_figure(model: VibrationModel) -> Figure:
    """Draw CRFA over load at several sampling rates, in closed form.

    The difference between the curves is the effect of sampling on the trend of the paper.
    """
    strokes = (("-o", VERMILION), ("--s", BLUE), ("-.^", GREEN), (":D", GREY))
    figure = Figure(figsize=(5.6, 4.4), layout="constrained")
    axes = figure.add_subplot()
    for (line_style, colour), rate in zip(strokes, RATES, strict=True):
        sampled = replace(model, rate_hz=rate)
        crfa = np.array([expected_crfa(sampled, CUTOFF, HEIGHT, load) for load in LOADS])
        label = f"{quantity('record_rate_hz').text(rate)}: {_power('load', np.array(LOADS), crfa)}"
        axes.loglog(LOADS, crfa, line_style, color=colour, label=label)
    continuous = [continuous_crfa(model, CUTOFF, HEIGHT, load) for load in LOADS]
    axes.loglog(LOADS, continuous, color="black", linewidth=1.0, label="continuous: load^0")
    name_axes(axes, "load_n", "expected_crfa", title="CRFA over load: effect of sampling")
    _tick_at(axes, np.array(LOADS))
    legend_below(figure)
    return figure


def _tick_at(axes: Axes, positions: Field) -> None:
    axes.set_xticks(positions, [f"{value:g}" for value in positions])
    axes.set_xticks([], minor=True)


def _power(symbol: str, x: Field, values: Field) -> str:
    """Fit a power law to the values and return it as text, such as "load^−0.67"."""
    power = float(np.polyfit(np.log(x), np.log(values), 1)[0])
    number = f"{power:.2f}".replace("-0.00", "0").replace("-", "−")
    return f"{symbol}^{number}"
