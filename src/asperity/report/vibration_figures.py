"""The figures of the vibration model: the paper's Figs 3 and 4 and its Table 1, ours beside the printed values.

Each function returns a matplotlib Figure; `write_png` puts one on disk. Display units begin here and end here.
"""

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.arrays import Field
from asperity.coupling import Vibration, VibrationModel
from asperity.errors import BadInput
from asperity.files import whole_file
from asperity.paper import Table1Row, continuous_crfa, expected_crfa
from asperity.report.figures import BLUE, GREEN, GREY, MICRO, STYLE, VERMILION
from asperity.signals import Signal, power_spectrum
from asperity.vibration import mass_motion, white_noise

RATES = (10e3, 20e3, 50e3, 200e3)  # Hz
SHOWN = 0.5  # seconds of a record: more is a black bar
LOADS = (100.0, 200.0, 300.0, 400.0)
HEIGHT, CUTOFF = 2e-6, 30.0  # of Table 1's first four rows


def write_png(figure: Figure, path: Path) -> Path:
    """Write the figure, whole or not at all, and return the path."""
    with whole_file(path) as part, matplotlib.rc_context(STYLE):
        figure.savefig(part, format="png", dpi=160, metadata={"Software": None})
    return path


def excitation_figure(heard: Vibration, model: VibrationModel) -> Figure:
    """White noise, its spectrum, the profile and its spectrum: the paper's Fig 3.

    Raises BadInput for a contact that no asperity touches.
    """
    if heard.profile is None:
        raise BadInput(f"there is no profile to draw: {heard.resonance.reason}")
    profile = heard.profile
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 5.6), layout="constrained")
        (a, b), (c, d) = figure.subplots(2, 2)
        noise = Signal(white_noise(profile.values.size, model.seed), profile.rate_hz, "m")
        _draw_record(a, noise, "(a) white noise, before any coefficient", "height [m]", 1.0, GREY)
        _draw_spectrum(b, noise, "(b) its spectrum", "density [m²/Hz]", GREY)
        b.axhline(2.0 / profile.rate_hz, color="black", linestyle="--", linewidth=1.0, label="2 / rate")
        _draw_record(c, profile, f"(c) profile, {model.excitation.label}", "height [µm]", MICRO, BLUE)
        _draw_spectrum(d, profile, "(d) its spectrum", "density [m²/Hz]", BLUE)
        if heard.oscillator is not None and heard.expected is not None:
            f = heard.expected.frequency_hz[1:]
            gain = heard.oscillator.sampled_gain(f, profile.rate_hz)
            d.loglog(f, heard.expected.density[1:] / gain, "--", color="black", linewidth=1.0, label="closed form")
        d.set_ylim(1e-11 * float(np.max(power_spectrum(profile).density)), None)
        for axes in (b, d):
            axes.legend(loc="lower left")
    return figure


def response_figure(heard: Vibration, model: VibrationModel) -> Figure:
    """Displacement, velocity, acceleration and the acceleration's spectrum: the paper's Fig 4.

    Raises BadInput for a contact that no asperity touches.
    """
    if heard.profile is None or heard.oscillator is None or heard.spectrum is None or heard.expected is None:
        raise BadInput(f"there is no response to draw: {heard.resonance.reason}")
    rate = heard.profile.rate_hz
    moved = mass_motion(heard.oscillator, heard.profile, method=model.response, substeps=model.substeps)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 5.6), layout="constrained")
        (a, b), (c, d) = figure.subplots(2, 2)
        _draw_record(a, Signal(moved.displacement, rate, "m"), "(a) displacement", "y [µm]", MICRO, BLUE)
        _draw_record(b, Signal(moved.velocity, rate, "m"), "(b) velocity", "y′ [mm/s]", 1e3, GREEN)
        _draw_record(c, Signal(moved.acceleration, rate, "m"), "(c) acceleration", "y″ [m/s²]", 1.0, VERMILION)

        f0 = heard.oscillator.natural_frequency_hz
        near = np.abs(heard.spectrum.frequency_hz / f0 - 1.0) < 0.1
        f = heard.spectrum.frequency_hz[near]
        d.plot(f, heard.spectrum.density[near], color=GREY, linewidth=0.7, label="raw periodogram")
        d.plot(f, heard.expected.density[near], color="black", linewidth=1.2, label="closed form")
        found = heard.resonance
        if found.found:
            d.plot(
                found.crf_hz, found.crfa, "o", color=VERMILION,
                label=f"CRF {found.crf_hz:.1f} Hz, CRFA {found.crfa:.3g}",
            )  # fmt: skip
        d.axvline(f0, color=BLUE, linestyle=":", linewidth=1.2, label=f"f0 {f0:.1f} Hz")
        d.set(xlabel="frequency [Hz]", ylabel="density [(m/s²)²/Hz]", title="(d) spectrum of the acceleration")
        d.set_ylim(0.0, None)
        d.legend(loc="upper right" if found.found and found.crf_hz < f0 else "upper left")
    return figure


