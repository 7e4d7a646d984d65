"""Evidence that a line of a series belongs to the contact.

A machine's structure has lines in any band. A line counts as the contact's resonance if two sensors
agree on it, if it follows load or speed as a contact does, or if a case states the contact. Other
lines are of unknown origin.
"""

from collections.abc import Sequence

import numpy as np

from asperity.core.arrays import Field
from asperity.monitoring.operating_point import CRF, USUAL_OIL, conditions_of
from asperity.monitoring.recording import TrackedRecording
from asperity.monitoring.target import Target

FEWEST_CHANGES = 8  # of a condition between recordings
SMALLEST_CHANGE = 0.05  # of its logarithm, in standard deviation
SMALLEST_EXPONENT = 0.03  # of CRF on load or speed, that counts as following
STANDARD_ERRORS = 4.0  # that an exponent is away from 0


def contact_evidence(tracked: Sequence[TrackedRecording], target: Target) -> str:
    """Return in words why the line of a series belongs to the contact; "" if nothing shows it."""
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
