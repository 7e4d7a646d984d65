"""Wear stages from the damping of the contact line, and from CRF and damping jointly."""

import re

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.resonance import Resonance, damping_objection, line_shape, no_resonance
from asperity.trend import StageErrors, split_stages

SQ = np.array(
    [0.54, 0.87, 1.25, 1.31, 1.64, 1.68, 1.92, 2.17, 2.43, 2.90, 3.06, 3.49]
)  # the paper's samples [um]
X = np.repeat(SQ, 5)
SHARE = 0.05  # relative deviation of a damping ratio
HERTZ = 15.0


def narrowing(x):
    """Log damping falls linearly to 1.8 um, then slowly: 0.04 via 0.014 to 0.012."""
    return np.exp(np.interp(x, [0.54, 1.8, 3.49], np.log([0.04, 0.014, 0.012])))


def level(x, value=3400.0):
    return np.full(np.shape(x), value)


def rising(x):
    return np.interp(x, [0.54, 1.8, 3.49], [2921.93, 3640.0, 3811.88])


def curve(x, length=0.8):
    """Falls to a third without a break."""
    return 0.012 + 0.028 * np.exp(-(x - 0.54) / length)


def trial(seed, *, crf=level, damping=narrowing, source="damping", x=X, **changes):
    rng = np.random.default_rng(seed)
    return split_stages(
        x,
        crf(x) + HERTZ * rng.standard_normal(x.size),
        damping_ratio=damping(x) * np.exp(SHARE * rng.standard_normal(x.size)),
        errors=StageErrors(crf_hz=HERTZ, damping_ratio=SHARE * damping(x)),
        source=source,
        **changes,
    )


def test_damping_that_falls_and_levels_off_is_severe_wear_from_there():
    stages = split_stages(SQ, level(SQ), damping_ratio=narrowing(SQ), source="damping")
    assert (stages.kind, stages.source) == ("severe", "damping")
    assert stages.split == pytest.approx(1.8, abs=0.01)
    assert stages.damping == pytest.approx((0.04, 0.014, 0.012), rel=0.01)
    assert np.isnan(stages.slopes).all()
    assert np.isnan(stages.scatter_hz)


def test_the_break_is_located_and_its_interval_covers():
    results = [trial(seed) for seed in range(60)]
    assert {result.kind for result in results} == {"severe"}
    covered = np.mean([result.interval[0] <= 1.8 <= result.interval[1] for result in results])
    assert 0.8 <= covered <= 1.0  # 60 trials: 90 % minus two standard errors


def test_deviations_of_a_damping_ratio_are_relative():
    """Ratios near 0.04 with a known deviation of half their size, not 0.02 of a logarithm."""
    ratio, std = narrowing(SQ), 0.01 * narrowing(SQ)
    ratio[:2] *= 0.5
    std[:2] = 0.6 * ratio[:2]
    stages = split_stages(
        SQ, level(SQ), damping_ratio=ratio, errors=StageErrors(damping_ratio=std), source="damping"
    )
    assert stages.kind == "severe"
    assert stages.damping[0] == pytest.approx(0.04, rel=0.1)


def test_rising_damping_is_running_in():
    stages = trial(1, damping=lambda x: 0.0005 / narrowing(x))
    assert stages.kind == "running-in"
    assert np.all(stages.probability == 0.0)


def test_a_smooth_fall_has_no_stage_and_level_damping_no_change():
    assert (
        np.mean([trial(seed, damping=curve).kind == "no distinct stage" for seed in range(30)])
        >= 0.9
    )
    results = [trial(seed, damping=lambda x: level(x, 0.02)) for seed in range(60)]
    assert np.mean([result.kind == "no change" for result in results]) >= 0.95
    value, error = re.search(r"damping stays at ([\d.]+) ± ([\d.]+)", results[0].verdict).groups()
    assert float(value) == pytest.approx(0.02, abs=3.0 * float(error))
    assert len(value) == len(error)  # rounded to its deviation
    assert "CRF" not in results[0].verdict


def test_a_crf_only_result_is_independent_of_the_damping():
    crf_only = split_stages(X, rising(X), errors=StageErrors(crf_hz=HERTZ))
    with_damping = split_stages(
        X, rising(X), damping_ratio=curve(X), errors=StageErrors(crf_hz=HERTZ, damping_ratio=0.001)
    )
    assert with_damping.source == crf_only.source == "crf"
    assert (with_damping.verdict, with_damping.split, with_damping.evidence) == (
        crf_only.verdict,
        crf_only.split,
        crf_only.evidence,
    )


def test_the_joint_break_is_more_precise_than_either():
    widths = {
        source: np.mean(
            [np.diff(trial(seed, crf=rising, source=source).interval) for seed in range(20)]
        )
        for source in ("crf", "damping", "both")
    }
    assert widths["both"] < 0.95 * min(widths["crf"], widths["damping"])
    stages = trial(3, crf=rising, source="both")
    assert "CRF rises" in stages.verdict
    assert "damping falls from 0.0" in stages.verdict


