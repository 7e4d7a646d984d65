"""Recording of the simulated rig: line of the contact, disturbances, and records of both."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.signals import Signal, Spectrum, power_spectrum, taper
from asperity.coupling import VibrationModel, excitation, oscillator, structural_resonance
from asperity.ehl import ContactState
from asperity.paper.numbers import SHAFT_HZ
from asperity.structure import NamedStructure, sensor_response

MAINS_HZ = 50.0
RING_HARMONICS, MAINS_HARMONICS = 40, 20
LOWPASS = 0.45  # corner of the anti-aliasing filter over the sampling rate
# resonance of the mounted accelerometer: + 5 % at 10 kHz, as published
MOUNTED_HZ, MOUNTED_DAMPING = 46e3, 0.02
FLAT_BELOW_HZ = 100.0  # machine noise decreases with frequency above
GRID_HZ = 0.25  # frequency grid of densities; the sharpest mode is ten times as wide


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """Disturbances of the accelerometer signal.

    `snr_db`: power of the contact's line over that of everything else, both within the contact's
    search band, on average over recordings. `modes` structural modes contribute most of the
    disturbance in the band. `gain_db` is the standard deviation of the disturbance level between
    recordings, `mode_gain_db` that of each mode in addition, `mode_drift` that of the modes'
    frequencies (common, relative), `speed_drift` that of the shaft speeds.
    """

    snr_db: float = 10.0
    modes: int = 4
    gain_db: float = 1.0
    mode_gain_db: float = 0.1
    mode_drift: float = 1e-4
    speed_drift: float = 1e-3

    def __post_init__(self) -> None:
        if not -60.0 <= self.snr_db <= 60.0:
            raise BadInput(
                f"SNR must be between -60 and 60 dB, got {self.snr_db:g} dB; the default is 10 dB"
            )
        if not 0 <= self.modes <= 20:
            raise BadInput(f"structural modes must be 0 to 20, got {self.modes}; the default is 4")
        for name in ("gain_db", "mode_gain_db", "mode_drift", "speed_drift"):
            if not getattr(self, name) >= 0.0:
                raise BadInput(
                    f"{name.replace('_', ' ')} must be 0 or more, got {getattr(self, name):g}"
                )


class Tones(NamedTuple):
    """Tones of shafts and mains: frequencies [Hz] and amplitudes [m/s^2], shape (tones,)."""

    frequency_hz: Field
    amplitude: Field


@dataclass(frozen=True, kw_only=True)
class RigRecording:
    """Test of a ring: true values, records and spectra.

    `sq_m` with `sq_std_m` is the profilometer's reading, `true_sq_m` the true value; `crf_hz`,
    `crfa` and `damping_ratio` are the true ones of the contact line, with the accelerometer's
    response in `crfa`. `contact_density` and `other_density` are one-sided [(m/s^2)^2/Hz] on
    `frequency_hz`.
    """

    sample: int
    repeat: int
    sq_m: float
    sq_std_m: float
    true_sq_m: float
    clr: float
    crf_hz: float
    crfa: float
    damping_ratio: float
    snr_db: float
    rate_hz: float
    duration_s: float
    frequency_hz: Field
    contact_density: Field
    other_density: Field
    tones: Tones
    seed: int

    @property
    def name(self) -> str:
        """File name without suffix, such as "sample-07-test-3"."""
        return f"sample-{self.sample:02d}-test-{self.repeat}"

    def signal(self) -> Signal:
        """Return the record [m/s^2]: Gaussian with exactly these densities, plus the tones."""
        samples = round(self.duration_s * self.rate_hz)
        # longer than the record, which is then not periodic
        length = scipy.fft.next_fast_len(samples + samples // 64, real=True)
        frequency = np.arange(length // 2 + 1) * (self.rate_hz / length)
        scale = self.rate_hz * length / 4.0
        rng = np.random.default_rng(self.seed)
        waves = rng.standard_normal(2 * frequency.size).view(complex)
        waves *= np.sqrt(
            scale
            * np.interp(frequency, self.frequency_hz, self.contact_density + self.other_density)
        )
        phases = np.exp(2j * np.pi * rng.random(self.tones.amplitude.size))
        at = np.rint(self.tones.frequency_hz * (length / self.rate_hz)).astype(int)
        np.add.at(waves, at, 0.5 * length * self.tones.amplitude * phases)
        waves[0] = 0.0
        values = scipy.fft.irfft(waves, length, overwrite_x=True)[:samples]
        return Signal(np.ascontiguousarray(values), self.rate_hz, "m/s^2")

    def spectrum(self, segment: int) -> Spectrum:
        """Return a Hann-tapered averaged spectrum, drawn directly without a record.

        Mean and covariance of its lines are those of spectra of records.

        Raises
        ------
        BadInput
            for a segment longer than the record or shorter than 8 samples.
        """
        samples = round(self.duration_s * self.rate_hz)
        if not 8 <= segment <= samples:
            raise BadInput(
                f"a spectrum's segment must have 8 to {samples} samples (the record), got {segment}"
            )
        weights = taper("hann", segment)
        spacing = self.rate_hz / segment
        frequency = np.arange(segment // 2 + 1) * spacing
        smooth = np.interp(frequency, self.frequency_hz, self.contact_density + self.other_density)
        averages = _averages_of(segment, samples)
        rng = np.random.default_rng(self.seed)
        scatter = _draw_scatter(averages, frequency.size, rng)
        mean_square = 2.0 / (self.rate_hz * float(np.sum(weights**2)))
        tonal = self._tonal_density(frequency.size, spacing, segment, mean_square)
        mixed = 2.0 * np.sqrt(np.maximum(tonal * smooth, 0.0)) * rng.standard_normal(frequency.size)
        density = np.abs(smooth * scatter + tonal + mixed / np.sqrt(2.0 * averages))
        density[0] = 0.0
        return Spectrum(
            frequency_hz=frequency,
            density=density,
            unit="(m/s^2)^2/Hz",
            duration_s=self.duration_s,
            segment=segment,
            window="hann",
            resolution_hz=float(self.rate_hz * np.sum(weights**2) / np.sum(weights) ** 2),
            averages=averages,
        )

    def _tonal_density(self, size: int, spacing: float, segment: int, mean_square: float) -> Field:
        """Return the density of the tones, spread over lines by the Hann taper."""
        tonal = np.zeros(size)
        nearest = np.rint(self.tones.frequency_hz / spacing).astype(int)
        for shift in range(-3, 4):
            at = nearest + shift
            inside = (at >= 0) & (at < size)
            offset = (at - self.tones.frequency_hz / spacing)[inside]
            amplitude = (
                0.5 * self.tones.amplitude[inside] * segment * np.abs(_hann_transform(offset))
            )
            np.add.at(tonal, at[inside], mean_square * amplitude**2)
        return tonal


def _draw_scatter(averages: float, size: int, rng: np.random.Generator) -> Field:
    """Draw the scatter of averaged lines about 1.

    Weights (1/6, 2/3, 1/6) over independent gammas: neighbours correlate by 4/9, as with a Hann
    taper.
    """
    drawn = rng.gamma(averages, 1.0 / averages, size + 2)
    return np.asarray((drawn[:-2] + 4.0 * drawn[1:-1] + drawn[2:]) / 6.0)


def _hann_transform(offset: Field) -> Field:
    """Return the transform of a Hann window of length 1, `offset` cycles from its centre.

    It is relative to the peak of a boxcar.
    """
    return np.asarray(
        0.5 * np.sinc(offset) + 0.25 * (np.sinc(offset - 1.0) + np.sinc(offset + 1.0))
    )


@cache
def _averages_of(segment: int, samples: int) -> float:
    """Return the number of independent averages, as counted by `signals.power_spectrum`."""
    return power_spectrum(Signal(np.zeros(samples), 1.0, "m/s^2"), segment=segment).averages


class RigTest(NamedTuple):
    """Test of a ring and its recording settings."""

    sample: int
    repeat: int
    sq_m: float
    sq_std_m: float
    rate_hz: float
    duration_s: float


class ContactLine(NamedTuple):
    """Line of the contact: true values, and density on the grid as measured."""

    true_sq_m: float
    clr: float
    crf_hz: float
    crfa: float
    damping_ratio: float
    contact_density: Field


def contact_line(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    frequency: Field,
    rate_hz: float,
) -> ContactLine:
    """Return the contact's line: |H|^2 of the oscillator times the excitation's spectrum."""
    spring = oscillator(state, conditions, model)
    excited = excitation(state, conditions, model)

    def density(at: Field) -> Field:
        return np.asarray(spring.gain(at) * excited.density(at, rate_hz))

    resonance = spring.natural_frequency_hz, spring.damping_ratio
    return _measured_line(state, resonance, density, frequency, rate_hz)


def _measured_line(
    state: ContactState,
    resonance: tuple[float, float],
    density: Callable[[Field], Field],
    frequency: Field,
    rate_hz: float,
) -> ContactLine:
    """Return the line of a resonance [Hz, ratio] by its density, with the accelerometer's gain."""

    def measured(at: Field) -> Field:
        return np.asarray(density(at) * _accelerometer(at, rate_hz))

    values = np.zeros(frequency.size)
    values[1:] = measured(frequency[1:])
    (f0, damping_ratio) = resonance
    height = float(np.ravel(measured(np.array(f0)))[0])
    return ContactLine(state.sq, state.clr, f0, height, damping_ratio, values)


