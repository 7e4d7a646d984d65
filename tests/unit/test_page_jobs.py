"""One job per session, the newest wins; refusals and failures return as one sentence."""

import os
import queue
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import pytest

from asperity.app import contact_jobs as work
from asperity.app.contact_jobs import JobFailure, Superseded, Ticket, run_job
from asperity.app.jobs import JobQueue, VisitPool, WorkerPool, job_outcome, wait_until_warm
from asperity.core.errors import BadInput
from asperity.paper import papers_case

SMALL = {"grid.cells": [48, 32], "surface.correlation_length": "40 um", "vibration": "none"}


class ManualWorkshop:
    """Workshop stub: jobs wait until the test runs them."""

    def __init__(self, slots=8):
        self.newest, self._free, self.submitted = [0] * slots, list(range(slots)), []

    def acquire_slot(self):
        return self._free.pop() if self._free else -1

    def release(self, slot):
        if slot >= 0:
            self.newest[slot] += 1
            self._free.append(slot)

    def submit(self, function, *arguments):
        self.submitted.append((function, arguments, Future()))
        return self.submitted[-1][2]


@pytest.mark.parametrize("running", [0, 1, 2])
def test_a_workshop_accepts_work_while_a_worker_is_idle(monkeypatch, running):
    worker_pool, futures = WorkerPool(workers=2), [Future() for _ in range(running)]
    next_future = iter(futures)
    monkeypatch.setattr(
        worker_pool, "_pool", SimpleNamespace(submit=lambda *_arguments: next(next_future))
    )
    for _ in futures:
        worker_pool.submit(str)
    assert worker_pool.has_room == (running < 2)
    for future in futures:
        future.set_result("")
    assert worker_pool.has_room


def run_immediately(function):
    function()


def test_one_job_at_a_time_and_the_newest_wins():
    workshop, results = ManualWorkshop(), []
    job_queue = JobQueue(workshop, run_immediately)
    for name in "abcd":
        job_queue.submit((str, (name,)), results.append)
    assert [arguments[1] for _, arguments, _ in workshop.submitted] == ["a"]
    workshop.submitted[0][2].set_result("a done")
    assert [arguments[1] for _, arguments, _ in workshop.submitted] == ["a", "d"]
    assert results == []  # the session no longer waits for it
    workshop.submitted[1][2].set_result("d done")
    assert results == ["d done"]
    assert not job_queue.busy


def test_a_worker_is_notified_of_cancelled_jobs():
    workshop = ManualWorkshop()
    line = JobQueue(workshop, run_immediately)
    line.submit((str, ()), print)
    ticket = workshop.submitted[0][1][0]
    assert workshop.newest[ticket.slot] == ticket.number
    line.submit((str, ()), print)
    assert workshop.newest[ticket.slot] > ticket.number


def test_a_closed_session_frees_its_slot_and_receives_nothing_more():
    workshop, results = ManualWorkshop(slots=1), []
    line = JobQueue(workshop, run_immediately)
    line.submit((str, ()), results.append)
    ticket = workshop.submitted[0][1][0]
    line.close()
    assert workshop.newest[ticket.slot] > ticket.number
    workshop.submitted[0][2].set_result("late")
    line.submit((str, ()), results.append)
    assert results == []
    assert len(workshop.submitted) == 1
    assert JobQueue(workshop, run_immediately)._slot == 0


def test_the_jobs_of_a_visit_wait_until_its_browser_is_connected():
    workshop, results = ManualWorkshop(), []
    workshop.submit_solve, workshop.when_warm = workshop.submit, run_immediately
    visit = VisitPool(workshop)
    queues = [JobQueue(visit, run_immediately, solves=solves) for solves in (False, True)]
    for line in queues:
        line.submit((str, ()), results.append)
    assert workshop.submitted == []
    assert all(line.busy for line in queues)
    visit.connect()
    assert len(workshop.submitted) == 2
    workshop.submitted[0][2].set_result("a")
    workshop.submitted[1][2].set_exception(ValueError())
    assert results[0] == "a"
    queues[0].submit((str, ()), results.append)
    assert len(workshop.submitted) == 3


def test_without_a_free_slot_jobs_still_run():
    workshop = ManualWorkshop(slots=0)
    JobQueue(workshop, run_immediately).submit((str, ()), print)
    assert workshop.submitted[0][1][0].slot == -1


def test_a_result_may_request_another_job():
    workshop, results = ManualWorkshop(), []
    line = JobQueue(workshop, run_immediately)
    line.submit(
        (str, ("a",)),
        lambda result: (results.append(result), line.submit((str, ("b",)), results.append)),
    )
    workshop.submitted[0][2].set_result(1)
    workshop.submitted[1][2].set_result(2)
    assert results == [1, 2]


def test_a_failure_is_reported_in_one_sentence(caplog):
    failed: Future = Future()
    failed.set_exception(ZeroDivisionError("inside"))
    assert "Internal error" in job_outcome(failed).message
    assert "inside" in caplog.text
    failing: Future = Future()
    failing.set_exception(BrokenProcessPool())
    assert "A worker process died" in job_outcome(failing).message


def refuse():
    raise BadInput("contact.load must be a force")


def test_a_refusal_returns_as_one_sentence():
    assert run_job(refuse) == JobFailure("contact.load must be a force.")


def test_a_solve_without_a_waiting_session_stops(monkeypatch):
    monkeypatch.setattr(work, "_newest", [5])
    case = papers_case().with_overrides(SMALL)
    assert isinstance(run_job(work.solve_fully, Ticket(0, 4), case), Superseded)
    assert run_job(work.solve_fully, Ticket(0, 5), case).converged
    assert run_job(work.solve_fully, Ticket(-1, 4), case).converged


def test_a_solve_stops_at_its_time_limit(monkeypatch):
    monkeypatch.setattr(work, "TIME_LIMIT_S", -1.0)
    case = papers_case().with_overrides(SMALL)
    assert "No solution within" in run_job(work.solve_fully, Ticket(-1, 0), case).message


def test_chosen_grids_beyond_the_pages_limit_are_refused(monkeypatch):
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
    results: queue.Queue = queue.Queue()
    line = JobQueue(worker_pool, results.put)
    answers = []
    line.submit((work.solve_fully, (papers_case().with_overrides(SMALL),)), answers.append)
    results.get(timeout=60)()
    assert answers[0].converged
    assert answers[0].gap.shape == (48, 32)
    line.close()


def test_a_worker_that_dies_is_replaced(worker_pool):
    with pytest.raises(BrokenProcessPool):
        worker_pool.submit(os._exit, 1).result(timeout=60)
    assert worker_pool.submit(refuse).result(timeout=120) == JobFailure(
        "contact.load must be a force."
    )
