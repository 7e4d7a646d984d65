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
    """The rig's ends, 2921.93 Hz at 0.54 um and 3811.88 Hz at 3.49 um, via 3640 Hz at 1.8 um."""
    return np.interp(x, [0.54, 1.8, 3.49], [2921.93, 3640.0, 3811.88])


def saturating(x, length=0.8):
    growth = (1.0 - np.exp(-(x - 0.54) / length)) / (1.0 - np.exp(-(3.49 - 0.54) / length))
    return 2921.93 + (3811.88 - 2921.93) * growth


def trial(truth, seed, std=15.0):
    return split_stages(
        X,
        truth(X) + std * np.random.default_rng(seed).standard_normal(X.size),
        errors=StageErrors(crf_hz=std),
    )


def test_without_scatter_the_break_is_exact():
    stages = split_stages(SQ, knee(SQ))
    assert stages.kind == "severe"
    assert stages.split == pytest.approx(1.8, abs=0.01)
    assert stages.slopes == pytest.approx(
        ((3640 - 2921.93) / 1.26, (3811.88 - 3640) / 1.69), rel=0.02
    )


def test_the_break_falls_between_the_papers_samples_and_its_interval_covers():
    results = [trial(knee, seed) for seed in range(60)]
    assert np.mean([1.68 <= result.split <= 1.92 for result in results]) >= 0.95
    covered = np.mean([result.interval[0] <= 1.8 <= result.interval[1] for result in results])
    assert 0.8 <= covered <= 1.0  # 60 trials: 90 % minus two standard errors


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
    location = X == 1.92  # 0.12 um after the break, about one roughness error
    assert 0.6 < vague.probability[location][0] < 0.97 < exact.probability[location][0]


def test_labels_follow_the_break():
    stages = trial(knee, 4)
    assert np.array_equal(np.array(stages.labels) == "severe", stages.split < X)
    assert "Severe wear from 1.8" in stages.verdict


def test_a_falling_resonance_is_running_in_and_not_severe_wear():
    stages = trial(lambda x: 6600.0 - knee(x), 3)
    assert stages.kind == "running-in"
    assert stages.split == pytest.approx(1.8, abs=0.12)
    assert set(stages.labels) == {"running-in", "steady"}
    assert np.all(stages.probability == 0.0)


def test_order_is_irrelevant_and_failed_recordings_have_a_probability():
    crf = knee(X) + 15.0 * np.random.default_rng(6).standard_normal(X.size)
    crf[[3, 30]] = np.nan
    order = np.random.default_rng(7).permutation(X.size)
    straight, shuffled = split_stages(X, crf), split_stages(X[order], crf[order])
    assert shuffled.split == pytest.approx(straight.split, rel=1e-9)
    assert shuffled.probability == pytest.approx(straight.probability[order], abs=1e-9)
    assert np.isfinite(straight.probability).all()


def test_results_are_independent_of_units():
    crf = knee(X) + 15.0 * np.random.default_rng(8).standard_normal(X.size)
    micrometres, metres = split_stages(X, crf), split_stages(X * 1e-6, crf)
    assert metres.split == pytest.approx(1e-6 * micrometres.split, rel=1e-6)
    assert metres.evidence == pytest.approx(micrometres.evidence, abs=1e-6)


def test_a_sudden_bend_of_crfa_narrows_the_break_and_smooth_growth_does_not():
    rng = np.random.default_rng(9)
    crf = knee(X) + 30.0 * rng.standard_normal(X.size)
    scatter = np.exp(0.05 * rng.standard_normal(X.size))
    crf_only = split_stages(X, crf)
    with_bend = split_stages(X, crf, np.exp(3.0 * np.maximum(X - 1.8, 0.0)) * scatter)
    with_growth = split_stages(X, crf, np.exp(0.8 * X - 0.1 * X**2) * scatter)
    width = {
        "alone": np.diff(crf_only.interval),
        "bend": np.diff(with_bend.interval),
        "growth": np.diff(with_growth.interval),
    }
    assert width["bend"] < 0.5 * width["alone"]
    assert width["growth"] > 0.7 * width["alone"]
    assert crf_only.evidence == with_bend.evidence  # without influence


def test_many_recordings_are_averaged_without_loss():
    x = np.linspace(0.0, 100.0, 3000)
    crf = np.interp(x, [0.0, 40.0, 100.0], [3000.0, 3500.0, 3600.0])
    stages = split_stages(
        x, crf + 15.0 * np.random.default_rng(2).standard_normal(x.size), unit="h"
    )
    assert stages.split == pytest.approx(40.0, abs=1.0)
    assert stages.scatter_hz < 5.0  # means over a dozen recordings


def test_too_few_locations_are_reported():
    stages = split_stages(np.repeat(SQ[:6], 5), knee(np.repeat(SQ[:6], 5)))
    assert stages.kind == "too few"
    assert np.isnan(
        stages.probability
    ).all()  # an undetermined result is not a finding of normal wear
    assert "got 6" in stages.verdict


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
def test_invalid_input_is_refused(changes, named):
    arguments = {"x": SQ, "crf_hz": knee(SQ), **changes}
    with pytest.raises(BadInput, match=named):
        split_stages(arguments.pop("x"), arguments.pop("crf_hz"), **arguments)


def test_tables_have_the_names_promised_by_signatures():
    assert set(STAGE_DETECTORS) == set(get_args(Detector))
    assert set(INDICATOR_METHODS) == set(get_args(IndicatorMethod))


def test_autocorrelated_scatter_is_weighted_by_the_inverse_covariance():
    """The two diagonals against the dense matrix and its determinant."""
    rng = np.random.default_rng(2)
    variance, memory, residual = (
        rng.uniform(0.5, 2.0, (3, 9)),
        np.array([0.0, 0.4, 0.85]),
        rng.standard_normal(9),
    )
    precision = _precision(variance, memory)
    for row, share in enumerate(memory):
        lag = np.abs(np.subtract.outer(np.arange(9), np.arange(9)))
        dense = share**lag * np.sqrt(np.outer(variance[row], variance[row]))
        sparse = (
            np.diag(precision.own[row])
            + np.diag(precision.next[row, 1:], 1)
            + np.diag(precision.next[row, 1:], -1)
        )
        assert sparse @ dense == pytest.approx(np.eye(9), abs=1e-12)
        assert precision.log_determinant[row] == pytest.approx(
            np.linalg.slogdet(2.0 * np.pi * dense)[1]
        )
        assert residual @ sparse @ residual == pytest.approx(
            residual @ np.linalg.solve(dense, residual)
        )


def test_the_interval_covers_the_break_under_autocorrelated_scatter():
    """Ignoring autocorrelation, 63 % of these intervals covered it."""
    x, covered = np.arange(40.0), []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        scatter = scipy.signal.lfilter(
            [np.sqrt(1.0 - 0.7**2)], [1.0, -0.7], rng.standard_normal(140)
        )[100:]
        location = rng.uniform(12.0, 24.0)
        course = 40.0 * np.minimum(x, location) + 7.0 * np.maximum(x - location, 0.0)
        stages = split_stages(x, 2922.0 + course + 15.0 * scatter)
        assert stages.kind == "severe"
        covered.append(stages.interval[0] <= location <= stages.interval[1])
    assert 0.8 <= np.mean(covered) <= 1.0
