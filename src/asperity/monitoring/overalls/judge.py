"""Judgement of overall values: level rule and zones of ISO 20816-3, row by row."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas

from asperity.core.arrays import Field, finite_or_none
from asperity.core.displayed import Brief
from asperity.core.documents import JsonObject
from asperity.core.files import save_csv
from asperity.monitoring.alarm import LEVEL_LEAST, ratio_text
from asperity.monitoring.operating_point import LEVEL, USUAL_OIL, OperatingPoint, conditions_of
from asperity.monitoring.overalls.acknowledged import acknowledged_rows, row_name
from asperity.monitoring.overalls.columns import is_logarithmic
from asperity.monitoring.overalls.row_levels import RowLevels
from asperity.monitoring.overalls.sensors import blind_sensors
from asperity.monitoring.overalls.table import OverallValues, read_overalls
from asperity.monitoring.overalls.zones import lasting_zone, velocity_zones
from asperity.monitoring.states import ZONE
from asperity.trend import AlarmState, LevelJudgement, MonitoredSeries

NO_SPECTRUM = "overall values have no spectrum"
DECIBEL = np.log(10.0) / 20.0  # of an amplitude


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class OverallTrack(Brief):
    """Judged overall values: the state after each row, and how the last one came about.

    `since` is the row with which the present state began, None for "none". `acknowledged` counts
    the acknowledged rows. `blind` is the reason for which a sensor is blind, "" without one.
    """

    overalls: OverallValues
    states: tuple[AlarmState, ...]
    since: int | None
    raised_by: str
    reason: str
    level: LevelJudgement
    blind: str
    acknowledged: int = 0
    notes: tuple[str, ...] = ()

    @property
    def state(self) -> AlarmState:
        """State of the alarm after the last row."""
        return self.states[-1]

    @property
    def causes(self) -> list[str]:
        """Kinds of causes that are active: level, zone."""
        if self.state not in ("alert", "alarm"):
            return []
        return sorted({ZONE if self.raised_by == ZONE else "level"})

    def verdict(self) -> str:
        """Return state and reason in one sentence."""
        since = row_name(self.overalls, self.since or 0)
        start = {
            "alarm": f"ALARM since {since}",
            "alert": f"Alert since {since}",
            "blind": "Blind",
            "cannot-tell": "Cannot tell",
            "none": "No alarm",
        }[self.state]
        return f"{start}: {self.reason}."

    @property
    def last_place(self) -> str:
        """Time stamp or x of the last row, as text."""
        return row_name(self.overalls, len(self.states) - 1)

    @property
    def acknowledged_place(self) -> str | None:
        """Time stamp or exact x of the last acknowledged row, as text; None without one."""
        if not self.acknowledged:
            return None
        number, overalls = self.acknowledged - 1, self.overalls
        return overalls.times[number] if overalls.times else repr(float(overalls.x[number]))

    def scalars(self, *, rows: bool = True) -> JsonObject:
        """Return the JSON of `asperity track --series`, if requested with all rows."""
        since = None if self.since is None else row_name(self.overalls, self.since)
        alarm = {"state": self.state, "since": since, "reason": self.reason}
        leveled = self.state in ("alert", "alarm")
        return {
            "verdict": self.verdict(),
            "recordings": self.rows() if rows else [],
            "alarm": {**alarm, "raised_by": self.raised_by or None, "causes": self.causes},
            "contact": {"state": "not-seen", "reason": NO_SPECTRUM},
            "level": {
                "state": self.state if leveled else self.level.state,
                "since": since if leveled else None,
                "factor": finite_or_none(self.level.factor),
                "reason": self.reason if leveled else self.level.reason,
            },
            "sensor": {"state": "blind" if self.blind else "ok", "reason": self.blind},
            "units": dict(self.overalls.units),
            "x": f"x_{self.overalls.x_unit}" if self.overalls.x_unit else "x",
            "notes": list(self.notes),
        }

    def rows(self, latest: int | None = None) -> list[JsonObject]:
        """Return one row per time stamp, of all or the latest: x, time, values, state."""
        first = 0 if latest is None else max(len(self.states) - latest, 0)
        columns = self._columns()
        return [
            {
                name: finite_or_none(float(entry)) if name in numeric else entry
                for name, entry in zip(columns, row, strict=True)
            }
            for numeric in [{*columns} - {"time", "state"}]
            for row in zip(*(entries[first:] for entries in columns.values()), strict=True)
        ]

    @property
    def table(self) -> pandas.DataFrame:
        """One row per time stamp."""
        return pandas.DataFrame(self._columns())

    def save(self, path: str | Path) -> Path:
        """Write the table as .csv; raises as `save_csv`."""
        return save_csv(path, self.table, "a judged series")

    def _columns(self) -> dict[str, Field | Sequence[str] | Sequence[None]]:
        """Return x, times, values, conditions and states by name."""
        overalls = self.overalls
        return {
            "x": overalls.x,
            "time": overalls.times or [None] * len(self.states),
            **overalls.values,
            **overalls.conditions,
            "state": self.states,
        }


def track_overalls(path: str | Path, *, acknowledge: str | None = None) -> OverallTrack:
    """Judge a table of time stamps and overall values.

    Parameters
    ----------
    path : as `read_overalls`
    acknowledge : time stamp up to which alarms are acknowledged, as in the file or in ISO 8601, or
        a date; "last": all rows. The baseline restarts after it

    Raises
    ------
    BadInput
        for a table that cannot be read, or an unknown time stamp.
    """
    overalls = read_overalls(path)
    return judge_overalls(overalls, acknowledged_rows(overalls, acknowledge))


def judge_overalls(overalls: OverallValues, first: int) -> OverallTrack:
    """Judge overall values from a row on; those before it are acknowledged."""
    levels = RowLevels(_monitored(overalls), overalls.x.size, first)
    zones, notes = velocity_zones(overalls)
    states: list[AlarmState] = ["none"] * first
    decision = _Decision("none", "all rows are acknowledged")
    for number in range(first, overalls.x.size):
        levels.add(number)
        if decision.state != "alarm":  # latched
            zone = lasting_zone(zones, number, first) if zones else ("", "")
            state = _state(levels, zone[0])
            if state == "alarm" or number == overalls.x.size - 1:
                decision = _decide(levels, zone)
            states.append(state)
        else:
            states.append("alarm")
    blind = blind_sensors(overalls)
    reason = "; ".join(blind.values())
    if len(blind) == len(overalls.values) and decision.state != "alarm":
        decision = _Decision("blind", reason)
        states[-1] = "blind"
    elif blind:
        notes.append(f"Blind: {reason}; the alarm is that of the others.")
    return OverallTrack(
        overalls=overalls,
        states=tuple(states),
        since=_since(states),
        raised_by=decision.raised_by,
        reason=decision.reason,
        level=levels.judgement(),
        blind=reason,
        acknowledged=first,
        notes=(*overalls.notes, *_unmeasured(overalls), *notes),
    )


class _Decision(NamedTuple):
    """State after a row, the reason, and what raised it."""

    state: AlarmState
    reason: str
    raised_by: str = ""


def _state(levels: RowLevels, letter: str) -> AlarmState:
    """Return the state after a row from the levels and the lasting zone."""
    if letter == "D" or levels.state == "alarm":
        return "alarm"
    if letter == "C" or levels.state == "alert":
        return "alert"
    return "none" if levels.complete else "cannot-tell"


def _decide(levels: RowLevels, zone: tuple[str, str]) -> _Decision:
    """Return the state after a row with its reason."""
    level, state = levels.judgement(), _state(levels, zone[0])
    if state == "cannot-tell":
        return _Decision(state, "baseline incomplete: fewer than 8 rows with values")
    if state != levels.state:
        return _Decision(state, zone[1], ZONE)
    return _Decision(state, level.reason, "" if state == "none" else level.name)


def _since(states: Sequence[AlarmState]) -> int | None:
    """Return the row with which the last state began; None for "none"."""
    if states[-1] == "none":
        return None
    others = [number for number, state in enumerate(states, 1) if state != states[-1]]
    return others[-1] if others else 0


def _monitored(overalls: OverallValues) -> list[MonitoredSeries]:
    """Return the logarithms of all values, with the conditions that may explain changes."""
    keys = [*overalls.conditions]
    points = (
        [
            OperatingPoint(
                **{
                    key: None if not np.isfinite(value) else float(value)
                    for key, value in zip(keys, row, strict=True)
                }
            )
            for row in np.column_stack([overalls.conditions[key] for key in keys])
        ]
        if keys
        else []
    )
    conditions = conditions_of(points, LEVEL, USUAL_OIL) if points else ()
    return [
        MonitoredSeries(
            name=name,
            values=_logarithms(values, overalls.units[name]),
            smallest_change=LEVEL_LEAST,
            contact=False,
            describe=ratio_text,
            conditions=conditions,
        )
        for name, values in overalls.values.items()
    ]


def _logarithms(values: Field, unit: str) -> Field:
    """Return the natural logarithms of amplitudes, or of the amplitudes of decibels."""
    if is_logarithmic(unit):
        return np.where(np.isfinite(values), DECIBEL * values, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where((values > 0.0) & np.isfinite(values), np.log(values), np.nan)


def _unmeasured(overalls: OverallValues) -> list[str]:
    """Return a note on each column with numbers that have no level."""
    notes = []
    for name, values in overalls.values.items():
        counts = {"infinite": int(np.isinf(values).sum())}
        if not is_logarithmic(overalls.units[name]):
            counts["0 or below"] = int((values[np.isfinite(values)] <= 0.0).sum())
        notes += [
            f"{name} is {kind} in {count} row{'s' * (count > 1)} without a level."
            for kind, count in counts.items()
            if count
        ]
    return notes
