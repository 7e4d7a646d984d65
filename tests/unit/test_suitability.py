"""For what a recording is good, compared with what reading it provides."""

import json

import numpy as np
import pytest

from asperity.cli import main
from asperity.monitoring import check_recordings, search_target
from asperity.monitoring.reading import common_spacing, read_spectrum
from asperity.recording import ReadOptions

BAND = (2000.0, 4000.0)
RATES = {"FTF": 9.0, "BPFO": 87.3}
ALL = {"contact_resonance", "envelope", "zone", "level"}


def write(path, *, seconds=4.0, rate_hz=20e3, unit="m/s^2", scale=1.0, gap=None, **sidecar):
    values = scale * np.random.default_rng(0).standard_normal(round(seconds * rate_hz))
    if gap is not None:
        values[:: round(gap * rate_hz)] = np.nan
    np.savez(path, acc=values, fs=rate_hz, unit=unit)
    path.with_name(f"{path.name}.json").write_text(json.dumps(sidecar))
    return path


CASES = {
    "whole": ({}, ALL),
    "velocity": ({"unit": "mm/s"}, ALL),
    "volts": ({"unit": "V"}, ALL - {"zone"}),
    "short": ({"seconds": 0.15}, {"envelope", "level"}),
    "two seconds": ({"seconds": 2.0}, ALL - {"zone"}),
    "snapshot": ({"seconds": 0.01}, {"level"}),
    "slow": ({"rate_hz": 2600.0, "seconds": 10.0}, {"envelope", "zone", "level"}),
    "very slow": ({"rate_hz": 1000.0, "seconds": 10.0}, {"envelope", "level"}),
    "often interrupted": ({"gap": 1.0}, {"contact_resonance", "zone", "level"}),
    "off": ({"scale": 1e-4}, set()),
}


@pytest.mark.parametrize("name", CASES)
def test_a_recording_is_good_for_what_reading_it_provides(tmp_path, name):
    given, expected = CASES[name]
    path = write(tmp_path / "a.npz", **given, faults_hz=RATES, machine_class="large-rigid")
    (checked,) = check_recordings([path], band_hz=BAND).checked
    assert {key for key, use in checked.uses.items() if use.possible} == expected
    assert all(use.reason for use in checked.uses.values())
    target = search_target(band_hz=BAND)
    spacing = common_spacing([path], ReadOptions(), target)
    reading = read_spectrum(path, ReadOptions(), target, spacing)
    if name != "off":
        assert ("contact_resonance" in expected) == reading.usable
        assert ("envelope" in expected) == np.isfinite(reading.depths["BPFO"])
        assert ("zone" in expected) == np.isfinite(reading.velocity)
        assert ("level" in expected) == (reading.quality.rms > 0.0)


@pytest.mark.parametrize(
    ("given", "use", "reason"),
    [
        (
            {},
            "envelope",
            "resolves 1 to 3000 Hz; state fault frequencies as faults_hz or faults_per_turn",
        ),
        ({"faults_hz": RATES}, "envelope", "resolves 1 to 3000 Hz: FTF, BPFO"),
        ({"faults_hz": RATES, "seconds": 0.4}, "envelope", "10 to 3000 Hz: BPFO, not FTF (9 Hz)"),
        ({"faults_hz": {"mesh": 5e3}}, "envelope", "resolves 1 to 3000 Hz, not mesh (5000 Hz)"),
        ({}, "zone", "state machine_class for its zone"),
        ({"machine_class": "large-rigid"}, "zone", "machine class large-rigid"),
        ({"unit": "V"}, "zone", "must be an acceleration or velocity, and is V"),
        ({"unit": "V"}, "level", "relative to recordings of equal gain only (unit: V)"),
        ({"seconds": 2.0}, "zone", "too short: 2 s; velocities from 10 Hz need 3.2 s"),
        ({"rate_hz": 1000.0}, "zone", "1000 Hz; velocities up to 1000 Hz need 2000 Hz"),
        ({"rate_hz": 1000.0}, "contact_resonance", "sampled too slowly: 1000 Hz"),
        ({"scale": 1e-4}, "level", "the machine was off"),
    ],
)
def test_the_reason_is_stated(tmp_path, given, use, reason):
    path = write(tmp_path / "a.npz", **given)
    (checked,) = check_recordings([path], band_hz=BAND).checked
    assert reason in checked.uses[use].reason


def shown(capsys, *arguments):
    with pytest.raises(SystemExit):
        main(["check", "--band", "2000", "4000", *arguments])
    return capsys.readouterr().out


def test_the_command_shows_what_a_recording_is_good_for(tmp_path, capsys):
    short = write(tmp_path / "b.npz", seconds=0.15)
    result = json.loads(shown(capsys, str(short), "--json"))
    uses = result["recordings"][0]["good_for"]
    assert uses["contact_resonance"] == {
        "possible": False,
        "reason": "too short: 0.15 s; a resonance 80 Hz wide needs 0.2 s",
    }
    assert {key: use["possible"] for key, use in uses.items()} == {
        "contact_resonance": False,
        "envelope": True,
        "zone": False,
        "level": True,
    }
    text = shown(capsys, str(short))
    assert "good for: envelope at fault frequencies, level trend." in text.splitlines()[0]
    assert "no contact resonance; envelope at fault frequencies, level trend" in text
    assert "NO: too short: 0.15 s; velocities from 10 Hz need 3.2 s" in text


def test_the_verdict_on_several_states_for_what_the_others_are_good(tmp_path):
    write(tmp_path / "a.npz")
    write(tmp_path / "b.npz", seconds=0.15)
    write(tmp_path / "c.npz", scale=1e-4)
    assert check_recordings([tmp_path], band_hz=BAND).verdict() == (
        "1 of 3 recordings can be used: too short; the machine was off, or the sensor "
        "disconnected. Other uses: envelope at fault frequencies (1), level trend (1)."
    )
