"""Statement of each contact model's oil balance, for the limits of a report."""

from collections.abc import Mapping

from asperity.ehl import ContactSolution

DRY = "dry"
_UNIFIED = (
    "Oil is not conserved.",
    "Oil and asperities share one pressure, kept between zero and the hardness. Oil is lost or "
    "created wherever a bound holds: in sum {imbalance} of the oil carried through the Hertz zone.",
)
_LIMITS: Mapping[str, tuple[str, str]] = {
    "unified": _UNIFIED,
    "paper": _UNIFIED,
    "mixed": (
        "Cavities are refilled.",
        "Oil and asperities have a pressure each, and oil also flows between touching asperities. "
        "It is created in cavities and lost where the pressure reaches the hardness: with the "
        "residual of all cells, in sum {imbalance} of the oil carried through the Hertz zone.",
    ),
    "conserving": (
        "Mass-conserving cavitation.",
        "Reynolds' equation holds in every cell and cavities are partly filled "
        "(Jakobsson-Floberg-Olsson). The oil balance is met to {imbalance} of the oil carried "
        "through the Hertz zone.",
    ),
    DRY: ("No oil.", "The contact is dry: film, cavitation and oil friction are left out."),
}


def model_name(solution: ContactSolution) -> str:
    """Return the contact model of a solution, `DRY` without lubricant."""
    return DRY if solution.lubricant is None else solution.options.model


def oil_limit(model: str, imbalance: str) -> tuple[str, str]:
    """Return heading and text of the limit that a model's oil balance sets.

    `imbalance` is the oil lost or created over the oil carried through, with its unit.
    """
    heading, text = _LIMITS[model]
    return heading, text.format(imbalance=imbalance)
