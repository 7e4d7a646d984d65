"""Numbers in text files: separator, decimal comma and markers of missing values.

`asperity.recording` and `asperity.surface` interpret the columns.
"""

import csv
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

MISSING = {
    "",
    "nan",
    "na",
    "n/a",
    "null",
    "none",
    "bad",
    "***",
    "-",
    "--",
    "---",
    "inf",
    "-inf",
    "#n/a",
    "overload",
}
_DATE = re.compile(r"\b\d{1,4}([./-])\d{1,2}\1\d{2,4}\b|\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?")
_THOUSANDS = {  # key: decimal comma
    False: re.compile(r"[-+]?\d{1,3}(,\d{3})+(\.\d*)?([eE][-+]?\d+)?"),
    True: re.compile(r"[-+]?\d{1,3}(\.\d{3})+(,\d*)?([eE][-+]?\d+)?"),
}
_COMMAS_BETWEEN_BLANKS = re.compile(
    r"\s*-?\d+(,\d+)?([eE][+-]?\d+)?(\s+-?\d+(,\d+)?([eE][+-]?\d+)?)*\s*"
)


@dataclass(frozen=True, slots=True)
class Dialect:
    """Format of rows of numbers in a text; a `separator` of None means blanks."""

    separator: str | None
    comma: bool

    def fields(self, line: str) -> list[str]:
        """Split a line at the separators."""
        if self.separator is None:
            return line.split()
        parts = line.split(self.separator)
        if '"' in line:
            with suppress(csv.Error, StopIteration):
                parts = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True))
        if len(parts) > 1 and line.rstrip(" \r\n").endswith(self.separator):
            parts.pop()
        return parts

    def number(self, field: str) -> float | None:
        """Return the number in a field; nan for a missing value, None for other text."""
        text = field.strip().strip('"').strip()
        if text.lower() in MISSING:
            return np.nan
        if _THOUSANDS[self.comma].fullmatch(text):
            text = text.replace("." if self.comma else ",", "")
        try:
            return (
                float(text.replace(",", ".") if self.comma else text) if "_" not in text else None
            )
        except ValueError:
            return None


def sniff_dialect(sample: Sequence[str], fewest_columns: int = 1) -> Dialect:
    """Detect the dialect of lines that mostly hold rows of at least `fewest_columns` numbers.

    Examples
    --------
    >>> from asperity.core.text_dialect import sniff_dialect
    >>> sniff_dialect(["1,5;2,0", "1,6;2,1"])
    Dialect(separator=';', comma=True)
    """
    sample = [_DATE.sub("", line) for line in sample]
    rows = [line for line in sample if re.fullmatch(r"[\s\d.,;+\-eE\"]+", line)] or sample
    numbers = "\n".join(rows)
    for separator in (";", "\t"):
        if sum(separator in line for line in rows) > len(rows) / 2:
            if re.search(r"\d\.\d{3},\d", numbers):  # 1.234,5
                return Dialect(separator, comma=True)
            return Dialect(separator, "," in numbers and not re.search(r"\d\.\d", numbers))
    if '"' in numbers:
        comma = bool(re.search(r'"[^",\n]*,[^",\n]*"(?:[,\s]|$)', numbers)) and "." not in numbers
        return Dialect("," if re.search(r'"\s*,|,\s*"', numbers) else None, comma)
    if not any("," in line for line in sample):
        return Dialect(None, False)
    # "0,5 1,25", or "0,5" alone if one column is enough; two columns of integers are ambiguous
    enough = all(len(row.split()) >= fewest_columns for row in rows)
    if enough and "." not in numbers and all(_COMMAS_BETWEEN_BLANKS.fullmatch(row) for row in rows):
        return Dialect(None, True)
    return Dialect("," if sum("," in line for line in rows) > len(rows) / 2 else None, False)
