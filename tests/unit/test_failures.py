"""Bearings that run to failure: an alarm on level before the end, none while healthy, and no
contact resonance.
"""

import numpy as np
import pytest
from benchmarks.failures import GROWTH, LENGTHS, PER_TURN, SNAPSHOTS, machine, tracked


@pytest.mark.parametrize("fault", PER_TURN)
@pytest.mark.parametrize(("seconds", "rate_hz"), LENGTHS[:2])
def test_a_failing_bearing_alarms_before_its_end_and_claims_no_contact(
    fault, seconds, rate_hz, tmp_path
):
    """benchmarks/failures.py has the same of 40 machines a row."""
    one = machine(fault, 200, seconds=seconds, rate_hz=rate_hz)
    track = tracked(one, tmp_path)
    states = track.alarm.states
    assert "alarm" not in states[: one.begins + 1]
    assert states.index("alarm") < SNAPSHOTS - 2
    assert track.alarm.state == "alarm"
    assert track.alarm.raised_by not in ("CRF", "damping")
    assert track.resonance_count == 0
    assert track.stages is None


def test_a_stand_in_grows_as_it_is_said_to():
    for fault in PER_TURN:
        one = machine(fault, 7)
        rms = [float(np.sqrt(np.mean(values**2))) for values in one.snapshots]
        assert GROWTH[0] / 1.3 < rms[-1] / np.median(rms[: one.begins]) < 1.3 * GROWTH[1]
        assert np.std(np.log(rms[: one.begins])) < 0.15
