"""What all that starts processes needs: how many, that Ctrl-C is the parent's business, and that they end with it.

And what all processes want: not to search for garbage or ask for memory again and again, and to
end at once.
"""

import atexit
import ctypes
import gc
import os
import signal
import sys
import threading

GARBAGE_FROM = (
    300_000  # objects; libraries make half as many while they load, and each search takes 0.03 s
)
KEPT = {-1: 128 << 20, -3: 32 << 20}  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h, in bytes


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def save_time() -> None:
    """Search for garbage seldom, and not at the end, where that takes 0.2 s; keep memory that is freed.

    A solve frees and asks for the same fields again and again, and the system clears what it hands
    out. glibc only.
    """
    gc.set_threshold(GARBAGE_FROM)
    atexit.register(gc.freeze)
    if (
        sys.platform == "linux"
        and (keep := getattr(ctypes.CDLL(None), "mallopt", None)) is not None
    ):
        for what, size in KEPT.items():
            keep(what, size)


def leave_interrupts_to_the_parent() -> None:
    """Ignore Ctrl-C in a worker process: the parent stops it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def set_up_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it: a parent that is killed cannot tell its workers to stop."""
    import multiprocessing  # here, and below: only those who start processes need it

    leave_interrupts_to_the_parent()
    save_time()
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    from multiprocessing.connection import wait

    wait([sentinel])
    os._exit(1)
