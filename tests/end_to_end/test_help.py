"""Help at 80 columns, completion in the shell, usage errors that name the command's help."""

import os
import re
import subprocess
import sys

import pytest

from asperity.case import KINDS
from asperity.cli.terminal.groups import GROUPS
from support.vocabulary import commands

NAMES = sorted(commands())  # "" is `asperity` itself


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "asperity", *arguments],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("name", NAMES)
def test_help_is_neither_cut_nor_wider_than_80_columns(asp, monkeypatch, name):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, err = asp(*name.split(), "--help")
    lines = out.splitlines()
    assert (code, err) == (0, "")
    assert [line for line in lines if len(line) > 80] == []
    usage = 1 + next(number for number, line in enumerate(lines) if not line)
    assert [line for line in lines[usage:] if line.endswith(("...", "…"))] == []


def test_commands_are_grouped_by_task_with_their_whole_summaries(asp, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    grouped = [name for names in GROUPS.values() for name in names]
    assert sorted(grouped) == [name for name in NAMES if name]
    out = asp("--help")[1]
    assert [title for title in GROUPS if f"\n{title}:\n" in out] == list(GROUPS)
    for name, command in commands().items():
        summary = command.help.partition("\n\n")[0].replace("\n", " ") if name else ""
        assert re.search(rf"^  {name} +{re.escape(summary)}$", out, re.MULTILINE) or not name


def test_without_a_command_the_groups_are_shown(asp):
    code, out, err = asp()
    assert (code, err) == (2, "")
    assert out == asp("--help")[1]


@pytest.mark.parametrize(
    ("arguments", "reference"),
    [
        (("solve", "case.toml", "--nope"), "asperity solve --help"),
        (("study",), "asperity study --help"),
        (("track", "--rate", "fast"), "--rate"),
        (("slove",), "Did you mean 'solve', 'store'? See asperity --help"),
    ],
)
def test_a_usage_error_names_the_help_of_the_command(asp, arguments, reference):
    code, out, err = asp(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert reference in err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("asperity so", {"solve"}),
        ("asperity s", {"solve", "study", "sensitivity", "surface", "store", "stribeck"}),
        ("asperity solve --su", {"--surface", "--surfaces"}),
        ("asperity track --fo", {"--forecast"}),
    ],
)
def test_bash_completes_commands_and_options(words, expected):
    position = str(len(words.split()) - 1)
    done = run(_ASPERITY_COMPLETE="complete_bash", COMP_WORDS=words, COMP_CWORD=position)
    assert set(done.stdout.split()) == expected, done.stderr


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_each_shell_can_be_printed(shell):
    done = run(_ASPERITY_COMPLETE=f"source_{shell}")
    assert "_ASPERITY_COMPLETE" in done.stdout, done.stderr


def test_numbers_of_surfaces_and_seeds_have_one_spelling():
    options = {
        name: {option for parameter in command.params for option in parameter.opts}
        for name, command in commands().items()
    }
    assert {name for name in options if "--surfaces" in options[name]} == {
        *("solve", "sensitivity", "calibrate")
    }
    assert {name for name in options if "--seed" in options[name]} == {
        *("infer", "rig", "sensitivity", "calibrate")
    }
    for other in ("--seeds", "--sample-seed", "--realisations"):
        assert [name for name in options if other in options[name]] == []


def test_out_takes_the_result_and_no_other_option_does():
    helps = {
        name: parameter.help
        for name, command in commands().items()
        for parameter in command.params
        if "--out" in parameter.opts
    }
    assert [name for name, text in helps.items() if not text.startswith(("File", "Folder"))] == []
    others = {
        name
        for name, command in commands().items()
        for parameter in command.params
        if "--figure" in parameter.opts
    }
    assert others == set()


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (
            ("report", "case.toml"),
            ("is a case, not a saved run", "asperity solve case.toml --out case.nc"),
        ),
        (("report", "notes.txt"), ("is not a saved run", "asperity solve --out")),
        (("new", "gears"), KINDS),
        (("solve", "case.toml", "--set", "load="), ("load=", "lacks a value", "contact.load=")),
        (("solve", "case.toml", "--set", "load=400 N"), ("did you mean contact.load?",)),
        (("solve", "case.toml", "--report", "a.html"), ("asperity report RUN.nc",)),
        (("machine", "case.toml", "--report", "a.html"), ("--out DIR writes",)),
        (("demo", "--report", "a.html"), ("the page is always written",)),
    ],
)
def test_frequent_mistakes_are_answered_with_the_remedy(asp, tmp_path, arguments, parts):
    (tmp_path / "notes.txt").write_text("Dear ring,", "utf-8")
    code, out, err = asp(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert [part for part in parts if part not in err] == []
