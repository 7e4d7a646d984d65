"""Progress: on a terminal only, beside the output; the wait for the compiler is announced, a solver
at work is not.
"""

import os
import subprocess
import sys
from time import sleep

import pytest

from asperity.cli import output
from asperity.ehl import Iteration


@pytest.mark.parametrize(("number", "announced"), [(0, True), (1, False)])
def test_the_first_step_ends_the_wait_not_the_start(monkeypatch, capsys, number, announced):
    monkeypatch.setattr(output, "NOTICE_DELAY_S", 0.05)
    with output.solver_progress("case", quiet=False) as step:
        step(Iteration((8, 8), number, 1.0, 1.0, float("inf")))
        sleep(0.3)
    assert ("compiles the solver" in capsys.readouterr().err) is announced


def test_a_file_gets_the_output_while_a_terminal_shows_progress():
    program = (
        "from asperity.cli.output import progress\n"
        "with progress('in [brackets/]', quiet=False) as display:\n"
        "    display('2 read', 2, 4)\n"
        "    print('{}')\n"
    )
    terminal, end = os.openpty()
    done = subprocess.run(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=end, text=True, check=True
    )
    os.close(end)
    shown = os.read(terminal, 100_000).decode()
    os.close(terminal)
    assert done.stdout == "{}\n"
    assert "in [brackets/]" in shown
    assert "2 read" in shown


def test_quiet_shows_nothing(capsys):
    with output.progress("case", quiet=True, compiles=True) as display:
        display("step 1")
    assert capsys.readouterr() == ("", "")


def test_surfaces_that_are_done_are_counted_beside_the_steps():
    shown = []
    steps = output.SolverSteps(lambda *told: shown.append(told))
    steps.step(Iteration((8, 8), 0, 1.0, 1.0, float("inf")))
    steps.step(Iteration((8, 8), 1, 1e-2, 1.0, 1.0))
    steps.surface(2, 5)
    steps.step(Iteration((16, 8), 3, 1e-4, 1.0, 1.0))
    assert shown == [
        ("8 x 8 cells, step 1, residual 1.0e-02", None, None),
        ("2 of 5 surfaces", 2, 5),
        ("16 x 8 cells, step 3, residual 1.0e-04", 2, 5),
    ]
