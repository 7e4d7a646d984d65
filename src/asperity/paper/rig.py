"""The paper's rig, simulated: recordings of worn rings whose contact resonance is known, to judge methods by.

The contact is asperity's own oscillator over its own rough profile. What a real accelerometer hears besides, and what
fools a search for the highest point, is drawn anew for each rig: structural modes, shaft and mains lines, noise.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.arrays import Field
from asperity.case import Case, load_case
from asperity.conditions import ContactConditions
from asperity.coupling import ASPERITIES_ALONE, VibrationModel, dry_full_load, excitation, oscillator, search_band
from asperity.ehl import ContactState, contact_state, solve_contact
from asperity.errors import BadInput, require_positive
from asperity.files import whole_file
from asperity.paper.table1 import DAMPING_RATIO, MASS, PAIR, papers_contact
from asperity.signals import Signal, Spectrum, power_spectrum

LOAD = 500.0  # [N], the paper's tests
SAMPLES_SQ_UM = (0.54, 0.87, 1.25, 1.31, 1.64, 1.68, 1.92, 2.17, 2.43, 2.90, 3.06, 3.49)  # its section 4.1
SAMPLES_STD_UM = (0.10, 0.08, 0.05, 0.05, 0.10, 0.06, 0.10, 0.08, 0.05, 0.05, 0.10, 0.06)
CRF_ENDS_HZ = (2921.93, 3811.88)  # its section 4.2, smoothest and roughest sample
KNEE_UM, KNEE_HZ = 1.8, 3640.0  # between its samples of 1.68 and 1.92 um; the height is ours, its figure has no numbers
SATURATION_UM = 0.8
CONSTANT_HZ = 3400.0
ROLLER_HZ, RING_HZ, MAINS_HZ = 3375.0 / 60.0, 300.0 / 60.0, 50.0
RING_HARMONICS, MAINS_HARMONICS = 40, 20
LOWPASS = 0.45  # corner of the anti-aliasing filter over the sampling rate
MOUNTED_HZ, MOUNTED_DAMPING = 46e3, 0.02  # resonance of the accelerometer on its stud: + 5 % at 10 kHz, as printed
FLAT_BELOW_HZ = 100.0  # machine noise, which falls with frequency above
RATE_PER_BAND = 3.0  # sampling rate over the upper end of the search band, at least
SHORTEST_RECORD = 1000
AT_ONCE = 2  # recordings made at the same time: 300 s at 20 kHz take 0.3 GB each
GRID_HZ = 0.25  # on which densities are worked out; the sharpest mode is ten times as wide


def _straight_with_knee(sq: Field) -> Field:
    at = np.array([SAMPLES_SQ_UM[0], KNEE_UM, SAMPLES_SQ_UM[-1]]) * 1e-6
    heights = np.array([CRF_ENDS_HZ[0], KNEE_HZ, CRF_ENDS_HZ[1]])
    slopes = np.diff(heights) / np.diff(at)
    return np.asarray(KNEE_HZ + np.where(sq < at[1], slopes[0], slopes[1]) * (sq - at[1]))


def _saturating(sq: Field) -> Field:
    grown = 1.0 - np.exp(-(sq * 1e6 - SAMPLES_SQ_UM[0]) / SATURATION_UM)
    whole = 1.0 - np.exp(-(SAMPLES_SQ_UM[-1] - SAMPLES_SQ_UM[0]) / SATURATION_UM)
    return np.asarray(CRF_ENDS_HZ[0] + (CRF_ENDS_HZ[1] - CRF_ENDS_HZ[0]) * grown / whole)


TRENDS: dict[str, Callable[[Field], Field]] = {  # CRF [Hz] over Sq [m]
    "knee": _straight_with_knee,
    "smooth": _saturating,
    "constant": lambda sq: np.full(np.shape(sq), CONSTANT_HZ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Disturbance:
    """What the accelerometer hears besides the contact.

    `snr_db`: power of the contact's line over that of everything else, both within the contact's search band, in the
    mean over recordings. `modes` structural modes share most of that band with it. `gain_db` is the standard
    deviation of the level of everything else from recording to recording, `mode_gain_db` that of each mode beside it,
    `mode_drift` that of the modes' frequencies (all together, relative), `speed_drift` that of the shafts' speeds.
    """

    snr_db: float = 10.0
    modes: int = 4
    gain_db: float = 1.0
    mode_gain_db: float = 0.1
    mode_drift: float = 1e-4
    speed_drift: float = 1e-3

    def __post_init__(self) -> None:
        if not -60.0 <= self.snr_db <= 60.0:
            raise BadInput(f"SNR must lie between -60 and 60 dB, got {self.snr_db:g} dB; 10 dB is the default")
        if not 0 <= self.modes <= 20:
            raise BadInput(f"structural modes must be 0 to 20, got {self.modes}; 4 is the default")
        for name in ("gain_db", "mode_gain_db", "mode_drift", "speed_drift"):
            if not getattr(self, name) >= 0.0:
                raise BadInput(f"{name.replace('_', ' ')} must be 0 or more, got {getattr(self, name):g}")


class Tones(NamedTuple):
    """Lines of shafts and mains: frequencies [Hz] and amplitudes [m/s^2], shape (tones,)."""

    frequency_hz: Field
    amplitude: Field


@dataclass(frozen=True, kw_only=True)
class RigRecording:
    """One test of one ring: the truth, and records and spectra of it.

    `sq_m` with `sq_std_m` is what a profilometer says, `true_sq_m` what the ring has; `crf_hz`, `crfa` and
    `damping_ratio` are the contact line's true ones, the accelerometer's response included in `crfa`.
    `contact_density` and `other_density` are one-sided [(m/s^2)^2/Hz] on `frequency_hz`.
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
        """Such as "sample-07-test-3"."""
        return f"sample-{self.sample:02d}-test-{self.repeat}"

    def signal(self) -> Signal:
        """The record [m/s^2]: Gaussian, with exactly these densities, and the tones; one seed, one record."""
        import scipy.fft as fft

        samples = round(self.duration_s * self.rate_hz)
        length = fft.next_fast_len(samples + samples // 64, real=True)  # cut off, so that no end meets the beginning
        frequency = np.arange(length // 2 + 1) * (self.rate_hz / length)
        scale = self.rate_hz * length / 4.0
        rng = np.random.default_rng(self.seed)
        waves = rng.standard_normal(2 * frequency.size).view(complex)
        waves *= np.sqrt(scale * np.interp(frequency, self.frequency_hz, self.contact_density + self.other_density))
        turns = np.exp(2j * np.pi * rng.random(self.tones.amplitude.size))
        at = np.rint(self.tones.frequency_hz * (length / self.rate_hz)).astype(int)
        np.add.at(waves, at, 0.5 * length * self.tones.amplitude * turns)
        waves[0] = 0.0
        return Signal(np.ascontiguousarray(fft.irfft(waves, length, overwrite_x=True)[:samples]), self.rate_hz, "m/s^2")

    def spectrum(self, segment: int) -> Spectrum:
        """A Hann-tapered averaged spectrum, drawn without a record: mean and covariance of lines as records have them.

        Raises BadInput for a segment longer than the record or shorter than 8 samples.
        """
        samples = round(self.duration_s * self.rate_hz)
        if not 8 <= segment <= samples:
            raise BadInput(f"a spectrum's segment must have 8 to {samples} samples (the record), got {segment}")
        from scipy.signal import get_window

        taper = get_window("hann", segment)
        spacing = self.rate_hz / segment
        frequency = np.arange(segment // 2 + 1) * spacing
        smooth = np.interp(frequency, self.frequency_hz, self.contact_density + self.other_density)
        averages = _averages_of(segment, samples)
        rng = np.random.default_rng(self.seed)
        # weights (1/6, 2/3, 1/6) over independent gammas: neighbours correlate by 4/9, as those behind a Hann taper do
        drawn = rng.gamma(averages, 1.0 / averages, frequency.size + 2)
        scatter = (drawn[:-2] + 4.0 * drawn[1:-1] + drawn[2:]) / 6.0
        mean_square = 2.0 / (self.rate_hz * float(np.sum(taper**2)))
        tonal = np.zeros(frequency.size)
        nearest = np.rint(self.tones.frequency_hz / spacing).astype(int)
        for shift in range(-3, 4):
            at = nearest + shift
            inside = (at >= 0) & (at < frequency.size)
            away = (at - self.tones.frequency_hz / spacing)[inside]
            amplitude = 0.5 * self.tones.amplitude[inside] * segment * np.abs(_hann_transform(away))
            np.add.at(tonal, at[inside], mean_square * amplitude**2)
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
            resolution_hz=float(self.rate_hz * np.sum(taper**2) / np.sum(taper) ** 2),
            averages=averages,
        )


def _hann_transform(away: Field) -> Field:
    """Of a Hann window of length 1 at `away` cycles from its centre, relative to a boxcar's peak."""
    return np.asarray(0.5 * np.sinc(away) + 0.25 * (np.sinc(away - 1.0) + np.sinc(away + 1.0)))


@cache
def _averages_of(segment: int, samples: int) -> float:
    """Independent ordinates a line is worth, `signals.power_spectrum`'s own count."""
    return power_spectrum(Signal(np.zeros(samples), 1.0, "m/s^2"), segment=segment).averages


@dataclass(frozen=True, kw_only=True)
class Rig:
    """Recordings and what is true of them all.

    `band_hz` is the contact's search band, in which SNR is counted; `full_load_crf_hz` the resonance with all load on
    asperities; `split_sq_m` where the trend has its knee, None where it has none; `case_text` a case file of the
    contact.
    """

    recordings: tuple[RigRecording, ...]
    band_hz: tuple[float, float]
    full_load_crf_hz: float
    split_sq_m: float | None
    disturbance: Disturbance
    load_n: float
    shaft_hz: tuple[float, ...]
    case_text: str


def simulate_rig(
    *,
    samples: int = len(SAMPLES_SQ_UM),
    repeats: int = 5,
    duration_s: float = 10.0,
    rate_hz: float = 20e3,
    disturbance: Disturbance | None = None,
    trend: str = "knee",
    repeat_std_hz: float = 15.0,
    seed: int = 7,
    case: Case | None = None,
) -> Rig:
    """The paper's test, 12 worn rings 5 times each at 500 N, or another number of them spread over the same range.

    Parameters
    ----------
    duration_s, rate_hz : of each recording; the paper's are 300 s at 20 kHz
    disturbance : what is heard besides the contact, by default at an SNR of 10 dB; its modes, levels and tones are
        drawn anew for each seed
    trend : name in TRENDS, the CRF over Sq: "knee", straight to 1.8 um and on at another slope, between the paper's
        ends; "smooth", a saturating exponential between them; "constant"
    repeat_std_hz : standard deviation of the true CRF from test to test
    seed : of everything drawn
    case : its contact solved at each Sq gives load and area shares, in place of `trend`; its load, radius, mass,
        damping and excitation make the line

    Raises
    ------
    BadInput
        for numbers out of range, an unknown trend, a case without [vibration] or with a resonance that the rate
        cannot show.
    NotConverged
        if a contact of the case cannot be solved.
    """
    if samples < 1 or repeats < 1:
        raise BadInput(f"a rig needs at least 1 sample and 1 repeat, got {samples} and {repeats}")
    if trend not in TRENDS:
        raise BadInput(f"rig trend must be one of {', '.join(TRENDS)}, got {trend!r}")
    require_positive("rig recording's duration", duration_s, "s")
    require_positive("rig sampling rate", rate_hz, "Hz")
    if not repeat_std_hz >= 0.0:
        raise BadInput(f"CRF deviation between repeats must be 0 or more, got {repeat_std_hz:g} Hz")
    if seed < 0:
        raise BadInput(f"rig seed must be 0 or more, got {seed}")
    if round(duration_s * rate_hz) < SHORTEST_RECORD:
        raise BadInput(
            f"a rig recording needs at least {SHORTEST_RECORD} samples, got {duration_s:g} s at {rate_hz:g} Hz; "
            "lengthen it"
        )
    conditions, model = _contact(case)
    band_hz = search_band(conditions, model)
    if rate_hz < RATE_PER_BAND * band_hz[1]:
        raise BadInput(
            f"rig sampling rate must be at least {RATE_PER_BAND:g} times the upper end of the "
            f"search band, {band_hz[1]:.0f} Hz, got {rate_hz:g} Hz; raise it"
        )
    positions = np.linspace(0.0, len(SAMPLES_SQ_UM) - 1.0, samples) if samples > 1 else np.zeros(1)
    of_sample = np.arange(len(SAMPLES_SQ_UM))
    sq = np.interp(positions, of_sample, SAMPLES_SQ_UM) * 1e-6
    sq_std = np.interp(positions, of_sample, SAMPLES_STD_UM) * 1e-6
    whole = replace(dry_full_load(conditions, float(sq[0])), clr=1.0)
    full_load_crf_hz = oscillator(whole, conditions, model).natural_frequency_hz
    disturbance = disturbance or Disturbance()
    own, *draws = np.random.SeedSequence(seed).spawn(1 + samples)
    frequency = np.arange(0.0, rate_hz / 2.0 + GRID_HZ, GRID_HZ)
    background = _background(frequency, band_hz, disturbance, np.random.default_rng(own))
    recordings = []
    for number, draw in enumerate(draws):
        rng = np.random.default_rng(draw)
        true_sq = max(float(sq[number] + sq_std[number] * rng.standard_normal()), 0.1 * float(sq[number]))
        if case is None:
            crf = float(TRENDS[trend](np.array(true_sq)))
            state = dry_full_load(conditions, true_sq)
            state = replace(state, clr=min((crf / full_load_crf_hz) ** 6, 1.0))
        else:
            state = _solved(case, true_sq)
        for repeat in range(repeats):
            recording = _Test(number + 1, repeat + 1, float(sq[number]), float(sq_std[number]), rate_hz, duration_s)
            shift = repeat_std_hz * rng.standard_normal() / full_load_crf_hz
            clr = min(max(state.clr ** (1.0 / 6.0) + shift, 0.01) ** 6, 1.0)
            contact = _line(replace(state, clr=clr), conditions, model, frequency, rate_hz)
            recordings.append(_recording(recording, contact, background, disturbance, band_hz, rng))
    return Rig(
        recordings=tuple(recordings),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
        split_sq_m=KNEE_UM * 1e-6 if trend == "knee" and case is None else None,
        disturbance=disturbance,
        load_n=conditions.load,
        shaft_hz=(ROLLER_HZ, RING_HZ),
        case_text=_papers_case().text if case is None else case.text,
    )


def _papers_case() -> Case:
    """The paper's case file, with the Young's modulus of its section 4, which the rig's steel has."""
    case = load_case(files("asperity.paper").joinpath("paper.toml").read_text("utf-8"), name="paper.toml")
    return case.with_overrides({"material.youngs_modulus": [f"{one * 1e-9:g} GPa" for one in PAIR.youngs_moduli]})


def _contact(case: Case | None) -> tuple[ContactConditions, VibrationModel]:
    """The rig's contact and how it vibrates, or a case's."""
    if case is None:
        return papers_contact(LOAD), VibrationModel(mass=MASS, damping_ratio=DAMPING_RATIO)
    model = case.vibration
    if model is None:
        raise BadInput(f"{case.source}: vibration is left out; add [vibration] with mass and damping_ratio")
    if model.stiffness_law not in ASPERITIES_ALONE:
        raise BadInput(
            f"{case.source}: a rig's resonance follows the asperities' load, got the stiffness law "
            f"{model.stiffness_law!r}; take {' or '.join(ASPERITIES_ALONE)}"
        )
    return case.conditions, model


def _solved(case: Case, sq: float) -> ContactState:
    """The case's contact at another roughness."""
    rough = case.with_overrides({"surface.sq": f"{sq * 1e6!r} um"})
    solution = solve_contact(rough.conditions, rough.lubricant, rough.surface(), options=rough.options)
    state = contact_state(solution)
    if state.clr <= 0.0 or state.car <= 0.0:
        raise BadInput(
            f"{case.source}: no asperity touches at Sq {sq * 1e6:.2f} um, and a rig without contact has no truth to "
            "tell; roughen the surface or thin the oil"
        )
    return state


def write_rig(
    rig: Rig,
    folder: str | Path,
    *,
    file_format: str = "h5",
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write every recording, what is known of it, and the truth; return the recordings' paths.

    Beside the recordings stand table.csv (file, Sq and its deviation in um, load, roller speed: what a test engineer
    knows), truth.csv (what nobody knows: CRF, CRFA, damping, CLR, true Sq, SNR) and rig.toml, the case behind it.

    Parameters
    ----------
    file_format : "h5", 32-bit floats with rate and unit; "wav", 32-bit floats in m/s^2, with the rate alone
    progress : called with how many of how many are written

    Raises
    ------
    BadInput
        for an unknown format, a folder that is not empty or cannot be made.
    """
    if file_format not in WRITERS:
        raise BadInput(f"a rig's recordings are written as {' or '.join(WRITERS)}, got {file_format!r}")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInput(f"{folder} is not empty, and other files would be taken for recordings; name a new folder")
    except OSError as error:
        raise BadInput(f"cannot make the folder {folder}: {error.strerror}; choose another") from None
    paths = [folder / f"{recording.name}.{file_format}" for recording in rig.recordings]

    def write(recording: RigRecording, path: Path) -> None:
        with whole_file(path) as part:
            WRITERS[file_format](part, recording.signal())

    with ThreadPoolExecutor(max_workers=AT_ONCE) as pool:
        writing = [pool.submit(write, *pair) for pair in zip(rig.recordings, paths, strict=True)]
        try:
            for number, one in enumerate(writing, 1):
                one.result()
                if progress is not None:
                    progress(number, len(writing))
        finally:
            for one in writing:
                one.cancel()
    known: list[tuple[str, ...]] = [("file", "sq_um", "sq_um_std", "load_n", "speed_hz")]
    truth: list[tuple[str, ...]] = [
        ("file", "sample", "repeat", "true_sq_um", "clr", "crf_hz", "crfa", "damping_ratio", "snr_db")
    ]
    for recording, path in zip(rig.recordings, paths, strict=True):
        sq, sq_std, true_sq = (1e6 * m for m in (recording.sq_m, recording.sq_std_m, recording.true_sq_m))
        known.append((path.name, f"{sq:.4g}", f"{sq_std:.3g}", f"{rig.load_n:g}", f"{rig.shaft_hz[0]:g}"))
        figures = (true_sq, recording.clr, recording.crf_hz, recording.crfa, recording.damping_ratio, recording.snr_db)
        truth.append((path.name, str(recording.sample), str(recording.repeat), *(f"{one:.6g}" for one in figures)))
    for name, rows in (("table.csv", known), ("truth.csv", truth)):
        with whole_file(folder / name) as part:
            part.write_text("".join(",".join(row) + "\n" for row in rows), "utf-8")
    with whole_file(folder / "rig.toml") as part:
        part.write_text(rig.case_text, "utf-8")
    return paths


def _write_hdf5(path: Path, signal: Signal) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        values = file.create_dataset("acceleration", data=signal.values.astype(np.float32))
        values.attrs["sampling_rate_hz"] = signal.rate_hz
        values.attrs["unit"] = signal.unit


def _write_wav(path: Path, signal: Signal) -> None:
    from scipy.io import wavfile

    if signal.rate_hz != round(signal.rate_hz):
        raise BadInput(f"a wav file holds a whole number of samples a second, got {signal.rate_hz:g} Hz; take h5")
    wavfile.write(path, round(signal.rate_hz), signal.values.astype(np.float32))


WRITERS: dict[str, Callable[[Path, Signal], None]] = {"h5": _write_hdf5, "wav": _write_wav}


class _Test(NamedTuple):
    """Which test of which ring, and how it is recorded."""

    sample: int
    repeat: int
    sq_m: float
    sq_std_m: float
    rate_hz: float
    duration_s: float


class _Line(NamedTuple):
    """The contact's line: truth, and density on the grid as the accelerometer shows it."""

    sq_m: float
    clr: float
    crf_hz: float
    crfa: float
    damping_ratio: float
    density: Field


def _line(
    state: ContactState, conditions: ContactConditions, model: VibrationModel, frequency: Field, rate_hz: float
) -> _Line:
    """|H|^2 of the oscillator times the spectrum of what it rides over."""
    spring = oscillator(state, conditions, model)
    ridden_over = excitation(state, conditions, model)
    f0 = spring.natural_frequency_hz

    def density(at: Field) -> Field:
        return np.asarray(spring.gain(at) * ridden_over.density(at, rate_hz) * _accelerometer(at, rate_hz))

    heard = np.zeros(frequency.size)
    heard[1:] = density(frequency[1:])
    return _Line(state.sq, state.clr, f0, float(density(np.array(f0))), spring.damping_ratio, heard)


def _accelerometer(frequency: Field, rate_hz: float) -> Field:
    """Power response: flat, towards its mounted resonance rising, cut by the anti-aliasing filter."""
    x = frequency / MOUNTED_HZ
    mounted = 1.0 / ((1.0 - x**2) ** 2 + (2.0 * MOUNTED_DAMPING * x) ** 2)
    return np.asarray(mounted / (1.0 + (frequency / (LOWPASS * rate_hz)) ** 16))


class _Background(NamedTuple):
    """What is common to all recordings of a rig; powers within the band, 1 in all."""

    frequency: Field
    mode_hz: Field
    mode_damping: Field
    mode_power: Field
    floor: Field  # on the grid
    order: Field  # tones: multiples of their source's frequency,
    source: Field  # 0 roller, 1 ring, 2 mains,
    power: Field  # and mean squares


def _background(
    frequency: Field, band_hz: tuple[float, float], disturbance: Disturbance, rng: np.random.Generator
) -> _Background:
    """Modes, noise and tones, drawn: their shares of the power in the band 0.6, 0.3 and 0.1, give or take."""
    low, high = band_hz
    outside = disturbance.modes  # as many below and above the band as within it
    mode_hz = np.concatenate(
        [
            rng.uniform(low, high, disturbance.modes),
            rng.uniform(0.2 * low, 0.95 * low, outside),
            rng.uniform(1.05 * high, max(0.9 * frequency[-1], 1.1 * high), outside),
        ]
    )
    damping = np.exp(rng.uniform(np.log(0.004), np.log(0.03), mode_hz.size))
    shares = rng.gamma([6.0 if disturbance.modes else 1e-9, 3.0, 1.0])
    shares /= np.sum(shares)
    heights = 10.0 ** rng.uniform(-1.2, 0.0, mode_hz.size)  # of the peaks, 12 dB between the lowest and the highest
    power = heights * damping * mode_hz
    power *= shares[0] / max(float(np.sum(power[: disturbance.modes])), np.finfo(float).tiny)
    inside = (frequency >= low) & (frequency <= high)
    floor = (1.0 + (frequency / FLAT_BELOW_HZ) ** 2) ** (-0.5 * rng.uniform(0.0, 1.5))
    floor *= shares[1] / (float(np.sum(floor[inside])) * GRID_HZ)

    roller = np.arange(1.0, np.floor(0.8 * frequency[-1] / ROLLER_HZ))
    order = np.concatenate([roller, np.arange(1.0, RING_HARMONICS), np.arange(1.0, MAINS_HARMONICS)])
    source = np.repeat([0, 1, 2], [roller.size, RING_HARMONICS - 1, MAINS_HARMONICS - 1])
    tone_power = rng.exponential(1.0, order.size) / order
    in_band = (source == 0) & (order * ROLLER_HZ > low) & (order * ROLLER_HZ < high)
    tone_power *= shares[2] / float(np.sum(tone_power[in_band]))
    return _Background(frequency, mode_hz, damping, power, floor, order, source, tone_power)


def _recording(
    test: _Test,
    contact: _Line,
    background: _Background,
    disturbance: Disturbance,
    band_hz: tuple[float, float],
    rng: np.random.Generator,
) -> RigRecording:
    """The background as loud as the SNR says, a little louder or softer each time, with its modes moved a little."""
    frequency = background.frequency
    inside = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = float(np.sum(contact.density[inside])) * GRID_HZ
    wanted = power / 10.0 ** (disturbance.snr_db / 10.0)
    level = wanted * 10.0 ** (disturbance.gain_db * rng.standard_normal() / 10.0)
    gains = 10.0 ** (disturbance.mode_gain_db * rng.standard_normal(background.mode_hz.size) / 10.0)
    mode_hz = background.mode_hz * (1.0 + disturbance.mode_drift * rng.standard_normal())
    other = background.floor.copy()
    for f0, damping, loud in zip(mode_hz, background.mode_damping, background.mode_power * gains, strict=True):
        # inertance of a mode under a white force; ∫ = π f0/(4ζ) near the peak
        x2 = (frequency / f0) ** 2
        other += loud * 4.0 * damping / (np.pi * f0) * x2**2 / ((1.0 - x2) ** 2 + 4.0 * damping**2 * x2)
    sources = np.array([ROLLER_HZ, RING_HZ, MAINS_HZ])
    sources[:2] *= 1.0 + disturbance.speed_drift * rng.standard_normal(2)
    at = background.order * sources[background.source]
    heard = _accelerometer(at, test.rate_hz)
    heard_other = level * other * _accelerometer(frequency, test.rate_hz)
    in_band = (at >= band_hz[0]) & (at <= band_hz[1])
    tonal = level * float(np.sum((background.power * heard)[in_band]))
    return RigRecording(
        sample=test.sample,
        repeat=test.repeat,
        sq_m=test.sq_m,
        sq_std_m=test.sq_std_m,
        true_sq_m=contact.sq_m,
        clr=contact.clr,
        crf_hz=contact.crf_hz,
        crfa=contact.crfa,
        damping_ratio=contact.damping_ratio,
        snr_db=float(10.0 * np.log10(power / (np.sum(heard_other[inside]) * GRID_HZ + tonal))),
        rate_hz=test.rate_hz,
        duration_s=test.duration_s,
        frequency_hz=frequency,
        contact_density=contact.density,
        other_density=heard_other,
        tones=Tones(at, np.sqrt(2.0 * level * background.power * heard)),
        seed=int(rng.integers(2**63)),
    )
