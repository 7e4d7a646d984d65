"""Watch of a growing table of overall values: updates, notifications, memory, failures."""

import json
from contextlib import suppress

import numpy as np
import pytest

from asperity.core.errors import AsperityError, BadInput
from asperity.monitoring import WatchSettings, watch_overalls
from asperity.monitoring.overalls import watch

LEVELS = np.exp(0.1 * np.random.default_rng(1).standard_normal(60))


class Finished(Exception):
    """End of a scripted watch."""


class Recipient:
    """A recipient that records notifications and fails as often as it is set to."""

    name = "recipient"

    def __init__(self, failures=0):
        self.failures, self.received = failures, []

    def send(self, notification):
        if self.failures:
            self.failures -= 1
            raise OSError("network is down")
        self.received.append(notification)

    @property
    def states(self):
        return [(notification["before"], notification["state"]) for notification in self.received]


def rows(path, count, factor=1.0):
    """Write the first rows of a table, those from the 40th on times a factor."""
    values = np.where(np.arange(60) < 40, 1.0, factor) * LEVELS
    lines = [f"2025-01-01T00:{number:02}:00,{values[number]:.4f}" for number in range(count)]
    path.write_text("\n".join(["time,rms [g]", *lines, ""]))


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Return a function that runs a watch with an action at each pause: updates, and its end."""
    monkeypatch.setattr(watch, "RETRY_S", 0.0)

    def start(*actions, out=tmp_path / "out", acknowledge=None, recipient=None, once=False):
        script = iter(actions)

        def pause(_):
            action = next(script, None)
            if action is None:
                raise Finished
            action()

        monkeypatch.setattr(watch, "sleep", pause)
        settings = WatchSettings(
            settle_time_s=0.0, once=once, notifiers=() if recipient is None else (recipient,)
        )
        updates = []
        with suppress(Finished):
            updates.extend(
                watch_overalls(tmp_path / "t.csv", out, settings, acknowledge=acknowledge)
            )
        return updates

    return start


def states(updates):
    return [None if update.track is None else update.track.state for update in updates]


def nothing():
    """Do nothing in a pause."""


def test_a_growing_table_is_judged_at_each_change(run, tmp_path):
    path = tmp_path / "t.csv"
    rows(path, 5)
    updates = run(lambda: rows(path, 40), nothing, lambda: rows(path, 50, 6.0), nothing)
    assert states(updates) == ["cannot-tell", "none", "alarm"]


def test_an_unreadable_table_is_stated_once_and_its_return(run, tmp_path):
    path = tmp_path / "t.csv"
    rows(path, 40)
    updates = run(
        lambda: path.write_text("time,rms [g]\n2025-01-01,1,2\n"),
        nothing,
        path.unlink,
        lambda: rows(path, 41),
    )
    assert states(updates) == ["none", None, "none"]
    (failure,), (recovery,) = updates[1].failed, updates[2].failed
    assert failure.startswith(
        "t.csv: line 2 has 3 fields, the heading 2; the last evaluation stands"
    )
    assert recovery == "t.csv can be read again"


def test_a_table_that_is_still_written_waits(tmp_path, monkeypatch):
    path = tmp_path / "t.csv"
    rows(path, 40)
    observer = watch._Watch(path, tmp_path, WatchSettings(settle_time_s=60.0), None)
    rows(path, 50, 6.0)
    observer.read()
    assert observer.track.state == "none"
    monkeypatch.setattr(watch, "time", lambda: path.stat().st_mtime + 61.0)
    observer.read()
    assert observer.track.state == "alarm"


def test_a_recipient_is_notified_once_of_a_state(run, tmp_path):
    path, recipient = tmp_path / "t.csv", Recipient()
    rows(path, 30)
    run(
        lambda: rows(path, 40),
        lambda: rows(path, 50, 6.0),
        lambda: rows(path, 55, 6.0),
        recipient=recipient,
    )
    assert recipient.states == [(None, "none"), ("none", "alarm")]
    assert recipient.received[1]["causes"] == ["level"]
    run(lambda: rows(path, 56, 6.0), recipient=recipient)  # a later watch
    assert len(recipient.received) == 2
    rows(path, 50)
    run(recipient=recipient)
    assert recipient.states[2:] == [("alarm", "none")]


def test_a_failing_recipient_is_retried(run, tmp_path):
    rows(tmp_path / "t.csv", 40)
    recipient = Recipient(failures=2)
    updates = run(nothing, nothing, nothing, recipient=recipient)
    assert recipient.states == [(None, "none")]
    assert [sentence for update in updates for sentence in update.failed] == [
        "recipient could not be notified (OSError: network is down); retrying",
        "recipient was notified",
    ]
    recipient.failures = 1  # of a watch that ends before it succeeds
    rows(tmp_path / "t.csv", 50, 6.0)
    run(recipient=recipient)
    run(recipient=recipient)
    assert recipient.states[1:] == [("none", "alarm")]


@pytest.mark.parametrize("stamp", ["last", "2025-01-01T00:49", "2025-01-01"])
def test_an_acknowledgement_is_stored(stamp, run, tmp_path):
    path = tmp_path / "t.csv"
    rows(path, 50, 6.0)
    assert states(run(acknowledge=stamp))[0] == "none"
    assert json.loads((tmp_path / "out/t.csv.json").read_text())["acknowledged"] == (
        "2025-01-01T00:49:00"
    )
    (update,) = run()
    assert update.track.acknowledged == 50
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], *lines[-3:]]))  # older rows have left the table
    assert run()[0].track.acknowledged == 3
    with pytest.raises(BadInput, match="noon is not a time stamp"):
        run(acknowledge="noon")


def test_an_acknowledged_row_without_a_date(run, tmp_path):
    lines = [f"{1000000.5 + number},1.5" for number in range(40)]
    (tmp_path / "t.csv").write_text("\n".join(["time [h],rms", *lines]))
    run(acknowledge="last")
    with (tmp_path / "t.csv").open("a") as stream:
        stream.write("\n1000041.5,1.5\n")
    assert run()[0].track.acknowledged == 40


def test_a_memory_that_cannot_be_written(run, tmp_path):
    rows(tmp_path / "t.csv", 40)
    blocked = tmp_path / "file"
    blocked.write_text("")
    recipient = Recipient()
    updates = run(nothing, blocked.unlink, nothing, out=blocked, recipient=recipient)
    failed = [sentence for update in updates for sentence in update.failed]
    assert len(failed) == 2
    assert failed[0].endswith("the watch continues without, retrying")
    assert failed[1] == "the memory of the watch is stored again"
    assert len(recipient.received) == 1
    blocked = tmp_path / "other"
    blocked.write_text("")
    with pytest.raises(AsperityError, match="other"):
        run(out=blocked, once=True)


def test_a_damaged_memory_is_replaced(run, tmp_path):
    rows(tmp_path / "t.csv", 40)
    memory = tmp_path / "out/t.csv.json"
    memory.parent.mkdir()
    for content in ("{", "[]", '{"acknowledged": 5, "known": {"recipient": 1}}'):
        memory.write_text(content)
        recipient = Recipient()
        assert states(run(recipient=recipient)) == ["none"]
        assert recipient.states == [(None, "none")]
