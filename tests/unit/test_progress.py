"""The wait for the compiler is announced; that of a solver at work is not."""

from time import sleep

import pytest

from asperity.cli import show
from asperity.ehl import Iteration


@pytest.mark.parametrize(("number", "announced"), [(0, True), (1, False)])
def test_the_first_step_ends_the_wait_not_the_start(monkeypatch, capsys, number, announced):
    monkeypatch.setattr(show, "SILENT_FOR", 0.05)
    with show.solver_progress("case", quiet=False) as step:
        step(Iteration((8, 8), number, 1.0, 1.0, float("inf")))
        sleep(0.3)
    assert ("compiles the solver" in capsys.readouterr().err) is announced
