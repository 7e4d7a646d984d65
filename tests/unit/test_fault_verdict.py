"""Verdict of a series that names the fault by the envelope, and what a change of CRF means."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.io import loadmat

from asperity.monitoring import TrackSettings, track_recordings
from asperity.monitoring.states import FALLING_CRF, RISING_CRF, crf_meaning
from asperity.report import write_track_report
from asperity.trend import EnvelopeDepth
from support.recordings import SHARED

RATE = 20e3
RATES = {"BPFO": 87.3, "BPFI": 131.9}
HEALTHY, FAULTY = 12, 10


def impacts(rate_hz, rng):
    """Return a second of impacts at a rate that ring at 5 kHz."""
    time = np.arange(round(RATE)) / RATE
    impulses = np.zeros(time.size)
    impulses[np.flatnonzero(np.diff(np.floor(rate_hz * time), prepend=0.0))] = 1.0
    impulses *= 1.0 + 0.1 * rng.standard_normal(time.size)
    ring = np.exp(-800.0 * time[:200]) * np.sin(2.0 * np.pi * 5000.0 * time[:200])
    return np.convolve(impulses, ring)[: time.size]


def recordings(folder, fault=None, rise=1.0):
    """Write a series in which a fault begins, or the level rises."""
    folder.mkdir()
    rates = ", ".join(f"{name} = {rate}" for name, rate in RATES.items())
    for number in range(HEALTHY + FAULTY):
        rng = np.random.default_rng(number)
        values = rng.standard_normal(round(RATE))
        faulty = number >= HEALTHY
        if faulty and fault:
            values += 6.0 * impacts(RATES[fault], rng)
        path = folder / f"r-{number:02}.npz"
        np.savez(path, acc=values * (rise if faulty else 1.0), fs=RATE, unit="m/s^2")
        path.with_name(f"{path.name}.toml").write_text(f"faults_hz = {{ {rates} }}\n")
    return track_recordings([folder], TrackSettings(band_hz=(2e3, 4e3)))


@pytest.mark.parametrize(
    ("fault", "other", "component"),
    [("BPFO", "BPFI", "outer race"), ("BPFI", "BPFO", "inner race")],
)
def test_the_verdict_names_the_component_and_its_evidence(tmp_path, fault, other, component):
    track = recordings(tmp_path / "in", fault)
    found = track.scalars()["fault"]
    assert found["component"] == component
    assert found["fault_frequency"] == fault
    assert found["factor"] > 4.0
    assert found["others"][other] < 0.5 * found["factor"]
    last = track.recordings[-1].reading.depths[fault]
    assert found["depth"] == pytest.approx(last, rel=0.1)
    sentence = f"Indicates a fault of the {component}: the envelope at {fault} has a depth of"
    assert sentence in track.verdict()
    page = write_track_report(track, tmp_path / "page.html").read_text("utf-8")
    assert sentence in page


def test_a_rise_of_the_level_alone_names_no_component(tmp_path):
    track = recordings(tmp_path / "in", rise=5.0)
    assert track.alarm.state == "alarm"
    assert track.scalars()["fault"]["component"] is None
    assert "No fault frequency has risen: the envelope at " in track.verdict()


def test_a_healthy_series_has_no_fault(tmp_path):
    track = recordings(tmp_path / "in")
    assert track.scalars()["fault"] is None
    assert "fault" not in track.verdict()


def test_the_depth_of_several_bearings_keeps_their_names(tmp_path):
    track = recordings(tmp_path / "in", "BPFO")
    depths = (EnvelopeDepth("BPFI NDE", "radial", 0.4, 9.0),)
    level = track.alarm.level._replace(depths=depths)
    track = replace(track, alarm=replace(track.alarm, level=level))
    assert (
        "Indicates a fault of the inner race: the envelope at BPFI NDE on radial has a depth of "
        "0.4, 9 times its baseline." in track.verdict()
    )


@pytest.mark.parametrize(
    ("change", "meaning"), [(1.2, RISING_CRF), (0.8, FALLING_CRF)], ids=["rise", "fall"]
)
def test_the_verdict_states_what_a_change_of_crf_means(tmp_path, change, meaning):
    track = recordings(tmp_path / "in")
    changed = [
        replace(recording, crf_reference_hz=3000.0 * (change if number >= HEALTHY else 1.0))
        for number, recording in enumerate(track.recordings)
    ]
    alarm = replace(track.alarm, state="alarm", since=HEALTHY, raised_by="CRF", reason="CRF")
    assert crf_meaning(alarm, changed) == meaning
    assert crf_meaning(replace(alarm, raised_by="the level (rms)"), changed) == ""
    assert crf_meaning(replace(alarm, state="none"), changed) == ""
    verdict = replace(track, recordings=tuple(changed), alarm=alarm).verdict()
    assert meaning in verdict


MFPT = SHARED / "vibration" / "mfpt"
MFPT_ORDERS = {"BPFO": 3.245, "BPFI": 4.755, "BSF": 2.557, "FTF": 0.4056}


@pytest.mark.parametrize(
    ("measured", "component"),
    [
        ("OuterRaceFault_vload_1", "outer race"),
        ("OuterRaceFault_vload_5", "outer race"),
        ("InnerRaceFault_vload_1", "inner race"),
        ("InnerRaceFault_vload_4", "inner race"),
    ],
)
def test_measured_faults_are_named(tmp_path, measured, component):
    """Name the fault of a measured recording that follows noise of the same spectrum."""
    file = MFPT / f"{measured}.mat"
    if not file.is_file():
        pytest.skip(f"{file.name} is not beside the repository")
    bearing = loadmat(file)["bearing"][0, 0]
    rate_hz, shaft_hz = float(bearing["sr"].item()), float(bearing["rate"].item())
    rates = ", ".join(f"{key} = {order * shaft_hz}" for key, order in MFPT_ORDERS.items())
    parts = np.array_split(bearing["gs"].ravel().astype(float), 4)
    rng = np.random.default_rng(1)
    noise = []
    for part in parts * 3:
        lines = np.abs(np.fft.rfft(part))
        phases = np.exp(2j * np.pi * rng.random(lines.size))
        noise.append(np.fft.irfft(lines * phases, part.size))
    for number, values in enumerate([*noise, *parts]):
        path = tmp_path / f"r-{number:02}.npz"
        np.savez(path, acc=values, fs=rate_hz, unit="g")
        path.with_name(f"{path.name}.toml").write_text(f"faults_hz = {{ {rates} }}\n")
    track = track_recordings([tmp_path], TrackSettings(band_hz=(2e3, 4e3)))
    assert track.scalars()["fault"]["component"] == component
