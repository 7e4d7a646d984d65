"""Detection, identification and removal of tones (shaft and mains harmonics) in a spectrum.

A tone is a few lines wide and exceeds its neighbours by more than chance; a resonance is wider. Its
source follows from speeds, which are stated or found from the tones themselves.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, require_positive
from asperity.core.signals import Spectrum

MAINS_HZ = (50.0, 60.0)
# expected false tones in the whole spectrum, and among the harmonics of each known speed
CHANCE = 1e-2
NEIGHBOURS = 20  # lines on either side whose median is the level under a tone
LARGEST_TONE_HALF_WIDTH = 8  # lines on either side; wider peaks are kept
TONE_HALF_WIDTH = 3  # lines on either side that a Hann taper spreads any tone over
SPEED_ERROR = 2e-3  # relative, of a stated speed, which the tones correct
FEWEST_HARMONICS = 5  # tones that a speed must explain to be found
SLOWEST_HZ, FASTEST_HZ = 4.0, 500.0  # range of the shaft speeds searched
SMALLEST_SPACING = 5.0  # lines between harmonics; a denser comb would explain anything
CANDIDATES = 40  # speeds tested in detail, of all that pairs of tones suggest
COMB_CHANCE = 1e-6  # chance of a false comb, all combs tried included


@dataclass(frozen=True, slots=True, kw_only=True)
class RemovedTone:
    """A removed tone: frequency [Hz], mean square [unit^2], and source.

    `source` is such as "57 x 56.25 Hz", or "unknown".
    """

    frequency_hz: float
    mean_square: float
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CleanSpectrum:
    """A spectrum with its tones removed.

    `spectrum` holds the level of the neighbours in their place; `kept`, shape (lines,), marks the
    unchanged lines; `removed` lists the tones by frequency; `speeds_hz` the shafts and mains that
    explain tones, corrected by them.
    """

    spectrum: Spectrum
    kept: Mask
    removed: tuple[RemovedTone, ...]
    speeds_hz: tuple[float, ...]


def remove_lines(
    spectrum: Spectrum,
    *,
    shaft_hz: Sequence[float] | None = None,
    band_hz: tuple[float, float] | None = None,
) -> CleanSpectrum:
    """Remove the tones from a spectrum.

    Parameters
    ----------
    shaft_hz : speeds of the shafts [Hz], used to identify tones and to find weak ones at their
        harmonics; None finds them from the tones. The mains, 50 or 60 Hz, are always included. The
        first and last 20 lines are not searched
    band_hz : remove tones from this band only; speeds still follow from the tones of the whole
        spectrum

    Raises
    ------
    BadInput
        for a speed that is not positive, a smoothed spectrum, one of fewer than 50 lines or with
        values that are not finite.
    """
    _require_removable(spectrum, shaft_hz)
    level = _level(spectrum)
    relative_density = spectrum.density / np.maximum(level, np.finfo(float).tiny)
    peaks, combs = _identify_tones(spectrum, relative_density, shaft_hz)
    low, high = band_hz if band_hz is not None else (0.0, np.inf)
    frequency = spectrum.frequency_hz[peaks]
    peaks = peaks[(frequency >= low) & (frequency <= high)]

    kept = np.ones(relative_density.size, dtype=bool)
    removed = []
    upper = 1.0 + 2.0 / np.sqrt(_shape(spectrum))
    for peak, tone in zip(peaks, _tone_frequencies(spectrum, relative_density, peaks), strict=True):
        first, last = _tone_extent(relative_density, int(peak), upper)
        lines = slice(first, last + 1)
        kept[lines] = False
        mean_square = float(np.sum(spectrum.density[lines] - level[lines])) * spectrum.spacing_hz
        source = _source(tone, combs, spectrum)
        removed.append(
            RemovedTone(frequency_hz=float(tone), mean_square=mean_square, source=source)
        )
    return CleanSpectrum(
        spectrum=_with_level(spectrum, level, ~kept),
        kept=kept,
        removed=tuple(removed),
        speeds_hz=tuple(combs),
    )


def _with_level(spectrum: Spectrum, level: Field, lines: Mask) -> Spectrum:
    """Return the spectrum with the level of their neighbours in place of some lines."""
    density = spectrum.density.copy()
    density[lines] = (
        level
        if np.all(lines)
        else np.interp(np.flatnonzero(lines), np.flatnonzero(~lines), level[~lines])
    )
    return replace(spectrum, density=density)


def _identify_tones(
    spectrum: Spectrum, relative_density: Field, shaft_hz: Sequence[float] | None
) -> tuple[Field, list[float]]:
    """Return the lines of all tones, weak harmonics included, and the speeds that explain them."""
    peaks = _find_peaks(relative_density, _threshold(spectrum, CHANCE / relative_density.size))
    combs = _find_combs(_tone_frequencies(spectrum, relative_density, peaks), spectrum, shaft_hz)
    weak = _weak_harmonics(spectrum, relative_density, combs, peaks)
    return np.union1d(peaks, weak), combs


def _require_removable(spectrum: Spectrum, shaft_hz: Sequence[float] | None) -> None:
    for speed in shaft_hz or ():
        require_positive("shaft speed", speed, "Hz")
    if spectrum.smoothing_passes:
        raise BadInput(
            "removing tones needs an unsmoothed spectrum, got one smoothed "
            f"{spectrum.smoothing_passes} times"
        )
    if spectrum.density.size <= 2 * NEIGHBOURS + 10:
        raise BadInput(
            f"a spectrum of {spectrum.density.size} lines is too short to detect tones; lengthen "
            "its segment"
        )
    if not np.isfinite(spectrum.density).all():
        raise BadInput("removing tones needs a finite spectrum; repair the record")


def _tone_extent(relative_density: Field, peak: int, upper: float) -> tuple[int, int]:
    """Return the first and last line of a tone: its core, and neighbours that exceed `upper`."""
    end = relative_density.size - 1
    first = max(peak - TONE_HALF_WIDTH, 0)
    last = min(peak + TONE_HALF_WIDTH, end)
    while first > max(peak - LARGEST_TONE_HALF_WIDTH, 0) and relative_density[first - 1] > upper:
        first -= 1
    while last < min(peak + LARGEST_TONE_HALF_WIDTH, end) and relative_density[last + 1] > upper:
        last += 1
    return first, last


def _shape(spectrum: Spectrum) -> float:
    """Return the shape of a line's gamma distribution; 1 for one tapered periodogram."""
    return max(spectrum.averages * (1.0 if spectrum.window == "boxcar" else 1.944), 1.0)


