"""One machine on two sensors: a line is the contact's where both hear it at one place."""

from dataclasses import replace

import numpy as np
import pytest
from benchmarks.sensors import BAND, FREQUENCY, NINETY, TRUTH, two_sensors

from asperity.core.errors import BadInput
from asperity.resonance import (
    SENSORS_DISAGREE,
    learn_sensors,
    line_shape,
    no_resonance,
    resonances_of_sensors,
)
from asperity.resonance.sensor_judgement import JointJudgement


def pulls(told):
    return [
        (one.crf_hz - true) / one.crf_std
        for one, true in zip(told.resonances, TRUTH, strict=True)
        if one.found
    ]


def test_a_line_on_both_is_found_and_held_as_often_as_the_interval_says():
    """Through structures that differ; benchmarks/sensors.py has the same at 40 series a row."""
    off = []
    for seed in range(6):
        told = resonances_of_sensors(two_sensors(100 + seed, size=0.3), band_hz=BAND)
        assert all(one.found for one in told.resonances)
        assert set(told.detected_on) == {("a", "b")}
        off += pulls(told)
    assert np.mean(np.abs(off) < NINETY) == pytest.approx(0.9, abs=0.08)


def test_an_interval_narrows_by_what_is_independent_and_not_by_a_copy():
    sensors = two_sensors(3, heights=(0.1, 0.1))
    told = resonances_of_sensors(sensors, band_hz=BAND)
    alone = resonances_of_sensors({"a": sensors["a"]}, band_hz=BAND)
    copied = resonances_of_sensors({"a": sensors["a"], "b": sensors["a"]}, band_hz=BAND)
    narrower = [
        one.crf_std / other.crf_std
        for one, other in zip(told.resonances, alone.resonances, strict=True)
    ]
    as_wide = [
        one.crf_std / other.crf_std
        for one, other in zip(copied.resonances, alone.resonances, strict=True)
    ]
    assert np.median(narrower) < 0.9
    assert np.median(as_wide) == pytest.approx(1.0, abs=0.02)
    assert told.common < 0.5 < 0.95 < copied.common


def test_a_line_too_weak_for_either_sensor_is_found_by_both():
    told = resonances_of_sensors(two_sensors(0, heights=(0.012, 0.012)), band_hz=BAND)
    best = max(sum(one.found for one in every) for every in told.alone.values())
    assert sum(one.found for one in told.resonances) > best
    assert np.max(np.abs(pulls(told))) < 4.0


def test_a_mode_that_moves_on_one_sensor_is_never_the_contacts():
    """Three series here, forty in benchmarks/sensors.py."""
    for seed in range(3):
        told = resonances_of_sensors(
            two_sensors(seed, heights=(0.0, 0.0), moving=True), band_hz=BAND
        )
        assert all(one.found for one in told.alone["a"])
        assert not any(one.found for one in told.resonances)
        assert "detected on a only, not on b" in told.resonances[0].reason


def test_sensors_that_disagree_make_no_single_claim():
    told = resonances_of_sensors(two_sensors(1, heights=(0.0, 0.7), moving=True), band_hz=BAND)
    assert all(one.reason.startswith(SENSORS_DISAGREE) for one in told.resonances)
    assert set(told.detected_on) == {()}


def test_a_sensor_without_spectra_leaves_the_others_word():
    sensors = two_sensors(2)
    alone = resonances_of_sensors({"a": sensors["a"]}, band_hz=BAND)
    told = resonances_of_sensors({"a": sensors["a"], "b": [None] * TRUTH.size}, band_hz=BAND)
    assert [one.crf_hz for one in told.resonances] == [one.crf_hz for one in alone.resonances]
    assert set(told.detected_on) == {("a",)}
    with pytest.raises(BadInput, match="no sensor has 6 recordings"):
        resonances_of_sensors({"a": sensors["a"][:3], "b": sensors["b"][:3]}, band_hz=BAND)


