"""Stages that `track` detects from CRF, damping and both in a series whose line narrows at constant
frequency.
"""

import json
import re
from urllib.parse import unquote

import numpy as np
import pytest
from scipy.signal import lfilter

from asperity.core.errors import BadInput
from asperity.monitoring import TrackSettings, track_recordings
from asperity.paper import papers_case
from asperity.report.track.page import render_track_page

pytestmark = pytest.mark.usefixtures("coarse_search")

RATE, F0, SECONDS = 20e3, 3000.0, 8.0
CASE = papers_case()
PLACES = np.arange(1.0, 13.0)
RATIO = np.exp(np.interp(PLACES, [1.0, 6.5, 12.0], np.log([0.04, 0.014, 0.0132])))


def record(path, seed, ratio, seconds=SECONDS):
    """Write white noise filtered by an oscillator at F0, plus additive noise."""
    rng = np.random.default_rng(seed)
    angle, decay = 2.0 * np.pi * F0 / RATE, np.exp(-2.0 * np.pi * ratio * F0 / RATE)
    noise = rng.standard_normal((2, round(seconds * RATE)))
    ringing = lfilter(
        [1.0], [1.0, -2.0 * decay * np.cos(angle * np.sqrt(1 - ratio**2)), decay**2], noise[0]
    )
    np.savez(path, acc=ringing + noise[1], fs=RATE, unit="m/s^2")
    return path


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    folder = tmp_path_factory.mktemp("narrowing")
    return [record(folder / f"{n:02}.npz", n, ratio) for n, ratio in enumerate(RATIO)]


@pytest.fixture(scope="module")
def track(series):
    return track_recordings(
        series,
        TrackSettings(band_hz=(2e3, 4e3), method="likelihood", stages_from="damping"),
        x=PLACES,
        case=CASE,
    )


def test_damping_detects_a_stage_that_crf_does_not_show(track):
    by = track.stages_by
    assert by["crf"].kind == "no change"
    assert (by["damping"].kind, by["both"].kind) == ("severe", "severe")
    low, high = by["damping"].interval
    assert low < 6.5 < high < 8.0
    assert "in the damping alone" in by["both"].verdict
    for recording, ratio in zip(track.recordings, RATIO, strict=True):
        damping, std = recording.damping
        assert damping == pytest.approx(ratio, abs=4.0 * std)


def test_the_deciding_indicator_sets_labels_and_alarm(track, series):
    assert track.stages is track.stages_by["damping"]
    assert track.recordings[-1].label == "severe"
    assert track.alarm.state in ("alert", "alarm")
    by_crf = track_recordings(
        series, TrackSettings(band_hz=(2e3, 4e3), method="likelihood"), x=PLACES, case=CASE
    )
    assert by_crf.stages is by_crf.stages_by["crf"]
    assert by_crf.alarm.state == "none"
    assert {recording.label for recording in by_crf.recordings} == {"none"}
    rows = dict(track.stage_rows())
    assert set(rows) == {
        "stage by CRF",
        "stage by damping (deciding)",
        "stage by CRF and damping",
    }


def test_json_lists_all_indicators_and_the_deciding_one(track):
    output = json.loads(json.dumps(track.scalars()))
    assert output["stages"]["source"] == "damping"
    assert list(output["stages_by"]) == ["crf", "damping", "both"]
    by_damping = output["stages_by"]["damping"]
    assert by_damping["split"] == output["stages"]["split"]
    assert by_damping["damping"][0] > 2.0 * by_damping["damping"][1] > by_damping["damping"][2]
    assert by_damping["slopes"] == [None, None]
    assert output["recordings"][0]["damping_reason"] == ""
    attribute = json.loads(track.to_dataset().attrs["track"])
    assert attribute["stages_by"]["both"]["kind"] == "severe"


def test_the_page_shows_all_indicators_and_the_break_of_damping(track):
    page = render_track_page(track)
    assert "Damping (decides)" in page
    assert "From damping alone: Severe wear from" in page
    assert "Damping decides stage and alarm" in page


def test_the_trend_has_a_separate_drawing_for_narrow_screens(track):
    match = re.search(
        r'<source media="([^"]*)" srcset="([^"]*)" width="(\d+)" height="\d+"><img ',
        render_track_page(track),
    )
    assert match[1] == "(max-width: 480px)"
    assert " " not in match[2]  # a space ends an address in a srcset
    assert unquote(match[2]).startswith("data:image/svg+xml,<svg ")
    assert int(match[3]) < 480  # drawn at nearly its own size, so that the text stays readable


def test_a_method_that_fits_no_width_determines_no_damping(series):
    track = track_recordings(
        series,
        TrackSettings(band_hz=(2e3, 4e3), method="peak", stages_from="both"),
        x=PLACES,
        case=CASE,
    )
    assert {recording.damping_reason for recording in track.recordings} == {
        "the method peak fits no width"
    }
    assert track.stages.kind == "too few"
    assert track.verdict().startswith("Too few points: ")
    assert np.isnan([recording.severe_probability for recording in track.recordings]).all()
    assert track.alarm.state == "none"
    assert any(
        "not determined for 12 of 12 resonances: the method peak" in note for note in track.notes
    )
    page = render_track_page(track)
    assert page.count("not determined</td>") >= 12
    assert "Damping of the contact resonance" not in page


@pytest.mark.parametrize(
    ("ratio", "reason"),
    [
        (0.003, "less than 4 times the spectrum's resolution of 6.0 Hz"),
        (0.0005, "of the line was removed as tones"),
    ],
)
def test_a_line_narrower_than_the_resolution_gives_no_damping(tmp_path, ratio, reason):
    path = record(tmp_path / "narrow.npz", 1, ratio, seconds=2.0)  # 18 and 3 Hz wide
    recording = track_recordings(
        [path], TrackSettings(band_hz=(2e3, 4e3), method="likelihood")
    ).recordings[0]
    assert recording.resonance.found
    assert reason in recording.damping_reason
    assert recording.row()["damping_ratio"] is None


def test_an_unknown_source_is_refused(series):
    with pytest.raises(BadInput, match="crf, damping, both, got 'width'"):
        track_recordings(series[:1], TrackSettings(band_hz=(2e3, 4e3), stages_from="width"))
