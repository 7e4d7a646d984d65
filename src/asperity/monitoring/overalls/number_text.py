"""Numbers as text: decimal points or commas, thousands separators, and entries without a number."""

from collections.abc import Mapping
from decimal import Decimal
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pandas

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput

Column: TypeAlias = "pandas.Series[Any]"
MOSTLY = 0.5  # share of the entries that are numbers in a column of numbers
LEAST_BESIDE_THOUSANDS = 100.0  # an integer without a mark from which 1,200 beside it is 1200
_EXPONENT = r"(?:[eE][-+]?\d+)?"
_GRAMMARS = {  # by decimal mark; thousands are separated by the other one
    ".": rf"[-+]?(?:[1-9]\d{{0,2}}(?:,\d{{3}})+(?:\.\d*)?|\d*(?:\.\d*)?{_EXPONENT})",
    ",": rf"[-+]?(?:[1-9]\d{{0,2}}(?:\.\d{{3}})+(?:,\d*)?|\d*(?:,\d*)?{_EXPONENT})",
}
_OTHER_MARK = {".": ",", ",": "."}
_DIGIT = r"\d"
_SPACED = r"[-+]?\d{1,3}(?:['’\u00a0\u202f ]\d{3})+(?:[.,]\d*)?"  # 1 200,5 or 1'200.5
_MISSING = ("", "nan", "null", "none", "n/a", "#n/a", "na", "-", "--")
_INFINITE = {"inf": np.inf, "+inf": np.inf, "infinity": np.inf, "-inf": -np.inf}
_INFINITE["-infinity"] = -np.inf


class ColumnNumbers(NamedTuple):
    """Numbers of a column, nan for other entries, and how many entries are of another kind."""

    values: Field
    texts: int = 0
    example: str = ""
    booleans: int = 0
    nested: int = 0


def text_entries(column: Column) -> Column:
    """Return the entries of a column that are text."""
    if pandas.api.types.is_string_dtype(column) and column.dtype != object:
        return column.dropna()
    if column.dtype == object:
        return column[[isinstance(entry, str) for entry in column]].astype("str")
    return column[:0].astype("str")


def decimal_marks(columns: Mapping[str, Column], file: str) -> dict[str, str]:
    """Return the decimal mark of each column, by its entries or else by the other columns.

    Raises
    ------
    BadInput
        for a column of which 1,200 may be 1.2 or 1200, or that has both decimal marks.
    """
    texts = {name: _tidy(text_entries(column)) for name, column in columns.items()}
    votes = {name: _votes(text) for name, text in texts.items()}
    decided = {name: next(iter(marks)) for name, marks in votes.items() if len(marks) == 1}
    of_file = {*decided.values()}
    for name, text in texts.items():
        if len(votes[name]) > 1 and _are_mostly_numbers(text):
            raise BadInput(
                f"column {name} of {file} has decimal points and decimal commas; write its "
                "numbers with one of them"
            )
        if name not in decided:
            decided[name] = (
                next(iter(of_file)) if len(of_file) == 1 else _usual_mark(name, text, file)
            )
    return decided


def column_numbers(column: Column, mark: str) -> ColumnNumbers:
    """Return the numbers of a column whose decimal mark is known."""
    if pandas.api.types.is_bool_dtype(column):
        return ColumnNumbers(np.full(len(column), np.nan), booleans=len(column))
    if pandas.api.types.is_numeric_dtype(column):
        return ColumnNumbers(column.to_numpy(dtype=float, na_value=np.nan))
    if column.dtype == object:
        return _object_numbers(column, mark)
    if not pandas.api.types.is_string_dtype(column):
        count = int(column.notna().sum())
        return ColumnNumbers(np.full(len(column), np.nan), texts=count, example="a date")
    return _text_numbers(column, mark)


def _object_numbers(column: Column, mark: str) -> ColumnNumbers:
    """Return the numbers of a column of JSON values."""
    entries = [*column]
    textual = np.array([isinstance(entry, str) for entry in entries], dtype=bool)
    values = np.array([_as_float(entry) for entry in entries], dtype=float)
    numbers = _text_numbers(column[textual].astype("str"), mark)
    values[textual] = numbers.values
    return numbers._replace(
        values=values,
        booleans=numbers.booleans + sum(isinstance(entry, bool) for entry in entries),
        nested=sum(isinstance(entry, list | dict | tuple | np.ndarray) for entry in entries),
    )


