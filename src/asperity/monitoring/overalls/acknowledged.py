"""Rows of a table of overall values up to which alarms are acknowledged."""

from bisect import bisect_right
from datetime import UTC, datetime

from asperity.core.errors import BadInput
from asperity.monitoring.alarm import LAST
from asperity.monitoring.overalls.table import OverallValues


def row_name(overalls: OverallValues, number: int) -> str:
    """Return time stamp or x of a row, as text."""
    if overalls.times:
        return overalls.times[number]
    return f"{overalls.x[number]:g} {overalls.x_unit}".rstrip()


def acknowledged_rows(overalls: OverallValues, stamp: str | None) -> int:
    """Return the number of rows up to a time stamp as in the file or in ISO 8601, or a date.

    Raises
    ------
    BadInput
        for an unknown time stamp.
    """
    if stamp is None:
        return 0
    if stamp == LAST:
        return int(overalls.x.size)
    count = _last_place(overalls, stamp.strip())
    if not count:
        raise BadInput(
            f"{stamp} is not a time stamp of {overalls.path.name}; acknowledge one of them, "
            f"such as {row_name(overalls, overalls.x.size - 1)}, or {LAST!r} for the newest"
        )
    return count


def rows_until(overalls: OverallValues, stamp: str | None) -> int:
    """Return the number of rows up to a stored time stamp, which may have left the file."""
    if stamp is None:
        return 0
    if overalls.times:
        return bisect_right(overalls.times, stamp)
    try:
        return bisect_right(overalls.x, float(stamp.split()[0]))
    except (ValueError, IndexError):
        return 0


def _last_place(overalls: OverallValues, stamp: str) -> int:
    """Return the number of the last row with a time stamp, counted from 1; 0 without one."""
    places = [number for number, text in enumerate(overalls.stamps, 1) if text.strip() == stamp]
    if not places and overalls.times:
        text = _iso(stamp)
        if text:
            starts = enumerate(overalls.times, 1)
            places = [number for number, time in starts if time.startswith(text)]
    elif not places:
        places = [
            number
            for number, x in enumerate(overalls.x, 1)
            if f"{x:g}" == stamp or row_name(overalls, number - 1) == stamp
        ]
    return places[-1] if places else 0


def _iso(stamp: str) -> str:
    """Return a stamp as `times` begin, as precise as it is; "" for other text."""
    try:
        time = datetime.fromisoformat(stamp)
    except ValueError:
        return ""
    if time.tzinfo is not None:
        time = time.astimezone(UTC).replace(tzinfo=None)
    if len(stamp) <= len("2025-01-31"):
        return time.strftime("%Y-%m-%d")
    if time.second or time.microsecond or stamp.count(":") > 1 + ("+" in stamp):
        text = time.isoformat()
        return text.rstrip("0").rstrip(".") if time.microsecond else text
    return time.isoformat(timespec="minutes")