def test_a_break_of_the_damping_only_is_reported_as_such():
    stages = trial(1, source="both")
    assert stages.kind == "severe"
    assert stages.interval == pytest.approx(trial(1).interval, abs=0.05)
    assert "in the damping alone" in stages.verdict
    assert stages.evidence["break in the damping alone"] == 0.0
    assert stages.evidence["no change"] > 6.0


def test_breaks_at_different_locations_are_not_combined():
    def early(x):
        return np.interp(x, [0.54, 1.31, 3.49], [2921.93, 3640.0, 3811.88])

    def late(x):
        return np.exp(np.interp(x, [0.54, 2.6, 3.49], np.log([0.04, 0.01, 0.0099])))

    stages = trial(2, crf=early, damping=late, source="both")
    assert stages.kind == "no distinct stage"
    assert "CRF at 1.3" in stages.verdict
    assert "damping at 2.5" in stages.verdict
    assert stages.evidence["breaks apart"] == 0.0
    assert stages.evidence["break in both"] > stages.evidence["breaks apart"] + 6.0
    assert np.isnan(stages.probability).all()


def test_contradicting_indicators_have_no_stage():
    stages = trial(1, crf=rising, damping=lambda x: 0.0005 / narrowing(x), source="both")
    assert stages.kind == "disagree"
    assert not stages.found
    assert np.isnan(stages.probability).all()
    assert set(stages.labels) == {"none"}
    assert "CRF rises" in stages.verdict
    assert "damping rises" in stages.verdict


def test_constant_damping_does_not_contradict_a_straight_crf():
    """Scatter may suggest a break in a straight CRF or constant damping; none is reported."""

    def straight(x):
        return np.interp(x, [0.54, 3.49], [2900.0, 3750.0])

    results = [
        trial(seed, crf=straight, damping=lambda x: level(x, 0.02), source="both", x=SQ)
        for seed in range(20)
    ]
    assert {result.kind for result in results} == {"no distinct stage"}


@pytest.mark.parametrize("source", ["damping", "both"])
def test_damping_at_too_few_locations_is_undetermined(source):
    ratio = np.where(SQ < 2.0, narrowing(SQ), np.nan)
    ratio[0] = np.nan
    stages = split_stages(SQ, rising(SQ), damping_ratio=ratio, source=source)
    assert stages.kind == "too few"
    assert stages.verdict.startswith("Too few points: ")
    assert "7 different x, got 6" in stages.verdict
    assert np.isnan(stages.probability).all()


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"source": "damping"}, "needs damping ratios"),
        ({"source": "width", "damping_ratio": SQ}, "crf, damping, both"),
        ({"source": "both", "damping_ratio": SQ[:3]}, "of one length"),
        ({"source": "both", "damping_ratio": -SQ}, "must be positive"),
        (
            {"source": "both", "damping_ratio": SQ, "errors": StageErrors(damping_ratio=-1.0)},
            "damping deviation must be 0 or more",
        ),
    ],
)
def test_invalid_input_is_refused(changes, named):
    with pytest.raises(BadInput, match=named):
        split_stages(SQ, rising(SQ), **changes)


# Validity of a line's width as damping
# -------------------------------------------------------------------------


def fitted(ratio, std, *, found=True):
    return Resonance(
        found=found,
        reason="",
        band_hz=(2e3, 4e3),
        method="likelihood",
        crf_hz=3000.0,
        damping_ratio=ratio,
        damping_ratio_std=std,
    )


def test_a_wide_and_precise_line_has_a_damping_ratio():
    assert damping_objection(fitted(0.02, 0.002), resolution_hz=6.0) is None


def test_a_line_whose_crest_is_masked_by_a_tone_has_none():
    assert "20 % of the line" in damping_objection(fitted(0.02, 0.002), 6.0, taken_out=0.2)
    assert damping_objection(fitted(0.02, 0.002), 6.0, taken_out=0.05) is None


@pytest.mark.parametrize(
    ("resonance", "message"),
    [
        (no_resonance("nothing moves", (2e3, 4e3), "joint"), "nothing moves"),
        (fitted(np.nan, np.nan), "method likelihood fits no width"),
        (fitted(0.02, np.nan), "without a standard deviation"),
        (fitted(0.02, 0.011), "0.020 ± 0.011"),
        (fitted(0.003, 0.0003), "18.0 Hz wide"),
    ],
)
def test_an_invalid_width_is_reported(resonance, message):
    assert message in damping_objection(resonance, resolution_hz=6.0)


def test_the_bias_of_the_narrowest_line_is_as_stated():
    """Half-power width of a line four resolutions wide under a Hann window (1.5 lines)."""
    per_line, width = 400, 6.0  # grid points per spectral line; width in lines
    lines = np.arange(-40 * per_line, 40 * per_line + 1) / per_line
    f0, zeta = 3000.0, width / 2.0 / 3000.0
    line = line_shape(f0 + lines, f0, zeta)
    transform = np.sinc(lines) / np.where(np.abs(np.abs(lines) - 1.0) < 1e-9, 1.0, 1.0 - lines**2)
    transform[np.abs(np.abs(lines) - 1.0) < 1e-9] = 0.5
    windowed = np.convolve(line, transform**2, mode="same")
    above_half = lines[windowed > 0.5 * windowed.max()]
    assert np.ptp(above_half) / width == pytest.approx(1.06, abs=0.02)