def test_where_sensors_have_agreed_one_of_them_is_enough_for_a_recording():
    sensors = two_sensors(4)
    told = resonances_of_sensors(
        {"a": sensors["a"], "b": [*sensors["b"][:9], None, None, None]}, band_hz=BAND
    )
    assert told.detected_on == (("a", "b"),) * 9 + (("a",),) * 3
    assert told.resonances[10].reason.endswith("here on a only")
    deaf = [replace(one, density=np.ones_like(one.density)) for one in sensors["b"]]
    silent = resonances_of_sensors({"a": sensors["a"], "b": deaf}, band_hz=BAND)
    assert not any(one.found for one in silent.resonances)


def test_a_spectrum_without_vibration_is_one_that_its_sensor_does_not_have():
    sensors = two_sensors(4)
    dead = [
        *sensors["b"][:9],
        replace(sensors["b"][9], density=np.zeros_like(FREQUENCY)),
        *sensors["b"][10:],
    ]
    told = resonances_of_sensors({"a": sensors["a"], "b": dead}, band_hz=BAND)
    without = resonances_of_sensors(
        {"a": sensors["a"], "b": [*dead[:9], None, *dead[10:]]}, band_hz=BAND
    )
    assert [one.crf_hz for one in told.resonances] == [one.crf_hz for one in without.resonances]
    assert told.detected_on[9] == ("a",)
    assert "no vibration" in told.alone["b"][9].reason


def test_a_sensor_that_was_moved_parts_the_series_of_all():
    """The same recordings four times, behind the second time with b's line through another
    structure.
    """
    once = two_sensors(9)
    assert (
        learn_sensors({name: 4 * every for name, every in once.items()}, band_hz=BAND)[0].moved
        == ()
    )
    mode = 1.0 + 0.04j / (1.0 - (FREQUENCY / 3300.0) ** 2 + 0.04j * FREQUENCY / 3300.0)
    elsewhere = [
        replace(
            one,
            density=one.density + 0.5 * (np.abs(mode) ** 2 - 1.0) * line_shape(FREQUENCY, f0, 0.02),
        )
        for one, f0 in zip(once["b"], TRUTH, strict=True)
    ]
    told, shared = learn_sensors(
        {"a": 4 * once["a"], "b": [*2 * once["b"], *2 * elsewhere]}, band_hz=BAND
    )
    assert told.moved == ((24, "b"),)
    assert len(told.resonances) == len(told.alone["b"]) == 4 * TRUTH.size
    assert shared.lines({"a": once["a"][-1:], "b": elsewhere[-1:]}).resonances[0].found


@pytest.mark.parametrize("order", ["abc", "bca"])
def test_who_may_stand_alone_does_not_hang_on_the_order_of_sensors(order):
    """a hears a line for the first time; b hears what b and c have heard together elsewhere."""
    line = resonances_of_sensors(two_sensors(100, size=0.3), band_hz=BAND).resonances[0]
    nothing = no_resonance("nothing", BAND, "joint")
    together = JointJudgement({}, {name: [None] for name in order}, BAND)
    together.alone = {name: (nothing if name == "c" else line,) for name in order}
    found, names = together._line_of_one_sensor(0, nothing, ["b", "c"], 1.0)
    assert found.found
    assert names == ("b",)


def test_heights_stay_those_of_one_sensor_whoever_is_named_first_later():
    sensors = two_sensors(1, heights=(0.7, 0.1))
    first, shared = learn_sensors(sensors, band_hz=BAND)
    turned = shared.lines(dict(reversed(sensors.items())))
    heights = [[one.crfa for one in told.resonances] for told in (first, turned)]
    assert np.all(np.isfinite(heights))
    assert heights[1] == pytest.approx(heights[0], rel=0.1)
    assert turned.detected_on[0] == first.detected_on[0]


def test_a_line_that_the_first_sensor_does_not_hear_has_no_height():
    two, other = two_sensors(100, size=0.3), two_sensors(5, heights=(0.0, 0.0))
    told = resonances_of_sensors({"deaf": other["a"], **two}, band_hz=BAND)
    found = [
        one
        for one, names in zip(told.resonances, told.detected_on, strict=True)
        if "deaf" not in names and names
    ]
    assert found
    assert all(np.isnan(one.crfa) and np.isnan(one.crfa_std) for one in found)
