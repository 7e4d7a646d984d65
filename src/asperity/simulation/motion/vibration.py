"""Vibration of a mass on a contact over its history, independent of the paper's coupling.

The load is prescribed at every step, so the approach of the bodies is the path of a slow mass: it
is the profile, and the tangent stiffness of the solved contact is the spring. No height from Sq,
no cut-off from CAR, no sphere's stiffness from CLR is used; the paper's coupling is evaluated on
the same history for comparison.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy

from asperity import coupling
from asperity.core.arrays import Field
from asperity.core.documents import JsonObject
from asperity.core.errors import AsperityError, BadInput, NotConverged
from asperity.core.quantities import lines, quantity, read
from asperity.core.signals import Signal, Spectrum, power_spectrum
from asperity.coupling import (
    MAX_LINEAR_LOAD,
    Tangent,
    Vibration,
    VibrationModel,
    band_about,
    contact_vibration,
)
from asperity.ehl import ContactSolution, Scales
from asperity.resonance import FEWEST_LINES, Resonance, contact_resonance, no_resonance
from asperity.simulation.motion.history import History
from asperity.solution import OscillatingContact, solve_thermal_contact, tangent_stiffness
from asperity.surface import MovingSurfaces
from asperity.vibration import ContactOscillator, acceleration

MOMENTS = 5  # settled steps at which the tangent stiffness is evaluated
WAVES = 0.4  # of a passage's steps: the shortest resolved wave has 2.5 steps
DECAY_TIMES = 12.0  # time constants of the oscillator: the transient decays to e^-12
# linear interpolation between samples then reduces the resonance's power by 0.2 %
SAMPLES_PER_PERIOD = 60.0
MIN_APPROACH = 1e-5  # of a²/R: smaller variation is within the solver's tolerance


@dataclass(frozen=True, kw_only=True)
class HistoryVibration:
    """Vibration excited by a history, as an accelerometer would record it.

    `oscillator` has the mean of `stiffness` [N/m], shape (moments,), the tangent stiffness of the
    contact at the steps `moments`; steps at which a neighbouring load could not be solved are in
    `unsolved`. `damping` is the contact's own damping ratio at the moments, where the mass
    resonates on its dynamic stiffness `dynamic` [N/m], with yielded cells elastic; nan where not
    determined, the last reason in `damping_failure`. `profile` [m] is the variation of the bodies'
    approach over one passage of the rough track, repeated periodically; `response` [m/s^2] and
    `spectrum` are the steady response to it, whose lines are `spacing_hz` apart, speed over track.
    `not_periodic` is the rms of the approach's non-repeating part over its total rms. Without
    roughness, or where nothing repeats, these are None and `resonance.reason` states why;
    `resonance` is estimated as in any recording, `coupled` is the vibration of the history's mean
    contact by the paper's coupling.
    """

    oscillator: ContactOscillator
    stiffness: Field
    moments: tuple[int, ...]
    unsolved: tuple[int, ...]
    spacing_hz: float | None
    resonance: Resonance
    coupled: Vibration
    damping: Field
    dynamic: Field
    damping_failure: str = ""
    profile: Signal | None = None
    response: Signal | None = None
    spectrum: Spectrum | None = None
    not_periodic: float | None = None

    @property
    def dynamic_load(self) -> float | None:
        """Root mean square of the dynamic force over the load; linear theory holds below 0.2."""
        if self.response is None or self.oscillator.load is None:
            return None
        return float(self.oscillator.mass * np.std(self.response.values) / self.oscillator.load)

    @property
    def crf_hz(self) -> float | None:
        """Resonance found in the history [Hz]."""
        return self.resonance.crf_hz if self.resonance.found else None

    @property
    def coupled_crf_hz(self) -> float | None:
        """Resonance by the paper's coupling [Hz]."""
        return self.coupled.resonance.crf_hz if self.coupled.resonance.found else None

    @property
    def stiffness_std(self) -> float:
        """Standard deviation of the tangent stiffness over the moments [N/m]."""
        return float(np.std(self.stiffness))

    @property
    def natural_frequency_std_hz(self) -> float:
        """Standard deviation of the natural frequency over the moments [Hz]."""
        f0 = self.oscillator.natural_frequency_hz
        return 0.5 * f0 * float(np.std(self.stiffness) / np.mean(self.stiffness))

    @property
    def damping_ratio(self) -> float:
        """Mean of the contact's own damping ratio over the moments that have one, or nan."""
        return _mean(self.damping)

    @property
    def damping_std(self) -> float:
        """Standard deviation of the contact's own damping ratio over the moments."""
        return _spread(self.damping)

    @property
    def dynamic_stiffness(self) -> float:
        """Mean dynamic stiffness at which the mass resonates [N/m], or nan."""
        return _mean(self.dynamic)

    @property
    def dynamic_stiffness_std(self) -> float:
        """Standard deviation of the dynamic stiffness over the moments [N/m]."""
        return _spread(self.dynamic)

    @property
    def approach_std(self) -> float | None:
        """Root mean square of the profile [m]."""
        return None if self.profile is None else float(np.std(self.profile.values))

    def verdict(self) -> str:
        """Return one sentence: the contact's own resonance, the paper's, and the excitation."""
        f0 = self.oscillator.natural_frequency_hz
        coupled = self.coupled.oscillator
        force = self.dynamic_load
        by_paper = "none" if coupled is None else f"{coupled.natural_frequency_hz:.0f} Hz"
        sentence = (
            f"Resonance from the tangent stiffness at {len(self.moments)} moments: {f0:.0f} ± "
            f"{self.natural_frequency_std_hz:.0f} Hz, from the paper's coupling: {by_paper}"
        )
        ratio = quantity("history_damping_ratio")
        if np.isfinite(self.damping_ratio):
            damping = ratio.text(self.damping_ratio, self.damping_std)
            sentence += f"; damping ratio of the oil film {damping}"
        else:
            sentence += f"; damping not determined ({self.damping_failure})"
        if self.approach_std is not None and force is not None:
            sentence += (
                f"; excitation {1e9 * self.approach_std:.3g} nm rms, dynamic force "
                f"{100 * force:.0f} % of the load"
            )
            if force > MAX_LINEAR_LOAD:
                sentence += ", too large for a linear spring"
        if self.resonance.found:
            return f"{sentence}; the history shows {self.resonance.crf_hz:.0f} Hz."
        return f"{sentence}; the history shows no resonance ({self.resonance.reason})."

    def scalars(self) -> JsonObject:
        """Return the additional values of `asperity run --listen --json`."""
        reasons = {
            "history_crf_reason": self.resonance.reason,
            "tangent_unsolved": list(self.unsolved),
        }
        return read(self, lines("history_vibration")) | reasons


