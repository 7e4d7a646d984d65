"""Pool of worker processes, and job queues in which the newest job replaces waiting ones."""

import multiprocessing
import threading
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import suppress
from functools import partial
from logging import getLogger

from asperity.app.contact_jobs import JobFailure, Superseded, Ticket, run_job, set_up, warm_up
from asperity.core.processes import cores

MAX_WORKERS = 4
SLOTS = 4096  # largest number of queues, six per session

Work = tuple[
    Callable[..., object], tuple[object, ...]
]  # function and its arguments after the ticket
_log = getLogger(__name__)


class WorkerPool:
    """Worker processes with one thread each, and the table of the latest job of each slot."""

    def __init__(self, workers: int | None = None) -> None:
        context = multiprocessing.get_context("spawn")
        self.newest = context.Array("q", SLOTS, lock=False)
        self._context = context
        self._free = list(range(SLOTS - 1, -1, -1))
        self.workers = workers or max(1, min(MAX_WORKERS, cores()))
        self._pool = self._new_pool()
        self.warming: list[Future[float]] = []
        self._running: set[Future[object]] = set()
        self._lock = threading.Lock()  # of the two lists below
        self._waiting: list[tuple[Future[object], Callable[..., object], tuple[object, ...]]] = []
        self._when_warm: list[Callable[[], None]] = []

    def _new_pool(self) -> Executor:
        return ProcessPoolExecutor(self.workers, self._context, set_up, (self.newest,))

    def warm_up(self) -> None:
        """Let one worker load and compile the solver; the others then load what it compiled."""
        first = self._pool.submit(warm_up)
        self.warming = [first]
        first.add_done_callback(self._start_waiting)

    def _start_waiting(self, _first: "Future[float]") -> None:
        """Start the jobs that waited for the solver, and warm up the other workers."""
        with self._lock:
            waiting, self._waiting = self._waiting, []
            callbacks, self._when_warm = self._when_warm, []
        for outcome, work, arguments in waiting:
            self.submit(work, *arguments).add_done_callback(partial(_copy_outcome, outcome))
        with suppress(BrokenExecutor, RuntimeError):  # the pool is closed
            self.warming += [self._pool.submit(warm_up) for _ in range(self.workers)]
        for callback in callbacks:
            callback()

    @property
    def is_warm(self) -> bool:
        """True once a worker has warmed up."""
        return any(future.done() for future in self.warming)

    @property
    def is_compiling(self) -> bool:
        """True while the first worker loads and compiles the solver."""
        return bool(self.warming) and not self.is_warm

    def when_warm(self, callback: Callable[[], None]) -> None:
        """Call a function once a worker has warmed up; at once without a pending warm-up."""
        with self._lock:
            if self.is_compiling:
                self._when_warm.append(callback)
                return
        callback()

    def submit_solve(self, work: Callable[..., object], *arguments: object) -> "Future[object]":
        """Run a job that needs the solver; it waits until one process has compiled it."""
        with self._lock:
            if self.is_compiling:
                outcome: Future[object] = Future()
                self._waiting.append((outcome, work, arguments))
                return outcome
        return self.submit(work, *arguments)

    def submit(self, work: Callable[..., object], *arguments: object) -> "Future[object]":
        """Run a job in a worker; its errors are returned as `JobFailure`."""
        try:
            future = self._pool.submit(run_job, work, *arguments)
        except (BrokenExecutor, RuntimeError):
            self._pool = self._new_pool()  # a worker died, possibly from lack of memory
            future = self._pool.submit(run_job, work, *arguments)
        self._running.add(future)
        future.add_done_callback(self._running.discard)
        return future

    @property
    def has_room(self) -> bool:
        """True if a worker is idle, or will be once the solver is compiled."""
        return len(self._running) + len(self._waiting) < self.workers

    def acquire_slot(self) -> int:
        """Reserve a slot; -1 if none is free, whose jobs cannot be superseded."""
        return self._free.pop() if self._free else -1

    def release(self, slot: int) -> None:
        """Release a slot and supersede its jobs."""
        if slot >= 0:
            self.newest[slot] += 1
            self._free.append(slot)

    def close(self) -> None:
        """Supersede all jobs and stop the workers."""
        for slot in range(SLOTS):
            self.newest[slot] = -1
        with self._lock:
            self._waiting.clear()
        self._pool.shutdown(wait=True, cancel_futures=True)


