"""[infer] of a case file: priors of unknown quantities, and feasible operating points."""

from collections.abc import Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, Strict, model_validator

from asperity.case.messages import Section, quoted, validated, with_axes
from asperity.case.units import Count, Seed
from asperity.core.errors import BadInput

MIN_POINTS, MOST_POINTS = 16, 4096
_ENDS = {"from", "to", "value", "std"}


class PriorSection(Section):
    """Prior of a quantity: `from` and `to`, or a `value` and its `std`."""

    start: object = Field(None, alias="from")
    to: object = None
    value: object = None
    std: object = None

    @model_validator(mode="after")
    def _one_of_two(self) -> Self:
        keys = [name for name in ("start", "to", "value", "std") if getattr(self, name) is not None]
        if keys not in (["start", "to"], ["value", "std"]):
            raise BadInput(
                "must have from and to, or value and std, such as "
                '{ value = "0.8 um", std = "0.1 um" }'
            )
        return self


class InferSection(Section):
    """[infer]: size of the emulator, and a prior per unknown quantity.

    Other keys name quantities.
    """

    axes: dict[str, PriorSection | Literal["known"]] = Field(
        default_factory=dict
    )  # as written: key -> prior
    points: Annotated[int, Strict(), Field(ge=MIN_POINTS, le=MOST_POINTS)] = (
        256  # contacts, of a Sobol sequence
    )
    surfaces: Count = 4  # surfaces a point
    cells: tuple[Count, Count] = (64, 64)
    seed: Seed = 0  # of the sequence and of all random numbers


def parse_infer(value: object) -> InferSection | None:
    """Parse [infer], which has its own keys and keys of quantities."""
    return with_axes(InferSection, value, _ENDS, _prior)


def _prior(value: object) -> object:
    if isinstance(value, Mapping):
        return validated(PriorSection, value)
    if value != "known":
        raise BadInput(
            'must be "known", or a prior such as { from = "0.5 um", to = "4 um" } or '
            f'{{ value = "0.8 um", std = "0.1 um" }}, got {quoted(value)}'
        )
    return value