def history_vibration(
    history: History, model: VibrationModel | None = None, *, moments: int = MOMENTS
) -> HistoryVibration:
    """Compute the vibration of a mass over a history.

    Parameters
    ----------
    history : its settled steps are used, at least one passage of the rough track
    model : mass, damping law, reference depth and indicator; by default the case's. Its stiffness
        law and excitation apply to `coupled` only; laws that need a solved contact are replaced
        by the paper's there
    moments : number of settled steps, spread evenly, over which the tangent stiffness is averaged

    Raises
    ------
    BadInput
        for no model, no moments, and as `contact_vibration`.
    NotConverged
        if the tangent stiffness could not be computed at any of the moments.
    """
    case = history.case
    model = case.vibration if model is None else model
    if model is None:
        raise BadInput(
            f"{case.source}: vibration is missing; add [vibration] with mass and damping_ratio"
        )
    if moments < 1:
        raise BadInput(f"moments must be 1 or more, got {moments}; the default is {MOMENTS}")
    surfaces = history.surfaces()
    samples = _moments(history, surfaces, model, moments)
    stiffness = samples.stiffness
    with case.naming("vibration"):
        oscillator = coupling.damped_oscillator(
            float(np.mean(stiffness)), case.conditions.load, model
        )
        coupled = _coupled(history, model)
    f0 = oscillator.natural_frequency_hz
    period, objection = _period(surfaces)
    profile, not_periodic, objection = (
        (None, None, objection) if period is None else _passage(history, period)
    )
    vibration = HistoryVibration(
        oscillator=oscillator,
        stiffness=stiffness,
        moments=samples.steps,
        unsolved=samples.unsolved,
        damping=samples.damping,
        dynamic=samples.dynamic,
        damping_failure=samples.failure,
        spacing_hz=None if period is None else 1.0 / period,
        resonance=no_resonance(objection or "", band_about(f0), model.method),
        coupled=coupled,
    )
    if profile is None:
        return vibration
    profile = resampled(profile, SAMPLES_PER_PERIOD * f0)
    response = steady_response(oscillator, profile)
    spectrum = power_spectrum(response, window="boxcar")
    return replace(
        vibration,
        profile=profile,
        response=response,
        spectrum=spectrum,
        not_periodic=not_periodic,
        resonance=_resonance(spectrum, f0, model),
    )