class VisitPool:
    """Worker pool of one visit, whose jobs wait until its browser is connected.

    A request alone starts no work: any web site can make a browser send one.
    """

    def __init__(self, worker_pool: WorkerPool) -> None:
        self._pool = worker_pool
        self.newest, self.acquire_slot, self.release = (
            worker_pool.newest,
            worker_pool.acquire_slot,
            worker_pool.release,
        )
        self.when_warm = worker_pool.when_warm
        self._connected = False
        self._waiting: list[tuple[Future[object], Callable[[], Future[object]]]] = []
        self._when_connected: list[Callable[[], None]] = []

    @property
    def is_compiling(self) -> bool:
        """True while the first worker loads and compiles the solver."""
        return self._pool.is_compiling

    @property
    def has_room(self) -> bool:
        """True if a worker is idle, or will be once the solver is compiled."""
        return self._pool.has_room

    def submit(self, work: Callable[..., object], *arguments: object) -> "Future[object]":
        """Run a job once the browser is connected; see `WorkerPool.submit`."""
        return self._start(partial(self._pool.submit, work, *arguments))

    def submit_solve(self, work: Callable[..., object], *arguments: object) -> "Future[object]":
        """Run a job that needs the solver once the browser is connected."""
        return self._start(partial(self._pool.submit_solve, work, *arguments))

    def _start(self, submit: Callable[[], "Future[object]"]) -> "Future[object]":
        if self._connected:
            return submit()
        outcome: Future[object] = Future()
        self._waiting.append((outcome, submit))
        return outcome

    def when_connected(self, callback: Callable[[], None]) -> None:
        """Call a function when the browser connects, which it has not done yet."""
        self._when_connected.append(callback)

    def connect(self) -> None:
        """Start the waiting jobs, and others at once from now on."""
        self._connected = True
        for callback in self._when_connected:
            callback()
        waiting, self._waiting = self._waiting, []
        for outcome, submit in waiting:
            submit().add_done_callback(partial(_copy_outcome, outcome))


def _copy_outcome(outcome: "Future[object]", done: "Future[object]") -> None:
    """Give a waiting job the outcome of its run."""
    error = done.exception()
    if error is None:
        outcome.set_result(done.result())
    else:
        outcome.set_exception(error)


class JobQueue:
    """Queue with one running and at most one waiting job, the newest.

    Parameters
    ----------
    workshop : runs the jobs
    deliver : calls a function under the document's lock
    solves : its jobs need the solver and wait until that is compiled
    """

    def __init__(
        self,
        worker_pool: WorkerPool | VisitPool,
        deliver: Callable[[Callable[[], None]], None],
        *,
        solves: bool = False,
    ) -> None:
        self._worker_pool, self._deliver = worker_pool, deliver
        self._submit = worker_pool.submit_solve if solves else worker_pool.submit
        self._slot = worker_pool.acquire_slot()
        self._number = worker_pool.newest[self._slot] if self._slot >= 0 else 0
        self._running = False
        self._waiting: tuple[Work, Callable[[object], None]] | None = None
        self.closed = False

    @property
    def busy(self) -> bool:
        """True while a job is running."""
        return self._running

    @property
    def has_room(self) -> bool:
        """True if a new job starts at once or replaces the running one."""
        return self._running or self._worker_pool.has_room

    def submit(self, work: Work, on_result: Callable[[object], None]) -> None:
        """Submit a job; `on_result` is called with its outcome unless it is superseded."""
        if self.closed:
            return
        self._number += 1
        if self._slot >= 0:
            self._worker_pool.newest[self._slot] = self._number
        self._waiting = (work, on_result)
        if not self._running:
            self._next()

    def cancel(self) -> None:
        """Cancel the running and the waiting job."""
        self._number += 1
        if self._slot >= 0:
            self._worker_pool.newest[self._slot] = self._number
        self._waiting = None

    def close(self) -> None:
        """Cancel all jobs and release the slot."""
        self.closed, self._waiting = True, None
        self._worker_pool.release(self._slot)
        self._slot = -1

    def _next(self) -> None:
        if self._waiting is None or self.closed:
            return
        (function, arguments), on_result = self._waiting
        self._waiting, self._running = None, True
        number = self._number
        future = self._submit(function, Ticket(self._slot, number), *arguments)
        future.add_done_callback(
            lambda done: self._deliver(lambda: self._finish(done, number, on_result))
        )

    def _finish(
        self, done: "Future[object]", number: int, on_result: Callable[[object], None]
    ) -> None:
        """Pass on the outcome of a job and start the next one."""
        self._running = False
        if self.closed:
            return
        result = job_outcome(done)
        if number == self._number and not isinstance(result, Superseded):
            on_result(result)
        if not self._running:
            self._next()


def job_outcome(done: "Future[object]") -> object:
    """Return the outcome of a job, a `JobFailure` if it failed or its process died."""
    try:
        return done.result()
    except BrokenExecutor:
        return JobFailure(
            "A worker process died, possibly from lack of memory. Try again or use a coarser grid."
        )
    except Exception:  # noqa: BLE001 - the session continues, the terminal shows the error
        _log.exception("a job failed")
        return JobFailure("Internal error; details in the terminal. Please report it.")


def wait_until_warm(worker_pool: WorkerPool, seconds: float) -> bool:
    """Wait for a warm worker; return False if there is none within this time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end and not worker_pool.is_warm:
        time.sleep(0.02)
    return worker_pool.is_warm
