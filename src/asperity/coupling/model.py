"""How a contact becomes a vibration: mass, laws and record as one value, and the two presets.

A law can be chosen by its name, with its parameters beside it as the case file has them; what is
stated for laws that are not in use is kept, so that another law can be tried.
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

SAMPLE_BYTES, SAMPLE_S = 150.0, 1e-6  # what a sample of a record takes of memory and time
SAMPLES_PER_PERIOD = (
    15.0  # below it the straight lines between samples cost the resonance over 3 % of its power
)
LAWS: dict[str, Mapping[str, type[Any]]] = {
    "damping_law": DAMPING_LAWS,
    "stiffness_law": STIFFNESS_LAWS,
    "excitation": EXCITATIONS,
    "patch": CONTACT_PATCHES,
}
_NAMES = {"patch": "contact patch"}  # where the keyword is not what people call it

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
    """How a contact state becomes a vibration record. The defaults are the preset `sound`; `preset` makes the other.

    Parameters
    ----------
    mass : mass that rides on the contact [kg]
    damping_ratio : of the contact oscillator; 0.01 dry to 0.1 in boundary lubrication (the paper's section 2.1)
    damping_law, stiffness_law, excitation, patch : a law, or its name in DAMPING_LAWS, STIFFNESS_LAWS, EXCITATIONS and
        CONTACT_PATCHES with its parameters as further keywords: `stiffness_law="hertz-line", reference_depth=0.01`.
        "hertz-point" is the paper's spring, a line contact's own stiffness is far higher
    response, substeps : see `asperity.vibration.acceleration`
    rate_hz : samples a second; at least `samples_per_period` times the full-load resonance
    samples_per_period : 15 keeps the loss to the straight lines between samples below 3 % of CRFA (at 100 kHz and
        3.5 kHz it is 0.8 %)
    duration_s : length of the record [s]; sd(CRF) = sqrt(ζ f0 / (2π duration)), 1.7 Hz for the paper's case and 4 s
    seed : of the profile; one seed, one record
    method : how the resonance is estimated, name in INDICATOR_METHODS. The likeliest line supposes a base that is white
        in acceleration, as noise behind a filter of order 2 is; over a surface's own spectrum, or averaged by a patch,
        take "peak", or `Vibration.expected`

    Raises BadInput for a quantity out of range or a name that is not in its table.
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
    stated: Mapping[str, Any] = field(
        init=False, repr=False, compare=False
    )  # every keyword by name, used or not

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
                f"{SAMPLES_PER_PERIOD:g} is the default"
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
                f"sub-steps must be 1 or more, got {self.substeps}; {SUBSTEPS} is the default"
            )
        require_choice("response", self.response, RESPONSE_METHODS)
        require_choice("indicator method", self.method, INDICATOR_METHODS)
        if not (self.linear or self.stiffness_law.point_spring):
            raise BadInput(
                "a nonlinear response is that of Hertz's point spring, got the stiffness law "
                f"{self.stiffness_law.name!r}; take hertz-point, or the exact response"
            )

    @property
    def linear(self) -> bool:
        """Whether the spring is taken as linear."""
        return self.response != "nonlinear"

    @property
    def needs_solution(self) -> bool:
        """Whether more is asked for than the dry, fully loaded contact of the paper's section 2 can tell."""
        laws = (self.excitation, self.damping_law)
        return not self.stiffness_law.asperities_alone or any(law.needs_solution for law in laws)

    def with_choices(self, **choices: Any) -> "VibrationModel":
        """The model with other keywords; parameters stated for laws that were not in use count if they now are."""
        return VibrationModel(**{**self.stated, **_by_name(choices)})

    @classmethod
    def preset(cls, name: str, **choices: Any) -> "VibrationModel":
        """The preset `name` with `choices` (mass and damping_ratio at least) on top; BadInput for an unknown name."""
        return cls(**{**preset_choices(name), **choices})


def preset_choices(name: str) -> Mapping[str, Any]:
    """Every choice that tells the presets apart, as `name` has it.

    "paper": everything as the paper's section 2 did it, as far as it can be recovered
    (docs/theory/vibration.md); "sound", the default: fine sampling, the true damping, the
    likeliest line.
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
    """A keyword of `VibrationModel`: its type (laws and methods by name), default and SI unit.

    The default is MISSING (of dataclasses) where the keyword is required, None where it may be
    left out.
    """

    kind: Any
    default: Any
    unit: str


def vibration_choices() -> Mapping[str, Choice]:
    """Every keyword that a model can be stated with by names and numbers, laws' parameters behind their law."""
    choices: dict[str, Choice] = {}
    for name, choice in _choices(VibrationModel):
        choices[name] = (
            choice._replace(kind=str, default=choice.default.name) if name in LAWS else choice
        )
        for law in LAWS.get(name, {}).values():
            for parameter, own in _choices(law):  # type: ignore[arg-type]  # classes are hashable
                choices.pop(parameter, None)  # one that two laws share stands behind the latter
                choices[parameter] = own._replace(default=None) if own.default is MISSING else own
    return choices


@cache
def _choices(law: type) -> tuple[tuple[str, Choice], ...]:
    kinds, marks = get_type_hints(law), parameters(law)
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
    """Keywords with every law as its name and its parameters."""
    stated = dict(choices)
    for slot in LAWS:
        law = choices.get(slot)
        if law is not None and not isinstance(law, str):
            own = {name: value for name, value in asdict(law).items() if value is not None}
            stated = {**own, **stated, slot: law.name}
    return stated


def _law(slot: str, stated: Mapping[str, Any]) -> Any:
    """The law stated for a slot; parameters stated for its neighbours are checked too."""
    default, thing, laws = (
        getattr(VibrationModel, slot).name,
        _NAMES.get(slot, slot.replace("_", " ")),
        LAWS[slot],
    )
    chosen = stated.get(slot, default)
    require_choice(thing, chosen, laws)
    made = {}
    for name, law in laws.items():
        missing = [
            entry.name
            for entry in fields(law)
            if entry.default is MISSING and entry.name not in stated
        ]
        if not missing:
            made[name] = law(
                **{entry.name: stated[entry.name] for entry in fields(law) if entry.name in stated}
            )
        elif name == chosen:
            unit = parameters(law)[missing[0]].unit
            raise BadInput(
                f"{thing} {name} needs {missing[0]}, in {unit}; add it, or take the law {default}"
            )
    return made[chosen]
