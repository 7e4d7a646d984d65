"""Numbers of a watch for time-series databases: by recording, and a regular heartbeat."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from time import time_ns

from asperity.core.documents import JsonObject
from asperity.monitoring.overview import SEVERITY
from asperity.monitoring.watching.watch_state import Update

STATE_CODES = {state: code for code, state in enumerate(reversed(SEVERITY))}  # 0: healthy
FIELDS = {  # key of a row, and name of the field
    "rms": "rms",
    "velocity_rms": "velocity",
    "crest": "crest",
    "kurtosis": "kurtosis",
    "crf_hz": "crf",
    "crf_std_hz": "crf_std",
    "crfa": "crfa",
    "damping_ratio": "damping",
    "clr": "clr",
    "severe_probability": "severe_probability",
}
STATE, HEARTBEAT = "state", "heartbeat"


@dataclass(frozen=True, slots=True)
class Measurement:
    """Values of one sensor at a time [ns since 1970]; integers are codes and counts."""

    machine: str
    point: str
    sensor: str
    time_ns: int
    fields: Mapping[str, float | int]


def measurements_of(update: Update) -> Iterator[Measurement]:
    """Yield the values of the new recordings of an update, sensor by sensor."""
    judgement = update.judgement or (None if update.track is None else update.track.scalars())
    if judgement is None:
        return
    machine, point, sensor = update.address
    new = {reading.file for reading in update.new}
    for row in judgement["recordings"]:
        parts = row["sensors"] or {sensor: row}
        for name, part in parts.items():
            if part["file"] in new:
                fields = _fields({**row, **part})
                started = row["started"]
                yield Measurement(machine, point, name, _nanoseconds(started), fields)


def heartbeat_of(update: Update) -> Measurement | None:
    """Return the state of a place now, as its heartbeat; None before its first judgement."""
    judgement = update.judgement
    state = None if update.track is None else update.track.alarm.state
    if judgement is not None:
        state = judgement["alarm"]["state"]
    if state is None:
        return None
    return Measurement(*update.address, time_ns(), {STATE: STATE_CODES[state], HEARTBEAT: 1})


def _fields(row: JsonObject) -> dict[str, float | int]:
    """Return the finite numbers of a row by names of fields, and the code of its state."""
    fields: dict[str, float | int] = {}
    for key, name in FIELDS.items():
        value = row.get(key)
        if isinstance(value, int | float) and math.isfinite(value):
            fields[name] = float(value)
    fields[STATE] = STATE_CODES[str(row["state"])]
    return fields


def _nanoseconds(started: str | None) -> int:
    """Return a stated start, as UTC where no zone is known, or now [ns since 1970]."""
    if not started:
        return time_ns()
    time = datetime.fromisoformat(started)
    time = time if time.tzinfo is not None else time.replace(tzinfo=UTC)
    since = time - datetime(1970, 1, 1, tzinfo=UTC)
    return (since.days * 86_400 + since.seconds) * 10**9 + since.microseconds * 1000