class StructureLines(NamedTuple):
    """Lines of a contact at the sensor of a machine structure."""

    structure: NamedStructure
    conditions: ContactConditions
    model: VibrationModel

    def line(
        self, state: ContactState, frequency: Field, rate_hz: float, shift: float
    ) -> ContactLine:
        """Return the line of a contact whose mode is shifted by a relative `shift`.

        H is the motion of the sensor for that of the roughness, and the line that of the mode which
        follows the contact.
        """
        spring = oscillator(state, self.conditions, self.model)
        resonance = structural_resonance(self.structure, self.conditions, self.model)
        f0 = float(np.exp(resonance.mode.log_frequency(np.log(spring.stiffness))))
        f0 *= 1.0 + shift
        stiffness = float(resonance.mode.stiffness_at(f0))
        damping_ratio = float(resonance.mode.total_damping(np.log(stiffness), spring.damping))
        excited = excitation(state, self.conditions, self.model)

        def density(at: Field) -> Field:
            motion = sensor_response(self.structure.structure, stiffness, spring.damping, at)
            gain = (2.0 * np.pi * at) ** 4 * np.abs(motion) ** 2
            return np.asarray(gain * excited.density(at, rate_hz))

        return _measured_line(state, (f0, damping_ratio), density, frequency, rate_hz)


