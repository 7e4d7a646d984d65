"""Vibration model of a contact: mass, laws and record settings as one value, and two presets.

A law can be chosen by its name, with its parameters as further keywords, as in the case file.
Parameters of laws that are not in use are retained, so that another law can be selected later.
"""

from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields
from functools import cache
from typing import Annotated, Any, Literal, NamedTuple, get_origin, get_type_hints

from asperity.core.errors import BadInput, require_choice
from asperity.core.limits import require_affordable
from asperity.core.quantities import Parameter, Parametric, parameters
from asperity.coupling.excitations import (
    CONTACT_PATCHES,
    EXCITATIONS,
    ExcitationLaw,
    NoiseExcitation,
    NoPatch,
    PatchLaw,
)
from asperity.coupling.laws import (
    DAMPING_LAWS,
    STIFFNESS_LAWS,
    DampingLaw,
    HertzPoint,
    RatioDamping,
    StiffnessLaw,
)
from asperity.resonance import INDICATOR_METHODS, IndicatorMethod
from asperity.vibration import RESPONSE_METHODS, SUBSTEPS, ResponseMethod, require_damping_ratio

SAMPLE_BYTES, SAMPLE_S = 150.0, 1e-6  # memory [B] and time [s] per sample of a record
SAMPLES_PER_PERIOD = 15.0  # with fewer, linear interpolation costs over 3 % of the resonance power
LAWS: dict[str, Mapping[str, type[Any]]] = {
    "damping_law": DAMPING_LAWS,
    "stiffness_law": STIFFNESS_LAWS,
    "excitation": EXCITATIONS,
    "patch": CONTACT_PATCHES,
}
_NAMES = {"patch": "contact patch"}  # usual names that differ from the keyword

PRESETS: dict[str, dict[str, Any]] = {
    "paper": {
        "damping_law": "hertz-for-radian",
        "stiffness_law": "hertz-point",
        "excitation": "noise",
        "cutoff_reference_hz": 30.0,
        "filter": "bilinear",
        "filter_order": 2,
        "height_as": "rms",
        "height_of": "record",
        "coefficient": "kept",
        "patch": "none",
        "rate_hz": 10e3,
        "duration_s": 1.6384,
        "response": "rk5",
        "substeps": 8,
        "samples_per_period": 2.0,
        "method": "peak",
    }
}


@dataclass(frozen=True, kw_only=True, init=False)
class VibrationModel(Parametric):
    """Vibration model of a contact. The defaults are the preset `sound`; see also `preset`.

    Parameters
    ----------
    mass : mass on the contact spring [kg]
    damping_ratio : of the contact oscillator; 0.01 dry to 0.1 in boundary lubrication (the paper's
        section 2.1)
    damping_law, stiffness_law, excitation, patch : a law, or its name in DAMPING_LAWS,
        STIFFNESS_LAWS, EXCITATIONS and CONTACT_PATCHES with its parameters as further keywords:
        `stiffness_law="hertz-line", reference_depth=0.01`. "hertz-point" is the paper's spring; the
        stiffness of a line contact is far higher
    response, substeps : see `asperity.vibration.acceleration`
    rate_hz : sampling rate; at least `samples_per_period` times the full-load resonance
    samples_per_period : 15 keeps the loss by linear interpolation between samples below 3 % of CRFA
        (at 100 kHz and 3.5 kHz it is 0.8 %)
    duration_s : length of the record [s]; sd(CRF) = sqrt(ζ f0 / (2π duration)), 1.7 Hz for the
        paper's case and 4 s
    seed : random seed of the profile
    method : resonance estimator, name in INDICATOR_METHODS. Maximum likelihood assumes a base that
        is white in acceleration, such as noise behind a filter of order 2; for a surface's own
        spectrum, or a patch average, use "peak", or `Vibration.expected`

    Raises
    ------
    BadInput
        for a quantity out of range or an unknown name.
    """

    mass: Annotated[float, Parameter("kg", "m", "oscillator mass")]
    damping_ratio: Annotated[float, Parameter("", "ζ")]
    damping_law: DampingLaw = field(default=RatioDamping())
    stiffness_law: StiffnessLaw = field(default=HertzPoint())
    excitation: ExcitationLaw = field(default=NoiseExcitation())
    patch: PatchLaw = field(default=NoPatch())
    response: ResponseMethod = "exact"
    substeps: int = SUBSTEPS
    rate_hz: Annotated[float, Parameter("Hz", positive="vibration sampling rate")] = 100e3
    samples_per_period: float = SAMPLES_PER_PERIOD
    duration_s: Annotated[float, Parameter("s", positive="vibration duration")] = 4.0
    seed: int = 1
    method: IndicatorMethod = "likelihood"
    # every keyword by name, used or not
    stated: Mapping[str, Any] = field(init=False, repr=False, compare=False)

    def __init__(self, *, mass: float, damping_ratio: float, **choices: Any) -> None:
        choices = _by_name({"mass": mass, "damping_ratio": damping_ratio, **choices})
        stated = {name: value for name, value in choices.items() if value is not None}
        if unknown := sorted(stated.keys() - vibration_choices().keys()):
            raise TypeError(f"VibrationModel has no keyword {', '.join(unknown)}")
        values = {
            entry.name: stated.get(entry.name, entry.default)
            for entry in fields(self)
            if entry.init
        }
        for name, value in {
            **values,
            **{slot: _law(slot, stated) for slot in LAWS},
            "stated": stated,
        }.items():
            object.__setattr__(self, name, value)
        self.__post_init__()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_damping_ratio(self.damping_ratio)
        if not self.samples_per_period >= 2.0:
            raise BadInput(
                f"samples per period must be at least 2, got {self.samples_per_period:g}; "
                f"the default is {SAMPLES_PER_PERIOD:g}"
            )
        samples = self.duration_s * self.rate_hz
        require_affordable(
            f"a vibration record of {self.duration_s:g} s at {self.rate_hz:g} Hz",
            memory=SAMPLE_BYTES * samples,
            seconds=SAMPLE_S * samples * (1.0 if self.linear else float(self.substeps)),
        )
        if self.seed < 0:
            raise BadInput(f"vibration seed must be 0 or more, got {self.seed}")
        if self.substeps < 1:
            raise BadInput(
                f"sub-steps must be 1 or more, got {self.substeps}; the default is {SUBSTEPS}"
            )
        require_choice("response", self.response, RESPONSE_METHODS)
        require_choice("indicator method", self.method, INDICATOR_METHODS)
        if not (self.linear or self.stiffness_law.point_spring):
            raise BadInput(
                "a nonlinear response needs Hertz's point spring, got the stiffness law "
                f"{self.stiffness_law.name!r}; use hertz-point or the exact response"
            )

    @property
    def linear(self) -> bool:
        """True if the spring is linear."""
        return self.response != "nonlinear"

    @property
    def needs_solution(self) -> bool:
        """True if the model needs more than the dry, fully loaded contact of the paper."""
        laws = (self.excitation, self.damping_law)
        return not self.stiffness_law.asperities_alone or any(law.needs_solution for law in laws)

    def with_choices(self, **choices: Any) -> "VibrationModel":
        """Return the model with other keywords; retained parameters of a law now in use apply."""
        return VibrationModel(**{**self.stated, **_by_name(choices)})

    @classmethod
    def preset(cls, name: str, **choices: Any) -> "VibrationModel":
        """Return the preset `name` with `choices` (at least mass and damping_ratio) applied.

        Raises
        ------
        BadInput
            for an unknown name.
        """
        return cls(**{**preset_choices(name), **choices})


