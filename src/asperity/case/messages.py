"""What is wrong with a table of a case file, said in one sentence that names the key, the value and the remedy."""

from collections.abc import Callable, Iterator, Mapping, Set
from difflib import get_close_matches
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from asperity.core.errors import BadInput

SIGNS = {
    "°C": "write degC for °C",
    "ºC": "write degC for °C",
    "°": "write deg",
    "%": "write a share, 0.05 for 5 %",
}
LONGEST = 80  # characters of a value in a message

S = TypeVar("S", bound="Section")


class Section(BaseModel):
    """A table of the case file; keys that are not fields are refused."""

    model_config = ConfigDict(
        defer_build=True, extra="forbid", frozen=True, allow_inf_nan=False, serialize_by_alias=True
    )


class LocatedError(BadInput):
    """What is wrong, and the keys that lead to it."""

    def __init__(self, keys: tuple[str | int, ...], message: str) -> None:
        super().__init__(message)
        self.keys = keys
        self.message = message


def quoted(value: object) -> str:
    """A value as a message shows it: text in quotation marks, and of what is long its beginning."""
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}... ({len(text)} characters)"


def remedy_for(value: object, but: str = "") -> str:
    """What to write instead of a sign that is none of ours, as the end of a sentence; nothing for most values.

    `but` is a sign that is none of the mistake's.
    """
    text = value if isinstance(value, str) else ""
    return next(
        (f"; {remedy}" for sign, remedy in SIGNS.items() if sign in text and sign != but), ""
    )


def none_from_word(value: object) -> object:
    """Let the word none leave an optional thing out: `--set material.hardness=none`."""
    return None if value == "none" else value


def parse_section(model: type[S], table: object, source: str) -> S:
    """A table with units, of a case or of another file, as the section that it is meant to be.

    Raises BadInput for what the section refuses; the sentence begins with `source` and names the
    key.
    """
    try:
        return validated(model, table)
    except LocatedError as mistake:
        raise BadInput(f"{source}: {_dotted(mistake.keys)} {mistake.message}") from None


def validated(model: type[S], table: object) -> S:
    """A table as a section; `LocatedError` for what it refuses."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _first_mistake(model, error) from None


def with_axes(
    model: type[S], value: object, own: Set[str], read: Callable[[object], object]
) -> S | None:
    """A section whose further keys name quantities, as tables (contact.load) or by their bare names; None for none.

    `own` are keys of which a table that is read has at least one; any other leads on to quantities.
    """
    if value is None or value == "none":
        return None
    if not isinstance(value, Mapping):
        raise BadInput(f"must be a table, got {quoted(value)}")
    known = set(model.model_fields) - {"axes"}
    stated = {
        key: tuple(v) if isinstance(v, list) else v for key, v in value.items() if key in known
    }
    axes = dict(_axes({key: v for key, v in value.items() if key not in known}, own, read))
    return validated(model, {**stated, "axes": axes})


def _axes(
    table: Mapping[str, object],
    own: Set[str],
    read: Callable[[object], object],
    parents: tuple[str, ...] = (),
) -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        keys = (*parents, key)
        if isinstance(value, Mapping) and not own & set(value):
            yield from _axes(value, own, read, keys)
            continue
        try:
            yield ".".join(keys), read(value)
        except LocatedError as mistake:
            raise LocatedError(keys + mistake.keys, mistake.message) from None
        except BadInput as mistake:
            raise LocatedError(keys, str(mistake)) from None


def choose(key: str, sections: Callable[[], Mapping[str, type[S]]], value: object) -> S:
    """The section that value[key] names; a bare name stands for a table that holds nothing else."""
    table = {key: value} if isinstance(value, str) else value
    if not isinstance(table, Mapping):
        raise BadInput(f"must be a table with the key {key}, got {quoted(value)}")
    known = sections()
    if key not in table:
        raise LocatedError((key,), f"is missing; it is one of {', '.join(known)}")
    name = table[key]
    if not isinstance(name, str) or name not in known:
        near = get_close_matches(str(name), known, n=1)
        remedy = f'; did you mean "{near[0]}"?' if near else ""
        raise LocatedError((key,), f"must be one of {', '.join(known)}, got {quoted(name)}{remedy}")
    return validated(known[name], table)


def _first_mistake(model: type[Section], error: ValidationError) -> LocatedError:
    """The mistake to mend first, in a sentence: a mistyped key explains a missing one."""
    mistakes = error.errors(include_url=False)
    mistake = next((m for m in mistakes if m["type"] == "extra_forbidden"), mistakes[0])
    keys, kind, given = mistake["loc"], mistake["type"], mistake["input"]
    cause = mistake.get("ctx", {}).get("error")
    if isinstance(cause, LocatedError):
        return LocatedError(keys + cause.keys, cause.message)
    if isinstance(cause, BadInput):
        return LocatedError(keys, str(cause))
    if kind == "extra_forbidden":
        known = _keys_of(model, keys[:-1])
        near = get_close_matches(str(keys[-1]), known, n=1)
        remedy = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
        return LocatedError(keys, f"is not a known key; {remedy}")
    if kind == "missing":
        return LocatedError(keys, "is missing; add it")
    expected = mistake["msg"].removeprefix("Input ").removeprefix("should ")
    if expected.startswith("be a valid dictionary"):
        expected = "be a table"
    expected = expected.replace("'", '"').replace("a valid tuple", "a list")
    return LocatedError(keys, f"must {expected}, got {quoted(given)}{remedy_for(given)}")


def _keys_of(model: type[Section], keys: tuple[str | int, ...]) -> list[str]:
    for key in keys:
        if isinstance(key, str):
            model = next(_sections_in(model.model_fields[key].annotation))
    return [entry.alias or name for name, entry in model.model_fields.items()]


def _sections_in(annotation: Any) -> Iterator[type[Section]]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for part in get_args(annotation):
        yield from _sections_in(part)


def _dotted(keys: tuple[str | int, ...]) -> str:
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).removeprefix(
        "."
    )
