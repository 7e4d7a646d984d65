"""Ranges of a case's quantities, shared by sensitivity analysis and calibration.

`OPEN_RANGES` are the quantities that the paper does not state, each with the reason for its ends.
"""

import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from asperity.case import Case, split_amount
from asperity.core.errors import BadInput

LOG_FROM = 2.0  # ratio of positive ends from which on a range is sampled in its logarithm
DIGITS = 4  # significant digits of a value in a range
FEWEST_CELLS = 8
LENGTH_KEY = "surface.correlation_length"
_ENTRY = re.compile(r"(?P<key>.+)\[(?P<index>\d+)\]")


@dataclass(frozen=True)
class ParameterRange:
    """A quantity of a case and the values it may take.

    Parameters
    ----------
    key : dotted key of the case; an entry of a pair with its index, "grid.x[0]"
    low, high : the ends, in `unit`
    unit : as in a case file, "GPa"; "" for a plain number
    reason : reason for the ends, a phrase
    """

    key: str
    low: float
    high: float
    unit: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise BadInput(
                f"{self.key} must have an ascending range, got {self.low:g} to {self.high:g}"
            )

    @property
    def log(self) -> bool:
        """True if shares are taken in the logarithm."""
        return self.low > 0.0 and self.high / self.low >= LOG_FROM

    def value(self, share: float) -> float:
        """Return the value at a share of the range, 0 to 1, in the range's unit."""
        value = self.low + share * (self.high - self.low)
        if self.log:
            value = self.low * (self.high / self.low) ** share
        return float(f"{value:.{DIGITS}g}")

    def share(self, value: float) -> float:
        """Return the share of the range at a value in its unit; not clipped to 0 and 1."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def written(self, share: float) -> str | float:
        """Return the value at a share of the range as in a case file."""
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
    """Parse a range `KEY=LOW..HIGH`, such as "material.hardness=0.65 GPa..3 GPa".

    `BadInput` for malformed text, ends of different dimensions or a descending range.
    """
    key, equals, interval = (part.strip() for part in text.partition("="))
    low, dots, high = (part.strip() for part in interval.partition(".."))
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
    case: Case, candidates: Sequence[ParameterRange] = OPEN_RANGES
) -> tuple[ParameterRange, ...]:
    """Return the ranges whose key the case has; its grid limits the correlation length."""
    ranges = [entry for entry in candidates if _has(case, entry.key)]
    ranges = [
        entry
        for entry in ranges
        if entry_of(entry.key)[1] is None or stated_value(case, entry.key) is not None
    ]
    return tuple(
        _resolved(case, entry, ranges) if entry.key == LENGTH_KEY else entry for entry in ranges
    )


def _has(case: Case, key: str) -> bool:
    section: object = case.contents
    for name in entry_of(key)[0].split("."):
        if name not in getattr(type(section), "model_fields", {}):
            return False
        section = getattr(section, name)
    return True


def _resolved(
    case: Case, lengths: ParameterRange, others: Sequence[ParameterRange]
) -> ParameterRange:
    """Limit lengths to at least two cells and at most half the domain, on every grid."""
    inlets = [
        entry.value(share) for entry in others if entry.key == "grid.x[0]" for share in (0.0, 1.0)
    ]
    grid = case.grid
    a = case.conditions.hertz.half_widths[0]
    upper = grid.upper[0]
    extents = [upper - inlet * a for inlet in inlets] or [grid.extent[0]]
    # the number of cells follows the domain, rounded to an even number: one may be missing
    fewest = grid.cells[0] * min(extents) / max(extents)
    widened = fewest / (fewest - 1.0) if inlets else 1.0
    # in um, as the range of the length
    coarsest = 1e6 * max(widened * max(extents) / grid.cells[0], grid.spacing[1])
    shortest = 1e6 * min(*extents, grid.extent[1])
    low = max(lengths.low, 2.0 * coarsest)
    high = min(lengths.high, 0.49 * shortest)
    if low >= high:
        reason = (
            f"the grid resolves no correlation length from {lengths.low:g} to {lengths.high:g} um"
        )
        raise BadInput(f"{case.source}: {reason}; use more cells or a larger domain")
    step = 10.0 ** (math.floor(math.log10(low)) - 2)  # three digits, rounded up to stay resolved
    return replace(
        lengths, low=float(f"{math.ceil(low / step) * step:.6g}"), high=float(f"{_down(high):.6g}")
    )


def _down(value: float) -> float:
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return math.floor(value / step) * step


def entry_of(key: str) -> tuple[str, int | None]:
    """Split a key into the case's key and the index in its pair: "grid.x[0]" is ("grid.x", 0)."""
    entry = _ENTRY.fullmatch(key)
    return (entry["key"], int(entry["index"])) if entry else (key, None)