def preset_choices(name: str) -> Mapping[str, Any]:
    """Return the settings of the preset `name` that differ between presets.

    "paper": as in the paper's section 2, as far as it can be recovered (docs/theory/vibration.md);
    "sound", the default: fine sampling, the true damping, maximum likelihood.
    """
    if name == "sound":
        return {
            key: choice.default
            for key, choice in vibration_choices().items()
            if key in PRESETS["paper"]
        }
    if name not in PRESETS:
        raise BadInput(f"vibration preset must be one of sound, {', '.join(PRESETS)}, got {name!r}")
    return PRESETS[name]


class Choice(NamedTuple):
    """Keyword of `VibrationModel`: its type (laws and methods by name), default and SI unit.

    The default is MISSING (of dataclasses) if the keyword is required, None if it is optional.
    """

    kind: Any
    default: Any
    unit: str


def vibration_choices() -> Mapping[str, Choice]:
    """Return every keyword of a model that is stated by a name or a number.

    Parameters of laws follow their law.
    """
    choices: dict[str, Choice] = {}
    for name, choice in _choices(VibrationModel):
        choices[name] = (
            choice._replace(kind=str, default=choice.default.name) if name in LAWS else choice
        )
        for law in LAWS.get(name, {}).values():
            for parameter, own in _choices(law):  # type: ignore[arg-type]  # classes are hashable
                choices.pop(parameter, None)  # a shared parameter follows the last of its laws
                choices[parameter] = own._replace(default=None) if own.default is MISSING else own
    return choices


@cache
def _choices(law: type) -> tuple[tuple[str, Choice], ...]:
    kinds = get_type_hints(law)
    marks = parameters(law)
    return tuple(
        (
            entry.name,
            Choice(
                str if get_origin(kinds[entry.name]) is Literal else kinds[entry.name],
                entry.default,
                marks[entry.name].unit,
            ),
        )
        for entry in fields(law)
        if entry.init
    )


def _by_name(choices: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keywords with every law replaced by its name and parameters."""
    stated = dict(choices)
    for slot in LAWS:
        law = choices.get(slot)
        if law is not None and not isinstance(law, str):
            values = {name: value for name, value in asdict(law).items() if value is not None}
            stated = {**values, **stated, slot: law.name}
    return stated


def _law(slot: str, stated: Mapping[str, Any]) -> Any:
    """Return the law of a slot; parameters of its alternatives are checked too."""
    default = getattr(VibrationModel, slot).name
    label = _NAMES.get(slot, slot.replace("_", " "))
    laws = LAWS[slot]
    name_of_law = stated.get(slot, default)
    require_choice(label, name_of_law, laws)
    instances = {}
    for name, law in laws.items():
        missing = [
            entry.name
            for entry in fields(law)
            if entry.default is MISSING and entry.name not in stated
        ]
        if not missing:
            instances[name] = law(
                **{entry.name: stated[entry.name] for entry in fields(law) if entry.name in stated}
            )
        elif name == name_of_law:
            unit = parameters(law)[missing[0]].unit
            raise BadInput(
                f"{label} {name} needs {missing[0]}, in {unit}; add it, or use the law {default}"
            )
    return instances[name_of_law]
