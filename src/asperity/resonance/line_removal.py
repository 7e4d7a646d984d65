"""Lines of shafts and mains in a spectrum: found, named, and taken out before anything is fitted.

A tone is a few lines wide and stands above its neighbours by more than chance; a resonance is
many. Whose tone it is follows from speeds, which are given or found in the tones themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, require_positive
from asperity.core.signals import Spectrum

MAINS_HZ = (50.0, 60.0)
# false tones in the whole spectrum; at the harmonics of a known speed the same in each comb of them
CHANCE = 1e-2
NEIGHBOURS = 20  # lines to either side whose median is the level below a tone
REACH = 8  # lines to either side that a tone may smear over; what is wider is left standing
CORE = 3  # lines to either side that a Hann taper spreads any tone over
SPEED_ERROR = 2e-3  # relative, of a given speed: it is put right by the tones themselves
FEWEST_HARMONICS = 5  # tones that a speed must explain to be found
SLOWEST_HZ, FASTEST_HZ = 4.0, 500.0  # shafts looked for
SEPARATE = (
    5.0  # spectral lines between neighbouring harmonics, below which a comb explains anything
)
MOST_PROMISING = 40  # speeds of all that pairs of tones suggest
SURE = 1e-6  # chance of as many tones on a comb that is not there, all combs tried counted


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A tone taken out: its frequency [Hz], its mean square [unit^2], and whose it is: "57 x 56.25 Hz" or "unknown"."""

    frequency_hz: float
    mean_square: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CleanSpectrum:
    """A spectrum without its tones.

    `spectrum` has the level beside them in their place; `kept`, shape (lines,), the lines that
    were left alone; `removed` what was taken out, by frequency; `speeds_hz` the shafts and the
    mains that explain tones, put right by them.
    """

    spectrum: Spectrum
    kept: Mask
    removed: tuple[Line, ...]
    speeds_hz: tuple[float, ...]


def remove_lines(
    spectrum: Spectrum,
    *,
    shaft_hz: Sequence[float] | None = None,
    band_hz: tuple[float, float] | None = None,
) -> CleanSpectrum:
    """Take the tones out of a spectrum.

    Parameters
    ----------
    shaft_hz : speeds of the shafts [Hz], to name tones by and to find weak ones at their harmonics; None finds them
        in the tones. The mains, 50 or 60 Hz, are looked for in any case. No tone is
        found among the first and last 20 lines
    band_hz : take tones out of this band only; speeds are judged by the tones of the whole spectrum all the same

    Raises
    ------
    BadInput
        for a speed that is not positive, a smoothed spectrum, one of fewer than 50 lines or with values that are not
        finite.
    """
    for speed in shaft_hz or ():
        require_positive("shaft speed", speed, "Hz")
    if spectrum.smoothing_passes:
        raise BadInput(
            f"lines are taken out of an unsmoothed spectrum, got one smoothed {spectrum.smoothing_passes} times"
        )
    if spectrum.density.size <= 2 * NEIGHBOURS + 10:
        raise BadInput(
            f"a spectrum of {spectrum.density.size} lines is too short to tell tones; lengthen the spectrum's segment"
        )
    if not np.isfinite(spectrum.density).all():
        raise BadInput(
            "a spectrum must be finite to take lines out of it, got some that is not; repair the record"
        )
    level = _level(spectrum)
    rise = spectrum.density / np.maximum(level, np.finfo(float).tiny)
    bound = _bound(spectrum, CHANCE / rise.size)
    peaks = _peaks(rise, bound)
    tones = _centre(spectrum, rise, peaks)
    combs = _combs(tones, spectrum, shaft_hz)
    weak = _weak_harmonics(spectrum, rise, combs, peaks)
    peaks = np.union1d(peaks, weak)
    low, high = band_hz if band_hz is not None else (0.0, np.inf)
    inside = (spectrum.frequency_hz[peaks] >= low) & (spectrum.frequency_hz[peaks] <= high)
    peaks = peaks[inside]
    tones = _centre(spectrum, rise, peaks)

    kept = np.ones(rise.size, dtype=bool)
    usual = 1.0 + 2.0 / np.sqrt(_shape(spectrum))
    removed = []
    for peak, tone in zip(peaks, tones, strict=True):
        first, last = max(peak - CORE, 0), min(peak + CORE, rise.size - 1)
        while first > max(peak - REACH, 0) and rise[first - 1] > usual:
            first -= 1
        while last < min(peak + REACH, rise.size - 1) and rise[last + 1] > usual:
            last += 1
        kept[first : last + 1] = False
        excess = spectrum.density[first : last + 1] - level[first : last + 1]
        square = float(np.sum(excess)) * spectrum.spacing_hz
        removed.append(
            Line(
                frequency_hz=float(tone), mean_square=square, source=_source(tone, combs, spectrum)
            )
        )
    density = spectrum.density.copy()
    density[~kept] = (
        np.interp(np.flatnonzero(~kept), np.flatnonzero(kept), level[kept])
        if np.any(kept)
        else level
    )
    return CleanSpectrum(
        spectrum=replace(spectrum, density=density),
        kept=kept,
        removed=tuple(removed),
        speeds_hz=tuple(combs),
    )


