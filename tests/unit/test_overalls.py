"""Overall values from a historian: formats, times, judgement, refusals."""

import json

import numpy as np
import pandas
import pytest

from asperity.core.errors import BadInput, UnreadableFile
from asperity.monitoring import read_overalls, track_overalls
from asperity.monitoring.overalls.row_levels import RowLevels
from asperity.trend import LevelMonitors, MonitoredSeries

COUNT = 300


def levels(factor=1.0, seed=1):
    values = np.exp(0.1 * np.random.default_rng(seed).standard_normal(COUNT))
    values[250:] *= factor
    return values


def stamps():
    return pandas.date_range("2025-01-03 04:00", periods=COUNT, freq="1h")


def text_table(path, values, heading="velocity [mm/s]", **more):
    table = pandas.DataFrame({"time": stamps(), heading: values, **more})
    table.to_csv(path, index=False)
    return path


# Reading
# ---------------------------------------------------------------------------------


def written(path, kind):
    table = pandas.DataFrame({"time": stamps(), "velocity [mm/s]": np.round(levels(), 4)})
    if kind == "csv":
        table.to_csv(path.with_suffix(".csv"), index=False)
        return path.with_suffix(".csv")
    if kind == "semicolons":
        table["time"] = table["time"].dt.strftime("%d.%m.%Y %H:%M")
        table.to_csv(path.with_suffix(".csv"), index=False, sep=";", decimal=",")
        return path.with_suffix(".csv")
    if kind == "parquet":
        table.set_index("time").to_parquet(path.with_suffix(".parquet"))
        return path.with_suffix(".parquet")
    ticks = {"s": 10**9, "ms": 10**6, "ns": 1}[kind]
    with path.with_suffix(".jsonl").open("w") as stream:
        for time, value in zip(table["time"], table["velocity [mm/s]"], strict=True):
            row = {"timestamp": time.value // ticks, "velocity [mm/s]": value}
            stream.write(json.dumps(row) + "\n")
    return path.with_suffix(".jsonl")


@pytest.mark.parametrize("kind", ["csv", "semicolons", "parquet", "s", "ms", "ns"])
def test_all_formats_hold_the_same_series(kind, tmp_path):
    overalls = read_overalls(written(tmp_path / "trend", kind))
    assert overalls.times[0] == "2025-01-03T04:00:00"
    assert overalls.x_unit == "h"
    assert np.allclose(overalls.x, np.arange(COUNT))
    assert overalls.units == {"velocity": "mm/s"}
    assert np.allclose(overalls.values["velocity"], np.round(levels(), 4))


def test_samples_in_json_lines_give_rms_and_kurtosis(tmp_path):
    samples = np.random.default_rng(3).standard_normal((40, 500)) + 5.0
    path = tmp_path / "loggers.jsonl"
    path.write_text(
        "\n".join(
            json.dumps({"time": 1.7e12 + 6e4 * number, "rate": 5e3, "unit": "g", "values": [*row]})
            for number, row in enumerate(samples)
        )
    )
    overalls = read_overalls(path)
    assert overalls.units == {"rms": "g", "kurtosis": ""}
    assert np.allclose(overalls.values["rms"], samples.std(axis=1))
    assert np.diff(overalls.x) == pytest.approx(1.0 / 60.0)


def test_order_of_day_and_month(tmp_path):
    path = tmp_path / "trend.csv"
    days = pandas.date_range("2025-01-01", periods=12, freq="D")
    for pattern, first in (("%d/%m/%Y", "day"), ("%m/%d/%Y", "month")):
        rows = [f"{day.strftime(pattern)},1.{number}" for number, day in enumerate(days)]
        path.write_text("\n".join(["date,rms", *rows]))
        overalls = read_overalls(path)
        assert overalls.times[-1] == "2025-01-12T00:00:00"
        assert f"with the {first} first" in overalls.notes[0]


def test_conditions_row_numbers_and_unsorted_rows(tmp_path):
    path = text_table(
        tmp_path / "t.csv", levels(), speed_hz=25.0 + 0 * levels(), id=np.arange(COUNT)
    )
    overalls = read_overalls(path)
    assert [*overalls.values] == ["velocity"]
    assert [*overalls.conditions] == ["speed_hz"]
    assert overalls.notes == ("Column id counts rows and is left out.",)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0], *lines[:0:-1]]))
    assert np.allclose(read_overalls(path).values["velocity"], overalls.values["velocity"])


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.csv", "a,b\n1,2\n3,4\n", "no column of times; name one of its columns time"),
        ("a.csv", "time,text\n2025-01-01,x\n2025-01-02,y\n", "no column of values beside time"),
        ("a.csv", "time,rms\n", "has no rows"),
        ("a.xlsx", "x", "a series is read from .csv"),
        ("a.jsonl", "[1, 2]\n", "line 1 holds no JSON object"),
        ("a.jsonl", '{"time": \n', "cannot be read as a table"),
        ("a.parquet", "no parquet", "cannot be read as a table"),
    ],
)
def test_unusable_tables_are_refused(name, content, message, tmp_path):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises((BadInput, UnreadableFile), match=message):
        read_overalls(path)