def _coupled(history: History, model: VibrationModel) -> Vibration:
    """Return the vibration of the mean contact by the paper's coupling."""
    if model.needs_solution:
        model = model.with_choices(stiffness_law="hertz-point", excitation="noise")
    return contact_vibration(history.mean_state, history.case.conditions, model)


def _passage(history: History, period: float) -> tuple[Signal | None, float | None, str | None]:
    """Return the repeating approach of the bodies; none if it does not vary."""
    rows, case = history.settled, history.case
    profile, not_periodic, objection = repeating(
        rows["time_s"].to_numpy(), rows["rigid_approach_m"].to_numpy(), period
    )
    if (
        profile is not None
        and np.std(profile.values)
        < MIN_APPROACH * Scales.from_conditions(case.conditions, case.lubricant).gap
    ):
        return (
            None,
            None,
            "the approach of the bodies does not vary: nothing excites a vibration",
        )
    return profile, not_periodic, objection


def repeating(
    time: Field, heights: Field, period: float
) -> tuple[Signal | None, float, str | None]:
    """Return one period of the repeating part of `heights` [m], without its mean.

    `time` [s] is evenly spaced, both have shape (steps,). The period's waves are fitted by least
    squares, so it need not be a whole number of steps. Also returns the rms of the remainder over
    the rms of the heights, and the reason if there is no period (or None).
    """
    step = (time[-1] - time[0]) / (time.size - 1)
    length = period / step
    if time.size < length:
        missing = (
            f"{time.size} settled steps are fewer than a passage of the rough track, {length:.0f}"
        )
        return (
            None,
            math.nan,
            f"{missing}; extend the history by {math.ceil(length) - time.size} steps",
        )
    waves = int(WAVES * length)
    samples = math.ceil(length)
    coefficients, remainder = _fitted_waves(time / period, heights, waves)
    spectrum = np.zeros(samples // 2 + 1, dtype=complex)
    spectrum[1 : waves + 1] = (
        samples / 2.0 * (coefficients[1 : waves + 1] - 1j * coefficients[waves + 1 :])
    )
    return Signal(np.fft.irfft(spectrum, samples), samples / period, "m"), remainder, None


def _fitted_waves(periods: Field, heights: Field, waves: int) -> tuple[Field, float]:
    """Return the coefficients of a fitted Fourier series, and the relative rms of the remainder."""
    phase = 2.0 * np.pi * np.outer(periods, np.arange(1, waves + 1))
    basis = np.hstack([np.ones((periods.size, 1)), np.cos(phase), np.sin(phase)])
    coefficients: Field = np.linalg.lstsq(basis, heights - heights.mean(), rcond=None)[0]
    remainder = float(np.std(heights - basis @ coefficients))
    variation = float(np.std(heights))
    return coefficients, remainder / variation if variation else 0.0


def resampled(profile: Signal, rate_hz: float) -> Signal:
    """Return a periodic profile at `rate_hz` or faster, band-limited to its own waves."""
    samples = profile.values.size
    finer = scipy.fft.next_fast_len(
        max(samples, math.ceil(samples * rate_hz / profile.rate_hz)), real=True
    )
    values = scipy.signal.resample(profile.values, finer)
    return replace(profile, values=values, rate_hz=profile.rate_hz * finer / samples)


def steady_response(oscillator: ContactOscillator, profile: Signal) -> Signal:
    """Return one period of the acceleration [m/s^2] over a periodic profile, without transient."""
    decay = DECAY_TIMES / (oscillator.damping_ratio * oscillator.angular_frequency)
    times = math.ceil(decay / profile.duration_s) + 2
    vibrated = acceleration(oscillator, replace(profile, values=np.tile(profile.values, times)))
    samples = profile.values.size  # skip the last period, whose end has a kink
    return replace(vibrated, values=vibrated.values[-2 * samples : -samples])


def _period(surfaces: MovingSurfaces) -> tuple[float | None, str | None]:
    """Return the time after which the contact repeats [s], or the reason why it does not."""
    if not any(surfaces.rough):
        return None, "the surfaces are smooth: no roughness excites a vibration"
    passages = [surfaces.passage_time(index) for index in (0, 1) if surfaces.rough[index]]
    moving = [passage for passage in passages if math.isfinite(passage)]
    if not moving:
        return None, "the roughness stands still: nothing excites a vibration"
    if not math.isclose(moving[0], moving[-1], rel_tol=1e-9):
        return (
            None,
            "two rough surfaces move at different speeds: no passage repeats",
        )
    return moving[0], None


class _Moments(NamedTuple):
    """Contact at some steps; `failure` is the last reason for undetermined damping."""

    steps: tuple[int, ...]
    stiffness: Field
    damping: Field
    dynamic: Field
    unsolved: tuple[int, ...]
    failure: str


def _moments(
    history: History, surfaces: MovingSurfaces, model: VibrationModel, moments: int
) -> _Moments:
    case = history.case
    rows = history.settled
    spring = Tangent(model.stated.get("reference_depth"))
    indices = np.unique(np.linspace(0, len(rows) - 1, moments + 2)[1:-1].round().astype(int))
    solved = []
    stiffness = []
    oscillations = []
    unsolved = []
    failure = ""
    for number, time in zip(rows["step"].iloc[indices], rows["time_s"].iloc[indices], strict=True):
        try:
            contact = solve_thermal_contact(
                case.conditions,
                case.lubricant,
                surfaces.composite_at(float(time)),
                thermal=case.thermal,
                options=case.options,
            )
            stiffness.append(
                tangent_stiffness(contact, reference_depth=spring.reference_depth).total
            )
        except NotConverged as unfinished:
            error = unfinished
            unsolved.append(int(number))
            continue
        solved.append(int(number))
        damping_ratio, dynamic_stiffness, reason = _oscillating(contact, spring, model.mass)
        oscillations.append((damping_ratio, dynamic_stiffness))
        failure = reason or failure
    if not stiffness:
        reason = (
            f"the tangent stiffness could not be computed at any of {len(unsolved)} steps: {error}"
        )
        raise NotConverged(error.solution, reason)
    damping, dynamic = np.array(oscillations).T
    return _Moments(tuple(solved), np.array(stiffness), damping, dynamic, tuple(unsolved), failure)


def _oscillating(
    contact: ContactSolution, spring: Tangent, mass: float
) -> tuple[float, float, str]:
    """Return damping ratio and dynamic stiffness of a mass; nan with the reason if undetermined."""
    try:
        result = OscillatingContact(contact, reference_depth=spring.reference_depth).resonance(mass)
    except AsperityError as refusal:  # all other numbers are valid without damping
        return math.nan, math.nan, str(refusal)
    return result.damping_ratio, result.stiffness, ""


def _mean(values: Field) -> float:
    finite = values[np.isfinite(values)]
    return float(np.mean(finite)) if finite.size else math.nan


def _spread(values: Field) -> float:
    finite = values[np.isfinite(values)]
    return float(np.std(finite)) if finite.size else math.nan


def _resonance(spectrum: Spectrum, f0: float, model: VibrationModel) -> Resonance:
    """Estimate the resonance near f0, if the lines are close enough."""
    band = band_about(f0, float(spectrum.frequency_hz[-1]))
    spacing_hz = spectrum.spacing_hz
    if (band[1] - band[0]) / spacing_hz < FEWEST_LINES + 1:
        min_factor = math.ceil((FEWEST_LINES + 1) * spacing_hz / (band[1] - band[0]))
        reason = (
            f"the track repeats: its lines are {spacing_hz:.0f} Hz apart, too far to resolve a "
            f"resonance near {f0:.0f} Hz"
        )
        remedy = f"raise motion.track at least {min_factor}-fold"
        return no_resonance(f"{reason}; {remedy}", band, model.method)
    return contact_resonance(spectrum, band_hz=band, method=model.method)
