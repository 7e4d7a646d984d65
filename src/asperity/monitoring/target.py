"""Search target: band and line width of the contact resonance, and its limit at full load share."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from asperity.case import Case, MachineCase
from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR
from asperity.core.errors import BadInput, require_positive
from asperity.coupling import BAND_MARGIN, StructuralResonance, search_band, structural_resonance
from asperity.paper import papers_case
from asperity.structure import MIN_CONTACT_SHARE, NamedStructure, Structure
from asperity.trend import LoadShare, asperity_load_share

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

    @property
    def unresponsive(self) -> str:
        """Reason why the mode says too little about the contact for a wear stage; else ""."""
        mode = self.structural
        if mode is None or not mode.unresponsive:
            return ""
        return (
            f"No wear stage is determined: the contact has {100.0 * mode.contact_share:.2g} % of "
            f"the strain energy of the mode at {mode.full_load_hz:.0f} Hz, less than "
            f"{100.0 * MIN_CONTACT_SHARE:.0f} %, so that its frequency says little about the "
            "contact; use a sensor and band where it has more (`asperity observe`)."
        )

    @property
    def _on_its_mass(self) -> StructuralResonance | None:
        """Resonance of the mass of [vibration] on a spring by another law than the sphere's."""
        model = None if self.case is None else self.case.vibration
        if self.case is None or model is None:
            return None
        if model.stiffness_law.point_spring or not model.stiffness_law.asperities_alone:
            return None
        mass = Structure.single_mass(model.mass)
        named = NamedStructure(name="the mass of [vibration]", structure=mass, frequency_std=0.0)
        return structural_resonance(named, self.case.conditions, model)

    def load_share(self, crf_hz: Field, crf_std_hz: Field) -> LoadShare | None:
        """Return the load share of the asperities by CRF; None without a responsive model.

        In a structure its interval includes the uncertainty of the structure's frequencies.
        """
        if self.full_load_crf_hz is None or self.unresponsive:
            return None
        resonance = self.structural or self._on_its_mass
        if resonance is None:
            return asperity_load_share(crf_hz, crf_std_hz, self.full_load_crf_hz)
        half = NORMAL_FACTOR * np.hypot(crf_std_hz, resonance.frequency_std * crf_hz)
        clr, low, high = (
            np.where(np.isfinite(crf_hz), resonance.load_share(ends), np.nan)
            for ends in (crf_hz, np.maximum(crf_hz - half, 1.0), crf_hz + half)
        )
        return LoadShare(clr=clr, interval=(low, high))


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
    if band_hz is not None and case is None:
        low, high = _valid_band(band_hz)
        return Target(
            band_hz=(low, high),
            width_hz=2.0 * USUAL_DAMPING * low,
            full_load_crf_hz=None,
            source=_source((low, high), None, given=True),
        )
    contact = case or papers_case()
    model = contact.vibration
    if model is None:
        raise BadInput(
            f"{contact.source}: [vibration] is missing; add it with mass and damping_ratio, "
            "or give a band"
        )
    structural = None
    if contact.structure is not None:
        structural = structural_resonance(contact.structure, contact.conditions, model)
    possible = search_band(contact.conditions, model) if structural is None else structural.band_hz
    searched = possible if band_hz is None else _valid_band(band_hz)
    damping_ratio = model.damping_ratio if structural is None else structural.damping_ratio
    return Target(
        band_hz=searched,
        width_hz=2.0 * damping_ratio * searched[0],
        full_load_crf_hz=None if case is None else possible[1] / (1.0 + BAND_MARGIN),
        source=_source(searched, case, given=band_hz is not None),
        structural=structural,
        assumed=case is None and band_hz is None,
        case=case,
    )


def _source(band_hz: tuple[float, float], case: Case | None, *, given: bool) -> str:
    """Return the origin of a band."""
    span = f"{band_hz[0]:.0f} to {band_hz[1]:.0f} Hz"
    if given:
        return f"{span}, as given"
    if case is None:
        return (
            f"{span}, that of the paper's contact, because neither a case nor a band was given; "
            "give `case` or `band_hz`"
        )
    inside = "" if case.structure is None else f" in {case.structure.name}"
    return f"{span}, from the contact of {case.source}{inside}"


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
