"""Dates in file names whose day or month comes first, compared with the files' times of change.

Order by name is order by number: 03-12-2024 precedes 04-11-2024, whichever comes first.
"""

import re
from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import datetime
from pathlib import Path

_DATE = re.compile(
    r"(?<!\d)(?P<date>(\d{1,2})([-._ ])(\d{1,2})\3(?P<year>\d{4}))(?!\d)"
    r"(?:\D{1,3}(?P<hour>\d{2})\D?(?P<minute>\d{2})(?:\D?(?P<second>\d{2}))?(?!\d))?"
)
READINGS = {"day": (0, 1), "month": (1, 0)}  # positions of day and month, by which comes first
REMEDY = "state `started` in sidecars, or name files by year, month and day"


def name_order_remark(paths: Sequence[Path]) -> str:
    """Return a remark if recordings in order of names may not be in order of time, or "".

    Their names hold dates that begin with a day or month. The times of change decide which of the
    two, if they agree with either.

    Parameters
    ----------
    paths : recordings that do not state their start, in order of names
    """
    matches = [_DATE.search(path.name) for path in paths]
    dated = [(path, match) for path, match in zip(paths, matches, strict=True) if match]
    if len(dated) < 2:
        return ""
    orders = {
        first: order
        for first in READINGS
        if (order := _order(_time(match, first) for _, match in dated)) is not None
    }
    by_name = list(range(len(dated)))
    if not orders or all(order == by_name for order in orders.values()):
        return ""
    name, text = dated[0][0].name, dated[0][1]["date"]
    changed = _order(_changed(path) for path, _ in dated)
    agreeing = [first for first, order in orders.items() if order == changed]
    if changed == by_name and agreeing:
        return ""
    if len(orders) == 1 or len(agreeing) == 1:
        (first,) = agreeing if len(agreeing) == 1 else orders
        source = "their times of change" if len(agreeing) == 1 else "their numbers"
        return (
            f"names such as {name} begin their date with the {first}, by {source}, and recordings "
            f"in order of names are not in order of time; {REMEDY}"
        )
    return (
        f"the date {text} in names such as {name} may begin with day or month, and the times of "
        f"change of the files agree with neither; recordings are in order of names, {REMEDY}"
    )


def _order(times: Iterable[datetime | None]) -> list[int] | None:
    """Return the positions in order of time; None if a time is missing or all are equal."""
    known = list(times)
    present = [time for time in known if time is not None]
    if len(present) < len(known) or len(set(present)) < 2:
        return None
    return sorted(range(len(known)), key=lambda number: present[number])


def _time(match: re.Match[str], first: str) -> datetime | None:
    """Return the time in a name, read with its day or month first; None if impossible."""
    numbers = int(match[2]), int(match[4])
    day, month = (numbers[position] for position in READINGS[first])
    hour, minute, second = (int(match[part] or 0) for part in ("hour", "minute", "second"))
    with suppress(ValueError):
        return datetime(int(match["year"]), month, day, hour, minute, second)
    return None


def _changed(path: Path) -> datetime | None:
    with suppress(OSError, OverflowError, ValueError):
        return datetime.fromtimestamp(path.stat().st_mtime)
    return None
