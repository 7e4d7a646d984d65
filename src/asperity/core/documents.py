"""Types of JSON and TOML documents, where they enter or leave the package."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    Json: TypeAlias = "bool | int | float | str | Sequence[Json] | Mapping[str, Json] | None"
    """A value that is written as JSON."""
else:
    Json = object  # other modules could not evaluate a recursive alias
JsonObject: TypeAlias = dict[str, Json]
"""A JSON object under construction."""
Table: TypeAlias = Mapping[str, object]
"""A table as it was read: its values are unchecked."""