def _accelerometer(frequency: Field, rate_hz: float) -> Field:
    """Return the power response: flat, rising to the mounted resonance, low-pass filtered."""
    x = frequency / MOUNTED_HZ
    mounted = 1.0 / ((1.0 - x**2) ** 2 + (2.0 * MOUNTED_DAMPING * x) ** 2)
    return np.asarray(mounted / (1.0 + (frequency / (LOWPASS * rate_hz)) ** 16))


class Background(NamedTuple):
    """Disturbances common to all recordings of a rig; total power 1 within the band."""

    band_hz: tuple[float, float]
    frequency: Field
    mode_hz: Field
    mode_damping: Field
    mode_power: Field
    floor: Field  # on the grid
    order: Field  # tones: multiples of their source's frequency,
    source: npt.NDArray[np.intp]  # 0 roller, 1 ring, 2 mains,
    power: Field  # and mean squares

    def recording(
        self,
        test: RigTest,
        contact: ContactLine,
        disturbance: Disturbance,
        rng: np.random.Generator,
    ) -> RigRecording:
        """Return a recording of the contact with these disturbances.

        Their level follows from the SNR, with random scatter; the modes are shifted in each
        recording.
        """
        inside = self._in_band(self.frequency)
        power = float(np.sum(contact.contact_density[inside])) * GRID_HZ
        target = power / 10.0 ** (disturbance.snr_db / 10.0)
        level = target * 10.0 ** (disturbance.gain_db * rng.standard_normal() / 10.0)
        gains = 10.0 ** (disturbance.mode_gain_db * rng.standard_normal(self.mode_hz.size) / 10.0)
        mode_hz = self.mode_hz * (1.0 + disturbance.mode_drift * rng.standard_normal())
        other = self._floor_and_modes(mode_hz, self.mode_power * gains)
        at = self._tone_hz(disturbance, rng)
        response = _accelerometer(at, test.rate_hz)
        measured_other = level * other * _accelerometer(self.frequency, test.rate_hz)
        tonal = level * float(np.sum((self.power * response)[self._in_band(at)]))
        return RigRecording(
            **test._asdict(),
            **contact._asdict(),
            snr_db=float(
                10.0 * np.log10(power / (np.sum(measured_other[inside]) * GRID_HZ + tonal))
            ),
            frequency_hz=self.frequency,
            other_density=measured_other,
            tones=Tones(at, np.sqrt(2.0 * level * self.power * response)),
            seed=int(rng.integers(2**63)),
        )

    def _tone_hz(self, disturbance: Disturbance, rng: np.random.Generator) -> Field:
        """Draw the frequencies of the tones [Hz]."""
        sources = np.array([*SHAFT_HZ, MAINS_HZ])
        sources[:2] *= 1.0 + disturbance.speed_drift * rng.standard_normal(2)
        return np.asarray(self.order * sources[self.source])

    def _floor_and_modes(self, mode_hz: Field, mode_power: Field) -> Field:
        """Return the density of noise and modes at these frequencies and powers."""
        density = self.floor.copy()
        for f0, damping, power in zip(mode_hz, self.mode_damping, mode_power, strict=True):
            # inertance of a mode under a white force; ∫ = π f0/(4ζ) near the peak
            x2 = (self.frequency / f0) ** 2
            density += (
                power
                * 4.0
                * damping
                / (np.pi * f0)
                * x2**2
                / ((1.0 - x2) ** 2 + 4.0 * damping**2 * x2)
            )
        return density

    def _in_band(self, frequency: Field) -> Mask:
        return (frequency >= self.band_hz[0]) & (frequency <= self.band_hz[1])


