"""One piece of work in flight a session, the newest wins; what is refused or fails comes back as a
sentence.
"""

import os
import queue
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import pytest

from asperity.app import contact_jobs as work
from asperity.app.contact_jobs import JobFailure, Superseded, Ticket, run_job
from asperity.app.jobs import JobQueue, WorkerPool, job_outcome, wait_until_warm
from asperity.core.errors import BadInput
from asperity.paper import papers_case

SMALL = {"grid.cells": [48, 32], "surface.correlation_length": "40 um", "vibration": "none"}


class Bench:
    """Stands in for a workshop: work waits until it is told to be done."""

    def __init__(self, slots=8):
        self.newest, self._free, self.begun = [0] * slots, list(range(slots)), []

    def acquire_slot(self):
        return self._free.pop() if self._free else -1

    def release(self, slot):
        if slot >= 0:
            self.newest[slot] += 1
            self._free.append(slot)

    def submit(self, function, *arguments):
        self.begun.append((function, arguments, Future()))
        return self.begun[-1][2]


@pytest.mark.parametrize("running", [0, 1, 2])
def test_a_workshop_has_room_while_a_worker_has_nothing_to_do(monkeypatch, running):
    worker_pool, futures = WorkerPool(workers=2), [Future() for _ in range(running)]
    waiting = iter(futures)
    monkeypatch.setattr(
        worker_pool, "_pool", SimpleNamespace(submit=lambda *_arguments: next(waiting))
    )
    for _ in futures:
        worker_pool.submit(str)
    assert worker_pool.has_room == (running < 2)
    for future in futures:
        future.set_result("")
    assert worker_pool.has_room


def at_once(function):
    function()


def test_one_piece_of_work_at_a_time_and_the_newest_wins():
    bench, came = Bench(), []
    line = JobQueue(bench, at_once)
    for wish in "abcd":
        line.submit((str, (wish,)), came.append)
    assert [arguments[1] for _, arguments, _ in bench.begun] == ["a"]
    bench.begun[0][2].set_result("a done")
    assert [arguments[1] for _, arguments, _ in bench.begun] == ["a", "d"]
    assert came == []  # nobody waits for it any more
    bench.begun[1][2].set_result("d done")
    assert came == ["d done"]
    assert not line.busy


def test_a_worker_is_told_what_is_wanted_no_more():
    bench = Bench()
    line = JobQueue(bench, at_once)
    line.submit((str, ()), print)
    ticket = bench.begun[0][1][0]
    assert bench.newest[ticket.slot] == ticket.number
    line.submit((str, ()), print)
    assert bench.newest[ticket.slot] > ticket.number


def test_a_session_that_closes_gives_its_place_back_and_hears_nothing_more():
    bench, came = Bench(slots=1), []
    line = JobQueue(bench, at_once)
    line.submit((str, ()), came.append)
    ticket = bench.begun[0][1][0]
    line.close()
    assert bench.newest[ticket.slot] > ticket.number
    bench.begun[0][2].set_result("late")
    line.submit((str, ()), came.append)
    assert came == []
    assert len(bench.begun) == 1
    assert JobQueue(bench, at_once)._slot == 0


def test_without_a_free_place_work_is_done_all_the_same():
    bench = Bench(slots=0)
    JobQueue(bench, at_once).submit((str, ()), print)
    assert bench.begun[0][1][0].slot == -1


def test_what_arrives_may_ask_for_more():
    bench, came = Bench(), []
    line = JobQueue(bench, at_once)
    line.submit(
        (str, ("a",)), lambda result: (came.append(result), line.submit((str, ("b",)), came.append))
    )
    bench.begun[0][2].set_result(1)
    bench.begun[1][2].set_result(2)
    assert came == [1, 2]


def test_what_fails_is_a_sentence(caplog):
    failed: Future = Future()
    failed.set_exception(ZeroDivisionError("inside"))
    assert "Internal error" in job_outcome(failed).message
    assert "inside" in caplog.text
    died: Future = Future()
    died.set_exception(BrokenProcessPool())
    assert "A worker process died" in job_outcome(died).message


def refuse():
    raise BadInput("contact.load must be a force")


def test_what_is_refused_travels_as_a_sentence():
    assert run_job(refuse) == JobFailure("contact.load must be a force.")


def test_a_solve_stops_where_nobody_waits(monkeypatch):
    monkeypatch.setattr(work, "_newest", [5])
    case = papers_case().with_overrides(SMALL)
    assert isinstance(run_job(work.solve_fully, Ticket(0, 4), case), Superseded)
    assert run_job(work.solve_fully, Ticket(0, 5), case).converged
    assert run_job(work.solve_fully, Ticket(-1, 4), case).converged


def test_a_solve_is_given_up_after_its_time(monkeypatch):
    monkeypatch.setattr(work, "TIME_LIMIT_S", -1.0)
    case = papers_case().with_overrides(SMALL)
    assert "No solution within" in run_job(work.solve_fully, Ticket(-1, 0), case).message


def test_more_cells_than_the_page_solves_are_refused_where_the_case_chooses_them(monkeypatch):
    monkeypatch.setattr("asperity.app.settings.MAX_CELLS", 100)
    case = papers_case().with_overrides({**SMALL, "grid.cells": "auto"})
    assert "at most 100 in all" in run_job(work.solve_fully, Ticket(-1, 0), case).message


@pytest.fixture(scope="module")
def worker_pool():
    plot = WorkerPool(1)
    plot.warm_up()
    yield plot
    plot.close()


def test_processes_warm_up_and_solve(worker_pool):
    assert wait_until_warm(worker_pool, 120.0)
    came: queue.Queue = queue.Queue()
    line = JobQueue(worker_pool, came.put)
    answers = []
    line.submit((work.solve_fully, (papers_case().with_overrides(SMALL),)), answers.append)
    came.get(timeout=60)()
    assert answers[0].converged
    assert answers[0].gap.shape == (48, 32)
    line.close()


def test_a_worker_that_dies_is_replaced(worker_pool):
    with pytest.raises(BrokenProcessPool):
        worker_pool.submit(os._exit, 1).result(timeout=60)
    assert worker_pool.submit(refuse).result(timeout=120) == JobFailure(
        "contact.load must be a force."
    )
