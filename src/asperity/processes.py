"""What all that starts processes needs: how many, and that Ctrl-C is the parent's business."""

import os
import signal


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def leave_interrupts_to_the_parent() -> None:
    """Ignore Ctrl-C in a worker process: the parent stops it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
