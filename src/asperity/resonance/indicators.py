"""CRF and CRFA: finding the contact resonance in a spectrum, with standard deviations and a verdict.

The default is a Whittle (maximum-likelihood) fit of one oscillator line over a sloping floor; the
paper's smoothed highest point is kept beside it. Where to look, the band, is the caller's to say:
`asperity.coupling` knows it.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum, smooth, taper
from asperity.resonance.likelihood_fit import Bounds, Data, Fit, Model, fit_spectrum, whittle_cost
from asperity.resonance.resonance import (
    Resonance,
    SeenLine,
    fitted_resonance,
    line_and_slopes,
    line_shape,
    no_resonance,
)

IndicatorMethod = Literal["likelihood", "modes", "peak"]

FEWEST_LINES = 20  # five parameters from fewer lines would be an interpolation, not a fit
STRONG_EVIDENCE = (
    10.0  # BIC difference, "very strong": Kass and Raftery, J. Am. Stat. Assoc. 90 (1995)
)
PAPER_PASSES = 3  # "five-point triple smoothing"
SMALLEST_DAMPING, LARGEST_DAMPING = 1e-5, 0.7  # above 0.7 an oscillator has no peak
MOST_MODES = 8
MODE_BLOCKS = 600
# a second line with more than this share of the strongest's power could be the contact's as well
AMBIGUOUS = 0.5
START_DAMPINGS = (0.002, 0.007, 0.02, 0.06)
SEEN_ROUNDS = (
    3  # what sampling makes of a line hardly depends on where it is: each round leaves a tenth
)
MOST_BLOCKS = 512  # for the search of a start only


def contact_resonance(
    spectrum: Spectrum,
    *,
    band_hz: tuple[float, float],
    method: IndicatorMethod = "likelihood",
    seen: SeenLine | None = None,
) -> Resonance:
    """Find the contact resonance between the two ends of `band_hz` [Hz].

    Parameters
    ----------
    method : "likelihood" fits one oscillator over a floor and tests it against the floor alone; "modes" fits as many
        as the spectrum needs and takes the strongest, if it is so by far; "peak" takes the highest point after the
        paper's smoothing, whatever it is
    seen : of "likelihood", what sampling makes of the line, where that is known: of a simulated record, whose profile
        is straight between samples and perhaps noise behind a digital filter. What a machine does knows no samples

    Raises
    ------
    BadInput
        for an unknown method, `seen` with another than "likelihood", a band outside the spectrum or with fewer than 20
        lines, a spectrum that is not finite, or a smoothed one where its statistics matter.
    """
    if method not in INDICATOR_METHODS:
        raise BadInput(
            f"indicator method must be one of {', '.join(INDICATOR_METHODS)}, got {method!r}"
        )
    inside = require_band(spectrum, band_hz)
    ends = band_hz[0], band_hz[1]
    if seen is None:
        return INDICATOR_METHODS[method](spectrum, inside, ends)
    if method != "likelihood":
        raise BadInput(
            f"a line as sampling leaves it is for the method likelihood, got {method!r}; leave seen out"
        )
    return _likeliest_line(spectrum, inside, ends, seen)


def require_band(spectrum: Spectrum, band_hz: tuple[float, float]) -> Mask:
    """Lines of the spectrum within the band; BadInput where a resonance cannot be looked for there."""
    low, high = band_hz
    top = float(spectrum.frequency_hz[-1])
    if not 0.0 < low < high <= top:
        raise BadInput(
            f"resonance band must lie between 0 and {top:g} Hz, got {low:g} to {high:g} Hz; change it"
        )
    inside = (spectrum.frequency_hz >= low) & (spectrum.frequency_hz <= high)
    lines = int(np.count_nonzero(inside))
    if lines < FEWEST_LINES:
        raise BadInput(
            f"resonance band {low:g} to {high:g} Hz holds {lines} spectral lines, a fit needs {FEWEST_LINES}; "
            "lengthen the spectrum's segment or widen the band"
        )
    if not np.isfinite(spectrum.density[inside]).all():
        raise BadInput(
            f"spectrum must be finite from {low:g} to {high:g} Hz, got some that is not; repair the record"
        )
    return inside


def _highest_point(spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]) -> Resonance:
    """The paper's section 4.2: smooth three times, take the highest point (here: of the band)."""
    smoothed = smooth(spectrum, PAPER_PASSES)
    density = smoothed.density[inside]
    highest = int(np.argmax(density))
    if highest in (0, density.size - 1):
        return no_resonance(
            "the highest point of the band is its edge: what is rising there lies outside",
            band_hz,
            "peak",
        )
    return Resonance(
        crf_hz=float(smoothed.frequency_hz[inside][highest]),
        crfa=float(density[highest]),
        crf_std=np.nan,
        crfa_std=np.nan,
        found=True,
        reason=f"highest point after {PAPER_PASSES} five-point smoothings, not tested against chance",
        band_hz=band_hz,
        method="peak",
    )


