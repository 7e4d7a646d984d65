"""Sequential alarm: one decision per recording, latched until acknowledged, at a set error rate.

Monitored series come in as `MonitoredSeries`; what a recording shows apart from any change, as
`RecordingStatus`. docs/theory/alarms.md has the equations and the measured error rates.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple, get_args

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.trend.alarm_inputs import (
    NO_MEMORY,
    AlarmChecks,
    AlarmHistory,
    AlarmState,
    LevelMemory,
    MonitoredSeries,
    RecordingStatus,
    judged_rows,
)
from asperity.trend.level_monitors import LevelJudgement, LevelMonitors
from asperity.trend.regressors import BASELINE_RECORDINGS, Condition
from asperity.trend.sequential import (
    BASELINE_POINTS,
    ChangeTest,
    ConditionRows,
    growth_test,
    knee_test,
    step_test,
    threshold,
)

ALARM_STATES: tuple[AlarmState, ...] = get_args(AlarmState)
FALSE_ALARM_RATE = 1e-3  # per recording
ALERT_RATE_FACTOR = 10.0  # false-alert rate over false-alarm rate
LATEST_RECORDINGS = 3  # the median of these is the present value of an indicator or condition
# points on either side of a step that are compared to see whether another indicator moves with it
STEP_WINDOW, STEP_WINDOW_MINIMUM = 12, 3
# change of a level that counts as moving: standard errors of the difference, and 0.9 dB
MOVE_DEVIATIONS, SMALLEST_MOVE = 3.0, 0.1
# share of the smallest change: effects of conditions are reported from there on, to this accuracy
REPORTED_SHARE = 0.4
PRIOR_ODDS_AGAINST_KNEE = 5.0
# share of the false-alarm rate given to indicators of the contact; levels share the rest
CONTACT_SHARE = 0.8


def knee_weight(x: Field, monitored: Sequence[MonitoredSeries]) -> float:
    """Return the probability of a knee against steps, cycles, bends and correlated scatter, 0 to 1.

    Uses the indicator with the clearest knee; 1 where there are too few points. The prior odds are
    calibrated so that stated probabilities match observed frequencies (docs/theory/alarms.md).
    """
    ratios = [
        assessed.change.log_ratio
        for series in monitored
        if (assessed := _assess(series, x, 0, x.size - 1)).points >= BASELINE_POINTS
    ]
    return 1.0 / (1.0 + PRIOR_ODDS_AGAINST_KNEE * float(np.exp(-max(ratios)))) if ratios else 1.0


NO_HISTORY = AlarmHistory()
NO_CHECKS = AlarmChecks()
NO_LEVEL = LevelJudgement()


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Alarm state at the end of a series.

    `states` are those after each recording; `since` is the index of the recording with which the
    present state began, None for "none". `raised_by` names the indicator behind an alert or alarm.
    `reason` is a sentence without its full stop. `explained` states which changes load, speed or
    temperature explain; empty where they explain none. `level` is the judgement of the levels by
    themselves, `level_memory` what the next judgement of a longer series needs of them.
    """

    state: AlarmState
    states: tuple[AlarmState, ...]
    since: int | None
    false_alarm_rate: float
    reason: str
    raised_by: str = ""
    explained: str = ""
    level: LevelJudgement = NO_LEVEL
    level_memory: LevelMemory = NO_MEMORY

    @property
    def verdict(self) -> str:
        """State and reason in one sentence."""
        label = {"none": "No alarm", "cannot-tell": "Cannot tell"}.get(
            self.state, self.state.capitalize()
        )
        return f"{label}: {self.reason}."

    def with_alert(self, reason: str, raised_by: str) -> "Alarm":
        """Return the alarm with an alert at the last recording, unless its state is more severe."""
        if self.state not in ("none", "cannot-tell"):
            return self
        states: tuple[AlarmState, ...] = (*self.states[:-1], "alert")
        return replace(
            self,
            state="alert",
            states=states,
            since=len(states) - 1,
            reason=reason,
            raised_by=raised_by,
        )

    def with_alarm_since(self, number: int, reason: str, raised_by: str) -> "Alarm":
        """Return the alarm raised at recording `number` and latched from there."""
        alarms: list[AlarmState] = ["alarm"] * (len(self.states) - number)
        states = (*self.states[:number], *alarms)
        return replace(
            self, state="alarm", states=states, since=number, reason=reason, raised_by=raised_by
        )


