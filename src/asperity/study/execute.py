"""Execution of a study: batches of cases on any `concurrent.futures` executor.

Each case is solved from scratch with its own seeds, so a resumed, sharded or distributed study
gives the same results as an uninterrupted one.
"""

import math
import os
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import chain, islice, takewhile
from multiprocessing import get_context
from pathlib import Path

from asperity.core.arrays import usual_float_errors
from asperity.core.errors import AsperityError, BadInput, require_positive
from asperity.core.notebook import notebook_progress
from asperity.core.processes import cores, set_up_worker
from asperity.study.evaluate import (
    DONE,
    FAILED,
    FIELDS,
    RUN,
    Evaluated,
    Row,
    TimedBatch,
    timed_batch,
)
from asperity.study.maps import require_zarr
from asperity.study.plan import StudyCase, StudyPlan
from asperity.study.result import StudyResult
from asperity.study.store import StudyFolder, open_study_folder, ordered_table, rows_table

BATCH_S = 2.0  # work in a batch: long against the cost of submitting it, short enough to lose
LARGEST_BATCH = 200
BATCHES_AHEAD = 2  # per worker; more would only be lost in a crash
STORED_FIELDS = {"solve": FIELDS, "shake": FIELDS, "surfaces": (RUN,)}  # by kind of study
MAX_CRASHES = 3  # of the processes that computed one case, the last of them running it alone


