"""A quantity of a case that may lie anywhere in a range: how it is written, and what a share of the way is.

`sensitivity` and `calibration` both ask what a case does as several of its quantities move.
`OPEN_RANGES` are those that the paper leaves open, each with the reason for its ends.
"""

import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from asperity.case import Case, split_amount
from asperity.core.errors import BadInput

# a range whose ends are positive and differ by more than this factor is gone through in its
# logarithm
LOG_FROM = 2.0
DIGITS = 4  # of a value in a range: no curve tells more
FEWEST_CELLS = 8
LENGTH_KEY = "surface.correlation_length"
_ENTRY = re.compile(r"(?P<key>.+)\[(?P<place>\d+)\]")


@dataclass(frozen=True)
class ParameterRange:
    """A quantity of a case and the values it may take.

    Parameters
    ----------
    key : dotted key of the case; an entry of a pair with its place, "grid.x[0]"
    low, high : the ends, in `unit`
    unit : as a case file writes it, "GPa"; "" for a plain number
    reason : why these ends, a phrase
    """

    key: str
    low: float
    high: float
    unit: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise BadInput(
                f"{self.key} must have a range that goes upwards, got {self.low:g} to {self.high:g}"
            )

    @property
    def log(self) -> bool:
        """Whether shares of the way are taken in the logarithm."""
        return self.low > 0.0 and self.high / self.low >= LOG_FROM

    def value(self, share: float) -> float:
        """The value at a share of the way, 0 to 1, in the range's unit."""
        value = self.low + share * (self.high - self.low)
        if self.log:
            value = self.low * (self.high / self.low) ** share
        return float(f"{value:.{DIGITS}g}")

    def share(self, value: float) -> float:
        """How far along the range a value in its unit lies; not bounded to 0 and 1."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def written(self, share: float) -> str | float:
        """The value at a share of the way as a case file writes it."""
        value = self.value(share)
        return f"{value:g} {self.unit}" if self.unit else value

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.key}={self.low:g}{unit}..{self.high:g}{unit}"


OPEN_RANGES = (
    ParameterRange(
        "material.hardness",
        0.5,
        5.0,
        "GPa",
        "from just above Hertz's mean pressure to quenched 45 steel (50 HRC)",
    ),
    ParameterRange(
        LENGTH_KEY,
        10.0,
        85.0,
        "um",
        "from four cells of the coarser grid to nearly half the domain",
    ),
    ParameterRange(
        "lubricant.viscosity.alpha",
        12.0,
        26.0,
        "1/GPa",
        "mineral oils, warm paraffinic to cool naphthenic",
    ),
    ParameterRange(
        "grid.x[0]", -4.5, -1.9, "", "from an inlet that feeds the film to the printed one"
    ),
    ParameterRange(
        "solver.contact_film", 1.0, 20.0, "nm", "from a few molecules of oil to a boundary film"
    ),
    ParameterRange(
        "vibration.cutoff_exponent",
        0.0,
        0.5,
        "",
        "from a cut-off that ignores CAR to one that goes with its root",
    ),
    ParameterRange(
        "vibration.cutoff_reference",
        20.0,
        40.0,
        "Hz",
        "the neighbours of 30 Hz in the paper's Table 1",
    ),
)


def parse_range(text: str) -> ParameterRange:
    """A range as the command line has it, `KEY=LOW..HIGH`, such as "material.hardness=0.65 GPa..3 GPa".

    `BadInput` for what is no such text, or has ends of different kinds or the wrong way round.
    """
    key, equals, ends = (part.strip() for part in text.partition("="))
    low, dots, high = (part.strip() for part in ends.partition(".."))
    if not (key and equals and low and dots and high):
        raise BadInput(
            f"a range is KEY=LOW..HIGH such as 'material.hardness=0.65 GPa..3 GPa', got {text!r}"
        )
    try:
        first, unit = split_amount(_number_or_text(low))
        last = split_amount(_number_or_text(high), unit)[0]
    except BadInput as error:
        raise BadInput(f"{key} {error}") from None
    return ParameterRange(key, float(first), float(last), unit)


def _number_or_text(text: str) -> object:
    try:
        return float(text)
    except ValueError:
        return text


def open_ranges(
    case: Case, wanted: Sequence[ParameterRange] = OPEN_RANGES
) -> tuple[ParameterRange, ...]:
    """Those of `wanted` that the case has a key for; lengths of roughness kept to what its grid can carry."""
    ranges = [entry for entry in wanted if _has(case, entry.key)]
    ranges = [
        entry
        for entry in ranges
        if entry_of(entry.key)[1] is None or stated_value(case, entry.key) is not None
    ]
    return tuple(
        _carried(case, entry, ranges) if entry.key == LENGTH_KEY else entry for entry in ranges
    )


def _has(case: Case, key: str) -> bool:
    section: Any = case.contents
    for name in entry_of(key)[0].split("."):
        if name not in getattr(type(section), "model_fields", {}):
            return False
        section = getattr(section, name)
    return True


def _carried(
    case: Case, lengths: ParameterRange, others: Sequence[ParameterRange]
) -> ParameterRange:
    """Two cells at least and half the domain at most, on every grid in the ranges."""
    inlets = [
        entry.value(share) for entry in others if entry.key == "grid.x[0]" for share in (0.0, 1.0)
    ]
    grid = case.grid
    a, upper = case.conditions.hertz.half_widths[0], grid.upper[0]
    along = [upper - inlet * a for inlet in inlets] or [grid.extent[0]]
    fewest = (
        grid.cells[0] * min(along) / max(along)
    )  # cells go along, to a whole even number: one may be missing
    widened = fewest / (fewest - 1.0) if inlets else 1.0
    coarsest = 1e6 * max(
        widened * max(along) / grid.cells[0], grid.spacing[1]
    )  # um, as the length's range
    shortest = 1e6 * min(*along, grid.extent[1])
    low, high = max(lengths.low, 2.0 * coarsest), min(lengths.high, 0.49 * shortest)
    if low >= high:
        reason = (
            f"the grid carries no correlation length from {lengths.low:g} to {lengths.high:g} um"
        )
        raise BadInput(f"{case.source}: {reason}; use more cells or a larger domain")
    step = 10.0 ** (math.floor(math.log10(low)) - 2)  # three digits, which the grid still carries
    return replace(
        lengths, low=float(f"{math.ceil(low / step) * step:.6g}"), high=float(f"{_down(high):.6g}")
    )


def _down(value: float) -> float:
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / step) * step


def entry_of(key: str) -> tuple[str, int | None]:
    """The case's key, and the place in its pair where the key names one: "grid.x[0]" is ("grid.x", 0)."""
    entry = _ENTRY.fullmatch(key)
    return (entry["key"], int(entry["place"])) if entry else (key, None)


