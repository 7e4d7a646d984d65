"""Shaft angle and speed from tachos with doubled, missing and paired pulses, and from times."""

import json

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.monitoring import check_recordings, search_target
from asperity.monitoring.reading import read_spectrum
from asperity.recording import ReadOptions
from asperity.vibration import turning_by_pulses, turning_by_times

RATE, SECONDS = 10e3, 8.0
TIME = np.arange(round(RATE * SECONDS)) / RATE
SPEEDS = {"constant": TIME * 25.0, "rising": TIME * 20.0 + 0.5 * 1.25 * TIME**2}  # 20 to 30 Hz
MARKS = np.arange(1.0, 200.0)  # positions [turns] of one mark per turn


def times_of(turns, speed):
    """Return the times [s] at which the shaft has turned so far."""
    return np.interp(turns[turns < SPEEDS[speed][-1]], SPEEDS[speed], TIME)


def signal(times_s, width_s=1e-3):
    """Return a tacho signal with pulses that begin at these times."""
    distance = TIME - times_s[np.maximum(np.searchsorted(times_s, TIME, "right") - 1, 0)]
    return ((distance >= 0.0) & (distance < width_s)).astype(float)


def with_doubled(share, later, seed=0):
    chosen = np.random.default_rng(seed).random(MARKS.size) < share
    return np.sort(np.concatenate([MARKS, MARKS[chosen] + later]))


def without(share, seed=0):
    kept = np.random.default_rng(seed).random(MARKS.size) >= share
    kept[[0, -1]] = True
    return MARKS[kept]


CASES = {  # marks [turns] and the remark
    "whole": (MARKS, None),
    "two marks at 0.4": (np.sort(np.concatenate([MARKS, MARKS + 0.4])), "at 0.4 and 0.6 of its"),
    "two marks at 0.45": (np.sort(np.concatenate([MARKS, MARKS + 0.45])), "at 0.45 and 0.55"),
    "all doubled": (np.sort(np.concatenate([MARKS, MARKS + 0.06])), "at 0.06 and 0.94"),
    "5 % doubled": (with_doubled(0.05, 0.3), "which were left out"),
    "5 % bounced": (with_doubled(0.05, 0.06), "which were left out"),
    "3 % missing": (without(0.03), "% of the tacho's pulses are missing and were bridged"),
    "10 % missing": (without(0.1), "% of the tacho's pulses are missing and were bridged"),
}


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("name", CASES)
def test_wrong_pulses_are_corrected_with_a_remark(name, speed):
    marks, remark = CASES[name]
    times_s = times_of(marks, speed)
    for turning in (
        turning_by_pulses(signal(times_s), RATE),
        turning_by_times(times_s, TIME.size, RATE),
    ):
        known = np.isfinite(turning.turns)
        assert known.mean() > 0.95
        assert np.ptp(turning.turns[known] - SPEEDS[speed][known]) < 0.01  # turns
        assert " ".join(turning.remarks).count("tacho") == (remark is not None)
        assert remark is None or remark in turning.remarks[0]


def test_the_share_of_missing_pulses_is_stated():
    marks = np.delete(MARKS, [20, 60, 61, 120, 150, 170])
    turning = turning_by_times(times_of(marks, "constant"), TIME.size, RATE)
    assert turning.remarks == ("3 % of the tacho's pulses are missing and were bridged",)


def test_uneven_marks_that_are_stated_are_no_fault():
    marks = np.sort(np.concatenate([MARKS, MARKS + 0.4]))
    turning = turning_by_times(times_of(marks, "rising"), TIME.size, RATE, per_turn=2.0)
    known = np.isfinite(turning.turns)
    assert np.ptp(turning.turns[known] - SPEEDS["rising"][known]) < 0.01
    assert turning.remarks == ()


def test_slightly_uneven_pulses_are_remarked_only():
    marks = np.sort(np.concatenate([MARKS, MARKS + 0.49]))
    turning = turning_by_times(times_of(marks, "constant"), TIME.size, RATE)
    assert turning.speed_hz == pytest.approx(50.0, rel=1e-3)
    assert turning.remarks == (
        "the tacho's intervals alternate by 4 %; state pulses_per_turn = 2 if it has twice as many "
        "marks",
    )


@pytest.mark.parametrize(("stated", "teeth"), [(58.0, 58), (60.0, 60)])
def test_a_wheel_with_a_gap_is_read_as_stated(stated, teeth):
    """60 teeth less two: pulses per turn are those present, or those of the pitch."""
    turns = np.arange(0.0, 190.0, 1.0 / 60.0)
    marks = turns[np.arange(turns.size) % 60 < 58]
    turning = turning_by_times(times_of(marks, "constant"), TIME.size, RATE, per_turn=stated)
    assert turning.speed_hz == pytest.approx(25.0, rel=2e-3)
    assert len(turning.remarks) == (teeth == 60)


def test_jitter_is_no_pair_of_pulses():
    for seed in range(40):
        rng = np.random.default_rng(seed)
        marks = MARKS[: rng.integers(12, 100)]
        marks = marks + 0.02 * rng.standard_normal(marks.size)
        turning = turning_by_times(times_of(marks, "constant"), TIME.size, RATE)
        assert turning.speed_hz == pytest.approx(25.0, rel=0.01)
        assert turning.remarks == ()


def test_pulses_of_no_shaft_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(BadInput, match="which no shaft produces"):
        turning_by_times(np.sort(rng.uniform(0.0, 8.0, 200)), TIME.size, RATE)
    with pytest.raises(BadInput, match="which no shaft produces"):
        turning_by_times(times_of(without(0.4), "constant"), TIME.size, RATE)
    with pytest.raises(BadInput, match="are not within the recording of 8 s; state their times"):
        turning_by_times(100.0 + times_of(MARKS, "constant"), TIME.size, RATE)


