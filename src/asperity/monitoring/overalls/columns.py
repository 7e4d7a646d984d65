"""Columns of a table of overall values: values with units, operating conditions, all others."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.monitoring.auxiliary_channels import UNITS
from asperity.monitoring.overalls.formats import unit_of_rows
from asperity.monitoring.overalls.number_text import ColumnNumbers, column_numbers
from asperity.recording import OPERATING_KEYS, acceleration_scale, name_and_unit, velocity_scale

FEWEST_NUMBERS = 8  # of a column, as of a baseline; all rows of a shorter table
FEWEST_CODES = 4  # distinct whole numbers up to which a column called quality holds codes
RESERVED = ("x", "time", "state")  # keys of a row in JSON
TEMPERATURES = {  # factor and offset to degC
    "degC": (1.0, 0.0),
    "°C": (1.0, 0.0),
    "C": (1.0, 0.0),
    "K": (1.0, -273.15),
    "degF": (1.0 / 1.8, -32.0 / 1.8),
    "°F": (1.0 / 1.8, -32.0 / 1.8),
    "F": (1.0 / 1.8, -32.0 / 1.8),
}
_CONDITION_NAMES = {
    "temperature_degc": re.compile(r"\b(?:temp|temperature|temperatur)\b"),
    "entrainment_m_s": re.compile(r"\bentrainment\b"),
    "speed_hz": re.compile(r"\b(?:speed|drehzahl|rpm)\b"),
    "load_n": re.compile(r"\b(?:load|last|force|kraft)\b"),
}
_CONDITION_UNITS = {  # units that leave no doubt about the key
    "temperature_degc": ("degC", "degc", "°C", "degF", "degf", "°F", "K"),
    "speed_hz": ("rpm", "RPM", "1/min", "min-1", "rps"),
    "load_n": ("N", "kN", "MN"),
}
_VIBRATION = re.compile(r"\b(?:acc\w*|vel\w*|vib\w*|rms|peak|pk|envelope|kurtosis|crest)\b")
_CODE = re.compile(r"\b(?:quality|qualität|status|flag|valid|good|alarm)\b")
_WITHOUT_UNIT = re.compile(r"\b(?:kurtosis|crest|skewness|factor)\b")
_LOGARITHMIC = re.compile(r"(?i)\s*(?:[va]db|db.*)\s*")


@dataclass(slots=True)
class ColumnSet:
    """Columns by their use; `notes` state what was left out."""

    values: dict[str, Field] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    conditions: dict[str, Field] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def is_logarithmic(unit: str) -> bool:
    """Return whether values are decibels."""
    return _LOGARITHMIC.fullmatch(unit) is not None


def words_of(text: str) -> str:
    """Return a heading in lower case, with blanks in place of underscores."""
    return text.lower().replace("_", " ")


def heading_parts(heading: str) -> tuple[str, str]:
    """Return name and unit of a heading: velocity [mm/s rms], level (dB), speed_rpm."""
    bracketed = re.fullmatch(r"(.*?\S)\s*\[\s*([^\]]*?)\s*\]", heading)
    if bracketed:
        return bracketed[1], bracketed[2]
    rounded = re.fullmatch(r"(.*?\S)\s*\(\s*([^)]*?)\s*\)", heading)
    if rounded and (is_logarithmic(rounded[2]) or _is_condition_unit(rounded[2])):
        return rounded[1], rounded[2]
    name, unit = name_and_unit(heading)
    return name, unit or ""


def sort_columns(
    table: pandas.DataFrame, marks: Mapping[str, str], stated_unit: str, file: str
) -> ColumnSet:
    """Return the columns of a table without its times, each as value, condition or note.

    Raises
    ------
    BadInput
        for a condition whose unit is unknown, or rows in different units.
    """
    columns = ColumnSet()
    row_unit, factors, unit_name = unit_of_rows(table, file)
    headings: list[str] = []
    for heading in table.columns:
        if heading == unit_name:
            continue
        numbers = column_numbers(table[heading], marks[heading])
        reason = _reason_to_omit(heading, numbers)
        if reason:
            columns.notes.append(f"Column {heading} {reason} and is left out.")
            continue
        if numbers.texts:
            columns.notes.append(
                f"Column {heading} has {numbers.texts} entries without a number, such as "
                f"{numbers.example}; they count as missing."
            )
        if not _add_condition(columns, heading, numbers.values, file):
            headings.append(heading)
            columns.values[heading] = numbers.values
    _omit_constants(columns)
    names = _value_names([heading for heading in headings if heading in columns.values])
    columns.values = {names[heading]: values for heading, values in columns.values.items()}
    for heading, name in names.items():
        unit = heading_parts(heading)[1]
        if not unit and not _WITHOUT_UNIT.search(words_of(heading)):
            unit = row_unit or stated_unit
            if factors is not None:
                columns.values[name] = columns.values[name] * factors
        columns.units[name] = unit
    return columns


def _reason_to_omit(heading: str, numbers: ColumnNumbers) -> str:
    """Return why a column is no series of values, or ""."""
    values = numbers.values
    filled = values[~np.isnan(values)]
    if numbers.nested:
        return "holds nested values"
    if numbers.booleans and filled.size <= numbers.booleans:
        return "holds true and false"
    if not filled.size:
        return f"holds text, such as {numbers.example}," if numbers.texts else "is empty"
    if filled.size < min(FEWEST_NUMBERS, values.size):
        return f"has only {filled.size} numbers in {values.size} rows"
    if _counts_rows(values):
        return "counts rows"
    whole = np.isfinite(filled).all() and (filled % 1.0 == 0.0).all()
    if whole and np.unique(filled).size <= FEWEST_CODES and _CODE.search(words_of(heading)):
        return "holds codes"
    return ""


def _counts_rows(values: Field) -> bool:
    """Return whether values are successive whole numbers, as of a row number."""
    steps = np.diff(np.where(np.isfinite(values), values, np.nan))
    return values.size >= FEWEST_NUMBERS and bool((steps == 1.0).all() or (steps == -1.0).all())


def _omit_constants(columns: ColumnSet) -> None:
    """Leave out values that are always equal, but not 0 as of a dead sensor, beside others."""
    constant = [
        heading
        for heading, values in columns.values.items()
        if values.size >= FEWEST_NUMBERS and np.nanmin(values) == np.nanmax(values) != 0.0
    ]
    if len(constant) == len(columns.values):
        return
    for heading in constant:
        value = float(np.nanmax(columns.values.pop(heading)))
        columns.notes.append(f"Column {heading} is always {value:g} and is left out.")


def _value_names(headings: list[str]) -> dict[str, str]:
    """Return the name of each value: the heading without unit, with it where names repeat."""
    short = {heading: heading_parts(heading)[0] for heading in headings}
    names = [*short.values()]
    return {
        heading: heading
        if names.count(name) > 1
        else f"{name} (column)"
        if name in RESERVED
        else name
        for heading, name in short.items()
    }


def _add_condition(columns: ColumnSet, heading: str, values: Field, file: str) -> bool:
    """Add a column of load, speed or temperature in the unit of its key; return whether it is."""
    name, unit = heading_parts(heading)
    key = heading if heading in OPERATING_KEYS else _condition_key(name, unit)
    if not key:
        return False
    if heading != key:
        values = _in_unit_of_key(values, heading, unit, key, file)
    if key in columns.conditions and heading != key:
        columns.notes.append(f"Column {heading} is left out: {key} is given by another column.")
        return True
    if key in columns.conditions:
        columns.notes.append(f"Column {key} takes precedence over another one of that quantity.")
    columns.conditions[key] = values
    if heading != key:
        columns.notes.append(f"Column {heading} is the operating condition {key}.")
    known = np.isfinite(values)
    if known.mean() <= 0.5:
        columns.notes.append(f"{key} is given in at most half of the rows and is not used.")
    elif key != "temperature_degc" and (values[known] <= 0.0).any():
        count = int((values[known] <= 0.0).sum())
        columns.notes.append(f"{key} is 0 or below in some rows ({count}) and is not used.")
    return True


def _condition_key(name: str, unit: str) -> str:
    """Return the key of the operating condition that a column states, or ""."""
    by_unit = next((key for key, units in _CONDITION_UNITS.items() if unit in units), "")
    if by_unit:
        return by_unit
    words = words_of(name)
    measured = acceleration_scale(unit) or velocity_scale(unit) or is_logarithmic(unit)
    if _VIBRATION.search(words) or (measured and " " in words):  # high speed shaft [mm/s]
        return ""
    return next((key for key, names in _CONDITION_NAMES.items() if names.search(words)), "")


def _is_condition_unit(unit: str) -> bool:
    known = {label for units in UNITS.values() for label in units} | {*TEMPERATURES}
    return unit in known


def _in_unit_of_key(values: Field, heading: str, unit: str, key: str, file: str) -> Field:
    """Return values in the unit of a key.

    Raises
    ------
    BadInput
        for an unknown unit.
    """
    factors = {label: (factor, 0.0) for label, factor in UNITS[key].items()}
    if key == "temperature_degc":
        factors |= TEMPERATURES
    matches = [label for label in factors if label.lower() == unit.lower()]
    if unit in factors:
        matches = [unit]
    if len(matches) != 1:
        stated = f"is in {unit}" if unit else "states no unit"
        raise BadInput(
            f"column {heading} of {file} {stated}, but {key} needs {', '.join(factors)}; convert "
            f"it and call it {key}, or leave it out"
        )
    factor, offset = factors[matches[0]]
    return values * factor + offset
