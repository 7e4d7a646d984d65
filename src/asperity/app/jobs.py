"""Work handed to processes: a pool that is warm, a table of what is still wanted, and one piece of work a session.

The newest wish of a session waits until what it asked for before has come back; those between are
never begun.
"""

import multiprocessing
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from logging import getLogger
from typing import Any

from asperity.app.contact_jobs import Refused, Superseded, Ticket, set_up, told, warm
from asperity.core.processes import cores

MOST_WORKERS = 4
SLOTS = 4096  # of queues at a time, three a session

Work = tuple[
    Callable[..., Any], tuple[Any, ...]
]  # what a worker calls, and with what after its ticket
_log = getLogger(__name__)


class Workshop:
    """Processes that solve, each with one thread, and a table that tells them what is not wanted any more."""

    def __init__(self, workers: int | None = None) -> None:
        context = multiprocessing.get_context("spawn")
        self.newest = context.Array("q", SLOTS, lock=False)
        self._context = context
        self._free = list(range(SLOTS - 1, -1, -1))
        self.workers = workers or max(1, min(MOST_WORKERS, cores()))
        self._pool = self._new_pool()
        self.warming: list[Future[float]] = []
        self._begun: set[Future[Any]] = set()

    def _new_pool(self) -> Executor:
        return ProcessPoolExecutor(self.workers, self._context, set_up, (self.newest,))

    def warm(self) -> None:
        """Let every worker load and compile what a solve needs."""
        self.warming = [self._pool.submit(warm) for _ in range(self.workers)]

    @property
    def is_warm(self) -> bool:
        """Whether a first worker has done so."""
        return any(future.done() for future in self.warming)

    def submit(self, work: Callable[..., Any], *arguments: Any) -> "Future[Any]":
        """Let a worker do it; what it refuses comes back as `Refused`."""
        try:
            future = self._pool.submit(told, work, *arguments)
        except (BrokenExecutor, RuntimeError):
            self._pool = (
                self._new_pool()
            )  # a worker died, of memory perhaps: the others are new too
            future = self._pool.submit(told, work, *arguments)
        self._begun.add(future)
        future.add_done_callback(self._begun.discard)
        return future

    @property
    def has_room(self) -> bool:
        """Whether a worker has nothing to do."""
        return len(self._begun) < self.workers

    def slot(self) -> int:
        """A place in the table for a session; -1 where all are taken, and nothing of it can be called back."""
        return self._free.pop() if self._free else -1

    def release(self, slot: int) -> None:
        """Give a place back; what was asked for by its session is wanted no more."""
        if slot >= 0:
            self.newest[slot] += 1
            self._free.append(slot)

    def close(self) -> None:
        """Call everything back and stop the workers."""
        for slot in range(SLOTS):
            self.newest[slot] = -1
        self._pool.shutdown(wait=True, cancel_futures=True)


class Queue:
    """One piece of work in flight; the newest wish waits, and what it replaces is never begun.

    Parameters
    ----------
    workshop : does the work
    deliver : calls a function where the session's models may be touched
    """

    def __init__(self, workshop: Workshop, deliver: Callable[[Callable[[], None]], None]) -> None:
        self._workshop, self._deliver = workshop, deliver
        self._slot = workshop.slot()
        self._number = workshop.newest[self._slot] if self._slot >= 0 else 0
        self._running = False
        self._waiting: tuple[Work, Callable[[Any], None]] | None = None
        self.closed = False

    @property
    def busy(self) -> bool:
        """Whether something is being worked on."""
        return self._running

    @property
    def has_room(self) -> bool:
        """Whether what is asked for would be begun at once, or takes the place of what is."""
        return self._running or self._workshop.has_room

    def ask(self, work: Work, arrived: Callable[[Any], None]) -> None:
        """Have something done, and be called with what came of it unless something newer was asked for meanwhile."""
        if self.closed:
            return
        self._number += 1
        if self._slot >= 0:
            self._workshop.newest[self._slot] = self._number
        self._waiting = (work, arrived)
        if not self._running:
            self._next()

    def close(self) -> None:
        """Ask for nothing more, and let go of everything."""
        self.closed, self._waiting = True, None
        self._workshop.release(self._slot)
        self._slot = -1

    def _next(self) -> None:
        if self._waiting is None or self.closed:
            return
        (function, arguments), arrived = self._waiting
        self._waiting, self._running = None, True
        number = self._number
        future = self._workshop.submit(function, Ticket(self._slot, number), *arguments)
        future.add_done_callback(
            lambda done: self._deliver(lambda: self._came(done, number, arrived))
        )

    def _came(self, done: "Future[Any]", number: int, arrived: Callable[[Any], None]) -> None:
        """Hand on what came, where the session's models may be touched."""
        self._running = False
        if self.closed:
            return
        result = outcome(done)
        if number == self._number and not isinstance(result, Superseded):
            arrived(result)
        if not self._running:
            self._next()


def outcome(done: "Future[Any]") -> Any:
    """What a piece of work gave; a sentence where its process died or it failed."""
    try:
        return done.result()
    except BrokenExecutor:
        return Refused(
            "A worker process died, for want of memory perhaps; turn the knob again, or take fewer cells."
        )
    except Exception:  # noqa: BLE001 - whatever it was, the session goes on and the terminal tells it
        _log.exception("a piece of work failed")
        return Refused(
            "This failed within asperity, which is a mistake of ours; what it was stands in the terminal."
        )


def wait_until_warm(workshop: Workshop, seconds: float) -> bool:
    """Whether a worker was warm within so many seconds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and not workshop.is_warm:
        time.sleep(0.02)
    return workshop.is_warm
