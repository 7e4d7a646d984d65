"""Page of a track: it states the finding, its start, the confidence and the action, and reports no
result as certain.
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
    """Hourly snapshots of a machine whose level rises to 20 times its baseline."""
    folder = tmp_path_factory.mktemp("in")
    levels = [*np.ones(12), *np.exp(np.log(20.0) * np.arange(24) / 23)]
    for number, level in enumerate(levels):
        values = level * np.random.default_rng(number).standard_normal(2000)
        name = f"2024.01.{1 + number // 24:02}.{number % 24:02}.00.00.npz"
        np.savez(folder / name, acc=values, fs=20e3, unit="m/s^2")
    return track_recordings([folder], TrackSettings(band_hz=BAND))


def action_block(track):
    """Entries of the page's block of actions by their headings."""
    html = render_track_page(track)
    block = html.partition('<dl class="actions">')[2].partition("</dl>")[0]
    return dict(re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", block))


def test_the_action_block_states_finding_start_confidence_and_action(failing):
    entries = action_block(failing)
    assert list(entries) == [
        "Finding",
        "Since",
        "Last recording",
        "Severity",
        "Confidence",
        "Action",
    ]
    assert re.fullmatch(
        r"The level \(rms\) rose to [\d.]+ times its baseline since [\d.]+ h\.",
        entries["Finding"],
    )
    first = failing.recordings[failing.alarm.since]
    assert first.reading.started.replace("T", " ") in entries["Since"]
    assert entries["Last recording"].endswith("2024-01-02 11:00:00")
    assert "velocity not determined" in entries["Severity"].lower()
    assert entries["Confidence"] == "False-alarm rate: one in 1000 recordings."
    assert entries["Action"].startswith("Find the source of the increase")


LASTING = "alert, if it lasts", "alarm, if it lasts"


def test_levels_are_drawn_relative_to_the_first_with_the_alarm_threshold(failing):
    with_fault = [
        replace(
            recording,
            reading=replace(recording.reading, depths={"BPFO": 0.1 * 1.1**number, "BSF": np.nan}),
        )
        for number, recording in enumerate(failing.recordings)
    ]
    figure = levels(replace(failing, recordings=tuple(with_fault))).draw(ON_PAGE)
    drawn = {line.get_label(): np.asarray(line.get_ydata()) for line in figure.axes[0].get_lines()}
    assert set(drawn) == {"rms", "kurtosis", "envelope BPFO", *LASTING}
    assert drawn["rms"][-1] == pytest.approx(20.0, rel=0.1)
    assert drawn["envelope BPFO"][-1] == pytest.approx(1.1**31.5, rel=0.01)
    assert drawn["kurtosis"] == pytest.approx(np.ones(36), abs=0.2)
    assert [drawn[label][0] for label in LASTING] == [2.0, 4.0]
    assert "Levels, bands and fault frequencies" in render_track_page(failing)
    assert levels(replace(failing, recordings=failing.recordings[:1])) is None


def test_a_crf_corrected_to_reference_conditions_is_drawn(failing):
    """The page shows CRF at the first load, speed and temperature beside the measured CRF."""
    moved = [
        replace(
            recording,
            resonance=replace(
                recording.resonance, found=True, crf_hz=3e3 + 10.0 * number, crf_std=5.0
            ),
        )
        for number, recording in enumerate(failing.recordings)
    ]
    corrected = [replace(recording, crf_reference_hz=3e3) for recording in moved]
    track = replace(failing, recordings=tuple(corrected))
    (shown,) = (
        line
        for line in trend(track).draw(ON_PAGE).axes[0].get_lines()
        if line.get_label() == "corrected to reference conditions"
    )
    assert np.asarray(shown.get_ydata()) == pytest.approx(np.full(35, 3e3))


@pytest.mark.parametrize("state", [state for state in ALARM_STATES if state != "alarm"])
def test_every_state_has_an_action(failing, state):
    entries = action_block(
        replace(failing, alarm=replace(failing.alarm, state=state, raised_by=""))
    )
    assert entries["Action"] == ACTIONS[state].replace("'", "&#39;")


@pytest.mark.parametrize(
    ("probability", "shown_text"),
    [(1.0, "above 0.99"), (0.997, "above 0.99"), (0.42, "0.42"), (0.0, "below 0.01")],
)
def test_a_probability_is_never_shown_as_certain(failing, probability, shown_text):
    *others, last = failing.recordings
    detected = replace(
        last,
        resonance=replace(last.resonance, found=True, crf_hz=3e3),
        severe_probability=probability,
    )
    html = render_track_page(replace(failing, recordings=(*others, detected)))
    tile = re.search(r"Severe, last recording.*?</div>", html, re.S)[0]
    assert shown_text in re.sub("<[^>]*>", "", tile)
    assert not re.search(r"\b1\.00\b|\b100 %", html)
