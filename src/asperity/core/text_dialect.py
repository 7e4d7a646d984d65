"""Numbers in text: what separates them, whether decimals follow a comma, what stands for one that is missing.

What the columns mean is left to `asperity.recording` and `asperity.surface`.
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
_THOUSANDS = {  # by whether decimals follow a comma
    False: re.compile(r"[-+]?\d{1,3}(,\d{3})+(\.\d*)?([eE][-+]?\d+)?"),
    True: re.compile(r"[-+]?\d{1,3}(\.\d{3})+(,\d*)?([eE][-+]?\d+)?"),
}
_COMMAS_BETWEEN_BLANKS = re.compile(
    r"\s*-?\d+(,\d+)?([eE][+-]?\d+)?(\s+-?\d+(,\d+)?([eE][+-]?\d+)?)*\s*"
)


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a text writes rows of numbers; a `separator` of None stands for blanks."""

    separator: str | None
    comma: bool

    def fields(self, line: str) -> list[str]:
        """What stands between the separators of a line."""
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
        """The number in a field, nan where one is marked as missing; None where there is something else."""
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
    """The dialect of lines that are mostly rows of at least so many numbers."""
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
    # 0,5 1,25, or 0,5 alone where one column will do: two columns of whole numbers would look the
    # same
    enough = all(len(row.split()) >= fewest_columns for row in rows)
    if enough and "." not in numbers and all(_COMMAS_BETWEEN_BLANKS.fullmatch(row) for row in rows):
        return Dialect(None, True)
    return Dialect("," if sum("," in line for line in rows) > len(rows) / 2 else None, False)