def stated_value(case: Case, key: str) -> Any:
    """What the case states for a dotted key, as a case file writes it; None where it states nothing."""
    name, place = entry_of(key)
    value: Any = tomllib.loads(case.text)
    for part in name.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if place is None or value is None:
        return value
    return value[place] if isinstance(value, list) and place < len(value) else None


def overrides_at(
    case: Case, ranges: Sequence[ParameterRange], shares: Iterable[float]
) -> dict[str, Any]:
    """The case's overrides at a share of the way through each range.

    Where the domain is moved along x or y, its cells go with it, so that their size stays that of
    the case's cells on the widest domain in the ranges.
    """
    overrides: dict[str, Any] = {}
    for entry, share in zip(ranges, map(float, shares), strict=True):
        key, place = entry_of(entry.key)
        if place is None:
            overrides[key] = entry.written(share)
        else:
            whole = overrides.get(key, stated_value(case, key))
            overrides[key] = [
                entry.written(share) if i == place else value for i, value in enumerate(whole)
            ]
    cells = list(case.grid.cells)
    for axis, key in enumerate(("grid.x", "grid.y")):
        if key in overrides and cells[axis] > 1:
            reach = overrides[key][1] - overrides[key][0]
            cells[axis] = max(
                2 * round(cells[axis] * reach / _widest(case, ranges, key) / 2), FEWEST_CELLS
            )
    if tuple(cells) != case.grid.cells:
        overrides["grid.cells"] = cells
    return overrides


def _widest(case: Case, ranges: Sequence[ParameterRange], key: str) -> float:
    low, high = (float(value) for value in stated_value(case, key))
    for entry in ranges:
        name, place = entry_of(entry.key)
        if name == key and place is not None:
            low, high = (entry.low, high) if place == 0 else (low, entry.high)
    return high - low


def require_ranges(
    case: Case, ranges: Sequence[ParameterRange], reserved: Mapping[str, str]
) -> None:
    """Refuse ranges named twice, of a `reserved` key (the value says why) or that the case would refuse, and none."""
    if not ranges:
        raise BadInput(
            f"{case.source}: nothing is varied; name a range such as 'material.hardness=0.65 GPa..3 GPa'"
        )
    keys = [entry.key for entry in ranges]
    for key in keys:
        if key in reserved:
            raise BadInput(f"{key} cannot be varied: {reserved[key]}")
        if keys.count(key) > 1:
            raise BadInput(f"{key} is varied twice; name it once")
        if entry_of(key)[1] is not None and stated_value(case, key) is None:
            raise BadInput(
                f"{case.source}: {key} is no entry of the case; name one such as grid.x[0]"
            )
    for number in range(len(ranges)):
        for end in (0.0, 1.0):
            shares = [end if place == number else 0.5 for place in range(len(ranges))]
            case.with_overrides(overrides_at(case, ranges, shares))


def at_cells(case: Case, cells: int | None) -> Case:
    """The case on `cells` x `cells` cells; None: as it is. An axis of one cell keeps it."""
    if cells is None:
        return case
    if cells < FEWEST_CELLS:
        raise BadInput(f"cells must be {FEWEST_CELLS} or more, got {cells}; 128 is the default")
    return case.with_overrides(
        {"grid.cells": [cells if count > 1 else 1 for count in case.grid.cells]}
    )
