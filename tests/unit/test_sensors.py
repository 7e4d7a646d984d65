"""One machine with two sensors: a line is the contact's if both detect it at one frequency."""

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


def normalised_errors(judgement):
    return [
        (resonance.crf_hz - true) / resonance.crf_std
        for resonance, true in zip(judgement.resonances, TRUTH, strict=True)
        if resonance.found
    ]


def test_a_line_on_both_sensors_is_detected_and_covered_at_the_stated_rate():
    """Through different structures; benchmarks/sensors.py repeats this with 40 series per row."""
    errors = []
    for seed in range(3):
        judgement = resonances_of_sensors(two_sensors(100 + seed, size=0.3), band_hz=BAND)
        assert all(resonance.found for resonance in judgement.resonances)
        assert set(judgement.detected_on) == {("a", "b")}
        errors += normalised_errors(judgement)
    assert np.mean(np.abs(errors) < NINETY) == pytest.approx(0.9, abs=0.1)  # two sigma of 36


def test_independent_sensors_narrow_an_interval_and_copies_do_not():
    sensors = two_sensors(3, heights=(0.1, 0.1))
    judgement = resonances_of_sensors(sensors, band_hz=BAND)
    with_copy = resonances_of_sensors({"a": sensors["a"], "b": sensors["a"]}, band_hz=BAND)
    ratios = [
        resonance.crf_std / other.crf_std
        for resonance, other in zip(judgement.resonances, judgement.alone["a"], strict=True)
    ]
    ratios_of_copy = [
        resonance.crf_std / other.crf_std
        for resonance, other in zip(with_copy.resonances, judgement.alone["a"], strict=True)
    ]
    assert np.median(ratios) < 0.9
    assert np.median(ratios_of_copy) == pytest.approx(1.0, abs=0.02)
    assert judgement.common < 0.5 < 0.95 < with_copy.common


def test_a_line_too_weak_for_either_sensor_is_detected_jointly():
    judgement = resonances_of_sensors(two_sensors(0, heights=(0.012, 0.012)), band_hz=BAND)
    most_on_one = max(
        sum(resonance.found for resonance in resonances) for resonances in judgement.alone.values()
    )
    assert sum(resonance.found for resonance in judgement.resonances) > most_on_one
    assert np.max(np.abs(normalised_errors(judgement))) < 4.0


def test_a_moving_mode_on_one_sensor_is_not_the_contacts():
    """One series here, 40 in benchmarks/sensors.py."""
    judgement = resonances_of_sensors(two_sensors(0, heights=(0.0, 0.0), moving=True), band_hz=BAND)
    assert all(resonance.found for resonance in judgement.alone["a"])
    assert not any(resonance.found for resonance in judgement.resonances)
    assert "detected on a only, not on b" in judgement.resonances[0].reason


@pytest.mark.usefixtures("coarse_search")
def test_contradicting_sensors_give_no_single_result():
    judgement = resonances_of_sensors(two_sensors(1, heights=(0.0, 0.7), moving=True), band_hz=BAND)
    assert all(resonance.reason.startswith(SENSORS_DISAGREE) for resonance in judgement.resonances)
    assert set(judgement.detected_on) == {()}


@pytest.mark.usefixtures("coarse_search")
def test_a_sensor_without_spectra_leaves_the_others_result():
    sensors = two_sensors(2)
    single = resonances_of_sensors({"a": sensors["a"]}, band_hz=BAND)
    judgement = resonances_of_sensors({"a": sensors["a"], "b": [None] * TRUTH.size}, band_hz=BAND)
    assert [resonance.crf_hz for resonance in judgement.resonances] == [
        resonance.crf_hz for resonance in single.resonances
    ]
    assert set(judgement.detected_on) == {("a",)}
    with pytest.raises(BadInput, match="no sensor has 6 recordings"):
        resonances_of_sensors({"a": sensors["a"][:3], "b": sensors["b"][:3]}, band_hz=BAND)


@pytest.mark.usefixtures("coarse_search")
def test_one_of_two_consistent_sensors_suffices_for_a_recording():
    sensors = two_sensors(4)
    judgement = resonances_of_sensors(
        {"a": sensors["a"], "b": [*sensors["b"][:9], None, None, None]}, band_hz=BAND
    )
    assert judgement.detected_on == (("a", "b"),) * 9 + (("a",),) * 3
    assert judgement.resonances[10].reason.endswith("detected by sensor a only")
    white = [replace(spectrum, density=np.ones_like(spectrum.density)) for spectrum in sensors["b"]]
    undetected = resonances_of_sensors({"a": sensors["a"], "b": white}, band_hz=BAND)
    assert not any(resonance.found for resonance in undetected.resonances)


