"""Velocity and its zones, and envelopes, against closed forms and the standard's table; alarms."""

import json
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.core.signals import Signal, power_spectrum
from asperity.monitoring import TrackSettings, track_recordings
from asperity.rating import severity_zone, velocity_rms
from asperity.recording import read_recording
from asperity.vibration import Envelope

RATE = 20e3


@pytest.mark.parametrize(
    ("hertz", "within"),
    [(10.5, 0.06), (12.5, 0.03), (25.0, 0.01), (50.0, 3e-3), (300.0, 2e-3), (990.0, 2e-3)],
)
def test_velocity_of_a_tone_is_acceleration_over_angular_frequency(hertz, within):
    time = np.arange(round(10 * RATE)) / RATE
    wave = 3.0 * np.sin(2.0 * np.pi * hertz * time)
    spectrum = power_spectrum(Signal(wave, RATE, "m/s^2"), segment=8000)  # lines 2.5 Hz apart
    exact = 3.0 / np.sqrt(2.0) / (2.0 * np.pi * hertz)
    assert velocity_rms(spectrum.frequency_hz, spectrum.density) == pytest.approx(exact, rel=within)


def test_velocity_of_white_noise_is_the_integral_of_its_band():
    """∫ S/(2πf)² df from 10 to 1000 Hz = S/(4π²) (1/10 - 1/1000); 1 Hz lines add 5 % at the lower
    end.
    """
    frequency = np.arange(0.0, 5000.0, 0.1)
    exact = np.sqrt(2.0 / (4.0 * np.pi**2) * (1.0 / 10.0 - 1.0 / 1000.0))
    assert velocity_rms(frequency, np.full(frequency.size, 2.0)) == pytest.approx(exact, rel=5e-3)


def test_velocity_is_undetermined_for_coarse_lines_or_a_low_rate():
    assert np.isnan(velocity_rms(np.arange(0.0, 2000.0, 6.0), np.ones(334)))
    assert np.isnan(velocity_rms(np.arange(0.0, 900.0, 1.0), np.ones(900)))


def test_velocity_of_a_velocity_is_the_integral_of_its_density():
    frequency = np.arange(0.0, 2000.0)
    assert velocity_rms(frequency, np.full(2000, 4e-6), "velocity") == pytest.approx(
        np.sqrt(991 * 4e-6)
    )
    with pytest.raises(BadInput, match="measured must be one of"):
        velocity_rms(frequency, np.ones(2000), "displacement")


@pytest.mark.parametrize(
    ("unit", "factor"), [("mm/s", 1e-3), ("in/s", 0.0254), ("m/s", 1.0), ("mm/s rms", 1e-3)]
)
def test_recorded_velocities_have_their_zone(tmp_path, unit, factor):
    """A velocity of 6 mm/s rms at 50 Hz, and 20 mm/s at 5 Hz below the range of the standard."""
    time = np.arange(round(4.0 * RATE)) / RATE
    for number in range(3):
        wave = 6e-3 * np.sin(2.0 * np.pi * 50.0 * time) + 20e-3 * np.sin(2.0 * np.pi * 5.0 * time)
        noise = 1e-5 * np.random.default_rng(number).standard_normal(time.size)
        values = (np.sqrt(2.0) * wave + noise) / factor
        np.savez(tmp_path / f"v-{number}.npz", v=values, fs=RATE, unit=unit)
    (tmp_path / "recordings.json").write_text('{"machine_class": "large-rigid"}')
    track = track_recordings([tmp_path], TrackSettings(band_hz=(2000.0, 4000.0)))
    assert {recording.zone for recording in track.recordings} == {"C"}
    row = track.scalars()["recordings"][0]
    assert (row["velocity_rms"], row["unit"]) == (pytest.approx(6e-3, rel=0.01), unit)


