"""Lines and tables within the width of the terminal."""

import pytest

from asperity.cli import output
from asperity.cli.terminal.layout import fitted, layout, terminal_width

ROWS = [
    ["roller 1", "12", "3.2", "4", "55.5", "a sentence of a cell that states a long reason"],
    ["roller 2 of the bearing", "12", "3.2", "4", "55.5", "short"],
]
TITLES = ["contact", "load [N]", "entrainment speed [m/s]", "x", "y", "reason"]


@pytest.mark.parametrize("width", [40, 60, 80, 100])
def test_a_table_is_no_wider_than_the_terminal_and_loses_nothing(width):
    whole = list(layout(TITLES, ROWS, left=1, width=None))
    lines = list(layout(TITLES, ROWS, left=1, width=width))
    assert max(map(len, whole)) > 100
    assert max(map(len, lines)) <= width
    words = {word for row in (*ROWS, TITLES) for cell in row for word in cell.split()}
    assert words <= set(" ".join(lines).split())


def test_a_table_that_fits_is_one_table():
    rows = [["a", "1"], ["b", "2"]]
    assert list(layout(["name", "value"], rows, left=1, width=80)) == [
        "  name  value",
        "  a         1",
        "  b         2",
    ]


@pytest.mark.parametrize("width", [40, 80])
def test_lines_are_wrapped_at_spaces_without_losing_words(width):
    line = (
        "  assumptions not covered  model mixed, pressure cap of 2 GPa, inlet of 4.5 half-widths "
        * 2
    )
    parts = fitted(line, width)
    assert max(map(len, parts)) <= width
    assert " ".join(parts).split() == line.split()


def test_a_number_stays_with_its_unit():
    parts = fitted("asperities carry 65.6 % of the load at 2.0 GPa", 22)
    assert [part for part in parts if part.startswith(("%", "GPa"))] == []


def test_a_value_is_continued_below_itself():
    first, second = fitted("  pressure  one two three four five six seven eight nine ten", 44)
    assert second.index(second.split()[0]) == first.index("one")


def test_a_suggested_command_can_be_copied():
    command = "asperity track rig --table rig/table.csv --case rig/rig.toml"
    first, *parts = fitted(f"Try next: {command}", 40)
    assert first == "Try next:"
    assert "".join(parts).replace("\\", "").split() == command.split()
    assert all(part.endswith(" \\") for part in parts[:-1])
    assert max(map(len, parts)) <= 40


def test_a_pipe_has_no_width_unless_columns_states_one(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert terminal_width() is None
    monkeypatch.setenv("COLUMNS", "80")
    assert terminal_width() == 80


def test_every_line_of_a_result_fits(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "60")
    rows = output.table([("name of a value", "text " * 30)], ["note " * 30])
    table = output.columns(TITLES, ROWS, left=1)
    output.show("verdict " * 30, dict, rows, table, as_json=False, quiet=False)
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 60


def test_a_number_in_a_heading_stays_with_its_unit():
    lines = list(layout(["mean film 90 %"], [["1"]], left=0, width=80))
    assert [line.strip() for line in lines] == ["mean film", "90 %", "1"]