class _Band(NamedTuple):
    """What a fit works on: ordinates over their mean, the band's lines, the floor's two columns."""

    data: Data
    scale: float
    frequency: Field
    floors: Field
    floor_only: Fit

    @property
    def scales(self) -> Field:
        """Of a line's height, f0 and damping ratio."""
        return np.array([self.scale, 1.0, 1.0])

    @property
    def price(self) -> float:
        """Of the three parameters of a line, by BIC."""
        return 3.0 * float(np.log(max(self.data.weight * self.frequency.size, math.e)))

    def ends(self, floor: Field) -> tuple[float, float]:
        """The density of a fitted floor at both ends."""
        return self.scale * float(floor[0]), self.scale * float(floor[1])

    def averaged(self, size: int) -> "_Band":
        """The band in blocks of `size` lines, but for the floor alone."""
        count = self.frequency.size // size

        def mean(values: Field) -> Field:
            return np.asarray(
                values[: count * size].reshape(count, size, *values.shape[1:]).mean(axis=1)
            )

        data = Data(mean(self.data.density), self.data.weight * size)
        return self._replace(data=data, frequency=mean(self.frequency), floors=mean(self.floors))


def _band(spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]) -> _Band | None:
    """The band's ordinates and the floor alone; None for a band without any vibration."""
    if spectrum.smoothing_passes:
        raise BadInput(
            f"the likelihood fit needs an unsmoothed spectrum, got one smoothed {spectrum.smoothing_passes} times; "
            "pass the spectrum itself or take method='peak'"
        )
    low, high = band_hz
    frequency = spectrum.frequency_hz[inside]
    scale = float(np.mean(spectrum.density[inside]))
    if scale <= 0.0:
        return None
    data = Data(spectrum.density[inside] / scale, spectrum.averages)
    share = (frequency - low) / (high - low)
    floors = np.stack([1.0 - share, share], axis=1)
    return _Band(data, scale, frequency, floors, _floor_only(floors, data, np.ones(2)))


def _floor_only(floors: Field, data: Data, start: Field) -> Fit:
    any_floor = Bounds(np.zeros(2), np.full(2, np.inf))
    return fit_spectrum(lambda theta: (floors @ theta, floors), start, any_floor, data)


def _objection(
    f0: float, f0_std: float, zeta: float, spectrum: Spectrum, band_hz: tuple[float, float]
) -> str | None:
    """Why a fitted line is no resonance of this band."""
    low, high = band_hz
    width = 2.0 * zeta * f0
    if not low + 3.0 * f0_std < f0 < high - 3.0 * f0_std:
        return f"what stands out peaks at or beyond the edge of the band {low:.0f} to {high:.0f} Hz"
    if width < spectrum.resolution_hz:
        return (
            f"the line at {f0:.0f} Hz is narrower than the spectrum resolves ({width:.2g} Hz wide, resolution "
            f"{spectrum.resolution_hz:.2g} Hz): a tone, or too short a segment"
        )
    if width > high - low:
        return f"the line at {f0:.0f} Hz is wider than the band ({width:.0f} Hz): a slope, not a resonance"
    return None


def _likeliest_line(
    spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float], seen: SeenLine | None = None
) -> Resonance:
    """The oscillator line that makes the spectrum likeliest, if the spectrum needs one."""
    band = _band(spectrum, inside, band_hz)
    if band is None:
        return no_resonance("the band holds no vibration at all", band_hz, "likelihood")
    low, high = band_hz
    fit = _fit_line(band, spectrum, band_hz, seen)
    evidence = 2.0 * (band.floor_only.cost - fit.cost) - band.price
    line = np.exp(fit.parameters[:3])
    std = fit.std[:3] * line
    _, f0, zeta = (float(value) for value in line)
    if evidence < STRONG_EVIDENCE:
        objection: str | None = (
            f"nothing stands out of the floor between {low:.0f} and {high:.0f} Hz (BIC {evidence:+.1f})"
        )
    elif not fit.settled:
        objection = "the fit did not settle"
    else:
        objection = _objection(f0, float(std[1]), zeta, spectrum, band_hz)
    if objection is not None:
        floor = band.ends(band.floor_only.parameters)
        return no_resonance(objection, band_hz, "likelihood", floor=floor, evidence=evidence)
    return fitted_resonance(
        line * band.scales,
        std * band.scales,
        reason=f"a line {2.0 * zeta * f0:.0f} Hz wide stands out of the floor (BIC {evidence:+.0f})",
        band_hz=band_hz,
        method="likelihood",
        floor=band.ends(fit.parameters[3:]),
        evidence=evidence,
        seen=seen,
    )


