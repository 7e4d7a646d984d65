"""CRF and CRFA of one spectrum, with standard deviations and a verdict.

The default is a Whittle (maximum-likelihood) fit of one oscillator line over a sloping floor; the
paper's smoothed highest point is available too. The caller states the search band;
`asperity.coupling` can predict it.
"""

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum, smooth
from asperity.resonance.band_fit import (
    STRONG_EVIDENCE,
    BandData,
    band_data,
    fit_floor,
    fit_line,
    fit_line_and_excitation,
    fit_modes,
    window_leakage,
)
from asperity.resonance.likelihood_fit import SpectrumFit, whittle_cost
from asperity.resonance.resonance import (
    ExcitationShape,
    Resonance,
    SamplingFactor,
    fitted_resonance,
    line_shape,
    no_resonance,
)

IndicatorMethod = Literal["likelihood", "modes", "peak"]

FEWEST_LINES = 20  # five parameters from fewer lines would be interpolation
PAPER_PASSES = 3  # "five-point triple smoothing"
MAX_MODE_BLOCKS = 600
# a second line with more than this share of the strongest line's power makes it ambiguous
AMBIGUOUS_POWER_SHARE = 0.5


@usual_float_errors
def contact_resonance(
    spectrum: Spectrum,
    *,
    band_hz: tuple[float, float],
    method: IndicatorMethod = "likelihood",
    sampling_factor: SamplingFactor | None = None,
) -> Resonance:
    """Find the contact resonance between the two ends of `band_hz` [Hz].

    Parameters
    ----------
    method : "likelihood" fits one oscillator line over a floor and tests it against the floor
        alone; "modes" fits as many lines as the spectrum needs and takes the strongest if it
        dominates; "peak" takes the highest point after the paper's smoothing, without a test
    sampling_factor : for "likelihood", the known effect of excitation and sampling on the line:
        `ExcitationShape((4.0,))` for a force or displacement that is white, or that of a simulated
        record (straight lines between samples, a digital noise filter). None: the excitation falls
        as f^-4 (white in acceleration) unless the spectrum contradicts it (BIC 10); then its slope
        is fitted, which `reason` states

    Raises
    ------
    BadInput
        for an unknown method, `sampling_factor` with another method than "likelihood", a band
        outside the spectrum or with fewer than 20 lines, a spectrum that is not finite, or a
        smoothed one where its statistics matter.

    Examples
    --------
    >>> from asperity.core.signals import power_spectrum
    >>> from asperity.resonance import contact_resonance
    >>> from asperity.vibration import ContactOscillator, FilteredNoise, acceleration
    >>> excitation = FilteredNoise(height=0.5e-6, cutoff_hz=100.0)
    >>> oscillator = ContactOscillator(mass=1.0, stiffness=1e7, damping_ratio=0.03)
    >>> signal = acceleration(oscillator, excitation.profile(200_000, 10_000.0, seed=1))
    >>> found = contact_resonance(power_spectrum(signal, segment=5000), band_hz=(300.0, 800.0))
    >>> f"{oscillator.natural_frequency_hz:.1f} Hz; {found.crf_hz:.1f} +- {found.crf_std:.1f} Hz"
    '503.3 Hz; 503.7 +- 0.4 Hz'
    """
    if method not in INDICATOR_METHODS:
        raise BadInput(
            f"indicator method must be one of {', '.join(INDICATOR_METHODS)}, got {method!r}"
        )
    inside = require_band(spectrum, band_hz)
    floor_at_ends = band_hz[0], band_hz[1]
    if sampling_factor is None:
        return INDICATOR_METHODS[method](spectrum, inside, floor_at_ends)
    if method != "likelihood":
        raise BadInput(
            f"sampling_factor applies to the method likelihood only, got {method!r}; omit it"
        )
    return _fit_most_likely_line(spectrum, inside, floor_at_ends, sampling_factor)


def require_band(spectrum: Spectrum, band_hz: tuple[float, float]) -> Mask:
    """Return the mask of the band's lines; BadInput where no resonance can be fitted there."""
    low, high = band_hz
    top = float(spectrum.frequency_hz[-1])
    if not 0.0 < low < high <= top:
        raise BadInput(
            f"resonance band must lie between 0 and {top:g} Hz, got {low:g} to {high:g} Hz; "
            f"change it"
        )
    inside = (spectrum.frequency_hz >= low) & (spectrum.frequency_hz <= high)
    lines = int(np.count_nonzero(inside))
    if lines < FEWEST_LINES:
        raise BadInput(
            f"resonance band {low:g} to {high:g} Hz holds {lines} spectral lines, a fit needs "
            f"{FEWEST_LINES}; lengthen the spectrum's segment or widen the band"
        )
    if not np.isfinite(spectrum.density[inside]).all():
        raise BadInput(f"spectrum must be finite from {low:g} to {high:g} Hz; repair the record")
    return inside


