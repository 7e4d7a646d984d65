"""The figures of a tracked series: trend, load share, waterfall, one spectrum with its fit and the lines taken out."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from asperity.arrays import Field
from asperity.errors import BadInput
from asperity.report.figures import BLUE, GREY, VERMILION, WIDTH, mean_of_neighbours, styled
from asperity.tracking import ALERT, DANGER
from asperity.wear import INTERVAL

if TYPE_CHECKING:
    from asperity.tracking import Track, TrackedRecording

MOST_ROWS = 400  # of a waterfall; more recordings are thinned out
SEVERITY = LinearSegmentedColormap.from_list("severity", ["#0072b2", "#e69f00", "#d55e00"])


def x_label(track: "Track") -> str:
    """The axis of the series: sq_um as Sq [µm], time_h as time [h]."""
    name, separator, unit = track.x_name.rpartition("_")
    units = {"um": "µm", "h": "h", "s": "s", "min": "min", "d": "d", "mm": "mm", "nm": "nm", "m": "m", "km": "km"}
    if separator and unit in units:
        return f"{'Sq' if name == 'sq' else name.replace('_', ' ')} [{units[unit]}]"
    return {"recording": "number"}.get(track.x_name, track.x_name)


@styled()
def trend(track: "Track") -> Figure:
    """CRF with 90 % intervals over x, the break with its interval; below it the probability of the severe stage.

    Raises
    ------
    BadInput
        for a series in which no resonance was found.
    """
    found = [one for one in track.recordings if one.resonance.found]
    if not found:
        raise BadInput("there is no trend to draw: no contact resonance was found")
    figure = Figure(figsize=(WIDTH * 1.9, 4.6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    _mark_break(above, track)
    _draw_crf(above, found)
    if track.target.full_load_crf_hz is not None:
        full = track.target.full_load_crf_hz
        above.axhline(full, color="black", linestyle=":", linewidth=1.0, label="all load on asperities")
    missing = [one.x for one in track.recordings if not one.resonance.found]
    if missing:
        above.plot(
            missing, np.full(len(missing), 0.02), "x", color=GREY, transform=above.get_xaxis_transform(),
            label="not found, or not usable",
        )  # fmt: skip
    above.set(ylabel="CRF [Hz]", title="Contact resonance frequency")
    _mark_break(below, track, labelled=False)
    severe = [(one.x, one.severe_probability) for one in track.recordings if np.isfinite(one.severe_probability)]
    below.plot([x for x, _ in severe], [p for _, p in severe], "o", color=VERMILION, markersize=4)
    for threshold, name in ((ALERT, "alert"), (DANGER, "alarm")):
        below.axhline(threshold, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
        below.annotate(
            name, (1.0, threshold), xycoords=("axes fraction", "data"), fontsize=8, color=GREY, ha="right", va="bottom"
        )
    below.set(ylim=(-0.05, 1.12), xlabel=x_label(track), ylabel="severe", yticks=(0.0, 0.5, 1.0))
    figure.legend(loc="outside lower center", ncols=4)
    return figure


def _draw_crf(axes: Axes, found: "list[TrackedRecording]") -> None:
    x = np.array([one.x for one in found])
    crf = np.array([one.resonance.crf_hz for one in found])
    reach = INTERVAL * np.array([one.resonance.crf_std for one in found])
    sideways = INTERVAL * np.array([one.x_std for one in found])
    axes.errorbar(
        x, crf, yerr=np.where(np.isfinite(reach), reach, 0.0), xerr=sideways if sideways.any() else None, fmt="none",
        ecolor=GREY, elinewidth=0.9, capsize=2, zorder=1, label="90 % interval",
    )  # fmt: skip
    colours = [SEVERITY(0.0 if np.isnan(one.severe_probability) else one.severe_probability) for one in found]
    axes.scatter(x, crf, c=colours, s=22, zorder=2, edgecolors="white", linewidths=0.4, label="CRF")


def _mark_break(axes: Axes, track: "Track", *, labelled: bool = True) -> None:
    stages = track.stages
    if stages is None or not stages.found:
        return
    axes.axvspan(*stages.interval, color="#f2e3c6", linewidth=0, zorder=0, label="break, 90 %" if labelled else None)
    axes.axvline(stages.split, color="#8a5a00", linewidth=1.0, zorder=0)


@styled()
def amplitude(track: "Track") -> Figure:
    """CRFA over x, logarithmic, with 90 % intervals."""
    found = [one for one in track.recordings if one.resonance.found and one.resonance.crfa > 0.0]
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    _mark_break(axes, track)
    crfa = np.array([one.resonance.crfa for one in found])
    std = np.array([one.resonance.crfa_std for one in found])
    factor = np.exp(INTERVAL * np.where(np.isfinite(std), std, 0.0) / crfa) if found else crfa
    axes.errorbar(
        [one.x for one in found], crfa, yerr=[crfa - crfa / factor, crfa * factor - crfa], fmt="s", color=BLUE,
        ecolor=GREY, elinewidth=0.9, capsize=2, markersize=4, label="CRFA with 90 % interval",
    )  # fmt: skip
    unit = "(m/s²)²/Hz" if track.comparable else "unit²/Hz, not comparable"
    axes.set(yscale="log", xlabel=x_label(track), ylabel=f"CRFA [{unit}]", title="Contact resonance amplitude")
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled()
def asperity_load_share(track: "Track") -> Figure:
    """CLR read off the CRF, with 90 % intervals, over x."""
    found = [one for one in track.recordings if np.isfinite(one.clr)]
    figure = Figure(figsize=(WIDTH, 3.1), layout="constrained")
    axes = figure.add_subplot()
    _mark_break(axes, track)
    clr = 100.0 * np.array([one.clr for one in found])
    ends = 100.0 * np.array([one.clr_interval for one in found]).reshape(-1, 2)
    axes.errorbar(
        [one.x for one in found], clr, yerr=[clr - ends[:, 0], ends[:, 1] - clr], fmt="o", color=VERMILION,
        ecolor=GREY, elinewidth=0.9, capsize=2, markersize=4, label="CLR as the model reads it",
    )  # fmt: skip
    axes.axhline(100.0, color="black", linestyle=":", linewidth=1.0)
    axes.set(xlabel=x_label(track), ylabel="load on asperities [%]", title="Load share, read off the CRF")
    axes.set_ylim(bottom=0.0)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled()
def waterfall(track: "Track") -> Figure:
    """The spectra of all recordings around the band, one a row, lines taken out, with the resonances found in them.

    Raises
    ------
    BadInput
        for a series without a spectrum.
    """
    drawn = [one for one in track.recordings if one.clean is not None]
    if not drawn:
        raise BadInput("there is no waterfall to draw: no recording could be used")
    drawn = drawn[:: -(-len(drawn) // MOST_ROWS)]
    frequency, inside = _around(track)
    together = max(1, int(np.count_nonzero(inside)) // 480)
    rows = np.array(
        [mean_of_neighbours(one.clean.spectrum.density[inside], together) for one in drawn if one.clean is not None]
    )
    shown = mean_of_neighbours(frequency[inside], together)
    levels = 10.0 * np.log10(np.maximum(rows, 1e-300))
    levels -= np.median(levels, axis=1, keepdims=True)
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    axes = figure.add_subplot()
    reach = float(np.quantile(np.abs(levels), 0.995)) or 1.0
    image = axes.imshow(
        levels, aspect="auto", origin="lower", cmap="cividis", vmin=-0.6 * reach, vmax=reach, interpolation="none",
        extent=(shown[0], shown[-1], 0.5, len(drawn) + 0.5),
    )  # fmt: skip
    found = [(one.resonance.crf_hz, number) for number, one in enumerate(drawn, 1) if one.resonance.found]
    axes.plot(
        [crf for crf, _ in found], [number for _, number in found], "o", markerfacecolor="none", color="white",
        markersize=4.5, markeredgewidth=0.9, label="CRF",
    )  # fmt: skip
    for end in track.target.band_hz:
        axes.axvline(end, color="white", linewidth=0.9, linestyle=(0, (4, 3)))
    axes.set(xlabel="frequency [Hz]", ylabel=f"recording, by {x_label(track)}", title="Spectra of the series")
    axes.set_xlim(shown[0], shown[-1])
    places = sorted({0, len(drawn) // 4, len(drawn) // 2, 3 * len(drawn) // 4, len(drawn) - 1})
    axes.set_yticks([place + 1 for place in places], [f"{drawn[place].x:.3g}" for place in places])
    axes.spines[:].set_visible(False)
    figure.colorbar(image, ax=axes, label="level over the recording's median [dB]", location="bottom", shrink=0.8)
    return figure


@styled()
def spectrum_with_fit(track: "Track", one: "TrackedRecording") -> Figure:
    """One recording's spectrum around the band: the fit, its CRF, and the lines of shafts and mains taken out.

    Raises
    ------
    BadInput
        for a recording without a spectrum.
    """
    if one.clean is None or one.reading.spectrum is None:
        raise BadInput(f"{one.file} has no spectrum to draw: {one.resonance.reason}")
    frequency, inside = _around(track)
    low, high = track.target.band_hz
    together = max(1, int(np.count_nonzero(inside)) // 700)
    shown = mean_of_neighbours(frequency[inside], together)
    original = _largest_of_neighbours(one.reading.spectrum.density[inside], together)
    clean = mean_of_neighbours(one.clean.spectrum.density[inside], together)
    figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
    axes = figure.add_subplot()
    axes.axvspan(low, high, facecolor="#e8eef4", edgecolor=GREY, linewidth=0.7, label="band searched")
    axes.semilogy(shown, original, color="#e3b9a0", linewidth=0.6, label="as recorded (peaks)")
    axes.semilogy(shown, clean, color=GREY, linewidth=0.8, label="lines taken out (mean)")
    lines = [line.frequency_hz for line in one.clean.removed if shown[0] <= line.frequency_hz <= shown[-1]]
    axes.plot(
        lines, np.full(len(lines), 0.985), "|", color=VERMILION, markersize=5, markeredgewidth=0.6,
        transform=axes.get_xaxis_transform(), label=f"{len(lines)} lines of shafts and mains",
    )  # fmt: skip
    curve = one.resonance.curve(shown)
    within = (shown >= low) & (shown <= high) & (curve > 0.0)
    if np.isfinite(curve[within]).any():
        axes.semilogy(shown[within], curve[within], color=BLUE, label="fit" if one.resonance.found else "fit, no line")
    title = "no resonance found"
    if one.resonance.found:
        axes.axvline(one.resonance.crf_hz, color=BLUE, linestyle="--", linewidth=1.0, label="CRF")
        title = f"CRF {one.resonance.crf_hz:.1f} Hz"
    unit = "(m/s²)²/Hz" if track.comparable else one.reading.spectrum.unit
    axes.set(xlabel="frequency [Hz]", ylabel=f"density [{unit}]", title=f"One spectrum: {title}")
    axes.set_xlim(shown[0], shown[-1])
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def _around(track: "Track") -> tuple[Field, Any]:
    """The frequencies of the series, and which of them lie in the band or near it."""
    first = next(one.reading.spectrum for one in track.recordings if one.clean is not None)
    assert first is not None
    low, high = track.target.band_hz
    margin = 0.3 * (high - low)
    frequency = first.frequency_hz
    return frequency, (frequency >= max(low - margin, 0.0)) & (frequency <= high + margin)


def _largest_of_neighbours(values: Field, together: int) -> Field:
    whole = values.size // together * together
    return np.asarray(values[:whole].reshape(-1, together).max(axis=1))
