"""The JSON object of a command: its verdict, and its error; the report opened with `--open`."""

import json
from contextlib import chdir
from pathlib import Path
from shutil import copy

import numpy as np
import pytest

from asperity import load_case, solve_case
from asperity.cli import main

pytestmark = pytest.mark.usefixtures("blank_figures")

EXAMPLES = Path(__file__).parents[2] / "examples"
SMALL = ("--surfaces", "1", "--set", "grid.cells=[32, 32]", "--set", "vibration=none")
SMOOTH = (*SMALL, "--set", "surface=flat")


def recording(path: Path) -> None:
    np.save(path, np.random.default_rng(1).standard_normal(20_000))


COMMANDS = {
    "solve": ("solve", "case.toml", *SMOOTH),
    "dry run of a machine": ("machine", "machine.toml", "--dry-run"),
    "check": ("check", "x.npy", "--rate", "20000"),
    "surface": ("surface", "heights.npy", "--pixel", "1 um", "--unit", "um"),
    "rig": ("rig", "--out", "rig", "--samples", "6", "--repeats", "1", "--duration", "1 s"),
    "table of overall values": ("track", "--series", "overall.csv"),
    "report": ("report", "run.nc"),
    "export": ("export", "run.nc", "run.csv"),
    "store": ("store", "asperity.db"),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a folder with a case, a machine, recordings, a store and a saved run."""
    folder = tmp_path_factory.mktemp("json")
    with chdir(folder):
        Path("case.toml").write_text((EXAMPLES / "paper.toml").read_text("utf-8"), "utf-8")
        Path("machine.toml").write_text((EXAMPLES / "nu206.toml").read_text("utf-8"), "utf-8")
        recording(Path("x.npy"))
        np.save("heights.npy", np.random.default_rng(2).standard_normal((64, 64)))
        rows = "".join(f"2024-01-{day:02},{1 + 0.01 * (day % 3)}\n" for day in range(1, 31))
        Path("overall.csv").write_text("time,rms\n" + rows, "utf-8")
        case = load_case("case.toml").with_overrides(
            {"surface": "flat", "grid.cells": [32, 32], "vibration": "none"}
        )
        solve_case(case, surfaces=1).save("run.nc")
        with pytest.raises(SystemExit):
            main(("track", "x.npy", "--rate", "20000", "--store", "asperity.db", "-q"))
    return folder


@pytest.fixture
def files(asp, made):
    """Return the runner of commands, beside the files."""
    for file in made.iterdir():
        if file.name != "case.toml":
            copy(file, file.name)
    return asp


@pytest.mark.parametrize("name", COMMANDS)
def test_the_object_holds_the_verdict_that_is_printed(files, name):
    arguments = COMMANDS[name]
    code, out, _ = files(*arguments, "--json")
    verdict = json.loads(out)["verdict"]
    assert verdict
    if name != "rig":  # refuses a folder that exists
        text = files(*arguments)
        assert (text[0], text[1].splitlines()[0]) == (code, verdict)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("solve", "absent.toml"), "absent.toml does not exist"),
        (("solve", "case.toml", "--nope"), "see asperity solve --help"),
        (("slove",), "Did you mean 'solve'"),
        (("track",), "no recordings are given"),
    ],
)
def test_an_error_is_an_object_with_the_exit_code(asp, arguments, part):
    code, out, err = asp(*arguments, "--json")
    error = json.loads(out)["error"]
    assert code == error["exit_code"] == 2
    assert part in error["message"]
    assert err == f"error: {error['message']}\n"


def test_a_result_with_an_error_stays_one_object(asp):
    recording(Path("x.npy"))
    Path("y.npy").write_bytes(b"no array")
    code, out, _ = asp("check", "x.npy", "y.npy", "--rate", "20000", "--json")
    both = json.loads(out)
    assert code == both["error"]["exit_code"] == 2
    assert "y.npy" in both["error"]["message"]
    assert "x.npy" in json.dumps(both["recordings"])


def test_errors_of_later_commands_do_not_repeat_earlier_results(asp):
    recording(Path("x.npy"))
    asp("check", "x.npy", "--rate", "20000", "--json")
    assert list(json.loads(asp("solve", "absent.toml", "--json")[1])) == ["error"]


def test_open_shows_the_report_in_the_browser(files, monkeypatch):
    addresses: list[str] = []
    monkeypatch.setattr("webbrowser.open", lambda address: addresses.append(address) or True)
    assert files("report", "run.nc", "--open")[0] == 0
    assert addresses == [Path("run.html").resolve().as_uri()]
    assert files("report", "run.nc")[0] == 0
    assert len(addresses) == 1


def test_without_a_browser_the_address_is_stated(files, monkeypatch):
    monkeypatch.setattr("webbrowser.open", lambda _: False)
    code, _, err = files("report", "run.nc", "--open", "--json")
    assert code == 0
    assert err == f"no browser was found; open {Path('run.html').resolve().as_uri()}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ("study", "case.toml", "--out", "study", "--open"),
        ("run", "case.toml", "--open"),
        ("wear", "case.toml", "--hours", "1", "--open"),
        ("track", "x.npy", "--open"),
        ("machine", "machine.toml", "--open"),
        ("infer", "x.npy", "--case", "case.toml", "--open"),
    ],
)
def test_open_without_a_report_is_refused(asp, arguments):
    code, out, err = asp(*arguments)
    assert (code, out) == (2, "")
    assert "--open opens the report" in err
