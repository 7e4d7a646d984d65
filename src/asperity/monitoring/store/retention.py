"""Retention: spectra and rows of a store that are not needed any more are deleted.

Judgements use the first recordings of a series, those after the last acknowledgement, the latest,
and the one that raised the standing alarm. These stay complete, so a judgement does not change.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from asperity.monitoring.store.database import FileVersion
from asperity.monitoring.store.schema import Run
from asperity.monitoring.store.sensor import ACKNOWLEDGED, Sensor
from asperity.monitoring.store.sensors import Sensors

FIRST, LATEST = 24, 120  # recordings that stay complete: more than are judged
VACUUM_SHARE = 0.05  # share of free pages from which the file is made smaller


@dataclass(frozen=True, slots=True)
class _Needed:
    """Recordings to be kept: complete for judgements, and as samples of the history."""

    judged: Collection[FileVersion]
    samples: Collection[FileVersion]  # one a day, and every change of state


def thin_store(
    sensors: Sensors,
    instants: Sequence[Sequence[FileVersion]],
    present: Collection[str],
    keep_s: float | None,
) -> None:
    """Delete spectra that are not needed, and thin out recordings older than `keep_s`.

    Spectra of one recording a day and of every change of state are kept up to that age, their rows
    for ever.

    Parameters
    ----------
    instants : the series in order of x
    present : files in the folder; a deleted recording whose file is there is not read again
    keep_s : age [s] relative to the latest recording; None: recordings are not deleted

    Raises
    ------
    StoreUnavailable
        if the store cannot be written; then nothing is deleted.
    """
    needed = _needed(sensors, instants)
    ordered = [key for keys in instants for key in keys]
    in_series = {*ordered}
    latest = {key.file: key for key in ordered}
    with sensors.store.transaction() as run:
        for sensor in sensors.by_name.values():
            times = sensor.times()
            limit = _limit(times, keep_s)
            old = {key for key, time in times.items() if time < limit}
            superseded = {key for key in times if latest.get(key.file, key) != key}
            judged = {key for key in times if key in needed.judged or key not in in_series}
            judged -= superseded
            kept = judged | {key for key in times if key in needed.samples} - superseded
            _delete_spectra(run, sensor, {*times} - judged - (kept - old))
            _delete_recordings(run, sensor, [key for key in ordered if key in times], old - kept)
            if keep_s is not None:
                _delete_history(run, sensor, limit)
            if present:
                sensor.forget_dropped(run, present)
    sensors.store.shrink(VACUUM_SHARE)


def _needed(sensors: Sensors, instants: Sequence[Sequence[FileVersion]]) -> _Needed:
    """Return the recordings to be kept."""
    marked = {sensors.acknowledged} - {None}
    standing = "" if sensors.standing is None else sensors.standing.file
    starts = [0]
    numbers = {*range(len(instants))[-LATEST:]}
    for number, keys in enumerate(instants):
        if marked & {Path(key.file).name for key in keys}:
            starts.append(number)
        if standing in {key.file for key in keys}:
            numbers.add(number)
    for start in starts:
        numbers |= {*range(start, min(start + FIRST + 1, len(instants)))}
    judged = {key for number in numbers for key in instants[number]}
    samples: set[FileVersion] = set()
    days: set[str] = set()
    before: str | None = None
    for keys in instants:
        state = sensors.state(keys[0])
        day = sensors.first_stored(keys[0]).day
        if state is None or state != before or day not in days:
            samples |= {*keys}
        before = state
        days.add(day)
    return _Needed(judged, samples)


def _limit(times: dict[FileVersion, datetime], keep_s: float | None) -> datetime:
    """Return the time before which recordings are old."""
    if keep_s is None or not times:
        return datetime.min.replace(tzinfo=UTC)
    return max(times.values()) - timedelta(seconds=keep_s)


def _delete_spectra(run: Run, sensor: Sensor, keys: Collection[FileVersion]) -> None:
    """Delete the stored readings of recordings."""
    for key in keys:
        recording = sensor.recordings[key]
        if recording.complete:
            run("UPDATE recording SET reading = x'' WHERE id = ?", (recording.number,))
            sensor.recordings[key] = recording._replace(complete=False)


def _delete_recordings(
    run: Run, sensor: Sensor, ordered: Sequence[FileVersion], keys: Collection[FileVersion]
) -> None:
    """Delete recordings; the next one of the series counts those deleted before it."""
    gap = 0
    for key in ordered:
        recording = sensor.recordings[key]
        if key in keys:
            gap += recording.gap + (not recording.refused)
        elif gap:
            run(
                "INSERT OR REPLACE INTO gap (recording, count) VALUES (?, ?)",
                (recording.number, recording.gap + gap),
            )
            sensor.recordings[key] = recording._replace(gap=recording.gap + gap)
            gap = 0
    for key in keys:
        sensor.delete(run, key)


def _delete_history(run: Run, sensor: Sensor, limit: datetime) -> None:
    """Delete old judgements without a change of state, and old notifications."""
    time = limit.isoformat(timespec="seconds")
    run(
        "DELETE FROM judgement WHERE id IN (SELECT id FROM (SELECT id, time, state, "
        "lag(state) OVER (ORDER BY id) AS before, row_number() OVER (ORDER BY id DESC) AS age "
        "FROM judgement WHERE sensor = ?) "
        "WHERE time < ? AND state != ? AND state = before AND age > ?)",
        (sensor.number, time, ACKNOWLEDGED, LATEST),
    )
    run(
        "DELETE FROM call WHERE sensor = ? AND time < ? AND answered IS NOT NULL "
        "AND id NOT IN (SELECT max(id) FROM call GROUP BY sensor, who)",
        (sensor.number, time),
    )
