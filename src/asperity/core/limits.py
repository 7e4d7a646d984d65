"""Limits on memory and time, estimated and checked before the computation starts.

The environment variables `ASPERITY_MEMORY_GB` and `ASPERITY_DAYS` override the limits; worker
processes inherit them.
"""

import math
import os
from pathlib import Path

from asperity.core.errors import BadInput, UnreadableFile

MEMORY = "ASPERITY_MEMORY_GB"
DAYS = "ASPERITY_DAYS"
UNPACKED_BYTES = 256e6  # any file may unpack to this size
UNPACKING_RATIO = 50.0  # largest expansion of a larger file; measured data compress less
READING_RATIO = 12.0  # memory of a reader over the file's size, for text that becomes numbers
DEFAULT_DAYS = 30.0
GIGABYTE = 1e9
_MEMORY_SHARE = 0.8  # of the machine's memory


def _environment_value(variable: str) -> float | None:
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
    """Return the memory limit [bytes]: the environment variable, or 80 % of the machine memory."""
    stated = _environment_value(MEMORY)
    if stated is not None:
        return stated * GIGABYTE
    limits = [_physical_memory()]
    for name in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            limits.append(float(Path(name).read_text("ascii")))
        except (OSError, ValueError):  # no cgroup, or "max"
            continue
    return _MEMORY_SHARE * min(limits)


def _physical_memory() -> float:
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):  # not available on every system
        return 16.0 * GIGABYTE


def require_affordable(task: str, *, memory: float = 0.0, seconds: float = 0.0) -> None:
    """Raise BadInput if a task would exceed the memory or time limit.

    Parameters
    ----------
    task : subject of the message, with its value
    memory, seconds : estimates [bytes, s]; infinite and nan exceed every limit
    """
    limit = memory_limit()
    days = _environment_value(DAYS) or DEFAULT_DAYS
    if not memory <= limit:
        raise BadInput(
            f"{task} would take about {memory / GIGABYTE:.2g} GB of memory, more than the limit of "
            f"{limit / GIGABYTE:.2g} GB; reduce it, or raise the limit with the environment "
            f"variable {MEMORY}"
        )
    if not seconds <= 86400.0 * days:
        raise BadInput(
            f"{task} would take about {seconds / 86400.0:.2g} days, more than the limit of "
            f"{days:g} days; reduce it, or raise the limit with the environment variable {DAYS}"
        )


def unpacked_limit(stored: int) -> float:
    """Return the largest unpacked size [bytes] of a file of `stored` bytes."""
    stated = _environment_value(MEMORY)
    return max(UNPACKED_BYTES, UNPACKING_RATIO * stored) if stated is None else stated * GIGABYTE


def reading_limit(stored: int) -> float:
    """Return the memory [bytes] that a reader may use, which holds the whole file at once."""
    stated = _environment_value(MEMORY)
    return (
        min(max(2.0 * UNPACKED_BYTES, READING_RATIO * stored), memory_limit())
        if stated is None
        else stated * GIGABYTE
    )


def stored_size(path: Path) -> int:
    """Return the bytes on disk of a file (a sparse file has fewer than its size) or folder."""
    if path.is_dir():
        return sum(stored_size(file) for file in path.rglob("*") if file.is_file())
    status = path.stat()
    return min(status.st_size, 512 * getattr(status, "st_blocks", status.st_size) or status.st_size)


def require_plausible_size(path: Path, declared: float, remedy: str) -> None:
    """Raise UnreadableFile if a file declares far more content than it stores (a zip bomb)."""
    stored = stored_size(path)
    limit = unpacked_limit(stored)
    if declared > limit:
        raise UnreadableFile(
            f"{path.name} of {stored / GIGABYTE:.2g} GB declares {declared / GIGABYTE:.2g} GB of "
            f"content, more than the limit of {limit / GIGABYTE:.2g} GB; {remedy}, or set {MEMORY} "
            "if the file is correct"
        )
