"""Decision after one recording: tests of shape, level rule, steps and the sensor's own state."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np

from asperity.core.arrays import Field
from asperity.trend.alarm_inputs import (
    AlarmChecks,
    AlarmState,
    MonitoredSeries,
    RecordingStatus,
    judged_rows,
)
from asperity.trend.level_monitors import LevelMonitors
from asperity.trend.sequential import (
    BASELINE_POINTS,
    ChangeTest,
    ConditionRows,
    growth_test,
    knee_test,
    step_test,
    threshold,
)

ALERT_RATE_FACTOR = 10.0  # false-alert rate over false-alarm rate
# points on either side of a step that are compared to see whether another indicator moves with it
STEP_WINDOW, STEP_WINDOW_MINIMUM = 12, 3
# change of a level that counts as moving: standard errors of the difference, and 0.9 dB
MOVE_DEVIATIONS, SMALLEST_MOVE = 3.0, 0.1
# share of the false-alarm rate given to indicators of the contact; levels share the rest
CONTACT_SHARE = 0.8


class Assessment(NamedTuple):
    """Tests of one indicator up to a recording, and its distinct points `x`, `values`."""

    change: ChangeTest
    step: ChangeTest
    points: int
    x: Field
    values: Field


def assess(series: MonitoredSeries, x: Field, first: int, last: int) -> Assessment:
    """Test an indicator up to the recording `last`, from `first` on."""
    judged = judged_rows(first, last)
    values, fitted = series.part(judged).at_baseline_conditions()
    point_x, (level, *rows) = _averaged_repeats(x[judged], values, fitted.rows)
    conditions = ConditionRows(np.array(rows), fitted.scatter / fitted.widths) if rows else None
    test = knee_test if series.contact else growth_test
    change, stepped = (
        run(point_x, level, smallest_change=series.smallest_change, conditions=conditions)
        for run in (test, step_test)
    )
    return Assessment(change, stepped, point_x.size, point_x, level)


Decision: TypeAlias = tuple[AlarmState, str, str]  # state, reason, indicator


@dataclass(frozen=True, slots=True)
class Judge:
    """Decisions after each recording of a series."""

    x: Field
    monitored: Sequence[MonitoredSeries]
    statuses: Sequence[RecordingStatus]
    levels: LevelMonitors
    rate: float
    checks: AlarmChecks
    first: int
    unit: str

    def decide(self, number: int) -> Decision:
        """Decide, unless something else than wear explains the change."""
        decision = self._plain(number)
        state, _, raised_by = decision
        if state in ("alert", "alarm") and (other := self.checks.explanation(number, raised_by)):
            self.levels.withhold(raised_by)
            return "none", other, ""
        return decision

    def alarm_by(self, number: int) -> str:
        """Return the indicator that would raise an alarm now; "" without."""
        state, _, raised_by = self._plain(number)
        return raised_by if state == "alarm" else ""

    def _plain(self, number: int) -> Decision:
        return _decide(
            [(series, assess(series, self.x, self.first, number)) for series in self.monitored],
            self.levels,
            self.statuses[number],
            self.rate,
            self.unit,
            partial(self.checks.confirmed, number),
        )


def _decide(
    assessed: Sequence[tuple[MonitoredSeries, Assessment]],
    levels: LevelMonitors,
    status: RecordingStatus,
    rate: float,
    unit: str,
    confirmed: Callable[[], bool],
) -> Decision:
    """Decide the state after one recording, most severe first.

    Order: alarm by a course (knee or growth), by the level rule, by a step; blind; alert by the
    level rule, a course, a step of unknown cause; incomplete baseline; none.
    """
    shares = _false_alarm_shares([series for series, _ in assessed], rate)
    course = _course_decision(assessed, shares, rate, unit, confirmed)
    if course is not None and course[0] == "alarm":
        return course
    level = levels.judgement()
    if level.state == "alarm":
        return "alarm", level.reason, level.name
    if (step_alarm := _step_alarm(assessed, shares, unit)) is not None:
        return step_alarm
    if status.state == "blind":
        return "blind", status.reason, ""
    if level.state == "alert":
        return "alert", level.reason, level.name
    if course is not None:
        return course
    if (unexplained := _unexplained_step(assessed, shares, unit)) is not None:
        return unexplained
    points = max((assessment.points for _, assessment in assessed), default=0)
    if points < BASELINE_POINTS:
        return "cannot-tell", f"baseline incomplete: {points} of {BASELINE_POINTS} points", ""
    return "none", f"no significant change at the set false-alarm rate ({_one_in(rate)})", ""


def _course_decision(
    assessed: Sequence[tuple[MonitoredSeries, Assessment]],
    shares: Sequence[float],
    rate: float,
    unit: str,
    confirmed: Callable[[], bool],
) -> Decision | None:
    """Return the first alarm by a knee or growth, else the last alert by one, else None."""
    alert: Decision | None = None
    for (series, assessment), share in zip(assessed, shares, strict=True):
        change = assessment.change
        if change.log_ratio < threshold(ALERT_RATE_FACTOR * share):
            continue
        where = f"{change.x:.4g} {unit}".rstrip()
        words = f"{series.name} {series.describe(change.change)}"
        words += f" until {where} and has flattened since" if series.contact else f" since {where}"
        if change.log_ratio >= threshold(share) and (not series.contact or confirmed()):
            return "alarm", words, series.name
        pending = f"not yet significant at the set false-alarm rate ({_one_in(rate)})"
        alert = "alert", f"{words}, {pending}", series.name
    return alert


def _step_alarm(
    assessed: Sequence[tuple[MonitoredSeries, Assessment]], shares: Sequence[float], unit: str
) -> Decision | None:
    """Return an alarm by an upward step that the sensor's gain-dependent series do not share."""
    for (series, assessment), share in zip(assessed, shares, strict=True):
        step = assessment.step
        if not (series.step_alarms and step.change > 0.0 and step.log_ratio >= threshold(share)):
            continue
        gain_dependent = [
            other_assessment
            for other, other_assessment in assessed
            if other.gain_dependent and other.sensor == series.sensor
        ]
        moved_together = all(_moves_at(other, step.x) for other in gain_dependent)
        if not (gain_dependent and moved_together):
            return "alarm", _describe_step(series, assessment, unit), series.name
    return None


