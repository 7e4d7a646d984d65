"""What of a series is watched, and what a recording lets one see: from tracked recordings to their alarm.

The test is left to `asperity.wear`; which indicators it is given, and from which change on it
counts, is said here.
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
    Follows,
    Response,
    conditions_of,
)
from asperity.monitoring.reading import Reading
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.series_state import Before
from asperity.trend import (
    Alarm,
    AlarmChecks,
    AlarmHistory,
    Condition,
    MonitoredSeries,
    RecordingStatus,
    Stages,
    StageSource,
    knee_weight,
    sequential_alarm,
    warm_up,
)

CRF_LEAST = 0.05  # of itself: the asperities' load share up by a third, (1.05)^6
DAMPING_LEAST = 0.2  # of its logarithm
LEVEL_LEAST = float(np.log(2.0))  # 6 dB, which ISO 13373-1 takes for a change worth looking into
BASELINE = 8  # recordings by which a CRF is counted from 1
UNSEEN = 3  # recordings without a resonance, from which on nobody sees the contact
LAST = "last"
KURTOSIS, CRF, RMS = "kurtosis", "CRF", "the level (rms)"
LEFT = 0.4  # of the least change, which a warm-up may leave unexplained


def raise_alarm(
    tracked: Sequence[TrackedRecording],
    source: StageSource,
    stages: Stages | None,
    stages_of: Callable[[Sequence[TrackedRecording]], Stages | None],
    *,
    false_alarm_rate: float,
    acknowledge: str | None = None,
    before: Before | None = None,
    unit: str = "",
    response: Response = ANY_CONTACT,
) -> Alarm:
    """The alarm of a series, in agreement with its stages.

    Parameters
    ----------
    source : which indicators of the contact decide
    stages, stages_of : of the whole series, and how to have them of a part
    false_alarm_rate : alarms without wear, a recording
    acknowledge : the recording up to which somebody has looked, by its name; "last" for all
    before : what was said of these recordings before
    response : how CRF may follow load, speed and temperature

    Raises
    ------
    BadInput
        for a recording that is not there, or a rate that is none.
    """
    contact, levels = _of_the_contact(tracked, source, response), _levels(tracked, response)
    x = np.array([one.x for one in tracked])
    warming = Warming(x, contact, levels, unit)
    alarm = sequential_alarm(
        x,
        [*contact, *levels],
        _sights(tracked, contact),
        false_alarm_rate=false_alarm_rate,
        checks=AlarmChecks(
            confirmed=lambda number: _severe(stages_of(tracked[: number + 1])),
            explanation=warming.excuses,
        ),
        acknowledged=_acknowledged(tracked, acknowledge),
        unit=unit,
        history=_said(tracked, before),
    )
    if (said_of := warming.said(len(tracked) - 1)) and acknowledge is None:
        alarm = replace(alarm, explained="; ".join(filter(None, [alarm.explained, said_of])))
    elif stages is not None and stages.kind == "severe" and acknowledge is None:
        alarm = alarm.with_alert(
            "a severe stage is indicated, not yet significant at the set false-alarm rate "
            f"(1 in {1.0 / false_alarm_rate:.0f} recordings)",
            source,
        )
    return _by_zone(tracked, _acknowledged(tracked, acknowledge), alarm)


class Warming:
    """A warm-up known by its shape, where nobody states the temperature that would tell it."""

    def __init__(
        self,
        x: Field,
        contact: Sequence[MonitoredSeries],
        levels: Sequence[MonitoredSeries],
        unit: str,
    ) -> None:
        crf = next((one for one in contact if one.name == CRF), None)
        level = next((one for one in levels if one.name.startswith(RMS)), None)
        self.x, self.unit, self.crf, self.level = x, unit, crf, level
        self.names = {CRF, *(one.name for one in levels if one.gain_dependent)}
        stated = [] if crf is None else [one.name for one in crf.conditions]
        self.known = crf is not None and level is not None and "temperature" not in " ".join(stated)

    def said(self, number: int) -> str:
        """That recordings up to one look like a warm-up; nothing where they do not."""
        if not self.known or self.crf is None or self.level is None:
            return ""
        upto = slice(number + 1)
        found = warm_up(self.x[upto], self.crf.values[upto], self.level.values[upto])
        if (
            found is None
            or abs(found.residual[0]) > LEFT * CRF_LEAST
            or abs(found.residual[1]) > LEFT * LEVEL_LEAST
        ):
            return ""
        length = f"{found.time_constant:.2g} {self.unit}".rstrip()
        return (
            f"this looks like a warm-up: CRF {_moved(found.crf)} and {self.level.name} {_times(found.level)}, both by "
            f"one exponential of length {length} from the beginning; state the oil's temperature to be sure"
        )

    def excuses(self, number: int, name: str) -> str:
        """The same, of a change that it explains."""
        return self.said(number) if name in self.names else ""


def _said(tracked: Sequence[TrackedRecording], before: Before | None) -> AlarmHistory:
    if before is None:
        return AlarmHistory()
    states = {}
    for number, one in enumerate(tracked):
        for file in one.files:
            if file in before.states:
                states[number] = before.states[file]
    return AlarmHistory(states, before.reason, before.raised_by)


def _severe(stages: Stages | None) -> bool:
    return stages is not None and stages.kind == "severe"


def at_reference(tracked: Sequence[TrackedRecording], response: Response) -> list[TrackedRecording]:
    """Recordings with CRF and damping ratio as they would be at the load, speed and temperature of the first ones."""
    crf, damping = _crf(tracked, response), _damping(tracked, response)
    frequency = (
        np.full(len(tracked), np.nan)
        if crf is None
        else _usual(tracked) * crf.at_baseline_conditions()[0]
    )
    ratio = (
        np.full(len(tracked), np.nan)
        if damping is None
        else np.exp(-damping.at_baseline_conditions()[0])
    )
    return [
        replace(one, crf_reference_hz=float(hertz), damping_reference=float(share))
        for one, hertz, share in zip(tracked, frequency, ratio, strict=True)
    ]


def weighed(tracked: Sequence[TrackedRecording], source: StageSource, response: Response) -> float:
    """The weight of a severe stage against steps, cycles and scatter that remembers, which stages do not look at."""
    return knee_weight(
        np.array([one.x for one in tracked]), _of_the_contact(tracked, source, response)
    )


def _usual(tracked: Sequence[TrackedRecording]) -> float:
    crf = np.array([one.resonance.crf_hz for one in tracked])
    return float(np.median(crf[np.isfinite(crf)][:BASELINE]))


def _conditions(
    tracked: Sequence[TrackedRecording], follows: Follows, response: Response
) -> tuple[Condition, ...]:
    return conditions_of([one.operating for one in tracked], follows, response.oil)


def _crf(tracked: Sequence[TrackedRecording], response: Response) -> MonitoredSeries | None:
    crf = np.array([one.resonance.crf_hz for one in tracked])
    if not np.isfinite(crf).any():
        return None
    return MonitoredSeries(
        name=CRF,
        values=crf / _usual(tracked),
        smallest_change=CRF_LEAST,
        contact=True,
        describe=_moved,
        conditions=_conditions(tracked, response.crf, response),
        relative=True,
    )


def _damping(tracked: Sequence[TrackedRecording], response: Response) -> MonitoredSeries | None:
    ratio = np.array([one.damping[0] for one in tracked])
    if not np.isfinite(ratio).any():
        return None
    return MonitoredSeries(
        name="damping",
        values=-np.log(ratio),
        smallest_change=DAMPING_LEAST,
        contact=True,
        describe=lambda by: _times(-by),
        conditions=_conditions(tracked, DAMPING, response),
    )


def _of_the_contact(
    tracked: Sequence[TrackedRecording], source: StageSource, response: Response
) -> list[MonitoredSeries]:
    crf, damping = _crf(tracked, response), _damping(tracked, response)
    if source == "both" and (crf is None or damping is None):
        return []
    return [
        one
        for one in (crf if source != "damping" else None, damping if source != "crf" else None)
        if one
    ]


def _levels(tracked: Sequence[TrackedRecording], response: Response) -> list[MonitoredSeries]:
    """Level and kurtosis of every recording of a running machine, on each sensor."""
    sensors = dict.fromkeys(name for one in tracked for name in one.readings)
    several = len(sensors) > 1
    return [
        level
        for sensor in sensors
        for level in _levels_on(
            sensor if several else "",
            [one.readings.get(sensor) for one in tracked],
            tracked,
            response,
        )
    ]


def _levels_on(
    sensor: str,
    readings: Sequence[Reading | None],
    tracked: Sequence[TrackedRecording],
    response: Response,
) -> list[MonitoredSeries]:
    """What one sensor heard, in the unit that most of its recordings have; None where it has none."""
    units = Counter(one.unit for one in readings if one is not None and one.quality is not None)
    if not units:
        return []
    (usual, _), *_ = units.most_common(1)

    def logarithms(value: Callable[[Reading], float]) -> Field:
        values = np.full(len(readings), np.nan)
        for number, one in enumerate(readings):
            quality = None if one is None else one.quality
            if (
                one is not None
                and quality is not None
                and not quality.dead
                and one.unit == usual
                and value(one) > 0.0
            ):
                values[number] = np.log(value(one))
        return values

    def quality_of(name: str) -> Callable[[Reading], float]:
        return lambda one: float(getattr(one.quality, name))

    def named(several: str, words: str) -> dict[str, Callable[[Reading], float]]:
        names = dict.fromkeys(
            name for one in readings if one is not None for name in getattr(one, several)
        )
        return {f"{words} {name}": _getter(several, name) for name in names}

    heard = {
        RMS: quality_of("rms"),
        KURTOSIS: quality_of("kurtosis"),
        "velocity (rms)": lambda one: one.velocity,
    }
    lines, deep = named("lines", "the line at"), named("depths", "the envelope at")
    heard |= named("bands", "the level") | lines
    met, of_pulses = (_conditions(tracked, follows, response) for follows in (LEVEL, PULSES))
    every = {words: logarithms(value) for words, value in (heard | deep).items()}
    return [
        MonitoredSeries(
            name=f"{words} on {sensor}" if sensor else words,
            values=values,
            smallest_change=LEVEL_LEAST,
            contact=False,
            describe=_times,
            gain_dependent=words not in deep and words != KURTOSIS,
            step_alarms=words in deep,
            sensor=sensor,
            conditions=of_pulses if words in deep or words in lines or words == KURTOSIS else met,
        )
        for words, values in every.items()
        if np.isfinite(values).any()
    ]


def _getter(several: str, name: str) -> Callable[[Reading], float]:
    return lambda one: getattr(one, several).get(name, np.nan)


def _by_zone(tracked: Sequence[TrackedRecording], first: int, alarm: Alarm) -> Alarm:
    """What ISO 20816-3 says: zone D twice running alarms, and stands as any alarm does; C at the end alerts."""
    zones = [
        (number, zone)
        for number, one in enumerate(tracked)
        if number >= first and (zone := one.zone) is not None
    ]
    for (_, before), (number, zone) in pairwise(zones):
        if before == zone == "D":
            sooner = alarm.state == "alarm" and alarm.since is not None and alarm.since <= number
            return (
                alarm
                if sooner
                else alarm.with_alarm_since(number, tracked[number].severity(), "zone")
            )
    lately = zones[-2:]
    known = len(lately) == 2 and lately[-1][0] == len(tracked) - 1
    if known and min(zone for _, zone in lately) == "C" and alarm.state == "none":
        return alarm.with_alert(tracked[-1].severity(), "zone")
    return alarm


def _moved(by: float) -> str:
    return f"{'rose' if by > 0.0 else 'fell'} by {abs(100.0 * by):.3g} %"


def _times(by: float) -> str:
    return f"{'rose' if by > 0.0 else 'fell'} to {np.exp(by):.3g} times what it was"


def _sights(
    tracked: Sequence[TrackedRecording], contact: Sequence[MonitoredSeries]
) -> list[RecordingStatus]:
    """What each recording lets one see of the machine."""
    seen = np.any(
        [np.zeros(len(tracked), dtype=bool), *(np.isfinite(one.values) for one in contact)], axis=0
    )
    sights = []
    for number, recording in enumerate(tracked):
        if recording.dead:
            sights.append(
                RecordingStatus("blind", f"{Path(recording.file).name}: {recording.reading.reason}")
            )
        elif seen[max(number - UNSEEN + 1, 0) : number + 1].any():
            sights.append(RecordingStatus())
        else:
            why = recording.resonance.reason or "not determined"
            last = (
                "recording shows" if number == 0 else f"{min(number + 1, UNSEEN)} recordings show"
            )
            sights.append(
                RecordingStatus("cannot-tell", f"none of the last {last} what decides ({why})")
            )
    return sights


def _acknowledged(tracked: Sequence[TrackedRecording], name: str | None) -> int:
    """How many recordings, from the first on, somebody has looked at."""
    if name is None:
        return 0
    if name == LAST:
        return len(tracked)
    for number, one in enumerate(tracked, 1):
        if any(name in (file, Path(file).name) for file in one.files):
            return number
    raise BadInput(
        f"{name} is not among the {len(tracked)} recordings; acknowledge one of them, or {LAST}"
    )
