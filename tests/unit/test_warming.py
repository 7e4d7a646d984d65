"""A warm-up is known by its shape, and nothing else is taken for one."""

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


def test_a_warm_up_is_measured_as_it_was_made():
    rng = np.random.default_rng(3)
    left = np.exp(-NUMBER / 5.0)
    crf = 1.0 - 0.08 * left + 0.002 * rng.standard_normal(NUMBER.size)
    level = 0.5 - 0.4 * left + 0.05 * rng.standard_normal(NUMBER.size)
    found = warm_up(3.0 * NUMBER, crf, level)
    assert (found.crf, found.level, found.time_constant) == pytest.approx(
        (0.08, 0.4, 15.0), rel=0.2
    )
    assert np.abs(found.residual) == pytest.approx([0.0, 0.0], abs=0.1)
    assert warm_up(NUMBER, crf, np.roll(level, 20)) is None  # the level goes its own way
    assert warm_up(NUMBER, 2.0 - crf, level) is None  # oil that warms makes CRF rise
    assert warm_up(NUMBER[:8], crf[:8], level[:8]) is None


def test_costs_beside_columns_are_those_of_least_squares():
    at = np.linspace(0.0, 1.0, 40)
    values = 1.0 - 0.08 * np.exp(-5.0 * at) + 0.002 * np.random.default_rng(1).standard_normal(40)
    columns = np.vstack([np.ones(40), at])
    rows = np.maximum(at - at[2:-2, None], 0.0)
    dense = [np.linalg.lstsq(np.vstack([columns, row]).T, values, rcond=None)[1][0] for row in rows]
    assert warming._costs(columns, rows, values) == pytest.approx(40.0 * np.log(dense), rel=1e-10)
    held = warming._costs(
        columns, 2.0 * columns, values
    )  # a row that the columns hold already adds nothing
    assert held == pytest.approx(
        np.full(2, 40.0 * np.log(np.linalg.lstsq(columns.T, values, rcond=None)[1][0]))
    )


def test_most_warm_ups_are_known_and_no_other_course_is():
    """benchmarks/alarms.py has the same at 300 series a row."""
    known = [
        warm_up(NUMBER, one.crf, one.level) is not None
        for one in (drawn_warm_up(np.random.default_rng([11, n])) for n in range(30))
    ]
    assert np.mean(known) > 0.6
    others = [
        saturating,
        straight,
        moved_sensor,
        KNEES["knee, CRF to 15 Hz"],
        WITHOUT_WEAR["load step, CRF by 2 to 12 %, not given"],
    ]
    for draw in others:
        series = [draw(np.random.default_rng([11, n])) for n in range(30)]
        assert not any(warm_up(NUMBER, one.crf, one.level) for one in series)


def watched(name, values, contact):
    return MonitoredSeries(
        name=name,
        values=values,
        smallest_change=0.05,
        contact=contact,
        describe=str,
        gain_dependent=not contact,
    )


def test_what_a_warm_up_explains_is_excused_and_what_comes_on_top_is_not():
    rng = np.random.default_rng(5)
    left = np.exp(-NUMBER / 4.0)
    crf = 1.0 - 0.1 * left + 0.002 * rng.standard_normal(NUMBER.size)
    level = -0.5 * left + 0.05 * rng.standard_normal(NUMBER.size)
    warming = Warming(NUMBER, [watched("CRF", crf, True)], [watched(RMS, level, False)], "h")
    assert warming.explanation(39).startswith("this looks like a warm-up: CRF rose by 10")
    assert warming.excuses(39, "CRF") == warming.excuses(39, RMS) == warming.explanation(39)
    assert warming.excuses(39, "kurtosis") == ""
    worn = crf + 0.04 * (NUMBER > 34)
    assert (
        Warming(
            NUMBER, [watched("CRF", worn, True)], [watched(RMS, level, False)], "h"
        ).explanation(39)
        == ""
    )
    assert judged(drawn_warm_up(np.random.default_rng([11, 1]))).state == "none"
