"""Readers in a process of their own: what becomes of them there is a sentence, and the next read
works.
"""

import ctypes
import os
import time

import numpy as np
import pytest

from asperity.core import sandbox as apart
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.sandbox import read_in_subprocess


def reads(path, factor):
    return path.name, factor * np.arange(3.0)


def refuses(path):
    raise BadInput(f"{path.name} has no unit")


def stumbles(path):
    raise ZeroDivisionError(f"{path.name}\nsecond line")


def crashes(path):  # noqa: ARG001
    ctypes.string_at(0)


def ends(path):  # noqa: ARG001
    os._exit(0)


def hangs(path):  # noqa: ARG001
    time.sleep(60)


def turns(path):  # noqa: ARG001
    while True:
        pass


def swells(path):  # noqa: ARG001
    return np.ones(10**8).sum()


def prints(path):
    os.system("echo noise; echo noise >&2")
    return path.name


def misses(path):  # noqa: ARG001
    import no_such_library  # noqa: F401


def who(path):  # noqa: ARG001
    return os.getpid()


@pytest.fixture
def read(tmp_path):
    (tmp_path / "file.dat").write_bytes(b"content")
    return lambda reader, *more: read_in_subprocess(
        tmp_path / "file.dat", f"{__name__}:{reader.__name__}", *more, remedy="export it again"
    )


def test_what_is_read_comes_back(read):
    name, values = read(reads, 2.0)
    assert name == "file.dat"
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0])


def test_a_refusal_is_the_readers_own(read):
    with pytest.raises(BadInput, match=r"^file\.dat has no unit$"):
        read(refuses)
    with pytest.raises(ImportError, match="no_such_library"):
        read(misses)


@pytest.mark.parametrize(
    ("reader", "reason"),
    [
        (stumbles, r"file.dat is damaged \(file.dat\); export it again"),
        (crashes, "file.dat is damaged: its reader crashed; export it again"),
        (ends, "its reader crashed"),
        (swells, "needs more than 0.51 GB of memory"),
    ],
)
def test_what_a_reader_does_not_survive_is_a_sentence_and_the_next_read_works(read, reader, reason):
    with pytest.raises(UnreadableFile, match=reason):
        read(reader)
    assert read(reads, 1.0)[0] == "file.dat"


@pytest.mark.parametrize("reader", [hangs, turns])
def test_a_reader_that_hangs_is_stopped(read, monkeypatch, reader):
    monkeypatch.setattr(apart, "BASE_SECONDS", 1.0)
    with pytest.raises(UnreadableFile, match="took longer than 1 s"):
        read(reader)
    assert read(reads, 1.0)[0] == "file.dat"


def test_loading_a_library_is_no_reading(tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "BASE_SECONDS", 1.0)
    monkeypatch.syspath_prepend(tmp_path)
    slow = "import time\nbegun = time.process_time()\nwhile time.process_time() < begun + 3: pass\n"
    (tmp_path / "slow_library.py").write_text(slow)
    apart._servers.clear()  # one that knows of the library's folder
    (tmp_path / "file.dat").write_bytes(b"content")
    about = {"remedy": "", "library": "slow_library"}
    assert (
        read_in_subprocess(tmp_path / "file.dat", f"{__name__}:reads", 1.0, **about)[0]
        == "file.dat"
    )


def test_what_a_library_prints_is_not_taken_for_its_answer(read, capfd):
    assert read(prints) == "file.dat"
    assert capfd.readouterr() == ("", "")


def test_one_process_serves_all_reads_and_is_none_of_ours(read):
    assert read(who) == read(who) != os.getpid()


def test_a_raised_limit_lets_more_be_read(read, monkeypatch):
    monkeypatch.setenv("ASPERITY_MEMORY_GB", "10")
    assert read(swells) == 1e8
