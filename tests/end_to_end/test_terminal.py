"""Output to a terminal, a pipe or a full device: plain sentences without control characters."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from asperity.cli import main

CASE = Path(__file__).parents[2] / "examples" / "paper.toml"


def run(*arguments: str, **about) -> subprocess.CompletedProcess[str]:
    about = {"capture_output": True, "text": True, "errors": "replace", "check": False} | about
    return subprocess.run([sys.executable, "-m", "asperity", *arguments], **about)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_unwritable_output_is_reported_in_one_sentence():
    with Path("/dev/full").open("w", encoding="utf-8") as full:
        done = run(
            "vibrate", str(CASE), "-q", capture_output=False, stdout=full, stderr=subprocess.PIPE
        )
    assert done.returncode == 1
    assert done.stderr.startswith("error: the output could not be written: No space left")
    assert done.stderr.count("\n") == 1


def test_a_closed_pipe_causes_no_traceback(tmp_path):
    np.save(tmp_path / "x.npy", np.random.default_rng(1).standard_normal(20000))
    reading, writing = os.pipe()
    os.close(reading)
    closed = {"capture_output": False, "stdout": writing, "stderr": subprocess.PIPE}
    done = run("check", str(tmp_path / "x.npy"), "--rate", "20000", **closed)
    os.close(writing)
    assert done.stderr == ""


@pytest.mark.parametrize("encoding", ["ascii", "ascii:strict", "latin-1"])
def test_results_reach_an_output_with_a_limited_character_set(encoding):
    done = run(
        "vibrate",
        str(CASE),
        "-q",
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
    )
    assert done.returncode == 0
    assert done.stderr == ""
    assert "Contact resonance at" in done.stdout


@pytest.mark.parametrize(
    "arguments",
    [("solve", "bad\x1b[31m.toml"), ("check", "bad\x1b[2J\x07.csv"), ("solve", "a\x00b.toml")],
)
def test_file_names_do_not_control_the_terminal(arguments, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(arguments)
    message = capsys.readouterr().err
    assert end.value.code == 2
    assert message.rstrip("\n").isprintable()
    assert "does not exist" in message or "null byte" in message


def test_channel_names_do_not_control_the_terminal(capsys, tmp_path):
    (tmp_path / "x.csv").write_text("rate: 20000\ntwo\x1b]0;title\x07 b,one\n" + "1,2\n3,1\n" * 100)
    with pytest.raises(SystemExit):
        main(("check", str(tmp_path / "x.csv"), "--rate", "20000"))
    assert "\x1b" not in capsys.readouterr().out


@pytest.mark.parametrize(
    "override",
    [
        "contact.load=" + "x" * 10**5,
        "x" * 10**5 + "=1",
        f"surface.file='{'y' * 10**5}'",
        "no equals" * 9999,
    ],
)
def test_a_refusal_is_short(capsys, override):
    with pytest.raises(SystemExit) as end:
        main(("solve", str(CASE), "--set", override))
    message = capsys.readouterr().err
    assert end.value.code == 2
    assert len(message) <= 500
    assert message.count("\n") == 1
