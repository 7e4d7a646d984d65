"""Text tables of numbers with any separator, decimal sign and header lines.

`asperity.surface.read` interprets the columns.
"""

import re
from pathlib import Path

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.text_dialect import sniff_dialect

SUFFIXES = {"txt", "csv", "tsv", "asc", "dat", "xyz", "hfm", "prf"}
_MAX_HEADER = 200  # lines
_NO_DATA = re.compile(r"^\s*no_?data(?:_?value)?[\s=:]+(-?\d+(?:\.\d+)?)\s*$", re.I | re.M)


def read_table(path: Path) -> Field:
    """Read the numbers of a text file, one row per line; nan for markers of missing values.

    A header such as "NODATA_value -9999" declares such a marker.

    Raises
    ------
    UnreadableFile
        The file is not text, holds no numbers, or has rows of different lengths.
    """
    content = path.read_bytes()
    if b"\0" in content[:4096] and not content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise UnreadableFile(f"{path.name} is not a text file; name it after its format")
    encoding = "utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig"
    lines = [
        line for line in content.decode(encoding, errors="replace").splitlines() if line.strip()
    ]
    dialect = sniff_dialect(
        [line for line in lines if re.search(r"\d", line)][-100:], fewest_columns=2
    )
    rows: list[list[float]] = []
    for number, line in enumerate(lines):
        numbers = [dialect.number(field) for field in dialect.fields(line)]
        row = [value for value in numbers if value is not None]
        if len(row) < len(numbers) or (not np.isfinite(row).any() and not rows):
            if rows or number >= _MAX_HEADER:
                raise UnreadableFile(
                    f"{path.name} has no numbers in {line.strip()[:40]!r}; correct or delete that "
                    "line"
                )
            continue
        if rows and len(row) != len(rows[0]):
            raise UnreadableFile(
                f"{path.name} has {len(row)} numbers in a row after rows of {len(rows[0])}; "
                "correct that row"
            )
        rows.append(row)
    if not rows:
        raise UnreadableFile(f"{path.name} holds no table of numbers; export it again as text")
    return _without_markers(np.array(rows), lines[:_MAX_HEADER])


def _without_markers(table: Field, header: list[str]) -> Field:
    """Return the table with nan for values that its header declares as missing."""
    for marker in _NO_DATA.findall("\n".join(header)):
        table[table == float(marker)] = np.nan
    return table