def _strongest_mode(spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]) -> Resonance:
    """As many oscillator lines as the spectrum needs, fitted together; the strongest, if it is so by far."""
    band = _band(spectrum, inside, band_hz)
    if band is None:
        return no_resonance("the band holds no vibration at all", band_hz, "modes")
    low, high = band_hz
    leakage = _leakage(spectrum)
    size = -(-band.frequency.size // MODE_BLOCKS)
    if (
        size > 1
    ):  # blocks far narrower than a line lose nothing, and blur it more than the window does
        band, leakage = band.averaged(size), np.ones(1)
        band = band._replace(
            floor_only=_floor_only(band.floors, band.data, band.floor_only.parameters)
        )
    fit = _fit_modes(band, band_hz, leakage)
    count = (fit.parameters.size - 2) // 3
    floor = band.ends(fit.parameters[3 * count :])
    if count == 0:
        evidence = 2.0 * (band.floor_only.cost - fit.cost) - band.price
        reason = f"nothing stands out of the floor between {low:.0f} and {high:.0f} Hz (BIC {evidence:+.1f})"
        return no_resonance(reason, band_hz, "modes", floor=floor, evidence=evidence)
    lines = np.exp(fit.parameters[: 3 * count]).reshape(count, 3)
    deviations = fit.std[: 3 * count].reshape(count, 3) * lines
    power = np.prod(lines, axis=1)  # A ζ f0, but for a factor the line's mean square
    order = np.argsort(power)[::-1]
    strongest = int(order[0])
    _, f0, zeta = (float(value) for value in lines[strongest])
    others = np.delete(np.arange(count), strongest)
    beside = floor[0] + (floor[1] - floor[0]) * (band.frequency - low) / (high - low)
    for number in others:
        beside = beside + band.scale * lines[number, 0] * line_shape(
            band.frequency, *lines[number, 1:]
        )
    evidence = 2.0 * (whittle_cost(beside / band.scale, band.data) - fit.cost) - band.price
    objection = _objection(f0, float(deviations[strongest, 1]), zeta, spectrum, band_hz)
    if not fit.settled:
        objection = "the fit did not settle"
    if objection is None and count > 1 and power[order[1]] > AMBIGUOUS * power[strongest]:
        rivals = [number for number in order if power[number] > AMBIGUOUS * power[strongest]]
        places = ", ".join(f"{place:.0f}" for place in sorted(lines[rivals, 1]))
        objection = f"lines at {places} Hz are about as strong: one spectrum cannot tell which is the contact's"
    if objection is not None:
        return no_resonance(objection, band_hz, "modes", floor=floor, evidence=evidence)
    rest = f"; {count - 1} weaker beside it" if count > 1 else ""
    return fitted_resonance(
        lines[strongest] * band.scales,
        deviations[strongest] * band.scales,
        reason=f"the strongest of {count} resonances, {2.0 * zeta * f0:.0f} Hz wide{rest}",
        band_hz=band_hz,
        method="modes",
        floor=floor,
        evidence=evidence,
        background=(band.frequency, beside),
    )


def _fit_modes(band: _Band, band_hz: tuple[float, float], leakage: Field) -> Fit:
    """Lines added one by one where the spectrum is farthest above the fit, all fitted anew, while BIC says so."""
    low, high = band_hz
    best, model = band.floor_only, _lines_model(band.frequency, band.floors, leakage)
    spacing = (band.frequency[-1] - band.frequency[0]) / (band.frequency.size - 1)
    for count in range(1, MOST_MODES + 1):
        expected = model(best.parameters)[0]
        trials = []
        for zeta in START_DAMPINGS:
            width = min(
                max(1, round(2.0 * zeta * 0.5 * (low + high) / spacing)), band.frequency.size // 4
            )
            excess = (
                scipy.ndimage.uniform_filter1d(band.data.density / expected, width, mode="nearest")
                - 1.0
            )
            at = int(np.argmax(excess * np.sqrt(width)))
            level = max(float(excess[at] * expected[at]), 1e-3)
            added = np.array([np.log(level), np.log(band.frequency[at]), np.log(zeta)])
            start = np.concatenate([best.parameters[:-2], added, best.parameters[-2:]])
            trials.append(fit_spectrum(model, start, _bounds(count, band_hz), band.data))
        trial = min(trials, key=lambda fit: fit.cost)
        if 2.0 * (best.cost - trial.cost) < band.price + STRONG_EVIDENCE:
            break
        best = trial
    return best


def _bounds(lines: int, band_hz: tuple[float, float]) -> Bounds:
    """Of (ln level, ln f0, ln ζ) of each line, and of the floor at the band's low and high end."""
    low, high = band_hz
    return Bounds(
        np.array([-30.0, np.log(0.9 * low), np.log(SMALLEST_DAMPING)] * lines + [0.0, 0.0]),
        np.array([30.0, np.log(1.1 * high), np.log(LARGEST_DAMPING)] * lines + [np.inf, np.inf]),
    )


def _lines_model(
    frequency: Field, floors: Field, leakage: Field, factor: Callable[[Field], Field] | None = None
) -> Model:
    """Expected density and slopes of any number of lines, as the window shows them, over the floor.

    `factor` on the lines, of frequency, is held.
    """
    reach = leakage.size // 2
    spacing = (frequency[-1] - frequency[0]) / (frequency.size - 1)
    wide = frequency[0] + spacing * np.arange(-reach, frequency.size + reach)
    bent = None if factor is None else factor(wide)

    def model(theta: Field) -> tuple[Field, Field]:
        level, f0, zeta = np.exp(theta[:-2].reshape(-1, 3, 1)).transpose(1, 0, 2)
        parts = level[:, None] * np.stack(
            line_and_slopes(wide, f0, zeta), axis=1
        )  # (lines, 3, frequencies)
        if bent is not None:
            parts = parts * bent
        if reach:
            blurred = [np.convolve(part, leakage, "valid") for part in parts.reshape(-1, wide.size)]
            parts = np.reshape(blurred, (*parts.shape[:2], frequency.size))
        expected = parts[:, 0].sum(axis=0) + floors @ theta[-2:]
        return expected, np.concatenate([parts.reshape(-1, frequency.size), floors.T]).T

    return model


INDICATOR_METHODS: dict[
    IndicatorMethod, Callable[[Spectrum, Mask, tuple[float, float]], Resonance]
] = {
    "likelihood": _likeliest_line,
    "modes": _strongest_mode,
    "peak": _highest_point,
}


def _fit_line(
    band: _Band, spectrum: Spectrum, band_hz: tuple[float, float], seen: SeenLine | None
) -> Fit:
    """Line and floor, started from blocks of the spectrum at several widths.

    The likelihood has a side maximum at every scatter peak.
    """
    bounds = _bounds(1, band_hz)
    blocks = band.averaged(-(-band.frequency.size // MOST_BLOCKS))
    model = _lines_model(blocks.frequency, blocks.floors, np.ones(1))
    starts = _starts(blocks.frequency, blocks.data.density)
    best = min(
        (fit_spectrum(model, start, bounds, blocks.data) for start in starts),
        key=lambda fit: fit.cost,
    )
    leakage = _leakage(spectrum)
    if seen is None:
        return fit_spectrum(
            _lines_model(band.frequency, band.floors, leakage), best.parameters, bounds, band.data
        )
    for _ in range(SEEN_ROUNDS):
        at_f0, at_zeta = (float(value) for value in np.exp(best.parameters[1:3]))
        factor = partial(seen, f0_hz=at_f0, damping_ratio=at_zeta)
        best = fit_spectrum(
            _lines_model(band.frequency, band.floors, leakage, factor),
            best.parameters,
            bounds,
            band.data,
        )
    return best


def _starts(frequency: Field, density: Field) -> list[Field]:
    """One start for each of several widths: the highest place of the spectrum averaged over that width."""
    spacing = (frequency[-1] - frequency[0]) / (frequency.size - 1)
    starts = []
    for zeta in START_DAMPINGS:
        width = max(1, round(2.0 * zeta * float(np.mean(frequency)) / spacing))
        averaged = scipy.ndimage.uniform_filter1d(
            density, min(width, density.size // 4), mode="nearest"
        )
        floor = float(np.quantile(averaged, 0.2)) / 2.0
        highest = int(np.argmax(averaged))
        level = np.log(max(averaged[highest] - floor, 1e-3))
        starts.append(np.array([level, np.log(frequency[highest]), np.log(zeta), floor, floor]))
    return starts


def _leakage(spectrum: Spectrum) -> Field:
    """What the window spreads over the lines around one; sums to 1. Exact for a spectrum smooth between lines."""
    if spectrum.window == "boxcar":
        return np.ones(1)
    weights = taper(spectrum.window, spectrum.segment)
    half = min(8, (spectrum.segment - 1) // 2)
    power = np.abs(scipy.fft.rfft(weights)[: half + 1]) ** 2
    near = np.concatenate([power[:0:-1], power]) / (
        weights.size * float(weights @ weights)
    )  # Parseval
    reach = int(np.flatnonzero(near[half:] > 1e-4)[-1])
    near = near[half - reach : half + reach + 1]
    return np.asarray(near / near.sum())