@pytest.mark.parametrize(
    (
        "machine",
        "mm_s",
        "zone",
    ),  # ISO 10816-3:2009, tables A.1 and A.2, which ISO 20816-3:2022 has taken over
    [
        ("large-rigid", (2.2, 2.4, 4.4, 4.6, 7.0, 7.2), "ABBCCD"),
        ("large-flexible", (3.4, 3.6, 7.0, 7.2, 10.9, 11.1), "ABBCCD"),
        ("medium-rigid", (1.3, 1.5, 2.7, 2.9, 4.4, 4.6), "ABBCCD"),
        ("medium-flexible", (2.2, 2.4, 4.4, 4.6, 7.0, 7.2), "ABBCCD"),
    ],
)
def test_zones_are_those_of_the_standard(machine, mm_s, zone):
    assert "".join(severity_zone(1e-3 * value, machine) for value in mm_s) == zone
    with pytest.raises(BadInput, match="machine class must be one of"):
        severity_zone(1.0, "small")


@pytest.mark.parametrize("share", [0.2, 0.5, 1.0])
def test_envelope_depth_of_a_modulated_tone_is_its_closed_form(share):
    """(1 + m cos)² = 1 + m²/2 + 2m cos + m²/2 cos 2: rms of both lines over the mean; a taper takes
    up to 15 %.
    """
    time = np.arange(round(8 * RATE)) / RATE
    wave = (1.0 + share * np.cos(2.0 * np.pi * 87.3 * time)) * np.cos(2.0 * np.pi * 4321.0 * time)
    envelope = Envelope(RATE)
    passed = [*envelope.watch([wave[:50_000], wave[50_000:120_001], wave[120_001:]])]
    assert np.array_equal(np.concatenate(passed), wave)
    exact = np.sqrt(2.0 * share**2 + share**4 / 8.0) / (1.0 + share**2 / 2.0)
    depths = envelope.depths({"outer": 87.3, "inner": 131.9, "slow": 0.5})
    assert depths["outer"] == pytest.approx(exact, rel=0.15)
    assert depths["inner"] < 0.02 * exact
    assert np.isnan(depths["slow"])
    assert np.isnan(envelope.depths({"beyond the band": 0.16 * RATE})["beyond the band"])


def test_an_envelope_of_a_short_or_interrupted_record_gives_what_it_supports():
    noise = np.random.default_rng(1).standard_normal(round(9 * RATE))
    short, gaps = Envelope(RATE), Envelope(RATE)
    list(short.watch([noise[:2000]]))
    assert 0.0 < short.depths({"fault": 87.3})["fault"] < 0.4
    assert np.isnan(short.depths({"fault": 30.0})["fault"])  # fewer than four revolutions
    noise[1000] = np.nan
    list(gaps.watch([noise]))
    assert gaps.chunks == 1  # one of two blocks has a gap
    empty = Envelope(RATE)
    list(empty.watch([np.zeros(2000)]))
    assert np.isnan(empty.depths({"fault": 87.3})["fault"])


def recordings(folder, velocities, depths, seconds=2.0, **sidecar):
    """A machine with this velocity [m/s] at 50 Hz; bearing impulses at 87.3 Hz excite 4 kHz to
    `depths`.
    """
    folder.mkdir()
    time = np.arange(round(seconds * RATE)) / RATE
    for number, (velocity, depth) in enumerate(zip(velocities, depths, strict=True)):
        rng = np.random.default_rng(number)
        vibration = np.sqrt(2.0) * velocity * 2.0 * np.pi * 50.0 * np.sin(2.0 * np.pi * 50.0 * time)
        impulses = rng.standard_normal(time.size) * (
            1.0 + depth * np.cos(2.0 * np.pi * 87.3 * time)
        )
        np.savez(
            folder / f"s-{number:03}.npz", acc=vibration + 0.3 * impulses, fs=RATE, unit="m/s^2"
        )
    (folder / "recordings.json").write_text(json.dumps(sidecar))
    return folder


