"""How a mass on a contact vibrates over its history, without the paper's coupling.

The load is held at every step, so that the approach of the bodies is the way that a slow mass
would go: it is the profile, and the tangent stiffness of the solved contact is the spring. No
height from Sq, no cut-off from CAR, no sphere's stiffness from CLR; the paper's way stands beside
it, on the same history.
"""

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy

from asperity import coupling
from asperity.core.arrays import Field
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
from asperity.ehl import Scales, solve_contact
from asperity.resonance import FEWEST_LINES, Resonance, contact_resonance, no_resonance
from asperity.simulation.motion.history import History
from asperity.solution import OscillatingContact, tangent_stiffness
from asperity.surface import MovingSurfaces
from asperity.vibration import ContactOscillator, acceleration

MOMENTS = 5  # of the settled steps, at which the tangent stiffness is taken
WAVES = 0.4  # of a passage's steps: the shortest wave that is resolved has two and a half steps
RUNG_DOWN = 12.0  # time constants of the oscillator: what is left of the start is e^-12
SAMPLES_PER_PERIOD = (
    60.0  # straight lines between samples then cost the resonance 0.2 % of its power
)
SILENT = 1e-5  # of a²/R: what the solver's tolerance leaves of the approach is no roughness


@dataclass(frozen=True, kw_only=True)
class HistoryVibration:
    """A history as an accelerometer would record it.

    `oscillator` has the mean of `stiffness` [N/m], shape (moments,), the tangent stiffness of the
    contact as it lies at the steps `moments`; steps at which a neighbouring load could not be
    solved are in `unsolved`. `damping` is the contact's own damping ratio at the moments, where
    the mass resonates on its dynamic stiffness `dynamic` [N/m], yielded cells elastic; nan where
    that is not determined, the last reason in `damping_failure`. `profile` [m] is one passage of
    the rough track, the approach of the bodies about its mean, which repeats; `response` [m/s^2]
    and `spectrum` are the steady answer to it, whose lines are `spacing_hz` apart, speed over
    track. `not_periodic` is what of the approach does not repeat, root mean square over root mean
    square. Without roughness, or where nothing repeats, these are None and `resonance.reason` says
    why; `resonance` is estimated as in any record, `coupled` is the paper's way to the vibration
    of the history's mean contact.
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
        """Root mean square of the dynamic force over the load; above 0.2 a linear spring misleads."""
        if self.response is None or self.oscillator.load is None:
            return None
        return float(self.oscillator.mass * np.std(self.response.values) / self.oscillator.load)

    @property
    def crf_hz(self) -> float | None:
        """The resonance that the history shows [Hz]."""
        return self.resonance.crf_hz if self.resonance.found else None

    @property
    def coupled_crf_hz(self) -> float | None:
        """The resonance by the paper's coupling [Hz]."""
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
        """Mean of the contact's own damping ratio over the moments that have one; nan without any."""
        return _mean(self.damping)

    @property
    def damping_std(self) -> float:
        """Standard deviation of the contact's own damping ratio over the moments."""
        return _spread(self.damping)

    @property
    def dynamic_stiffness(self) -> float:
        """Mean of the dynamic stiffness where the mass resonates on it [N/m]; nan without any."""
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
        """One sentence: the contact's own resonance, the paper's, and what drives the mass."""
        f0, coupled, force = (
            self.oscillator.natural_frequency_hz,
            self.coupled.oscillator,
            self.dynamic_load,
        )
        by_paper = "not at all" if coupled is None else f"at {coupled.natural_frequency_hz:.0f} Hz"
        sentence = (
            f"By its own stiffness, taken at {len(self.moments)} moments, the contact resonates at "
            f"{f0:.0f} ± {self.natural_frequency_std_hz:.0f} Hz, by the paper's coupling {by_paper}"
        )
        ratio = quantity("history_damping_ratio")
        if np.isfinite(self.damping_ratio):
            sentence += f"; its oil damps with a ratio of {ratio.text(self.damping_ratio, self.damping_std)}"
        else:
            sentence += f"; its damping is not determined ({self.damping_failure})"
        if self.approach_std is not None and force is not None:
            sentence += (
                f"; the approach of the bodies drives a mass on it by {1e9 * self.approach_std:.3g} nm rms, "
                f"with a force of {100 * force:.0f} % of the load"
            )
            if force > MAX_LINEAR_LOAD:
                sentence += ", too much for a linear spring"
        if self.resonance.found:
            return f"{sentence}; the history shows {self.resonance.crf_hz:.0f} Hz."
        return f"{sentence}; the history shows no resonance ({self.resonance.reason})."

    def scalars(self) -> dict[str, Any]:
        """What `asperity run --listen --json` says besides the history; None where there is none."""
        reasons = {
            "history_crf_reason": self.resonance.reason,
            "tangent_unsolved": list(self.unsolved),
        }
        return read(self, lines("history_vibration")) | reasons