def _fit_highest_point(spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]) -> Resonance:
    """Smooth three times and take the highest point of the band (the paper's section 4.2)."""
    smoothed = smooth(spectrum, PAPER_PASSES)
    density = smoothed.density[inside]
    highest = int(np.argmax(density))
    if highest in (0, density.size - 1):
        return no_resonance(
            "the highest point is at the edge of the band: the peak lies outside", band_hz, "peak"
        )
    return Resonance(
        crf_hz=float(smoothed.frequency_hz[inside][highest]),
        crfa=float(density[highest]),
        crf_std=np.nan,
        crfa_std=np.nan,
        found=True,
        reason=f"highest point after {PAPER_PASSES} five-point smoothings, not tested against "
        f"chance",
        band_hz=band_hz,
        method="peak",
    )


def _objection(
    line: Field, std: Field, spectrum: Spectrum, band_hz: tuple[float, float]
) -> str | None:
    """Return the reason why a fitted line is not a resonance of this band, or None."""
    (low, high), f0_std = band_hz, float(std[1])
    _, f0, zeta = (float(value) for value in line)
    width = 2.0 * zeta * f0
    if not low + 3.0 * f0_std < f0 < high - 3.0 * f0_std:
        return f"the line peaks at or beyond the edge of the band {low:.0f} to {high:.0f} Hz"
    if width < spectrum.resolution_hz:
        return (
            f"the line at {f0:.0f} Hz is narrower than the spectrum resolves ({width:.2g} Hz wide, "
            f"resolution {spectrum.resolution_hz:.2g} Hz): a tone, or too short a segment"
        )
    if width > high - low:
        return (
            f"the line at {f0:.0f} Hz is wider than the band ({width:.0f} Hz): a slope, not "
            f"a resonance"
        )
    return None


def _fit_most_likely_line(
    spectrum: Spectrum,
    inside: Mask,
    band_hz: tuple[float, float],
    sampling_factor: SamplingFactor | None = None,
) -> Resonance:
    """Fit one oscillator line and accept it if the spectrum needs one."""
    band = band_data(spectrum, inside, band_hz)
    if band is None:
        return no_resonance("the band holds no vibration", band_hz, "likelihood")
    fit = fit_line(band, spectrum, band_hz, sampling_factor)
    evidence = band.evidence(fit, band.floor_only.cost)
    line = np.exp(fit.parameters[:3])
    std = fit.std[:3] * line
    if evidence < STRONG_EVIDENCE:
        objection: str | None = _below_floor(band_hz, evidence)
    elif not fit.converged:
        objection = "the fit did not converge"
    else:
        objection = _objection(line, std, spectrum, band_hz)
    if objection is not None:
        floor = band.floor_at_ends(band.floor_only.parameters)
        return no_resonance(objection, band_hz, "likelihood", floor=floor, evidence=evidence)
    fit, shape = (
        (fit, None) if sampling_factor else _with_free_excitation(band, spectrum, band_hz, fit)
    )
    line = np.exp(fit.parameters[:3])
    return fitted_resonance(
        line * band.scales,
        fit.std[:3] * line * band.scales,
        reason=f"a line {2.0 * line[2] * line[1]:.0f} Hz wide stands out above the floor (BIC "
        f"{evidence:+.0f}){'' if shape is None else shape.remark}",
        band_hz=band_hz,
        method="likelihood",
        floor=band.floor_at_ends(fit.parameters[-2:]),
        evidence=evidence,
        sampling_factor=sampling_factor or shape,
    )


def _with_free_excitation(
    band: BandData, spectrum: Spectrum, band_hz: tuple[float, float], fit: SpectrumFit
) -> tuple[SpectrumFit, ExcitationShape | None]:
    """Return the fit under a free excitation and its shape, or `fit` where f^-4 suffices."""
    free = fit_line_and_excitation(band, spectrum, band_hz, fit)
    line = np.exp(free.parameters[:3])
    if free is fit or _objection(line, free.std[:3] * line, spectrum, band_hz):
        return fit, None
    return free, ExcitationShape(tuple(map(float, free.parameters[3:-2])))