@pytest.mark.parametrize(
    ("velocity", "zone", "state", "message"),
    [
        (
            8e-3,
            "D",
            "alarm",
            (
                "velocity 8 mm/s rms, 10 to 1000 Hz: zone D of ISO 20816-3 (large-rigid), severe"
                " enough"
            ),
        ),
        (6e-3, "C", "cannot-tell", "Cannot tell: baseline incomplete"),
        (3e-3, "B", "cannot-tell", "Cannot tell: baseline incomplete"),
    ],
)
def test_a_zone_raises_the_standards_state(tmp_path, velocity, zone, state, message):
    folder = recordings(
        tmp_path / "in", [velocity] * 3, [0.0] * 3, seconds=4.0, machine_class="large-rigid"
    )
    track = track_recordings([folder], TrackSettings(band_hz=(2000.0, 4000.0)))
    assert {recording.zone for recording in track.recordings} == {zone}
    assert track.alarm.state == state
    assert message in track.verdict()
    assert track.scalars()["recordings"][0]["velocity_rms"] == pytest.approx(velocity, rel=0.02)
    if state == "alarm":
        assert track.alarm.since == 1  # the second recording in zone D
        assert track.alarm.states == ("cannot-tell", "alarm", "alarm")
    looked = track_recordings([folder], TrackSettings(band_hz=(2000.0, 4000.0), acknowledge="last"))
    assert looked.alarm.state == "none"


def test_zone_d_alarms_even_if_left_again(tmp_path):
    velocities = [1e-3, 9e-3, 9e-3, 1e-3, 1e-3]
    folder = recordings(
        tmp_path / "in", velocities, [0.0] * 5, seconds=4.0, machine_class="large-rigid"
    )
    track = track_recordings([folder], TrackSettings(band_hz=(2000.0, 4000.0)))
    assert (track.alarm.state, track.alarm.since, track.alarm.raised_by) == ("alarm", 2, "zone")


def test_without_a_class_velocity_has_no_zone(tmp_path):
    folder = recordings(tmp_path / "in", [8e-3] * 3, [0.0] * 3, seconds=4.0)
    track = track_recordings([folder], TrackSettings(band_hz=(2000.0, 4000.0)))
    assert track.recordings[-1].zone is None
    assert track.alarm.state != "alarm"
    assert (
        "zone of ISO 20816-3 not determined: the sidecar states no machine_class"
        in track.recordings[-1].severity()
    )


@pytest.mark.parametrize(
    "late", [np.geomspace(0.05, 0.9, 14), np.full(14, 0.3)], ids=["grows", "jumps"]
)
def test_an_envelope_fault_alarms_at_constant_level(tmp_path, late):
    """Only the outer-race fault grows."""
    depths = np.concatenate([np.zeros(14), late])
    folder = recordings(
        tmp_path / "in", [1e-3] * 28, depths, faults_hz={"outer ring": 87.3, "inner ring": 131.9}
    )
    track = track_recordings([folder], TrackSettings(band_hz=(2000.0, 4000.0)))
    assert (track.alarm.state, track.alarm.raised_by) == ("alarm", "the envelope at outer ring")
    assert track.table["depth_outer ring"].iloc[-1] > 5.0 * track.table["depth_inner ring"].iloc[-1]


@pytest.mark.parametrize(
    ("sidecar", "message"),
    [
        ({"machine_class": "huge"}, "machine_class must be one of large-rigid"),
        ({"faults_hz": 87.3}, "faults_hz must be positive fault frequencies by name"),
        ({"faults_hz": {"BPFO": -1.0}}, "faults_hz must be positive fault frequencies by name"),
        ({"faults_hz": {}}, "faults_hz must be positive fault frequencies by name"),
    ],
)
def test_an_invalid_sidecar_is_refused(tmp_path, sidecar, message):
    folder = recordings(tmp_path / "in", [1e-3], [0.0], **sidecar)
    with pytest.raises(BadInput, match=message):
        read_recording(Path(folder) / "s-000.npz")