# Judgement
# ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("factor", "state"), [(1.0, "none"), (2.5, "alert"), (6.0, "alarm")])
def test_states_of_a_jump(factor, state, tmp_path):
    judged = track_overalls(text_table(tmp_path / "t.csv", levels(factor)))
    assert judged.state == state
    scalars = judged.scalars()
    assert scalars["level"]["state"] == state
    assert scalars["contact"] == {"state": "not-seen", "reason": "overall values have no spectrum"}
    assert [row["state"] for row in scalars["recordings"]] == [*judged.states]
    if state != "none":
        assert judged.states.index(state) == judged.since == 252
        assert judged.verdict().lower().startswith(f"{state} since 2025-01-13t16:00:00: velocity")


def test_acknowledged_rows_start_a_new_baseline(tmp_path):
    path = text_table(tmp_path / "t.csv", levels(6.0))
    assert track_overalls(path, acknowledge="last").state == "none"
    judged = track_overalls(path, acknowledge="2025-01-13 18:00:00")
    assert judged.state == "none"
    with pytest.raises(
        BadInput, match="acknowledge one of them, such as 2025-01-15T15:00:00, or 'last'"
    ):
        track_overalls(path, acknowledge="2025-01-13 18:30")


def test_the_zone_of_a_velocity_alarms(tmp_path):
    path = text_table(tmp_path / "t.csv", 2.0 * levels(3.0))
    assert track_overalls(path).state == "alert"
    (tmp_path / "t.csv.json").write_text('{"machine_class": "medium-rigid"}')
    judged = track_overalls(path)
    assert (judged.state, judged.raised_by, judged.since) == ("alarm", "zone", 251)
    assert judged.reason == "velocity is in zone D of ISO 20816-3"


def test_load_explains_a_level_if_it_is_stated(tmp_path):
    load = np.where(np.arange(COUNT) < 250, 500.0, 1500.0)
    values = levels() * (load / 500.0)
    assert track_overalls(text_table(tmp_path / "t.csv", values)).state == "alert"
    assert track_overalls(text_table(tmp_path / "t.csv", values, load_n=load)).state == "none"


def test_a_stuck_or_dead_sensor_is_blind(tmp_path):
    values = levels()
    values[-40:] = values[-40]
    judged = track_overalls(text_table(tmp_path / "t.csv", values))
    assert (judged.state, judged.scalars()["sensor"]["state"]) == ("blind", "blind")
    assert "velocity has not changed in the last 30 rows" in judged.verdict()
    values[-1] = 0.0
    assert "no value above 0" in track_overalls(text_table(tmp_path / "t.csv", values)).blind


def test_few_rows_cannot_be_judged(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("time,rms\n2025-01-01,1.0\n2025-01-02,1.1\n")
    judged = track_overalls(path)
    assert judged.state == "cannot-tell"
    assert judged.verdict().startswith("Cannot tell: baseline incomplete")


def test_rows_are_judged_as_by_all_monitors_with_reasons():
    rng = np.random.default_rng(7)
    values = {name: 0.3 * rng.standard_normal(COUNT) for name in "ab"}
    values["a"][200:240] += 1.1
    values["b"][rng.random(COUNT) < 0.3] = np.nan
    monitored = [
        MonitoredSeries(name=name, values=series, smallest_change=0.7, contact=False, describe=str)
        for name, series in values.items()
    ]
    rows, monitors = RowLevels(monitored, COUNT, 0), LevelMonitors(monitored, COUNT, 0)
    states = set()
    for number in range(COUNT):
        rows.add(number)
        monitors.add(number)
        states.add(rows.state)
        assert (rows.state, rows.complete) == (monitors.judgement().state, monitors.complete)
    assert states >= {"none", "alert"}
    assert rows.judgement() == monitors.judgement()
