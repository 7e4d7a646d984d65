"""What to run next: against the closed form of a linear machine, and what a repeat tells."""

from dataclasses import replace

import numpy as np
import pytest

from asperity.inference import (
    ChannelPrediction,
    ForwardModel,
    LogMeasurement,
    Observation,
    ObservationPoint,
    infer_observations,
)
from asperity.inference.likelihood import (
    EXPONENT_STD,
    SIZES,
    emulated_errors,
    law_errors,
    log_likelihood,
    predictive_mixture,
)
from asperity.inference.next_point import _mutual_information, at_point, expected_information
from asperity.inference.observations import point_similarity
from support.emulated import formula_emulator, formula_setting

HERE = (500.0, 0.8)
SLOPES = np.array(
    [1.0, 1.0, 0.4]
)  # of ln CRF with the one unknown of a linear machine, at three points
LOADS = (500.0, 500.0, 800.0)


def heard_once(setting, emulator, times=1):
    """A contact with unknowns in the middle of their priors, heard so often at one point."""
    forward = ForwardModel(setting, emulator, (ObservationPoint(*HERE),))
    shown = forward.predict(np.zeros((1, forward.dims)), "hertz-point")
    crf, damping = (float(np.exp(values[0, 0])) for values in (shown.crf, shown.damping))
    one = Observation(
        load_n=HERE[0],
        entrainment_m_s=HERE[1],
        crf_hz=crf,
        crf_std_hz=1e-3 * crf,
        damping_ratio=damping,
        damping_std=0.03 * damping,
    )
    return [one] * times


@pytest.fixture(scope="module")
def setting():
    return formula_setting()


@pytest.fixture(scope="module")
def emulator(setting):
    return formula_emulator(setting)


def test_a_repeat_tells_a_small_part_of_what_the_first_told(setting, emulator):
    """And little where load is stated a little differently, as that is hardly another place."""
    found = infer_observations(setting, emulator, heard_once(setting, emulator))
    nothing = infer_observations(setting, emulator, [])
    first = expected_information(nothing.forward, nothing.draws, (HERE,), seed=0)[
        0
    ].information_bits
    places = (HERE, (1.005 * HERE[0], HERE[1]), (900.0, 2.5))
    repeat, beside, far = (
        one.information_bits
        for one in expected_information(found.forward, found.draws, places, seed=0)
    )
    assert first > 2.0
    assert repeat < 0.05 * first
    assert repeat < 0.1 * far
    assert beside < 0.15 * first


# A linear machine
# -------------------------------------------------------------------------------------------------


def linear(unknown, emulated=0.01):
    """What it shows: ln CRF goes with its one unknown; forces are known."""
    crf = 8.0 + 0.1 * unknown[:, None] * SLOPES
    nothing = np.full_like(crf, np.nan)
    log_force = np.tile(np.log(LOADS), (len(crf), 1))
    return ChannelPrediction(
        crf, np.full_like(crf, emulated), nothing, nothing, nothing, nothing, log_force
    )


def points(std, value=8.02):
    """Heard at the first alone."""
    return [
        ObservationPoint(
            load, 1.0, crf=LogMeasurement(value, std) if place == 0 else LogMeasurement()
        )
        for place, load in enumerate(LOADS)
    ]


def covariance(size, emulated=0.01):
    """Of the errors at the three points, of one machine: those of the likelihood, the exponent's
    about the first.
    """
    shown, near = linear(np.zeros(1), emulated), point_similarity(points(1e-3))
    law = law_errors("crf", shown.log_force, np.array([size]), near, shown.log_force[:, :1])
    return (law + emulated_errors("crf", shown.crf_std, near))[0]