def table1_figure(rows: list[Table1Row]) -> Figure:
    """CRFA over load, height and cut-off: the printed values, and the median and 5 to 95 % range of our records."""
    parts = (
        (rows[:4], [row.load_n for row in rows[:4]], "load [N]"),
        (rows[4:8], [row.height_m * MICRO for row in rows[4:8]], "profile height [µm]"),
        (rows[8:], [row.cutoff_hz for row in rows[8:]], "cut-off [Hz]"),
    )
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 3.9), layout="constrained")
        for axes, (part, x, label) in zip(figure.subplots(1, 3), parts, strict=True):
            median = np.array([row.crfa for row in part])
            reach = np.array([[row.crfa - row.crfa_low for row in part], [row.crfa_high - row.crfa for row in part]])
            axes.errorbar(
                x, median, reach, fmt="o", color=BLUE, capsize=5, label="ours: median, 5 to 95 % of single records"
            )
            axes.plot(x, [row.paper_crfa for row in part], "x", color=VERMILION, markersize=9, label="printed")
            power = float(np.polyfit(np.log(x), np.log(median), 1)[0])
            axes.set(xscale="log", yscale="log", xlabel=label, title=f"median ~ {_power(label, power)}")
            axes.set_xticks(x, [f"{value:g}" for value in x])
            axes.set_xticks([], minor=True)
        figure.get_axes()[0].set_ylabel("CRFA [(m/s²)²/Hz]")
        keys, labels = figure.get_axes()[0].get_legend_handles_labels()
        figure.legend(keys, labels, loc="outside lower center", ncols=2)
    return figure


def load_trend_figure(model: VibrationModel) -> Figure:
    """CRFA over load at several sampling rates, in closed form: what of the paper's trend is sampling, what physics."""
    strokes = (("-o", VERMILION), ("--s", BLUE), ("-.^", GREEN), (":D", GREY))
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(5.6, 4.4), layout="constrained")
        axes = figure.add_subplot()
        for (stroke, colour), rate in zip(strokes, RATES, strict=True):
            sampled = replace(model, rate_hz=rate)
            crfa = [expected_crfa(sampled, CUTOFF, HEIGHT, load) for load in LOADS]
            power = float(np.polyfit(np.log(LOADS), np.log(crfa), 1)[0])
            axes.loglog(LOADS, crfa, stroke, color=colour, label=f"{rate * 1e-3:g} kHz: {_power('load', power)}")
        continuous = [continuous_crfa(model, CUTOFF, HEIGHT, load) for load in LOADS]
        axes.loglog(LOADS, continuous, color="black", linewidth=1.0, label="not sampled: load^0")
        axes.set_xticks(LOADS, [f"{load:g}" for load in LOADS])
        axes.set_xticks([], minor=True)
        axes.set(xlabel="load [N]", ylabel="expected CRFA [(m/s²)²/Hz]", title="CRFA falls with load: the sampling")
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def _power(label: str, power: float) -> str:
    number = f"{power:.2f}".replace("-0.00", "0").replace("-", "−")
    return f"{label.split(' [')[0].split()[-1]}^{number}"


def _draw_record(axes: Axes, record: Signal, title: str, label: str, scale: float, colour: str) -> None:
    shown = record.values[: max(2, round(SHOWN * record.rate_hz))]
    axes.plot(np.arange(shown.size) / record.rate_hz, shown * scale, color=colour, linewidth=0.6)
    axes.set(xlabel="time [s]", ylabel=label, title=title)
    axes.margins(x=0.0)


def _draw_spectrum(axes: Axes, record: Signal, title: str, label: str, colour: str) -> None:
    spectrum = power_spectrum(record)
    frequency, density = _thinned(spectrum.frequency_hz[2:], spectrum.density[2:])
    axes.loglog(frequency, density, color=colour, linewidth=0.7, label="one record")
    axes.set(xlabel="frequency [Hz]", ylabel=label, title=title)


def _thinned(frequency: Field, density: Field, lines: int = 1200) -> tuple[Field, Field]:
    """Means over bins of equal width on a logarithmic axis, where there are more lines than a figure can show."""
    edges = np.unique(np.searchsorted(frequency, np.geomspace(frequency[0], frequency[-1], lines)))
    width = np.diff([*edges, frequency.size])
    return np.add.reduceat(frequency, edges) / width, np.add.reduceat(density, edges) / width
