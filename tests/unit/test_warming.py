"""Warm-ups are recognised by their shape; no other course is taken for one."""

import numpy as np
import pytest
from benchmarks.alarms import (
    KNEES,
    NUMBER,
    RMS,
    WITHOUT_WEAR,
    judged,
    moved_sensor,
    saturating,
    straight,
)
from benchmarks.alarms import warm_up as drawn_warm_up

from asperity.monitoring.alarm import Warming
from asperity.trend import MonitoredSeries, warm_up, warming


def test_the_parameters_of_a_warm_up_are_recovered():
    rng = np.random.default_rng(3)
    remaining = np.exp(-NUMBER / 5.0)
    crf = 1.0 - 0.08 * remaining + 0.002 * rng.standard_normal(NUMBER.size)
    level = 0.5 - 0.4 * remaining + 0.05 * rng.standard_normal(NUMBER.size)
    fit = warm_up(3.0 * NUMBER, crf, level)
    assert (fit.crf, fit.level, fit.time_constant) == pytest.approx((0.08, 0.4, 15.0), rel=0.2)
    assert np.abs(fit.residual) == pytest.approx([0.0, 0.0], abs=0.1)
    assert warm_up(NUMBER, crf, np.roll(level, 20)) is None  # the level does not follow CRF
    assert warm_up(NUMBER, 2.0 - crf, level) is None  # CRF must rise in a warm-up
    assert warm_up(NUMBER[:8], crf[:8], level[:8]) is None


def test_costs_agree_with_dense_least_squares():
    position = np.linspace(0.0, 1.0, 40)
    values = (
        1.0 - 0.08 * np.exp(-5.0 * position) + 0.002 * np.random.default_rng(1).standard_normal(40)
    )
    columns = np.vstack([np.ones(40), position])
    rows = np.maximum(position - position[2:-2, None], 0.0)
    dense = [np.linalg.lstsq(np.vstack([columns, row]).T, values, rcond=None)[1][0] for row in rows]
    assert warming._costs(columns, rows, values) == pytest.approx(40.0 * np.log(dense), rel=1e-10)
    # a row that is a multiple of a column does not reduce the cost
    unchanged = warming._costs(columns, 2.0 * columns, values)
    assert unchanged == pytest.approx(
        np.full(2, 40.0 * np.log(np.linalg.lstsq(columns.T, values, rcond=None)[1][0]))
    )


def test_most_warm_ups_are_recognised_and_no_other_course_is():
    """benchmarks/alarms.py tests the same with 300 series per row."""
    recognised = [
        warm_up(NUMBER, drawn.crf, drawn.level) is not None
        for drawn in (drawn_warm_up(np.random.default_rng([11, n])) for n in range(30))
    ]
    assert np.mean(recognised) > 0.6
    others = [
        saturating,
        straight,
        moved_sensor,
        KNEES["knee, CRF to 15 Hz"],
        WITHOUT_WEAR["load step, CRF by 2 to 12 %, not given"],
    ]
    for draw in others:
        series = [draw(np.random.default_rng([11, n])) for n in range(30)]
        assert not any(warm_up(NUMBER, drawn.crf, drawn.level) for drawn in series)


def monitored(name, values, contact):
    return MonitoredSeries(
        name=name,
        values=values,
        smallest_change=0.05,
        contact=contact,
        describe=str,
        gain_dependent=not contact,
    )


def test_only_changes_that_a_warm_up_explains_are_excused():
    rng = np.random.default_rng(5)
    remaining = np.exp(-NUMBER / 4.0)
    crf = 1.0 - 0.1 * remaining + 0.002 * rng.standard_normal(NUMBER.size)
    level = -0.5 * remaining + 0.05 * rng.standard_normal(NUMBER.size)
    warming = Warming(NUMBER, [monitored("CRF", crf, True)], [monitored(RMS, level, False)], "h")
    assert warming.explanation(39).startswith("this looks like a warm-up: CRF rose by 10")
    assert warming.excuses(39, "CRF") == warming.excuses(39, RMS) == warming.explanation(39)
    assert warming.excuses(39, "kurtosis") == ""
    worn = crf + 0.04 * (NUMBER > 34)
    assert (
        Warming(
            NUMBER, [monitored("CRF", worn, True)], [monitored(RMS, level, False)], "h"
        ).explanation(39)
        == ""
    )
    assert judged(drawn_warm_up(np.random.default_rng([11, 1]))).state == "none"
