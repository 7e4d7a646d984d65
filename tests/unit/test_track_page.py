"""What a track's page says to who must act: what changed, since when, how sure, what next; never
that it is certain.
"""

import re
from dataclasses import replace

import numpy as np
import pytest

from asperity.monitoring import TrackSettings, track_recordings
from asperity.report.style import ON_PAGE
from asperity.report.track.exhibits import levels, trend
from asperity.report.track.page import ACTIONS, render_track_page
from asperity.trend import ALARM_STATES

BAND = (2000.0, 4000.0)


@pytest.fixture(scope="module")
def failing(tmp_path_factory):
    """Snapshots of a machine whose level rises twenty times, an hour apart."""
    folder = tmp_path_factory.mktemp("in")
    levels = [*np.ones(12), *np.exp(np.log(20.0) * np.arange(24) / 23)]
    for number, level in enumerate(levels):
        values = level * np.random.default_rng(number).standard_normal(2000)
        name = f"2024.01.{1 + number // 24:02}.{number % 24:02}.00.00.npz"
        np.savez(folder / name, acc=values, fs=20e3, unit="m/s^2")
    return track_recordings([folder], TrackSettings(band_hz=BAND))


def acted(track):
    """The block for who must act, by its headings."""
    html = render_track_page(track)
    block = html.partition('<dl class="actions">')[2].partition("</dl>")[0]
    return dict(re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", block))


def test_who_must_act_reads_what_since_when_how_sure_and_what_next(failing):
    said = acted(failing)
    assert list(said) == ["Finding", "Since", "Last recording", "Severity", "Confidence", "Action"]
    assert re.fullmatch(
        r"The level \(rms\) rose to [\d.]+ times its baseline since [\d.]+ h\.", said["Finding"]
    )
    first = failing.recordings[failing.alarm.since]
    assert first.reading.started.replace("T", " ") in said["Since"]
    assert said["Last recording"].endswith("2024-01-02 11:00:00")
    assert "velocity not determined" in said["Severity"].lower()
    assert said["Confidence"] == "False-alarm rate: one in 1000 recordings."
    assert said["Action"].startswith("Find the source of the increase")


def test_levels_are_drawn_over_their_first_beside_the_least_that_alarms(failing):
    struck = [
        replace(
            one, reading=replace(one.reading, depths={"BPFO": 0.1 * 1.1**number, "BSF": np.nan})
        )
        for number, one in enumerate(failing.recordings)
    ]
    figure = levels(replace(failing, recordings=tuple(struck))).draw(ON_PAGE)
    drawn = {line.get_label(): np.asarray(line.get_ydata()) for line in figure.axes[0].get_lines()}
    assert set(drawn) == {"rms", "kurtosis", "envelope BPFO", "alarm threshold"}
    assert drawn["rms"][-1] == pytest.approx(20.0, rel=0.1)
    assert drawn["envelope BPFO"][-1] == pytest.approx(1.1**31.5, rel=0.01)
    assert drawn["kurtosis"] == pytest.approx(np.ones(36), abs=0.2)
    assert drawn["alarm threshold"][0] == pytest.approx(2.0)
    assert "Levels, bands and fault frequencies" in render_track_page(failing)
    assert levels(replace(failing, recordings=failing.recordings[:1])) is None


def test_a_crf_that_conditions_explain_is_drawn_without_them(failing):
    """Where it would be at the first load, speed and temperature, beside where it is."""
    moved = [
        replace(
            one,
            resonance=replace(one.resonance, found=True, crf_hz=3e3 + 10.0 * number, crf_std=5.0),
        )
        for number, one in enumerate(failing.recordings)
    ]
    resample_to_constant_speed = [replace(one, crf_reference_hz=3e3) for one in moved]
    track = replace(failing, recordings=tuple(resample_to_constant_speed))
    (shown,) = (
        line
        for line in trend(track).draw(ON_PAGE).axes[0].get_lines()
        if line.get_label() == "corrected to reference conditions"
    )
    assert np.asarray(shown.get_ydata()) == pytest.approx(np.full(35, 3e3))


@pytest.mark.parametrize("state", [state for state in ALARM_STATES if state != "alarm"])
def test_every_state_has_something_to_do(failing, state):
    said = acted(replace(failing, alarm=replace(failing.alarm, state=state, raised_by="")))
    assert said["Action"] == ACTIONS[state].replace("'", "&#39;")


@pytest.mark.parametrize(
    ("probability", "said"),
    [(1.0, "above 0.99"), (0.997, "above 0.99"), (0.42, "0.42"), (0.0, "below 0.01")],
)
def test_a_probability_is_never_certain(failing, probability, said):
    *others, last = failing.recordings
    found = replace(
        last,
        resonance=replace(last.resonance, found=True, crf_hz=3e3),
        severe_probability=probability,
    )
    html = render_track_page(replace(failing, recordings=(*others, found)))
    tile = re.search(r"Severe, last recording.*?</div>", html, re.S)[0]
    assert said in re.sub("<[^>]*>", "", tile)
    assert not re.search(r"\b1\.00\b|\b100 %", html)
