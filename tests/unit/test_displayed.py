"""Results in Python: `repr` of at most 300 characters, a picture in notebooks, `.plot()`."""

import re
from dataclasses import fields, is_dataclass, replace

import matplotlib.axes
import numpy as np
import pytest

import asperity as asp
from asperity.case import case_template, load_case, load_machine
from asperity.core.displayed import MAX_REPR, Brief, Displayed
from asperity.core.errors import BadInput
from asperity.machines import machine_conditions
from asperity.paper import RigSettings, simulate_rig, write_rig
from asperity.simulation import run_history, run_wear
from asperity.study import plan_study, run_study

SMALL = {"grid.cells": [48, 24], "contact.roughness": "standing", "contact.load": "500 N"}
FEW = {"wear.patches": 1, "grid.cells": [48, 24], "contact.roughness": "standing"}


def template(kind: str, changes: dict[str, object]) -> asp.Case:
    return load_case(case_template(kind)).with_overrides(changes)


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> dict[str, object]:
    run = asp.solve_case(template("line", SMALL), surfaces=1)
    studied = template("study", SMALL | {"study.sq": ["0.5 um", "0.9 um"], "study.seeds": 1})
    noise = np.random.default_rng(1).normal(size=2000)
    signal = asp.Signal(noise, rate_hz=2000.0, unit="m/s^2")
    bearing = tmp_path_factory.mktemp("machine") / "bearing.toml"
    bearing.write_text(case_template("bearing"), "utf-8")
    rig = simulate_rig(RigSettings(samples=8, repeats=1, duration_s=2.0))
    recordings = write_rig(rig, tmp_path_factory.mktemp("rig"))
    return {
        "track": asp.track_recordings(recordings),
        "run": run,
        "solution": run.solution,
        "surface": run.solution.surface,
        "spectrum": asp.power_spectrum(signal),
        "study": run_study(plan_study(studied), workers=1),
        "wear": run_wear(template("wear", FEW), hours=0.01),
        "motion": run_history(template("motion", SMALL), steps=3),
        "machine": machine_conditions(load_machine(bearing)),
        "state": run.state,
        "case": run.case,
        "signal": signal,
    }


def test_a_repr_has_at_most_300_characters(results):
    for name, result in results.items():
        assert len(repr(result)) <= MAX_REPR, name
        assert repr(result).startswith(f"{type(result).__name__}("), name
    assert "on this grid asperities" in repr(results["run"])


DRAWN = ("run", "solution", "surface", "spectrum", "study", "wear", "motion", "machine", "track")


@pytest.mark.parametrize("name", DRAWN)
def test_a_result_is_drawn_in_one_line(results, name, tmp_path):
    axes = results[name].plot()
    assert isinstance(axes, matplotlib.axes.Axes)
    axes.figure.savefig(tmp_path / "figure.png")
    assert axes.has_data() or axes.patches or axes.images


@pytest.mark.parametrize("name", DRAWN)
def test_a_notebook_shows_a_picture(results, name):
    page = results[name]._repr_html_()
    assert re.search(r'<img alt="\w+" [^>]+src="data:image/png;base64,[\w+/=]{2000,}">', page)


def test_a_notebook_shows_the_numbers_of_a_run(results):
    page = results["run"]._repr_html_()
    for title in ("asperity load share, CLR", "contact resonance frequency, CRF"):
        assert f"<td>{title}</td>" in page


def test_a_track_without_a_resonance_shows_its_levels(results):
    without = tuple(
        replace(recording, resonance=replace(recording.resonance, found=False))
        for recording in results["track"].recordings
    )
    track = replace(results["track"], recordings=without, stages=None, stages_by={})
    assert "Trend" not in track.plot().get_title("left")
    with pytest.raises(BadInput, match="levels"):
        track.plot("trend")


def test_pyplot_shows_a_drawing(results):
    from matplotlib import pyplot

    axes = results["surface"].plot()
    assert pyplot.gcf() is axes.figure
    pyplot.close(axes.figure)
    assert axes.figure.number not in pyplot.get_fignums()


def test_a_drawing_is_chosen_by_name(results):
    assert "Pressure" in results["run"].plot("pressure").get_title("left")
    with pytest.raises(BadInput, match="film, contact, pressure"):
        results["run"].plot("presure")


def test_public_results_with_arrays_or_other_results_are_brief():
    """A dataclass that prints a field of these kinds may print thousands of characters."""
    long = re.compile(r"Field|Mask|DataFrame|tuple\[\w+, \.\.\.\]|Solution|Case\b")
    for name in asp.__all__:
        public = getattr(asp, name)
        if not (isinstance(public, type) and is_dataclass(public)):
            continue
        printed = [field for field in fields(public) if field.repr and long.search(str(field.type))]
        if printed:
            assert issubclass(public, Brief), (name, [field.name for field in printed])


def test_every_drawn_class_is_tested(results):
    tested = {type(results[name]) for name in DRAWN}
    names = {name for name in asp.__all__ if isinstance(getattr(asp, name), type)}
    drawn = {getattr(asp, name) for name in names if issubclass(getattr(asp, name), Displayed)}
    assert drawn <= tested
