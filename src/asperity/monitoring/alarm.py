"""Alarm of a series: indicators, their relevant changes, and states between recordings.

`asperity.trend` holds the test; this module chooses the indicators and the least change of each.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.monitoring.operating_point import (
    ANY_CONTACT,
    DAMPING,
    LEVEL,
    PULSES,
    Response,
    ResponseExponents,
    conditions_of,
)
from asperity.monitoring.reading import Reading
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.series_state import PreviousStates
from asperity.monitoring.settings import TrackSettings
from asperity.monitoring.states import ZONE
from asperity.trend import (
    Alarm,
    AlarmChecks,
    AlarmHistory,
    Condition,
    LevelMemory,
    MonitoredSeries,
    RecordingStatus,
    Stages,
    StageSource,
    knee_weight,
    sequential_alarm,
    warm_up,
)

CRF_LEAST = 0.05  # relative change of CRF: the asperities' load share up by a third, (1.05)^6
DAMPING_LEAST = 0.2  # change of the logarithm of damping
LEVEL_LEAST = float(np.log(2.0))  # 6 dB, a significant change according to ISO 13373-1
BASELINE = 8  # recordings whose median CRF is the reference
LAST = "last"
KURTOSIS = "kurtosis"
CRF = "CRF"
RMS = "the level (rms)"
ENVELOPE = "the envelope at"  # before the name of a fault frequency
MAX_RESIDUAL = 0.4  # of the least change, that a warm-up may leave unexplained


def raise_alarm(
    tracked: Sequence[TrackedRecording],
    settings: TrackSettings,
    stages: Stages | None,
    stages_of: Callable[[Sequence[TrackedRecording]], Stages | None],
    *,
    previous: PreviousStates | None = None,
    unit: str = "",
    response: Response = ANY_CONTACT,
    of_contact: bool = True,
) -> Alarm:
    """Compute the alarm of a series, consistent with its stages.

    Parameters
    ----------
    settings : deciding indicator, false-alarm rate and acknowledged recording
    stages, stages_of : stages of the whole series, and a function for a part of it
    previous : states of these recordings from the judgement before
    unit : unit of x
    response : response of CRF to load, speed and temperature
    of_contact : whether the line belongs to the contact; one of unknown origin raises nothing

    Raises
    ------
    BadInput
        if the acknowledged recording does not exist, or the rate is invalid.
    """
    source = settings.stages_from
    acknowledge = settings.acknowledge
    false_alarm_rate = settings.false_alarm_rate
    contact = _contact_indicators(tracked, source, response) if of_contact else []
    levels = _level_indicators(tracked, response)
    x = np.array([recording.x for recording in tracked])
    warming = Warming(x, contact, levels, unit)
    alarm = sequential_alarm(
        x,
        [*contact, *levels],
        _statuses(tracked),
        false_alarm_rate=false_alarm_rate,
        checks=AlarmChecks(
            confirmed=lambda number: _severe(stages_of(tracked[: number + 1])),
            explanation=warming.excuses,
        ),
        acknowledged=_acknowledged(tracked, acknowledge),
        unit=unit,
        history=_previous_states(tracked, previous),
    )
    if (warm_up_note := warming.explanation(len(tracked) - 1)) and acknowledge is None:
        alarm = replace(alarm, explained="; ".join(filter(None, [alarm.explained, warm_up_note])))
    elif stages is not None and stages.kind == "severe" and acknowledge is None:
        rate = f"the set false-alarm rate (1 in {1.0 / false_alarm_rate:.0f})"
        alarm = alarm.with_alert(
            f"a severe stage is indicated, not yet significant at {rate}", source
        )
    return _by_zone(tracked, _acknowledged(tracked, acknowledge), alarm)


class Warming:
    """Detection of a warm-up by its shape, where the temperature is not stated."""

    def __init__(
        self,
        x: Field,
        contact: Sequence[MonitoredSeries],
        levels: Sequence[MonitoredSeries],
        unit: str,
    ) -> None:
        crf = next((indicator for indicator in contact if indicator.name == CRF), None)
        level = next((indicator for indicator in levels if indicator.name.startswith(RMS)), None)
        self.x, self.unit, self.crf, self.level = x, unit, crf, level
        self.names = {CRF, *(indicator.name for indicator in levels if indicator.gain_dependent)}
        names = [] if crf is None else [condition.name for condition in crf.conditions]
        self.applicable = (
            crf is not None and level is not None and "temperature" not in " ".join(names)
        )

    def explanation(self, number: int) -> str:
        """Return a sentence if recordings up to `number` look like a warm-up, otherwise nothing."""
        if not self.applicable or self.crf is None or self.level is None:
            return ""
        rows = slice(number + 1)
        fit = warm_up(self.x[rows], self.crf.values[rows], self.level.values[rows])
        if (
            fit is None
            or abs(fit.residual[0]) > MAX_RESIDUAL * CRF_LEAST
            or abs(fit.residual[1]) > MAX_RESIDUAL * LEVEL_LEAST
        ):
            return ""
        length = f"{fit.time_constant:.2g} {self.unit}".rstrip()
        return (
            f"this looks like a warm-up: CRF {_relative_change(fit.crf)} and {self.level.name} "
            f"{ratio_text(fit.level)}, time constant {length}; state the oil temperature to confirm"
        )

    def excuses(self, number: int, name: str) -> str:
        """Return the explanation of a change in an indicator that a warm-up affects."""
        return self.explanation(number) if name in self.names else ""


def _previous_states(
    tracked: Sequence[TrackedRecording], previous: PreviousStates | None
) -> AlarmHistory:
    if previous is None:
        return AlarmHistory()
    states = {}
    for number, recording in enumerate(tracked):
        for file in recording.files:
            if file in previous.states:
                states[number] = previous.states[file]
    levels = _level_memory(tracked, previous)
    return AlarmHistory(states, previous.reason, previous.raised_by, levels)


def _level_memory(tracked: Sequence[TrackedRecording], previous: PreviousStates) -> LevelMemory:
    """Return the memory of the levels, up to the recording after which it was stored."""

    def number_after(file: str) -> int:
        numbers = (n for n, recording in enumerate(tracked, 1) if file in recording.files)
        return next(numbers, 0)

    if previous.levels is None:
        return LevelMemory(gap=number_after(previous.before_gap))
    judged = number_after(previous.levels.last)
    return LevelMemory(judged, previous.levels.monitors) if judged else LevelMemory()


def _severe(stages: Stages | None) -> bool:
    return stages is not None and stages.kind == "severe"


def at_reference(tracked: Sequence[TrackedRecording], response: Response) -> list[TrackedRecording]:
    """Reduce CRF and damping ratio to load, speed and temperature of the first recordings."""
    crf = _crf(tracked, response)
    damping = _damping(tracked, response)
    frequency = (
        np.full(len(tracked), np.nan)
        if crf is None
        else _reference_crf(tracked) * crf.at_baseline_conditions()[0]
    )
    ratio = (
        np.full(len(tracked), np.nan)
        if damping is None
        else np.exp(-damping.at_baseline_conditions()[0])
    )
    return [
        replace(recording, crf_reference_hz=float(hertz), damping_reference=float(share))
        for recording, hertz, share in zip(tracked, frequency, ratio, strict=True)
    ]


def severe_stage_weight(
    tracked: Sequence[TrackedRecording], source: StageSource, response: Response
) -> float:
    """Weigh a severe stage against steps, cycles and correlated scatter, which stages neglect."""
    return knee_weight(
        np.array([recording.x for recording in tracked]),
        _contact_indicators(tracked, source, response),
    )


def _reference_crf(tracked: Sequence[TrackedRecording]) -> float:
    crf = np.array([recording.resonance.crf_hz for recording in tracked])
    return float(np.median(crf[np.isfinite(crf)][:BASELINE]))


def _conditions(
    tracked: Sequence[TrackedRecording], exponents: ResponseExponents, response: Response
) -> tuple[Condition, ...]:
    return conditions_of([recording.operating for recording in tracked], exponents, response.oil)


def _crf(tracked: Sequence[TrackedRecording], response: Response) -> MonitoredSeries | None:
    crf = np.array([recording.resonance.crf_hz for recording in tracked])
    if not np.isfinite(crf).any():
        return None
    return MonitoredSeries(
        name=CRF,
        values=crf / _reference_crf(tracked),
        smallest_change=CRF_LEAST,
        contact=True,
        describe=_relative_change,
        conditions=_conditions(tracked, response.crf, response),
        relative=True,
    )


def _damping(tracked: Sequence[TrackedRecording], response: Response) -> MonitoredSeries | None:
    ratio = np.array([recording.damping[0] for recording in tracked])
    if not np.isfinite(ratio).any():
        return None
    return MonitoredSeries(
        name="damping",
        values=-np.log(ratio),
        smallest_change=DAMPING_LEAST,
        contact=True,
        describe=lambda by: ratio_text(-by),
        conditions=_conditions(tracked, DAMPING, response),
    )


def _contact_indicators(
    tracked: Sequence[TrackedRecording], source: StageSource, response: Response
) -> list[MonitoredSeries]:
    crf = _crf(tracked, response)
    damping = _damping(tracked, response)
    if source == "both" and (crf is None or damping is None):
        return []
    return [
        indicator
        for indicator in (
            crf if source != "damping" else None,
            damping if source != "crf" else None,
        )
        if indicator
    ]


def _level_indicators(
    tracked: Sequence[TrackedRecording], response: Response
) -> list[MonitoredSeries]:
    """Return level and kurtosis of a running machine on each sensor, over the recordings."""
    sensors = dict.fromkeys(name for recording in tracked for name in recording.readings)
    several = len(sensors) > 1
    return [
        level
        for sensor in sensors
        for level in _levels_on_sensor(
            sensor,
            [recording.readings.get(sensor) for recording in tracked],
            tracked,
            response,
            several=several,
        )
    ]


def _levels_on_sensor(
    sensor: str,
    readings: Sequence[Reading | None],
    tracked: Sequence[TrackedRecording],
    response: Response,
    *,
    several: bool,
) -> list[MonitoredSeries]:
    """Return the indicators of a sensor, from recordings in its most frequent unit."""
    unit = _usual_unit(readings)
    if unit is None:
        return []
    levels = {
        RMS: _quality_getter("rms"),
        KURTOSIS: _quality_getter("kurtosis"),
        "velocity (rms)": lambda reading: reading.velocity,
    }
    lines = _named_getters(readings, "lines", "the line at")
    depths = _named_getters(readings, "depths", ENVELOPE)
    levels |= _named_getters(readings, "bands", "the level") | lines
    level_conditions, pulse_conditions = (
        _conditions(tracked, exponents, response) for exponents in (LEVEL, PULSES)
    )
    values_by_name = {
        label: _logarithms(readings, unit, value) for label, value in (levels | depths).items()
    }
    return [
        MonitoredSeries(
            name=f"{label} on {sensor}" if several else label,
            key=f"{sensor}: {label} [{unit}]",
            values=values,
            smallest_change=LEVEL_LEAST,
            contact=False,
            describe=ratio_text,
            gain_dependent=label not in depths and label != KURTOSIS,
            step_alarms=label in depths,
            sensor=sensor if several else "",
            fault_frequency=label.removeprefix(f"{ENVELOPE} ") if label in depths else "",
            conditions=pulse_conditions
            if label in depths or label in lines or label == KURTOSIS
            else level_conditions,
        )
        for label, values in values_by_name.items()
        if np.isfinite(values).any()
    ]


def _usual_unit(readings: Sequence[Reading | None]) -> str | None:
    """Return the most frequent unit of readings; None if nothing could be read."""
    units = Counter(
        reading.unit for reading in readings if reading is not None and reading.quality is not None
    )
    return units.most_common(1)[0][0] if units else None


def _named_getters(
    readings: Sequence[Reading | None], field: str, label: str
) -> dict[str, Callable[[Reading], float]]:
    """Return a function for each named value in a field of the readings, by its words."""
    names = dict.fromkeys(
        name for reading in readings if reading is not None for name in getattr(reading, field)
    )
    return {f"{label} {name}": _getter(field, name) for name in names}


def _logarithms(
    readings: Sequence[Reading | None], unit: str, value: Callable[[Reading], float]
) -> Field:
    """Return the logarithm of a value over the recordings; nan for dead sensors, other units."""
    values = np.full(len(readings), np.nan)
    for number, reading in enumerate(readings):
        quality = None if reading is None else reading.quality
        if (
            reading is not None
            and quality is not None
            and not quality.dead
            and reading.unit == unit
            and value(reading) > 0.0
        ):
            values[number] = np.log(value(reading))
    return values


def _quality_getter(name: str) -> Callable[[Reading], float]:
    return lambda reading: float(getattr(reading.quality, name))


def _getter(field: str, name: str) -> Callable[[Reading], float]:
    return lambda reading: getattr(reading, field).get(name, np.nan)


def _by_zone(tracked: Sequence[TrackedRecording], first: int, alarm: Alarm) -> Alarm:
    """Add the zones of ISO 20816-3: zone D twice in succession alarms, C at the end alerts."""
    zones = [
        (number, zone)
        for number, recording in enumerate(tracked)
        if number >= first and (zone := recording.zone) is not None
    ]
    for (_, previous), (number, zone) in pairwise(zones):
        if previous == zone == "D":
            raised = alarm.state == "alarm" and alarm.since is not None and alarm.since <= number
            return (
                alarm
                if raised
                else alarm.with_alarm_since(number, tracked[number].severity(), ZONE)
            )
    latest = zones[-2:]
    current = len(latest) == 2 and latest[-1][0] == len(tracked) - 1
    if current and min(zone for _, zone in latest) == "C" and alarm.state == "none":
        return alarm.with_alert(tracked[-1].severity(), ZONE)
    return alarm


def _relative_change(by: float) -> str:
    return f"{'rose' if by > 0.0 else 'fell'} by {abs(100.0 * by):.3g} %"


def ratio_text(by: float) -> str:
    """Return a change of a logarithmic level in words."""
    return f"{'rose' if by > 0.0 else 'fell'} to {np.exp(by):.3g} times its baseline"


def _statuses(tracked: Sequence[TrackedRecording]) -> list[RecordingStatus]:
    """Return which recordings are from a dead sensor."""
    return [
        RecordingStatus("blind", f"{Path(recording.file).name}: {recording.reading.reason}")
        if recording.dead
        else RecordingStatus()
        for recording in tracked
    ]


def _acknowledged(tracked: Sequence[TrackedRecording], name: str | None) -> int:
    """Return the number of acknowledged recordings."""
    if name is None:
        return 0
    if name == LAST:
        return len(tracked)
    for number, recording in enumerate(tracked, 1):
        if any(name in (file, Path(file).name) for file in recording.files):
            return number
    raise BadInput(
        f"{name} is not among the {len(tracked)} recordings; acknowledge one of "
        f"them, or {LAST!r} for the newest"
    )
