"""Calibration: recovery of the generating parameters, closed forms, unidentifiable parameters.

Mostly dry contacts: asperities carry the whole load, and the Hertzian resonance needs no solver.
"""

import json
import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from asperity import load_case
from asperity.cli import main
from asperity.core.errors import BadInput
from asperity.paper import Anchor
from asperity.study import CalibrationSettings, calibrate, plan_points, run_study
from asperity.study.calibration import _levels
from asperity.study.sensitivities import MisfitSlopes

PAPER = Path(__file__).parents[2] / "examples" / "paper.toml"
DRY = {
    "lubricant": "none",
    "surface.correlation_length": "60 um",
    "vibration.duration": "1 s",
    "vibration.damping_ratio": 0.005,
    "grid.cells": [32, 32],
    "study": "none",
}
CAP = "material.hardness=0.5 GPa..4 GPa"
MODULUS = "material.youngs_modulus=120 GPa..300 GPa"
FRICTION = "material.boundary_friction=0.05..0.3"
QUICK = {"cells": 32, "seeds": 1, "screened": 4, "starts": 1}


@pytest.fixture(autouse=True)
def case_preset_alone(monkeypatch):
    """Simulate the case's vibration, and not those of both presets, which no anchor here names."""
    monkeypatch.setattr("asperity.study.evaluate.BOTH_PRESETS", ())


@pytest.fixture(scope="module")
def dry():
    return load_case(PAPER).with_overrides(DRY)


@pytest.fixture(scope="module")
def without_vibration(dry):
    """Case without vibration, which takes longer to compute than a small contact."""
    return dry.with_overrides({"vibration": "none"})


@pytest.fixture
def threads():
    with ThreadPoolExecutor(1) as executor:
        yield executor


def full_load_crf(modulus):
    """CRF by the paper's Eqs 2 to 4 for two bodies of this modulus [Pa], 500 N, 5.4 mm, 0.1 kg."""
    reduced = modulus / 2.0 / (1.0 - 0.3**2)
    depth = (9.0 * 500.0**2 / (16.0 * reduced**2 * 5.4e-3)) ** (1.0 / 3.0)
    return math.sqrt(1.5 * 500.0 / depth / 0.1) / (2.0 * math.pi)


def test_calibration_recovers_the_parameters_and_reports_unidentifiable_ones(
    dry, threads, tmp_path
):
    truth = dry.with_overrides(
        {"material.hardness": "1.3 GPa", "material.youngs_modulus": "230 GPa"}
    )
    simulated = run_study(
        plan_points(truth, [{"surface.sq": "3 um"}], seeding="common"), executor=threads
    ).table
    anchors = [
        Anchor(
            name="CAR",
            quantity="car_domain",
            sq=3e-6,
            value=float(simulated["car_domain"].iloc[0]),
            tolerance=0.01,
        ),
        Anchor(name="CRF", quantity="crf_hz", sq=3e-6, value=full_load_crf(230e9), tolerance=10.0),
    ]
    settings = CalibrationSettings(free=[CAP, MODULUS, FRICTION], **QUICK)
    found = calibrate(dry, anchors, settings=settings, out=tmp_path, executor=threads)
    cap, modulus, friction = found.parameters
    assert cap.value == pytest.approx(1.3, rel=0.03)
    assert modulus.value == pytest.approx(230.0, rel=0.02)
    assert found.misfit < 0.5
    assert found.fit["met"].all()
    assert (cap.identifiable, modulus.identifiable, friction.identifiable) == (True, True, False)
    assert friction.learnt == pytest.approx(0.0, abs=1e-12)
    assert found.unidentifiable == ("material.boundary_friction",)
    assert cap.low < 1.3 < cap.high
    assert found.directions[-1].weights == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert not found.directions[-1].determined
    # here E is determined by CRF ~ E^(1/3) alone: its standard deviation follows from that of CRF
    crf_alone = 3.0 * 10.0 / full_load_crf(230e9)
    half_width = 0.5 * math.log(modulus.high / modulus.low)
    assert half_width == pytest.approx(crf_alone, rel=0.4)
    assert "Not determined by the anchors: material.boundary_friction." in found.verdict()
    stated = found.calibrated.conditions
    assert stated.hardness == pytest.approx(1e9 * cap.value)
    assert stated.pair.youngs_moduli[0] == pytest.approx(1e9 * modulus.value)
    assert found.calibrated.grid.cells == dry.grid.cells
    json.dumps(found.scalars(), allow_nan=False)

    parts = sorted((tmp_path / "evaluations" / "parts").iterdir())
    again = calibrate(
        dry, anchors, settings=settings, out=tmp_path, executor=threads
    )  # resumed from the folder
    assert again.parameters == found.parameters
    assert sorted((tmp_path / "evaluations" / "parts").iterdir()) == parts


