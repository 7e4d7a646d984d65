"""Sequential alarm on series of indicators with known truth."""

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.trend import (
    AlarmChecks,
    MonitoredSeries,
    RecordingStatus,
    knee_weight,
    sequential_alarm,
)
from asperity.trend.sequential import growth_test, knee_test, step_test, threshold

NUMBER = np.arange(40.0)
PER_THOUSAND = threshold(1e-3)


def knee_at(place, scatter, seed, after=0.18):
    """Simulate the paper's CRF, 2922 to 3640 Hz with a slower rise after the knee, relative to the
    start.
    """
    pace = 718.0 / place
    course = 2922.0 + np.where(
        place > NUMBER, pace * NUMBER, 718.0 + after * pace * (NUMBER - place)
    )
    return (course + scatter * np.random.default_rng(seed).standard_normal(NUMBER.size)) / 2922.0


def recordings_to_alarm(test, values, smallest_change, above=PER_THOUSAND):
    """Return the number of recordings after which a test first raises an alarm."""
    for count in range(1, values.size + 1):
        if test(NUMBER[:count], values[:count], smallest_change=smallest_change).log_ratio > above:
            return count
    return None


def monitored(values, contact=True, smallest_change=0.05):
    return MonitoredSeries(
        name="CRF",
        values=np.asarray(values),
        smallest_change=smallest_change,
        contact=contact,
        describe=lambda by: f"by {by:.2f}",
    )


def alarm_state(values, statuses=None, **choices):
    values = np.asarray(values)
    status_list = statuses or [RecordingStatus()] * values.size
    return sequential_alarm(
        np.arange(float(values.size)), [monitored(values)], status_list, **choices
    )


@pytest.mark.parametrize("place", [12, 18, 24])
def test_a_knee_is_detected_early_and_located(place):
    values = knee_at(place, 5.0, place)
    count = recordings_to_alarm(knee_test, values, 0.05)
    assert place < count <= place + 5
    found = knee_test(NUMBER[:count], values[:count], smallest_change=0.05)
    assert found.x == pytest.approx(place, abs=2.0)
    assert found.change == pytest.approx(718.0 / 2922.0, abs=0.04)


def scatter(seed, size=0.004):
    return size * np.random.default_rng(seed).standard_normal(NUMBER.size)


HEALTHY = {
    "level": np.ones(40),
    "daily cycle of 2 %": 1.0 + 0.02 * np.sin(NUMBER * 2.0 * np.pi / 24.0),
    "load step": 1.0 + 0.08 * (NUMBER >= 15),
    "warm-up": 1.0 - 0.1 * np.exp(-NUMBER / 4.0),
    "straight": 1.0 + 0.2 * NUMBER / 40.0,
    "saturating": 1.25 - 0.25 * np.exp(-NUMBER / 15.0),
    "rising ever faster": 1.0 + 0.25 * (NUMBER / 40.0) ** 3,
    "flat, then rising": 1.0 + 0.01 * np.maximum(NUMBER - 20.0, 0.0),
    "falling, then flat": 1.2 - 0.01 * np.minimum(NUMBER, 20.0),
}


@pytest.mark.parametrize("name", HEALTHY)
def test_a_course_without_knee_raises_no_alarm_after_any_recording(name):
    assert recordings_to_alarm(knee_test, HEALTHY[name] + scatter(3), 0.05) is None


@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e6])
def test_the_evidence_of_a_knee_does_not_depend_on_the_unit_of_x(unit):
    values = knee_at(18, 5.0, 1)[:24]
    unscaled, scaled = (
        knee_test(NUMBER[:24], values, smallest_change=0.05),
        knee_test(7.0 * unit + NUMBER[:24] * unit, values, smallest_change=0.05),
    )
    assert scaled.log_ratio == pytest.approx(unscaled.log_ratio, rel=1e-4)
    assert (scaled.x - 7.0 * unit) / unit == pytest.approx(unscaled.x, rel=1e-4)


