"""What a check finds wrong with a recording."""

import numpy as np
import pytest

from asperity.recording import SampleStatistics, check_recording, open_channels, open_recording
from support.recordings import SHARED

RATE = 1000.0
RNG = np.random.default_rng(5)
NOISE = 3.0 * RNG.standard_normal(20_000)


def checked(tmp_path, values, *, unit="m/s^2", **wanted):
    np.savez(tmp_path / "a.npz", acc=values, fs=RATE, unit=unit)
    return check_recording(open_recording(tmp_path / "a.npz"), **wanted)


def test_a_sound_recording_has_nothing_wrong(tmp_path):
    found = checked(tmp_path, NOISE + 0.5, width_hz=10.0, band_hz=(50.0, 400.0))
    assert (found.usable, found.remarks, found.samples, found.duration_s) == (
        True,
        (),
        20_000,
        20.0,
    )
    assert found.rms == pytest.approx(NOISE.std(), rel=1e-12)
    assert found.offset == pytest.approx(NOISE.mean() + 0.5, rel=1e-9)
    assert found.peak == pytest.approx(np.abs(NOISE - NOISE.mean()).max(), rel=1e-9)


def test_statistics_do_not_depend_on_the_blocks(tmp_path):
    values = NOISE.copy()
    values[777:1234] = np.nan
    whole = checked(tmp_path, values)
    opened = open_recording(tmp_path / "a.npz")
    gauge = SampleStatistics()
    for _ in gauge.pass_through(opened.blocks(613)):
        pass
    pieces = gauge.quality(opened, width_hz=None, band_hz=None)
    assert pieces.rms == pytest.approx(whole.rms, rel=1e-12)
    assert (pieces.gaps, pieces.missing, pieces.peak) == (
        1,
        457 / 20_000,
        pytest.approx(whole.peak),
    )


def test_clipping_is_counted(tmp_path):
    sine = 5.0 * np.sin(2.0 * np.pi * 3.0 * np.arange(20_000) / RATE)
    found = checked(tmp_path, np.clip(sine, -4.0, 4.0))
    assert found.clipped == pytest.approx(
        2.0 * np.arccos(0.8) / np.pi, rel=0.02
    )  # share of time beyond 0.8
    assert any("clipped" in remark and "too low" in remark for remark in found.remarks)
    assert checked(tmp_path, sine).clipped == 0.0


@pytest.mark.parametrize(
    ("drive", "piled"),
    [(3.0, True), (2.0, True), (0.1, False)],
    ids=["hard driven", "driven", "not driven"],
)
def test_soft_clipping_is_noticed(tmp_path, drive, piled):
    """tanh of Gaussian noise, as an amplifier at its limit has it; by blocks of any size."""
    found = checked(tmp_path, 5.0 * np.tanh(drive * NOISE / NOISE.std()))
    assert (found.clipped, any("soft clipping" in remark for remark in found.remarks)) == (
        0.0,
        piled,
    )
    gauge = SampleStatistics()
    for _ in gauge.pass_through(np.array_split(5.0 * np.tanh(drive * NOISE / NOISE.std()), 37)):
        pass
    assert gauge.piled == piled


def test_what_falls_towards_its_extremes_is_not_called_clipped(tmp_path):
    for values in (
        NOISE,
        NOISE**3,
        np.abs(NOISE) ** 0.5 * np.sign(NOISE),
        RNG.uniform(-1.0, 1.0, 20_000),
    ):
        assert not any("clip" in remark for remark in checked(tmp_path, values).remarks)


def test_gaps_and_stuck_stretches_are_counted(tmp_path):
    values = NOISE.copy()
    values[100:200] = values[7000:7300] = np.nan
    values[9000:9500] = values[8999]
    found = checked(tmp_path, values)
    assert (found.gaps, found.missing) == (2, 400 / 20_000)
    assert found.stuck == pytest.approx(500 / 19_600)
    assert found.usable


@pytest.mark.parametrize(
    ("values", "unit"),
    [
        (np.zeros(2000), "V"),
        (0.002 * RNG.integers(-1, 2, 2000), "V"),
        (0.001 * NOISE, "m/s^2"),
        (np.full(2000, 7.5), "g"),
    ],
)
def test_a_machine_at_rest_is_called_off(tmp_path, values, unit):
    found = checked(tmp_path, values, unit=unit)
    assert found.off
    assert "machine was off" in found.faults[0]


def test_quantised_noise_is_not_off(tmp_path):
    assert not checked(tmp_path, np.round(NOISE), unit="V").off


def test_too_short_and_too_slow_for_the_resonance(tmp_path):
    found = checked(tmp_path, NOISE[:500], width_hz=20.0, band_hz=(100.0, 450.0))
    assert "too short: 0.5 s; a resonance 20 Hz wide needs 0.8 s" in found.faults[0]
    assert "sampled too slowly: 1000 Hz; a band up to 450 Hz needs 1125 Hz" in found.faults[1]


def test_offsets_are_said(tmp_path):
    assert any("offset" in remark for remark in checked(tmp_path, NOISE + 20.0).remarks)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the developers' data are not on this machine")
def test_the_stopped_machine_of_the_ims_data_is_off_and_the_others_run():
    states = {}
    for path in sorted((SHARED / "vibration" / "ims").iterdir()):
        states[path.name] = {check_recording(one).off for one in open_channels(path, rate_hz=20e3)}
    assert states == {
        "2003.10.22.12.06.24": {False},
        "2004.02.12.10.32.39": {False},
        "2004.02.19.06.22.39": {True},
    }
