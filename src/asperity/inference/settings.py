"""Inference setting of a case: unknowns and priors, operating ranges, size of the emulator."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

from asperity.case import Case, InferSection, PriorSection, SheetSection, split_amount
from asperity.core.errors import BadInput
from asperity.coupling import structural_resonance
from asperity.inference.priors import Unknown
from asperity.structure import MIN_CONTACT_SHARE
from asperity.study import ParameterRange, full_key, overrides_at, require_ranges, stated_value

LOAD = "contact.load"
SPEED = "contact.entrainment_speed"
TEMPERATURE = "lubricant.temperature"
OFFSET = "temperature_offset_k"
GRID_ERROR = "grid_error"
# default ranges of load and speed, as factors on the case's values
OPERATING: Mapping[str, tuple[float, float]] = {LOAD: (0.4, 2.0), SPEED: (0.25, 2.0)}
TEMPERATURE_SPAN_K = 25.0  # on both sides of the case's temperature
OFFSET_STD_K = 3.0
MIN_CELLS_PER_LENGTH = 2.0  # the grid does not resolve shorter correlation lengths
Prior = PriorSection | Literal["known"]
LENGTHS = (
    "surface.correlation_length",
    "surface.correlation_length[0]",
    "surface.correlation_length[1]",
)


@dataclass(frozen=True, slots=True)
class _Default:
    """Default prior of a quantity: a factor up and down, limits, or a relative deviation."""

    key: str
    factor: float = 1.0
    limits: tuple[float, float] | None = None
    relative_std: float = math.nan
    reason: str = ""
    emulated: bool = True


UNKNOWNS: Mapping[str, _Default] = {
    "surface.sq": _Default("sq_m", 4.0, reason="from a fourth of the stated Sq to four times it"),
    LENGTHS[0]: _Default("correlation_length_x_m", 1.6, reason="a factor 1.6 either way"),
    LENGTHS[1]: _Default("correlation_length_x_m", 1.6, reason="a factor 1.6 either way"),
    LENGTHS[2]: _Default("correlation_length_y_m", 1.6, reason="a factor 1.6 either way"),
    "material.hardness": _Default(
        "hardness_pa", 2.0, reason="a factor 2 either way: it is seldom known"
    ),
    "lubricant.viscosity.eta0": _Default("oil_viscosity_pa_s", 2.0, reason="15 to 20 K either way"),
    "lubricant.viscosity.alpha": _Default(
        "oil_alpha_1_pa", 1.25, reason="the difference between estimates of alpha"
    ),
    "vibration.mass": _Default(
        "mass_kg",
        relative_std=0.1,
        reason="the mass is weighed, its effective share is not known",
        emulated=False,
    ),
    "vibration.damping_ratio": _Default(
        "damping_ratio", 3.0, reason="dry joints to damped ones", emulated=False
    ),
    "vibration.cutoff_exponent": _Default(
        "cutoff_exponent",
        limits=(0.0, 0.5),
        emulated=False,
        reason="from a cut-off independent of CAR to one proportional to its square root",
    ),
}


@dataclass(frozen=True)
class Setting:
    """Unknowns, priors and operating ranges of a case, and the size of its emulator.

    Parameters
    ----------
    case : the contact, on the emulator's grid, without [infer]
    contact : unknowns that are inputs of the emulator
    others : unknowns of the measurement: mass, damping, bandwidth, temperature offset, grid error
    operating : ranges of load and speed, and of temperature for an oil given by its data sheet
    points, surfaces, seed : of the emulator
    """

    case: Case
    contact: tuple[Unknown, ...]
    others: tuple[Unknown, ...]
    operating: tuple[ParameterRange, ...]
    points: int
    surfaces: int
    seed: int

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """All unknowns, in the order of z."""
        return (*self.contact, *self.others)

    @property
    def ranges(self) -> tuple[ParameterRange, ...]:
        """Ranges of the emulator's inputs, in order."""
        return (*(unknown.range for unknown in self.contact), *self.operating)


