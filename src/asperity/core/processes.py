"""Worker processes (number, interrupts, end with the parent) and memory settings of processes."""

import atexit
import ctypes
import gc
import os
import signal
import sys
import threading

# Threshold of the garbage collector [objects]: imports create half as many, and each collection
# takes 0.03 s
GC_THRESHOLD = 300_000
# M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h [bytes]
MALLOC_OPTIONS = {-1: 128 << 20, -3: 32 << 20}


def cores() -> int:
    """Return the number of processors available to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def tune_memory_use() -> None:
    """Collect garbage rarely and not at exit (0.2 s), and let malloc keep freed memory.

    A solve allocates and frees the same fields repeatedly, and the system clears each new page.
    The malloc options need glibc.
    """
    gc.set_threshold(GC_THRESHOLD)
    atexit.register(gc.freeze)
    if (
        sys.platform == "linux"
        and (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)) is not None
    ):
        for option, size in MALLOC_OPTIONS.items():
            mallopt(option, size)


def ignore_interrupts() -> None:
    """Ignore Ctrl-C in a worker process: the parent stops it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def set_up_worker() -> None:
    """Ignore Ctrl-C and exit with the parent, which cannot stop its workers if it is killed."""
    import multiprocessing  # slow import, not needed without workers

    ignore_interrupts()
    tune_memory_use()
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_exit_with_parent, args=(parent.sentinel,), daemon=True).start()


def _exit_with_parent(sentinel: int) -> None:
    from multiprocessing.connection import wait

    wait([sentinel])
    os._exit(1)
