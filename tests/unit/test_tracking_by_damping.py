"""A series whose line narrows and keeps its frequency: what `track` reads from CRF, from damping
and from both.
"""

import json
import re
from urllib.parse import unquote

import numpy as np
import pytest
from scipy.signal import lfilter

from asperity.core.errors import BadInput
from asperity.monitoring import TrackSettings, track_recordings
from asperity.report.track.page import render_track_page

RATE, F0, SECONDS = 20e3, 3000.0, 8.0
PLACES = np.arange(1.0, 13.0)
RATIO = np.exp(np.interp(PLACES, [1.0, 6.5, 12.0], np.log([0.04, 0.014, 0.0132])))


def record(path, seed, ratio, seconds=SECONDS):
    """White noise through an oscillator at F0, in a little more noise."""
    rng = np.random.default_rng(seed)
    turn, shrink = 2.0 * np.pi * F0 / RATE, np.exp(-2.0 * np.pi * ratio * F0 / RATE)
    noise = rng.standard_normal((2, round(seconds * RATE)))
    ringing = lfilter(
        [1.0], [1.0, -2.0 * shrink * np.cos(turn * np.sqrt(1 - ratio**2)), shrink**2], noise[0]
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
    )


def test_crf_sees_nothing_where_damping_sees_the_stage(track):
    by = track.stages_by
    assert by["crf"].kind == "no change"
    assert (by["damping"].kind, by["both"].kind) == ("severe", "severe")
    low, high = by["damping"].interval
    assert low < 6.5 < high < 8.0
    assert "in the damping alone" in by["both"].verdict
    for one, ratio in zip(track.recordings, RATIO, strict=True):
        damping, std = one.damping
        assert damping == pytest.approx(ratio, abs=4.0 * std)


def test_what_decides_has_labels_and_alarm(track, series):
    assert track.stages is track.stages_by["damping"]
    assert track.recordings[-1].label == "severe"
    assert track.alarm.state in ("alert", "alarm")
    plain = track_recordings(
        series, TrackSettings(band_hz=(2e3, 4e3), method="likelihood"), x=PLACES
    )
    assert plain.stages is plain.stages_by["crf"]
    assert plain.alarm.state == "none"
    assert {one.label for one in plain.recordings} == {"none"}
    rows = dict(track.stage_rows())
    assert set(rows) == {
        "stage by CRF",
        "stage by damping (deciding)",
        "stage by CRF and damping",
    }


def test_json_has_every_way_and_which_decides(track):
    said = json.loads(json.dumps(track.scalars()))
    assert said["stages"]["source"] == "damping"
    assert list(said["stages_by"]) == ["crf", "damping", "both"]
    by_damping = said["stages_by"]["damping"]
    assert by_damping["split"] == said["stages"]["split"]
    assert by_damping["damping"][0] > 2.0 * by_damping["damping"][1] > by_damping["damping"][2]
    assert by_damping["slopes"] == [None, None]
    assert said["recordings"][0]["damping_reason"] == ""
    attribute = json.loads(track.to_dataset().attrs["track"])
    assert attribute["stages_by"]["both"]["kind"] == "severe"


def test_the_page_shows_each_way_and_the_damping_with_its_break(track):
    page = render_track_page(track)
    assert "Damping (decides)" in page
    assert "From damping alone: Severe wear from" in page
    assert "Damping decides stage and alarm" in page


def test_the_trend_has_a_drawing_of_its_own_for_telephones(track):
    found = re.search(
        r'<source media="([^"]*)" srcset="([^"]*)" width="(\d+)" height="\d+"><img ',
        render_track_page(track),
    )
    assert found[1] == "(max-width: 480px)"
    assert " " not in found[2]  # which ends an address in a srcset
    assert unquote(found[2]).startswith("data:image/svg+xml,<svg ")
    assert int(found[3]) < 480  # of a type that is drawn at its size, nearly


def test_a_method_without_a_width_determines_no_damping(series):
    track = track_recordings(
        series, TrackSettings(band_hz=(2e3, 4e3), method="peak", stages_from="both"), x=PLACES
    )
    assert {one.damping_reason for one in track.recordings} == {"the method peak fits no width"}
    assert track.stages.kind == "too few"
    assert track.verdict().startswith(
        "Cannot tell: no deciding indicator found in the last 3 recordings"
    )
    assert "Too few points: " in track.verdict()
    assert np.isnan([one.severe_probability for one in track.recordings]).all()
    assert track.alarm.state == "cannot-tell"
    assert any(
        "not determined for 12 of 12 resonances: the method peak" in note for note in track.notes
    )
    page = render_track_page(track)
    assert page.count("not determined</td>") >= 12
    assert "Damping of the contact resonance" not in page


@pytest.mark.parametrize(
    ("ratio", "said"),
    [
        (0.003, "less than 4 times the spectrum's resolution of 6.0 Hz"),
        (0.0005, "of the line was removed as tones"),
    ],
)
def test_a_line_as_narrow_as_the_spectrum_is_not_taken_for_damping(tmp_path, ratio, said):
    path = record(tmp_path / "narrow.npz", 1, ratio, seconds=2.0)  # 18 and 3 Hz wide
    one = track_recordings(
        [path], TrackSettings(band_hz=(2e3, 4e3), method="likelihood")
    ).recordings[0]
    assert one.resonance.found
    assert said in one.damping_reason
    assert one.row()["damping_ratio"] is None


def test_an_unknown_source_is_refused(series):
    with pytest.raises(BadInput, match="crf, damping, both, got 'width'"):
        track_recordings(series[:1], TrackSettings(band_hz=(2e3, 4e3), stages_from="width"))
