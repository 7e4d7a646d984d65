"""The vibration of a contact: ride over it, record the acceleration, look for its resonance."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import NotConverged
from asperity.core.signals import Signal, Spectrum, power_spectrum
from asperity.coupling.band import band_about, require_sampling, search_band
from asperity.coupling.laws import LoadedContact
from asperity.coupling.model import VibrationModel
from asperity.coupling.spring import oscillator
from asperity.ehl import ContactSolution, ContactState
from asperity.resonance import Resonance, contact_resonance, line_shape, no_resonance
from asperity.vibration import (
    ContactOscillator,
    Excitation,
    FilteredNoise,
    acceleration,
    expected_spectrum,
    mass_motion,
)

ALIASES = 3
LINEAR_UP_TO = (
    0.2  # rms dynamic force over load; the CRF is then 0.4 % lower than the linear spring's
)


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """The vibration of a mass on a contact.

    `resonance` was searched in `band_hz`, which follows from the contact alone; `full_load_crf_hz`
    is the resonance with all load on asperities [Hz]. `profile` [m] is drawn from the
    `excitation`, and with `response` [m/s^2] and its `spectrum` the record; `expected_crfa` is the
    continuous height of what `spectrum` scatters about at the oscillator's own frequency
    [(m/s^2)^2/Hz]. `dynamic_load` is the rms dynamic force over the spring's load (above 0.2 a
    linear spring misleads), `contact_loss` the share of the time in the air. When no asperity
    touches there is no spring and no record: all of these are None and `resonance.reason` says so.
    """

    resonance: Resonance
    band_hz: tuple[float, float]
    full_load_crf_hz: float
    oscillator: ContactOscillator | None = None
    profile: Signal | None = None
    response: Signal | None = None
    spectrum: Spectrum | None = None
    excitation: Excitation | None = None
    expected_crfa: float | None = None
    dynamic_load: float | None = None
    contact_loss: float | None = None

    @cached_property
    def expected(self) -> Spectrum | None:
        """What `spectrum` scatters about, in closed form (of the linear spring); None without a record."""
        if (
            self.oscillator is None
            or self.excitation is None
            or self.profile is None
            or self.spectrum is None
        ):
            return None
        rate_hz = self.profile.rate_hz
        heights = self.excitation.density(self.spectrum.frequency_hz, rate_hz)
        below = replace(self.spectrum, density=heights, unit="m^2/Hz")
        return expected_spectrum(self.oscillator, below, rate_hz=rate_hz)


@dataclass(frozen=True, slots=True)
class SampledLine:
    """What a record's own sampling makes of an oscillator's line over noise that is white in acceleration.

    Straight lines between samples, their aliases included, and the digital filter that the noise
    is behind; see `ContactOscillator.sampled_gain`.
    """

    noise: FilteredNoise
    rate_hz: float

    def __call__(self, frequency_hz: Field, f0_hz: float, damping_ratio: float) -> Field:
        """A factor on the line at each frequency [Hz], 1 at f0."""
        stiffness = (2.0 * np.pi * f0_hz) ** 2  # of a mass of 1 kg
        spring = ContactOscillator(
            mass=1.0, stiffness=stiffness, damping_ratio=damping_ratio, load=1.0
        )
        inside = np.clip(frequency_hz, 1e-3 * f0_hz, 0.5 * self.rate_hz)
        here, there = (
            spring.sampled_gain(at, self.rate_hz) * self._sampled_noise(at)
            for at in (inside, np.array(f0_hz))
        )
        return np.asarray(here / there / line_shape(inside, f0_hz, damping_ratio))

    def _sampled_noise(self, frequency_hz: Field) -> Field:
        """Density of the noise's samples: a continuous filter leaves something above rate/2, which folds back."""
        density = self.noise.density(frequency_hz, self.rate_hz)
        if self.noise.filter == "continuous":
            for turn in range(1, ALIASES + 1):
                for alias in (
                    turn * self.rate_hz - frequency_hz,
                    turn * self.rate_hz + frequency_hz,
                ):
                    density = density + self.noise.density(alias, self.rate_hz)
        return np.asarray(density)


def excitation(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> Excitation:
    """What passes under the mass, by the model's excitation and averaged over its patch.

    Raises BadInput for a flat surface, noise behind a contact without touching asperities,
    roughness that has to pass at a speed and does not, a surface that is not known because there
    is no solution.
    """
    contact = LoadedContact(state.clr, state, conditions, solution)
    return model.patch(model.excitation(contact), contact)


def contact_vibration(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> Vibration:
    """Ride over the contact, record the acceleration and look for its resonance.

    The stiffness law "tangent" and the excitation "surface" need the `solution` itself. Raises
    BadInput for a sampling rate below `samples_per_period` times the full-load resonance, or what
    `oscillator`, `excitation` and its records refuse.
    """
    full_load_crf_hz = require_sampling(conditions, model, state.sq)
    objection, spring = _objection(state, model), None
    if objection is None:
        try:
            spring = oscillator(state, conditions, model, solution=solution)
        except NotConverged as unfinished:
            objection = (
                f"the tangent stiffness takes neighbouring loads, and at one of them: {unfinished}"
            )
    if model.stiffness_law.asperities_alone:
        band_hz = search_band(conditions, model)
    else:
        band_hz = band_about(
            full_load_crf_hz if spring is None else spring.natural_frequency_hz, model.rate_hz / 2.0
        )
    if spring is None:
        silent = no_resonance(objection or "", band_hz, model.method)
        return Vibration(resonance=silent, band_hz=band_hz, full_load_crf_hz=full_load_crf_hz)
    below = excitation(state, conditions, model, solution=solution)
    profile = below.profile(round(model.duration_s * model.rate_hz), model.rate_hz, model.seed)
    if model.linear:
        response, contact_loss = (
            acceleration(spring, profile, method=model.response, substeps=model.substeps),
            0.0,
        )
    else:
        motion = mass_motion(spring, profile, method=model.response, substeps=model.substeps)
        response, contact_loss = (
            Signal(motion.acceleration, profile.rate_hz, "m/s^2"),
            motion.contact_loss,
        )
    spectrum = power_spectrum(response, window="boxcar")
    f0 = np.array(spring.natural_frequency_hz)
    seen = None
    if model.method == "likelihood" and model.linear and isinstance(below, FilteredNoise):
        seen = SampledLine(below, model.rate_hz)
    return Vibration(
        resonance=contact_resonance(
            spectrum, band_hz=band_hz, method=model.method, sampling_factor=seen
        ),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
        oscillator=spring,
        profile=profile,
        response=response,
        spectrum=spectrum,
        excitation=below,
        expected_crfa=float(spring.gain(f0) * below.density(f0, model.rate_hz)),
        dynamic_load=float(model.mass * np.std(response.values) / (spring.load or conditions.load)),
        contact_loss=contact_loss,
    )


def _objection(state: ContactState, model: VibrationModel) -> str | None:
    """Why there can be no resonance, where that is known beforehand."""
    if state.sq == 0.0:
        return "the surfaces are flat: there is no roughness to excite a vibration"
    if state.clr == 0.0 and model.stiffness_law.asperities_alone:
        return "no asperity carries load: the oil separates the surfaces, and there is no contact spring to resonate"
    return model.excitation.objection(state)