def test_the_likelihood_ratio_of_white_scatter_is_that_of_least_squares():
    """Slow reference: with independent scatter, n/2 ln of the ratio of the two straight fits'
    residual squares.
    """
    values = knee_at(10, 20.0, 5)[:20]
    at = NUMBER[:20]

    def residual_squares(columns):
        design = np.stack([np.ones(20), *columns], axis=1)
        return float(
            np.sum((values - design @ np.linalg.lstsq(design, values, rcond=None)[0]) ** 2)
        )

    from asperity.trend import sequential

    hinges = np.maximum(at - np.arange(3.0, 18.0)[:, None], 0.0)
    own = sequential._log_likelihoods(values, hinges, companion=at)[
        list(sequential.CORRELATIONS).index(0.0)
    ]
    straight = sequential._log_likelihoods(values, at[None])[
        list(sequential.CORRELATIONS).index(0.0)
    ]
    reference = [
        10.0 * np.log(residual_squares([at]) / residual_squares([at, hinge])) for hinge in hinges
    ]
    assert own - straight == pytest.approx(reference, rel=1e-6)


@pytest.mark.parametrize("memory", [-0.3, 0.7, 0.9])
def test_correlated_scatter_has_the_likelihood_of_its_full_covariance(memory):
    """Slow reference: generalised least squares with the dense covariance and its determinant."""
    from scipy.linalg import toeplitz

    from asperity.trend import sequential

    values = knee_at(10, 20.0, 6)[:20]
    rows = sequential._saturating_curves(NUMBER[:20])[::7]
    covariance = toeplitz(memory ** np.arange(20.0))
    inverse = np.linalg.inv(covariance)

    def likelihood(row):
        design = np.stack([np.ones(20), row], axis=1)
        fitted = np.linalg.solve(design.T @ inverse @ design, design.T @ inverse @ values)
        off = values - design @ fitted
        return -10.0 * np.log(off @ inverse @ off) - 0.5 * np.linalg.slogdet(covariance)[1]

    own = sequential._log_likelihoods(values, rows)[list(sequential.CORRELATIONS).index(memory)]
    assert own == pytest.approx([likelihood(row) for row in rows], abs=1e-6)


def test_an_alarm_persists_after_its_cause_disappears():
    values = np.concatenate([knee_at(12, 5.0, 2)[:20], 1.0 + scatter(7)[:20]])
    count = alarm_state(values).states.index("alarm") + 1
    assert knee_test(NUMBER, values, smallest_change=0.05).log_ratio < PER_THOUSAND
    assert count < 20
    assert set(alarm_state(values).states[count:]) == {"alarm"}
    assert alarm_state(values, acknowledged=20).state != "alarm"


def test_a_growing_level_is_distinguished_from_a_step():
    growing = np.log(np.where(NUMBER < 25, 1.0, np.exp(0.15 * (NUMBER - 25)))) + scatter(1, 0.05)
    stepping = np.log(3.0) * (NUMBER >= 20) + scatter(2, 0.05)
    assert 25 < recordings_to_alarm(growth_test, growing, np.log(2.0)) <= 34
    assert recordings_to_alarm(growth_test, stepping, np.log(2.0)) is None
    assert recordings_to_alarm(step_test, stepping, np.log(2.0)) in range(22, 26)
    assert recordings_to_alarm(step_test, scatter(3, 0.05), np.log(2.0)) is None


def test_an_acknowledged_alarm_restarts_the_baseline():
    values = knee_at(15, 5.0, 2)
    alarm = alarm_state(values)
    raised = alarm.states.index("alarm")
    assert (alarm.state, alarm.since, alarm.raised_by) == ("alarm", raised, "CRF")
    assert set(alarm.states[raised:]) == {"alarm"}
    assert "has flattened since" in alarm.reason
    after = alarm_state(values, acknowledged=raised + 1)
    assert after.states[raised + 1] == "cannot-tell"
    assert "alarm" not in after.states
    assert after.state == "none"
    all_acknowledged = alarm_state(values, acknowledged=40)
    assert (all_acknowledged.state, all_acknowledged.since) == ("none", None)
    assert "all 40 recordings are acknowledged" in all_acknowledged.reason