def _shape(spectrum: Spectrum) -> float:
    """Shape of the gamma distribution of a line: one tapered periodogram is worth 1, by whatever `averages` says."""
    return max(spectrum.averages * (1.0 if spectrum.window == "boxcar" else 1.944), 1.0)


def _level(spectrum: Spectrum) -> Field:
    """Mean density beside each line: the running median, and what the median of a gamma distribution lacks."""
    shape = _shape(spectrum)
    middle = scipy.ndimage.median_filter(spectrum.density, 2 * NEIGHBOURS + 1, mode="nearest")
    return np.asarray(middle / float(scipy.special.gammaincinv(shape, 0.5) / shape))


def _bound(spectrum: Spectrum, chance: float) -> float:
    """How far above its neighbours a line may stand by chance; the level itself is known to 1.25/sqrt(41) of that."""
    shape = _shape(spectrum)
    return float(scipy.special.gammainccinv(shape, chance) / shape * (1.0 + 0.6 / np.sqrt(shape)))


def _peaks(rise: Field, bound: float) -> Field:
    """Lines that stand out, the highest of each group, where the group is no wider than a tone can be."""
    above = rise > bound
    above[:NEIGHBOURS] = above[-NEIGHBOURS:] = False  # too few neighbours to one side
    peaks = []
    for at in map(int, np.flatnonzero(above)):
        first, last = max(at - CORE, 0), min(at + CORE, rise.size - 1)
        if rise[at] >= np.max(rise[first : last + 1]):
            wide = rise[max(at - 2 * REACH, 0) : at + 2 * REACH + 1]
            if np.count_nonzero(wide > max(0.25 * rise[at], bound)) <= 2 * CORE + 1:
                peaks.append(at)
    return np.array(peaks, dtype=int)


def _centre(spectrum: Spectrum, rise: Field, peaks: Field) -> Field:
    """Frequencies of the tones [Hz], between lines: from the two highest lines of each, by the taper's own shape.

    Their amplitudes are as (1 - δ)/(2 + δ) to 1 behind a Hann taper, as δ/(1 - δ) to 1 behind none.
    """
    if peaks.size == 0:
        return np.zeros(0)
    above = np.sqrt(np.maximum(np.pad(rise, 1) - 1.0, 1e-12))
    left, top, right = above[peaks], above[peaks + 1], above[peaks + 2]
    ratio = np.maximum(left, right) / top
    away = (
        ratio / (1.0 + ratio)
        if spectrum.window == "boxcar"
        else (2.0 * ratio - 1.0) / (1.0 + ratio)
    )
    return np.asarray(
        (peaks + np.where(right > left, 1.0, -1.0) * np.clip(away, 0.0, 0.5)) * spectrum.spacing_hz
    )


