"""Level rule over all levels of a series, with a memory between judgements."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from asperity.trend.alarm_inputs import NO_MEMORY, LevelMemory, MonitoredSeries, judged_rows
from asperity.trend.level_rule import LevelMonitor, LevelState

STATES: tuple[LevelState, ...] = ("none", "alert", "alarm")


class EnvelopeDepth(NamedTuple):
    """Present depth of the envelope at a fault frequency, and its factor over the baseline."""

    fault_frequency: str
    sensor: str
    depth: float
    factor: float


class LevelJudgement(NamedTuple):
    """Most severe state of all levels after a recording.

    `factor` is the highest present level over its baseline, nan if unknown; `name` the level behind
    the state, or the highest one. `depths` are those of the envelope, the highest factor first.
    """

    state: LevelState = "none"
    factor: float = math.nan
    name: str = ""
    reason: str = "no level could be measured"
    depths: tuple[EnvelopeDepth, ...] = ()


class LevelMonitors:
    """Monitors of the levels of a series; recordings are added in order.

    `memory` is that before the last recording of the series, which is always judged again.
    """

    def __init__(
        self,
        monitored: Sequence[MonitoredSeries],
        count: int,
        first: int,
        memory: LevelMemory = NO_MEMORY,
    ) -> None:
        self._levels = [series for series in monitored if not series.contact]
        self._first, self._last, self._gap = first, count - 1, memory.gap
        stored = memory.monitors if memory.judged >= first else {}
        self._next = max(memory.judged, first) if stored else first
        self._monitors = {
            series.identity: LevelMonitor.from_json(stored[series.identity])
            if series.identity in stored
            else LevelMonitor()
            for series in self._levels
        }
        self.memory = LevelMemory(self._next, stored)

    @property
    def complete(self) -> bool:
        """True if the baseline of a level is known."""
        return any(monitor.complete for monitor in self._monitors.values())

    def add(self, number: int) -> None:
        """Add a recording of the series, unless the memory includes it."""
        if number < self._next:
            return
        if number == self._last:
            monitors = {key: monitor.to_json() for key, monitor in self._monitors.items()}
            self.memory = LevelMemory(number, {**self.memory.monitors, **monitors})
        for series in self._levels:
            monitor = self._monitors[series.identity]
            monitor.update(self._value(series, number))
            monitor.keeps_baseline |= number + 1 == self._gap
        self._next = number + 1

    def judgement(self) -> LevelJudgement:
        """Return the most severe state of all levels after the recordings so far."""
        rises = {series.name: self._monitors[series.identity].rise for series in self._levels}
        findings = {series.name: self._monitors[series.identity].finding for series in self._levels}
        known = [series for series in self._levels if math.isfinite(rises[series.name])]
        if not known:
            return LevelJudgement()
        series = max(
            known,
            key=lambda series: (STATES.index(findings[series.name].state), rises[series.name]),
        )
        (state, evidence), rise = findings[series.name], rises[series.name]
        words = f"{series.name} {series.describe(rise)}"
        if state == "none":
            words = f"no level stays above its baseline; the highest, {series.name}, is "
            words += f"{math.exp(rise):.2g} times its baseline"
        elif evidence:
            words = f"{words}, {evidence}"
        return LevelJudgement(state, math.exp(rise), series.name, words, self._depths())

    def _depths(self) -> tuple[EnvelopeDepth, ...]:
        """Return the depths of the envelope, the highest factor over the baseline first."""
        depths = []
        for series in self._levels:
            monitor = self._monitors[series.identity]
            if series.fault_frequency and math.isfinite(monitor.rise):
                depth, factor = math.exp(monitor.present), math.exp(monitor.rise)
                depths.append(EnvelopeDepth(series.fault_frequency, series.sensor, depth, factor))
        return tuple(sorted(depths, key=lambda depth: -depth.factor))

    def withhold(self, name: str) -> None:
        """End the finding of a level whose change something else explains."""
        for series in self._levels:
            if series.name == name:
                self._monitors[series.identity].withhold()

    def _value(self, series: MonitoredSeries, number: int) -> float:
        """Return the level of a recording at the conditions of the baseline."""
        if not series.conditions or not math.isfinite(series.values[number]):
            return float(series.values[number])
        rows = judged_rows(self._first, number)
        return float(series.part(rows).at_baseline_conditions()[0][-1])
