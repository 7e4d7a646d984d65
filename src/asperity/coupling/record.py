"""Vibration record of a contact: simulate the acceleration of the mass and find its resonance."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, usual_float_errors
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
# Largest rms dynamic force over load for a linear spring; the CRF error is then 0.4 %.
MAX_LINEAR_LOAD = 0.2


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """Vibration of a mass on a contact.

    `resonance` is searched in `band_hz`, which follows from the contact alone; `full_load_crf_hz`
    is the resonance with all load on asperities [Hz]. `profile` [m] is drawn from the `excitation`;
    `response` [m/s^2] and its `spectrum` are the record; `expected_crfa` is the expected continuous
    spectrum at the oscillator's natural frequency [(m/s^2)^2/Hz]. `dynamic_load` is the rms dynamic
    force over the spring's load (above 0.2 a linear spring is inaccurate), `contact_loss` the
    fraction of time without contact. Without asperity contact there is no spring and no record: all
    of these are None, and `resonance.reason` states why.
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
        """Expected value of `spectrum` for the linear spring; None without a record."""
        if (
            self.oscillator is None
            or self.excitation is None
            or self.profile is None
            or self.spectrum is None
        ):
            return None
        rate_hz = self.profile.rate_hz
        heights = self.excitation.density(self.spectrum.frequency_hz, rate_hz)
        base_excitation = replace(self.spectrum, density=heights, unit="m^2/Hz")
        return expected_spectrum(self.oscillator, base_excitation, rate_hz=rate_hz)


@dataclass(frozen=True, slots=True)
class SampledLine:
    """Effect of sampling on an oscillator's line over noise that is white in acceleration.

    It includes linear interpolation between samples with its aliases, and the digital filter of the
    noise; see `ContactOscillator.sampled_gain`.
    """

    noise: FilteredNoise
    rate_hz: float

    def __call__(self, frequency_hz: Field, f0_hz: float, damping_ratio: float) -> Field:
        """Return the factor on the line at each frequency [Hz], 1 at f0."""
        stiffness = (2.0 * np.pi * f0_hz) ** 2  # of a mass of 1 kg
        spring = ContactOscillator(
            mass=1.0, stiffness=stiffness, damping_ratio=damping_ratio, load=1.0
        )
        inside = np.clip(frequency_hz, 1e-3 * f0_hz, 0.5 * self.rate_hz)
        at_frequency, at_f0 = (
            spring.sampled_gain(frequencies, self.rate_hz) * self._sampled_noise(frequencies)
            for frequencies in (inside, np.array(f0_hz))
        )
        return np.asarray(at_frequency / at_f0 / line_shape(inside, f0_hz, damping_ratio))

    def _sampled_noise(self, frequency_hz: Field) -> Field:
        """Return the density of the sampled noise, including power above rate/2 that folds back."""
        density = self.noise.density(frequency_hz, self.rate_hz)
        if self.noise.filter == "continuous":
            for multiple in range(1, ALIASES + 1):
                for alias in (
                    multiple * self.rate_hz - frequency_hz,
                    multiple * self.rate_hz + frequency_hz,
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
    """Return the model's excitation for a contact, averaged over its patch.

    Raises
    ------
    BadInput
        for a flat surface, noise without touching asperities, roughness that needs a passing speed
        but has none, or a surface excitation without a solution.
    """
    contact = LoadedContact(state.clr, state, conditions, solution)
    return model.patch(model.excitation(contact), contact)


@usual_float_errors
def contact_vibration(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> Vibration:
    """Simulate the acceleration of the mass on the contact and find its resonance.

    The stiffness law "tangent" and the excitation "surface" need the `solution`.

    Raises
    ------
    BadInput
        for a sampling rate below `samples_per_period` times the full-load resonance, and as
        `oscillator` and `excitation`.
    """
    full_load_crf_hz = require_sampling(conditions, model, state.sq)
    objection = _objection(state, model)
    spring = None
    if objection is None:
        try:
            spring = oscillator(state, conditions, model, solution=solution)
        except NotConverged as unfinished:
            objection = (
                f"the tangent stiffness needs neighbouring loads, one of which failed: {unfinished}"
            )
    if model.stiffness_law.asperities_alone:
        band_hz = search_band(conditions, model)
    else:
        band_hz = band_about(
            full_load_crf_hz if spring is None else spring.natural_frequency_hz, model.rate_hz / 2.0
        )
    if spring is None:
        resonance = no_resonance(objection or "", band_hz, model.method)
        return Vibration(resonance=resonance, band_hz=band_hz, full_load_crf_hz=full_load_crf_hz)
    record = _simulate(spring, excitation(state, conditions, model, solution=solution), model)
    f0 = np.array(spring.natural_frequency_hz)
    return Vibration(
        resonance=contact_resonance(
            record.spectrum, band_hz=band_hz, method=model.method, sampling_factor=record.line_model
        ),
        band_hz=band_hz,
        full_load_crf_hz=full_load_crf_hz,
        oscillator=spring,
        profile=record.profile,
        response=record.response,
        spectrum=record.spectrum,
        excitation=record.excitation,
        expected_crfa=float(spring.gain(f0) * record.excitation.density(f0, model.rate_hz)),
        dynamic_load=float(
            model.mass * np.std(record.response.values) / (spring.load or conditions.load)
        ),
        contact_loss=record.contact_loss,
    )


class _Record(NamedTuple):
    """Simulated record of a mass, and the sampled line over its noise, if that applies."""

    excitation: Excitation
    profile: Signal
    response: Signal
    spectrum: Spectrum
    contact_loss: float
    line_model: SampledLine | None


def _simulate(
    spring: ContactOscillator, base_excitation: Excitation, model: VibrationModel
) -> _Record:
    """Simulate the record of a mass on `spring` under an excitation."""
    samples = round(model.duration_s * model.rate_hz)
    profile = base_excitation.profile(samples, model.rate_hz, model.seed)
    contact_loss = 0.0
    if model.linear:
        response = acceleration(spring, profile, method=model.response, substeps=model.substeps)
    else:
        motion = mass_motion(spring, profile, method=model.response, substeps=model.substeps)
        response = Signal(motion.acceleration, profile.rate_hz, "m/s^2")
        contact_loss = motion.contact_loss
    line_model = None
    if model.method == "likelihood" and model.linear and isinstance(base_excitation, FilteredNoise):
        line_model = SampledLine(base_excitation, model.rate_hz)
    spectrum = power_spectrum(response, window="boxcar")
    return _Record(base_excitation, profile, response, spectrum, contact_loss, line_model)


def _objection(state: ContactState, model: VibrationModel) -> str | None:
    """Return the reason why there is no resonance, if it is known in advance."""
    if state.sq == 0.0:
        return "the surfaces are flat: no roughness excites a vibration"
    if state.clr == 0.0 and model.stiffness_law.asperities_alone:
        return (
            "no asperity carries load: the oil separates the surfaces, so that there is no contact "
            "spring"
        )
    return model.excitation.objection(state)
