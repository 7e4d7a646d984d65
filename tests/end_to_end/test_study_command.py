"""`asperity study`: killed processes and dask workers, shards and bad input."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import pandas
import pytest

import asperity.study.execute as execution

CASE = Path(__file__).parents[2] / "examples" / "paper.toml"
SETTINGS = {
    "lubricant": "none",
    "grid.cells": "[32, 24]",
    "surface.correlation_length": "30 um",
    "vibration.duration": "0.1 s",
    "study.sq": '["1 um", "2 um", "3 um", "4 um"]',
    "study.seeds": "6",
}
WORDS = [word for key, value in SETTINGS.items() for word in ("--set", f"{key}={value}")]


def study_in(out, *more):
    """Return the words of the command, with the table in `out`."""
    return "study", str(CASE), "--out", str(out), *WORDS, *more


def start_study(out, *more):
    command = [sys.executable, "-m", "asperity", *study_in(out, *more)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def rows(out):
    return pandas.read_parquet(out / "table.parquet").drop(columns="seconds")


def part_files(out):
    return len(list((out / "parts").glob("*.parquet")))


def wait_for(condition, seconds=60.0):
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < seconds
        time.sleep(0.01)


@pytest.fixture(scope="module")
def complete(tmp_path_factory):
    """Return the rows of a study that one process computes without interruption."""
    out = tmp_path_factory.mktemp("complete")
    running = start_study(out, "--workers", "1", "--json")
    output, errors = running.communicate(timeout=120)
    assert running.returncode == 0, errors
    assert all("s so far)" in line for line in errors.splitlines())  # progress alone
    result = json.loads(output)
    assert (result["cases"], result["failed"], result["table"]) == (
        24,
        0,
        str(out / "table.parquet"),
    )
    assert result["seconds"] > 0.0
    return rows(out)


def test_a_study_whose_parent_is_killed_resumes_to_the_same_table(complete, asp, tmp_path):
    out = tmp_path / "out"
    running = start_study(out, "--workers", "2")
    wait_for(lambda: part_files(out) >= 2)
    workers = subprocess.run(
        ["pgrep", "-P", str(running.pid)], capture_output=True, text=True, check=False
    ).stdout
    running.kill()
    running.communicate()
    finished = part_files(out)
    wait_for(lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers.split()), 20.0)
    assert part_files(out) == finished
    code, output, errors = asp(*study_in(out, "--workers", "1", "--json"))
    assert code == 0, errors
    assert json.loads(output)["computed"] < 24
    pandas.testing.assert_frame_equal(rows(out), complete, check_exact=True)


def test_a_study_survives_a_killed_worker(complete, tmp_path):
    running = start_study(tmp_path, "--workers", "2")
    wait_for(lambda: part_files(tmp_path) >= 2)
    found = subprocess.run(
        ["pgrep", "-P", str(running.pid), "-f", "spawn_main"],
        capture_output=True,
        text=True,
        check=False,
    )
    os.kill(int(found.stdout.split()[0]), signal.SIGKILL)
    _, complaint = running.communicate(timeout=120)
    assert running.returncode == 0, complaint
    pandas.testing.assert_frame_equal(rows(tmp_path), complete, check_exact=True)


@contextmanager
def dask_cluster(folder):
    environment = {**os.environ, "DASK_DISTRIBUTED__ADMIN__LOG_LENGTH": "0"}
    address = folder / "scheduler.json"
    scheduler = [
        sys.executable,
        "-m",
        "distributed.cli.dask_scheduler",
        "--port",
        "0",
        "--host",
        "127.0.0.1",
    ]
    worker = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        "--scheduler-file",
        str(address),
        "--nthreads",
        "1",
    ]
    options = ["--no-dashboard", "--scheduler-file", str(address)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment}
    processes = [subprocess.Popen([*scheduler, *options], **quiet)]
    try:
        wait_for(address.exists)
        workers = [*worker, "--no-nanny", "--no-dashboard", "--local-directory", str(folder)]
        processes += [subprocess.Popen(workers, **quiet) for _ in range(2)]
        yield json.loads(address.read_text())["address"], processes[1:]
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def test_a_killed_dask_worker_does_not_change_the_rows(complete, asp, tmp_path):
    out = tmp_path / "out"

    def kill(worker):
        wait_for(lambda: part_files(out) >= 2)
        worker.kill()

    with dask_cluster(tmp_path) as (address, workers):
        killing = Thread(target=kill, args=(workers[0],))
        killing.start()
        code, output, errors = asp(*study_in(out, "--executor", f"dask:{address}", "--json"))
        killing.join()
        assert workers[0].wait(10.0) == -signal.SIGKILL
    assert code == 0, errors
    assert json.loads(output)["computed"] == 24
    pandas.testing.assert_frame_equal(rows(out), complete, check_exact=True)


def test_shards_merge_to_the_complete_table(complete, asp):
    for k in ("1", "2"):
        code, out, _ = asp(
            "study", str(CASE), "--out", k, *WORDS, "--shard", f"{k}/2", "--workers", "1", "--json"
        )
        assert code == 0
        assert (json.loads(out)["cases"], json.loads(out)["planned"]) == (12, 24)
    code, out, _ = asp(
        "study", str(CASE), "--out", "merged", *WORDS, "--merge", "1", "--merge", "2", "--json"
    )
    assert code == 0
    assert json.loads(out)["computed"] == 0
    pandas.testing.assert_frame_equal(rows(Path("merged")), complete, check_exact=True)


def test_the_verdict_comes_first_and_failures_are_reported(asp):
    sweep = 'study={sq=["1 um"], correlation_length=["30 um", "3 um"]}'
    code, out, err = asp(
        "study", str(CASE), "--out", "out", *WORDS[:-4], "--set", sweep, "--workers", "1"
    )
    assert code == 1
    assert out.startswith("2 cases, 1 failed")
    assert "correlation length along x must be at least 2 cells" in out
    assert re.fullmatch(r"error: 1 of 2 cases failed; the first: .*\n", err)


@pytest.mark.workers
def test_a_dry_run_estimates_the_cost(asp):
    code, out, err = asp("study", str(CASE), "--dry-run", *WORDS, "--workers", "4", "--json")
    assert (code, err) == (0, "")
    result = json.loads(out)
    assert (
        result["cases"],
        result["kept"],
        result["points"],
        result["seeds"],
        result["workers"],
    ) == (
        24,
        0,
        4,
        6,
        4,
    )
    at_work = 24 * result["seconds_a_case"] / min(4, execution.cores())
    assert at_work < result["seconds"] < at_work + 120.0  # includes the start of the workers


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--shard", "4/3"], "--shard must be k/N with 1 <= k <= N, such as 1/3, got 4/3"),
        (["--executor", "slurm"], "--executor must be dask:ADDRESS"),
        (
            ["--executor", "dask:tcp://127.0.0.1:1"],
            "no dask scheduler answers at tcp://127.0.0.1:1",
        ),
        (["--fields", "colour"], "fields must be among"),
        (["--set", "study.sq=none"], "study.sq must be a list of values or a range"),
        (["--merge", "nowhere"], "nowhere holds no study"),
        (["--report", "page.pdf"], "--report must be a file that ends in .html, got page.pdf"),
    ],
)
def test_bad_input_is_refused_in_one_sentence_and_writes_no_table(
    asp, monkeypatch, words, sentence
):
    monkeypatch.setattr("asperity.study.dask_workers.DASK_WAIT_S", 1.0)
    code, out, err = asp("study", str(CASE), "--out", "out", *WORDS, *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert len(err.splitlines()) == 1
    assert not Path("out/table.parquet").exists()


def test_a_study_needs_a_study_folder(asp):
    Path("file").write_text("")
    refused = asp("study", str(CASE), "--out", "file")
    assert refused == (2, "", "error: cannot write into file: it is a file; name a folder\n")
    code, _, err = asp("study", str(CASE))
    assert code == 2
    assert "state --out DIR" in err
