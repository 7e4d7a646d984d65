"""Errors in a table of a case file, as one sentence with key, value and remedy."""

from collections.abc import Callable, Iterator, Mapping, Set
from difflib import get_close_matches
from typing import TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError

from asperity.core.errors import BadInput, shortened

SIGNS = {
    "°C": "write degC for °C",
    "ºC": "write degC for °C",
    "°": "write deg",
    "%": "write a fraction, 0.05 for 5 %",
}

S = TypeVar("S", bound="Section")


class Section(BaseModel):
    """Table of a case file; unknown keys are refused."""

    model_config = ConfigDict(
        defer_build=True, extra="forbid", frozen=True, allow_inf_nan=False, serialize_by_alias=True
    )


class LocatedError(BadInput):
    """Error in a table, with the keys that lead to it."""

    def __init__(self, keys: tuple[str | int, ...], message: str) -> None:
        super().__init__(message)
        self.keys = keys
        self.message = message


def quoted(value: object) -> str:
    """Return a value as messages show it: text in quotation marks, long values truncated."""
    return shortened(f'"{value}"' if isinstance(value, str) else str(value))


def remedy_for(value: object, but: str = "") -> str:
    """Return a remedy for an unknown sign in a value, as the end of a sentence; else "".

    `but` is a sign that is not the cause of the error.
    """
    text = value if isinstance(value, str) else ""
    return next(
        (f"; {remedy}" for sign, remedy in SIGNS.items() if sign in text and sign != but), ""
    )


def none_from_word(value: object) -> object:
    """Return None for "none", so that `--set material.hardness=none` omits an optional value."""
    return None if value == "none" else value


def parse_section(model: type[S], table: object, source: str) -> S:
    """Parse a table with units, of a case or of another file, as a section.

    Raises BadInput for what the section refuses; the sentence begins with `source` and names the
    key.
    """
    try:
        return validated(model, table)
    except LocatedError as error:
        raise BadInput(f"{source}: {_dotted(error.keys)} {error.message}") from None


def validated(model: type[S], table: object) -> S:
    """Validate a table as a section; raises `LocatedError`."""
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _first_error(model, error) from None


def with_axes(
    model: type[S], value: object, own: Set[str], read: Callable[[object], object]
) -> S | None:
    """Parse a section whose further keys name quantities; None for "none".

    Quantities are nested tables (contact.load) or bare names. `own` are keys of which a table of
    values has at least one; any other table leads on to quantities.
    """
    if value is None or value == "none":
        return None
    if not isinstance(value, Mapping):
        raise BadInput(f"must be a table, got {quoted(value)}")
    fields = set(model.model_fields) - {"axes"}
    settings = {
        key: tuple(v) if isinstance(v, list) else v for key, v in value.items() if key in fields
    }
    axes = dict(_axes({key: v for key, v in value.items() if key not in fields}, own, read))
    return validated(model, {**settings, "axes": axes})


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
        except LocatedError as error:
            raise LocatedError(keys + error.keys, error.message) from None
        except BadInput as error:
            raise LocatedError(keys, str(error)) from None


def choose(key: str, sections: Callable[[], Mapping[str, type[S]]], value: object) -> S:
    """Return the section that value[key] names; a bare name stands for a table with that key."""
    table = {key: value} if isinstance(value, str) else value
    if not isinstance(table, Mapping):
        raise BadInput(f"must be a table with the key {key}, got {quoted(value)}")
    choices = sections()
    if key not in table:
        raise LocatedError((key,), f"is missing; choose one of {', '.join(choices)}")
    name = table[key]
    if not isinstance(name, str) or name not in choices:
        matches = get_close_matches(str(name), choices, n=1)
        remedy = f'; did you mean "{matches[0]}"?' if matches else ""
        raise LocatedError(
            (key,), f"must be one of {', '.join(choices)}, got {quoted(name)}{remedy}"
        )
    return validated(choices[name], table)


def _first_error(model: type[Section], error: ValidationError) -> LocatedError:
    """Return the error to fix first: a mistyped key explains a missing one."""
    errors = error.errors(include_url=False)
    entry = next((m for m in errors if m["type"] == "extra_forbidden"), errors[0])
    keys = entry["loc"]
    kind = entry["type"]
    value = entry["input"]
    cause = entry.get("ctx", {}).get("error")
    if isinstance(cause, LocatedError):
        return LocatedError(keys + cause.keys, cause.message)
    if isinstance(cause, BadInput):
        return LocatedError(keys, str(cause))
    if kind == "extra_forbidden":
        valid = _keys_of(model, keys[:-1])
        matches = get_close_matches(str(keys[-1]), valid, n=1)
        inside = [] if len(keys) > 1 else _sections_with(model, str(keys[-1]))
        matches = inside[:1] or matches
        remedy = f"did you mean {matches[0]}?" if matches else f"known here: {', '.join(valid)}"
        return LocatedError(keys, f"is not a known key; {remedy}")
    if kind == "missing":
        return LocatedError(keys, "is missing; add it")
    if kind == "too_long":
        expected = f"have {entry['ctx']['max_length']} values at most"
    else:
        expected = _expected(entry["msg"])
    return LocatedError(keys, f"must {expected}, got {quoted(value)}{remedy_for(value)}")


def _expected(message: str) -> str:
    """Return what a value must be, from pydantic's message, in the words of a case file."""
    expected = message.removeprefix("Input ").removeprefix("should ")
    if expected.startswith("be a valid dictionary"):
        return "be a table"
    return expected.replace("'", '"').replace("a valid tuple", "a list")


def _keys_of(model: type[Section], keys: tuple[str | int, ...]) -> list[str]:
    for key in keys:
        if isinstance(key, str):
            model = next(_sections_in(model.model_fields[key].annotation))
    return [entry.alias or name for name, entry in model.model_fields.items()]


def _sections_with(model: type[Section], key: str) -> list[str]:
    """Return the dotted keys of the sections of a case that have a key, such as contact.load."""
    return [
        f"{name}.{key}"
        for name, entry in model.model_fields.items()
        for section in list(_sections_in(entry.annotation))[:1]
        if key in section.model_fields
    ]


def _sections_in(annotation: object) -> Iterator[type[Section]]:
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for part in get_args(annotation):
        yield from _sections_in(part)


def _dotted(keys: tuple[str | int, ...]) -> str:
    return "".join(
        f"[{key}]" if isinstance(key, int) else f".{shortened(key)}" for key in keys
    ).removeprefix(".")
