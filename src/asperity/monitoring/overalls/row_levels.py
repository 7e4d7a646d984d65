"""Level rule over many rows: reasons in words are composed only where they are needed."""

from collections.abc import Sequence

from asperity.trend import (
    AlarmState,
    LevelJudgement,
    LevelMemory,
    LevelMonitor,
    LevelMonitors,
    MonitoredSeries,
)

SEVERITY: tuple[AlarmState, ...] = ("none", "alert", "alarm")


class RowLevels:
    """Levels of a table, judged row by row, of `count` rows from `first` on.

    With operating conditions each value is first corrected to those of the baseline.
    """

    def __init__(self, monitored: Sequence[MonitoredSeries], count: int, first: int) -> None:
        self._monitored, self._count, self._first = monitored, count, first
        self._corrected = any(series.conditions for series in monitored)
        self._levels = LevelMonitors(monitored, count, first)
        self._monitors = {series.name: LevelMonitor() for series in monitored}
        self._values = [(self._monitors[series.name], series.values) for series in monitored]

    def add(self, number: int) -> None:
        """Add a row."""
        if self._corrected:
            self._levels.add(number)
            return
        for monitor, values in self._values:
            monitor.update(float(values[number]))

    @property
    def state(self) -> AlarmState:
        """Most severe state of all levels."""
        if self._corrected:
            return self._levels.judgement().state
        return max((monitor.finding.state for monitor, _ in self._values), key=SEVERITY.index)

    @property
    def complete(self) -> bool:
        """True if the baseline of a level is known."""
        if self._corrected:
            return self._levels.complete
        return any(monitor.complete for monitor, _ in self._values)

    def judgement(self) -> LevelJudgement:
        """Return the most severe state of all levels after the rows so far, with its reason."""
        if self._corrected:
            return self._levels.judgement()
        stored = {name: monitor.to_json() for name, monitor in self._monitors.items()}
        memory = LevelMemory(self._count, stored)
        return LevelMonitors(self._monitored, self._count, self._first, memory).judgement()
