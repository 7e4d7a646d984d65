"""A bar in notebooks shows how far a calculation has come; elsewhere nothing is shown."""

import sys
from types import SimpleNamespace

import pytest

import asperity as asp
from asperity.case import case_template, load_case
from asperity.core import notebook
from asperity.study import plan_study, run_study

FEW = {"grid.cells": [64, 32], "contact.roughness": "standing"}


class ZMQInteractiveShell:
    """Shell of a notebook, by its name."""


@pytest.fixture
def shown(monkeypatch):
    """Return the contents that a simulated notebook displayed."""
    contents: list[str] = []

    def display(content, display_id):
        assert display_id
        contents.append(content)
        return SimpleNamespace(update=contents.append)

    module = SimpleNamespace(get_ipython=ZMQInteractiveShell)
    monkeypatch.setitem(sys.modules, "IPython", module)
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(HTML=str, display=display))
    monkeypatch.setattr(notebook, "INTERVAL_S", 0.0)
    return contents


def test_a_motion_shows_its_steps(shown):
    asp.run_history(load_case(case_template("motion")).with_overrides(FEW), steps=3)
    assert shown[0].startswith("Motion <progress")
    assert "starting" in shown[0]
    assert 'value="1.000"' in shown[-1]
    assert shown[-1].endswith("step 3 of 3")


def test_wear_shows_its_hours(shown):
    few = FEW | {"wear.patches": 1, "grid.cells": [48, 24]}
    asp.run_wear(load_case(case_template("wear")).with_overrides(few), hours=0.01)
    assert shown[-1].endswith("of 0.01 h")


def test_a_study_shows_its_cases(shown):
    swept = FEW | {"study.sq": ["0.5 um", "0.9 um"], "study.seeds": 1}
    run_study(plan_study(load_case(case_template("study")).with_overrides(swept)), workers=1)
    assert shown[-1].endswith("2 of 2 cases, 0 failed")


def test_several_surfaces_are_counted(shown):
    asp.solve_case(load_case(case_template("line")).with_overrides(FEW), surfaces=2)
    assert shown[-1].endswith("2 of 2 surfaces")


def test_nothing_is_shown_elsewhere(monkeypatch):
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=object))
    assert notebook.count_progress("Solving", "surfaces") is None
    monkeypatch.delitem(sys.modules, "IPython")
    assert notebook.count_progress("Solving", "surfaces") is None


def test_a_callback_replaces_the_bar(shown):
    steps: list[object] = []
    asp.run_history(
        load_case(case_template("motion")).with_overrides(FEW), steps=2, progress=steps.append
    )
    assert (len(steps) >= 2, shown) == (True, [])