def closed_form(place, size, std, emulated=0.01):
    """Bits of the unknown that one more recording at a place tells: half log2 of determinants'
    ratios.
    """
    measured = std**2 * np.eye(2)
    rows = np.ix_([0, place], [0, place])
    slopes = 0.1 * SLOPES[[0, place]]
    known = covariance(size, emulated)[rows] + measured
    open_, one = known + np.outer(slopes, slopes), slice(0, 1)
    both = np.linalg.slogdet(open_)[1] - np.linalg.slogdet(open_[one, one])[1]
    own = np.linalg.slogdet(known)[1] - np.linalg.slogdet(known[one, one])[1]
    return 0.5 * (both - own) / np.log(2.0)


def told(place, size, std, emulated=0.01, count=3000):
    """The same by possible machines: drawn from what the first recording leaves, and asked what
    they would show.
    """
    rng = np.random.default_rng(1)
    variance = covariance(size, emulated)[0, 0] + std**2
    log_force = 0.1 * SLOPES[0]
    left = 1.0 / (1.0 + log_force**2 / variance)
    unknown = left * log_force / variance * 0.02 + np.sqrt(left) * rng.standard_normal(count)
    shown = at_point(
        predictive_mixture(linear(unknown, emulated), points(std), "crf", [size]), place
    )
    return _mutual_information([(shown, std, (rng.random(count), rng.standard_normal(count)))])


@pytest.mark.parametrize("size", [0.0, *SIZES])
@pytest.mark.parametrize("std", [1e-3, 0.02])
@pytest.mark.parametrize("place", [1, 2])
def test_information_of_a_linear_machine_is_the_ratio_of_determinants(place, std, size):
    assert told(place, size, std) == pytest.approx(closed_form(place, size, std), abs=0.06)


def test_a_repeat_tells_what_measurement_left_open_and_no_more():
    """Errors that both have in common are no news; without any, two say what one of half the
    variance does.
    """
    repeats = [told(1, 0.02, std) for std in (0.05, 0.01, 1e-4)]
    assert repeats == sorted(repeats, reverse=True)
    assert repeats[-1] < 0.01
    alone = 0.5 * np.log2((1.0 + 2.0 * 0.01 / 0.05**2) / (1.0 + 0.01 / 0.05**2))
    assert closed_form(1, 0.0, 0.05, emulated=0.0) == pytest.approx(alone, abs=1e-9)


def test_what_was_heard_says_nothing_of_errors_elsewhere_under_another_force():
    """Without the emulator's share that all points have in common; an exponent that is off adds to
    what is left.
    """
    far = linear(np.zeros(1), emulated=0.0)._replace(log_force=np.log([[1.0, 1.0, 1e6]]))
    shown = predictive_mixture(far, points(1e-3), "crf", [0.02])
    assert shown.mean[0, 0, 2] == pytest.approx(8.0, abs=1e-9)
    assert shown.std[0, 0, 2] == pytest.approx(np.hypot(0.02, EXPONENT_STD * np.log(1e6)), rel=1e-9)


def test_densities_of_what_would_be_heard_make_the_likelihood_of_both():
    """p(first) p(second given first) is p(both), the law's sizes unknown, as long as no exponent is
    off.
    """
    same = [
        ObservationPoint(500.0, 1.0, crf=LogMeasurement(8.02, 2e-3)),
        ObservationPoint(500.0, 2.0, crf=LogMeasurement(7.96, 2e-3)),
    ]
    first = [same[0], replace(same[1], crf=LogMeasurement())]
    rng = np.random.default_rng(3)
    crf, nothing = 8.0 + 0.05 * rng.standard_normal((6, 2)), np.full((6, 2), np.nan)
    shown = ChannelPrediction(
        crf, np.full((6, 2), 0.01), nothing, nothing, nothing, nothing, np.full((6, 2), 6.0)
    )
    then = predictive_mixture(shown, first, "crf").log_density(np.array([np.nan, 7.96]), 2e-3)[:, 1]
    one, both = (log_likelihood(shown, points, discrepancy=True) for points in (first, same))
    assert one + then == pytest.approx(both, abs=1e-9)
