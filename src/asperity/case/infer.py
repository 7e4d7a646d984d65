"""[infer] of a case file: what is not known of the contact and how far, and where it may be run."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, Strict, model_validator

from asperity.case.amounts import Count, Seed
from asperity.case.refusals import LocatedError, Section, quoted, validated
from asperity.errors import BadInput

LEAST_POINTS, MOST_POINTS = 16, 4096
_ENDS = {"from", "to", "value", "std"}


class PriorSection(Section):
    """What is known of a quantity before any recording: `from` and `to`, or a `value` and its `std`."""

    start: Any = Field(None, alias="from")
    to: Any = None
    value: Any = None
    std: Any = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        stated = [name for name in ("start", "to", "value", "std") if getattr(self, name) is not None]
        if stated not in (["start", "to"], ["value", "std"]):
            raise BadInput('must have from and to, or value and std, such as { value = "0.8 um", std = "0.1 um" }')
        return self


class InferSection(Section):
    """[infer]: the emulator's size, and a prior for each quantity that is not known. Other keys name quantities."""

    axes: dict[str, PriorSection | Literal["known"]] = Field(default_factory=dict)  # as written: key -> prior
    points: Annotated[int, Strict(), Field(ge=LEAST_POINTS, le=MOST_POINTS)] = 256  # contacts, of a Sobol sequence
    surfaces: Count = 4  # surfaces a point
    cells: tuple[Count, Count] = (64, 64)
    seed: Seed = 0  # of the sequence and of all that is drawn


def parse_infer(value: object) -> InferSection | None:
    """The priors; quantities stand beside the section's own keys, as tables (contact.load) or by their bare names."""
    if value is None or value == "none":
        return None
    if not isinstance(value, Mapping):
        raise BadInput(f"must be a table, got {quoted(value)}")
    known = set(InferSection.model_fields) - {"axes"}
    own = {key: tuple(v) if isinstance(v, list) else v for key, v in value.items() if key in known}
    return validated(InferSection, {**own, "axes": dict(_axes({k: v for k, v in value.items() if k not in known}))})


def _axes(table: Mapping[str, object], parents: tuple[str, ...] = ()) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        keys = (*parents, key)
        if isinstance(value, Mapping) and not _ENDS & set(value):
            yield from _axes(value, keys)
        elif isinstance(value, Mapping):
            try:
                yield ".".join(keys), validated(PriorSection, value)
            except LocatedError as mistake:
                raise LocatedError(keys + mistake.keys, mistake.message) from None
        elif value == "known":
            yield ".".join(keys), value
        else:
            raise LocatedError(
                keys,
                'must be "known", or what is known of it such as { from = "0.5 um", to = "4 um" } or '
                f'{{ value = "0.8 um", std = "0.1 um" }}, got {quoted(value)}',
            )
