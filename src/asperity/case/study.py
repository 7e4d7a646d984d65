"""[study] of a case file: its own keys, and the quantities to vary, each over a list or a range."""

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field, PlainValidator

from asperity.case.messages import Section, quoted, validated, with_axes
from asperity.case.units import Count, Seed
from asperity.core.errors import BadInput


def _parse_seeds(value: object) -> int | tuple[int, ...]:
    """Parse the number of seeds, or a list of seeds."""
    if isinstance(value, list | tuple) and value:
        if all(
            isinstance(seed, int) and not isinstance(seed, bool) and seed >= 0 for seed in value
        ):
            return tuple(map(int, value))
    elif isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return int(value)
    raise BadInput(f"must be 1 or more, or a list of seeds such as [1, 2, 3], got {quoted(value)}")


def _is_whole(value: object, least: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


StudyKind = Literal["solve", "vibrate", "shake"]
Seeding = Literal["independent", "common"]


class RangeSection(Section):
    """Range in [study]: `step` or `count` of values; neither for sampled studies."""

    start: object = Field(alias="from")
    to: object
    step: object = None
    count: Count | None = None
    scale: Literal["linear", "log"] = "linear"


class StudySection(Section):
    """[study]: quantities that a sweep varies; every other key names a quantity of the case."""

    kind: StudyKind = "solve"
    axes: dict[str, tuple[object, ...] | RangeSection]  # as written: key -> values
    samples: Count | None = None  # points of a Latin hypercube in place of the full product
    sample_seed: Seed = 0
    seeds: Annotated[int | tuple[int, ...], PlainValidator(_parse_seeds)] = (
        1  # surfaces per point, or their seeds
    )
    seeding: Seeding = "independent"


def parse_study(value: object) -> StudySection | None:
    """Parse [study], which has its own keys and keys of quantities."""
    return with_axes(StudySection, value, {"from", "to", "step", "count"}, _values)


def _values(value: object) -> object:
    if isinstance(value, Mapping):
        return validated(RangeSection, value)
    if isinstance(value, list) and value:
        return tuple(value)
    raise BadInput(
        "must be a list of values or a range such as "
        '{ from = "0.5 um", to = "4 um", step = "0.1 um" }, '
        f"got {quoted(value)}"
    )