def inference_setting(case: Case) -> Setting:
    """Return the inference setting of a case from its [infer] and the defaults in `UNKNOWNS`.

    Raises
    ------
    BadInput
        for a case without [vibration], oil or roughness; a prior of a quantity that cannot be
        inferred; a range that the grid does not resolve.
    """
    _require_inferable(case)
    section = case.contents.infer or InferSection()
    base = case.with_written({"infer": "none", "study": "none", "grid.cells": list(section.cells)})
    priors = {_key_of(case, name): prior for name, prior in section.axes.items()}
    operating = _operating(base, priors)
    unknowns = [
        unknown
        for key, default in UNKNOWNS.items()
        if (unknown := _unknown(base, key, default, priors.get(key), operating)) is not None
    ]
    if not any(unknown.key == "sq_m" for unknown in unknowns) and "surface.sq" not in priors:
        raise BadInput(
            f"{case.source}: surface has no sq to infer; use a generated surface, kind gaussian"
        )
    if any(entry.key == TEMPERATURE for entry in operating):
        label = "of the oil from the stated value"
        unknowns.append(Unknown.stated(OFFSET, TEMPERATURE, 0.0, OFFSET_STD_K, "K", label))
    unknowns.append(
        Unknown.stated(GRID_ERROR, "grid.cells", 0.0, 1.0, "", "of the emulator's grid")
    )
    contact = tuple(
        u for u in unknowns if u.range.key in UNKNOWNS and UNKNOWNS[u.range.key].emulated
    )
    others = tuple(u for u in unknowns if u not in contact)
    setting = Setting(
        base, contact, others, operating, section.points, section.surfaces, section.seed
    )
    require_ranges(base, setting.ranges, {})
    return setting


def _require_inferable(case: Case) -> None:
    """Raise BadInput for a case without vibration, oil or roughness."""
    if case.vibration is None:
        raise BadInput(
            f"{case.source}: vibration is missing; add [vibration] with mass and damping_ratio"
        )
    if case.lubricant is None:
        raise BadInput(f"{case.source}: the contact is dry, so that CLR is 1; add a lubricant")
    if stated_value(case, "surface.kind") == "flat":
        raise BadInput(f"{case.source}: surface is flat, without asperity contact; use a rough one")


def _key_of(case: Case, name: str) -> str:
    """Return the case key of a name in [infer]; BadInput for one that cannot be inferred."""
    key = name if name in UNKNOWNS else full_key(case, name, "infer")
    if key not in UNKNOWNS and key not in (*OPERATING, TEMPERATURE):
        names = ", ".join(
            sorted({entry.rpartition(".")[2] for entry in (*UNKNOWNS, *OPERATING, TEMPERATURE)})
        )
        raise BadInput(f"{case.source}: infer.{name} cannot be inferred; possible are {names}")
    return key


def _operating(case: Case, priors: Mapping[str, Prior]) -> tuple[ParameterRange, ...]:
    ranges = []
    for key, (low, high) in OPERATING.items():
        value, unit = split_amount(stated_value(case, key))
        default = ParameterRange(
            key, low * float(value), high * float(value), unit, "about the case's own"
        )
        ranges.append(_stated_range(case, key, priors.get(key)) or default)
    if isinstance(case.contents.lubricant, SheetSection):
        value, unit = split_amount(stated_value(case, TEMPERATURE))
        limits = float(value) - TEMPERATURE_SPAN_K, float(value) + TEMPERATURE_SPAN_K
        default = ParameterRange(TEMPERATURE, *limits, unit, "about the case's own")
        ranges.append(_stated_range(case, TEMPERATURE, priors.get(TEMPERATURE)) or default)
    elif TEMPERATURE in priors:
        raise BadInput(
            f"{case.source}: infer.temperature needs an oil given by its data sheet; "
            "set grade and temperature"
        )
    return tuple(ranges)


def _stated_range(case: Case, key: str, prior: Prior | None) -> ParameterRange | None:
    """Return an operating range stated in [infer], or None."""
    if prior is None:
        return None
    if not isinstance(prior, PriorSection) or prior.start is None:
        name = key.rpartition(".")[2]
        raise BadInput(f"{case.source}: infer.{name} is an operating range; give from and to")
    return _range(case, key, prior)


def _range(case: Case, key: str, prior: PriorSection) -> ParameterRange:
    low, unit = _amount(case, key, "from", prior.start)
    high, _ = _amount(case, key, "to", prior.to, unit)
    return ParameterRange(key, low, high, unit, "as stated")


def _amount(
    case: Case, key: str, entry: str, value: object, unit: str | None = None
) -> tuple[float, str]:
    try:
        number, written_unit = split_amount(value, unit)
    except BadInput as error:
        raise BadInput(f"{case.source}: infer.{key.rpartition('.')[2]}.{entry} {error}") from None
    return float(number), written_unit


