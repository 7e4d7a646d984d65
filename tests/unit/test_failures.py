"""Bearings that run to failure: a level alarm before the end, none while healthy, no contact
resonance.
"""

import numpy as np
import pytest
from benchmarks.failures import GROWTH, LENGTHS, PER_TURN, SNAPSHOTS, machine, tracked


@pytest.mark.parametrize("fault", PER_TURN)
@pytest.mark.parametrize(("seconds", "rate_hz"), LENGTHS[:2])
def test_a_failing_bearing_alarms_before_its_end_without_contact_resonance(
    fault, seconds, rate_hz, tmp_path
):
    """benchmarks/failures.py repeats this for 40 machines per row."""
    bearing = machine(fault, 200, seconds=seconds, rate_hz=rate_hz)
    track = tracked(bearing, tmp_path)
    states = track.alarm.states
    assert "alarm" not in states[: bearing.begins + 1]
    assert states.index("alarm") < SNAPSHOTS - 2
    assert track.alarm.state == "alarm"
    assert track.alarm.raised_by not in ("CRF", "damping")
    assert track.resonance_count == 0
    assert track.stages is None


def test_the_simulated_fault_grows_by_the_specified_factor():
    for fault in PER_TURN:
        bearing = machine(fault, 7)
        rms = [float(np.sqrt(np.mean(values**2))) for values in bearing.snapshots]
        assert GROWTH[0] / 1.3 < rms[-1] / np.median(rms[: bearing.begins]) < 1.3 * GROWTH[1]
        assert np.std(np.log(rms[: bearing.begins])) < 0.15
