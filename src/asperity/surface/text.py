"""Tables of numbers as text: columns or a matrix, with any separator, decimal points or commas, and header lines.

Which column means what is left to `asperity.surface.read`.
"""

import re
from pathlib import Path

import numpy as np

from asperity.arrays import Field
from asperity.errors import UnreadableFile

SUFFIXES = {"txt", "csv", "tsv", "asc", "dat", "xyz", "hfm", "prf"}
_MISSING = {"", "nan", "na", "bad", "***", "-", "inf", "-inf"}  # how exports write a height that was not measured
_LONGEST_HEADER = 200  # lines


def read_table(path: Path) -> Field:
    """The numbers of a text file, one row a line; NaN for what its exporter marks as missing.

    Raises
    ------
    UnreadableFile
        for bytes that are no text, no numbers, or rows of different lengths.
    """
    content = path.read_bytes()
    if b"\0" in content[:4096] and not content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise UnreadableFile(f"{path.name} is not a text file; name it after its format")
    encoding = "utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    lines = [line for line in content.decode(encoding, errors="replace").splitlines() if line.strip()]
    separator, comma = _dialect(lines)
    rows: list[list[float]] = []
    for number, line in enumerate(lines):
        row = _row(line, separator, comma)
        if row is None or (not np.isfinite(row).any() and not rows):
            if rows or number >= _LONGEST_HEADER:
                raise UnreadableFile(f"{path.name} has no numbers in {line.strip()[:40]!r}; mend or delete that line")
            continue
        if rows and len(row) != len(rows[0]):
            raise UnreadableFile(
                f"{path.name} has {len(row)} numbers in a row after rows of {len(rows[0])}; mend that row"
            )
        rows.append(row)
    if not rows:
        raise UnreadableFile(f"{path.name} holds no table of numbers; export it again as text")
    return np.array(rows)


def _dialect(lines: list[str]) -> tuple[str | None, bool]:
    """What stands between the numbers (None: blanks), and whether their decimals follow a comma."""
    sample = [line for line in lines if re.search(r"\d", line)][-100:]
    text = "\n".join(sample)
    for separator in (";", "\t"):
        if separator in text:
            return separator, "," in text
    if '"' in text:
        return '"', bool(re.search(r'"[^"\n]*,[^"\n]*"(?:[,\s]|$)', text)) and "." not in text
    if "," not in text:
        return None, False
    # 0,5 1,25: numbers with decimal commas between blanks; 0.5,1.25 and 1, 2, 3: commas between numbers
    between_blanks = all(re.fullmatch(r"\s*[^\s,]*(?:,\d+\S*)?(?:\s+[^\s,]*(?:,\d+\S*)?)+\s*", line) for line in sample)
    return (None, True) if "." not in text and between_blanks else (",", False)


def _row(line: str, separator: str | None, comma: bool) -> list[float] | None:
    if separator == '"':
        fields = re.findall(r'"([^"]*)"', line) if '"' in line else line.split(",")
    else:
        fields = line.strip().split(separator)
    values = []
    for field in fields:
        text = field.strip().strip('"')
        if text.lower() in _MISSING:
            values.append(np.nan)
            continue
        try:
            values.append(float(text.replace(",", ".") if comma else text))
        except ValueError:
            return None
    if separator is not None and values and np.isnan(values[-1]) and not fields[-1].strip():
        values.pop()  # a separator at the end of the line
    return values