@pytest.mark.usefixtures("coarse_search")
def test_a_spectrum_without_vibration_counts_as_missing():
    sensors = two_sensors(4)
    dead = [
        *sensors["b"][:9],
        replace(sensors["b"][9], density=np.zeros_like(FREQUENCY)),
        *sensors["b"][10:],
    ]
    judgement = resonances_of_sensors({"a": sensors["a"], "b": dead}, band_hz=BAND)
    without = resonances_of_sensors(
        {"a": sensors["a"], "b": [*dead[:9], None, *dead[10:]]}, band_hz=BAND
    )
    assert [resonance.crf_hz for resonance in judgement.resonances] == [
        resonance.crf_hz for resonance in without.resonances
    ]
    assert judgement.detected_on[9] == ("a",)
    assert "no vibration" in judgement.alone["b"][9].reason


@pytest.mark.usefixtures("coarse_search")
def test_a_moved_sensor_splits_the_series_of_all_sensors():
    """The same recordings twice; the second time, b has another structure."""
    single = two_sensors(9)
    assert (
        learn_sensors({name: 2 * spectra for name, spectra in single.items()}, band_hz=BAND)[
            0
        ].moved
        == ()
    )
    mode = 1.0 + 0.04j / (1.0 - (FREQUENCY / 3300.0) ** 2 + 0.04j * FREQUENCY / 3300.0)
    moved = [
        replace(
            spectrum,
            density=spectrum.density
            + 0.5 * (np.abs(mode) ** 2 - 1.0) * line_shape(FREQUENCY, f0, 0.02),
        )
        for spectrum, f0 in zip(single["b"], TRUTH, strict=True)
    ]
    judgement, shared = learn_sensors(
        {"a": 2 * single["a"], "b": [*single["b"], *moved]}, band_hz=BAND
    )
    assert judgement.moved == ((12, "b"),)
    assert len(judgement.resonances) == len(judgement.alone["b"]) == 2 * TRUTH.size
    assert shared.lines({"a": single["a"][-1:], "b": moved[-1:]}).resonances[0].found


@pytest.mark.parametrize("order", ["abc", "bca"])
def test_a_single_sensors_admission_is_independent_of_the_sensor_order(order):
    """a detects a line for the first time; b repeats one that b and c detected jointly
    elsewhere.
    """
    line = resonances_of_sensors(two_sensors(100, size=0.3), band_hz=BAND).resonances[0]
    undetected = no_resonance("undetected", BAND, "joint")
    joint = JointJudgement({}, {name: [None] for name in order}, BAND)
    joint.alone = {name: (undetected if name == "c" else line,) for name in order}
    resonance, names = joint._line_of_one_sensor(0, undetected, ["b", "c"], 1.0)
    assert resonance.found
    assert names == ("b",)


@pytest.mark.usefixtures("coarse_search")
def test_heights_refer_to_the_same_sensor_in_any_order():
    sensors = two_sensors(1, heights=(0.7, 0.1))
    first, shared = learn_sensors(sensors, band_hz=BAND)
    reordered = shared.lines(dict(reversed(sensors.items())))
    heights = [
        [resonance.crfa for resonance in judgement.resonances] for judgement in (first, reordered)
    ]
    assert np.all(np.isfinite(heights))
    assert heights[1] == pytest.approx(heights[0], rel=0.1)
    assert reordered.detected_on[0] == first.detected_on[0]


@pytest.mark.usefixtures("coarse_search")
def test_a_line_undetected_by_the_first_sensor_has_no_height():
    sensors, other = two_sensors(100, size=0.3), two_sensors(5, heights=(0.0, 0.0))
    judgement = resonances_of_sensors({"c": other["a"], **sensors}, band_hz=BAND)
    detected = [
        resonance
        for resonance, names in zip(judgement.resonances, judgement.detected_on, strict=True)
        if "c" not in names and names
    ]
    assert detected
    assert all(np.isnan(resonance.crfa) and np.isnan(resonance.crfa_std) for resonance in detected)
