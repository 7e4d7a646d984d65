"""Contact resonance: an oscillator line in a spectrum and its errors, or why none was found."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from asperity.core.arrays import Field


class SamplingFactor(Protocol):
    """Effect of sampling on an oscillator line."""

    def __call__(self, frequency_hz: Field, f0_hz: float, damping_ratio: float) -> Field:
        """Return the factor on the line at each frequency [Hz], 1 at f0."""


@dataclass(frozen=True, slots=True)
class ExcitationShape:
    """Effect on an oscillator line of an excitation that is not white in acceleration.

    The ln of the factor is a polynomial in ln(f/f0), 0 at f0, with `coefficients` from the first
    power on. The first is the slope: 0 for a profile whose density falls as f^-4, 4 for one that is
    white in displacement and for a white force.
    """

    coefficients: tuple[float, ...]

    @property
    def remark(self) -> str:
        """Remark on a fitted excitation."""
        return (
            f"; the excitation falls as f^{self.coefficients[0] - 4.0:.1f} there, not as f^-4, and "
            "was fitted; state a known one as sampling_factor"
        )

    def __call__(self, frequency_hz: Field, f0_hz: float, damping_ratio: float) -> Field:  # noqa: ARG002
        """Return the factor on the line at each frequency [Hz], 1 at f0."""
        log = np.log(np.maximum(frequency_hz, 1e-6 * f0_hz) / f0_hz)
        return np.asarray(
            np.exp(
                np.clip(
                    np.polynomial.polynomial.polyval(log, (0.0, *self.coefficients)), -300.0, 300.0
                )
            )
        )

    def steepness(self, log: Field) -> Field:
        """Return the derivative of ln factor at ln(f/f0)."""
        orders = np.arange(1, len(self.coefficients) + 1)
        return np.asarray(np.polynomial.polynomial.polyval(log, orders * self.coefficients))


@dataclass(frozen=True, slots=True, kw_only=True)
class Resonance:
    """A contact resonance, or the reason why none was found.

    `crf_hz` is the oscillator's natural frequency f0 [Hz]; `crfa` the fitted line at f0 without the
    floor [(m/s^2)^2/Hz]; `crf_std`, `crfa_std` their standard deviations from the Fisher
    information. `damping_ratio`, its `damping_ratio_std`, and `floor`, the density at the lower and
    upper end of `band_hz`, complete the fitted curve; where more than a floor was fitted,
    `background` (frequencies, densities) replaces it. `evidence` is the BIC difference between the
    fits with and without the line (10, very strong, is required). All values of the line are nan
    when it was not `found`; `reason` then states why. `sampling_factor` is the effect of sampling
    on the line, where known. `crf_shared_std` is the part of `crf_std` that lines at the same place
    have in common: errors caused by a structure do not average out over repeats. The paper's peak
    has no standard deviation, damping, floor or evidence: nan.
    """

    found: bool
    reason: str
    band_hz: tuple[float, float]
    method: str
    crf_hz: float = np.nan
    crfa: float = np.nan
    crf_std: float = np.nan
    crf_shared_std: float = 0.0
    crfa_std: float = np.nan
    damping_ratio: float = np.nan
    damping_ratio_std: float = np.nan
    floor: tuple[float, float] = (np.nan, np.nan)
    evidence: float = np.nan
    background: tuple[Field, Field] | None = field(default=None, compare=False, repr=False)
    sampling_factor: SamplingFactor | None = field(default=None, compare=False, repr=False)

    @property
    def crf_std_hz(self) -> float:
        """`crf_std` under its name in tables and JSON [Hz]."""
        return self.crf_std

    def curve(self, frequency_hz: Field) -> Field:
        """Return the fitted density at `frequency_hz` (any shape): line and floor.

        The floor alone when no line was found; nan for a method that fits no curve.
        """
        low, high = self.band_hz
        if self.background is None:
            share = (frequency_hz - low) / (high - low)
            curve = self.floor[0] * (1.0 - share) + self.floor[1] * share
        else:
            curve = np.interp(frequency_hz, *self.background)
        if self.found:
            line = self.crfa * line_shape(frequency_hz, self.crf_hz, self.damping_ratio)
            curve = curve + (
                line
                if self.sampling_factor is None
                else line * self.sampling_factor(frequency_hz, self.crf_hz, self.damping_ratio)
            )
        return curve


FEWEST_RESOLUTIONS = 4.0  # that a line is wide: a Hann window then widens it by 6 %
LARGEST_TONE_SHARE = 0.1

LARGEST_RELATIVE_STD = 0.5


def damping_objection(
    resonance: Resonance, resolution_hz: float, *, taken_out: float = 0.0
) -> str | None:
    """Return the reason why a line's width does not determine its damping ratio, or None.

    Parameters
    ----------
    resolution_hz : equivalent noise bandwidth of the spectrum [Hz]
    taken_out : share of the line's half-power width that was removed as tones
    """
    if not resonance.found:
        return resonance.reason
    ratio = resonance.damping_ratio
    std = resonance.damping_ratio_std
    if not np.isfinite(ratio):
        return f"the method {resonance.method} fits no width"
    if not np.isfinite(std):
        return "its width was fitted without a standard deviation"
    if std > LARGEST_RELATIVE_STD * ratio:
        return f"its damping ratio is uncertain by more than half ({ratio:.3f} ± {std:.3f})"
    width = 2.0 * ratio * resonance.crf_hz
    if width < FEWEST_RESOLUTIONS * resolution_hz:
        return (
            f"a line {width:.1f} Hz wide is less than {FEWEST_RESOLUTIONS:g} times the spectrum's "
            f"resolution of {resolution_hz:.1f} Hz; record for longer"
        )
    if taken_out > LARGEST_TONE_SHARE:
        return (
            f"{100 * taken_out:.0f} % of the line was removed as tones, so its width is too large"
        )
    return None


def line_shape(frequency_hz: Field, f0_hz: Field | float, damping_ratio: Field | float) -> Field:
    """Return the acceleration line of an oscillator on white base acceleration, 1 at f = f0.

    T(f)/T(f0) with T = (f0^4 + (2ζ f0 f)^2) / ((f0^2 - f^2)^2 + (2ζ f0 f)^2), T(f0) = (1 +
    4ζ^2)/(4ζ^2). Roughness whose spectrum falls as f^-4 (a second-order low pass, far above its
    cut-off) is white base acceleration.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.resonance import line_shape
    >>> line_shape(np.array([400.0, 500.0, 600.0]), f0_hz=500.0, damping_ratio=0.05)
    array([0.07326733, 1.        , 0.04828637])
    """
    return _line_and_parts(frequency_hz, f0_hz, damping_ratio)[0]


def line_and_slopes(
    frequency_hz: Field, f0_hz: Field | float, damping_ratio: Field | float
) -> tuple[Field, Field, Field]:
    """Return the line L, dL/d(ln f0) and dL/d(ln ζ); shapes broadcast."""
    line, x2, squared, top, bottom = _line_and_parts(frequency_hz, f0_hz, damping_ratio)
    by_f0 = line * (
        (2.0 * squared * x2 - 4.0 * x2 * (1.0 - x2)) / bottom - 2.0 * squared * x2 / top
    )
    by_damping = line * (2.0 * squared * x2 * (1.0 / top - 1.0 / bottom) + 2.0 / (1.0 + squared))
    return line, by_f0, by_damping


def _line_and_parts(
    frequency_hz: Field, f0_hz: Field | float, damping_ratio: Field | float
) -> tuple[Field, Field, Field | float, Field, Field]:
    """Return the line L, (f/f0)^2, (2ζ)^2, and L's numerator and denominator."""
    x2 = (frequency_hz / f0_hz) ** 2
    squared = 4.0 * damping_ratio**2
    top = 1.0 + squared * x2
    bottom = (1.0 - x2) ** 2 + squared * x2
    return squared / (1.0 + squared) * top / bottom, x2, squared, top, bottom


def no_resonance(reason: str, band_hz: tuple[float, float], method: str, **known: Any) -> Resonance:
    """Return a resonance that was not found, or not looked for; `known` sets further fields."""
    return Resonance(found=False, reason=reason, band_hz=band_hz, method=method, **known)


def fitted_resonance(line: Field, std: Field, **known: Any) -> Resonance:
    """Return the resonance of a fitted line: height, f0, damping ratio, and their deviations.

    `known` sets the other fields.
    """
    names = ("crfa", "crf_hz", "damping_ratio", "crfa_std", "crf_std", "damping_ratio_std")
    known |= zip(names, map(float, (*line, *std)), strict=True)
    return Resonance(found=True, **known)
