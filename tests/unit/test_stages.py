from typing import get_args

import numpy as np
import pytest
import scipy

from asperity.core.errors import BadInput
from asperity.resonance import IndicatorMethod
from asperity.resonance.indicators import INDICATOR_METHODS
from asperity.trend import Detector, StageErrors, split_stages
from asperity.trend.change_points import _precision
from asperity.trend.stages import STAGE_DETECTORS

SQ = np.array(
    [0.54, 0.87, 1.25, 1.31, 1.64, 1.68, 1.92, 2.17, 2.43, 2.90, 3.06, 3.49]
)  # the paper's samples [um]
SQ_STD = np.array([0.10, 0.08, 0.05, 0.05, 0.10, 0.06, 0.10, 0.08, 0.05, 0.05, 0.10, 0.06])
X = np.repeat(SQ, 5)


def knee(x):
    """The rig's ends, 2921.93 Hz at 0.54 um and 3811.88 Hz at 3.49 um, by way of 3640 Hz at
    1.8 um.
    """
    return np.interp(x, [0.54, 1.8, 3.49], [2921.93, 3640.0, 3811.88])


def saturating(x, length=0.8):
    grown = (1.0 - np.exp(-(x - 0.54) / length)) / (1.0 - np.exp(-(3.49 - 0.54) / length))
    return 2921.93 + (3811.88 - 2921.93) * grown


def trial(truth, seed, std=15.0):
    return split_stages(
        X,
        truth(X) + std * np.random.default_rng(seed).standard_normal(X.size),
        errors=StageErrors(crf_hz=std),
    )


def test_without_scatter_the_break_is_where_it_is():
    found = split_stages(SQ, knee(SQ))
    assert found.kind == "severe"
    assert found.split == pytest.approx(1.8, abs=0.01)
    assert found.slopes == pytest.approx(
        ((3640 - 2921.93) / 1.26, (3811.88 - 3640) / 1.69), rel=0.02
    )


def test_the_break_falls_between_the_papers_samples_and_its_interval_covers():
    found = [trial(knee, seed) for seed in range(60)]
    assert np.mean([1.68 <= one.split <= 1.92 for one in found]) >= 0.95
    covered = np.mean([one.interval[0] <= 1.8 <= one.interval[1] for one in found])
    assert 0.8 <= covered <= 1.0  # of 60: 90 %, two standard errors either way


@pytest.mark.parametrize("length", [0.5, 0.8, 2.0])
def test_a_smooth_curve_has_no_stages(length):
    kinds = [trial(lambda x: saturating(x, length), seed).kind for seed in range(30)]
    assert np.mean([kind == "no distinct stage" for kind in kinds]) >= 0.9


def test_a_constant_has_no_change():
    kinds = [trial(lambda x: np.full(x.size, 3400.0), seed).kind for seed in range(60)]
    assert np.mean([kind == "no change" for kind in kinds]) >= 0.95


def test_errors_in_roughness_widen_the_interval_and_soften_the_probability():
    exact = trial(knee, 1)
    rng = np.random.default_rng(1)
    crf = knee(X) + 15.0 * rng.standard_normal(X.size)
    vague = split_stages(X, crf, errors=StageErrors(crf_hz=15.0, x=np.repeat(SQ_STD, 5)))
    assert np.diff(vague.interval) > 2.0 * np.diff(exact.interval)
    at = X == 1.92  # 0.12 um, about one of its errors, behind the break
    assert 0.6 < vague.probability[at][0] < 0.97 < exact.probability[at][0]


def test_labels_follow_the_break():
    found = trial(knee, 4)
    assert np.array_equal(np.array(found.labels) == "severe", found.split < X)
    assert "Severe wear from 1.8" in found.verdict


def test_a_falling_resonance_is_running_in_and_not_severe_wear():
    found = trial(lambda x: 6600.0 - knee(x), 3)
    assert found.kind == "running-in"
    assert found.split == pytest.approx(1.8, abs=0.12)
    assert set(found.labels) == {"running-in", "steady"}
    assert np.all(found.probability == 0.0)


def test_order_of_recordings_does_not_matter_and_lost_ones_have_a_probability_too():
    crf = knee(X) + 15.0 * np.random.default_rng(6).standard_normal(X.size)
    crf[[3, 30]] = np.nan
    order = np.random.default_rng(7).permutation(X.size)
    straight, shuffled = split_stages(X, crf), split_stages(X[order], crf[order])
    assert shuffled.split == pytest.approx(straight.split, rel=1e-9)
    assert shuffled.probability == pytest.approx(straight.probability[order], abs=1e-9)
    assert np.isfinite(straight.probability).all()


