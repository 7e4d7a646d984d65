"""Stiffness and damping of a solved contact over frequency in a run's output: on request only."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray

from asperity.case import load_case
from asperity.cli import main
from asperity.core.errors import AsperityError, BadInput
from asperity.report import write_report
from asperity.report.run.stiffness import stiffness_over_frequency
from asperity.results import dynamic, load_run, solve_case
from asperity.solution import dynamic_stiffness

SMALL = {
    "grid.cells": "[64, 32]",
    "surface.correlation_length": "40 um",
    "vibration.duration": "0.2 s",
}
COUNT = 9


@pytest.fixture(scope="module")
def run():
    return solve_case(
        load_case("examples/paper.toml").with_overrides({**SMALL, "solver.dynamic": COUNT})
    )


def test_the_curve_passes_through_the_reported_resonance(run):
    curve, own = run.dynamic_curve, run.own_resonance.elastic
    assert curve.frequency_hz.shape == (COUNT,)
    points = int(np.argmin(np.abs(curve.frequency_hz - own.frequency_hz)))
    assert curve.frequency_hz[points] == own.frequency_hz
    assert curve.elastic.stiffness[points] == pytest.approx(own.stiffness, rel=1e-4)
    assert curve.elastic.damping[points] == pytest.approx(own.damping, rel=1e-2)
    assert curve.virgin.stiffness[points] == pytest.approx(
        run.own_resonance.virgin.stiffness, rel=1e-4
    )
    assert curve.frequency_hz[0] == pytest.approx(own.frequency_hz / 10.0, rel=0.1)
    assert curve.frequency_hz[-1] > 3.0 * own.frequency_hz


def test_every_point_equals_the_dynamic_stiffness_at_its_frequency(run):
    curve = run.dynamic_curve
    for index in (0, COUNT - 1):
        for yielded, branch in (("elastic", curve.elastic), ("flowing", curve.virgin)):
            alone = dynamic_stiffness(
                run.solution, float(curve.frequency_hz[index]), yielded=yielded
            )
            assert branch.stiffness[index] == pytest.approx(alone.stiffness, rel=1e-3)
            assert branch.damping[index] == pytest.approx(
                alone.damping, rel=2e-2, abs=1e-3 * abs(curve.elastic.damping[0])
            )
    assert curve.elastic.slow == pytest.approx(
        dynamic_stiffness(run.solution, 0.0).stiffness, rel=1e-3
    )


def test_the_curve_is_in_json_and_file_only_if_requested(run, tmp_path):
    summary = json.loads(json.dumps(run.summary()))["dynamic_curve"]
    assert summary["frequency_hz"] == run.dynamic_curve.frequency_hz.tolist()
    assert summary["stiffness_n_m"] == run.dynamic_curve.elastic.stiffness.tolist()
    assert summary["damping_ns_m"] == run.dynamic_curve.elastic.damping.tolist()
    assert summary["slow_stiffness_n_m"] == run.dynamic_curve.elastic.slow
    assert set(summary) > {
        "stiffness_virgin_n_m",
        "damping_virgin_ns_m",
        "slow_stiffness_virgin_n_m",
    }
    with xarray.open_dataset(run.save(tmp_path / "run.nc")) as kept:
        np.testing.assert_array_equal(kept["dynamic_frequency"], run.dynamic_curve.frequency_hz)
        np.testing.assert_array_equal(
            kept["dynamic_stiffness"], run.dynamic_curve.elastic.stiffness
        )
        assert kept["dynamic_damping"].attrs["units"] == "N s m-1"
    again = load_run(tmp_path / "run.nc")
    np.testing.assert_allclose(
        again.dynamic_curve.elastic.stiffness, run.dynamic_curve.elastic.stiffness, rtol=1e-6
    )
    without_curve = replace(run, case=run.case.with_overrides({"solver.dynamic": 0}))
    assert without_curve.dynamic_curve is None
    assert "dynamic_curve" not in without_curve.summary()
    assert "dynamic_stiffness" not in without_curve.contents().variables
    assert "stiffness-over-frequency" not in (tmp_path / "p.html").name
    page = write_report([without_curve], tmp_path / "p.html").read_text("utf-8")
    assert "Stiffness over frequency" not in page


def test_the_page_shows_the_curve_with_the_resonance_marked(run, tmp_path):
    page = write_report([run], tmp_path / "page.html").read_text("utf-8")
    assert "Stiffness and damping of the solved contact" in page
    above, below = stiffness_over_frequency(run).figure().axes
    own = run.own_resonance.elastic
    (mark,) = [line for line in above.get_lines() if line.get_label() == "resonance of the mass"]
    assert mark.get_xydata()[0] == pytest.approx((own.frequency_hz, 1e-6 * own.stiffness))
    assert "N s/m" in below.get_ylabel()


def test_without_a_mass_the_curve_is_centred_on_the_film_crossing_frequency(run):
    without_mass = replace(run, case=run.case.with_overrides({"vibration": "none"}), vibration=None)
    conditions = run.case.conditions
    crossing = conditions.entrainment_speed / (2.0 * np.pi * conditions.hertz.half_widths[0])
    assert np.min(np.abs(without_mass.dynamic_curve.frequency_hz / crossing - 1.0)) < 1e-12


def test_frequencies_that_fail_are_nan_and_noted(run, monkeypatch):
    class FailingContact(dynamic.OscillatingContact):
        def evaluate(self, frequency_hz):
            if frequency_hz > 20e3:
                raise AsperityError(f"not found at {frequency_hz:.0f} Hz")
            return super().evaluate(frequency_hz)

    monkeypatch.setattr(dynamic, "OscillatingContact", FailingContact)
    failing_run = replace(run)
    curve = failing_run.dynamic_curve
    assert np.isnan(curve.elastic.stiffness[-1])
    assert np.isfinite(curve.elastic.stiffness[0])
    assert failing_run.summary()["dynamic_curve"]["stiffness_n_m"][-1] is None
    assert any("Not found at" in note for note in failing_run.remarks)


def test_a_contact_without_dynamic_stiffness_has_a_note(run):
    conserving = solve_case(run.case.with_overrides({"model": "conserving", "surface": "flat"}))
    assert conserving.dynamic_curve is None
    assert any(
        "No stiffness over frequency: dynamic stiffness needs the model" in note
        for note in conserving.remarks
    )


def test_the_command_takes_an_option_and_refuses_an_invalid_number(capsys):
    arguments = ["solve", "examples/paper.toml", "--surfaces", "1", "--json"]
    for key, value in SMALL.items():
        arguments += ["--set", f"{key}={value}"]
    with pytest.raises(SystemExit) as exit_info:
        main([*arguments, "--dynamic"])
    assert not exit_info.value.code
    summary = json.loads(capsys.readouterr().out)
    assert len(summary["dynamic_curve"]["frequency_hz"]) == dynamic.FREQUENCIES
    with pytest.raises(BadInput, match=r"solver\.dynamic"):
        load_case("examples/paper.toml").with_overrides({"solver.dynamic": 1})
