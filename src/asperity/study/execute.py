"""A study computed: batches of cases over processes or machines, any `concurrent.futures` executor, kept as they end.

Nothing here depends on how cases are spread: each is solved from nothing, with its own seeds, so
that a resumed, sharded or distributed study gives what an unbroken one gives.
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
from typing import Any

import pandas

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, require_positive
from asperity.core.files import versions
from asperity.core.processes import cores, set_up_worker
from asperity.core.storage import MANIFEST
from asperity.study.evaluate import DONE, FAILED, FIELDS, Row, timed_batch
from asperity.study.maps import require_zarr
from asperity.study.plan import StudyCase, StudyPlan
from asperity.study.store import (
    Store,
    in_order,
    manifest_of,
    open_kept,
    open_read,
    open_store,
    table_of,
)

BATCH_S = 2.0  # work in a batch: long beside the cost of handing it over, short enough to lose
LARGEST_BATCH = 200
BATCHES_AHEAD = 2  # a worker; more would only be lost in a crash
MOST_DEATHS = 3  # of the processes that computed one case, the last of them with nothing beside it
DASK_WAIT_S = 10.0
PROCESS_S = 2.0  # until a worker process is there, with its libraries


@dataclass(frozen=True)
class StudyProgress:
    """How far a study is: `kept` were finished before, `rate` counts cases a second since."""

    total: int
    kept: int
    done: int
    failed: int
    seconds: float

    @property
    def rate(self) -> float:
        """Cases a second."""
        return self.done / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Time left at the rate so far; None before the first case."""
        return (self.total - self.kept - self.done) / self.rate if self.done else None


@dataclass(frozen=True)
class StudyResult:
    """A study: its plan, and a row for every finished case, in the plan's order."""

    plan: StudyPlan
    table: pandas.DataFrame
    folder: Path | None = None
    path: Path | None = None  # of the merged table
    seconds: float = 0.0
    computed: int = 0  # now; the other rows were kept from before

    @property
    def failures(self) -> pandas.DataFrame:
        """The rows that must not be used, each with its reason."""
        rows: pandas.DataFrame = self.table[self.table["status"] != DONE]
        return rows

    @property
    def failed(self) -> int:
        """How many cases failed or did not converge."""
        return len(self.failures)

    @property
    def missing(self) -> int:
        """Cases of the plan that nobody has computed yet."""
        return len(self.plan.cases) - len(self.table)

    @property
    def versions(self) -> dict[str, str]:
        """Of asperity and what it stands on, when the folder was begun; in memory, those of now."""
        return versions() if self.folder is None else dict(manifest_of(self.folder)["versions"])

    def maps(self, case_id: str) -> dict[str, Field]:
        """The maps that `fields` asked for of a case, each (nx, ny) in SI.

        Raises
        ------
        UnreadableFile
            where none are kept, or they are damaged.
        BadInput
            for a case of another study, or a study in memory.
        """
        if self.folder is None:
            raise BadInput("maps are kept in a study's folder, and this study has none; give out")
        if case_id not in self.table["case_id"].to_numpy():
            raise BadInput(
                f"the study has no finished case {case_id!r}; take one of the column case_id"
            )
        return open_kept(self.folder).maps(case_id)


def run_study(
    plan: StudyPlan,
    *,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    shard: tuple[int, int] = (1, 1),
    retry_failed: bool = False,
    fields: Sequence[str] = (),
    merge_from: Sequence[str | Path] = (),
    progress: Callable[[StudyProgress], None] | None = None,
) -> StudyResult:
    """Compute what is missing of a study.

    Parameters
    ----------
    plan : from `plan_study` or `plan_points`
    out : folder to keep it in, and to go on from; None: in memory
    executor : anything of `concurrent.futures`, with asperity importable where it runs; by default processes of its own
    workers : processes, by default as many as there are processors
    shard : (k, n), compute only every n-th case, beginning with the k-th
    retry_failed : compute failed cases again
    fields : maps to keep beside the rows, of FIELDS; needs `out`
    merge_from : folders of the same study computed elsewhere, whose cases are taken over
    progress : called after every batch

    Raises
    ------
    BadInput
        for a folder, shard, worker count or field that cannot be used.
    AsperityError
        if results cannot be written, or the executor is lost; finished cases are kept.
    """
    if not 1 <= shard[0] <= shard[1]:
        raise BadInput(f"shard must be k/N with 1 <= k <= N, got {shard[0]}/{shard[1]}")
    if workers is not None:
        require_positive("workers", workers)
    unknown = [name for name in fields if name not in FIELDS]
    if unknown:
        raise BadInput(f"fields must be among {', '.join(FIELDS)}, got {unknown[0]}")
    if (fields or merge_from) and out is None:
        raise BadInput("fields and merged folders need a folder to be kept in; give out")
    if fields:
        require_zarr()
    begun = time.perf_counter()
    with nullcontext() if out is None else open_store(Path(out), plan, shard) as store:
        for other in merge_from:
            assert store is not None
            store.take_from(Path(other))
        work = _Work(plan, store, shard, retry_failed, tuple(fields), begun, progress)
        if work.waiting:
            _compute(work, executor, workers)
        seconds = time.perf_counter() - begun
        if store is None:
            table = in_order([table_of(work.rows)] if work.rows else [], plan)
            return StudyResult(plan, table, seconds=seconds, computed=work.done)
        path = store.merge()
        return StudyResult(plan, store.table(), store.folder, path, seconds, work.done)


