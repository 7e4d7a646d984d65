"""Which resonance is looked for: a band, how wide its line is, where it ends with all load on asperities."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from asperity.case import Case, MachineCase
from asperity.core.errors import BadInput, require_positive
from asperity.coupling import BAND_MARGIN, search_band
from asperity.paper import papers_case

SHAFTS = (
    "shaft_hz",
    "pinion_hz",
    "cam_hz",
    "disc_1_hz",
)  # of machines, whose speed the case states
USUAL_DAMPING = 0.02  # the paper's, where no case states one


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where the contact resonance may lie.

    `band_hz` its ends; `width_hz` half-power width of a line at the lower end; `full_load_crf_hz`
    the resonance with all load on asperities, None where no contact model is known; `source` a
    sentence that says who chose the band; `assumed` whether that was nobody; `case` the contact
    that was given. `rates_per_turn` are what of a machine turns, passes or meshes how often in a
    turn of its shaft, by name, and `shaft_hz` how fast that turns, where nobody says otherwise.
    """

    band_hz: tuple[float, float]
    width_hz: float
    full_load_crf_hz: float | None
    source: str
    assumed: bool = False
    case: Case | None = field(default=None, repr=False, compare=False)
    rates_per_turn: Mapping[str, float] = field(default_factory=dict)
    shaft_hz: float | None = None


def search_target(
    case: Case | MachineCase | None = None, band_hz: tuple[float, float] | None = None
) -> Target:
    """The band of a case's contact model, or the one given; else that of the paper's contact, and it says so.

    Of a machine it is that of its most loaded contact, where the case has [vibration].

    Raises
    ------
    BadInput
        for a case without [vibration], or a band that is none.
    """
    if isinstance(case, MachineCase):
        per_turn, shaft = _rates(case)
        return replace(
            search_target(_contact(case), band_hz), rates_per_turn=per_turn, shaft_hz=shaft
        )
    if band_hz is not None:
        low, high = (require_positive("band", end, "Hz") for end in band_hz)
        if not low < high:
            raise BadInput(f"band must go from low to high, got {low:g} to {high:g} Hz; swap them")
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
            f"{contact.source}: vibration is left out; add [vibration] with mass and damping_ratio, or a band"
        )
    searched = search_band(contact.conditions, contact.vibration)
    full_load = None if case is None else searched[1] / (1.0 + BAND_MARGIN)
    if band_hz is not None:
        searched = (low, high)
    elif case is not None:
        source = f"{searched[0]:.0f} to {searched[1]:.0f} Hz, from the contact of {case.source}"
    else:
        source = (
            f"{searched[0]:.0f} to {searched[1]:.0f} Hz, that of the paper's contact, because neither a case nor a "
            "band was given; give case or band_hz"
        )
    return Target(
        band_hz=searched,
        width_hz=2.0 * contact.vibration.damping_ratio * searched[0],
        full_load_crf_hz=full_load,
        source=source,
        assumed=case is None and band_hz is None,
        case=case,
    )


def _contact(machine: MachineCase) -> Case | None:
    """The contact of a machine that carries most; None where the case does not say how it vibrates."""
    if not machine.complete or "vibration" not in machine.tables:
        return None
    return machine.case(
        max((one for one in machine.contacts if not one.stands_still), key=lambda one: one.load)
    )


def _rates(machine: MachineCase) -> tuple[dict[str, float], float | None]:
    """What passes how often in a turn, by name, and the shaft's speed [Hz]."""
    every = machine.machine.frequencies
    shaft = next((every[name] for name in SHAFTS if every.get(name, 0.0) > 0.0), None)
    if shaft is None:
        return {}, None
    return {_name(key): rate / shaft for key, rate in every.items()}, shaft


def _name(key: str) -> str:
    """Of a rate: BPFO as everybody writes it."""
    bare = key.removesuffix("_hz")
    return bare.upper() if bare in ("bpfo", "bpfi", "bsf", "ftf") else bare.replace("_", " ")
