"""Simulated wear test of the paper's rig: recordings with known resonance, to test methods.

The contact is asperity's own oscillator on its own rough profile. The disturbances of an
accelerometer signal are drawn anew for each rig: structural modes, shaft and mains lines, noise.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from asperity import ehl
from asperity import solution as postprocessing
from asperity.case import Case
from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.limits import require_affordable
from asperity.coupling import (
    STIFFNESS_LAWS,
    VibrationModel,
    dry_full_load,
    oscillator,
    search_band,
    structural_resonance,
)
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
    ContactLine,
    Disturbance,
    RigRecording,
    RigTest,
    StructureLines,
    contact_line,
    draw_background,
)
from asperity.structure import NamedStructure

RigTrend = Literal["knee", "smooth", "constant"]

KNEE_UM, KNEE_HZ = (
    1.8,
    3640.0,
)  # in the published split; the height is ours (no numbers in the paper)
SATURATION_UM = 0.8
CONSTANT_HZ = 3400.0
MIN_RATE_RATIO = 3.0  # of the sampling rate to the upper end of the search band
MIN_RECORD = 1000  # samples
PROFILOMETER_STD = 2e-8  # standard deviation of the measured Sq of a worn surface [m]; ours
SAMPLE_BYTES, SAMPLE_S = 50.0, 2e-7  # memory [B] and time [s] per sample
WRITERS_AT_ONCE = 2  # recordings generated in parallel: 300 s at 20 kHz take 0.3 GB each


def _straight_with_knee(sq: Field) -> Field:
    nodes = np.array([SAMPLES_SQ_UM[0], KNEE_UM, SAMPLES_SQ_UM[-1]]) * 1e-6
    crf_hz = np.array([CRF_ENDS_HZ[0], KNEE_HZ, CRF_ENDS_HZ[1]])
    slopes = np.diff(crf_hz) / np.diff(nodes)
    return np.asarray(KNEE_HZ + np.where(sq < nodes[1], slopes[0], slopes[1]) * (sq - nodes[1]))


def _saturating(sq: Field) -> Field:
    growth = 1.0 - np.exp(-(sq * 1e6 - SAMPLES_SQ_UM[0]) / SATURATION_UM)
    full_load = 1.0 - np.exp(-(SAMPLES_SQ_UM[-1] - SAMPLES_SQ_UM[0]) / SATURATION_UM)
    return np.asarray(CRF_ENDS_HZ[0] + (CRF_ENDS_HZ[1] - CRF_ENDS_HZ[0]) * growth / full_load)


TRENDS: dict[RigTrend, Callable[[Field], Field]] = {  # CRF [Hz] over Sq [m]
    "knee": _straight_with_knee,
    "smooth": _saturating,
    "constant": lambda sq: np.full(np.shape(sq), CONSTANT_HZ),
}


class Moment(NamedTuple):
    """Mean state of a wearing contact after so many hours."""

    hours: float
    state: ContactState


@dataclass(frozen=True, slots=True, kw_only=True)
class RigSettings:
    """Settings of a simulated wear test; by default the paper's 12 rings, 5 tests each, 10 s long.

    `samples` are spread over the paper's range of Sq, with `repeats` tests each. `duration_s` and
    `rate_hz` are those of each recording (in the paper 300 s at 20 kHz). `trend` is the CRF over
    Sq: "knee", straight to 1.8 um and on at another slope, between the paper's ends; "smooth", a
    saturating exponential between them; "constant". `repeat_std_hz` is the standard deviation of
    the true CRF between tests, `seed` the random seed.

    Raises
    ------
    BadInput
        for numbers out of range or an unknown trend.
    """

    samples: int = len(SAMPLES_SQ_UM)
    repeats: int = 5
    duration_s: float = 10.0
    rate_hz: float = 20e3
    trend: RigTrend = "knee"
    repeat_std_hz: float = 15.0
    seed: int = 7

    def __post_init__(self) -> None:
        if self.samples < 1 or self.repeats < 1:
            raise BadInput(
                f"a rig needs at least 1 sample and 1 repeat, got {self.samples} and {self.repeats}"
            )
        require_choice("rig trend", self.trend, TRENDS)
        if not self.repeat_std_hz >= 0.0:
            raise BadInput(
                f"CRF deviation between repeats must be 0 or more, got {self.repeat_std_hz:g} Hz"
            )
        if self.seed < 0:
            raise BadInput(f"rig seed must be 0 or more, got {self.seed}")
        require_positive("rig recording's duration", self.duration_s, "s")
        require_positive("rig sampling rate", self.rate_hz, "Hz")
        length = self.duration_s * self.rate_hz
        tests = self.samples * self.repeats
        record = f"{self.duration_s:g} s at {self.rate_hz:g} Hz"
        require_affordable(
            f"a wear test of {self.samples} samples x {self.repeats} recordings of {record}",
            memory=WRITERS_AT_ONCE * SAMPLE_BYTES * length + 8.0 * self.rate_hz / GRID_HZ * tests,
            seconds=SAMPLE_S * length * tests,
        )
        if round(length) < MIN_RECORD:
            raise BadInput(
                f"a rig recording needs at least {MIN_RECORD} samples, got {record}; lengthen it"
            )


@dataclass(frozen=True, kw_only=True)
class Rig:
    """Recordings of a simulated wear test, and their common properties.

    `band_hz` is the contact's search band, in which SNR is defined; `full_load_crf_hz` the
    resonance with all load on asperities; `split_sq_m` the knee of the trend, None without one;
    `case_text` a case file of the contact; `hours` of each sample, if one wearing contact was
    recorded.
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
    settings: RigSettings | None = None,
    *,
    disturbance: Disturbance | None = None,
    case: Case | None = None,
    moments: Sequence[Moment] | None = None,
) -> Rig:
    """Simulate the paper's wear test: worn rings at 500 N, several recordings each.

    Parameters
    ----------
    settings : size and trend of the test; default `RigSettings()`
    disturbance : signals besides the contact, drawn anew for each seed; default `Disturbance()`
    case : its contact, solved at each Sq, gives load and area shares instead of the trend; its
        load, radius, mass, damping (for the damping law "contact" that of the solved contact) and
        excitation define the line; its structure, if it has one, the modes
    moments : states of that case's contact as it wears, one sample each, instead of contacts solved
        at each Sq

    Raises
    ------
    BadInput
        for a case without [vibration], or a resonance too high for the sampling rate.
    NotConverged
        if a contact of the case cannot be solved.
    """
    settings = settings or RigSettings()
    if moments:
        settings = replace(settings, samples=len(moments))
    conditions, model = _contact(case)
    structure = None if case is None else case.structure
    band_hz = _band(conditions, model, settings.rate_hz, structure)
    sq, sq_std = _measured(settings.samples, moments, settings.seed)
    full_load_crf_hz = _full_load_crf_hz(conditions, model, float(sq[0]), structure)
    disturbance = disturbance or Disturbance()
    rings = _Rings(settings, case, moments, conditions, model, full_load_crf_hz)
    readings = list(zip(sq.tolist(), sq_std.tolist(), strict=True))
    return Rig(
        recordings=tuple(rings.recordings(readings, band_hz, disturbance)),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
        split_sq_m=KNEE_UM * 1e-6 if settings.trend == "knee" and case is None else None,
        disturbance=disturbance,
        load_n=conditions.load,
        shaft_hz=SHAFT_HZ,
        case_text=_case_text(case or rig_case()),
        hours=None if moments is None else tuple(moment.hours for moment in moments),
    )


