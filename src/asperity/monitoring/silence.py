"""Whether recordings have stopped coming: a sensor, a logger or a line that delivers nothing any more.

What is kept and who is called is left to `store` and `watch`.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from statistics import median

ENOUGH = 8  # times between arrivals, from which on one knows how often recordings come
LONGER = 5.0  # than usual, before anybody is called
LEAST_S = 60.0
SILENCE = "silence"  # who raised a state: recordings that do not come


def silence(
    arrivals: Sequence[datetime], expected_s: float | None, now: datetime | None = None
) -> str:
    """Why recordings are overdue, a sentence without an end; empty where they are not, or nobody knows how often.

    Parameters
    ----------
    arrivals : when recordings came, in order
    expected_s : the longest time between two that is in order; None: five times what is usual, once that is known
    """
    if not arrivals:
        return ""
    gaps = [(behind - before).total_seconds() for before, behind in pairwise(arrivals)]
    usual = median(gaps) if len(gaps) >= ENOUGH else None
    if expected_s is None and usual is None:
        return ""
    longest = max(LONGER * (usual or 0.0), LEAST_S) if expected_s is None else expected_s
    waited = ((now or datetime.now(UTC)) - arrivals[-1]).total_seconds()
    if waited <= longest:
        return ""
    came = (
        f"one comes every {spoken(usual)}"
        if expected_s is None and usual
        else f"{spoken(longest)} are allowed"
    )
    return f"no recording has come for {spoken(waited)}, since {arrivals[-1].isoformat(timespec='seconds')}; {came}"


def spoken(seconds: float) -> str:
    """A time in the unit in which a person says it."""
    for unit, size in (("days", 86_400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
