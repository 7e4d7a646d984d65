"""How soon a knee can be found at all, against the dense covariance and against drawn series."""

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


def test_independent_rows_are_those_of_the_dense_covariance():
    rows = np.random.default_rng(1).standard_normal((2, 30))
    covariance = scipy.linalg.toeplitz(0.7 ** np.arange(30))
    dense = rows @ np.linalg.solve(covariance, rows.T)
    assert independent(rows, 0.7) @ independent(rows, 0.7).T == pytest.approx(dense)


def test_a_course_that_is_no_knee_has_no_distance():
    assert distance(18, 0, 30.0, 0.0, courses) == pytest.approx(0.0, abs=1e-6)  # a line up to now
    grown = [distance(18, behind, 30.0, 0.0, courses) for behind in range(1, 9)]
    assert all(np.diff(grown) > 0.0)
    assert distance(18, 5, 15.0, 0.0, courses) == pytest.approx(2.0 * grown[4])


def test_in_scatter_of_its_own_a_course_is_told_by_what_dense_covariances_say():
    """Slow twin: information (Kullback and Leibler) of one Gaussian against another, and no scatter
    that is nearer.
    """
    near = nearest(18, 6, 30.0, 0.0, courses)
    own = np.eye(25)
    other = near.size**2 * scipy.linalg.toeplitz(near.memory ** np.arange(25))
    inverse = np.linalg.inv(other)
    told = (
        np.trace(inverse @ own)
        - 25
        + near.left @ near.left / near.size**2
        + np.linalg.slogdet(other)[1]
    )
    assert near.apart == pytest.approx(0.5 * told)
    assert near.apart < 0.5 * distance(18, 6, 30.0, 0.0, courses) ** 2
    assert 0.0 < near.memory < 0.7


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_where_scatter_is_known_the_drawn_power_is_the_derived_one(memory):
    left = nearest_residual(course_of(18, 5) / 30.0, memory, courses)
    same = Nearest(float(left @ left) / 2.0, left, memory, 1.0)
    (derived,) = power(np.array([np.linalg.norm(left)]), np.array([5]), 0.02)
    assert power_unknown(same, memory, 0.02) == pytest.approx(derived, abs=0.03)


def test_a_season_hides_a_knee():
    assert nearest(18, 6, 15.0, 0.0, in_season).apart < nearest(18, 6, 15.0, 0.0, courses).apart


def test_the_alarms_own_test_finds_no_more_than_the_bound():
    """Knees at the 18th recording to 30 Hz, with the share of drawn ones whose ratio is beyond all
    but 2 % of lines.
    """
    rng, x = np.random.default_rng(5), np.arange(24.0)
    line = RISE_HZ / 18.0 * x
    bent = np.where(x < 18.0, line, RISE_HZ + AFTER * RISE_HZ / 18.0 * (x - 18.0))

    def ratios(course):
        drawn = (course + 30.0 * rng.standard_normal((150, x.size))) / 2921.93
        return np.array([knee_test(x, one, smallest_change=0.05).log_ratio for one in drawn])

    found = float(np.mean(ratios(bent) > np.quantile(ratios(line), 0.98)))
    (bound,) = power(np.array([distance(18, 5, 30.0, 0.0, courses)]), np.array([5]), 0.02)
    assert 0.3 * bound < found < bound + 0.1
