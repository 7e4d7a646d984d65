"""[study] of a case file: its own keys, and the quantities that it varies, each over a list or a range."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator

from asperity.case.messages import Section, quoted, validated, with_axes
from asperity.case.units import Count, Seed
from asperity.core.errors import BadInput


def _parse_seeds(value: object) -> int | tuple[int, ...]:
    """How many seeds, or the seeds themselves."""
    if type(value) is int and value >= 1:
        return value
    if (
        isinstance(value, list | tuple)
        and value
        and all(type(seed) is int and seed >= 0 for seed in value)
    ):
        return tuple(value)
    raise BadInput(f"must be 1 or more, or a list of seeds such as [1, 2, 3], got {quoted(value)}")


StudyKind = Literal["solve", "vibrate", "shake"]
Seeding = Literal["independent", "common"]


class RangeSection(Section):
    """A range in [study]: `step` from one value to the next, or `count` of them; over samples, neither."""

    start: Any = Field(alias="from")
    to: Any
    step: Any = None
    count: Count | None = None
    scale: Literal["linear", "log"] = "linear"


class StudySection(Section):
    """[study]: what a sweep varies. Every other key names a quantity of the case."""

    kind: StudyKind = "solve"
    axes: dict[str, tuple[Any, ...] | RangeSection]  # as written: key -> values
    samples: Count | None = None  # a Latin hypercube of so many points in place of the product
    sample_seed: Seed = 0
    seeds: Annotated[int | tuple[int, ...], PlainValidator(_parse_seeds)] = (
        1  # how many surfaces a point, or which
    )
    seeding: Seeding = "independent"


def parse_study(value: object) -> StudySection | None:
    """The plan of a study; quantities stand beside its own keys."""
    return with_axes(StudySection, value, {"from", "to", "step", "count"}, _values)


def _values(value: object) -> object:
    if isinstance(value, Mapping):
        return validated(RangeSection, value)
    if isinstance(value, list) and value:
        return tuple(value)
    raise BadInput(
        'must be a list of values or a range such as { from = "0.5 um", to = "4 um", step = "0.1 um" }, '
        f"got {quoted(value)}"
    )
