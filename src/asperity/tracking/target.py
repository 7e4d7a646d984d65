"""Which resonance is looked for: a band, how wide its line is, where it ends with all load on asperities."""

from dataclasses import dataclass, field

from asperity.case import Case
from asperity.coupling import BAND_MARGIN, search_band
from asperity.errors import BadInput, require_positive
from asperity.paper import papers_case

USUAL_DAMPING = 0.02  # the paper's, where no case states one


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """Where the contact resonance may lie.

    `band_hz` its ends; `width_hz` half-power width of a line at the lower end; `full_load_crf_hz` the resonance with
    all load on asperities, None where no contact model is known; `source` a sentence that says who chose the band;
    `assumed` whether that was nobody; `case` the contact that was given.
    """

    band_hz: tuple[float, float]
    width_hz: float
    full_load_crf_hz: float | None
    source: str
    assumed: bool = False
    case: Case | None = field(default=None, repr=False, compare=False)


def search_target(case: Case | None = None, band_hz: tuple[float, float] | None = None) -> Target:
    """The band of a case's contact model, or the one given; else that of the paper's contact, and it says so.

    Raises
    ------
    BadInput
        for a case without [vibration], or a band that is none.
    """
    if band_hz is not None:
        low, high = (require_positive("band", end, "Hz") for end in band_hz)
        if not low < high:
            raise BadInput(f"band must go from low to high, got {low:g} to {high:g} Hz; swap them")
        source = f"{low:.0f} to {high:.0f} Hz, as given"
        if case is None:
            return Target(band_hz=(low, high), width_hz=2.0 * USUAL_DAMPING * low, full_load_crf_hz=None, source=source)
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
