"""Oscillator of a contact: the mass on the contact's spring, by a model's laws."""

from asperity.contact.conditions import ContactConditions
from asperity.core.errors import require_positive
from asperity.coupling.laws import LoadedContact, StiffnessLaw
from asperity.coupling.model import VibrationModel
from asperity.ehl import ContactSolution, ContactState
from asperity.vibration import ContactOscillator, require_damping_ratio


def oscillator(
    state: ContactState,
    conditions: ContactConditions,
    model: VibrationModel,
    *,
    solution: ContactSolution | None = None,
) -> ContactOscillator:
    """Return the mass on the contact spring, by the model's stiffness and damping laws.

    Raises
    ------
    BadInput
        if the law needs asperity load and there is none, or needs a solved contact and there is
        none.
    """
    if model.stiffness_law.asperities_alone:
        require_positive("load share of the asperities (CLR)", state.clr)
    return loaded_oscillator(
        model.stiffness_law, LoadedContact(state.clr, state, conditions, solution), model
    )


def resonance_at(
    clr: float, state: ContactState, conditions: ContactConditions, model: VibrationModel
) -> float | None:
    """Return the natural frequency [Hz] at another load share of the same contact.

    None for a law that would need that contact solved; 0 without asperity load, if the spring is
    that of the asperities alone.
    """
    law = model.stiffness_law
    if not law.by_load_share:
        return None
    if clr <= 0.0 and law.asperities_alone:
        return 0.0
    return natural_frequency_hz(law, LoadedContact(clr, state, conditions), model)


def loaded_oscillator(
    law: StiffnessLaw, contact: LoadedContact, model: VibrationModel
) -> ContactOscillator:
    """Return the model's mass and damping on the spring of `law` for a contact."""
    load = contact.asperity_load if law.asperities_alone else contact.conditions.load
    return damped_oscillator(law(contact), load, model, solution=contact.solution)


def natural_frequency_hz(law: StiffnessLaw, contact: LoadedContact, model: VibrationModel) -> float:
    """Return the natural frequency [Hz] on the spring of `law`; the contact need not be solved."""
    simple = model.with_choices(damping_law="ratio") if model.damping_law.needs_solution else model
    return loaded_oscillator(law, contact, simple).natural_frequency_hz


def damped_oscillator(
    stiffness: float, load: float, model: VibrationModel, *, solution: ContactSolution | None = None
) -> ContactOscillator:
    """Return the model's mass and damping on a spring of `stiffness` [N/m] carrying `load` [N].

    Raises
    ------
    BadInput
        if the damping law needs a solved contact and there is none.
    """
    ratio = model.damping_law(
        mass=model.mass, stiffness=stiffness, damping_ratio=model.damping_ratio, solution=solution
    )
    return ContactOscillator(
        mass=model.mass, stiffness=stiffness, damping_ratio=require_damping_ratio(ratio), load=load
    )