def sequential_alarm(
    x: Field,
    monitored: Sequence[MonitoredSeries],
    statuses: Sequence[RecordingStatus],
    *,
    false_alarm_rate: float = FALSE_ALARM_RATE,
    checks: AlarmChecks = NO_CHECKS,
    acknowledged: int = 0,
    unit: str = "",
    history: AlarmHistory = NO_HISTORY,
) -> Alarm:
    """Judge a series after each recording, using only the recordings up to it.

    Parameters
    ----------
    x : shape (recordings,), rising; recordings at one x are repeats and are averaged
    monitored : series that may raise the alarm; the false-alarm rate is divided among them
    statuses : one per recording
    false_alarm_rate : alarms without wear, per recording
    checks : confirmation by the stage detector, and explanations other than wear
    acknowledged : number of acknowledged recordings; the baseline restarts after them
    unit : of x
    history : earlier decisions, which stand, and the memory of the levels

    Raises
    ------
    BadInput
        for a false-alarm rate outside 0 to 0.1.
    """
    _require_rate(false_alarm_rate)
    states: list[AlarmState] = ["none"] * acknowledged
    reason = history.reason
    raised_by = history.raised_by
    levels = LevelMonitors(monitored, len(statuses), acknowledged, history.levels)
    for number in range(acknowledged, len(statuses)):
        levels.add(number)
        earlier = history.states.get(number) if number < len(statuses) - 1 else None
        if earlier is not None:
            states.append(earlier)
            continue
        if states and states[-1] == "alarm" and number > acknowledged:  # latched
            states.append("alarm")
            continue
        decision = _decide(
            [(series, _assess(series, x, acknowledged, number)) for series in monitored],
            levels,
            statuses[number],
            false_alarm_rate,
            unit,
            partial(checks.confirmed, number),
        )
        state, reason, raised_by = _unless_explained(decision, number, checks)
        states.append(state)
    if len(states) == acknowledged:
        reason = f"all {acknowledged} recordings are acknowledged and no newer one has arrived"
    return Alarm(
        state=states[-1] if len(states) > acknowledged else "none",
        states=tuple(states),
        since=_start_of_last_state(states, acknowledged),
        false_alarm_rate=false_alarm_rate,
        reason=reason,
        raised_by=raised_by,
        explained=_explained_changes(monitored, acknowledged),
        level=levels.judgement(),
        level_memory=levels.memory,
    )


def _explained_changes(monitored: Sequence[MonitoredSeries], acknowledged: int) -> str:
    """Describe the changes of all series that operating conditions explain."""
    explained = (_explained_by_conditions(series, acknowledged) for series in monitored)
    return "; ".join(filter(None, explained))


def _require_rate(false_alarm_rate: float) -> None:
    if not 0.0 < false_alarm_rate < 0.1:
        raise BadInput(
            f"false-alarm rate must lie between 0 and 0.1 per recording, got {false_alarm_rate:g}; "
            "0.001 means one in 1000 recordings"
        )


def _start_of_last_state(states: Sequence[AlarmState], acknowledged: int) -> int | None:
    """Return the recording from which on all states equal the last one; None without an alarm."""
    if len(states) == acknowledged or states[-1] == "none":
        return None
    since = len(states)
    while since > acknowledged and states[since - 1] == states[-1]:
        since -= 1
    return since


class _Assessment(NamedTuple):
    """Tests of one indicator up to a recording, and its distinct points `x`, `values`."""

    change: ChangeTest
    step: ChangeTest
    points: int
    x: Field
    values: Field


