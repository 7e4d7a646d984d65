"""Wear curve and anchors, on tables of known statistics."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas
import pytest

from asperity.case import load_case
from asperity.core.errors import BadInput, UnreadableFile
from asperity.paper import (
    CRF_ENDS_HZ,
    PAPER_ANCHORS,
    SAMPLES_SQ_UM,
    TRENDS,
    Anchor,
    compare_with_anchors,
    load_anchors,
    rig_deviation,
    rig_prediction,
)
from asperity.results import solve_case
from asperity.study import WearCurve, curve_from_study, plan_points, run_study, wear_curve

EXAMPLES = Path(__file__).parents[2] / "examples"


def synthetic_curve(sq_um, seeds, **columns):
    """A curve with `seeds` surfaces per level; each column is a function of Sq [um] and the seed's
    index.
    """
    level, seed = (grid.ravel() for grid in np.meshgrid(sq_um, np.arange(seeds), indexing="ij"))
    table = pandas.DataFrame({"surface.sq": 1e-6 * level, "status": "done", "clr": 0.5})
    for name, law in columns.items():
        table[name] = law(level, seed)
    return WearCurve(np.unique(table["surface.sq"]), table)


def resonance_columns(law, scatter=2.0, seed=3):
    """Columns of both presets from a function of CRF against Sq [um]."""
    rng = np.random.default_rng(seed)
    columns = {}
    for preset in ("sound", "paper"):
        columns[f"crf_{preset}_hz"] = lambda sq, _: law(sq) + scatter * rng.standard_normal(sq.size)
        columns[f"crfa_{preset}"] = lambda sq, _: 1e-3 * sq**2
        columns[f"crf_std_{preset}_hz"] = lambda sq, _: np.full(sq.size, scatter)
    return columns


def test_means_deviations_and_intervals_follow_students_distribution():
    curve = synthetic_curve([1.0, 2.0], 3, crf_hz=lambda sq, seed: sq + (seed - 1.0))
    assert curve.mean("crf_hz") == pytest.approx([1.0, 2.0])
    assert curve.std("crf_hz") == pytest.approx([1.0, 1.0])
    reach = 2.91998558 / np.sqrt(3.0)  # printed tables: t of 2 degrees of freedom, two-sided 90 %
    assert curve.interval("crf_hz") == pytest.approx(
        np.array([[1.0 - reach, 1.0 + reach], [2.0 - reach, 2.0 + reach]])
    )


def test_interpolation_between_levels_is_linear_with_independent_errors():
    curve = synthetic_curve([1.0, 2.0], 3, crf_hz=lambda sq, seed: sq + (seed - 1.0))
    reach = 2.91998558 / np.sqrt(3.0)
    middle, low, high = curve.interpolate(1.25e-6, "crf_hz")
    deviation = reach * np.hypot(0.75, 0.25)
    assert (middle, low, high) == pytest.approx((1.25, 1.25 - deviation, 1.25 + deviation))
    assert curve.interpolate(2e-6, "crf_hz") == pytest.approx((2.0, 2.0 - reach, 2.0 + reach))
    assert np.isnan(curve.interpolate(2.1e-6, "crf_hz")).all()


def test_the_interval_of_a_share_lies_within_0_to_1_and_keeps_its_coverage():
    rng = np.random.default_rng(5)
    true, studies = 0.09, 60
    shares = rng.beta(1.0, 1.0 / true - 1.0, (studies, 3))  # mean 0.09, deviation 0.08
    curve = synthetic_curve(
        [float(level + 1) for level in range(studies)],
        3,
        clr=lambda sq, seed: shares[np.round(sq).astype(int) - 1, np.asarray(seed, int)],
        crfa=lambda sq, seed: shares[np.round(sq).astype(int) - 1, np.asarray(seed, int)],
    )
    clipped, unlimited = curve.interval("clr"), curve.interval("crfa")
    assert (unlimited[:, 0] < 0.0).mean() > 0.2  # Student's interval alone leaves the range
    assert clipped.min() >= 0.0
    assert clipped.max() <= 1.0
    covered = [(ends[:, 0] <= true) & (true <= ends[:, 1]) for ends in (clipped, unlimited)]
    assert (covered[0] == covered[1]).all()
    middle, low, high = curve.interpolate(1.5e-6, "clr")
    assert 0.0 <= low <= middle <= high <= 1.0


def test_failed_cases_and_missing_resonances_are_excluded_from_means():
    curve = synthetic_curve([1.0, 2.0], 3, car=lambda sq, seed: sq + seed)
    curve.table.loc[0, "status"] = "not converged"
    curve.table.loc[4, "car"] = np.nan
    assert curve.left_out == 1
    assert curve.mean("car") == pytest.approx([2.5, 3.0])
    assert curve.std("car") == pytest.approx([np.std([2, 3], ddof=1), np.std([2, 4], ddof=1)])
    with pytest.raises(BadInput, match="no column 'colour'"):
        curve.mean("colour")


def test_a_knee_is_located_and_a_smooth_curve_has_none():
    sq = np.arange(0.5, 4.05, 0.25)
    knee = synthetic_curve(
        sq, 3, **resonance_columns(lambda sq: 3600.0 + np.where(sq < 1.8, 500.0, 60.0) * (sq - 1.8))
    )
    for preset in ("sound", "paper"):
        stages = knee.stages[preset]
        assert stages.kind == "severe"
        assert stages.split == pytest.approx(1.8, abs=0.1)
    smooth = synthetic_curve(
        sq, 3, **resonance_columns(lambda sq: 3800.0 - 900.0 * np.exp(-(sq - 0.5) / 0.8))
    )
    assert not smooth.stages["sound"].found
    assert "from 50 to 50 %" in smooth.verdict()


def test_anchors_report_their_deviation_and_whether_it_is_within_tolerance():
    curve = synthetic_curve([0.5, 2.5, 4.0], 4, car=lambda sq, seed: 0.1 * sq + 0.01 * (seed - 1.5))
    common = {"quantity": "car", "tolerance": 0.02}
    anchors = [
        Anchor(name="met", sq=2.5e-6, value=0.26, **common),
        Anchor(name="possible", sq=2.5e-6, value=0.285, **common),
        Anchor(name="missed", sq=2.5e-6, value=0.5, **common),
        Anchor(name="change", since=0.5e-6, sq=2.5e-6, value=0.2, **common),
        Anchor(name="enough", sq=4e-6, value=0.3, sense="at least", **common),
        Anchor(name="too much", sq=4e-6, value=0.3, sense="at most", **common),
        Anchor(name="not covered", sq=5e-6, value=0.3, **common),
        Anchor(name="no split", quantity="split", value=2.5, tolerance=0.1),
    ]
    table = compare_with_anchors(curve, anchors).set_index("anchor")
    assert table["miss"].fillna(9.0).round(9).to_dict() == {
        "met": -0.01,
        "possible": -0.035,
        "missed": -0.25,
        "change": 0.0,
        "enough": 0.0,
        "too much": 0.1,
        "not covered": 9.0,
        "no split": 9.0,
    }
    assert list(table.index[table["met"]]) == ["met", "change", "enough"]
    assert list(table.index[table["possible"]]) == ["met", "possible", "change", "enough"]


def test_the_papers_anchors_equal_its_printed_numbers():
    text = (Path(__file__).parents[2].parent / "shared" / "paper.txt").resolve()
    if not text.exists():
        pytest.skip("the text of the paper is missing")
    printed = text.read_text("utf-8")
    for number in ("5.57%", "59.22%", "2921.93 Hz", "3811.88 Hz", "1.68 μm", "1.92 μm"):
        assert number in printed
    values = {anchor.name: anchor.value for anchor in PAPER_ANCHORS}
    assert (
        values["CAR of the domain at 0.5 um"] == values["CAR of the Hertz zone at 0.5 um"] == 0.0557
    )
    assert values["CAR of the domain at 2.5 um"] == 0.5922
    assert (values["CRF at 0.54 um, rig"], values["CRF at 3.49 um, rig"]) == (2921.93, 3811.88)
    assert values["split, rig"] == pytest.approx((1.68 + 1.92) / 2.0)


def test_a_curve_on_the_rigs_trend_has_no_deviation():
    levels = np.linspace(0.54, 3.49, 60)
    curve = synthetic_curve(
        levels, 2, **resonance_columns(lambda sq: TRENDS["smooth"](1e-6 * sq), scatter=0.0)
    )
    deviation = rig_deviation(curve)
    assert deviation["ends"] == pytest.approx(0.0, abs=0.1)
    assert deviation["smooth"] == pytest.approx(0.0, abs=0.5)
    assert deviation["knee"] > 20.0
    table = rig_prediction(curve)
    assert table["sq_um"].tolist() == list(SAMPLES_SQ_UM)
    assert table["printed_hz"].dropna().tolist() == list(CRF_ENDS_HZ)


def test_wear_curve_solves_each_level_with_each_seed():
    dry = {
        "lubricant": "none",
        "grid.x": [-1.9, 1.9],
        "grid.cells": [24, 24],
        "vibration.duration": "0.1 s",
    }
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {**dry, "surface.correlation_length": "30 um"}
    )
    with ThreadPoolExecutor(1) as executor:
        curve = wear_curve(case, sq_values=[2e-6, 1e-6], seeds=[4, 5], executor=executor)
    assert curve.sq == pytest.approx([1e-6, 2e-6])
    expected = [
        solve_case(case.with_overrides({"surface.sq": sq, "surface.seed": seed})).state.car
        for sq in ("1 um", "2 um")
        for seed in (4, 5)
    ]
    assert curve.table["car"].tolist() == expected
    assert curve.mean("car") == pytest.approx([np.mean(expected[:2]), np.mean(expected[2:])])
    with pytest.raises(BadInput, match="Sq must be positive"):
        wear_curve(case, sq_values=[-1e-6], seeds=1)


def test_a_study_of_another_quantity_has_no_wear_curve():
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {"lubricant": "none", "grid.cells": [32, 24]}
    )
    with ThreadPoolExecutor(1) as executor:
        result = run_study(plan_points(case, [{"contact.load": "200 N"}]), executor=executor)
    with pytest.raises(
        BadInput, match=r"needs a study that varies surface\.sq alone, got contact\.load"
    ):
        curve_from_study(result)


def test_user_anchors_are_read_and_invalid_ones_are_refused(tmp_path):
    file = tmp_path / "anchors.toml"
    own = (
        '[[anchor]]\nname = "ours"\nquantity = "clr"\nsq = "0.6 um"\nvalue = 0.2\ntolerance ='
        " 0.05\n"
    )
    file.write_text(own)
    assert load_anchors(file) == (
        Anchor(name="ours", quantity="clr", sq=0.6e-6, value=0.2, tolerance=0.05),
    )
    for text, sentence in [
        (own.replace("0.05", "0.0"), "tolerance"),
        (own.replace('"0.6 um"', "0.6"), "bare number 0.6"),
        (own.replace('sq = "0.6 um"\n', ""), "needs sq, a length"),
        (own + "colour = 1\n", "colour"),
        ("", "anchor"),
    ]:
        file.write_text(text)
        with pytest.raises(BadInput, match=sentence):
            load_anchors(file)
    file.write_text("[[")
    with pytest.raises(UnreadableFile, match="cannot be read as TOML"):
        load_anchors(file)
