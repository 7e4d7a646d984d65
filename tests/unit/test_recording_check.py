"""Quality checks of recordings: clipping, gaps, machine at rest, length."""

import numpy as np
import pytest

from asperity.recording import SampleStatistics, check_recording, open_channels, open_recording
from support.recordings import SHARED

RATE = 1000.0
RNG = np.random.default_rng(5)
NOISE = 3.0 * RNG.standard_normal(20_000)


def checked(tmp_path, values, *, unit="m/s^2", **settings):
    np.savez(tmp_path / "a.npz", acc=values, fs=RATE, unit=unit)
    return check_recording(open_recording(tmp_path / "a.npz"), **settings)


def test_a_sound_recording_has_no_findings(tmp_path):
    report = checked(tmp_path, NOISE + 0.5, width_hz=10.0, band_hz=(50.0, 400.0))
    assert (report.usable, report.remarks, report.samples, report.duration_s) == (
        True,
        (),
        20_000,
        20.0,
    )
    assert report.rms == pytest.approx(NOISE.std(), rel=1e-12)
    assert report.offset == pytest.approx(NOISE.mean() + 0.5, rel=1e-9)
    assert report.peak == pytest.approx(np.abs(NOISE - NOISE.mean()).max(), rel=1e-9)


def test_statistics_are_independent_of_the_block_size(tmp_path):
    values = NOISE.copy()
    values[777:1234] = np.nan
    complete = checked(tmp_path, values)
    opened = open_recording(tmp_path / "a.npz")
    statistics = SampleStatistics()
    for _ in statistics.pass_through(opened.blocks(613)):
        pass
    in_blocks = statistics.quality(opened, width_hz=None, band_hz=None)
    assert in_blocks.rms == pytest.approx(complete.rms, rel=1e-12)
    assert (in_blocks.gaps, in_blocks.missing, in_blocks.peak) == (
        1,
        457 / 20_000,
        pytest.approx(complete.peak),
    )


def test_clipping_is_counted(tmp_path):
    sine = 5.0 * np.sin(2.0 * np.pi * 3.0 * np.arange(20_000) / RATE)
    report = checked(tmp_path, np.clip(sine, -4.0, 4.0))
    assert report.clipped == pytest.approx(
        2.0 * np.arccos(0.8) / np.pi, rel=0.02
    )  # fraction of samples beyond 0.8
    assert any("clipped" in remark and "too low" in remark for remark in report.remarks)
    assert checked(tmp_path, sine).clipped == 0.0


@pytest.mark.parametrize(
    ("drive", "soft_clipped"),
    [(3.0, True), (2.0, True), (0.1, False)],
    ids=["hard driven", "driven", "not driven"],
)
def test_soft_clipping_is_detected(tmp_path, drive, soft_clipped):
    """tanh of Gaussian noise, as from an amplifier at its limit; for any block size."""
    report = checked(tmp_path, 5.0 * np.tanh(drive * NOISE / NOISE.std()))
    assert (report.clipped, any("soft clipping" in remark for remark in report.remarks)) == (
        0.0,
        soft_clipped,
    )
    statistics = SampleStatistics()
    for _ in statistics.pass_through(
        np.array_split(5.0 * np.tanh(drive * NOISE / NOISE.std()), 37)
    ):
        pass
    assert statistics.piled == soft_clipped


def test_a_distribution_with_thin_tails_is_not_reported_as_clipped(tmp_path):
    for values in (
        NOISE,
        NOISE**3,
        np.abs(NOISE) ** 0.5 * np.sign(NOISE),
        RNG.uniform(-1.0, 1.0, 20_000),
    ):
        assert not any("clip" in remark for remark in checked(tmp_path, values).remarks)


def test_gaps_and_stuck_samples_are_counted(tmp_path):
    values = NOISE.copy()
    values[100:200] = values[7000:7300] = np.nan
    values[9000:9500] = values[8999]
    report = checked(tmp_path, values)
    assert (report.gaps, report.missing) == (2, 400 / 20_000)
    assert report.stuck == pytest.approx(500 / 19_600)
    assert report.usable


@pytest.mark.parametrize(
    ("values", "unit"),
    [
        (np.zeros(2000), "V"),
        (0.002 * RNG.integers(-1, 2, 2000), "V"),
        (0.001 * NOISE, "m/s^2"),
        (np.full(2000, 7.5), "g"),
    ],
)
def test_a_machine_at_rest_is_reported_as_off(tmp_path, values, unit):
    report = checked(tmp_path, values, unit=unit)
    assert report.off
    assert "machine was off" in report.faults[0]


def test_quantised_noise_is_not_off(tmp_path):
    assert not checked(tmp_path, np.round(NOISE), unit="V").off


def test_a_record_too_short_or_slow_for_the_resonance_is_reported(tmp_path):
    report = checked(tmp_path, NOISE[:500], width_hz=20.0, band_hz=(100.0, 450.0))
    assert "too short: 0.5 s; a resonance 20 Hz wide needs 0.8 s" in report.faults[0]
    assert "sampled too slowly: 1000 Hz; a band up to 450 Hz needs 1125 Hz" in report.faults[1]


def test_offsets_are_reported(tmp_path):
    assert any("offset" in remark for remark in checked(tmp_path, NOISE + 20.0).remarks)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the developers' data are not on this machine")
def test_the_stopped_machine_of_the_ims_data_is_off_and_the_others_run():
    states = {}
    for path in sorted((SHARED / "vibration" / "ims").iterdir()):
        states[path.name] = {
            check_recording(recording).off for recording in open_channels(path, rate_hz=20e3)
        }
    assert states == {
        "2003.10.22.12.06.24": {False},
        "2004.02.12.10.32.39": {False},
        "2004.02.19.06.22.39": {True},
    }