def _combs(tones: Field, spectrum: Spectrum, shaft_hz: Sequence[float] | None) -> list[float]:
    """Speeds that explain tones, put right by them: those given, or those found; and the mains."""
    combs: list[float] = []
    left = tones
    mains = [(_evidence(left, speed, spectrum), speed) for speed in MAINS_HZ]
    strongest = max(mains)
    if strongest[0] > -np.log(CHANCE):
        combs.append(strongest[1])
        left = left[~_on_comb(left, strongest[1], spectrum)]
    if shaft_hz is not None:
        return [_put_right(tones, speed, spectrum) for speed in shaft_hz] + combs
    lowest = max(SLOWEST_HZ, SEPARATE * spectrum.spacing_hz)
    while left.size >= FEWEST_HARMONICS:
        differences = np.abs(left[:, None] - left[None, :])[np.triu_indices(left.size, 1)]
        candidates = np.unique(np.concatenate([left, differences]).round(6))
        candidates = candidates[(candidates >= lowest) & (candidates <= FASTEST_HZ)]
        if candidates.size == 0:
            break
        rough = np.array(
            [np.count_nonzero(_on_comb(left, speed, spectrum)) for speed in candidates]
        )
        rough = rough - left.size * 1.5 * spectrum.spacing_hz / candidates
        promising = candidates[np.argsort(rough)[-MOST_PROMISING:]]
        judged = [
            (_evidence(left, _put_right(left, speed, spectrum), spectrum), speed)
            for speed in promising
        ]
        evidence, speed = max(judged)
        if evidence - np.log(candidates.size) < -np.log(SURE):
            break
        speed = _put_right(left, speed, spectrum)
        combs.insert(0, speed)
        left = left[~_on_comb(left, speed, spectrum)]
    return combs


def _on_comb(tones: Field, speed: float, spectrum: Spectrum) -> Mask:
    order = np.maximum(np.rint(tones / speed), 1.0)
    return np.asarray(np.abs(tones - order * speed) < 0.75 * spectrum.spacing_hz)


def _put_right(tones: Field, speed: float, spectrum: Spectrum) -> float:
    """The speed that its harmonics among the tones have in common, from the low orders to the high."""
    reach = SPEED_ERROR
    for _ in range(20):
        order = np.rint(tones / speed)
        near = (order >= 1.0) & (
            np.abs(tones - order * speed)
            < np.minimum(reach * tones, 0.3 * speed) + spectrum.spacing_hz
        )
        if not np.any(near):
            return speed
        lowest = np.argsort(order[near])[: 2 + int(1.5 * FEWEST_HARMONICS)]
        use_order, use = order[near], tones[near]
        if reach == SPEED_ERROR:
            use_order, use = use_order[lowest], use[lowest]
        speed = float(np.sum(use_order * use) / np.sum(use_order**2))
        reach = 0.0
    return speed


def _evidence(tones: Field, speed: float, spectrum: Spectrum) -> float:
    """-ln of the chance that so many of the tones would lie on a comb by themselves (binomial)."""
    count = int(np.count_nonzero(_on_comb(tones, speed, spectrum)))
    if count < FEWEST_HARMONICS:
        return 0.0
    by_chance = min(1.5 * spectrum.spacing_hz / speed, 1.0)
    return float(-np.log(scipy.special.betainc(count, tones.size - count + 1, by_chance)))


def _weak_harmonics(spectrum: Spectrum, rise: Field, combs: Sequence[float], peaks: Field) -> Field:
    """Lines at harmonics of the speeds that stand out by less than a tone of unknown origin has to."""
    weak = []
    for speed in combs:
        orders = np.arange(1, int(spectrum.frequency_hz[-1] / speed))
        if orders.size == 0:
            continue
        bound = _bound(spectrum, CHANCE / orders.size)
        for at in np.rint(orders * speed / spectrum.spacing_hz).astype(int):
            first = max(at - 1, 0)
            best = first + int(np.argmax(rise[first : at + 2]))
            taken = peaks.size > 0 and np.min(np.abs(peaks - best)) <= CORE
            if rise[best] > bound and not taken:
                weak.append(best)
    return np.array(weak, dtype=int)


def _source(tone: float, combs: Sequence[float], spectrum: Spectrum) -> str:
    for speed in combs:
        if _on_comb(np.array([tone]), speed, spectrum)[0]:
            return f"{max(round(tone / speed), 1)} x {speed:.4g} Hz"
    return "unknown"
