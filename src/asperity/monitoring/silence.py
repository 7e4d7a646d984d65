"""Detection of overdue recordings: a sensor, logger or line that has stopped delivering."""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from statistics import median

MIN_INTERVALS = 8  # intervals between arrivals from which the usual one is known
OVERDUE_FACTOR = 5.0  # usual intervals without a recording until it is overdue
MIN_WAIT_S = 60.0
SILENCE = "silence"  # `raised_by` of a state: overdue recordings


def overdue_reason(
    arrivals: Sequence[datetime], limit_s: float | None, now: datetime | None = None
) -> str:
    """Return why recordings are overdue, without a full stop; empty if they are not.

    Parameters
    ----------
    arrivals : times at which recordings arrived, in order
    limit_s : longest time between recordings [s]; None: five usual intervals, once these are known
    """
    if not arrivals:
        return ""
    intervals = [(after - before).total_seconds() for before, after in pairwise(arrivals)]
    typical = median(intervals) if len(intervals) >= MIN_INTERVALS else None
    if limit_s is None and typical is None:
        return ""
    longest = max(OVERDUE_FACTOR * (typical or 0.0), MIN_WAIT_S) if limit_s is None else limit_s
    elapsed = ((now or datetime.now(UTC)) - arrivals[-1]).total_seconds()
    if elapsed <= longest:
        return ""
    expected = (
        f"the usual interval is {duration_text(typical)}"
        if limit_s is None and typical
        else f"the limit is {duration_text(longest)}"
    )
    last = arrivals[-1].isoformat(timespec="seconds")
    return f"no recording has come for {duration_text(elapsed)}, since {last}; {expected}"


def duration_text(seconds: float) -> str:
    """Return a duration in its natural unit."""
    for unit, size in (("days", 86_400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
