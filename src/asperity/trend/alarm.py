"""Sequential alarm: one decision per recording, latched until acknowledged, at a set error rate.

Monitored series come in as `MonitoredSeries`; what a recording shows apart from any change, as
`RecordingStatus`. docs/theory/alarms.md has the equations and the measured error rates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

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
)
from asperity.trend.decision import Decision, Judge, assess
from asperity.trend.level_monitors import LevelJudgement, LevelMonitors
from asperity.trend.regressors import BASELINE_RECORDINGS, Condition
from asperity.trend.sequential import BASELINE_POINTS

ALARM_STATES: tuple[AlarmState, ...] = get_args(AlarmState)
FALSE_ALARM_RATE = 1e-3  # per recording
LATEST_RECORDINGS = 3  # the median of these is the present value of an indicator or condition
# share of the smallest change: effects of conditions are reported from there on, to this accuracy
REPORTED_SHARE = 0.4
PRIOR_ODDS_AGAINST_KNEE = 5.0


def knee_weight(x: Field, monitored: Sequence[MonitoredSeries]) -> float:
    """Return the probability of a knee against steps, cycles, bends and correlated scatter, 0 to 1.

    Uses the indicator with the clearest knee; 1 where there are too few points. The prior odds are
    calibrated so that stated probabilities match observed frequencies (docs/theory/alarms.md).
    """
    ratios = [
        assessed.change.log_ratio
        for series in monitored
        if (assessed := assess(series, x, 0, x.size - 1)).points >= BASELINE_POINTS
    ]
    return 1.0 / (1.0 + PRIOR_ODDS_AGAINST_KNEE * float(np.exp(-max(ratios)))) if ratios else 1.0


NO_HISTORY = AlarmHistory()
NO_CHECKS = AlarmChecks()
NO_LEVEL = LevelJudgement()


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Alarm state at the end of a series.

    `states` are those after each recording; `since` is the index of the recording with which the
    present state began, None for "none". `raised_by` names the indicator behind an alert or alarm,
    `raised_since` one that would raise the alarm now, after it was latched.
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
    raised_since: str = ""
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
    levels = LevelMonitors(monitored, len(statuses), acknowledged, history.levels)
    judge = Judge(
        x,
        monitored,
        statuses,
        levels,
        false_alarm_rate,
        checks=checks,
        first=acknowledged,
        unit=unit,
    )
    decision, latched = _decided_states(judge, states, history)
    _, reason, raised_by = decision
    if len(states) == acknowledged:
        reason = f"all {acknowledged} recordings are acknowledged and no newer one has arrived"
    return Alarm(
        state=states[-1] if len(states) > acknowledged else "none",
        states=tuple(states),
        since=_start_of_last_state(states, acknowledged),
        false_alarm_rate=false_alarm_rate,
        reason=reason,
        raised_by=raised_by,
        raised_since=judge.alarm_by(len(states) - 1) if latched else "",
        explained=_explained_changes(monitored, acknowledged),
        level=levels.judgement(),
        level_memory=levels.memory,
    )


def _decided_states(
    judge: Judge, states: list[AlarmState], history: AlarmHistory
) -> tuple[Decision, bool]:
    """Add the state after each recording; return the last decision, and whether it is latched."""
    decision: Decision = ("none", history.reason, history.raised_by)
    latched = False
    for number in range(judge.first, len(judge.statuses)):
        judge.levels.add(number)
        earlier = history.states.get(number) if number < len(judge.statuses) - 1 else None
        latched = earlier is None and number > judge.first and states[-1] == "alarm"
        if earlier is not None:
            states.append(earlier)
        elif latched:
            states.append("alarm")
        else:
            decision = judge.decide(number)
            states.append(decision[0])
    return decision, latched


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
