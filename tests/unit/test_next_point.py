"""Choice of the next operating point: closed form of a linear machine, information of a repeat."""

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
)  # slopes of ln CRF over the one unknown of a linear machine, at three points
LOADS = (500.0, 500.0, 800.0)


def observations_at_one_point(setting, emulator, times=1):
    """Repeated observations at one point of a contact with all unknowns at their prior medians."""
    forward = ForwardModel(setting, emulator, (ObservationPoint(*HERE),))
    prediction = forward.predict(np.zeros((1, forward.dims)), "hertz-point")
    crf, damping = (float(np.exp(values[0, 0])) for values in (prediction.crf, prediction.damping))
    observation = Observation(
        load_n=HERE[0],
        entrainment_m_s=HERE[1],
        crf_hz=crf,
        crf_std_hz=1e-3 * crf,
        damping_ratio=damping,
        damping_std=0.03 * damping,
    )
    return [observation] * times


@pytest.fixture(scope="module")
def setting():
    return formula_setting()


@pytest.fixture(scope="module")
def emulator(setting):
    return formula_emulator(setting)


def test_a_repeat_gives_little_information_compared_with_the_first_recording(setting, emulator):
    """A point with a slightly different load gives little more than a repeat."""
    posterior = infer_observations(setting, emulator, observations_at_one_point(setting, emulator))
    prior = infer_observations(setting, emulator, [])
    first = expected_information(prior.forward, prior.draws, (HERE,), seed=0)[0].information_bits
    places = (HERE, (1.005 * HERE[0], HERE[1]), (900.0, 2.5))
    repeat, adjacent, distant = (
        point.information_bits
        for point in expected_information(posterior.forward, posterior.draws, places, seed=0)
    )
    assert first > 2.0
    assert repeat < 0.05 * first
    assert repeat < 0.1 * distant
    assert adjacent < 0.15 * first


# A linear machine
# -------------------------------------------------------------------------------------------------


def linear(unknown, emulated=0.01):
    """Linear response: ln CRF is proportional to the one unknown; the forces are known."""
    crf = 8.0 + 0.1 * unknown[:, None] * SLOPES
    missing = np.full_like(crf, np.nan)
    log_force = np.tile(np.log(LOADS), (len(crf), 1))
    return ChannelPrediction(
        *(crf, np.full_like(crf, emulated), *(missing,) * 4, log_force),
        *(missing, missing),
    )


def points(std, value=8.02):
    """Three points, observed at the first only."""
    return [
        ObservationPoint(
            load, 1.0, crf=LogMeasurement(value, std) if place == 0 else LogMeasurement()
        )
        for place, load in enumerate(LOADS)
    ]


def covariance(size, emulated=0.01):
    """Covariance of the errors at the three points: likelihood and exponent (about the first
    point).
    """
    prediction, similarity = linear(np.zeros(1), emulated), point_similarity(points(1e-3))
    law = law_errors(
        "crf", prediction.log_force, np.array([size]), similarity, prediction.log_force[:, :1]
    )
    return (law + emulated_errors("crf", prediction.crf_std, similarity))[0]


def closed_form(place, size, std, emulated=0.01):
    """Information [bit] of a second recording at `place`: half log2 of a ratio of determinants."""
    measured = std**2 * np.eye(2)
    rows = np.ix_([0, place], [0, place])
    slopes = 0.1 * SLOPES[[0, place]]
    error_covariance = covariance(size, emulated)[rows] + measured
    total_covariance, first = error_covariance + np.outer(slopes, slopes), slice(0, 1)
    total_log_det = (
        np.linalg.slogdet(total_covariance)[1]
        - np.linalg.slogdet(total_covariance[first, first])[1]
    )
    error_log_det = (
        np.linalg.slogdet(error_covariance)[1]
        - np.linalg.slogdet(error_covariance[first, first])[1]
    )
    return 0.5 * (total_log_det - error_log_det) / np.log(2.0)


def sampled_information(place, size, std, emulated=0.01, count=3000):
    """Information from sampled machines: posterior draws after the first recording predict the
    second.
    """
    rng = np.random.default_rng(1)
    variance = covariance(size, emulated)[0, 0] + std**2
    log_force = 0.1 * SLOPES[0]
    variance_ratio = 1.0 / (1.0 + log_force**2 / variance)
    unknown = variance_ratio * log_force / variance * 0.02 + np.sqrt(
        variance_ratio
    ) * rng.standard_normal(count)
    mixture = at_point(
        predictive_mixture(linear(unknown, emulated), points(std), "crf", [size]), place
    )
    return _mutual_information([(mixture, std, (rng.random(count), rng.standard_normal(count)))])


@pytest.mark.parametrize("size", [0.0, *SIZES])
@pytest.mark.parametrize("std", [1e-3, 0.02])
@pytest.mark.parametrize("place", [1, 2])
def test_information_of_a_linear_machine_is_the_ratio_of_determinants(place, std, size):
    assert sampled_information(place, size, std) == pytest.approx(
        closed_form(place, size, std), abs=0.06
    )


def test_a_repeat_adds_only_the_information_lost_to_measurement_noise():
    """Common errors add nothing; without them two recordings equal one with half the variance."""
    repeats = [sampled_information(1, 0.02, std) for std in (0.05, 0.01, 1e-4)]
    assert repeats == sorted(repeats, reverse=True)
    assert repeats[-1] < 0.01
    expected = 0.5 * np.log2((1.0 + 2.0 * 0.01 / 0.05**2) / (1.0 + 0.01 / 0.05**2))
    assert closed_form(1, 0.0, 0.05, emulated=0.0) == pytest.approx(expected, abs=1e-9)


def test_an_observation_does_not_inform_errors_at_another_force():
    """Without the common emulator error; an uncertain exponent adds to the residual."""
    distant = linear(np.zeros(1), emulated=0.0)._replace(log_force=np.log([[1.0, 1.0, 1e6]]))
    mixture = predictive_mixture(distant, points(1e-3), "crf", [0.02])
    assert mixture.mean[0, 0, 2] == pytest.approx(8.0, abs=1e-9)
    assert mixture.std[0, 0, 2] == pytest.approx(
        np.hypot(0.02, EXPONENT_STD * np.log(1e6)), rel=1e-9
    )


def test_sequential_predictive_densities_give_the_joint_likelihood():
    """p(first) p(second | first) = p(both) with unknown law errors, for an exact exponent."""
    same = [
        ObservationPoint(500.0, 1.0, crf=LogMeasurement(8.02, 2e-3)),
        ObservationPoint(500.0, 2.0, crf=LogMeasurement(7.96, 2e-3)),
    ]
    first = [same[0], replace(same[1], crf=LogMeasurement())]
    rng = np.random.default_rng(3)
    crf, missing = 8.0 + 0.05 * rng.standard_normal((6, 2)), np.full((6, 2), np.nan)
    prediction = ChannelPrediction(
        *(crf, np.full((6, 2), 0.01), *(missing,) * 4, np.full((6, 2), 6.0)),
        *(missing, missing),
    )
    then = predictive_mixture(prediction, first, "crf").log_density(np.array([np.nan, 7.96]), 2e-3)[
        :, 1
    ]
    single, joint = (
        log_likelihood(prediction, points, discrepancy=True) for points in (first, same)
    )
    assert single + then == pytest.approx(joint, abs=1e-9)
