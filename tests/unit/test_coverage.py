"""Intervals have one coverage, stated once."""

import re
from statistics import NormalDist

import pytest

from asperity.core.coverage import COVERAGE, NORMAL_FACTOR, QUANTILES, UPPER
from support.source import PACKAGE


def test_the_constants_of_an_interval_agree():
    assert pytest.approx(0.5 * (1.0 + COVERAGE)) == UPPER
    assert pytest.approx((1.0 - UPPER, 0.5, UPPER)) == QUANTILES
    assert pytest.approx(NormalDist().inv_cdf(UPPER), rel=1e-14) == NORMAL_FACTOR


def test_coverage_is_stated_in_one_module():
    pattern = re.compile(r"\b1\.64[45]\d*|0\.05, 0\.5, 0\.95|ppf\(0\.95|stdtrit\([^)]*0\.95")
    found = {
        path.relative_to(PACKAGE).as_posix()
        for path in PACKAGE.rglob("*.py")
        if pattern.search(path.read_text("utf-8"))
    }
    assert found == {"core/coverage.py"}
