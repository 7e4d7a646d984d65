"""Case as TOML text: read, write with all defaults, and replace values."""

import copyreg
import os
import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, TypeAlias

import tomli_w

from asperity.case.infer import InferSection
from asperity.case.lubricant import SheetSection
from asperity.case.materials import NAMED, NAMED_THERMAL
from asperity.case.messages import Section, parse_section, quoted
from asperity.case.sections import CaseFile
from asperity.case.study import StudySection
from asperity.case.units import Amount
from asperity.case.vibration import preset_keys
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.files import require_file
from asperity.core.third_party import first_line

MAX_BYTES = 4_000_000  # of a case file

Tables: TypeAlias = dict[str, Any]  # of a TOML document


def read_text(path: Path) -> str:
    """Read a case file's text; `UnreadableFile` if it is missing or not text."""
    require_file(path)
    if path.stat().st_size > MAX_BYTES:
        raise UnreadableFile(
            f"{path} has {path.stat().st_size} bytes, too many for a case file; check its name"
        )
    try:
        return path.read_text("utf-8")
    except UnicodeDecodeError:
        raise UnreadableFile(f"{path} is not a text file; a case is TOML") from None
    except OSError as error:
        raise UnreadableFile(f"{path} cannot be read: {error.strerror}") from None


def parse_toml(text: str, source: str) -> Tables:
    """Parse TOML text into tables; `UnreadableFile` if it is not valid."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also numbers and nesting beyond Python's limits
        raise UnreadableFile(f"{source} is not valid TOML: {first_line(error)}") from None


def restated(contents: CaseFile) -> str:
    """Return a case as TOML with all defaults, quantities as they were written."""
    tables = _plain(contents)
    if contents.lubricant is None:
        tables["lubricant"] = "none"
    if contents.material.name is not None and contents.material.hardness is None:
        tables["material"]["hardness"] = "none"  # its name would determine it
    if isinstance(contents.lubricant, SheetSection):  # determines these values
        for key in contents.thermal.defaulted:
            del tables["thermal"][key]
    return tomli_w.dumps(tables)


def _reread(text: str) -> CaseFile:
    return parse_section(CaseFile, tomllib.loads(text), "a case")


def _as_text(contents: CaseFile) -> tuple[Callable[[str], CaseFile], tuple[str]]:
    return _reread, (restated(contents),)


# the sections of laws are created at run time, which pickle cannot import
copyreg.pickle(CaseFile, _as_text)


def replaced(tables: Tables, overrides: Mapping[str, object], source: str) -> Tables:
    """Return the tables with values replaced by dotted keys; text is parsed as TOML if possible.

    `vibration.preset` and `material.name` replace all keys that they determine. Raises BadInput
    for an invalid key.
    """
    if "material.name" in overrides:
        for section, keys in (("material", NAMED), ("thermal", NAMED_THERMAL)):
            if isinstance(table := tables.get(section), dict):
                for key in keys:
                    table.pop(key, None)
    if "vibration.preset" in overrides:  # values of the old preset would override the new one
        for choice in preset_keys():
            tables.get("vibration", {}).pop(choice, None)
    for path, value in overrides.items():
        *parents, key = path.split(".")
        if not all((*parents, key)):
            raise BadInput(f"{source}: {path} is not a key; use one such as contact.load")
        table = tables
        for parent in parents:
            if not isinstance(table.get(parent), dict):
                table[parent] = {}
            table = table[parent]
        # a copy, because a later key may modify it
        table[key] = _toml_value(value) if isinstance(value, str) else deepcopy(value)
    return tables


def relative_path(file: str | Path, folder: Path) -> str:
    """Return `file` relative to `folder`, so that a case can be moved with its surface."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # on another drive
        return Path(file).resolve().as_posix()


def _toml_value(text: str) -> object:
    try:
        read = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text  # the shell removed the quotes
    except (ValueError, RecursionError) as error:
        raise BadInput(
            f"a value cannot be read ({first_line(error)}), got {quoted(text)}"
        ) from None
    # further keys on later lines are not part of the value
    return read["value"] if len(read) == 1 else text


def _plain(section: Section) -> Tables:
    """Return tables of plain values, quantities as written; omitted values stay omitted."""
    values = {
        entry.alias or name: getattr(section, name)
        for name, entry in type(section).model_fields.items()
    }
    if isinstance(section, StudySection | InferSection):
        values |= values.pop("axes")
    return {key: _plain_value(value) for key, value in values.items() if value is not None}


def _plain_value(value: object) -> object:
    if isinstance(value, Section):
        return _plain(value)
    if isinstance(value, tuple):
        return [_plain_value(entry) for entry in value]
    return value.text if isinstance(value, Amount) else value
