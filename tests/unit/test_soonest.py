"""How soon a knee can be found at all, against the dense covariance and against drawn series."""

import numpy as np
import pytest
import scipy.linalg
from benchmarks.alarms import AFTER, RISE_HZ
from benchmarks.soonest import courses, distance, independent, power

from asperity.wear.sequential import knee


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


def test_the_alarms_own_test_finds_no_more_than_the_bound():
    """Knees at the 18th recording to 30 Hz, with the share of drawn ones whose ratio is beyond all but 2 % of lines."""
    rng, x = np.random.default_rng(5), np.arange(24.0)
    line = RISE_HZ / 18.0 * x
    bent = np.where(x < 18.0, line, RISE_HZ + AFTER * RISE_HZ / 18.0 * (x - 18.0))

    def ratios(course):
        drawn = (course + 30.0 * rng.standard_normal((150, x.size))) / 2921.93
        return np.array([knee(x, one, least=0.05).log_ratio for one in drawn])

    found = float(np.mean(ratios(bent) > np.quantile(ratios(line), 0.98)))
    (bound,) = power(np.array([distance(18, 5, 30.0, 0.0, courses)]), np.array([5]), 0.02)
    assert 0.3 * bound < found < bound + 0.1
