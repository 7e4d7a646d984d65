"""States of a judged series apart: contact, level and sensor; evidence and silence.

A machine's structure has lines in any band. A line counts as the contact's resonance if two sensors
agree on it, if it follows load or speed as a contact does, or if a case states the contact. Other
lines are of unknown origin.
"""

from collections.abc import Sequence
from datetime import UTC, datetime
from itertools import pairwise
from statistics import median
from typing import cast

import numpy as np

from asperity.core.arrays import Field, finite_or_none
from asperity.core.documents import JsonObject
from asperity.monitoring.forecast import FORECAST
from asperity.monitoring.operating_point import CRF, USUAL_OIL, conditions_of
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.target import Target
from asperity.trend import ALERT_FACTOR, Alarm

UNSEEN = 3  # last recordings without a resonance from which the contact is not seen
ORIGIN_REMEDY = "state load or speed, a second sensor, or the case of the contact"
FEWEST_CHANGES = 8  # of a condition between recordings
SMALLEST_CHANGE = 0.05  # of its logarithm, in standard deviation
SMALLEST_EXPONENT = 0.03  # of CRF on load or speed, that counts as following
STANDARD_ERRORS = 4.0  # that an exponent is away from 0
MIN_INTERVALS = 8  # intervals between arrivals from which the usual one is known
OVERDUE_FACTOR = 5.0  # usual intervals without a recording until it is overdue
MIN_WAIT_S = 60.0
COMPONENTS = {
    "BPFO": "outer race",
    "BPFI": "inner race",
    "BSF": "rolling elements",
    "FTF": "cage",
}  # by fault frequency
CRF_SOURCES = frozenset(("CRF", "crf", "both"))
RISING_CRF = (
    "In an oil-lubricated contact a rising CRF means a larger load share of the asperities; in a "
    "dry contact CRF falls with wear."
)
FALLING_CRF = (
    "In an oil-lubricated contact a falling CRF means a smaller load share of the asperities, such "
    "as by running-in, a thicker film or a lower load; in a dry contact it is a sign of wear."
)
SILENCE, ZONE = "silence", "zone"  # `raised_by` of a state: overdue recordings, ISO 20816-3
# sources of an alert or alarm of the contact: indicators, stages, forecast
CONTACT_SOURCES = frozenset(("CRF", "damping", "crf", "both", FORECAST))


def contact_state(recordings: Sequence[TrackedRecording], evidence: str) -> JsonObject:
    """Return whether the contact is seen in the last recordings, and why or why not."""
    latest = recordings[-UNSEEN:]
    seen = [recording for recording in latest if recording.resonance.found]
    if seen:
        frequency = f"{seen[-1].resonance.crf_hz:.4g} Hz"
        if evidence:
            return {"state": "seen", "reason": f"a line at {frequency}; {evidence}"}
        reason = f"a line of unknown origin at {frequency}; {ORIGIN_REMEDY}"
        return {"state": "not-seen", "reason": reason}
    why = latest[-1].resonance.reason or "not determined"
    number = f"last {len(latest)} recordings" if len(latest) > 1 else "recording"
    return {"state": "not-seen", "reason": f"no contact resonance in the {number} ({why})"}


def level_state(alarm: Alarm, recordings: Sequence[TrackedRecording]) -> JsonObject:
    """Return the state of the levels, since which file, and the present factor."""
    level = alarm.level
    state, reason, since = level.state, level.reason, None
    if alarm.state in ("alert", "alarm") and alarm.raised_by not in {*CONTACT_SOURCES, SILENCE}:
        state, reason = alarm.state, alarm.reason
        since = None if alarm.since is None else recordings[alarm.since].file
    return {
        "state": state,
        "since": since,
        "factor": finite_or_none(level.factor),
        "reason": reason,
    }


def fault_state(alarm: Alarm) -> JsonObject | None:
    """Return the fault that an alert or alarm indicates, by the depths of the envelope.

    None without an alert or alarm of a level, or without fault frequencies. The `component` is None
    where no depth has risen.
    """
    depths = alarm.level.depths
    raised = {alarm.raised_by, alarm.raised_since} - {*CONTACT_SOURCES, SILENCE, ""}
    if not depths or alarm.state not in ("alert", "alarm") or not raised:
        return None
    highest, *others = depths
    risen = highest.factor >= ALERT_FACTOR
    name = highest.fault_frequency
    return {
        "component": _component(name) if risen else None,
        "fault_frequency": name,
        "sensor": highest.sensor or None,
        "depth": highest.depth,
        "factor": highest.factor,
        "others": {
            depth.fault_frequency: depth.factor
            for depth in others
            if depth.sensor == highest.sensor
        },
    }


def _component(fault_frequency: str) -> str:
    """Return the component of a fault frequency, such as "BPFO" or "BPFO drive end"."""
    kind = fault_frequency.partition(" ")[0].upper()
    return COMPONENTS.get(kind, f"component of {fault_frequency}")


def fault_sentence(fault: JsonObject | None) -> str:
    """Return the fault and its evidence in a sentence; "" without one."""
    if fault is None:
        return ""
    name, factor = fault["fault_frequency"], f"{fault['factor']:.2g} times its baseline"
    others = cast("dict[str, float]", fault["others"])
    if fault["component"] is None:
        return f"No fault frequency has risen: the envelope at {name}, the highest, is {factor}."
    on = f" on {fault['sensor']}" if fault["sensor"] else ""
    beside = ", ".join(f"{other} {by:.2g} times" for other, by in others.items())
    compared = f" (others: {beside})" if beside else ""
    return (
        f"Indicates a fault of the {fault['component']}: the envelope at {name}{on} has a depth of "
        f"{fault['depth']:.2g}, {factor}{compared}."
    )


