"""States of a judged series apart: contact, level and sensor."""

from collections.abc import Sequence

from asperity.core.arrays import finite_or_none
from asperity.core.documents import JsonObject
from asperity.monitoring.forecast import FORECAST
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.silence import SILENCE
from asperity.trend import Alarm

ORIGIN_REMEDY = "state load or speed, a second sensor, or the case of the contact"
UNSEEN = 3  # last recordings without a resonance from which the contact is not seen
ZONE = "zone"  # `raised_by` of a state: zone of ISO 20816-3
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


def causes(alarm: Alarm, recordings: Sequence[TrackedRecording]) -> list[str]:
    """Return the kinds of causes that are active: contact, level, zone, silence."""
    kinds = {"level"} if alarm.level.state != "none" else set()
    if alarm.state in ("alert", "alarm"):
        named = {SILENCE: "silence", ZONE: "zone"} | dict.fromkeys(CONTACT_SOURCES, "contact")
        kinds.add(named.get(alarm.raised_by, "level"))
    if len(recordings) > 1 and all(recording.zone in ("C", "D") for recording in recordings[-2:]):
        kinds.add("zone")
    return sorted(kinds)


def sensor_state(alarm: Alarm, recordings: Sequence[TrackedRecording]) -> JsonObject:
    """Return whether the sensor delivers usable recordings, and why not."""
    last = recordings[-1]
    if alarm.state == "blind":
        return {"state": "blind", "reason": alarm.reason}
    if last.dead:
        return {"state": "blind", "reason": last.reading.reason}
    return {"state": "ok", "reason": ""}
