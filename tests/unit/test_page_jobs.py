"""One piece of work in flight a session, the newest wins; what is refused or fails comes back as a sentence."""

import os
import queue
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import pytest

from asperity.app import contact_jobs as work
from asperity.app.contact_jobs import Refused, Superseded, Ticket, told
from asperity.app.jobs import Queue, Workshop, outcome, wait_until_warm
from asperity.core.errors import BadInput
from asperity.paper import papers_case

SMALL = {"grid.cells": [48, 32], "surface.correlation_length": "40 um", "vibration": "none"}


class Bench:
    """Stands in for a workshop: work waits until it is told to be done."""

    def __init__(self, slots=8):
        self.newest, self._free, self.begun = [0] * slots, list(range(slots)), []

    def slot(self):
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
    workshop, futures = Workshop(workers=2), [Future() for _ in range(running)]
    waiting = iter(futures)
    monkeypatch.setattr(
        workshop, "_pool", SimpleNamespace(submit=lambda *_arguments: next(waiting))
    )
    for _ in futures:
        workshop.submit(str)
    assert workshop.has_room == (running < 2)
    for future in futures:
        future.set_result("")
    assert workshop.has_room


def at_once(function):
    function()


def test_one_piece_of_work_at_a_time_and_the_newest_wins():
    bench, came = Bench(), []
    line = Queue(bench, at_once)
    for wish in "abcd":
        line.ask((str, (wish,)), came.append)
    assert [arguments[1] for _, arguments, _ in bench.begun] == ["a"]
    bench.begun[0][2].set_result("a done")
    assert [arguments[1] for _, arguments, _ in bench.begun] == ["a", "d"]
    assert came == []  # nobody waits for it any more
    bench.begun[1][2].set_result("d done")
    assert came == ["d done"]
    assert not line.busy


def test_a_worker_is_told_what_is_wanted_no_more():
    bench = Bench()
    line = Queue(bench, at_once)
    line.ask((str, ()), print)
    ticket = bench.begun[0][1][0]
    assert bench.newest[ticket.slot] == ticket.number
    line.ask((str, ()), print)
    assert bench.newest[ticket.slot] > ticket.number


def test_a_session_that_closes_gives_its_place_back_and_hears_nothing_more():
    bench, came = Bench(slots=1), []
    line = Queue(bench, at_once)
    line.ask((str, ()), came.append)
    ticket = bench.begun[0][1][0]
    line.close()
    assert bench.newest[ticket.slot] > ticket.number
    bench.begun[0][2].set_result("late")
    line.ask((str, ()), came.append)
    assert came == []
    assert len(bench.begun) == 1
    assert Queue(bench, at_once)._slot == 0


def test_without_a_free_place_work_is_done_all_the_same():
    bench = Bench(slots=0)
    Queue(bench, at_once).ask((str, ()), print)
    assert bench.begun[0][1][0].slot == -1


def test_what_arrives_may_ask_for_more():
    bench, came = Bench(), []
    line = Queue(bench, at_once)
    line.ask(
        (str, ("a",)), lambda result: (came.append(result), line.ask((str, ("b",)), came.append))
    )
    bench.begun[0][2].set_result(1)
    bench.begun[1][2].set_result(2)
    assert came == [1, 2]


def test_what_fails_is_a_sentence(caplog):
    failed: Future = Future()
    failed.set_exception(ZeroDivisionError("inside"))
    assert "a mistake of ours" in outcome(failed).sentence
    assert "inside" in caplog.text
    died: Future = Future()
    died.set_exception(BrokenProcessPool())
    assert "A worker process died" in outcome(died).sentence


def refuse():
    raise BadInput("contact.load must be a force")


def test_what_is_refused_travels_as_a_sentence():
    assert told(refuse) == Refused("contact.load must be a force.")


def test_a_solve_stops_where_nobody_waits(monkeypatch):
    monkeypatch.setattr(work, "_newest", [5])
    case = papers_case().with_overrides(SMALL)
    assert isinstance(told(work.solve_fully, Ticket(0, 4), case), Superseded)
    assert told(work.solve_fully, Ticket(0, 5), case).converged
    assert told(work.solve_fully, Ticket(-1, 4), case).converged


def test_a_solve_is_given_up_after_its_time(monkeypatch):
    monkeypatch.setattr(work, "LONGEST_S", -1.0)
    case = papers_case().with_overrides(SMALL)
    assert "given up" in told(work.solve_fully, Ticket(-1, 0), case).sentence


def test_more_cells_than_the_page_solves_are_refused_where_the_case_chooses_them(monkeypatch):
    monkeypatch.setattr("asperity.app.settings.MOST_CELLS", 100)
    case = papers_case().with_overrides({**SMALL, "grid.cells": "auto"})
    assert "at most 100 in all" in told(work.solve_fully, Ticket(-1, 0), case).sentence


@pytest.fixture(scope="module")
def workshop():
    made = Workshop(1)
    made.warm()
    yield made
    made.close()


def test_processes_warm_up_and_solve(workshop):
    assert wait_until_warm(workshop, 120.0)
    came: queue.Queue = queue.Queue()
    line = Queue(workshop, came.put)
    answers = []
    line.ask((work.solve_fully, (papers_case().with_overrides(SMALL),)), answers.append)
    came.get(timeout=60)()
    assert answers[0].converged
    assert answers[0].gap.shape == (48, 32)
    line.close()


def test_a_worker_that_dies_is_replaced(workshop):
    with pytest.raises(BrokenProcessPool):
        workshop.submit(os._exit, 1).result(timeout=60)
    assert workshop.submit(refuse).result(timeout=120) == Refused("contact.load must be a force.")
