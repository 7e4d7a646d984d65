"""Level rule: persistence, chance, baseline, memory, and equal states however files arrive."""

import json

import numpy as np
import pytest

from asperity.monitoring import TrackSettings, WatchSettings, track_recordings, watch_folder
from asperity.trend import LevelMonitor, LevelMonitors, MonitoredSeries

QUIET = 0.1  # scatter of the logarithmic level


def noise(seed, count, scatter=QUIET):
    return scatter * np.random.default_rng(seed).standard_normal(count)


def states(levels):
    monitor = LevelMonitor()
    return [monitor.update(float(level)).state for level in levels]


def series(values, name="rms"):
    return MonitoredSeries(
        name=name,
        values=np.asarray(values, dtype=float),
        smallest_change=np.log(2.0),
        contact=False,
        describe=lambda by: f"rose to {np.exp(by):.3g} times its baseline",
    )


@pytest.mark.parametrize(
    ("factor", "state", "delay"),
    [(1.5, None, None), (2.5, "alert", 3), (5.0, "alarm", 3), (20.0, "alarm", 2)],
)
@pytest.mark.parametrize("healthy", [300, 1000])
def test_a_jump_that_stays_is_reported_after_two_or_three_recordings(factor, state, delay, healthy):
    levels = noise(1, healthy + 10)
    levels[healthy:] += np.log(factor)
    found = states(levels)
    if state is None:
        assert set(found) == {"none"}
    else:
        assert found.index(state) == healthy + delay - 1


@pytest.mark.parametrize("growth", [1.002, 1.01, 1.1])
def test_slow_growth_is_reported_at_its_factor(growth):
    """Growth below 1 % a recording raised no alarm at any factor before."""
    count = 300 + int(np.log(10.0) / np.log(growth))
    levels = noise(2, count) + np.maximum(np.arange(count) - 300, 0) * np.log(growth)
    found = states(levels)
    for state, factor in (("alert", 2.0), ("alarm", 4.0)):
        level = levels[found.index(state)]
        assert 0.8 * factor < np.exp(level) < 1.6 * factor


def test_single_outliers_raise_nothing_and_lasting_bursts_do():
    levels = noise(3, 600)
    levels[50:600:20] += np.log(20.0)
    assert set(states(levels)) == {"none"}
    levels[400::3] += np.log(20.0)
    assert states(levels)[-1] == "alarm"


def test_frequent_outliers_require_longer_runs():
    """A run of three is chance where every tenth recording is an outlier."""
    levels = noise(4, 500)
    levels[np.random.default_rng(5).random(500) < 0.1] += np.log(6.0)
    assert "alarm" not in states(levels)


def test_the_baseline_settles_with_the_level_and_does_not_grow_with_it():
    run_in = np.log(6.0) * np.exp(-np.arange(400) / 40.0) + noise(6, 400)
    grown = np.concatenate([run_in, run_in[-1] + np.log(5.0) + noise(7, 5)])
    found = states(grown)
    assert "alarm" not in found[:400]
    assert found[402] == "alarm"
    slow = np.log(4.0) * np.arange(3000) / 2500.0 + noise(8, 3000)
    assert states(slow)[-1] == "alarm"


def test_an_alert_needs_more_than_the_scatter_of_the_level():
    daily = 0.55 * np.sin(2.0 * np.pi * np.arange(1500) / 144.0) + noise(9, 1500)
    assert "alarm" not in states(daily)
    assert "alert" not in states(daily[400:])[200:]  # learned from the first cycle


@pytest.mark.parametrize("factor", [2.3, 3.0])
@pytest.mark.parametrize("healthy", [12, 20, 60])
def test_an_alert_stands_while_the_level_does(factor, healthy):
    """Raised values enter neither baseline nor scatter, also of a fault after few recordings."""
    levels = noise(21, healthy + 400)
    levels[healthy:] += np.log(factor)
    monitor = LevelMonitor()
    found = [monitor.update(float(level)).state for level in levels]
    assert found[healthy + 4 :] == ["alert"] * (len(levels) - healthy - 4)
    assert np.exp(monitor.rise) == pytest.approx(factor, rel=0.25)


def test_an_explained_rise_does_not_alarm_when_it_has_ended():
    levels = noise(22, 80)
    levels[30:36] += np.log(5.0)
    monitor = LevelMonitor()
    found = []
    for level in levels:
        found.append(monitor.update(float(level)).state)
        if found[-1] != "none" and len(found) < 45:
            monitor.withhold()
    assert set(found[45:]) == {"none"}


