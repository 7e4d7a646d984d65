"""README, the page on Python and that on the case file show the actual output."""

import io
import os
import re
import shlex
import shutil
from contextlib import redirect_stdout
from pathlib import Path

import pytest

from support.pages import read
from support.source import ROOT

README = read(ROOT / "README.md")
PYTHON = read(ROOT / "docs" / "start" / "python.md")
MAX_WORDS = 700  # of the README, with its code
# Another processor sums in another order, see test_golden_numbers; only 0 requires every digit.
TOLERANCE = float(os.environ.get("ASPERITY_GOLDEN_TOLERANCE", "2e-3"))
NUMBER = re.compile(r"\d+(?:\.\d+)?")


@pytest.fixture
def short_tracks():
    """Solve whole tracks instead: the README shows their numbers."""


def matches(printed: str, shown: str) -> bool:
    """Return True for the same words, with numbers within the tolerance or one unit in the last
    digit.
    """
    if TOLERANCE == 0.0:
        return printed == shown
    pairs = zip(NUMBER.findall(printed), NUMBER.findall(shown), strict=False)
    close = (
        float(a) == pytest.approx(float(b), rel=TOLERANCE, abs=1.01 * last_digit(b))
        for a, b in pairs
    )
    return NUMBER.sub("", printed) == NUMBER.sub("", shown) and all(close)


def last_digit(number: str) -> float:
    return 10.0 ** -len(number.partition(".")[2])


def test_the_readme_is_short():
    assert len(README.text.split()) <= MAX_WORDS


def test_the_first_commands_print_the_verdict_shown(asp):
    shutil.copytree(ROOT / "examples", "examples")
    commands, verdict = next(
        (block, after)
        for block, after in zip(README.blocks, README.blocks[1:], strict=False)
        if (block.language, after.language) == ("sh", "")
    )
    solve, report = commands.text.splitlines()
    code, out, _ = asp(*shlex.split(solve)[1:])
    assert code == 0
    assert matches(out.splitlines()[0], verdict.text.strip())
    assert asp(*shlex.split(report)[1:])[0] == 0


def test_five_lines_of_python_print_the_verdict_and_draw_the_film(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples", "examples")
    (block,) = (block for block in README.blocks if block.language == "python")
    assert len([line for line in block.text.splitlines() if line]) <= 5
    verdict = next(block.text for block in README.blocks if block.text.startswith("Mixed lubr"))
    printed = io.StringIO()
    with redirect_stdout(printed):
        exec(compile(block.text, "README.md", "exec"), {})
    assert matches(printed.getvalue().strip(), verdict.strip())
    assert Path("film.png").read_bytes().startswith(b"\x89PNG")


def test_the_python_example_prints_the_output_shown():
    _, block = (block for block in PYTHON.blocks if block.language == "python")
    after = next(
        line.text
        for line in PYTHON.prose
        if line.number > block.line.number and "This prints" in line.text
    )
    printed = io.StringIO()
    with redirect_stdout(printed):
        exec(compile(block.text, "python.md", "exec"), {})
    assert matches(printed.getvalue().strip(), re.search(r"`([^`]+)`", after)[1])


REFUSED = (
    'contact.lod="400 N"',
    "lubricant.viscosity.law=baruss",
    "contact.radius=5.4",
    'contact.load="-5 N"',
)


def test_refusals_match_the_text_shown(asp):
    *_, shown = (
        block for block in read(ROOT / "docs" / "case-file.md").blocks if not block.language
    )
    assert [
        asp("solve", "case.toml", "--set", mistake)[2].strip() for mistake in REFUSED
    ] == shown.text.splitlines()


def test_a_difference_is_detected():
    shown = "CLR 0.822, CRF 3711 Hz"
    assert matches(shown, shown)
    assert not matches("CLR 0.832, CRF 3711 Hz", shown)
    assert not matches("CAR 0.822, CRF 3711 Hz", shown)
