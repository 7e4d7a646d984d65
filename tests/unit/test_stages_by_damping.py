"""Stages read from the damping of the contact's line, and from CRF and damping together."""

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
    """The logarithm falls straight to 1.8 um and hardly after: 0.04 by way of 0.014 to 0.012."""
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


def test_damping_that_falls_and_then_stands_is_severe_wear_from_where_it_stands():
    found = split_stages(SQ, level(SQ), damping_ratio=narrowing(SQ), source="damping")
    assert (found.kind, found.source) == ("severe", "damping")
    assert found.split == pytest.approx(1.8, abs=0.01)
    assert found.damping == pytest.approx((0.04, 0.014, 0.012), rel=0.01)
    assert np.isnan(found.slopes).all()
    assert np.isnan(found.scatter_hz)


def test_its_break_is_where_it_was_put_and_the_interval_covers():
    found = [trial(seed) for seed in range(60)]
    assert {one.kind for one in found} == {"severe"}
    covered = np.mean([one.interval[0] <= 1.8 <= one.interval[1] for one in found])
    assert 0.8 <= covered <= 1.0  # of 60: 90 %, two standard errors either way


def test_deviations_of_a_ratio_count_by_its_size():
    """Ratios near 0.04 that are off by half, and known to be: by their size, not by 0.02 of a
    logarithm.
    """
    ratio, std = narrowing(SQ), 0.01 * narrowing(SQ)
    ratio[:2] *= 0.5
    std[:2] = 0.6 * ratio[:2]
    found = split_stages(
        SQ, level(SQ), damping_ratio=ratio, errors=StageErrors(damping_ratio=std), source="damping"
    )
    assert found.kind == "severe"
    assert found.damping[0] == pytest.approx(0.04, rel=0.1)


def test_damping_that_rises_is_running_in():
    found = trial(1, damping=lambda x: 0.0005 / narrowing(x))
    assert found.kind == "running-in"
    assert np.all(found.probability == 0.0)


def test_a_smooth_fall_has_no_stage_and_level_damping_no_change():
    assert (
        np.mean([trial(seed, damping=curve).kind == "no distinct stage" for seed in range(30)])
        >= 0.9
    )
    still = [trial(seed, damping=lambda x: level(x, 0.02)) for seed in range(60)]
    assert np.mean([one.kind == "no change" for one in still]) >= 0.95
    value, error = re.search(r"damping stays at ([\d.]+) ± ([\d.]+)", still[0].verdict).groups()
    assert float(value) == pytest.approx(0.02, abs=3.0 * float(error))
    assert len(value) == len(error)  # the value ends where its deviation does
    assert "CRF" not in still[0].verdict


def test_crf_alone_is_what_it_was_whatever_the_damping():
    plain = split_stages(X, rising(X), errors=StageErrors(crf_hz=HERTZ))
    beside = split_stages(
        X, rising(X), damping_ratio=curve(X), errors=StageErrors(crf_hz=HERTZ, damping_ratio=0.001)
    )
    assert beside.source == plain.source == "crf"
    assert (beside.verdict, beside.split, beside.evidence) == (
        plain.verdict,
        plain.split,
        plain.evidence,
    )


def test_together_they_know_the_break_better_than_either():
    widths = {
        source: np.mean(
            [np.diff(trial(seed, crf=rising, source=source).interval) for seed in range(20)]
        )
        for source in ("crf", "damping", "both")
    }
    assert widths["both"] < 0.95 * min(widths["crf"], widths["damping"])
    found = trial(3, crf=rising, source="both")
    assert "CRF rises" in found.verdict
    assert "damping falls from 0.0" in found.verdict


def test_a_break_of_the_damping_alone_is_said_to_be_that():
    found = trial(1, source="both")
    assert found.kind == "severe"
    assert found.interval == pytest.approx(trial(1).interval, abs=0.05)
    assert "in the damping alone" in found.verdict
    assert found.evidence["break in the damping alone"] == 0.0
    assert found.evidence["no change"] > 6.0


