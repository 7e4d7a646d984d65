"""Resonances of a machine structure as those of the vibration model's mass on the contact."""

from dataclasses import replace
from math import nan, sqrt

import numpy as np

from asperity.coupling import StructuralResonance, structural_resonance
from asperity.inference.observations import Observation
from asperity.inference.recording_input import ObservedSeries
from asperity.inference.settings import LOAD, Setting
from asperity.structure import MIN_CONTACT_SHARE
from asperity.study import overrides_at


def on_single_mass(setting: Setting, series: ObservedSeries) -> ObservedSeries:
    """Convert the resonances of a case with a structure; return others unchanged.

    The frequency of the mode that follows the contact gives the contact's stiffness, and this the
    frequency of the mass of [vibration] on it; likewise the damping. Their standard deviations grow
    as the contact's share falls. Heights are left out. Resonances are excluded where the contact
    has less than 5 % of the mode's strain energy, or where no stiffness gives their frequency.
    """
    case = setting.case
    if case.structure is None or case.vibration is None:
        return series
    heaviest = next(entry for entry in setting.operating if entry.key == LOAD)
    heavy = case.with_written(overrides_at(case, [heaviest], [1.0])).conditions
    resonance = structural_resonance(case.structure, heavy, case.vibration)
    observations, excluded = [], list(series.excluded)
    for observation in series.observations:
        reason = _objection(observation, resonance)
        if reason:
            excluded.append((observation.name, reason))
        converted = (
            _without_resonance(observation) if reason else _converted(observation, resonance)
        )
        if converted is not None:
            observations.append(converted)
    note = (
        f"Frequencies are those of {case.vibration.mass:g} kg on the contact, converted from the "
        f"mode of {case.structure.name} in which the contact has "
        f"{100.0 * resonance.contact_share:.2g} % of the strain energy."
    )
    return replace(
        series,
        observations=tuple(observations),
        excluded=tuple(excluded),
        notes=(*series.notes, note),
    )


def _objection(observation: Observation, resonance: StructuralResonance) -> str:
    """Return why a resonance says nothing about the contact; "" if it does."""
    if np.isnan(observation.crf_hz):
        return ""
    stiffness = resonance.mode.stiffness_at(observation.crf_hz)
    share = float(2.0 * resonance.mode.log_slope(np.log(stiffness)))
    if share < MIN_CONTACT_SHARE:
        return (
            f"the contact has {100.0 * share:.2g} % of the strain energy of its mode, less than "
            f"{100.0 * MIN_CONTACT_SHARE:.0f} %"
        )
    low, high = resonance.mode.frequency_hz[[0, -1]]
    if not low < observation.crf_hz < high:
        return (
            f"no stiffness of the contact gives {observation.crf_hz:.0f} Hz, only "
            f"{low:.0f} to {high:.0f} Hz"
        )
    return ""


def _without_resonance(observation: Observation) -> Observation | None:
    """Return an observation of the capacitance alone; None without one."""
    if np.isnan(observation.capacitance_f):
        return None
    return replace(
        observation,
        crf_hz=nan,
        crf_std_hz=nan,
        crf_shared_std_hz=0.0,
        crfa=nan,
        damping_ratio=nan,
    )


def _converted(observation: Observation, resonance: StructuralResonance) -> Observation:
    if np.isnan(observation.crf_hz):
        return observation
    measured_hz = observation.crf_hz
    slope = float(resonance.single_mass_slope(measured_hz))
    damping, damping_std = _damping(observation, resonance)
    return replace(
        observation,
        crf_hz=float(resonance.on_single_mass(measured_hz)),
        crf_std_hz=slope * observation.crf_std_hz,
        crf_shared_std_hz=slope * observation.crf_shared_std_hz,
        crfa=nan,
        damping_ratio=damping,
        damping_std=damping_std,
    )


def _damping(observation: Observation, resonance: StructuralResonance) -> tuple[float, float]:
    """Return the damping ratio of the mass on the contact; nan if the structure has all of it."""
    place = np.log(resonance.mode.stiffness_at(observation.crf_hz))
    own, per_damping = (
        float(resonance.mode.total_damping(place, damping)) for damping in (0.0, 1.0)
    )
    of_contact = observation.damping_ratio - own
    if not of_contact > 0.0:  # nan too
        return nan, nan
    mass = resonance.springs[-1].mass
    critical = 2.0 * sqrt(float(np.exp(place)) * mass)
    scale = 1.0 / (per_damping - own) / critical
    return scale * of_contact, scale * observation.damping_std