def _text_numbers(column: Column, mark: str) -> ColumnNumbers:
    """Return the numbers of a column of text."""
    text = _tidy(column.fillna(""))
    values, other = _parsed(text, mark)
    words = text[other]
    logical = np.asarray(words.str.lower().isin(("true", "false")), dtype=bool)
    words = words[~logical]
    example = " ".join(str(words.iloc[0]).split())[:40] if len(words) else ""
    return ColumnNumbers(values, len(words), example, int(logical.sum()))


def _as_float(entry: object) -> float:
    """Return a number of JSON; nan for anything else."""
    if isinstance(entry, bool | np.bool_) or not isinstance(
        entry, int | float | np.number | Decimal
    ):
        return np.nan
    try:
        return float(entry)
    except OverflowError:
        return np.inf


def _parsed(text: Column, mark: str) -> tuple[Field, Mask]:
    """Return the numbers of texts, and a mask of those that are words."""
    values = np.full(len(text), np.nan)
    numeric = _matches(text, mark)
    plain = text[numeric].str.replace(_OTHER_MARK[mark], "", regex=False)
    plain = plain.str.replace(mark, ".", regex=False)
    values[numeric] = pandas.to_numeric(plain, errors="coerce").to_numpy(dtype=float)
    rest = text[~numeric].str.lower()
    values[~numeric] = rest.map(_INFINITE).to_numpy(dtype=float)
    other = ~numeric
    other[~numeric] = ~rest.isin((*_MISSING, *_INFINITE)).to_numpy(dtype=bool)
    return values, other


def _matches(text: Column, mark: str) -> Mask:
    """Return a mask of the texts that are numbers with this decimal mark."""
    numeric = text.str.fullmatch(_GRAMMARS[mark]) & text.str.contains(_DIGIT)
    return np.asarray(numeric, dtype=bool)


def _tidy(text: Column) -> Column:
    """Return texts without outer blanks, and without blanks or apostrophes between thousands."""
    text = text.str.strip()
    spaced = text.str.fullmatch(_SPACED)
    if not np.asarray(spaced, dtype=bool).any():
        return text
    return text.where(~spaced, text.str.replace(r"['’\u00a0\u202f ]", "", regex=True))


def _votes(text: Column) -> set[str]:
    """Return the decimal marks that some entry requires."""
    marked = text[np.asarray(text.str.contains("[.,]"), dtype=bool)]
    point, comma = (_matches(marked, mark) for mark in (".", ","))
    return {
        mark for mark, required in ((".", point & ~comma), (",", comma & ~point)) if required.any()
    }


def _usual_mark(name: str, text: Column, file: str) -> str:
    """Return the decimal mark of a column whose entries with a mark read either way."""
    with_comma = np.asarray(text.str.contains(",", regex=False), dtype=bool)
    ambiguous = with_comma & _matches(text, ".")
    if not ambiguous.any() or not _are_mostly_numbers(text):
        return "."
    integers = pandas.to_numeric(text[~with_comma], errors="coerce").to_numpy(dtype=float)
    largest = np.max(integers, initial=0.0, where=np.isfinite(integers))
    if LEAST_BESIDE_THOUSANDS <= largest < 1000.0 and (integers[integers > 0] % 1.0 == 0.0).all():
        return "."
    example = str(text[ambiguous].iloc[0])
    raise BadInput(
        f"column {name} of {file} has numbers such as {example}, which may be "
        f"{example.replace(',', '.')} or {example.replace(',', '')}; write decimal points and no "
        "thousands separators"
    )


def _are_mostly_numbers(text: Column) -> bool:
    """Return whether most entries are numbers with either decimal mark."""
    filled = text[~np.asarray(text.str.lower().isin(_MISSING), dtype=bool)]
    return bool(len(filled)) and bool(
        np.mean(_matches(filled, ".") | _matches(filled, ",")) > MOSTLY
    )
