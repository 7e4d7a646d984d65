"""Judgement of overall values: level rule and zones of ISO 20816-3, row by row."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas

from asperity.core.arrays import finite_or_none
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput
from asperity.core.files import write_csv
from asperity.monitoring.alarm import LAST, LEVEL_LEAST, ratio_text
from asperity.monitoring.operating_point import LEVEL, USUAL_OIL, OperatingPoint, conditions_of
from asperity.monitoring.overalls.table import OverallValues, read_overalls
from asperity.monitoring.states import ZONE
from asperity.rating import severity_zone
from asperity.trend import AlarmState, LevelJudgement, LevelMonitors, MonitoredSeries

METRES_PER_SECOND = {"m/s": 1.0, "mm/s": 1e-3, "in/s": 0.0254, "ips": 0.0254}
STUCK = 30  # last equal rows from which a sensor that varied before counts as blind
NO_SPECTRUM = "overall values have no spectrum"


@dataclass(frozen=True, slots=True, kw_only=True)
class OverallTrack:
    """Judged overall values: the state after each row, and how the last one came about.

    `since` is the row with which the present state began, None for "none".
    """

    overalls: OverallValues
    states: tuple[AlarmState, ...]
    since: int | None
    raised_by: str
    reason: str
    level: LevelJudgement
    blind: str

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
        start = {
            "alarm": f"ALARM since {self._place(self.since or 0)}",
            "alert": f"Alert since {self._place(self.since or 0)}",
            "blind": "Blind",
            "cannot-tell": "Cannot tell",
            "none": "No alarm",
        }[self.state]
        return f"{start}: {self.reason}."

    @property
    def last_place(self) -> str:
        """Time stamp or x of the last row, as text."""
        return self._place(len(self.states) - 1)

    def scalars(self, *, rows: bool = True) -> JsonObject:
        """Return the JSON of `asperity track --series`, if requested with all rows."""
        since = None if self.since is None else self._place(self.since)
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
            "notes": list(self.overalls.notes),
        }

    def rows(self) -> list[JsonObject]:
        """Return one row per time stamp: x, time, values, conditions, state."""
        overalls = self.overalls
        columns = {**overalls.values, **overalls.conditions}
        return [
            {
                "x": finite_or_none(float(x)),
                "time": overalls.times[number] if overalls.times else None,
                **{name: finite_or_none(float(values[number])) for name, values in columns.items()},
                "state": self.states[number],
            }
            for number, x in enumerate(overalls.x)
        ]

    @property
    def table(self) -> pandas.DataFrame:
        """One row per time stamp."""
        return pandas.DataFrame(self.rows())

    def save(self, path: str | Path) -> Path:
        """Write the table as .csv.

        Raises
        ------
        BadInput
            for another suffix, or a path that is not writable.
        """
        path = Path(path)
        if path.suffix.lower() != ".csv":
            raise BadInput(f"a judged series is saved as .csv, got {path.name}; change the suffix")
        write_csv(path, self.table)
        return path

    def _place(self, number: int) -> str:
        """Return time stamp or x of a row, as text."""
        overalls = self.overalls
        if overalls.times:
            return overalls.times[number]
        return f"{overalls.x[number]:g} {overalls.x_unit}".rstrip()


def track_overalls(path: str | Path, *, acknowledge: str | None = None) -> OverallTrack:
    """Judge a table of time stamps and overall values.

    Parameters
    ----------
    path : as `read_overalls`
    acknowledge : time stamp up to which alarms are acknowledged, as in the file or in ISO 8601;
        "last": all rows. The baseline restarts after it

    Raises
    ------
    BadInput
        for a table that cannot be read, or an unknown time stamp.
    """
    overalls = read_overalls(path)
    first = _acknowledged(overalls, acknowledge)
    levels = LevelMonitors(_monitored(overalls), overalls.x.size, first)
    zones = _zones(overalls)
    states: list[AlarmState] = ["none"] * first
    decision = _Decision("none", "all rows are acknowledged")
    for number in range(first, overalls.x.size):
        levels.add(number)
        if decision.state != "alarm":  # latched
            decision = _decide(levels, _lasting_zone(zones, number, first))
        states.append(decision.state)
    blind = _blind(overalls)
    if blind and decision.state != "alarm":
        decision = _Decision("blind", blind)
        states[-1] = "blind"
    return OverallTrack(
        overalls=overalls,
        states=tuple(states),
        since=_since(states),
        raised_by=decision.raised_by,
        reason=decision.reason,
        level=levels.judgement(),
        blind=blind,
    )


class _Decision(NamedTuple):
    """State after a row, the reason, and what raised it."""

    state: AlarmState
    reason: str
    raised_by: str = ""


def _decide(levels: LevelMonitors, zone: tuple[str, str]) -> _Decision:
    """Decide the state after a row from the levels and the lasting zone."""
    level = levels.judgement()
    letter, reason = zone
    if letter == "D" and level.state != "alarm":
        return _Decision("alarm", reason, ZONE)
    if letter == "C" and level.state == "none":
        return _Decision("alert", reason, ZONE)
    if level.state == "none" and not levels.complete:
        return _Decision("cannot-tell", "baseline incomplete: fewer than 8 rows with values")
    return _Decision(level.state, level.reason, "" if level.state == "none" else level.name)


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
    with np.errstate(divide="ignore", invalid="ignore"):
        return [
            MonitoredSeries(
                name=name,
                values=np.where(values > 0.0, np.log(values), np.nan),
                smallest_change=LEVEL_LEAST,
                contact=False,
                describe=ratio_text,
                conditions=conditions,
            )
            for name, values in overalls.values.items()
        ]


def _zones(overalls: OverallValues) -> dict[str, tuple[str, ...]]:
    """Return the zone of ISO 20816-3 after each row, "" if unknown, for each velocity."""
    if overalls.machine_class is None:
        return {}
    zones = {}
    for name, values in overalls.values.items():
        scale = METRES_PER_SECOND.get(overalls.units[name].lower())
        if scale is not None and "peak" not in name.lower():
            zones[name] = tuple(
                severity_zone(scale * value, overalls.machine_class) if np.isfinite(value) else ""
                for value in values
            )
    return zones


def _lasting_zone(zones: dict[str, tuple[str, ...]], number: int, first: int) -> tuple[str, str]:
    """Return the better of the last two zones of the worst velocity, and the reason in words."""
    if number <= first or not zones:
        return "", ""
    lasting = {name: min(of[number - 1], of[number]) for name, of in zones.items()}
    name = max(lasting, key=lambda name: lasting[name])
    return lasting[name], f"{name} is in zone {lasting[name]} of ISO 20816-3"


def _blind(overalls: OverallValues) -> str:
    """Return why the last rows show nothing of the machine, or ""."""
    latest = {name: values[-1] for name, values in overalls.values.items()}
    if not any(np.isfinite(value) and value > 0.0 for value in latest.values()):
        return "the last row has no value above 0"
    if overalls.x.size <= 2 * STUCK:
        return ""
    stuck = [
        name
        for name, values in overalls.values.items()
        if np.ptp(values[-STUCK:]) == 0.0 and _varies(values[:-STUCK])
    ]
    if len(stuck) < len(latest):
        return ""
    return f"{', '.join(stuck)} has not changed in the last {STUCK} rows"


def _varies(values: Sequence[float] | np.ndarray) -> bool:
    """Return whether at most half of the successive values are equal."""
    return bool(np.mean(np.diff(values) == 0.0) < 0.5)


def _acknowledged(overalls: OverallValues, time: str | None) -> int:
    """Return the number of acknowledged rows."""
    if time is None:
        return 0
    if time == LAST:
        return int(overalls.x.size)
    stamp = time.strip().replace(" ", "T")
    places = overalls.times or [f"{x:g}" for x in overalls.x]
    numbers = [number for number, place in enumerate(places, 1) if place == stamp]
    if not numbers:
        raise BadInput(
            f"{time} is not a time stamp of {overalls.path.name}; acknowledge one of them, such as "
            f"{places[-1]}, or {LAST!r} for the newest"
        )
    return numbers[-1]