def draw_background(
    frequency: Field,
    band_hz: tuple[float, float],
    disturbance: Disturbance,
    rng: np.random.Generator,
) -> Background:
    """Draw modes, noise and tones, with mean power shares in the band of 0.6, 0.3 and 0.1."""
    low, high = band_hz
    # as many modes below and above the band as within it
    highest = max(0.9 * float(frequency[-1]), 1.1 * high)
    spans = (low, high), (0.2 * low, 0.95 * low), (1.05 * high, highest)
    mode_hz = np.concatenate([rng.uniform(start, end, disturbance.modes) for start, end in spans])
    damping = np.exp(rng.uniform(np.log(0.004), np.log(0.03), mode_hz.size))
    shares = rng.gamma([6.0 if disturbance.modes else 1e-9, 3.0, 1.0])
    shares /= np.sum(shares)
    heights = 10.0 ** rng.uniform(-1.2, 0.0, mode_hz.size)  # of the peaks, within 12 dB
    power = heights * damping * mode_hz
    power *= shares[0] / max(float(np.sum(power[: disturbance.modes])), np.finfo(float).tiny)
    floor = _draw_floor(frequency, band_hz, shares[1], rng)
    tones = _draw_tones(frequency, band_hz, shares[2], rng)
    return Background(band_hz, frequency, mode_hz, damping, power, floor, *tones)


def _draw_floor(
    frequency: Field, band_hz: tuple[float, float], share: float, rng: np.random.Generator
) -> Field:
    """Draw the density of noise, with a power of `share` within the band."""
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    floor = (1.0 + (frequency / FLAT_BELOW_HZ) ** 2) ** (-0.5 * rng.uniform(0.0, 1.5))
    return np.asarray(floor * (share / (float(np.sum(floor[inside])) * GRID_HZ)))


def _draw_tones(
    frequency: Field, band_hz: tuple[float, float], share: float, rng: np.random.Generator
) -> tuple[Field, npt.NDArray[np.intp], Field]:
    """Draw the harmonics of shafts and mains: order, source and power, `share` within the band."""
    (low, high), roller_hz = band_hz, SHAFT_HZ[0]
    roller = np.arange(1.0, np.floor(0.8 * frequency[-1] / roller_hz))
    order = np.concatenate(
        [roller, np.arange(1.0, RING_HARMONICS), np.arange(1.0, MAINS_HARMONICS)]
    )
    source = np.repeat([0, 1, 2], [roller.size, RING_HARMONICS - 1, MAINS_HARMONICS - 1])
    power = rng.exponential(1.0, order.size) / order
    in_band = (source == 0) & (order * roller_hz > low) & (order * roller_hz < high)
    power *= share / float(np.sum(power[in_band]))
    return order, source, power
