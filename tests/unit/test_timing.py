"""Sampling rates and gaps from columns of times with few digits."""

from functools import partial

import numpy as np
import pytest

from asperity.core.errors import UnreadableFile
from asperity.recording import open_recording
from asperity.recording import text as text_reader
from asperity.recording.timing import GapFiller, fit_clock, rate_from_times

RATES = (2560, 8192, 10_240, 12_800, 20_000, 25_600, 44_100, 48_000, 51_200)


@pytest.mark.parametrize("digits", [5, 6, 9])
@pytest.mark.parametrize("rate", RATES)
def test_the_rate_is_estimated_from_the_slope_of_all_times(rate, digits):
    times = np.round(3.0 + np.arange(rate) / rate, digits)
    complete = rate_from_times("t", "s", times)
    assert complete["rate_hz"] == rate
    assert complete["rate_doubt"] < 2.5e-5
    assert rate_from_times("t", "s", np.delete(times, slice(1000, 1400)))["rate_hz"] == rate


def test_an_unusual_rate_is_estimated_to_the_precision_of_its_times():
    times = np.round(np.arange(6000) / 11_937.4, 5)  # half a second
    estimate = rate_from_times("t", "s", times)
    assert abs(estimate["rate_hz"] / 11_937.4 - 1.0) < estimate["rate_doubt"] < 4e-5


def test_gaps_are_detected_in_coarse_times():
    times = np.round(np.arange(44_100) / 44_100.0, 5)
    present = np.delete(np.arange(44_100), np.r_[500:501, 20_000:23_000])
    filler = GapFiller(fit_clock(times[present]))
    complete = np.concatenate(
        [filler.fill(times[part], part.astype(float)) for part in np.array_split(present, 7)]
    )
    assert complete.size == 44_100
    assert np.flatnonzero(np.isnan(complete)).tolist() == [500, *range(20_000, 23_000)]
    assert np.array_equal(complete[~np.isnan(complete)], present)
    assert filler.note == "2 gaps in its times: 3001 samples are missing"
    without_gaps = GapFiller(fit_clock(times))
    assert without_gaps.fill(times, times).size == 44_100
    assert without_gaps.note == ""


def test_times_with_a_dominant_gap_are_refused():
    times = np.concatenate([np.arange(100.0), 1e9 + np.arange(100.0)])
    with pytest.raises(UnreadableFile, match="split the recording"):
        GapFiller(fit_clock(np.arange(200.0))).fill(times, times)


def rows(rate, gap):
    number = np.delete(np.arange(3 * rate), slice(*gap)) if gap else np.arange(3 * rate)
    times = np.round(number / rate, 5)
    return times, np.random.default_rng(1).standard_normal(times.size)


def csv(path, times, values):
    path.write_text(
        "time [s],acc [m/s^2]\n"
        + "".join(f"{t:.5f},{v:.6f}\n" for t, v in zip(times, values, strict=True))
    )
    return path


def parquet(path, times, values, dates=False):
    import pandas

    column = pandas.to_datetime(times, unit="s", origin="2026-10-25") if dates else times
    pandas.DataFrame({"time" if dates else "time [s]": column, "acc [m/s^2]": values}).to_parquet(
        path
    )
    return path


@pytest.mark.parametrize(
    "write", [csv, parquet, partial(parquet, dates=True)], ids=["csv", "parquet", "dates"]
)
@pytest.mark.parametrize("large", [False, True])
def test_a_gap_is_detected_in_every_format_with_times(tmp_path, monkeypatch, write, large):
    if large:
        monkeypatch.setattr(text_reader, "_LARGE", 1000)
        monkeypatch.setattr(text_reader, "_CHUNK", 40_000)
    complete = rows(12_800, None)
    holed = rows(12_800, (9000, 9400))
    for name, (times, values), missing in (("a", complete, 0), ("b", holed, 400)):
        opened = open_recording(write(tmp_path / f"{name}.dat", times, values))
        assert opened.rate_hz == 12_800
        read = opened.read()
        assert read.values.size == 38_400
        assert int(np.isnan(read.values).sum()) == missing
        assert np.allclose(read.values[~np.isnan(read.values)], values, atol=1e-6)
        assert any(
            "1 gap in its times: 400 samples are missing" in note for note in read.notes
        ) == (missing > 0)


def test_the_uncertainty_of_the_rate_is_propagated_to_crf():
    from dataclasses import replace

    from asperity.monitoring.judgement import judge
    from asperity.monitoring.reading import Reading
    from asperity.monitoring.target import search_target
    from asperity.paper import RigSettings, simulate_rig

    rig = simulate_rig(RigSettings(samples=6, repeats=1, duration_s=10.0))
    exact = [
        Reading(file=f"{k}", spectrum=recording.spectrum(20_000), rate_hz=20e3, unit="m/s^2")
        for k, recording in enumerate(rig.recordings)
    ]
    target = search_target(None, rig.band_hz)
    known, uncertain = (
        judge([replace(reading, rate_doubt=doubt) for reading in exact], target)
        .recordings[0]
        .resonance
        for doubt in (0.0, 0.01)
    )
    assert known.found
    assert uncertain.crf_std == pytest.approx(np.hypot(known.crf_std, 0.01 * known.crf_hz))
    assert uncertain.crf_shared_std == pytest.approx(
        np.hypot(known.crf_shared_std, 0.01 * known.crf_hz)
    )
    assert known.crf_shared_std <= known.crf_std
