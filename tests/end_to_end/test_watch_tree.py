"""`asperity watch` of a tree: every subfolder is a measuring point, in one store and process."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.monitoring import WatchSettings, watch_tree
from asperity.monitoring.fleet import tree_watch

ONCE = ("--once", "--settle", "0")
WATCHING = WatchSettings(poll_interval_s=0.0, settle_time_s=0.0)


def snapshots(folder, levels, first=0):
    """Write noise without a contact resonance, in recordings of 0.1 s."""
    Path(folder).mkdir(exist_ok=True, parents=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(2000)
        np.savez(Path(folder) / f"s-{number:03}.npz", acc=values, fs=20e3, unit="m/s^2")


def failing():
    """Return constant levels followed by a rise to twenty times that level."""
    return np.concatenate([np.ones(12), np.exp(np.log(20.0) * np.arange(24) / 23)])


def query_store(query, store="plant/asperity-watch/asperity.db"):
    with closing(sqlite3.connect(store)) as connection:
        return connection.execute(query).fetchall()


@pytest.fixture
def plant(tmp_path, monkeypatch):
    """Return a tree of three measuring points on two machines."""
    monkeypatch.chdir(tmp_path)
    snapshots("plant/fan 1/DE", np.ones(9))
    snapshots("plant/pump/stage 2/NDE", failing())
    snapshots("plant/pump", np.ones(9))
    Path("plant/.hidden").mkdir()
    snapshots("plant/.hidden", np.ones(1))
    return tmp_path / "plant"


COUNTS = (
    "SELECT machine.name, point.name, count(*) FROM recording JOIN sensor ON sensor.id = sensor "
    "JOIN point ON point.id = point JOIN machine ON machine.id = machine GROUP BY 1, 2"
)
STORED = [("fan 1", "DE", 9), ("pump", "point", 9), ("pump", "stage 2/NDE", 36)]


def test_each_subfolder_is_a_measuring_point_of_one_store(asp, plant):
    assert plant
    code, out, err = asp("watch", "plant", *ONCE)
    assert (code, err) == (3, "")
    lines = out.splitlines()
    assert len(lines) == 3
    assert lines[0].startswith("fan 1/DE: No alarm")
    assert lines[2].startswith("pump/stage 2/NDE: ALARM since s-")
    assert query_store(COUNTS) == STORED
    assert Path("plant/asperity-watch/pump/stage 2/NDE/report.html").is_file()
    code, out, _ = asp("watch", "plant", *ONCE, "--json")
    updates = [json.loads(line) for line in out.splitlines()]
    assert (code, [update["place"] for update in updates]) == (
        3,
        ["fan 1/DE", "pump/point", "pump/stage 2/NDE"],
    )
    assert [update["new"] for update in updates] == [[], [], []]


def test_recordings_in_the_folder_itself_are_watched_alone_unless_a_tree_is_requested(asp, plant):
    snapshots(plant, np.ones(2))
    asp("watch", "plant", *ONCE, "--out", "alone")
    assert len(query_store(COUNTS, "alone/asperity.db")) == 1
    asp("watch", "plant", *ONCE, "--tree", "--out", "plant/results")
    assert query_store(COUNTS, "plant/results/asperity.db") == [
        *STORED[:1],
        ("plant", "point", 2),
        *STORED[1:],
    ]


def test_a_failing_place_does_not_stop_the_others(asp, plant, monkeypatch):
    original = tree_watch.FolderWatch.check

    def check(self):
        if self.folder == plant / "fan 1" / "DE":
            raise ValueError("broken")
        return original(self)

    monkeypatch.setattr(tree_watch.FolderWatch, "check", check)
    code, out, err = asp("watch", "plant", *ONCE)
    assert code == 1
    assert "1 of 3 places could not be evaluated" in err
    assert [line.partition(":")[0] for line in out.splitlines()] == [
        "pump/point",
        "pump/stage 2/NDE",
    ]
    updates = watch_tree(plant, plant.parent / "out", watching=WATCHING)
    first = [next(updates) for _ in range(3)]
    assert first[0].failed == (
        "fan 1/DE failed (ValueError: broken); the watch continues and retries",
    )
    assert [update.place for update in first[1:]] == ["pump/point", "pump/stage 2/NDE"]
    monkeypatch.setattr(tree_watch.FolderWatch, "check", original)
    update = next(updates)
    assert (update.place, update.failed) == ("fan 1/DE", ("fan 1/DE is checked again",))
    updates.close()


def test_a_folder_that_appears_is_watched(plant, monkeypatch):
    monkeypatch.setattr(tree_watch, "SEARCH_S", 0.0)
    updates = watch_tree(plant, plant.parent / "out", watching=WATCHING)
    assert [next(updates).place for _ in range(3)][-1] == "pump/stage 2/NDE"
    snapshots("plant/new/DE", np.ones(2))
    assert next(updates).place == "new/DE"
    updates.close()


@pytest.mark.parametrize("memory", [0, tree_watch.CACHE_BYTES])
def test_spectra_released_from_memory_are_read_from_the_store(plant, monkeypatch, memory):
    monkeypatch.setattr(tree_watch, "CACHE_BYTES", memory)
    updates = watch_tree(plant, plant.parent / "out", watching=WATCHING)
    first = [next(updates) for _ in range(3)]
    snapshots("plant/fan 1/DE", [1.0], first=9)
    snapshots("plant/pump/stage 2/NDE", [20.0], first=36)
    later = [next(updates) for _ in range(2)]
    assert [len(update.track.recordings) for update in later] == [10, 37]
    assert later[1].track.alarm.since == first[2].track.alarm.since
    updates.close()


def test_a_full_disk_is_stated_once_for_all_places(plant, disk):
    updates = watch_tree(plant, plant.parent / "out", watching=WATCHING)
    assert len([next(updates) for _ in range(3)]) == 3
    disk.full = True
    for place in ("fan 1/DE", "pump/stage 2/NDE"):
        snapshots(f"plant/{place}", [20.0], first=40)
    later = [next(updates) for _ in range(2)]
    assert [len(update.new) for update in later] == [1, 1]
    assert sum(len(update.failed) for update in later) == 1
    disk.full = False
    later = [next(updates) for _ in range(2)]
    assert [sentence.partition("asperity.db ")[2] for sentence in later[0].failed] == [
        "is written again; nothing was lost"
    ]
    updates.close()
    assert [count for _, _, count in query_store(COUNTS, "out/asperity.db")] == [10, 9, 37]


def test_names_of_machine_and_point_are_refused_in_a_tree(plant):
    with pytest.raises(BadInput, match="folders name machine and point in a tree, got Fan"):
        watch_tree(plant, plant.parent / "out", watching=WatchSettings(machine="Fan"))
