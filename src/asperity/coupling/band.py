"""Frequency range of a contact's resonance, and the sampling rate that it requires."""

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput
from asperity.coupling.laws import LoadedContact
from asperity.coupling.model import VibrationModel
from asperity.coupling.spring import natural_frequency_hz
from asperity.ehl import ContactState

MIN_CLR = 0.01  # load share at the lower end of the search band; below it there is no resonance
BAND_MARGIN = 0.05
BAND_FACTOR = 1.5  # half-width of the band if the load share does not bound the resonance


def dry_full_load(conditions: ContactConditions, sq: float) -> ContactState:
    """Return the state of the paper's section 2: dry, with all load on roughness `sq` [m]."""
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
    """Return the search band for the asperities' spring [Hz]: f0 from CLR 0.01 to 1, 5 % wider."""
    state = dry_full_load(conditions, 0.0)
    low, high = (
        natural_frequency_hz(model.stiffness_law, LoadedContact(share, state, conditions), model)
        for share in (MIN_CLR, 1.0)
    )
    return (1.0 - BAND_MARGIN) * low, (1.0 + BAND_MARGIN) * high


def band_about(frequency_hz: float, highest_hz: float = np.inf) -> tuple[float, float]:
    """Return the search band about an estimated resonance, limited to `highest_hz`.

    Examples
    --------
    >>> from asperity.coupling import band_about
    >>> [round(edge) for edge in band_about(800.0)]
    [533, 1200]
    """
    return frequency_hz / BAND_FACTOR, min(frequency_hz * BAND_FACTOR, highest_hz)


def require_sampling(conditions: ContactConditions, model: VibrationModel, sq: float) -> float:
    """Return the full-load resonance [Hz], if the model samples it finely enough.

    `sq` is the roughness [m]. No solved contact is required, so that the check can run before
    solving.

    Raises
    ------
    BadInput
        for a sampling rate below `samples_per_period` times that resonance.
    """
    contact = LoadedContact(1.0, dry_full_load(conditions, sq), conditions)
    full_load_hz = natural_frequency_hz(
        model.stiffness_law.at_full_load(conditions), contact, model
    )
    required_hz = model.samples_per_period * full_load_hz
    if model.rate_hz < required_hz:
        raise BadInput(
            f"vibration sampling rate must be at least {model.samples_per_period:g} times the "
            f"full-load resonance of {full_load_hz:.0f} Hz, got {model.rate_hz:g} Hz; raise it to "
            f"{np.ceil(required_hz):.0f} Hz"
        )
    return full_load_hz