def _level(spectrum: Spectrum) -> Field:
    """Return the mean density around each line: the running median over the gamma median."""
    shape = _shape(spectrum)
    middle = scipy.ndimage.median_filter(spectrum.density, 2 * NEIGHBOURS + 1, mode="nearest")
    return np.asarray(middle / float(scipy.special.gammaincinv(shape, 0.5) / shape))


def _threshold(spectrum: Spectrum, chance: float) -> float:
    """Return the relative density that a line exceeds by chance with this probability.

    The level itself is known to 1.25/sqrt(41) of the scatter.
    """
    shape = _shape(spectrum)
    return float(scipy.special.gammainccinv(shape, chance) / shape * (1.0 + 0.6 / np.sqrt(shape)))


def _find_peaks(relative_density: Field, bound: float) -> Field:
    """Return lines above the threshold, the highest of each group that is as narrow as a tone."""
    excess = relative_density > bound
    excess[:NEIGHBOURS] = excess[-NEIGHBOURS:] = False  # too few neighbours to one side
    peaks = []
    for index in map(int, np.flatnonzero(excess)):
        first = max(index - TONE_HALF_WIDTH, 0)
        last = min(index + TONE_HALF_WIDTH, relative_density.size - 1)
        if relative_density[index] >= np.max(relative_density[first : last + 1]):
            surroundings = relative_density[
                max(index - 2 * LARGEST_TONE_HALF_WIDTH, 0) : index
                + 2 * LARGEST_TONE_HALF_WIDTH
                + 1
            ]
            if (
                np.count_nonzero(surroundings > max(0.25 * relative_density[index], bound))
                <= 2 * TONE_HALF_WIDTH + 1
            ):
                peaks.append(index)
    return np.array(peaks, dtype=int)


def _tone_frequencies(spectrum: Spectrum, relative_density: Field, peaks: Field) -> Field:
    """Return the frequencies of the tones [Hz], interpolated between the two highest lines of each.

    Their amplitudes are as (1 - δ)/(2 + δ) to 1 behind a Hann taper, as δ/(1 - δ) to 1 behind none.
    """
    if peaks.size == 0:
        return np.zeros(0)
    excess = np.sqrt(np.maximum(np.pad(relative_density, 1) - 1.0, 1e-12))
    unexplained = excess[peaks]
    top = excess[peaks + 1]
    right = excess[peaks + 2]
    ratio = np.maximum(unexplained, right) / top
    offset = (
        ratio / (1.0 + ratio)
        if spectrum.window == "boxcar"
        else (2.0 * ratio - 1.0) / (1.0 + ratio)
    )
    return np.asarray(
        (peaks + np.where(right > unexplained, 1.0, -1.0) * np.clip(offset, 0.0, 0.5))
        * spectrum.spacing_hz
    )


