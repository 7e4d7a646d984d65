"""Text exports of PCS tribometers (MTM, EHD and ETM): the tables of a test's steps.

A file begins with a line such as MTM311 Test Data File. A step begins with Step, its number and
the time at which it started; its table has a header that begins with Step Time (s) or Rolling Speed
(mm/s), fields separated by tabs, and ends with an empty line. The layout was read off public
exports of an MTM and a public reader of those of an EHD rig.
"""

import re
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pandas

from asperity.core.displayed import Displayed
from asperity.core.errors import BadInput
from asperity.core.files import require_file
from asperity.core.limits import require_affordable

FIRST_LINE = re.compile(r"(MTM|EHS|EHD|ETM)\w* Test Data File")
STEP = re.compile(r"Step (\d+)\b.*started at")
TABLE = ("Step Time (s)\t", "Rolling Speed (mm/s)\t", "SRR (%)\t")
MEMORY_PER_BYTE = 30.0  # of text, while it is read


@dataclass(frozen=True, repr=False)
class TribometerStep(Displayed):
    """A step of a test.

    `kind` and `description` are those of the export, such as BOD_TIMED; `table` has a column per
    quantity, named as in the file with its unit.
    """

    number: int
    kind: str
    description: str
    table: pandas.DataFrame


@dataclass(frozen=True, repr=False)
class TribometerTest(Displayed):
    """A test with its steps that have a table; `facts` are the named values before the first."""

    facts: dict[str, str]
    steps: tuple[TribometerStep, ...]


def read_tribometer(path: str | Path) -> TribometerTest:
    """Read the text export of a PCS tribometer.

    Raises
    ------
    BadInput
        for a file that is missing or too large, of another kind, or without a table.
    """
    path = Path(path)
    require_file(path)
    require_affordable(f"reading {path}", memory=MEMORY_PER_BYTE * path.stat().st_size)
    lines = path.read_bytes().decode("utf-8", errors="replace").replace("\0", "").splitlines()
    if not lines or FIRST_LINE.match(lines[0].lstrip("\ufeff")) is None:
        raise BadInput(
            f'{path} is not the text export of a PCS tribometer, which begins with a line such as "'
            'MTM311 Test Data File"; export the test as text'
        )
    starts = [number for number, line in enumerate(lines) if STEP.match(line)]
    blocks = [lines[start:end] for start, end in pairwise([*starts, len(lines)])]
    steps = [step for block in blocks if (step := _step(block)) is not None]
    if not steps:
        raise BadInput(f"{path} contains no step with a table; export a test that was completed")
    header = lines[: starts[0] if starts else len(lines)]
    return TribometerTest(dict(pair for line in header if (pair := _fact(line))), tuple(steps))


def _fact(line: str) -> tuple[str, str] | None:
    """Return name and value of a line in which a colon and a tab separate them."""
    name, tab, value = line.partition(":\t")
    return (name.strip(), value.strip()) if tab and value.strip() else None


def _step(lines: list[str]) -> TribometerStep | None:
    """Return a step from its lines, None without a table."""
    number = STEP.match(lines[0])
    start = next((row for row, line in enumerate(lines) if line.startswith(TABLE)), None)
    if number is None or start is None:
        return None
    named = [field.strip() for line in lines[1:start] for field in line.split("\t")]
    values = dict(zip(named, [*named[1:], ""], strict=True))
    names = [name.strip() for name in lines[start].split("\t")]
    rows = []
    for line in lines[start + 1 :]:
        fields = line.split("\t")
        if not line.strip() or len(fields) < 2:
            break
        rows.append([*fields, *[""] * len(names)][: len(names)])
    table = pandas.DataFrame(rows, columns=range(len(names)), dtype=str)
    # a quantity that is plotted stands twice, and columns without a name separate groups
    kept = [column for column, name in enumerate(names) if name and name not in names[:column]]
    numbers = {names[at]: pandas.to_numeric(table[at], errors="coerce") for at in kept}
    return TribometerStep(
        int(number[1]),
        values.get("Step type", ""),
        values.get("Step description", ""),
        pandas.DataFrame(numbers).dropna(axis=1, how="all"),
    )