def test_contradictory_anchors_are_fitted_halfway_and_named(without_vibration, threads):
    """Two CARs for one hardness: the misfits are equal and opposite and trade off one to one."""
    anchors = [
        Anchor(name="little", quantity="car_domain", sq=2e-6, value=0.25, tolerance=0.01),
        Anchor(name="much", quantity="car_domain", sq=2e-6, value=0.35, tolerance=0.01),
    ]
    found = calibrate(
        without_vibration,
        anchors,
        settings=CalibrationSettings(free=[CAP], **QUICK),
        executor=threads,
    )
    miss = found.fit.set_index("anchor")["miss"]
    assert miss["little"] == pytest.approx(0.05, abs=0.01)
    assert miss["much"] == pytest.approx(-0.05, abs=0.01)
    assert found.misfit == pytest.approx(2.0 * 5.0**2, rel=0.1)
    assert {(trade.given_up, trade.relieved) for trade in found.trade_offs} == {
        ("little", "much"),
        ("much", "little"),
    }
    for trade in found.trade_offs:
        assert trade.misfit == pytest.approx(5.0**2, rel=0.4)
        assert trade.without < 0.05 * trade.misfit
    assert "0 of 2 anchors are met" in found.verdict()


def test_a_satisfied_bound_does_not_affect_the_fit(without_vibration, threads):
    car = Anchor(name="CAR", quantity="car_domain", sq=2e-6, value=0.3, tolerance=0.01)
    bound = Anchor(
        name="above", quantity="car_domain", sq=2e-6, value=0.1, tolerance=0.001, sense="at least"
    )
    found = calibrate(
        without_vibration,
        [car, bound],
        settings=CalibrationSettings(free=[CAP], **QUICK),
        executor=threads,
    )
    alone = calibrate(
        without_vibration,
        [car],
        settings=CalibrationSettings(free=[CAP], **QUICK),
        executor=threads,
    )
    assert found.parameters == alone.parameters
    assert found.fit.set_index("anchor").loc["above", "miss"] == 0.0
    infeasible = replace(bound, value=0.95)  # above the CAR at the lowest hardness
    pushed = calibrate(
        without_vibration,
        [infeasible],
        settings=CalibrationSettings(free=[CAP], **QUICK),
        executor=threads,
    )
    assert pushed.parameters[0].at_end
    assert pushed.parameters[0].value == pytest.approx(0.5, rel=0.03)
    assert "At the end of the range: material.hardness." in pushed.verdict()


def test_scatter_over_surfaces_adds_no_information():
    """Slopes of pure noise: products over different surfaces cancel, whereas squares accumulate."""
    rng = np.random.default_rng(3)
    learnt, naive = [], []
    for _ in range(200):
        slopes = MisfitSlopes(np.zeros((6, 4)), 5.0 * rng.standard_normal((6, 4, 1)))
        learnt.append(slopes.information[0, 0])
        naive.append(float(np.sum(slopes.mean**2)))
    assert np.mean(naive) == pytest.approx(4 * 25.0 / 6.0, rel=0.1)
    assert np.median(learnt) < 0.25 * np.mean(naive)
    assert np.mean(np.array(learnt) > 12.0) < 0.2  # rarely determined; with squares mostly
    assert np.mean(np.array(naive) > 12.0) > 0.5
    true = MisfitSlopes(np.zeros((6, 4)), 5.0 + 5.0 * rng.standard_normal((6, 4, 1)))
    assert true.information[0, 0] == pytest.approx(4 * 25.0, rel=0.5)