def test_units_do_not_matter():
    crf = knee(X) + 15.0 * np.random.default_rng(8).standard_normal(X.size)
    micrometres, metres = split_stages(X, crf), split_stages(X * 1e-6, crf)
    assert metres.split == pytest.approx(1e-6 * micrometres.split, rel=1e-6)
    assert metres.evidence == pytest.approx(micrometres.evidence, abs=1e-6)


def test_a_sudden_bend_of_crfa_narrows_the_break_and_smooth_growth_does_not():
    rng = np.random.default_rng(9)
    crf = knee(X) + 30.0 * rng.standard_normal(X.size)
    scatter = np.exp(0.05 * rng.standard_normal(X.size))
    alone = split_stages(X, crf)
    with_bend = split_stages(X, crf, np.exp(3.0 * np.maximum(X - 1.8, 0.0)) * scatter)
    with_growth = split_stages(X, crf, np.exp(0.8 * X - 0.1 * X**2) * scatter)
    width = {
        "alone": np.diff(alone.interval),
        "bend": np.diff(with_bend.interval),
        "growth": np.diff(with_growth.interval),
    }
    assert width["bend"] < 0.5 * width["alone"]
    assert width["growth"] > 0.7 * width["alone"]
    assert alone.evidence == with_bend.evidence  # it decides nothing


def test_many_recordings_are_averaged_and_lose_nothing():
    x = np.linspace(0.0, 100.0, 3000)
    crf = np.interp(x, [0.0, 40.0, 100.0], [3000.0, 3500.0, 3600.0])
    found = split_stages(x, crf + 15.0 * np.random.default_rng(2).standard_normal(x.size), unit="h")
    assert found.split == pytest.approx(40.0, abs=1.0)
    assert found.scatter_hz < 5.0  # of means over a dozen recordings


def test_too_few_places_are_called_so():
    found = split_stages(np.repeat(SQ[:6], 5), knee(np.repeat(SQ[:6], 5)))
    assert found.kind == "too few"
    assert np.isnan(found.probability).all()  # no verdict is not a verdict of normal wear
    assert "got 6" in found.verdict


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"detector": "ruptures"}, "bayesian"),
        ({"crf_hz": np.ones(3)}, "one length"),
        ({"x": np.full(12, np.nan)}, "finite"),
        ({"errors": StageErrors(crf_hz=-1.0)}, "CRF deviation"),
        ({"errors": StageErrors(x=-1.0)}, "x deviation"),
        ({"errors": StageErrors(x=np.ones(3))}, "one number or 12"),
        ({"x": [], "crf_hz": []}, "got none"),
    ],
)
def test_what_cannot_be_meant_is_refused(changes, named):
    arguments = {"x": SQ, "crf_hz": knee(SQ), **changes}
    with pytest.raises(BadInput, match=named):
        split_stages(arguments.pop("x"), arguments.pop("crf_hz"), **arguments)


def test_the_tables_have_the_names_that_signatures_promise():
    assert set(STAGE_DETECTORS) == set(get_args(Detector))
    assert set(INDICATOR_METHODS) == set(get_args(IndicatorMethod))


def test_scatter_that_remembers_is_weighed_by_the_inverse_of_its_covariance():
    """The two diagonals beside the dense matrix and its determinant."""
    rng = np.random.default_rng(2)
    variance, memory, off = (
        rng.uniform(0.5, 2.0, (3, 9)),
        np.array([0.0, 0.4, 0.85]),
        rng.standard_normal(9),
    )
    told = _precision(variance, memory)
    for row, share in enumerate(memory):
        apart = np.abs(np.subtract.outer(np.arange(9), np.arange(9)))
        dense = share**apart * np.sqrt(np.outer(variance[row], variance[row]))
        sparse = (
            np.diag(told.own[row])
            + np.diag(told.next[row, 1:], 1)
            + np.diag(told.next[row, 1:], -1)
        )
        assert sparse @ dense == pytest.approx(np.eye(9), abs=1e-12)
        assert told.log_determinant[row] == pytest.approx(np.linalg.slogdet(2.0 * np.pi * dense)[1])
        assert off @ sparse @ off == pytest.approx(off @ np.linalg.solve(dense, off))


def test_the_interval_holds_the_break_where_scatter_remembers():
    """As if it did not, 63 % of these intervals held it."""
    x, held = np.arange(40.0), []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        scatter = scipy.signal.lfilter(
            [np.sqrt(1.0 - 0.7**2)], [1.0, -0.7], rng.standard_normal(140)
        )[100:]
        at = rng.uniform(12.0, 24.0)
        course = 40.0 * np.minimum(x, at) + 7.0 * np.maximum(x - at, 0.0)
        found = split_stages(x, 2922.0 + course + 15.0 * scatter)
        assert found.kind == "severe"
        held.append(found.interval[0] <= at <= found.interval[1])
    assert 0.8 <= np.mean(held) <= 1.0