def test_every_third_pulse_missing_is_ambiguous():
    marks = MARKS[np.arange(MARKS.size) % 3 != 2]
    with pytest.raises(BadInput, match="because every third pulse is missing or of"):
        turning_by_times(times_of(marks, "constant"), TIME.size, RATE)
    turning = turning_by_times(times_of(marks, "constant"), TIME.size, RATE, per_turn=2.0)
    assert turning.speed_hz == pytest.approx(25.0 / 3.0, rel=1e-2)  # two uneven marks, as stated


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("lost", [5, 12])
def test_a_long_gap_is_bridged(lost, speed):
    marks = np.delete(MARKS, np.s_[100 : 100 + lost])
    turning = turning_by_times(times_of(marks, speed), TIME.size, RATE)
    known = np.isfinite(turning.turns)
    assert np.ptp(turning.turns[known] - SPEEDS[speed][known]) < 0.05
    assert "% of the tacho's pulses are missing and were bridged" in turning.remarks[0]


def test_many_long_gaps_are_refused():
    lost = [first + number for first in range(10, 190, 30) for number in range(6)]
    with pytest.raises(BadInput, match="which no shaft produces"):
        turning_by_times(times_of(np.delete(MARKS, lost), "constant"), TIME.size, RATE)


def test_equal_times_are_left_out():
    times_s = times_of(MARKS, "constant")
    turning = turning_by_times(np.sort(np.append(times_s, times_s[20:23])), TIME.size, RATE)
    assert turning.speed_hz == pytest.approx(25.0)
    assert turning.remarks == ("the tacho has 3 equal times, which were left out",)


def vibration():
    """Return noise with a 3 kHz resonance struck 3.58 times per turn of the rising speed."""
    rng = np.random.default_rng(1)
    struck = np.flatnonzero(np.diff(np.floor(3.58 * SPEEDS["rising"]), prepend=0.0))
    impulses = np.zeros(TIME.size)
    impulses[struck] = 5.0
    ring = np.exp(-800.0 * TIME[:200]) * np.sin(2.0 * np.pi * 3000.0 * TIME[:200])
    return rng.standard_normal(TIME.size) + np.convolve(impulses, ring)[: TIME.size]


def read(path, **sidecar):
    stated = {"tacho": "pulse", "faults_per_turn": {"BPFO": 3.58}, "channel": "acc"} | sidecar
    path.with_name(f"{path.name}.json").write_text(json.dumps(stated))
    return read_spectrum(path, ReadOptions(), search_target(band_hz=(2000.0, 4000.0)), 0.5)


@pytest.mark.parametrize("form", ["npz", "few in npz", "mat", "h5", "csv"])
def test_a_channel_of_pulse_times_is_a_tacho(tmp_path, form):
    acc, times_s = vibration(), times_of(MARKS, "rising")
    if form.startswith("few"):
        times_s, form = times_s[::4], "npz"
        assert times_s.size < 64
    per_turn = 1.0 if times_s.size > 64 else 0.25
    path = tmp_path / f"a.{form}"
    facts = {"fs": RATE, "unit": "m/s^2"}
    if form == "npz":
        np.savez(path, acc=acc, pulse=times_s, **facts)
    elif form == "mat":
        from scipy.io import savemat

        times_s, per_turn = times_s[::4], 0.25
        savemat(path, {"acc": acc, "pulse": times_s} | facts)
    elif form == "h5":
        import h5py

        times_s, per_turn = times_s[::4], 0.25
        with h5py.File(path, "w") as file:
            file.attrs.update(facts)
            file["acc"], file["pulse"] = acc, times_s
    else:
        rows = [f"{k / RATE:.4f},{value:.5f}," for k, value in enumerate(acc)]
        rows[: times_s.size] = [
            f"{row}{1e3 * time:.4f}" for row, time in zip(rows, times_s, strict=False)
        ]
        path.write_text("\n".join(["time [s],acc [m/s^2],pulse [ms]", *rows]))
    reading = read(path, pulses_per_turn=per_turn)
    assert float(reading.facts["speed_hz"][0]) == pytest.approx(25.0, rel=0.01)
    assert reading.depths["BPFO"] > 0.4
    assert reading.quality.remarks == ()


def test_a_rising_signal_is_not_taken_for_times(tmp_path):
    np.savez(tmp_path / "a.npz", acc=vibration(), pulse=TIME, fs=RATE, unit="m/s^2")
    reading = read(tmp_path / "a.npz")
    assert reading.quality.remarks == (
        "the tacho signal has 1 pulses, but 4 are required; use another channel",
    )


def test_remarks_on_the_tacho_reach_the_reading_and_the_check(tmp_path):
    marks = np.sort(np.concatenate([MARKS, MARKS + 0.4]))
    pulse = signal(times_of(marks, "rising"))
    np.savez(tmp_path / "a.npz", acc=vibration(), pulse=pulse, fs=RATE, unit="m/s^2")
    reading = read(tmp_path / "a.npz", speed_hz=12.5)
    (checked,) = check_recordings([tmp_path / "a.npz"], band_hz=(2000.0, 4000.0)).checked
    for remarks in (reading.quality.remarks, checked.quality.remarks):
        assert remarks == (
            "the tacho has two pulses in place of one, at 0.4 and 0.6 of its interval; every "
            "second one is used",
            "the tacho gives 25.01 Hz, the a.npz.json 12.5 Hz; the tacho is used, check its "
            "pulses_per_turn",
        )