def _assess(series: MonitoredSeries, x: Field, first: int, last: int) -> _Assessment:
    judged = judged_rows(first, last)
    values, fitted = series.part(judged).at_baseline_conditions()
    point_x, (level, *rows) = _averaged_repeats(x[judged], values, fitted.rows)
    conditions = ConditionRows(np.array(rows), fitted.scatter / fitted.widths) if rows else None
    test = knee_test if series.contact else growth_test
    change, stepped = (
        run(point_x, level, smallest_change=series.smallest_change, conditions=conditions)
        for run in (test, step_test)
    )
    return _Assessment(change, stepped, point_x.size, point_x, level)


def _moves_at(assessed: _Assessment, x: float) -> bool:
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


def _explained_by_conditions(series: MonitoredSeries, first: int) -> str:
    """Describe a change that operating conditions explain; empty where they do not."""
    _, fitted = series.at_baseline_conditions(first)
    values = np.log(series.values[first:]) if series.relative else series.values[first:]
    finite = np.isfinite(values) & np.isfinite(fitted.rows).all(axis=0)
    if not fitted.names or finite.sum() < BASELINE_POINTS:
        return ""
    change, effect = (
        float(
            np.median(series_values[finite][-LATEST_RECORDINGS:])
            - np.median(series_values[finite][:BASELINE_RECORDINGS])
        )
        for series_values in (values, fitted.effect)
    )
    smallest = series.smallest_change
    if abs(effect) < REPORTED_SHARE * smallest:
        return ""
    if abs(change - effect) > REPORTED_SHARE * max(abs(change), smallest):
        return ""
    words = " and ".join(
        _condition_change(condition, first, finite)
        for condition in series.conditions
        if condition.name in fitted.names
    )
    as_ratio = np.expm1 if series.relative else float
    return (
        f"{series.name} {series.describe(float(as_ratio(change)))}, and {words} explains it "
        f"({series.describe(float(as_ratio(effect)))})"
    )


def _condition_change(condition: Condition, first: int, finite: Mask) -> str:
    """Describe how a condition changed from the baseline to the latest recordings."""
    data = condition.shown[first:][finite]
    before, now = (
        float(np.median(part)) for part in (data[:BASELINE_RECORDINGS], data[-LATEST_RECORDINGS:])
    )
    return f"{condition.name} from {before:.4g} to {now:.4g} {condition.unit}"


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


_Decision = tuple[AlarmState, str, str]  # state, reason, indicator


def _unless_explained(decision: _Decision, number: int, checks: AlarmChecks) -> _Decision:
    """Return the decision, withheld where something else than wear explains the change."""
    state, _, raised_by = decision
    if state in ("alert", "alarm") and (other := checks.explanation(number, raised_by)):
        return "none", other, ""
    return decision


def _decide(
    assessed: Sequence[tuple[MonitoredSeries, _Assessment]],
    levels: LevelMonitors,
    status: RecordingStatus,
    rate: float,
    unit: str,
    confirmed: Callable[[], bool],
) -> _Decision:
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
    assessed: Sequence[tuple[MonitoredSeries, _Assessment]],
    shares: Sequence[float],
    rate: float,
    unit: str,
    confirmed: Callable[[], bool],
) -> _Decision | None:
    """Return the first alarm by a knee or growth, else the last alert by one, else None."""
    alert: _Decision | None = None
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
    assessed: Sequence[tuple[MonitoredSeries, _Assessment]], shares: Sequence[float], unit: str
) -> _Decision | None:
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
    assessed: Sequence[tuple[MonitoredSeries, _Assessment]], shares: Sequence[float], unit: str
) -> _Decision | None:
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


def _describe_step(series: MonitoredSeries, assessment: _Assessment, unit: str) -> str:
    step = assessment.step
    return (
        f"{series.name} {series.describe(step.change)} in one step at {step.x:.4g} {unit}".rstrip()
    )


def _one_in(rate: float) -> str:
    return f"1 in {1.0 / rate:.0f} recordings"
