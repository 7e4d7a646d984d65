"""What all that starts processes needs: how many, that Ctrl-C is the parent's business, and that they end with it.

And what all processes want: an end that does not take as long as their beginning.
"""

import atexit
import gc
import os
import signal
import threading


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def end_quickly() -> None:
    """At its end, leave what this process holds to the system: searching it for garbage takes 0.2 s."""
    atexit.register(gc.freeze)


def leave_interrupts_to_the_parent() -> None:
    """Ignore Ctrl-C in a worker process: the parent stops it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def set_up_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it: a parent that is killed cannot tell its workers to stop."""
    import multiprocessing  # here, and below: only those who start processes need it

    leave_interrupts_to_the_parent()
    end_quickly()
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    from multiprocessing.connection import wait

    wait([sentinel])
    os._exit(1)