def test_an_alert_ends_when_the_level_returns_and_an_alarm_does_not():
    levels = noise(10, 120)
    levels[60:70] += np.log(3.0)
    found = states(levels)
    assert found[64] == "alert"
    assert found[-1] == "none"
    levels[60:70] += np.log(3.0)
    assert states(levels)[-1] == "alarm"


def test_missing_values_change_nothing():
    levels = noise(11, 60)
    levels[40:] += np.log(5.0)
    gaps = np.insert(levels, [10, 41, 42], np.nan)
    monitor = LevelMonitor()
    found = [monitor.update(float(level)).state for level in gaps]
    assert [state for state, level in zip(found, gaps, strict=True) if np.isfinite(level)] == (
        states(levels)
    )


def test_a_stored_memory_continues_as_if_never_interrupted():
    levels = noise(12, 300)
    levels[200:] += np.log(2.5) * (np.arange(100) > 20)
    monitor, stored = LevelMonitor(), LevelMonitor()
    for level in levels:
        stored = LevelMonitor.from_json(json.loads(json.dumps(stored.to_json())))
        assert monitor.update(float(level)) == stored.update(float(level))
    assert monitor == stored


def test_the_most_severe_level_is_reported_with_its_factor():
    quiet, loud = noise(13, 60), noise(14, 60)
    loud[50:] += np.log(5.0)
    levels = LevelMonitors([series(quiet, "band"), series(loud)], 60, 0)
    for number in range(60):
        levels.add(number)
    judgement = levels.judgement()
    assert (judgement.state, judgement.name) == ("alarm", "rms")
    assert judgement.factor == pytest.approx(5.0, rel=0.2)
    assert judgement.reason == (
        f"rms rose to {judgement.factor:.3g} times its baseline, in 3 successive recordings"
    )


# The same states, however recordings arrive
# ---------------------------------------------------------------------------------


def write(folder, levels, first=0):
    folder.mkdir(exist_ok=True)
    for number, level in enumerate(levels, first):
        values = level * np.random.default_rng(number).standard_normal(1000)
        np.savez(folder / f"s-{number:04}.npz", acc=values, fs=20e3, unit="m/s^2")


def watched(folder, out):
    settings = WatchSettings(once=True, settle_time_s=0.0)
    *_, last = watch_folder(folder, out, TrackSettings(), settings)
    return last.track


def summary(track):
    scalars = track.scalars()
    since = scalars["alarm"]["since"]
    return [
        *(scalars[name]["state"] for name in ("alarm", "contact", "level", "sensor")),
        since and since[-10:],
    ]


@pytest.mark.parametrize("growth", ["none", "jump", "slow"])
def test_states_do_not_depend_on_how_the_recordings_arrive(growth, tmp_path):
    """One by one (resumed each time), in batches, at once, and by `track`."""
    count = 150
    levels = np.exp(noise(15, count, 0.05))
    if growth == "jump":
        levels[130:] *= 6.0
    elif growth == "slow":
        levels *= np.exp(np.maximum(np.arange(count) - 60, 0) * np.log(12.0) / 90.0)
    expected = None
    arrivals = {
        "singly": [30, 31, 129, *range(130, 135), count],
        "batches": [*range(20, count, 20), count],
        "at once": [count],
    }
    for name, ends in arrivals.items():
        for first, end in zip([0, *ends], ends, strict=False):
            write(tmp_path / name, levels[first:end], first)
            track = watched(tmp_path / name, tmp_path / f"{name} out")
        found = summary(track)
        expected = expected or found
        assert found == expected, name
    assert summary(track_recordings([tmp_path / "at once"])) == expected
    assert expected[0] == ("none" if growth == "none" else "alarm")


def test_an_old_acknowledgement_keeps_the_baseline_of_its_recordings(tmp_path):
    """A watch that judges the first and latest recordings only, after a step in between."""
    levels = np.exp(noise(31, 200, 0.05))
    levels[60:] *= 2.6
    write(tmp_path / "in", levels)
    settings = WatchSettings(once=True, settle_time_s=0.0)
    for acknowledge in (None, "s-0020.npz"):
        chosen = TrackSettings(acknowledge=acknowledge)
        *_, last = watch_folder(tmp_path / "in", tmp_path / "out", chosen, settings)
        assert last.track.alarm.state == "alert"
        assert last.track.alarm.level.factor == pytest.approx(2.6, rel=0.15)