@dataclass(frozen=True)
class StudyProgress:
    """Progress of a study: `kept` cases were finished before, `done` since."""

    total: int
    kept: int
    done: int
    failed: int
    seconds: float

    @property
    def rate(self) -> float:
        """Cases per second."""
        return self.done / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Remaining time at the present rate; None before the first case."""
        return (self.total - self.kept - self.done) / self.rate if self.done else None


@usual_float_errors
def run_study(
    plan: StudyPlan,
    *,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    shard: tuple[int, int] = (1, 1),
    retry_failed: bool = False,
    fields: Sequence[str] = (),
    progress: Callable[[StudyProgress], None] | None = None,
) -> StudyResult:
    """Compute the missing cases of a study.

    Parameters
    ----------
    plan : from `plan_study` or `plan_points`
    out : folder to store the study in and resume from; None: in memory
    executor : any `concurrent.futures` executor that can import asperity; None: new processes
    workers : number of processes, by default one per processor
    shard : (k, n), compute only every n-th case, starting with the k-th
    retry_failed : compute failed cases again
    fields : maps to store beside the rows, of FIELDS, or "run" for whole runs; needs `out`
    progress : called after every batch

    Raises
    ------
    BadInput
        for a folder, shard, worker count or field that cannot be used.
    AsperityError
        if results cannot be written, or the executor is lost; finished cases are kept.
    """
    _require_shard(shard)
    if workers is not None:
        require_positive("workers", workers)
    _require_fields(fields, plan.kind, stored=out is not None)
    start = time.perf_counter()
    progress = progress or notebook_progress("Study", _progress_text)
    with nullcontext() if out is None else open_study_folder(Path(out), plan, shard) as store:
        work = _Work(plan, store, shard, retry_failed, tuple(fields), start, progress)
        if work.waiting:
            _compute(work, executor, workers)
        seconds = time.perf_counter() - start
        if store is None:
            table = ordered_table([rows_table(work.rows)] if work.rows else [], plan)
            return StudyResult(plan, table, seconds=seconds, computed=work.done)
        path = store.merge()
        return StudyResult(
            plan, store.table(), store.folder, path, seconds, work.done, store.remarks()
        )


def _progress_text(state: StudyProgress) -> tuple[float, str]:
    done = state.kept + state.done
    return done / max(state.total, 1), f"{done} of {state.total} cases, {state.failed} failed"


def merge_studies(
    plan: StudyPlan,
    folders: Sequence[str | Path],
    *,
    out: str | Path,
    shard: tuple[int, int] = (1, 1),
) -> None:
    """Copy the finished cases of other folders of the same study into `out`.

    Parameters
    ----------
    plan : of all folders
    folders : the same study computed elsewhere
    out : folder to copy to
    shard : of the computation that follows, as in `run_study`

    Raises
    ------
    BadInput
        for a folder that holds another study, or that another process computes in.
    """
    _require_shard(shard)
    with open_study_folder(Path(out), plan, shard) as store:
        for folder in folders:
            store.import_parts(Path(folder))


@contextmanager
def study_executor(workers: int | None = None) -> Iterator[Executor]:
    """Provide worker processes for several studies; starting them takes seconds."""
    pool = _pool(workers or cores())
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _require_fields(fields: Sequence[str], kind: str, *, stored: bool) -> None:
    unknown = [name for name in fields if name not in FIELDS]
    if unknown:
        raise BadInput(f"fields must be among {', '.join(FIELDS)}, got {unknown[0]}")
    absent = [name for name in fields if name not in STORED_FIELDS.get(kind, ())]
    if absent:
        raise BadInput(f"a study of kind {kind!r} has no field {absent[0]}; leave it out")
    if fields and not stored:
        raise BadInput("fields need a folder to be stored in; give out")
    if any(name != RUN for name in fields):
        require_zarr()


def _require_shard(shard: tuple[int, int]) -> None:
    if not 1 <= shard[0] <= shard[1]:
        raise BadInput(f"shard must be k/N with 1 <= k <= N, got {shard[0]}/{shard[1]}")


def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, get_context("spawn"), set_up_worker)


def _require_start(pool: Executor) -> None:
    """Raise AsperityError if processes die before they receive a case."""
    try:
        pool.submit(os.getpid).result()
    except BrokenExecutor:
        raise AsperityError(
            "worker processes cannot start; a script must be a file with its calls "
            'under if __name__ == "__main__":, or give executor=ThreadPoolExecutor()'
        ) from None


class _Work:
    """Cases to compute, in batches of a suitable duration, and the results so far."""

    def __init__(
        self,
        plan: StudyPlan,
        store: StudyFolder | None,
        shard: tuple[int, int],
        retry_failed: bool,
        fields: tuple[str, ...],
        start: float,
        progress: Callable[[StudyProgress], None] | None,
    ) -> None:
        stored = {} if store is None else store.finished()
        self.plan, self.store, self.fields = plan, store, fields
        self.start, self.progress = start, progress
        self.attempts = {case_id: attempt + 1 for case_id, (_, attempt) in stored.items()}
        share = {case.id: case for case in shard_cases(plan, shard)}
        settled = {
            case_id for case_id, (status, _) in stored.items() if status == DONE or not retry_failed
        }
        self.waiting = deque(case for case in share.values() if case.id not in settled)
        self.total, self.kept = len(share), len(share) - len(self.waiting)
        self.done = self.failures = 0
        self.crashes: Counter[str] = Counter()
        self.case_s: float | None = None  # time per case on one worker
        self.rows: list[Row] = []

    def batch(self, workers: int) -> list[StudyCase]:
        """Remove and return the next cases for one worker."""
        if self.crashes[self.waiting[0].id]:  # run a suspect alone, to tell whether it is the cause
            return [self.waiting.popleft()]
        size = (
            1
            if self.case_s is None
            else math.ceil(BATCH_S / max(self.case_s, BATCH_S / LARGEST_BATCH))
        )
        # otherwise one worker finishes long after the others
        limit = math.ceil(len(self.waiting) / (2 * workers))
        following = takewhile(
            lambda case: not self.crashes[case.id], islice(self.waiting, min(size, limit))
        )
        return [self.waiting.popleft() for _ in list(following)]

    def finish(
        self,
        batch: Sequence[StudyCase],
        results: Sequence[Evaluated],
        seconds: float,
    ) -> None:
        """Store the results of a batch."""
        rows = [
            {"case_id": case.id, "attempt": self.attempts.get(case.id, 1), **result.row}
            for case, result in zip(batch, results, strict=True)
        ]
        if self.store is None:
            self.rows += rows
        else:
            self.store.write_batch(rows, results)
        mean_s = seconds / len(batch)
        self.case_s = mean_s if self.case_s is None else 0.7 * self.case_s + 0.3 * mean_s
        self.done += len(batch)
        self.failures += sum(row["status"] != DONE for row in rows)
        self.report()

    def report(self) -> None:
        """Report the progress of the study."""
        if self.progress is not None:
            seconds = time.perf_counter() - self.start
            self.progress(StudyProgress(self.total, self.kept, self.done, self.failures, seconds))

    def requeue(self, batches: Sequence[Sequence[StudyCase]], *, failed: bool) -> None:
        """Queue the cases of a crashed process again, or record them as `failed`."""
        for case in chain(*batches):
            self.crashes[case.id] += 1
            if failed:
                row = {
                    "status": FAILED,
                    "reason": "the process that computed it died: killed, or out of memory",
                }
                self.finish([case], [Evaluated(row)], 0.0)
            else:
                self.waiting.append(case)


def _compute(work: _Work, executor: Executor | None, workers: int | None) -> None:
    work.report()
    if executor is not None:
        _run_batches(work, executor, workers or _worker_count(executor))
        if work.waiting:
            raise AsperityError(
                "the executor lost its workers; finished cases are kept, "
                "run the study again to resume"
            )
        return
    count = min(workers or cores(), len(work.waiting))
    started = True
    while work.waiting:  # a pool that lost a process is broken and is replaced
        pool, before = _pool(count), work.done
        try:
            if not started:
                _require_start(pool)
            _run_batches(work, pool, count)
            started = work.done > before
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        pool.shutdown(wait=True)


def _run_batches(work: _Work, executor: Executor, workers: int) -> None:
    """Submit batches until none are left or the executor is broken."""
    pending: dict[Future[TimedBatch], list[StudyCase]] = {}
    while work.waiting or pending:
        broken = not _submit(work, executor, workers, pending)
        lost: list[list[StudyCase]] = []
        for future in wait(pending, return_when=FIRST_COMPLETED).done:
            batch = pending.pop(future)
            try:
                results, seconds = future.result()
            except (BrokenExecutor, CancelledError):
                lost.append(batch)
            except Exception as error:
                if type(error).__name__ != "KilledWorker":
                    raise AsperityError(
                        f"the executor failed ({type(error).__name__}: {error}); "
                        "finished cases are kept"
                    ) from error
                # dask has tried it on several workers
                work.requeue([batch], failed=len(batch) == 1)
            else:
                work.finish(batch, results, seconds)
        if lost or broken:
            lost += _salvage(work, pending)
            single = len(lost) == 1 and len(lost[0]) == 1
            work.requeue(lost, failed=single and work.crashes[lost[0][0].id] >= MAX_CRASHES - 1)
            return


def _submit(
    work: _Work,
    executor: Executor,
    workers: int,
    pending: dict[Future[TimedBatch], list[StudyCase]],
) -> bool:
    """Keep every worker supplied; return False if the executor is broken."""
    while work.waiting and len(pending) < BATCHES_AHEAD * workers:
        cases = (work.waiting[0], *chain(*pending.values()))
        if pending and any(work.crashes[case.id] for case in cases):
            return True  # a suspect runs alone on the executor
        batch = work.batch(workers)
        job = (work.plan.case, work.plan.kind, [case.overrides for case in batch], work.fields)
        try:
            pending[executor.submit(timed_batch, *job)] = batch
        except BrokenExecutor:
            work.waiting.extendleft(reversed(batch))
            return False
    return True


def _salvage(
    work: _Work, pending: dict[Future[TimedBatch], list[StudyCase]]
) -> list[list[StudyCase]]:
    """Store the batches that a broken executor finished; return those it did not."""
    lost = []
    for future, batch in pending.items():
        try:
            results, seconds = future.result()
        except (BrokenExecutor, CancelledError):
            lost.append(batch)
        else:
            work.finish(batch, results, seconds)
    return lost


def _worker_count(executor: Executor) -> int:
    client = getattr(executor, "_client", None)
    if client is not None:
        return max(1, int(sum(client.nthreads().values())))
    return int(getattr(executor, "_max_workers", None) or cores())


def shard_cases(plan: StudyPlan, shard: tuple[int, int]) -> list[StudyCase]:
    """Return the cases of a shard (k, n): every n-th, starting with the k-th."""
    return [case for case in plan.cases if case.number % shard[1] == shard[0] - 1]
