"""Where a contact's resonance can lie, from the contact alone, and how finely it has to be sampled."""

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput
from asperity.coupling.laws import LoadedContact
from asperity.coupling.model import VibrationModel
from asperity.coupling.spring import natural_frequency_hz
from asperity.ehl import ContactState

SMALLEST_SHARE = (
    0.01  # CLR at the lower end of the search band: below it the film is full and nothing resonates
)
BAND_MARGIN = 0.05
BAND_FACTOR = (
    1.5  # where the load share does not bound the resonance: the band about it, up and down
)


def dry_full_load(conditions: ContactConditions, sq: float) -> ContactState:
    """The paper's section 2: no oil, and roughness `sq` [m] that touches everywhere and carries all the load."""
    return ContactState(
        car=1.0,
        car_domain=1.0,
        clr=1.0,
        capped_oil_load_ratio=0.0,
        sq=sq,
        h_min=0.0,
        h_central=0.0,
        h_mean=0.0,
        lambda_ratio=None,
        p_max=conditions.hertz.p_max,
        reynolds_residual=0.0,
        load_error=0.0,
        mass_flux_imbalance=0.0,
    )


def search_band(conditions: ContactConditions, model: VibrationModel) -> tuple[float, float]:
    """Where the resonance of the asperities' own spring can be [Hz]: f0 from CLR 0.01 to 1, 5 % wider at both ends."""
    state = dry_full_load(conditions, 0.0)
    low, high = (
        natural_frequency_hz(model.stiffness_law, LoadedContact(share, state, conditions), model)
        for share in (SMALLEST_SHARE, 1.0)
    )
    return (1.0 - BAND_MARGIN) * low, (1.0 + BAND_MARGIN) * high


def band_about(frequency_hz: float, highest_hz: float = np.inf) -> tuple[float, float]:
    """The search band where the load share does not bound the resonance: a factor about it, `highest_hz` at most."""
    return frequency_hz / BAND_FACTOR, min(frequency_hz * BAND_FACTOR, highest_hz)


def require_sampling(conditions: ContactConditions, model: VibrationModel, sq: float) -> float:
    """The full-load resonance [Hz] of a contact with roughness `sq` [m], where the model samples it finely enough.

    Needs no solved contact, so that it can be asked before one is solved. Raises BadInput for a
    sampling rate below `samples_per_period` times that resonance.
    """
    contact = LoadedContact(1.0, dry_full_load(conditions, sq), conditions)
    full_load_hz = natural_frequency_hz(
        model.stiffness_law.at_full_load(conditions), contact, model
    )
    slowest = model.samples_per_period * full_load_hz
    if model.rate_hz < slowest:
        raise BadInput(
            f"vibration sampling rate must be at least {model.samples_per_period:g} times the full-load resonance of "
            f"{full_load_hz:.0f} Hz, got {model.rate_hz:g} Hz; raise it to {np.ceil(slowest):.0f} Hz"
        )
    return full_load_hz
