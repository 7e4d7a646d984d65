"""Inputs of the alarm: monitored series, status of each recording, checks, earlier decisions."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.core.arrays import Field
from asperity.core.documents import JsonObject
from asperity.trend.regressors import (
    NO_CONDITION_EFFECT,
    Condition,
    ConditionEffect,
    fit_conditions,
)

AlarmState = Literal["none", "alert", "alarm", "blind", "cannot-tell"]


FIRST_JUDGED, LATEST_JUDGED = 8, 112  # recordings that judge the last one of a long series


def judged_rows(first: int, last: int) -> NDArray[np.intp]:
    """Return the recordings that judge `last`: the first ones from `first` on, and the latest."""
    start = max(last - LATEST_JUDGED + 1, first)
    return np.concatenate(
        [np.arange(first, min(first + FIRST_JUDGED, start)), np.arange(start, last + 1)]
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class MonitoredSeries:
    """One indicator over the recordings of a series, which may raise the alarm.

    Parameters
    ----------
    name : of the indicator, for sentences
    values : shape (recordings,); nan where not determined
    smallest_change : smallest change worth acting on, in units of `values` (dead band)
    contact : True for an indicator of the contact, whose severe stage is a rise that flattens;
        False for a level, which grows
    describe : change to words, such as "rose by 5 %"
    gain_dependent : whether the sensor's gain changes it
    step_alarms : whether a step upwards raises the alarm, unless all gain-dependent series of the
        sensor move with it (then the sensor may have been moved)
    conditions : operating conditions that may explain changes; same recordings
    relative : whether `values` are ratios; conditions then act on their logarithm
    sensor : name of the sensor, empty for a single one
    key : identity in the memory of the levels, such as sensor, name and unit; default: the name
    fault_frequency : name of the fault frequency at which the envelope's depth is measured
    """

    name: str
    values: Field
    smallest_change: float
    contact: bool
    describe: Callable[[float], str]
    gain_dependent: bool = False
    step_alarms: bool = False
    sensor: str = ""
    key: str = ""
    fault_frequency: str = ""
    conditions: tuple[Condition, ...] = ()
    relative: bool = False

    @property
    def identity(self) -> str:
        """Key in the memory of the levels."""
        return self.key or self.name

    def part(self, rows: NDArray[np.intp]) -> "MonitoredSeries":
        """Return the series of some recordings."""
        conditions = tuple(
            replace(condition, values=condition.values[rows], shown=condition.shown[rows])
            for condition in self.conditions
        )
        return replace(self, values=self.values[rows], conditions=conditions)

    def at_baseline_conditions(self, first: int = 0) -> tuple[Field, ConditionEffect]:
        """Return the values from a recording on, corrected to the baseline's conditions."""
        part = slice(first, None)
        values = self.values[part]
        if not self.conditions:
            return values, NO_CONDITION_EFFECT
        conditions = [
            replace(condition, values=condition.values[part]) for condition in self.conditions
        ]
        fitted = fit_conditions(
            np.log(values) if self.relative else values,
            conditions,
            smallest_change=self.smallest_change,
        )
        return np.asarray(
            values * np.exp(-fitted.effect) if self.relative else values - fitted.effect
        ), fitted


class RecordingStatus(NamedTuple):
    """State of a recording before any test: "none" (usable) or "blind"; and why."""

    state: AlarmState = "none"
    reason: str = ""


class LevelMemory(NamedTuple):
    """Memory of all levels after `judged` recordings of the series, as JSON by level.

    After `gap` recordings others are missing: the baseline is that of the recordings before it.
    """

    judged: int = 0
    monitors: Mapping[str, JsonObject] = MappingProxyType({})
    gap: int = 0


NO_MEMORY = LevelMemory()


class AlarmHistory(NamedTuple):
    """Earlier decisions: states by recording number, reason and source of a standing alarm, levels.

    Stored states are final, except that the last recording is always judged again.
    """

    states: Mapping[int, AlarmState] = MappingProxyType({})
    reason: str = ""
    raised_by: str = ""
    levels: LevelMemory = NO_MEMORY


class AlarmChecks(NamedTuple):
    """Checks made before an alarm is raised.

    `confirmed(number)` states whether the stage detector finds the severe stage in the recordings
    up to `number`; an alarm by an indicator of the contact requires it. `explanation(number, name)`
    returns in words what other than wear explains a change of the indicator `name` up to `number`
    (empty for nothing); an explained alarm or alert is withheld.
    """

    confirmed: Callable[[int], bool] = lambda _: True
    explanation: Callable[[int, str], str] = lambda _number, _name: ""
