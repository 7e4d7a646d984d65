"""What a contact resonance is: an oscillator's line in a spectrum with its deviations, or why there is none."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from asperity.core.arrays import Field


class SeenLine(Protocol):
    """What sampling makes of an oscillator's line."""

    def __call__(self, frequency_hz: Field, f0_hz: float, damping_ratio: float) -> Field:
        """A factor on the line at each frequency [Hz], 1 at f0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Resonance:
    """A contact resonance, or the reason why there is none.

    `crf_hz` is the oscillator's natural frequency f0 [Hz]; `crfa` the fitted line at f0 without
    the floor below it [(m/s^2)^2/Hz]; `crf_std`, `crfa_std` their standard deviations from the
    Fisher information. `damping_ratio` with its `damping_ratio_std`, and `floor`, the density at
    the lower and upper end of `band_hz`, complete the fitted curve; where more than a floor was
    fitted, `background` in its place: frequencies and densities. `evidence` is how much better, by
    BIC, a line and the rest explain the band than the rest alone (found needs 10, very strong).
    All of a line's figures are nan when it was not `found`; `reason` then says why. `seen` is how
    the record's sampling bends that line, where that was known. `crf_shared_std` is the part of
    `crf_std` that lines at this place have in common: what a structure brings does not average
    away over repeats. The paper's peak has no standard deviation, damping, floor or evidence: nan.
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
    seen: SeenLine | None = field(default=None, compare=False, repr=False)

    @property
    def crf_std_hz(self) -> float:
        """`crf_std`, under the name that tables and JSON give it [Hz]."""
        return self.crf_std

    def curve(self, frequency_hz: Field) -> Field:
        """Fitted density at `frequency_hz` (any shape): line and floor; the floor alone when nothing was found.

        nan everywhere for a method that fits no curve.
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
                if self.seen is None
                else line * self.seen(frequency_hz, self.crf_hz, self.damping_ratio)
            )
        return curve


NARROWEST = 4.0  # resolutions: a Hann window widens such a line by 6 %
MOST_TAKEN_OUT = 0.1
# standard deviation of a damping ratio over itself: more says hardly its order of magnitude
VAGUEST = 0.5


def damping_objection(
    resonance: Resonance, resolution_hz: float, *, taken_out: float = 0.0
) -> str | None:
    """Why a line's width is no damping ratio that one could follow; None where it is one.

    `resolution_hz` is the equivalent noise bandwidth of the spectrum [Hz], `taken_out` the share
    of the line's half-power width that was taken for tones and is missing from the spectrum.
    """
    if not resonance.found:
        return resonance.reason
    ratio, std = resonance.damping_ratio, resonance.damping_ratio_std
    if not np.isfinite(ratio):
        return f"the method {resonance.method} fits no width"
    if not np.isfinite(std):
        return "its width was fitted without a deviation"
    if std > VAGUEST * ratio:
        return f"its damping ratio is not known to half of itself ({ratio:.3f} ± {std:.3f})"
    width = 2.0 * ratio * resonance.crf_hz
    if width < NARROWEST * resolution_hz:
        return (
            f"a line {width:.1f} Hz wide is less than {NARROWEST:g} times the spectrum's resolution of "
            f"{resolution_hz:.1f} Hz; record for longer"
        )
    if taken_out > MOST_TAKEN_OUT:
        return f"{100 * taken_out:.0f} % of the line was taken out as tones, which leaves too wide a rest"
    return None


def line_shape(frequency_hz: Field, f0_hz: Field | float, damping_ratio: Field | float) -> Field:
    """Acceleration line of an oscillator that rides over white base acceleration, 1 at f = f0.

    T(f)/T(f0) with T = (f0^4 + (2ζ f0 f)^2) / ((f0^2 - f^2)^2 + (2ζ f0 f)^2), T(f0) = (1 +
    4ζ^2)/(4ζ^2). Roughness whose spectrum falls as f^-4 (a second-order low pass, far above its
    cut-off) is white base acceleration.
    """
    return _line_and_parts(frequency_hz, f0_hz, damping_ratio)[0]


def line_and_slopes(
    frequency_hz: Field, f0_hz: Field | float, damping_ratio: Field | float
) -> tuple[Field, Field, Field]:
    """The line L, dL/d(ln f0) and dL/d(ln ζ); shapes broadcast."""
    line, x2, squared, top, bottom = _line_and_parts(frequency_hz, f0_hz, damping_ratio)
    by_f0 = line * (
        (2.0 * squared * x2 - 4.0 * x2 * (1.0 - x2)) / bottom - 2.0 * squared * x2 / top
    )
    by_damping = line * (2.0 * squared * x2 * (1.0 / top - 1.0 / bottom) + 2.0 / (1.0 + squared))
    return line, by_f0, by_damping


def _line_and_parts(
    frequency_hz: Field, f0_hz: Field | float, damping_ratio: Field | float
) -> tuple[Field, Field, Field | float, Field, Field]:
    """The line L, (f/f0)^2, (2ζ)^2, and L's numerator and denominator."""
    x2 = (frequency_hz / f0_hz) ** 2
    squared = 4.0 * damping_ratio**2
    top, bottom = 1.0 + squared * x2, (1.0 - x2) ** 2 + squared * x2
    return squared / (1.0 + squared) * top / bottom, x2, squared, top, bottom


def no_resonance(reason: str, band_hz: tuple[float, float], method: str, **known: Any) -> Resonance:
    """A resonance that is not there, or that could not even be looked for, and why; what is `known` by field."""
    return Resonance(found=False, reason=reason, band_hz=band_hz, method=method, **known)


def fitted_resonance(line: Field, std: Field, **known: Any) -> Resonance:
    """The resonance of a fitted line: height, f0 and damping ratio with their deviations; the rest by field."""
    names = ("crfa", "crf_hz", "damping_ratio", "crfa_std", "crf_std", "damping_ratio_std")
    known |= zip(names, map(float, (*line, *std)), strict=True)
    return Resonance(found=True, **known)