def _find_combs(tones: Field, spectrum: Spectrum, shaft_hz: Sequence[float] | None) -> list[float]:
    """Return the speeds that explain tones, corrected by them: stated or found, and the mains."""
    combs: list[float] = []
    unexplained = tones
    mains_evidence, mains_hz = max(
        (_evidence(unexplained, speed, spectrum), speed) for speed in MAINS_HZ
    )
    if mains_evidence > -np.log(CHANCE):
        combs.append(mains_hz)
        unexplained = unexplained[~_on_comb(unexplained, mains_hz, spectrum)]
    if shaft_hz is not None:
        return [_corrected_speed(tones, speed, spectrum) for speed in shaft_hz] + combs
    while (speed := _best_comb(unexplained, spectrum)) is not None:
        combs.insert(0, speed)
        unexplained = unexplained[~_on_comb(unexplained, speed, spectrum)]
    return combs


def _best_comb(tones: Field, spectrum: Spectrum) -> float | None:
    """Return the speed whose harmonics explain most tones; None if chance explains as many."""
    if tones.size < FEWEST_HARMONICS:
        return None
    differences = np.abs(tones[:, None] - tones[None, :])[np.triu_indices(tones.size, 1)]
    candidates = np.unique(np.concatenate([tones, differences]).round(6))
    lowest = max(SLOWEST_HZ, SMALLEST_SPACING * spectrum.spacing_hz)
    candidates = candidates[(candidates >= lowest) & (candidates <= FASTEST_HZ)]
    if candidates.size == 0:
        return None
    score = np.array([np.count_nonzero(_on_comb(tones, speed, spectrum)) for speed in candidates])
    score = score - tones.size * 1.5 * spectrum.spacing_hz / candidates
    evidence, speed = max(
        (_evidence(tones, _corrected_speed(tones, speed, spectrum), spectrum), speed)
        for speed in candidates[np.argsort(score)[-CANDIDATES:]]
    )
    if evidence - np.log(candidates.size) < -np.log(COMB_CHANCE):
        return None
    return _corrected_speed(tones, speed, spectrum)


def _on_comb(tones: Field, speed: float, spectrum: Spectrum) -> Mask:
    order = np.maximum(np.rint(tones / speed), 1.0)
    return np.asarray(np.abs(tones - order * speed) < 0.75 * spectrum.spacing_hz)


def _corrected_speed(tones: Field, speed: float, spectrum: Spectrum) -> float:
    """Return the speed that fits its harmonics among the tones, from low orders to high."""
    tolerance = SPEED_ERROR
    for _ in range(20):
        order = np.rint(tones / speed)
        matching = (order >= 1.0) & (
            np.abs(tones - order * speed)
            < np.minimum(tolerance * tones, 0.3 * speed) + spectrum.spacing_hz
        )
        if not np.any(matching):
            return speed
        lowest = np.argsort(order[matching])[: 2 + int(1.5 * FEWEST_HARMONICS)]
        used_orders = order[matching]
        used_tones = tones[matching]
        if tolerance == SPEED_ERROR:
            used_orders, used_tones = used_orders[lowest], used_tones[lowest]
        speed = float(np.sum(used_orders * used_tones) / np.sum(used_orders**2))
        tolerance = 0.0
    return speed


def _evidence(tones: Field, speed: float, spectrum: Spectrum) -> float:
    """Return -ln of the chance that as many tones lie on a comb by themselves (binomial)."""
    count = int(np.count_nonzero(_on_comb(tones, speed, spectrum)))
    if count < FEWEST_HARMONICS:
        return 0.0
    probability = min(1.5 * spectrum.spacing_hz / speed, 1.0)
    return float(-np.log(scipy.special.betainc(count, tones.size - count + 1, probability)))


def _weak_harmonics(
    spectrum: Spectrum, relative_density: Field, combs: Sequence[float], peaks: Field
) -> Field:
    """Return lines at harmonics of known speeds that a lower threshold detects."""
    weak = []
    for speed in combs:
        orders = np.arange(1, int(spectrum.frequency_hz[-1] / speed))
        if orders.size == 0:
            continue
        bound = _threshold(spectrum, CHANCE / orders.size)
        for index in np.rint(orders * speed / spectrum.spacing_hz).astype(int):
            first = max(index - 1, 0)
            best = first + int(np.argmax(relative_density[first : index + 2]))
            claimed = peaks.size > 0 and np.min(np.abs(peaks - best)) <= TONE_HALF_WIDTH
            if relative_density[best] > bound and not claimed:
                weak.append(best)
    return np.array(weak, dtype=int)


def _source(tone: float, combs: Sequence[float], spectrum: Spectrum) -> str:
    for speed in combs:
        if _on_comb(np.array([tone]), speed, spectrum)[0]:
            return f"{max(round(tone / speed), 1)} x {speed:.4g} Hz"
    return "unknown"