def _case_text(case: Case) -> str:
    """Return the case as TOML for another folder: a structure's file with its whole path."""
    stated = case.contents.structure
    if stated is None or not Path(stated).suffix:
        return case.text
    return case.with_written({"structure": str((case.folder / stated).absolute())}).text


class _Rings(NamedTuple):
    """Contacts of the rings of a test."""

    settings: RigSettings
    case: Case | None
    moments: Sequence[Moment] | None
    conditions: ContactConditions
    model: VibrationModel
    full_load_crf_hz: float

    @property
    def frequency(self) -> Field:
        """Frequency grid of densities [Hz]."""
        return np.arange(0.0, self.settings.rate_hz / 2.0 + GRID_HZ, GRID_HZ)

    def recordings(
        self,
        readings: Sequence[tuple[float, float]],
        band_hz: tuple[float, float],
        disturbance: Disturbance,
    ) -> Iterator[RigRecording]:
        """Yield all recordings, from the profilometer's Sq and its standard deviations [m]."""
        seeds = np.random.SeedSequence(self.settings.seed).spawn(1 + len(readings))
        background_rng, *draws = (np.random.default_rng(seed) for seed in seeds)
        background = draw_background(self.frequency, band_hz, disturbance, background_rng)
        for number, (rng, reading) in enumerate(zip(draws, readings, strict=True), 1):
            for test, line in self._tests(number, reading, rng):
                yield background.recording(test, line, disturbance, rng)

    def _tests(
        self, number: int, reading: tuple[float, float], rng: np.random.Generator
    ) -> Iterator[tuple[RigTest, ContactLine]]:
        """Yield the tests of a ring."""
        (sq, std) = reading
        settings = self.settings
        true_sq = max(sq + std * float(rng.standard_normal()), 0.1 * sq)
        state, model = self._contact(number - 1, true_sq)
        for repeat in range(1, settings.repeats + 1):
            test = RigTest(number, repeat, sq, std, settings.rate_hz, settings.duration_s)
            yield test, self._line(state, model, rng)

    def _contact(self, index: int, true_sq: float) -> tuple[ContactState, VibrationModel]:
        """Return a sample's contact and its vibration model."""
        if self.case is None:
            trend = self.settings.trend
            return _on_trend(trend, true_sq, self.conditions, self.full_load_crf_hz), self.model
        if self.moments:
            return _touching(self.moments[index]), self.model
        return _solved(self.case, true_sq, self.model)

    def _line(
        self, state: ContactState, model: VibrationModel, rng: np.random.Generator
    ) -> ContactLine:
        """Return the line of a test, shifted at random."""
        shift = self.settings.repeat_std_hz * rng.standard_normal() / self.full_load_crf_hz
        rate_hz = self.settings.rate_hz
        structure = None if self.case is None else self.case.structure
        if structure is None:
            shifted = _shifted(state, shift)
            return contact_line(shifted, self.conditions, model, self.frequency, rate_hz)
        lines = StructureLines(structure, self.conditions, model)
        return lines.line(state, self.frequency, rate_hz, shift)