def _unknown(
    case: Case,
    key: str,
    default: _Default,
    prior: Prior | None,
    operating: tuple[ParameterRange, ...],
) -> Unknown | None:
    """Return an unknown with its stated or default prior; None if absent or known in the case."""
    case_value = _own_value(case, key)
    if prior == "known" or case_value is None:
        if isinstance(prior, PriorSection):
            raise BadInput(
                f"{case.source}: infer.{key} has a prior, but the case has no such quantity"
            )
        return None
    if prior is not None:
        return _stated_unknown(case, key, default.key, prior, operating)
    number, unit = split_amount(case_value)
    mean = float(number)
    if not math.isnan(default.relative_std):
        std = default.relative_std * mean
        if key == "vibration.mass" and case.structure is not None:
            std = max(std, _structural_mass_std(case) * mean)
        return Unknown.stated(default.key, key, mean, std, unit, default.reason)
    low, high = default.limits or (mean / default.factor, mean * default.factor)
    entry = ParameterRange(key, float(f"{low:.4g}"), float(f"{high:.4g}"), unit, default.reason)
    return Unknown(default.key, _resolved(case, entry, operating))


def _structural_mass_std(case: Case) -> float:
    """Return the relative uncertainty of the mass that stands for that of the structure.

    An error of the mode's frequency is one of the frequency on the mass over the contact's share.
    """
    assert case.structure is not None
    assert case.vibration is not None
    resonance = structural_resonance(case.structure, case.conditions, case.vibration)
    return 2.0 * resonance.frequency_std / max(resonance.contact_share, MIN_CONTACT_SHARE)


def _own_value(case: Case, key: str) -> object:
    """Return the case's own value of a quantity; None if it has none, or as another quantity."""
    value = stated_value(case, key)
    if key == LENGTHS[0] and isinstance(value, list):
        return value[0] if value[0] == value[1] else None
    return None if key in LENGTHS[1:] and _isotropic(case) else value


def _stated_unknown(
    case: Case,
    key: str,
    name: str,
    prior: PriorSection,
    operating: tuple[ParameterRange, ...],
) -> Unknown:
    """Return an unknown with the prior stated in [infer]: a value and its deviation, or a range."""
    if prior.start is None:
        mean, unit = _amount(case, key, "value", prior.value)
        std, _ = _amount(case, key, "std", prior.std, unit)
        if not 0.0 < std < math.inf:
            raise BadInput(
                f"{case.source}: infer.{key}.std must be positive, got {prior.std}; "
                'for a certain value, write "known"'
            )
        return Unknown.stated(name, key, mean, std, unit, "as stated")
    entered = _range(case, key, prior)
    resolved = _resolved(case, entered, operating)
    if resolved != entered:
        raise BadInput(
            f"{case.source}: infer.{key.rpartition('.')[2]} must lie within {resolved.low:g} "
            f"to {resolved.high:g} {resolved.unit}, which the emulator's grid resolves at "
            "every load; narrow it, or increase infer.cells"
        )
    return Unknown(name, entered)


def _isotropic(case: Case) -> bool:
    lengths = stated_value(case, LENGTHS[0])
    return not isinstance(lengths, list) or lengths[0] == lengths[1]


def _resolved(
    case: Case, lengths: ParameterRange, operating: tuple[ParameterRange, ...]
) -> ParameterRange:
    """Limit a range, if of correlation lengths, to those that the grid resolves at every load."""
    if lengths.key not in LENGTHS:
        return lengths
    loads = next(entry for entry in operating if entry.key == LOAD)
    grids = [case.with_written(overrides_at(case, [loads], [end])).grid for end in (0.0, 1.0)]
    scale = 1.0 / float(Unknown("", lengths).to_si(1.0))  # type: ignore[arg-type]
    low = MIN_CELLS_PER_LENGTH * scale * max(max(grid.spacing) for grid in grids)
    high = 0.49 * scale * min(min(grid.extent) for grid in grids)
    low, high = (
        max(lengths.low, float(f"{1.005 * low:.3g}")),
        min(lengths.high, float(f"{0.995 * high:.3g}")),
    )
    if low >= high:
        raise BadInput(
            f"{case.source}: the emulator's grid resolves no correlation length from "
            f"{lengths.low:g} to {lengths.high:g} {lengths.unit}; increase infer.cells, or mark "
            'the length as "known"'
        )
    return replace(lengths, low=low, high=high)