def _below_floor(band_hz: tuple[float, float], evidence: float) -> str:
    low, high = band_hz
    return (
        f"no line stands out above the floor between {low:.0f} and {high:.0f} Hz "
        f"(BIC {evidence:+.1f})"
    )


class _Modes(NamedTuple):
    """Fitted lines with their standard deviations, (modes, 3), and the index of the strongest."""

    lines: Field
    std: Field
    power: Field  # A ζ f0, proportional to the line's mean square
    strongest: int

    def background(
        self, band: BandData, floor: tuple[float, float], band_hz: tuple[float, float]
    ) -> Field:
        """Return the density of the floor and of all lines but the strongest."""
        low, high = band_hz
        density = floor[0] + (floor[1] - floor[0]) * (band.frequency - low) / (high - low)
        for height, *line in np.delete(self.lines, self.strongest, axis=0):
            density = density + band.scale * height * line_shape(band.frequency, *line)
        return density

    @property
    def description(self) -> str:
        """The strongest line in words."""
        count = len(self.lines)
        (_, f0, zeta) = self.lines[self.strongest]
        rest = f"; {count - 1} weaker" if count > 1 else ""
        return f"the strongest of {count} resonances, {2.0 * zeta * f0:.0f} Hz wide{rest}"

    def ambiguity(self) -> str | None:
        """Return why the strongest line may not be the contact's, or None."""
        rivals = self.power > AMBIGUOUS_POWER_SHARE * self.power[self.strongest]
        if np.count_nonzero(rivals) < 2:
            return None
        listed = ", ".join(f"{frequency:.0f}" for frequency in sorted(self.lines[rivals, 1]))
        return (
            f"lines at {listed} Hz have similar power: one spectrum cannot tell which is the "
            f"contact's"
        )


def _fitted_modes(fit: SpectrumFit) -> _Modes:
    lines = np.exp(fit.parameters[:-2]).reshape(-1, 3)
    power = np.prod(lines, axis=1)
    return _Modes(lines, fit.std[:-2].reshape(-1, 3) * lines, power, int(np.argmax(power)))


def _mode_band(
    spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]
) -> tuple[BandData, Field] | None:
    """Return the band in at most 600 blocks and its leakage; None without vibration."""
    band = band_data(spectrum, inside, band_hz)
    if band is None:
        return None
    size = -(-band.frequency.size // MAX_MODE_BLOCKS)
    if size == 1:
        return band, window_leakage(spectrum)
    # blocks are far narrower than a line but wider than the window's leakage
    band = band.block_averaged(size)
    floor_only = fit_floor(band.floors, band.data, band.floor_only.parameters)
    return band._replace(floor_only=floor_only), np.ones(1)


def _fit_strongest_mode(
    spectrum: Spectrum, inside: Mask, band_hz: tuple[float, float]
) -> Resonance:
    """Fit as many lines as the spectrum needs and accept the strongest if it dominates."""
    averaged = _mode_band(spectrum, inside, band_hz)
    if averaged is None:
        return no_resonance("the band holds no vibration", band_hz, "modes")
    band, leakage = averaged
    fit = fit_modes(band, band_hz, leakage)
    floor = band.floor_at_ends(fit.parameters[-2:])
    if fit.parameters.size == 2:
        evidence = band.evidence(fit, band.floor_only.cost)
        reason = _below_floor(band_hz, evidence)
        return no_resonance(reason, band_hz, "modes", floor=floor, evidence=evidence)
    modes = _fitted_modes(fit)
    line = modes.lines[modes.strongest]
    std = modes.std[modes.strongest]
    background = modes.background(band, floor, band_hz)
    evidence = band.evidence(fit, whittle_cost(background / band.scale, band.data))
    objection = _objection(line, std, spectrum, band_hz) or modes.ambiguity()
    if not fit.converged:
        objection = "the fit did not converge"
    if objection is not None:
        return no_resonance(objection, band_hz, "modes", floor=floor, evidence=evidence)
    return fitted_resonance(
        line * band.scales,
        std * band.scales,
        reason=modes.description,
        band_hz=band_hz,
        method="modes",
        floor=floor,
        evidence=evidence,
        background=(band.frequency, background),
    )


INDICATOR_METHODS: dict[
    IndicatorMethod, Callable[[Spectrum, Mask, tuple[float, float]], Resonance]
] = {"likelihood": _fit_most_likely_line, "modes": _fit_strongest_mode, "peak": _fit_highest_point}
