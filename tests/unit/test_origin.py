"""Evidence that a line belongs to the contact: case, two sensors, load or speed; or none."""

import numpy as np
import pytest
from scipy.signal import lfilter

from asperity.monitoring import TrackSettings, track_recordings
from asperity.paper import papers_case

pytestmark = pytest.mark.usefixtures("coarse_search")

RATE, SECONDS, COUNT = 20e3, 4.0, 14
SETTINGS = TrackSettings(band_hz=(2e3, 4e3), method="likelihood")
LOADS = np.where(np.arange(COUNT) % 3 == 0, 500.0, 900.0)


def lines(folder, frequencies):
    """Write recordings of one line each, above white noise."""
    folder.mkdir()
    files = []
    for number, frequency in enumerate(frequencies):
        rng = np.random.default_rng(number)
        noise = rng.standard_normal((2, round(SECONDS * RATE)))
        decay = np.exp(-2.0 * np.pi * 0.01 * frequency / RATE)
        cosine = np.cos(2.0 * np.pi * frequency / RATE)
        ringing = lfilter([1.0], [1.0, -2.0 * decay * cosine, decay**2], noise[0])
        files.append(folder / f"{number:02}.npz")
        np.savez(files[-1], acc=0.2 * ringing + noise[1], fs=RATE, unit="m/s^2")
    return files


def table(folder, key, values):
    path = folder / "table.csv"
    rows = [f"{number:02}.npz,{number},{value:g}" for number, value in enumerate(values)]
    path.write_text("\n".join([f"file,x,{key}", *rows]))
    return path


def wearing(end=3600.0):
    """Return frequencies that rise as contact resonances do with wear."""
    return np.interp(np.arange(COUNT), [0, 8, COUNT - 1], [2700.0, end - 100.0, end])


def test_a_line_in_a_stated_band_is_of_unknown_origin(tmp_path):
    track = track_recordings(lines(tmp_path / "in", wearing()), SETTINGS)
    scalars = track.scalars()
    assert track.stages is None
    assert track.evidence == ""
    assert scalars["contact"]["state"] == "not-seen"
    assert scalars["contact"]["reason"].startswith("a line of unknown origin at 36")
    assert "unknown origin" in track.verdict()
    assert "state load or speed, a second sensor, or the case" in track.verdict()
    assert track.alarm.state == "none"
    assert {recording.label for recording in track.recordings} == {"none"}


def test_a_case_states_the_contact(tmp_path):
    track = track_recordings(lines(tmp_path / "in", wearing()), SETTINGS, case=papers_case())
    assert track.scalars()["contact"]["state"] == "seen"
    assert "predicts its band" in track.evidence
    assert track.stages.kind == "severe"


@pytest.mark.parametrize(
    ("exponent", "evidence"),
    [(1.0 / 6.0, "it follows the load with an exponent of 0.1"), (0.0, ""), (-0.3, "")],
)
def test_a_line_that_follows_the_load_as_a_contact_does(exponent, evidence, tmp_path):
    files = lines(tmp_path / "in", 3000.0 * (LOADS / 500.0) ** exponent)
    track = track_recordings(files, SETTINGS, table=table(tmp_path, "load_n", LOADS))
    assert track.evidence.startswith(evidence)
    assert bool(track.evidence) == bool(evidence)


def test_a_line_proportional_to_speed_is_not_of_the_contact(tmp_path):
    """A gear mesh or an order moves with the speed; a contact falls slightly or stays."""
    speeds = np.where(np.arange(COUNT) % 3 == 0, 25.0, 27.0)
    files = lines(tmp_path / "in", 2800.0 * speeds / 25.0)
    track = track_recordings(files, SETTINGS, table=table(tmp_path, "speed_hz", speeds))
    assert track.evidence == ""
