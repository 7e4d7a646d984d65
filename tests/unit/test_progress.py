"""Progress output: shown on terminals only; names the compilation of the solver."""

import os
import subprocess
import sys
from time import sleep

from asperity.cli import output
from asperity.ehl import Iteration


def test_compilation_is_shown_before_the_first_iteration(monkeypatch, capsys):
    monkeypatch.setattr(output, "FIRST_LINE_S", 0.05)

    def compile_ahead(report):
        report(3, 28)
        sleep(0.1)

    monkeypatch.setattr("asperity.kernels.ahead.compile_ahead", compile_ahead)
    with output.solver_progress("case", quiet=False) as step:
        first = capsys.readouterr().err
        step(Iteration((8, 8), 1, 1.0, 1.0, float("inf")))
        sleep(0.15)
    assert first == "case: compiling the solver, once after installation ... (0 s so far)\n"
    assert "compiling" not in capsys.readouterr().err


def test_units_are_printed_with_the_micro_sign(capsys):
    output.print_line("60 us at 1.5 um; state sq = '2 um', 0.5um.nc")
    assert capsys.readouterr().out == "60 µs at 1.5 µm; state sq = '2 um', 0.5um.nc\n"


def test_progress_is_shown_on_the_terminal_while_output_is_redirected():
    program = (
        "from asperity.cli.output import progress\n"
        "with progress('in [brackets/]', quiet=False) as display:\n"
        "    display('2 read', 2, 4)\n"
        "    print('{}')\n"
    )
    terminal, terminal_end = os.openpty()
    process = subprocess.run(
        [sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=terminal_end,
        text=True,
        check=True,
    )
    os.close(terminal_end)
    output_text = os.read(terminal, 100_000).decode()
    os.close(terminal)
    assert process.stdout == "{}\n"
    assert "in [brackets/]" in output_text
    assert "2 read" in output_text


def test_lines_of_a_log_report_that_the_work_continues(monkeypatch, capsys):
    monkeypatch.setattr(output, "FIRST_LINE_S", 0.05)
    with output.progress("case", "setting up ...", quiet=False) as display:
        sleep(0.1)
        display("3 of 9 contacts", 3, 9)
        sleep(0.6)
    first, *rest = capsys.readouterr().err.splitlines()
    assert first == "case: setting up ... (0 s so far)"
    assert 2 <= len(rest) <= 4  # at 0.15, 0.35 and 0.75 s, delays double
    assert set(rest) <= {f"case: 3 of 9 contacts ({seconds} s so far)" for seconds in (0, 1)}
    sleep(0.3)
    assert capsys.readouterr().err == ""


def test_a_watch_prints_no_lines_of_progress(monkeypatch, capsys):
    monkeypatch.setattr(output, "FIRST_LINE_S", 0.02)
    with output.progress("recordings", "watching ...", quiet=False, log=False):
        sleep(0.2)
    assert capsys.readouterr().err == ""


def test_quiet_shows_no_progress(capsys):
    with output.progress("case", quiet=True, compiles=True) as display:
        display("step 1")
    assert capsys.readouterr() == ("", "")


def test_finished_surfaces_are_counted_with_the_iterations():
    messages = []
    steps = output.SolverSteps(lambda *counts: messages.append(counts))
    steps.step(Iteration((8, 8), 0, 1.0, 1.0, float("inf")))
    steps.step(Iteration((8, 8), 1, 1e-2, 1.0, 1.0))
    steps.surface(2, 5)
    steps.step(Iteration((16, 8), 3, 1e-4, 1.0, 1.0))
    assert messages == [
        ("8 x 8 cells, step 1, residual 1.0e-02", None, None),
        ("2 of 5 surfaces", 2, 5),
        ("16 x 8 cells, step 3, residual 1.0e-04", 2, 5),
    ]
