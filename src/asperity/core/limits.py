"""How much memory and time a piece of work may take: worked out beforehand, and refused in a sentence where it is more.

`ASPERITY_MEMORY_GB` and `ASPERITY_DAYS` raise the limits (or lower them); worker processes inherit
them.
"""

import math
import os
from pathlib import Path

from asperity.core.errors import BadInput, UnreadableFile

MEMORY, DAYS = "ASPERITY_MEMORY_GB", "ASPERITY_DAYS"
SMALL_FILE = 256e6  # bytes that any file may unpack to
MOST_PACKED = 50.0  # times that a larger one may grow: measured data are not packed more tightly
READING = 12.0  # times its size, that a reader may take of memory: text that becomes numbers
LONGEST_DAYS = 30.0
GIGABYTE = 1e9
_SHARE = 0.8  # of the machine's memory


def _stated(variable: str) -> float | None:
    text = os.environ.get(variable, "").strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise BadInput(
            f"the environment variable {variable} must be a positive number, got {text[:40]!r}"
        )
    return value


def memory_limit() -> float:
    """Bytes that a computation may take: what is stated, or four fifths of the machine's memory."""
    stated = _stated(MEMORY)
    if stated is not None:
        return stated * GIGABYTE
    limits = [_physical_memory()]
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            limits.append(float(Path(name).read_text("ascii")))
        except (OSError, ValueError):  # no such system, or "max"
            continue
    return _SHARE * min(limits)


def _physical_memory() -> float:
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):  # not on every system
        return 16.0 * GIGABYTE


def require_affordable(what: str, *, memory: float = 0.0, seconds: float = 0.0) -> None:
    """Refuse what would take more bytes or seconds than there are.

    Parameters
    ----------
    what : the thing and its value, as the sentence begins with it
    memory, seconds : estimates, of which an infinite or unknown one is too much
    """
    most, days = memory_limit(), _stated(DAYS) or LONGEST_DAYS
    if not memory <= most:
        raise BadInput(
            f"{what} would take about {memory / GIGABYTE:.2g} GB of memory, where {most / GIGABYTE:.2g} GB may be "
            f"used; ask for less, or set {MEMORY}"
        )
    if not seconds <= 86400.0 * days:
        raise BadInput(
            f"{what} would take about {seconds / 86400.0:.2g} days, where {days:g} may be used; "
            f"ask for less, or set {DAYS}"
        )


def unpacked_limit(stored: int) -> float:
    """Bytes that a file of so many stored bytes may unpack to."""
    stated = _stated(MEMORY)
    return max(SMALL_FILE, MOST_PACKED * stored) if stated is None else stated * GIGABYTE


def reading_limit(stored: int) -> float:
    """Bytes of memory that a reader of such a file may take, which holds all of it at once."""
    stated = _stated(MEMORY)
    return (
        min(max(2.0 * SMALL_FILE, READING * stored), memory_limit())
        if stated is None
        else stated * GIGABYTE
    )


def stored_size(path: Path) -> int:
    """Bytes that a file takes on the disk: fewer than it claims where it has holes; of a folder, all files in it."""
    if path.is_dir():
        return sum(stored_size(file) for file in path.rglob("*") if file.is_file())
    status = path.stat()
    return min(status.st_size, 512 * getattr(status, "st_blocks", status.st_size) or status.st_size)


def require_unpacked(path: Path, declared: float, remedy: str) -> None:
    """Refuse a file that claims to hold far more than it stores, before anything is unpacked."""
    stored = stored_size(path)
    limit = unpacked_limit(stored)
    if declared > limit:
        raise UnreadableFile(
            f"{path.name} of {stored / GIGABYTE:.2g} GB claims to hold {declared / GIGABYTE:.2g} GB, where "
            f"{limit / GIGABYTE:.2g} GB may be unpacked; {remedy}, or set {MEMORY} if it is right"
        )