def crf_meaning(alarm: Alarm, recordings: Sequence[TrackedRecording]) -> str:
    """Return what the change of CRF behind an alert or alarm means; "" without one."""
    crf = [recording.crf_reference_hz for recording in recordings]
    found = [value for value in crf if np.isfinite(value)]
    raised = {alarm.raised_by, alarm.raised_since} & CRF_SOURCES
    if not raised or alarm.state not in ("alert", "alarm") or not found:
        return ""
    risen = median(found[-UNSEEN:]) > median(found[:FEWEST_CHANGES])
    return RISING_CRF if risen else FALLING_CRF


def causes(
    alarm: Alarm, recordings: Sequence[TrackedRecording], silence_reason: str = ""
) -> list[str]:
    """Return the kinds of causes that are active: contact, level, silence, zone."""
    kinds = {"level"} if alarm.level.state != "none" else set()
    named = {ZONE: ZONE} | dict.fromkeys(CONTACT_SOURCES, "contact")
    if alarm.state in ("alert", "alarm"):
        raised = filter(None, (alarm.raised_by, alarm.raised_since))
        kinds |= {named.get(source, "level") for source in raised}
    if silence_reason:
        kinds.add(SILENCE)
    if len(recordings) > 1 and all(recording.zone in ("C", "D") for recording in recordings[-2:]):
        kinds.add(ZONE)
    return sorted(kinds)


def sensor_state(
    alarm: Alarm, recordings: Sequence[TrackedRecording], silence_reason: str = ""
) -> JsonObject:
    """Return whether the sensor delivers usable recordings, and why not."""
    last = recordings[-1]
    if alarm.state == "blind" or silence_reason:
        return {"state": "blind", "reason": silence_reason or alarm.reason}
    if last.dead:
        return {"state": "blind", "reason": last.reading.reason}
    return {"state": "ok", "reason": ""}


def contact_evidence(tracked: Sequence[TrackedRecording], target: Target) -> str:
    """Return in words why the line of a series belongs to the contact; "" if nothing shows it."""
    if target.unresponsive:
        return ""
    if target.case is not None:
        return f"the contact of {target.case.source} predicts its band"
    found = [recording for recording in tracked if recording.resonance.found]
    agreed = [
        recording
        for recording in found
        if sum(sensor.detects for sensor in recording.on_sensors.values()) > 1
    ]
    if found and 2 * len(agreed) > len(found):
        return "two sensors agree on it"
    return _followed_condition(found)


def _followed_condition(found: Sequence[TrackedRecording]) -> str:
    """Return which condition the line follows with an exponent that a contact can have, or ""."""
    crf = np.log([recording.resonance.crf_hz for recording in found])
    conditions = conditions_of([recording.operating for recording in found], CRF, USUAL_OIL)
    for condition in conditions:
        finite = np.isfinite(condition.values)
        exponent, error = _exponent(condition.values[finite], crf[finite])
        following = STANDARD_ERRORS * error < abs(exponent) and abs(exponent) > SMALLEST_EXPONENT
        margin = 2.0 * error
        if following and condition.low - margin <= exponent <= condition.high + margin:
            return f"it follows the {condition.name} with an exponent of {exponent:.2g}"
    return ""


def _exponent(condition: Field, crf: Field) -> tuple[float, float]:
    """Return the exponent from changes between recordings, and its standard error."""
    change, response = np.diff(condition), np.diff(crf)
    if change.size < FEWEST_CHANGES or np.std(change) < SMALLEST_CHANGE:
        return 0.0, np.inf
    change, response = change - change.mean(), response - response.mean()
    squares = float(change @ change)
    exponent = float(change @ response) / squares
    residual = response - exponent * change
    return exponent, float(np.sqrt(residual @ residual / (change.size - 2) / squares))


def overdue_reason(
    arrivals: Sequence[datetime], limit_s: float | None, now: datetime | None = None
) -> str:
    """Return why recordings are overdue, without a full stop; empty if they are not.

    Parameters
    ----------
    arrivals : times at which recordings arrived, in order
    limit_s : longest time between recordings [s]; None: five usual intervals, once these are known
    """
    if not arrivals:
        return ""
    intervals = [(after - before).total_seconds() for before, after in pairwise(arrivals)]
    typical = median(intervals) if len(intervals) >= MIN_INTERVALS else None
    if limit_s is None and typical is None:
        return ""
    longest = max(OVERDUE_FACTOR * (typical or 0.0), MIN_WAIT_S) if limit_s is None else limit_s
    elapsed = ((now or datetime.now(UTC)) - arrivals[-1]).total_seconds()
    if elapsed <= longest:
        return ""
    expected = (
        f"the usual interval is {duration_text(typical)}"
        if limit_s is None and typical
        else f"the limit is {duration_text(longest)}"
    )
    last = arrivals[-1].isoformat(timespec="seconds")
    return f"no recording has come for {duration_text(elapsed)}, since {last}; {expected}"


def duration_text(seconds: float) -> str:
    """Return a duration in its natural unit."""
    for unit, size in (("days", 86_400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