def history_vibration(
    history: History, model: VibrationModel | None = None, *, moments: int = MOMENTS
) -> HistoryVibration:
    """Let the mass of a vibration model ride on a history.

    Parameters
    ----------
    history : its settled steps are ridden over, at least one passage of the rough track
    model : mass, damping law, reference depth and indicator; the case's unless given. Its stiffness law and its
        excitation are those of `coupled` only, and the paper's there if they ask for one solved contact
    moments : how many steps, evenly over the settled ones, the tangent stiffness is the mean of

    Raises
    ------
    BadInput
        for no model, no moments, or what `contact_vibration` refuses.
    NotConverged
        if the tangent stiffness could be had at none of the moments.
    """
    case = history.case
    model = case.vibration if model is None else model
    if model is None:
        raise BadInput(
            f"{case.source}: vibration is left out; add [vibration] with mass and damping_ratio"
        )
    if moments < 1:
        raise BadInput(
            f"the tangent stiffness is taken at 1 moment or more, got {moments}; {MOMENTS} is the default"
        )
    surfaces = history.surfaces()
    taken = _moments(history, surfaces, model, moments)
    stiffness = taken.stiffness
    with case.naming("vibration"):
        oscillator = coupling.damped_oscillator(
            float(np.mean(stiffness)), case.conditions.load, model
        )
        alone = model
        if model.needs_solution:
            alone = model.with_choices(stiffness_law="hertz-point", excitation="noise")
        coupled = contact_vibration(history.mean_state, case.conditions, alone)
    f0 = oscillator.natural_frequency_hz
    period, objection = _period(surfaces)
    profile, not_periodic, objection = (
        (None, None, objection) if period is None else _passage(history, period)
    )
    vibration = HistoryVibration(
        oscillator=oscillator,
        stiffness=stiffness,
        moments=taken.steps,
        unsolved=taken.unsolved,
        damping=taken.damping,
        dynamic=taken.dynamic,
        damping_failure=taken.failure,
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


def _passage(history: History, period: float) -> tuple[Signal | None, float | None, str | None]:
    """What `repeating` makes of the approach of the bodies, unless nothing moves."""
    rows, case = history.settled, history.case
    profile, not_periodic, objection = repeating(
        rows["time_s"].to_numpy(), rows["rigid_approach_m"].to_numpy(), period
    )
    if (
        profile is not None
        and np.std(profile.values)
        < SILENT * Scales.from_conditions(case.conditions, case.lubricant).gap
    ):
        return (
            None,
            None,
            "the approach of the bodies does not change: there is nothing to excite a vibration",
        )
    return profile, not_periodic, objection


def repeating(
    time: Field, heights: Field, period: float
) -> tuple[Signal | None, float, str | None]:
    """One period of what repeats in `heights` [m] at evenly spaced `time` [s], both (steps,), about its mean.

    Least squares of the period's waves, so that it need be no whole number of steps. Returns it,
    what is left of the heights over what they vary by, both root mean square, and why there is no
    period (or None).
    """
    step = (time[-1] - time[0]) / (time.size - 1)
    length = period / step
    if time.size < length:
        missing = (
            f"{time.size} settled steps are less than a passage of the rough track, {length:.0f}"
        )
        return (
            None,
            math.nan,
            f"{missing}; let the history go on for {math.ceil(length) - time.size} steps more",
        )
    waves = int(WAVES * length)
    phase = 2.0 * np.pi * np.outer(time / period, np.arange(1, waves + 1))
    basis = np.hstack([np.ones((time.size, 1)), np.cos(phase), np.sin(phase)])
    coefficients: Field = np.linalg.lstsq(basis, heights - heights.mean(), rcond=None)[0]
    left, varied = float(np.std(heights - basis @ coefficients)), float(np.std(heights))
    samples = math.ceil(length)
    spectrum = np.zeros(samples // 2 + 1, dtype=complex)
    spectrum[1 : waves + 1] = (
        samples / 2.0 * (coefficients[1 : waves + 1] - 1j * coefficients[waves + 1 :])
    )
    return (
        Signal(np.fft.irfft(spectrum, samples), samples / period, "m"),
        left / varied if varied else 0.0,
        None,
    )


def resampled(profile: Signal, rate_hz: float) -> Signal:
    """A profile that repeats, at `rate_hz` or faster: its own waves and no others."""
    samples = profile.values.size
    finer = scipy.fft.next_fast_len(
        max(samples, math.ceil(samples * rate_hz / profile.rate_hz)), real=True
    )
    values = scipy.signal.resample(profile.values, finer)
    return replace(profile, values=values, rate_hz=profile.rate_hz * finer / samples)


def steady_response(oscillator: ContactOscillator, profile: Signal) -> Signal:
    """One period of the acceleration [m/s^2] over a profile that repeats for ever; the start has rung down."""
    decay = RUNG_DOWN / (oscillator.damping_ratio * oscillator.angular_frequency)
    times = math.ceil(decay / profile.duration_s) + 2
    ridden = acceleration(oscillator, replace(profile, values=np.tile(profile.values, times)))
    samples = profile.values.size  # the last period has no kink at its end
    return replace(ridden, values=ridden.values[-2 * samples : -samples])


def _period(surfaces: MovingSurfaces) -> tuple[float | None, str | None]:
    """Time after which the contact is what it was [s], or why there is none."""
    if not any(surfaces.rough):
        return None, "the surfaces are flat: there is no roughness to excite a vibration"
    passages = [surfaces.passage_time(index) for index in (0, 1) if surfaces.rough[index]]
    moving = [passage for passage in passages if math.isfinite(passage)]
    if not moving:
        return None, "the roughness stands still: nothing passes that could excite a vibration"
    if not math.isclose(moving[0], moving[-1], rel_tol=1e-9):
        return (
            None,
            "two rough surfaces at different speeds do not meet alike again: no passage repeats",
        )
    return moving[0], None


class _Moments(NamedTuple):
    """The contact as it lies at some steps; `failure` is the last reason why a damping is not determined."""

    steps: tuple[int, ...]
    stiffness: Field
    damping: Field
    dynamic: Field
    unsolved: tuple[int, ...]
    failure: str


def _moments(
    history: History, surfaces: MovingSurfaces, model: VibrationModel, moments: int
) -> _Moments:
    case, rows, spring = history.case, history.settled, Tangent(model.stated.get("reference_depth"))
    chosen = np.unique(np.linspace(0, len(rows) - 1, moments + 2)[1:-1].round().astype(int))
    solved, stiffness, shaken, unsolved, failure = [], [], [], [], ""
    for number, time in zip(rows["step"].iloc[chosen], rows["time_s"].iloc[chosen], strict=True):
        try:
            contact = solve_contact(
                case.conditions,
                case.lubricant,
                surfaces.composite_at(float(time)),
                options=case.options,
            )
            stiffness.append(
                tangent_stiffness(contact, reference_depth=spring.reference_depth).total
            )
        except NotConverged as unfinished:
            lost = unfinished
            unsolved.append(int(number))
            continue
        solved.append(int(number))
        try:
            found = OscillatingContact(contact, reference_depth=spring.reference_depth).resonance(
                model.mass
            )
            shaken.append((found.damping_ratio, found.stiffness))
        except AsperityError as refusal:  # every other number is as good without it
            shaken.append((math.nan, math.nan))
            failure = str(refusal)
    if not stiffness:
        reason = f"the tangent stiffness could be had at none of {len(unsolved)} steps: {lost}"
        raise NotConverged(lost.solution, reason)
    damping, dynamic = np.array(shaken).T
    return _Moments(tuple(solved), np.array(stiffness), damping, dynamic, tuple(unsolved), failure)


def _mean(values: Field) -> float:
    known = values[np.isfinite(values)]
    return float(np.mean(known)) if known.size else math.nan


def _spread(values: Field) -> float:
    known = values[np.isfinite(values)]
    return float(np.std(known)) if known.size else math.nan


def _resonance(spectrum: Spectrum, f0: float, model: VibrationModel) -> Resonance:
    """Looked for about f0, where the lines are close enough to show one."""
    band = band_about(f0, float(spectrum.frequency_hz[-1]))
    apart = spectrum.spacing_hz
    if (band[1] - band[0]) / apart < FEWEST_LINES + 1:
        least = math.ceil((FEWEST_LINES + 1) * apart / (band[1] - band[0]))
        reason = f"the track repeats: its lines lie {apart:.0f} Hz apart, too far to show a resonance near {f0:.0f} Hz"
        remedy = f"make motion.track {least} times as long or more"
        return no_resonance(f"{reason}; {remedy}", band, model.method)
    return contact_resonance(spectrum, band_hz=band, method=model.method)