def load_study(folder: str | Path) -> StudyResult:
    """Read what a study's folder holds, finished or not.

    Raises
    ------
    UnreadableFile
        if the folder holds no study, or something in it is damaged.
    """
    store = open_kept(Path(folder))
    return StudyResult(store.plan, store.table(), store.folder, store.merged)


@contextmanager
def study_executor(workers: int | None = None) -> Iterator[Executor]:
    """Processes for several studies in a row: starting them takes seconds."""
    pool = _pool(workers or cores())
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """The workers of a dask scheduler, such as tcp://10.0.0.1:8786.

    Raises
    ------
    BadInput
        if dask.distributed is not installed, or nobody answers at the address.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise BadInput(
            "a dask executor needs dask.distributed; pip install 'asperity[study]'"
        ) from None
    try:
        client: Any = Client(address, timeout=DASK_WAIT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError) as error:
        raise BadInput(
            f"no dask scheduler answers at {address} ({type(error).__name__}); check the address"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=DASK_WAIT_S)
        except TimeoutError:
            raise BadInput(
                f"the dask scheduler at {address} has no workers; start some with dask worker"
            ) from None
        yield client.get_executor(pure=False)


def _pool(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, get_context("spawn"), set_up_worker)


def _require_start(pool: Executor) -> None:
    """AsperityError where processes die before they are given a case: then no case is to blame."""
    try:
        pool.submit(os.getpid).result()
    except BrokenExecutor:
        raise AsperityError(
            "worker processes cannot start, nothing was computed by them; a script needs to be a file with its calls "
            'under if __name__ == "__main__":, or give executor=ThreadPoolExecutor()'
        ) from None


class _Work:
    """What is still to be computed, in batches that suit its pace, and what has been."""

    def __init__(
        self,
        plan: StudyPlan,
        store: Store | None,
        shard: tuple[int, int],
        retry_failed: bool,
        fields: tuple[str, ...],
        begun: float,
        progress: Callable[[StudyProgress], None] | None,
    ) -> None:
        known = {} if store is None else store.finished()
        self.plan, self.store, self.fields, self.begun, self.progress = (
            plan,
            store,
            fields,
            begun,
            progress,
        )
        self.attempts = {case_id: attempt + 1 for case_id, (_, attempt) in known.items()}
        share = {case.id: case for case in _share(plan, shard)}
        kept = {
            case_id for case_id, (status, _) in known.items() if status == DONE or not retry_failed
        }
        self.waiting = deque(case for case in share.values() if case.id not in kept)
        self.total, self.kept = len(share), len(share) - len(self.waiting)
        self.done = self.failures = 0
        self.deaths: Counter[str] = Counter()
        self.case_s: float | None = None  # a worker takes for a case
        self.rows: list[Row] = []

    def batch(self, workers: int) -> list[StudyCase]:
        """The next cases to hand to one worker."""
        if self.deaths[
            self.waiting[0].id
        ]:  # a process died over it: on its own, it shows whose fault that was
            return [self.waiting.popleft()]
        size = (
            1
            if self.case_s is None
            else math.ceil(BATCH_S / max(self.case_s, BATCH_S / LARGEST_BATCH))
        )
        fair = math.ceil(
            len(self.waiting) / (2 * workers)
        )  # or one worker ends long after the others
        next_ones = takewhile(
            lambda case: not self.deaths[case.id], islice(self.waiting, min(size, fair))
        )
        return [self.waiting.popleft() for _ in list(next_ones)]

    def finish(
        self,
        batch: Sequence[StudyCase],
        results: Sequence[tuple[Row, dict[str, Field]]],
        seconds: float,
    ) -> None:
        """Keep what a worker brings back."""
        rows, fields = [], {}
        for case, (row, maps) in zip(batch, results, strict=True):
            rows.append({"case_id": case.id, "attempt": self.attempts.get(case.id, 1), **row})
            fields[case.id] = maps
        if self.store is None:
            self.rows += rows
        else:
            self.store.keep(rows, fields)
        pace = seconds / len(batch)
        self.case_s = pace if self.case_s is None else 0.7 * self.case_s + 0.3 * pace
        self.done += len(batch)
        self.failures += sum(row["status"] != DONE for row in rows)
        self.tell()

    def tell(self) -> None:
        """Report how far the study is."""
        if self.progress is not None:
            seconds = time.perf_counter() - self.begun
            self.progress(StudyProgress(self.total, self.kept, self.done, self.failures, seconds))

    def bury(self, batches: Sequence[Sequence[StudyCase]], *, certain: bool) -> None:
        """Take back the cases whose process died; where it is `certain` that one killed it, that case has failed."""
        for case in chain(*batches):
            self.deaths[case.id] += 1
            if certain:
                row = {
                    "status": FAILED,
                    "reason": "the process that computed it died: killed, or out of memory",
                }
                self.finish([case], [(row, {})], 0.0)
            else:
                self.waiting.append(case)


def _compute(work: _Work, executor: Executor | None, workers: int | None) -> None:
    work.tell()
    if executor is not None:
        _spread(work, executor, workers or _workers_of(executor))
        if work.waiting:
            raise AsperityError(
                "the executor lost its workers; finished cases are kept, run the study again to go on"
            )
        return
    count = min(workers or cores(), len(work.waiting))
    started = True
    while work.waiting:  # a pool that lost a process is broken, and another takes over
        pool, before = _pool(count), work.done
        try:
            if not started:
                _require_start(pool)
            _spread(work, pool, count)
            started = work.done > before
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
        pool.shutdown(wait=True)


def _spread(work: _Work, executor: Executor, workers: int) -> None:
    """Hand out batches until none are left, or the executor is broken."""
    pending: dict[Future[Any], list[StudyCase]] = {}
    while work.waiting or pending:
        broken = not _hand_out(work, executor, workers, pending)
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
                        f"the executor failed ({type(error).__name__}: {error}); finished cases are kept"
                    ) from error
                work.bury([batch], certain=len(batch) == 1)  # dask has tried it on several workers
            else:
                work.finish(batch, results, seconds)
        if lost or broken:
            lost += _salvaged(work, pending)
            only = len(lost) == 1 and len(lost[0]) == 1
            work.bury(lost, certain=only and work.deaths[lost[0][0].id] >= MOST_DEATHS - 1)
            return


def _hand_out(
    work: _Work, executor: Executor, workers: int, pending: dict[Future[Any], list[StudyCase]]
) -> bool:
    """Keep every worker supplied; False if the executor takes nothing any more."""
    while work.waiting and len(pending) < BATCHES_AHEAD * workers:
        cases = (work.waiting[0], *chain(*pending.values()))
        if pending and any(work.deaths[case.id] for case in cases):
            return True  # a case that may have killed its process has the executor to itself
        batch = work.batch(workers)
        job = (work.plan.case, work.plan.kind, [case.overrides for case in batch], work.fields)
        try:
            pending[executor.submit(timed_batch, *job)] = batch
        except BrokenExecutor:
            work.waiting.extendleft(reversed(batch))
            return False
    return True


def _salvaged(work: _Work, pending: dict[Future[Any], list[StudyCase]]) -> list[list[StudyCase]]:
    """Keep what a broken executor finished after all; the batches that it did not."""
    lost = []
    for future, batch in pending.items():
        try:
            results, seconds = future.result()
        except (BrokenExecutor, CancelledError):
            lost.append(batch)
        else:
            work.finish(batch, results, seconds)
    return lost


def _workers_of(executor: Executor) -> int:
    client = getattr(executor, "_client", None)
    if client is not None:
        return max(1, int(sum(client.nthreads().values())))
    return int(getattr(executor, "_max_workers", None) or cores())


@dataclass(frozen=True)
class StudyCost:
    """What a study will cost, from a few of its cases computed and thrown away."""

    cases: int  # of this shard
    kept: int
    case_s: float  # one worker, mean of those tried
    tried: int
    workers: int
    start_s: float = 0.0  # until a worker has loaded and compiled

    @property
    def seconds(self) -> float:
        """Wall-clock time that is left; workers start beside one another, on as many processors as there are."""
        left = self.cases - self.kept
        at_once = max(1, min(self.workers, cores(), left))
        return left * self.case_s / at_once + (self.start_s if left else 0.0)


def estimate_study(
    plan: StudyPlan,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    shard: tuple[int, int] = (1, 1),
) -> StudyCost:
    """Time three cases of a study, from its beginning, middle and end; nothing is kept.

    Raises
    ------
    BadInput
        for a folder that holds another study.
    """
    known = (
        open_read(Path(out), plan).finished()
        if out is not None and (Path(out) / MANIFEST).exists()
        else {}
    )
    share = _share(plan, shard)
    if not share:
        return StudyCost(0, 0, 0.0, 0, workers or cores())
    chosen = [share[round(part * (len(share) - 1))].overrides for part in (0.0, 0.5, 1.0)]
    _, first = timed_batch(plan.case, plan.kind, [chosen[1]])  # loads and compiles
    _, seconds = timed_batch(plan.case, plan.kind, chosen)
    kept = sum(case.id in known for case in share)
    case_s = seconds / len(chosen)
    start_s = PROCESS_S + max(0.0, first - case_s)
    return StudyCost(len(share), kept, case_s, len(chosen), workers or cores(), start_s)


def _share(plan: StudyPlan, shard: tuple[int, int]) -> list[StudyCase]:
    return [case for case in plan.cases if case.number % shard[1] == shard[0] - 1]