def _unexplained_step(
    assessed: Sequence[tuple[MonitoredSeries, Assessment]], shares: Sequence[float], unit: str
) -> Decision | None:
    """Return an alert for the first significant step, whose cause recordings do not show."""
    for (series, assessment), share in zip(assessed, shares, strict=True):
        if assessment.step.log_ratio >= threshold(share):
            return (
                "alert",
                f"{_describe_step(series, assessment, unit)} and has stayed there (load, gain, a "
                "moved sensor or damage: the recordings do not show which; acknowledge it once the "
                "cause is known)",
                series.name,
            )
    return None


def _describe_step(series: MonitoredSeries, assessment: Assessment, unit: str) -> str:
    step = assessment.step
    return (
        f"{series.name} {series.describe(step.change)} in one step at {step.x:.4g} {unit}".rstrip()
    )


def _moves_at(assessed: Assessment, x: float) -> bool:
    """Return whether the mean of a logarithmic level changes at `x` by more than its scatter."""
    before = assessed.values[assessed.x < x][-STEP_WINDOW:]
    after = assessed.values[assessed.x >= x][:STEP_WINDOW]
    if min(before.size, after.size) < STEP_WINDOW_MINIMUM:
        return False
    error = np.hypot(
        before.std(ddof=1) / np.sqrt(before.size), after.std(ddof=1) / np.sqrt(after.size)
    )
    return bool(abs(after.mean() - before.mean()) > max(MOVE_DEVIATIONS * error, SMALLEST_MOVE))


def _averaged_repeats(x: Field, values: Field, rows: Field) -> tuple[Field, list[Field]]:
    """Average values and condition rows over repeats at one x; leave out unknown ones."""
    finite = (
        np.isfinite(values) & np.isfinite(rows).all(axis=0) if len(rows) else np.isfinite(values)
    )
    if not finite.any():
        return x[:0], [values[:0], *rows[:, :0]]
    distinct, index = np.unique(x[finite], return_inverse=True)
    repeats = np.bincount(index)
    return distinct, [np.bincount(index, row[finite]) / repeats for row in (values, *rows)]


def _false_alarm_shares(monitored: Sequence[MonitoredSeries], rate: float) -> list[float]:
    """Divide the false-alarm rate: `CONTACT_SHARE` to contact indicators, the rest to levels."""
    of_contact = sum(series.contact for series in monitored)
    kinds = {
        True: (CONTACT_SHARE, of_contact),
        False: (1.0 - CONTACT_SHARE, len(monitored) - of_contact),
    }
    single_kind = of_contact in (0, len(monitored))
    return [
        rate * (1.0 if single_kind else kinds[series.contact][0]) / kinds[series.contact][1]
        for series in monitored
    ]


def _one_in(rate: float) -> str:
    return f"1 in {1.0 / rate:.0f} recordings"