def test_an_alarm_on_the_contact_checks_the_wear_stage():
    values = knee_at(15, 5.0, 2)
    confirmations = []
    alarm = alarm_state(
        values, checks=AlarmChecks(confirmed=lambda number: confirmations.append(number) or False)
    )
    assert confirmations
    assert set(alarm.states) == {"cannot-tell", "none", "alert"}


def test_an_unobservable_state_is_reported_and_not_called_healthy():
    level = 1.0 + scatter(4)
    off = [RecordingStatus()] * 39 + [RecordingStatus("blind", "the machine was off")]
    assert alarm_state(level, off).state == "blind"
    assert alarm_state(level, off).since == 39
    assert alarm_state(level[:5]).state == "cannot-tell"
    assert "5 of 8 points" in alarm_state(level[:5]).reason
    assert alarm_state(level).state == "none"


def test_a_step_of_unknown_cause_is_an_alert():
    alarm = alarm_state(HEALTHY["load step"] + scatter(5))
    assert alarm.state == "alert"
    assert "in one step at 15" in alarm.reason
    assert "alarm" not in alarm.states
    assert alarm_state(HEALTHY["load step"] + scatter(5), acknowledged=15).state == "none"


@pytest.mark.parametrize(
    ("level", "state"), [(0.0, "alarm"), (0.4, "alert")], ids=["fault", "moved sensor"]
)
def test_a_jump_in_depth_is_a_fault_unless_the_level_jumps_with_it(level, state):
    """A relocated sensor may receive a bearing better: the level jumps too, which a fault hardly
    causes.
    """
    jump = (NUMBER >= 20).astype(float)
    series = {"depth": 0.9 * jump + scatter(1, 0.1), "rms": level * jump + scatter(2, 0.05)}
    monitored_series = [
        MonitoredSeries(
            name=name,
            values=values,
            smallest_change=np.log(2.0),
            contact=False,
            describe="by {:.2f}".format,
            gain_dependent=name == "rms",
            step_alarms=name == "depth",
        )
        for name, values in series.items()
    ]
    assert sequential_alarm(NUMBER, monitored_series, [RecordingStatus()] * 40).state == state


def test_a_knee_has_a_high_weight_and_a_step_or_a_bend_a_low_one():
    weights = {
        name: knee_weight(NUMBER, [monitored(HEALTHY[name] + scatter(3))]) for name in HEALTHY
    }
    assert max(weights.values()) < 0.25
    assert knee_weight(NUMBER, [monitored(knee_at(18, 5.0, 1))]) > 0.99
    assert knee_weight(NUMBER[:20], [monitored(knee_at(18, 15.0, 1)[:20])]) < 0.9  # just after it
    assert knee_weight(NUMBER[:5], [monitored(np.ones(5))]) == 1.0  # undetermined


def test_a_smaller_rate_of_false_alarms_takes_longer():
    values = knee_at(15, 15.0, 3)
    delays = [
        alarm_state(values, false_alarm_rate=rate).states.index("alarm")
        for rate in (1e-1 - 1e-9, 1e-3, 1e-5)
    ]
    assert delays[0] < delays[1] < delays[2]


@pytest.mark.parametrize("rate", [0.0, -1.0, 0.5, np.nan])
def test_an_invalid_rate_is_refused(rate):
    with pytest.raises(BadInput, match="false-alarm rate"):
        alarm_state(np.ones(3), false_alarm_rate=rate)


def test_repeats_of_one_test_count_as_one_point():
    repeated = np.repeat(NUMBER[:4], 5)
    values = 1.0 + 0.1 * repeated
    alarm = sequential_alarm(repeated, [monitored(values)], [RecordingStatus()] * 20)
    assert "4 of 8 points" in alarm.reason