def stated_value(case: Case, key: str) -> Any:
    """Return the value that the case states for a dotted key, or None."""
    name, index = entry_of(key)
    value: object = tomllib.loads(case.text)
    for part in name.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    if index is None or value is None:
        return value
    return value[index] if isinstance(value, list) and index < len(value) else None


def overrides_at(
    case: Case, ranges: Sequence[ParameterRange], shares: Iterable[float]
) -> dict[str, object]:
    """Return the case's overrides at a share of each range.

    If the domain changes along x or y, the number of cells changes with it, so that their size
    stays that of the case's cells on the widest domain in the ranges.
    """
    overrides: dict[str, Any] = {}
    for entry, share in zip(ranges, map(float, shares), strict=True):
        key, index = entry_of(entry.key)
        if index is None:
            overrides[key] = entry.written(share)
        else:
            components = overrides.get(key, stated_value(case, key))
            overrides[key] = [
                entry.written(share) if i == index else value for i, value in enumerate(components)
            ]
    cells = list(case.grid.cells)
    for axis, key in enumerate(("grid.x", "grid.y")):
        if key in overrides and cells[axis] > 1:
            extent = overrides[key][1] - overrides[key][0]
            cells[axis] = max(
                2 * round(cells[axis] * extent / _widest(case, ranges, key) / 2), FEWEST_CELLS
            )
    if tuple(cells) != case.grid.cells:
        overrides["grid.cells"] = cells
    return overrides


def _widest(case: Case, ranges: Sequence[ParameterRange], key: str) -> float:
    low, high = (float(value) for value in stated_value(case, key))
    for entry in ranges:
        name, index = entry_of(entry.key)
        if name == key and index is not None:
            low, high = (entry.low, high) if index == 0 else (low, entry.high)
    return high - low


def require_ranges(
    case: Case, ranges: Sequence[ParameterRange], reserved: Mapping[str, str]
) -> None:
    """Raise BadInput for no range, duplicates, a `reserved` key or an invalid range."""
    if not ranges:
        raise BadInput(
            f"{case.source}: nothing is varied; "
            "name a range such as 'material.hardness=0.65 GPa..3 GPa'"
        )
    keys = [entry.key for entry in ranges]
    for key in keys:
        if key in reserved:
            raise BadInput(f"{key} cannot be varied: {reserved[key]}")
        if keys.count(key) > 1:
            raise BadInput(f"{key} is varied twice; name it once")
        if entry_of(key)[1] is not None and stated_value(case, key) is None:
            raise BadInput(
                f"{case.source}: {key} is not an entry of the case; name one such as grid.x[0]"
            )
    for number in range(len(ranges)):
        for end in (0.0, 1.0):
            shares = [end if other == number else 0.5 for other in range(len(ranges))]
            case.with_written(overrides_at(case, ranges, shares))


STANDING = {"contact.roughness": "standing"}


def at_cells(case: Case, cells: int | None) -> Case:
    """Return the case on `cells` x `cells` cells (None: unchanged); single cells stay single.

    Roughness stands still, as in the paper: hundreds of contacts with running roughness take hours.
    """
    case = case.with_written(STANDING)
    if cells is None:
        return case
    if cells < FEWEST_CELLS:
        raise BadInput(f"cells must be {FEWEST_CELLS} or more, got {cells}; 128 is the default")
    return case.with_written(
        {"grid.cells": [cells if count > 1 else 1 for count in case.grid.cells]}
    )
