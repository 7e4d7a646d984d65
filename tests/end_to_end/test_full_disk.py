"""A full disk or quota: one sentence, and no partial output, whatever is being written."""

import resource
import subprocess
import sys

import pytest

SMALL = ("--set", "grid.cells=[32, 24]", "--set", "surface.correlation_length=40 um", "-q")


def limited(kilobytes: int):
    """Return a function that limits a process's file size; the limit acts like a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (kilobytes << 10, kilobytes << 10))


COMMANDS = {  # the command, and a size in kB that is too small for its output
    "run": (("solve", "case.toml", "--surfaces", "1", *SMALL, "--out", "new/run.nc"), 30),
    "history": (("run", "case.toml", "--steps", "2", *SMALL, "--out", "new/history"), 5),
    "study": (
        (
            "study",
            "case.toml",
            "--workers",
            "1",
            *SMALL,
            "--set",
            "study.sq=['1 um']",
            "--out",
            "new/study",
        ),
        4,
    ),
    "rig": (
        ("rig", "--out", "new/rig", "--samples", "1", "--repeats", "1", "--duration", "5 s"),
        50,
    ),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_is_reported_in_one_sentence(asp, tmp_path, name):
    assert asp
    arguments, kilobytes = COMMANDS[name]
    (tmp_path / "new").mkdir()
    ended = subprocess.run(
        [sys.executable, "-m", "asperity", *arguments],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=limited(kilobytes),
    )
    assert ended.returncode == 1
    assert ended.stderr.count("\n") == 1
    assert "could not be written" in ended.stderr
    assert not list(tmp_path.rglob("*.part"))
    assert not list(tmp_path.rglob("*.nc"))
