"""Resonance of a contact in its machine structure: the mode that follows the contact."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.coupling.band import BAND_MARGIN, MIN_CLR, dry_full_load
from asperity.coupling.laws import LoadedContact
from asperity.coupling.model import VibrationModel
from asperity.coupling.spring import loaded_oscillator
from asperity.structure import ContactMode, Receptances, Structure, contact_mode
from asperity.vibration import ContactOscillator


@dataclass(frozen=True, eq=False, kw_only=True)
class StructuralResonance:
    """Mode of a structure with the largest share of the contact, over the load share.

    `springs` are the contact at CLR 0.01 and 1, by the law of the vibration model.
    """

    mode: ContactMode
    springs: tuple[ContactOscillator, ContactOscillator]

    @property
    def band_hz(self) -> tuple[float, float]:
        """Search band [Hz]: the mode from CLR 0.01 to 1, 5 % wider."""
        low, high = np.exp(self.mode.log_frequency(np.log([s.stiffness for s in self.springs])))
        return (1.0 - BAND_MARGIN) * float(low), (1.0 + BAND_MARGIN) * float(high)

    @property
    def contact_share(self) -> float:
        """Share of the contact in the strain energy of the mode, with all load on asperities."""
        return float(2.0 * self.mode.log_slope(np.log(self.springs[1].stiffness)))

    @property
    def full_load_hz(self) -> float:
        """Frequency of the mode with all load on asperities [Hz]."""
        return self.band_hz[1] / (1.0 + BAND_MARGIN)

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of the mode with all load on asperities."""
        spring = self.springs[1]
        return float(self.mode.total_damping(np.log(spring.stiffness), spring.damping))

    def on_single_mass(self, crf_hz: ArrayLike) -> Field:
        """Return the frequency [Hz] of the vibration model's mass on the same contact spring."""
        full = self.springs[1]
        ratio = self.mode.stiffness_at(crf_hz) / full.stiffness
        return np.asarray(full.natural_frequency_hz * np.sqrt(ratio))

    def single_mass_slope(self, crf_hz: ArrayLike) -> Field:
        """Return the derivative of `on_single_mass`: a mode with a small share moves little."""
        stiffness = self.mode.stiffness_at(crf_hz)
        slope = np.maximum(self.mode.log_slope(np.log(stiffness)), 1e-6)
        return np.asarray(0.5 / slope * self.on_single_mass(crf_hz) / np.asarray(crf_hz))


def structural_resonance(
    structure: Structure | Receptances, conditions: ContactConditions, model: VibrationModel
) -> StructuralResonance:
    """Return the resonance of a contact in a structure, by the stiffness law of the model.

    Raises
    ------
    BadInput
        if the structure has no mode from 50 Hz to 20 kHz.
    """
    law = model.stiffness_law.at_full_load(conditions)
    state = dry_full_load(conditions, 0.0)
    simple = model.with_choices(damping_law="ratio") if model.damping_law.needs_solution else model
    low, high = (
        loaded_oscillator(law, LoadedContact(share, state, conditions), simple)
        for share in (MIN_CLR, 1.0)
    )
    return StructuralResonance(
        mode=contact_mode(
            structure, min(0.5 * low.stiffness, 0.1 * high.stiffness), 1.5 * high.stiffness
        ),
        springs=(low, high),
    )
