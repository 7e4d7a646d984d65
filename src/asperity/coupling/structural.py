"""Resonance of a contact in its machine structure: the mode that follows the contact."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.coupling.band import BAND_MARGIN, MIN_CLR, dry_full_load
from asperity.coupling.laws import LoadedContact
from asperity.coupling.model import VibrationModel
from asperity.coupling.spring import loaded_oscillator
from asperity.structure import MIN_CONTACT_SHARE, ContactMode, NamedStructure, contact_mode
from asperity.vibration import ContactOscillator

MIN_RANGE = 1.01  # of the stiffness over the load share, from which CRF determines it
SHARES = 25  # of the load, at which the law is evaluated


@dataclass(frozen=True, eq=False, kw_only=True)
class StructuralResonance:
    """Mode of a structure with the largest share of the contact, over the load share.

    `springs` are the contact at the load shares `clr`, increasing to 1, by the law of the vibration
    model. `frequency_std` is the relative standard deviation of the structure's own frequencies.
    """

    mode: ContactMode
    clr: Field
    springs: tuple[ContactOscillator, ...]
    frequency_std: float

    @property
    def stiffness(self) -> Field:
        """Stiffness of the contact at each load share [N/m]."""
        return np.array([spring.stiffness for spring in self.springs])

    @property
    def band_hz(self) -> tuple[float, float]:
        """Search band [Hz]: the mode from CLR 0.01 to 1, 5 % wider."""
        low, high = np.exp(self.mode.log_frequency(np.log(self.stiffness[[0, -1]])))
        return (1.0 - BAND_MARGIN) * float(low), (1.0 + BAND_MARGIN) * float(high)

    @property
    def contact_share(self) -> float:
        """Least share of the contact in the strain energy of the mode, from CLR 0.01 to 1."""
        return float(np.min(2.0 * self.mode.log_slope(np.log(self.stiffness))))

    @property
    def full_load_hz(self) -> float:
        """Frequency of the mode with all load on asperities [Hz]."""
        return self.band_hz[1] / (1.0 + BAND_MARGIN)

    @property
    def damping_ratio(self) -> float:
        """Damping ratio of the mode with all load on asperities."""
        spring = self.springs[-1]
        return float(self.mode.total_damping(np.log(spring.stiffness), spring.damping))

    @property
    def unresponsive(self) -> bool:
        """True if the contact has less than 5 % of the strain energy of the mode."""
        return self.contact_share < MIN_CONTACT_SHARE

    def load_share(self, crf_hz: ArrayLike) -> Field:
        """Return the load share of the asperities at frequencies of the mode, 0.01 to 1.

        nan for a law by which the stiffness does not depend on it.
        """
        if self.stiffness[-1] < MIN_RANGE * self.stiffness[0]:
            return np.full(np.shape(crf_hz), np.nan)
        stiffness = np.log(self.mode.stiffness_at(crf_hz))
        return np.exp(np.interp(stiffness, np.log(self.stiffness), np.log(self.clr)))

    def on_single_mass(self, crf_hz: ArrayLike) -> Field:
        """Return the frequency [Hz] of the vibration model's mass on the same contact spring."""
        full = self.springs[-1]
        ratio = self.mode.stiffness_at(crf_hz) / full.stiffness
        return np.asarray(full.natural_frequency_hz * np.sqrt(ratio))

    def single_mass_slope(self, crf_hz: ArrayLike) -> Field:
        """Return the derivative of `on_single_mass`: a mode with a small share moves little."""
        stiffness = self.mode.stiffness_at(crf_hz)
        slope = np.maximum(self.mode.log_slope(np.log(stiffness)), 1e-6)
        return np.asarray(0.5 / slope * self.on_single_mass(crf_hz) / np.asarray(crf_hz))


def structural_resonance(
    named: NamedStructure, conditions: ContactConditions, model: VibrationModel
) -> StructuralResonance:
    """Return the resonance of a contact in a structure, by the stiffness law of the model.

    Raises
    ------
    BadInput
        for a line contact on the spring of a sphere, or if the structure has no mode from 50 Hz to
        20 kHz.
    """
    law = model.stiffness_law.at_full_load(conditions)
    if conditions.long and law.point_spring:
        raise BadInput(
            f"the stiffness law {law.name!r} is that of a sphere, far softer than this line "
            f"contact, so that {named.name} would have other modes; set stiffness_law = "
            '"hertz-line" in [vibration]'
        )
    state = dry_full_load(conditions, 0.0)
    simple = model.with_choices(damping_law="ratio") if model.damping_law.needs_solution else model
    shares = np.geomspace(MIN_CLR, 1.0, SHARES)
    springs = tuple(
        loaded_oscillator(law, LoadedContact(float(share), state, conditions), simple)
        for share in shares
    )
    low, high = springs[0].stiffness, springs[-1].stiffness
    return StructuralResonance(
        mode=contact_mode(named.structure, min(0.5 * low, 0.1 * high), 1.5 * high),
        clr=shares,
        springs=springs,
        frequency_std=named.frequency_std,
    )
