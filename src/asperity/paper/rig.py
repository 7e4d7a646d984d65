"""The paper's rig, simulated: recordings of worn rings whose contact resonance is known, to judge methods by.

The contact is asperity's own oscillator over its own rough profile. What an accelerometer picks up
besides, and what fools a search for the highest point, is drawn anew for each rig: structural
modes, shaft and mains lines, noise.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import scipy

from asperity import ehl
from asperity.case import Case
from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.files import atomic_write, write_text
from asperity.core.limits import require_affordable
from asperity.core.signals import Signal
from asperity.coupling import STIFFNESS_LAWS, VibrationModel, dry_full_load, oscillator, search_band
from asperity.ehl import ContactState
from asperity.paper.contact import papers_contact, rig_case
from asperity.paper.numbers import (
    CRF_ENDS_HZ,
    DAMPING_RATIO,
    MASS,
    RIG_LOAD,
    SAMPLES_SQ_UM,
    SAMPLES_STD_UM,
    SHAFT_HZ,
)
from asperity.paper.rig_recording import (
    GRID_HZ,
    Disturbance,
    RigRecording,
    RigTest,
    contact_line,
    draw_background,
)
from asperity.solution import contact_state

RigTrend = Literal["knee", "smooth", "constant"]
RecordingFormat = Literal["h5", "wav"]

KNEE_UM, KNEE_HZ = (
    1.8,
    3640.0,
)  # in the printed split; the height is ours, the paper's figure has no numbers
SATURATION_UM = 0.8
CONSTANT_HZ = 3400.0
RATE_PER_BAND = 3.0  # sampling rate over the upper end of the search band, at least
SHORTEST_RECORD = 1000
MEASURED_STD = 2e-8  # of a worn surface's Sq, by a profilometer [m]; ours
SAMPLE_BYTES, SAMPLE_S = 50.0, 2e-7  # what a sample takes of memory and time
AT_ONCE = 2  # recordings made at the same time: 300 s at 20 kHz take 0.3 GB each


def _straight_with_knee(sq: Field) -> Field:
    at = np.array([SAMPLES_SQ_UM[0], KNEE_UM, SAMPLES_SQ_UM[-1]]) * 1e-6
    heights = np.array([CRF_ENDS_HZ[0], KNEE_HZ, CRF_ENDS_HZ[1]])
    slopes = np.diff(heights) / np.diff(at)
    return np.asarray(KNEE_HZ + np.where(sq < at[1], slopes[0], slopes[1]) * (sq - at[1]))


def _saturating(sq: Field) -> Field:
    grown = 1.0 - np.exp(-(sq * 1e6 - SAMPLES_SQ_UM[0]) / SATURATION_UM)
    whole = 1.0 - np.exp(-(SAMPLES_SQ_UM[-1] - SAMPLES_SQ_UM[0]) / SATURATION_UM)
    return np.asarray(CRF_ENDS_HZ[0] + (CRF_ENDS_HZ[1] - CRF_ENDS_HZ[0]) * grown / whole)


TRENDS: dict[RigTrend, Callable[[Field], Field]] = {  # CRF [Hz] over Sq [m]
    "knee": _straight_with_knee,
    "smooth": _saturating,
    "constant": lambda sq: np.full(np.shape(sq), CONSTANT_HZ),
}


class Moment(NamedTuple):
    """A contact that wears, when it is recorded: after so many hours, and its mean state then."""

    hours: float
    state: ContactState


@dataclass(frozen=True, kw_only=True)
class Rig:
    """Recordings and what is true of them all.

    `band_hz` is the contact's search band, in which SNR is counted; `full_load_crf_hz` the
    resonance with all load on asperities; `split_sq_m` where the trend has its knee, None where it
    has none; `case_text` a case file of the contact. `hours` of each sample, where one contact was
    recorded as it wore.
    """

    recordings: tuple[RigRecording, ...]
    band_hz: tuple[float, float]
    full_load_crf_hz: float
    split_sq_m: float | None
    disturbance: Disturbance
    load_n: float
    shaft_hz: tuple[float, ...]
    case_text: str
    hours: tuple[float, ...] | None = None


def simulate_rig(
    *,
    samples: int = len(SAMPLES_SQ_UM),
    repeats: int = 5,
    duration_s: float = 10.0,
    rate_hz: float = 20e3,
    disturbance: Disturbance | None = None,
    trend: RigTrend = "knee",
    repeat_std_hz: float = 15.0,
    seed: int = 7,
    case: Case | None = None,
    moments: Sequence[Moment] | None = None,
) -> Rig:
    """The paper's test, 12 worn rings 5 times each at 500 N, or another number of them spread over the same range.

    Parameters
    ----------
    duration_s, rate_hz : of each recording; the paper's are 300 s at 20 kHz
    disturbance : what is recorded besides the contact, by default at an SNR of 10 dB; its modes, levels and tones are
        drawn anew for each seed
    trend : name in TRENDS, the CRF over Sq: "knee", straight to 1.8 um and on at another slope, between the paper's
        ends; "smooth", a saturating exponential between them; "constant"
    repeat_std_hz : standard deviation of the true CRF from test to test
    seed : of everything drawn
    case : its contact solved at each Sq gives load and area shares, in place of `trend`; its load, radius, mass,
        damping (the solved contact's own, by the damping law "contact") and excitation make the line
    moments : of that case's contact as it wears, in place of contacts of its own at each Sq; a sample each

    Raises
    ------
    BadInput
        for numbers out of range, an unknown trend, a case without [vibration] or with a resonance that the rate
        cannot show.
    NotConverged
        if a contact of the case cannot be solved.
    """
    samples = len(moments or range(samples))
    _require_settings(samples, repeats, trend, repeat_std_hz, seed, duration_s, rate_hz)
    conditions, model = _contact(case)
    band_hz = _band(conditions, model, rate_hz)
    sq, sq_std = _measured(samples, moments, seed)
    full_load_crf_hz = _full_load_crf_hz(conditions, model, float(sq[0]))
    disturbance = disturbance or Disturbance()
    own, *draws = np.random.SeedSequence(seed).spawn(1 + samples)
    frequency = np.arange(0.0, rate_hz / 2.0 + GRID_HZ, GRID_HZ)
    background = draw_background(frequency, band_hz, disturbance, np.random.default_rng(own))
    recordings = []
    for number, draw in enumerate(draws):
        rng = np.random.default_rng(draw)
        true_sq = max(
            float(sq[number] + sq_std[number] * rng.standard_normal()), 0.1 * float(sq[number])
        )
        state, ridden = _on_trend(trend, true_sq, conditions, full_load_crf_hz), model
        if case is not None:
            state, ridden = (
                _touching(moments[number], model) if moments else _solved(case, true_sq, model)
            )
        for repeat in range(repeats):
            test = RigTest(
                number + 1,
                repeat + 1,
                float(sq[number]),
                float(sq_std[number]),
                rate_hz,
                duration_s,
            )
            tested = _shifted(state, repeat_std_hz * rng.standard_normal() / full_load_crf_hz)
            line = contact_line(tested, conditions, ridden, frequency, rate_hz)
            recordings.append(background.recorded(test, line, disturbance, rng))
    return Rig(
        recordings=tuple(recordings),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
        split_sq_m=KNEE_UM * 1e-6 if trend == "knee" and case is None else None,
        disturbance=disturbance,
        load_n=conditions.load,
        shaft_hz=SHAFT_HZ,
        case_text=(case or rig_case()).text,
        hours=None if moments is None else tuple(moment.hours for moment in moments),
    )


def _full_load_crf_hz(conditions: ContactConditions, model: VibrationModel, sq: float) -> float:
    """The resonance with all load on asperities [Hz]."""
    whole = replace(dry_full_load(conditions, sq), clr=1.0)
    return oscillator(
        whole, conditions, model.with_choices(damping_law="ratio")
    ).natural_frequency_hz


def _on_trend(
    trend: RigTrend, sq: float, conditions: ContactConditions, full_load_crf_hz: float
) -> ContactState:
    """A contact whose load share gives the trend's CRF."""
    clr = min((float(TRENDS[trend](np.array(sq))) / full_load_crf_hz) ** 6, 1.0)
    return replace(dry_full_load(conditions, sq), clr=clr)


def _shifted(state: ContactState, shift: float) -> ContactState:
    """The same contact with so much more CRF, relative to that of all load on asperities."""
    return replace(state, clr=min(max(state.clr ** (1.0 / 6.0) + shift, 0.01) ** 6, 1.0))


def _measured(samples: int, moments: Sequence[Moment] | None, seed: int) -> tuple[Field, Field]:
    """What a profilometer says of each sample's Sq, and its deviation [m]: the paper's rings, or a contact that wears.

    Of the paper's rings the true Sq is drawn about it, of a contact that wears it is drawn about
    the true one.
    """
    if moments is None:
        positions = (
            np.linspace(0.0, len(SAMPLES_SQ_UM) - 1.0, samples) if samples > 1 else np.zeros(1)
        )
        sq, std = (
            np.interp(positions, range(len(um)), um) * 1e-6
            for um in (SAMPLES_SQ_UM, SAMPLES_STD_UM)
        )
        return sq, std
    off = MEASURED_STD * np.random.default_rng([seed, samples]).standard_normal(samples)
    true = np.array([moment.state.sq for moment in moments])
    return np.maximum(true + off, 0.1 * true), np.full(samples, MEASURED_STD)


def _touching(moment: Moment, model: VibrationModel) -> tuple[ContactState, VibrationModel]:
    """The contact of a moment, and the model as it is."""
    if moment.state.clr <= 0.0 or moment.state.car <= 0.0:
        raise BadInput(
            f"no asperity touches after {moment.hours:g} h, and a rig without contact has no truth to tell; "
            "record it earlier"
        )
    return moment.state, model


def _require_settings(
    samples: int,
    repeats: int,
    trend: str,
    repeat_std_hz: float,
    seed: int,
    duration_s: float,
    rate_hz: float,
) -> None:
    if samples < 1 or repeats < 1:
        raise BadInput(f"a rig needs at least 1 sample and 1 repeat, got {samples} and {repeats}")
    require_choice("rig trend", trend, TRENDS)
    if not repeat_std_hz >= 0.0:
        raise BadInput(f"CRF deviation between repeats must be 0 or more, got {repeat_std_hz:g} Hz")
    if seed < 0:
        raise BadInput(f"rig seed must be 0 or more, got {seed}")

    require_positive("rig recording's duration", duration_s, "s")
    require_positive("rig sampling rate", rate_hz, "Hz")
    length = duration_s * rate_hz
    require_affordable(
        f"a wear test of {samples} samples x {repeats} recordings of {duration_s:g} s at {rate_hz:g} Hz",
        memory=AT_ONCE * SAMPLE_BYTES * length + 8.0 * rate_hz / GRID_HZ * samples * repeats,
        seconds=SAMPLE_S * length * samples * repeats,
    )
    if round(length) < SHORTEST_RECORD:
        record = f"{duration_s:g} s at {rate_hz:g} Hz"
        raise BadInput(
            f"a rig recording needs at least {SHORTEST_RECORD} samples, got {record}; lengthen it"
        )


def _band(
    conditions: ContactConditions, model: VibrationModel, rate_hz: float
) -> tuple[float, float]:
    """The search band [Hz], which the sampling rate must be able to show."""
    band_hz = search_band(conditions, model)
    if rate_hz < RATE_PER_BAND * band_hz[1]:
        least = f"{RATE_PER_BAND:g} times the upper end of the search band, {band_hz[1]:.0f} Hz"
        raise BadInput(f"rig sampling rate must be at least {least}, got {rate_hz:g} Hz; raise it")
    return band_hz


def _contact(case: Case | None) -> tuple[ContactConditions, VibrationModel]:
    """The rig's contact and how it vibrates, or a case's."""
    if case is None:
        return papers_contact(RIG_LOAD), VibrationModel(mass=MASS, damping_ratio=DAMPING_RATIO)
    model = case.vibration
    if model is None:
        raise BadInput(
            f"{case.source}: vibration is left out; add [vibration] with mass and damping_ratio"
        )
    if not model.stiffness_law.asperities_alone:
        usable = " or ".join(name for name, law in STIFFNESS_LAWS.items() if law.asperities_alone)
        raise BadInput(
            f"{case.source}: a rig's resonance follows the asperities' load, got the stiffness law "
            f"{model.stiffness_law.name!r}; take {usable}"
        )
    return case.conditions, model


def _solved(case: Case, sq: float, model: VibrationModel) -> tuple[ContactState, VibrationModel]:
    """The case's contact at another roughness; and the model with that contact's damping, where it is to have it."""
    rough = case.with_overrides({"surface.sq": f"{sq * 1e6!r} um"})
    solution = ehl.solve_contact(
        rough.conditions, rough.lubricant, rough.surface(), options=rough.options
    )
    state = contact_state(solution)
    if state.clr <= 0.0 or state.car <= 0.0:
        raise BadInput(
            f"{case.source}: no asperity touches at Sq {sq * 1e6:.2f} um, and a rig without contact has no truth to "
            "tell; roughen the surface or thin the oil"
        )
    if (
        model.damping_law.needs_solution
    ):  # of the ring: its tests scatter in load share, not in damping
        damped = oscillator(state, rough.conditions, model, solution=solution).damping_ratio
        model = model.with_choices(damping_law="ratio", damping_ratio=damped)
    return state, model


def write_rig(
    rig: Rig,
    folder: str | Path,
    *,
    file_format: RecordingFormat = "h5",
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write every recording, what is known of it, and the truth; return the recordings' paths.

    Beside the recordings stand table.csv (file, Sq and its deviation in um, load, roller speed:
    what a test engineer knows), truth.csv (what nobody knows: CRF, CRFA, damping, CLR, true Sq,
    SNR) and rig.toml, the case behind it.

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
        raise BadInput(
            f"a rig's recordings are written as {' or '.join(WRITERS)}, got {file_format!r}"
        )
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInput(
                f"{folder} is not empty, and other files would be taken for recordings; name a new folder"
            )
    except OSError as error:
        raise BadInput(
            f"cannot make the folder {folder}: {error.strerror}; choose another"
        ) from None
    paths = [folder / f"{recording.name}.{file_format}" for recording in rig.recordings]

    def write(recording: RigRecording, path: Path) -> None:
        with atomic_write(path) as part:
            WRITERS[file_format](part, recording.signal())

    pool = ThreadPoolExecutor(max_workers=AT_ONCE)
    try:
        for number, _ in enumerate(pool.map(write, rig.recordings, paths), 1):
            if progress is not None:
                progress(number, len(paths))
    finally:
        pool.shutdown(cancel_futures=True)
    _write_tables(rig, paths, folder)
    write_text(folder / "rig.toml", rig.case_text)
    return paths


def _write_tables(rig: Rig, paths: Sequence[Path], folder: Path) -> None:
    when = () if rig.hours is None else ("hours",)
    known: list[tuple[str, ...]] = [("file", *when, "sq_um", "sq_um_std", "load_n", "speed_hz")]
    truth: list[tuple[str, ...]] = [
        (
            "file",
            "sample",
            "repeat",
            "true_sq_um",
            "clr",
            "crf_hz",
            "crfa",
            "damping_ratio",
            "snr_db",
        )
    ]
    for recording, path in zip(rig.recordings, paths, strict=True):
        sq, sq_std, true_sq = (
            1e6 * m for m in (recording.sq_m, recording.sq_std_m, recording.true_sq_m)
        )
        at = () if rig.hours is None else (f"{rig.hours[recording.sample - 1]:.6g}",)
        known.append(
            (
                path.name,
                *at,
                f"{sq:.4g}",
                f"{sq_std:.3g}",
                f"{rig.load_n:g}",
                f"{rig.shaft_hz[0]:g}",
            )
        )
        figures = (
            true_sq,
            recording.clr,
            recording.crf_hz,
            recording.crfa,
            recording.damping_ratio,
            recording.snr_db,
        )
        truth.append(
            (
                path.name,
                str(recording.sample),
                str(recording.repeat),
                *(f"{value:.6g}" for value in figures),
            )
        )
    for name, rows in (("table.csv", known), ("truth.csv", truth)):
        write_text(folder / name, "".join(",".join(row) + "\n" for row in rows))


def _write_hdf5(path: Path, signal: Signal) -> None:
    import h5py

    made = BytesIO()  # in memory: the HDF5 library does not survive a disk that is full
    with h5py.File(made, "w") as file:
        values = file.create_dataset("acceleration", data=signal.values.astype(np.float32))
        values.attrs["sampling_rate_hz"] = signal.rate_hz
        values.attrs["unit"] = signal.unit
    path.write_bytes(made.getvalue())


def _write_wav(path: Path, signal: Signal) -> None:
    if signal.rate_hz != round(signal.rate_hz):
        raise BadInput(
            f"a wav file holds a whole number of samples a second, got {signal.rate_hz:g} Hz; take h5"
        )
    scipy.io.wavfile.write(path, round(signal.rate_hz), signal.values.astype(np.float32))


WRITERS: dict[RecordingFormat, Callable[[Path, Signal], None]] = {
    "h5": _write_hdf5,
    "wav": _write_wav,
}
