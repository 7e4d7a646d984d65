"""Earliest detection of a knee, against the dense covariance and drawn series."""

import numpy as np
import pytest
import scipy.linalg
from benchmarks.alarms import AFTER, RISE_HZ
from benchmarks.soonest import (
    Nearest,
    courses,
    distance,
    in_season,
    independent,
    nearest,
    nearest_residual,
    power,
    power_unknown,
)
from benchmarks.soonest import knee as course_of

from asperity.trend.sequential import knee_test


def test_independent_rows_agree_with_the_dense_covariance():
    rows = np.random.default_rng(1).standard_normal((2, 30))
    covariance = scipy.linalg.toeplitz(0.7 ** np.arange(30))
    dense = rows @ np.linalg.solve(covariance, rows.T)
    assert independent(rows, 0.7) @ independent(rows, 0.7).T == pytest.approx(dense)


def test_a_course_without_a_knee_has_zero_distance():
    assert distance(18, 0, 30.0, 0.0, courses) == pytest.approx(
        0.0, abs=1e-6
    )  # the course is still a straight line
    distances = [distance(18, delay, 30.0, 0.0, courses) for delay in range(1, 9)]
    assert all(np.diff(distances) > 0.0)
    assert distance(18, 5, 15.0, 0.0, courses) == pytest.approx(2.0 * distances[4])


def test_with_unknown_scatter_the_distance_agrees_with_dense_covariances():
    """Reference: Kullback-Leibler information of one Gaussian against another; no scatter is
    closer.
    """
    closest = nearest(18, 6, 30.0, 0.0, courses)
    white = np.eye(25)
    other = closest.size**2 * scipy.linalg.toeplitz(closest.memory ** np.arange(25))
    inverse = np.linalg.inv(other)
    information = (
        np.trace(inverse @ white)
        - 25
        + closest.left @ closest.left / closest.size**2
        + np.linalg.slogdet(other)[1]
    )
    assert closest.apart == pytest.approx(0.5 * information)
    assert closest.apart < 0.5 * distance(18, 6, 30.0, 0.0, courses) ** 2
    assert 0.0 < closest.memory < 0.7


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_with_known_scatter_the_simulated_power_agrees_with_the_derived_one(memory):
    residual = nearest_residual(course_of(18, 5) / 30.0, memory, courses)
    same = Nearest(float(residual @ residual) / 2.0, residual, memory, 1.0)
    (derived,) = power(np.array([np.linalg.norm(residual)]), np.array([5]), 0.02)
    assert power_unknown(same, memory, 0.02) == pytest.approx(derived, abs=0.03)


def test_a_season_hides_a_knee():
    assert nearest(18, 6, 15.0, 0.0, in_season).apart < nearest(18, 6, 15.0, 0.0, courses).apart


def test_the_alarm_test_is_no_more_powerful_than_the_bound():
    """Knees at recording 18 of up to 30 Hz; share of draws whose ratio exceeds that of 98 % of
    lines.
    """
    rng, x = np.random.default_rng(5), np.arange(24.0)
    line = RISE_HZ / 18.0 * x
    broken_line = np.where(x < 18.0, line, RISE_HZ + AFTER * RISE_HZ / 18.0 * (x - 18.0))

    def ratios(course):
        sample = (course + 30.0 * rng.standard_normal((150, x.size))) / 2921.93
        return np.array([knee_test(x, series, smallest_change=0.05).log_ratio for series in sample])

    simulated_power = float(np.mean(ratios(broken_line) > np.quantile(ratios(line), 0.98)))
    (bound,) = power(np.array([distance(18, 5, 30.0, 0.0, courses)]), np.array([5]), 0.02)
    assert 0.3 * bound < simulated_power < bound + 0.1