def _full_load_crf_hz(
    conditions: ContactConditions,
    model: VibrationModel,
    sq: float,
    structure: NamedStructure | None,
) -> float:
    """Return the resonance with all load on asperities [Hz]."""
    if structure is not None:
        return structural_resonance(structure, conditions, model).full_load_hz
    full_load = replace(dry_full_load(conditions, sq), clr=1.0)
    return oscillator(
        full_load, conditions, model.with_choices(damping_law="ratio")
    ).natural_frequency_hz


def _on_trend(
    trend: RigTrend, sq: float, conditions: ContactConditions, full_load_crf_hz: float
) -> ContactState:
    """Return a contact state whose load share gives the trend's CRF."""
    clr = min((float(TRENDS[trend](np.array(sq))) / full_load_crf_hz) ** 6, 1.0)
    return replace(dry_full_load(conditions, sq), clr=clr)


def _shifted(state: ContactState, shift: float) -> ContactState:
    """Return the state with its CRF shifted, relative to the full-load CRF."""
    return replace(state, clr=min(max(state.clr ** (1.0 / 6.0) + shift, 0.01) ** 6, 1.0))


def _measured(samples: int, moments: Sequence[Moment] | None, seed: int) -> tuple[Field, Field]:
    """Return the measured Sq of each sample and its standard deviation [m].

    For the paper's rings the true Sq is drawn about the measured one; for a wearing contact the
    measured Sq is drawn about the true one.
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
    errors = PROFILOMETER_STD * np.random.default_rng([seed, samples]).standard_normal(samples)
    true = np.array([moment.state.sq for moment in moments])
    return np.maximum(true + errors, 0.1 * true), np.full(samples, PROFILOMETER_STD)


def _touching(moment: Moment) -> ContactState:
    """Return the state of a moment with asperity contact."""
    if moment.state.clr <= 0.0 or moment.state.car <= 0.0:
        raise BadInput(
            f"no asperity touches after {moment.hours:g} h, but the simulated rig needs asperity "
            "contact; record earlier"
        )
    return moment.state


def _band(
    conditions: ContactConditions,
    model: VibrationModel,
    rate_hz: float,
    structure: NamedStructure | None,
) -> tuple[float, float]:
    """Return the search band [Hz], if the sampling rate resolves it."""
    if structure is None:
        band_hz = search_band(conditions, model)
    else:
        band_hz = structural_resonance(structure, conditions, model).band_hz
    if rate_hz < MIN_RATE_RATIO * band_hz[1]:
        minimum = f"{MIN_RATE_RATIO:g} times the upper end of the search band, {band_hz[1]:.0f} Hz"
        raise BadInput(
            f"rig sampling rate must be at least {minimum}, got {rate_hz:g} Hz; raise it"
        )
    return band_hz


def _contact(case: Case | None) -> tuple[ContactConditions, VibrationModel]:
    """Return the conditions and the vibration model of the rig, or of a case."""
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
            f"{case.source}: a rig needs a stiffness law of the asperities alone, got "
            f"{model.stiffness_law.name!r}; use {usable}"
        )
    return case.conditions, model


def _solved(case: Case, sq: float, model: VibrationModel) -> tuple[ContactState, VibrationModel]:
    """Return the case's contact at another Sq, and the model with that contact's damping."""
    rough = case.with_written({"surface.sq": f"{sq * 1e6!r} um"})
    solution = ehl.solve_contact(
        rough.conditions, rough.lubricant, rough.surface(), options=rough.options
    )
    state = postprocessing.contact_state(solution)
    if state.clr <= 0.0 or state.car <= 0.0:
        raise BadInput(
            f"{case.source}: no asperity touches at Sq {sq * 1e6:.2f} um, but the simulated rig "
            "needs asperity contact; use a rougher surface or a thinner oil"
        )
    if model.damping_law.needs_solution:  # once per ring: tests differ in load share only
        damped = oscillator(state, rough.conditions, model, solution=solution).damping_ratio
        model = model.with_choices(damping_law="ratio", damping_ratio=damped)
    return state, model