def test_breaks_at_different_places_are_not_one_break():
    def early(x):
        return np.interp(x, [0.54, 1.31, 3.49], [2921.93, 3640.0, 3811.88])

    def late(x):
        return np.exp(np.interp(x, [0.54, 2.6, 3.49], np.log([0.04, 0.01, 0.0099])))

    found = trial(2, crf=early, damping=late, source="both")
    assert found.kind == "no distinct stage"
    assert "CRF at 1.3" in found.verdict
    assert "damping at 2.5" in found.verdict
    assert found.evidence["breaks apart"] == 0.0
    assert found.evidence["break in both"] > found.evidence["breaks apart"] + 6.0
    assert np.isnan(found.probability).all()


def test_indicators_that_contradict_each_other_have_no_stage():
    found = trial(1, crf=rising, damping=lambda x: 0.0005 / narrowing(x), source="both")
    assert found.kind == "disagree"
    assert not found.found
    assert np.isnan(found.probability).all()
    assert set(found.labels) == {"none"}
    assert "CRF rises" in found.verdict
    assert "damping rises" in found.verdict


def test_a_damping_that_holds_contradicts_nothing():
    """A break in the damping alone may be the likeliest break of a CRF that goes straight: it is
    none for that.
    """

    def straight(x):
        return np.interp(x, [0.54, 3.49], [2900.0, 3750.0])

    found = [
        trial(seed, crf=straight, damping=lambda x: level(x, 0.02), source="both", x=SQ)
        for seed in range(20)
    ]
    assert {one.kind for one in found} == {"no distinct stage"}


@pytest.mark.parametrize("source", ["damping", "both"])
def test_damping_known_at_too_few_places_is_not_determined(source):
    ratio = np.where(SQ < 2.0, narrowing(SQ), np.nan)
    ratio[0] = np.nan
    found = split_stages(SQ, rising(SQ), damping_ratio=ratio, source=source)
    assert found.kind == "too few"
    assert found.verdict.startswith("Too few points: ")
    assert "7 different x, got 6" in found.verdict
    assert np.isnan(found.probability).all()


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
def test_what_cannot_be_meant_is_refused(changes, named):
    with pytest.raises(BadInput, match=named):
        split_stages(SQ, rising(SQ), **changes)


# Whether a line's width is its damping at all
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


def test_a_line_that_is_wide_and_well_known_has_a_damping_ratio():
    assert damping_objection(fitted(0.02, 0.002), resolution_hz=6.0) is None


def test_a_line_that_lost_its_crest_to_a_tone_has_none():
    assert "20 % of the line" in damping_objection(fitted(0.02, 0.002), 6.0, taken_out=0.2)
    assert damping_objection(fitted(0.02, 0.002), 6.0, taken_out=0.05) is None


@pytest.mark.parametrize(
    ("resonance", "said"),
    [
        (no_resonance("nothing moves", (2e3, 4e3), "joint"), "nothing moves"),
        (fitted(np.nan, np.nan), "method likelihood fits no width"),
        (fitted(0.02, np.nan), "without a standard deviation"),
        (fitted(0.02, 0.011), "0.020 ± 0.011"),
        (fitted(0.003, 0.0003), "18.0 Hz wide"),
    ],
)
def test_a_width_that_is_no_damping_is_told(resonance, said):
    assert said in damping_objection(resonance, resolution_hz=6.0)


def test_the_narrowest_line_allowed_is_seen_too_wide_by_what_is_stated():
    """A line four resolutions wide behind a Hann window of that resolution (1.5 lines): its
    half-power width.
    """
    per_line, width = 400, 6.0  # grid points a spectral line; width in lines
    lines = np.arange(-40 * per_line, 40 * per_line + 1) / per_line
    f0, zeta = 3000.0, width / 2.0 / 3000.0
    line = line_shape(f0 + lines, f0, zeta)
    transform = np.sinc(lines) / np.where(np.abs(np.abs(lines) - 1.0) < 1e-9, 1.0, 1.0 - lines**2)
    transform[np.abs(np.abs(lines) - 1.0) < 1e-9] = 0.5
    seen = np.convolve(line, transform**2, mode="same")
    above = lines[seen > 0.5 * seen.max()]
    assert np.ptp(above) / width == pytest.approx(1.06, abs=0.02)