def test_information_of_a_linear_model_matches_least_squares():
    rng = np.random.default_rng(4)
    jacobian = rng.standard_normal((5, 3))
    slopes = MisfitSlopes(np.zeros((3, 5)), np.repeat(jacobian[None], 3, axis=0))
    assert slopes.information == pytest.approx(jacobian.T @ jacobian)
    covariance, scale = slopes.covariance(2)
    assert scale == 1.0
    assert covariance == pytest.approx(np.linalg.inv(jacobian.T @ jacobian + 12.0 * np.eye(3)))


def test_levels_match_the_anchors_and_close_ones_are_merged():
    anchors = [
        Anchor(name=f"{sq}", quantity="clr", sq=1e-6 * sq, since=None, value=0.5, tolerance=0.1)
        for sq in (0.5, 0.54, 2.5, 3.49, 3.5, 4.0)
    ]
    assert [1e6 * level for level in _levels(anchors, None)] == pytest.approx(
        [0.5, 0.54, 2.5, 3.5, 4.0]
    )
    assert _levels(anchors, [4e-6, 0.5e-6]) == (0.5e-6, 4e-6)
    with pytest.raises(BadInput, match=r"must span the anchors' Sq from 0\.5 to 4 um, got 1, 4"):
        _levels(anchors, [1e-6, 4e-6])


CRF = Anchor(name="CRF", quantity="crf_hz", sq=2e-6, value=3800.0, tolerance=10.0)


@pytest.mark.parametrize(
    ("anchors", "settings", "message"),
    [
        ([], {}, "needs a fitted anchor"),
        ([replace(CRF, fitted=False)], {}, "needs a fitted anchor"),
        (
            [Anchor(name="bend", quantity="split", value=2.0, tolerance=0.1)],
            {},
            "'bend' is a split",
        ),
        ([CRF], {"free": ["surface.sq=1 um..2 um"]}, "surface.sq cannot be varied"),
        ([CRF], {"free": []}, "nothing is varied"),
        ([CRF], {"seeds": 0}, "seeds must be 1 or more"),
        ([replace(CRF, quantity="crv_hz")], {}, "no column 'crv_hz'"),
    ],
)
def test_invalid_settings_are_refused(dry, threads, anchors, settings, message):
    chosen = CalibrationSettings(**{"free": [MODULUS], **QUICK, **settings})
    with pytest.raises(BadInput) as refused:
        calibrate(dry, anchors, settings=chosen, executor=threads)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_anchor_of_the_resonance_needs_a_vibration(dry):
    with pytest.raises(BadInput, match=r"'CRF' needs a vibration; add \[vibration\]"):
        calibrate(
            dry.with_overrides({"vibration": "none"}),
            [CRF],
            settings=CalibrationSettings(free=[MODULUS]),
        )


def test_the_command_writes_a_case_that_a_study_can_run(
    without_vibration, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path("case.toml").write_text(without_vibration.text, "utf-8")
    Path("anchors.toml").write_text(
        '[[anchor]]\nname = "CAR"\nquantity = "car_domain"\nsq = "2 um"\nvalue = 0.3\ntolerance ='
        " 0.01\n",
        "utf-8",
    )
    arguments = [
        "calibrate",
        "case.toml",
        "--anchors",
        "anchors.toml",
        "--free",
        CAP,
        "--cells",
        "32",
        "--surfaces",
        "1",
        "--screened",
        "2",
        "--starts",
        "1",
        "--workers",
        "1",
        "--out",
        "found",
    ]
    with pytest.raises(SystemExit) as end:
        main(arguments)
    out, err = capsys.readouterr()
    assert (end.value.code or 0, err) == (0, "")
    assert out.startswith("1 of 1 anchors are met within their tolerances with material.hardness ")
    calibrated = load_case("found/calibrated.toml")
    assert f"{1e-9 * calibrated.conditions.hardness:.3g} GPa" in out.splitlines()[0]
    assert calibrated.contents.study is not None
    assert Path("found/calibration.png").read_bytes().startswith(b"\x89PNG")
    assert Path("found/anchors.csv").read_text("utf-8").count("\n") == 4
    with pytest.raises(SystemExit):
        main([*arguments, "--json"])
    summary = json.loads(capsys.readouterr().out)
    assert summary["verdict"] == out.splitlines()[0]
    assert summary["parameters"][0]["identifiable"] is True
    assert summary["calibrated"] == str(Path("found", "calibrated.toml"))
