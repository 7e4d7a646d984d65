"""Search target: band and line width of the contact resonance, and its limit at full load share."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from asperity.case import Case, MachineCase
from asperity.core.errors import BadInput, require_positive
from asperity.coupling import BAND_MARGIN, StructuralResonance, search_band, structural_resonance
from asperity.paper import papers_case

SHAFTS = ("shaft_hz", "pinion_hz", "cam_hz", "disc_1_hz")  # shafts with a speed in the case
USUAL_DAMPING = 0.02  # damping ratio of the paper, without a case


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Search range of the contact resonance.

    `band_hz` are its ends; `width_hz` is the half-power width of a line at the lower end;
    `full_load_crf_hz` the resonance with all load on asperities, None without a contact model.
    `source` states the origin of the band; `assumed` is true if the user gave neither case nor
    band; `case` is the contact. `rates_per_turn` are the fault frequencies as shaft orders, by
    name, and `shaft_hz` is the shaft's speed in the case. `structural` is the mode that follows the
    contact, if the case has a structure.
    """

    band_hz: tuple[float, float]
    width_hz: float
    full_load_crf_hz: float | None
    source: str
    structural: StructuralResonance | None = field(default=None, repr=False, compare=False)
    assumed: bool = False
    case: Case | None = field(default=None, repr=False, compare=False)
    rates_per_turn: Mapping[str, float] = field(default_factory=dict)
    shaft_hz: float | None = None


def search_target(
    case: Case | MachineCase | None = None, band_hz: tuple[float, float] | None = None
) -> Target:
    """Return the band given, of the case's contact model, or of the paper's contact.

    For a machine it is that of the most loaded contact, if the case has [vibration].

    Raises
    ------
    BadInput
        if the case has no [vibration], or the band is invalid.
    """
    if isinstance(case, MachineCase):
        per_turn, shaft = _rates(case)
        return replace(
            search_target(_contact(case), band_hz), rates_per_turn=per_turn, shaft_hz=shaft
        )
    if band_hz is not None:
        low, high = _valid_band(band_hz)
        source = f"{low:.0f} to {high:.0f} Hz, as given"
        if case is None:
            return Target(
                band_hz=(low, high),
                width_hz=2.0 * USUAL_DAMPING * low,
                full_load_crf_hz=None,
                source=source,
            )
    contact = case or papers_case()
    if contact.vibration is None:
        raise BadInput(
            f"{contact.source}: [vibration] is missing; add it with mass and damping_ratio, "
            "or give a band"
        )
    model, structure = contact.vibration, contact.structure
    structural = None
    damping_ratio = model.damping_ratio
    if structure is None:
        searched = search_band(contact.conditions, model)
    else:
        structural = structural_resonance(structure.structure, contact.conditions, model)
        searched, damping_ratio = structural.band_hz, structural.damping_ratio
    full_load = None if case is None else searched[1] / (1.0 + BAND_MARGIN)
    if band_hz is not None:
        searched = (low, high)
    elif case is not None:
        inside = "" if structure is None else f" in {structure.name}"
        source = (
            f"{searched[0]:.0f} to {searched[1]:.0f} Hz, from the contact of {case.source}{inside}"
        )
    else:
        source = (
            f"{searched[0]:.0f} to {searched[1]:.0f} Hz, that of the paper's contact, because "
            "neither a case nor a band was given; give `case` or `band_hz`"
        )
    return Target(
        band_hz=searched,
        width_hz=2.0 * damping_ratio * searched[0],
        full_load_crf_hz=full_load,
        source=source,
        assumed=case is None and band_hz is None,
        case=case,
        structural=structural,
    )


def _valid_band(band_hz: tuple[float, float]) -> tuple[float, float]:
    low, high = (require_positive("band", end, "Hz") for end in band_hz)
    if not low < high:
        raise BadInput(f"band must go from low to high, got {low:g} to {high:g} Hz; swap them")
    return low, high


def _contact(machine: MachineCase) -> Case | None:
    """Return the most loaded contact of a machine; None if the case states no vibration."""
    if not machine.complete or "vibration" not in machine.tables:
        return None
    return machine.case(
        max(
            (contact for contact in machine.contacts if not contact.stands_still),
            key=lambda contact: contact.load,
        )
    )


def _rates(machine: MachineCase) -> tuple[dict[str, float], float | None]:
    """Return fault frequencies as shaft orders, by name, and the shaft's speed [Hz]."""
    rates = machine.machine.frequencies
    shaft = next((rates[name] for name in SHAFTS if rates.get(name, 0.0) > 0.0), None)
    if shaft is None:
        return {}, None
    return {_name(key): rate / shaft for key, rate in rates.items()}, shaft


def _name(key: str) -> str:
    """Return the label of a fault frequency, such as BPFO."""
    name = key.removesuffix("_hz")
    return name.upper() if name in ("bpfo", "bpfi", "bsf", "ftf") else name.replace("_", " ")
