"""Readers in a subprocess: failures become messages, and the next read works."""

import ctypes
import os
import time

import numpy as np
import pytest

from asperity.core import sandbox as apart
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.sandbox import read_in_subprocess


def return_values(path, factor):
    return path.name, factor * np.arange(3.0)


def raise_bad_input(path):
    raise BadInput(f"{path.name} has no unit")


def raise_unexpected(path):
    raise ZeroDivisionError(f"{path.name}\nsecond line")


def crash(path):  # noqa: ARG001
    ctypes.string_at(0)


def exit_early(path):  # noqa: ARG001
    os._exit(0)


def sleep_forever(path):  # noqa: ARG001
    time.sleep(60)


def loop_forever(path):  # noqa: ARG001
    while True:
        pass


def use_much_memory(path):  # noqa: ARG001
    return np.ones(10**8).sum()


def print_noise(path):
    os.system("echo noise; echo noise >&2")
    return path.name


def import_missing(path):  # noqa: ARG001
    import no_such_library  # noqa: F401


def process_id(path):  # noqa: ARG001
    return os.getpid()


@pytest.fixture
def read(tmp_path):
    (tmp_path / "file.dat").write_bytes(b"content")
    return lambda reader, *more: read_in_subprocess(
        tmp_path / "file.dat", f"{__name__}:{reader.__name__}", *more, remedy="export it again"
    )


def test_read_values_are_returned(read):
    name, values = read(return_values, 2.0)
    assert name == "file.dat"
    np.testing.assert_array_equal(values, [0.0, 2.0, 4.0])


def test_a_refusal_passes_through_unchanged(read):
    with pytest.raises(BadInput, match=r"^file\.dat has no unit$"):
        read(raise_bad_input)
    with pytest.raises(ImportError, match="no_such_library"):
        read(import_missing)


@pytest.mark.parametrize(
    ("reader", "reason"),
    [
        (raise_unexpected, r"file.dat is damaged \(file.dat\); export it again"),
        (crash, "file.dat is damaged: its reader crashed; export it again"),
        (exit_early, "its reader crashed"),
        (use_much_memory, "needs more than 0.51 GB of memory"),
    ],
)
def test_a_failing_reader_raises_a_message_and_the_next_read_works(read, reader, reason):
    with pytest.raises(UnreadableFile, match=reason):
        read(reader)
    assert read(return_values, 1.0)[0] == "file.dat"


@pytest.mark.parametrize("reader", [sleep_forever, loop_forever])
def test_a_reader_that_hangs_is_stopped(read, monkeypatch, reader):
    monkeypatch.setattr(apart, "BASE_SECONDS", 1.0)
    with pytest.raises(UnreadableFile, match="took longer than 1 s"):
        read(reader)
    assert read(return_values, 1.0)[0] == "file.dat"


def test_loading_a_library_does_not_count_as_reading_time(tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "BASE_SECONDS", 1.0)
    monkeypatch.syspath_prepend(tmp_path)
    slow = "import time\nbegun = time.process_time()\nwhile time.process_time() < begun + 3: pass\n"
    (tmp_path / "slow_library.py").write_text(slow)
    apart._servers.clear()  # start a server that has the library's folder on its path
    (tmp_path / "file.dat").write_bytes(b"content")
    options = {"remedy": "", "library": "slow_library"}
    assert (
        read_in_subprocess(tmp_path / "file.dat", f"{__name__}:return_values", 1.0, **options)[0]
        == "file.dat"
    )


def test_output_of_a_library_is_not_mistaken_for_its_result(read, capfd):
    assert read(print_noise) == "file.dat"
    assert capfd.readouterr() == ("", "")


def test_one_subprocess_serves_all_reads(read):
    assert read(process_id) == read(process_id) != os.getpid()


def test_a_raised_memory_limit_allows_larger_reads(read, monkeypatch):
    monkeypatch.setenv("ASPERITY_MEMORY_GB", "10")
    assert read(use_much_memory) == 1e8
