"""`asperity track --series`: verdict, JSON, exit codes, refusals."""

import json
from pathlib import Path

import numpy as np
import pytest


def trend(path, factor):
    values = np.exp(0.1 * np.random.default_rng(1).standard_normal(60))
    values[50:] *= factor
    rows = [
        f"2025-01-01T{number // 60:02}:{number % 60:02}:00,{value:.4f}"
        for number, value in enumerate(values)
    ]
    Path(path).write_text("\n".join(["time,rms [g]", *rows]))


@pytest.mark.parametrize(("factor", "code"), [(1.0, 0), (2.5, 0), (6.0, 3)])
def test_exit_codes_and_json(asp, factor, code):
    trend("trend.csv", factor)
    found, out, _ = asp("track", "--series", "trend.csv", "--json")
    result = json.loads(out)
    assert found == code
    assert {"verdict", "recordings", "alarm", "contact", "level", "sensor", "x"} <= {*result}
    assert {"state", "since", "factor", "reason"} == {*result["level"]}
    assert {"state", "since", "reason", "raised_by", "causes"} == {*result["alarm"]}
    assert result["level"]["factor"] == pytest.approx(factor, rel=0.2)
    assert len(result["recordings"]) == 60
    assert result["units"] == {"rms": "g"}


def test_table_and_file(asp):
    trend("trend.csv", 6.0)
    code, out, _ = asp("track", "--series", "trend.csv", "--out", "judged.csv")
    assert code == 3
    assert out.startswith("ALARM since 2025-01-01T00:52:00: rms rose to")
    assert "rms [g]" in out
    assert Path("judged.csv").read_text().count("\n") == 61


@pytest.mark.parametrize("stamp", ["2025-01-01T00:55", "2025-01-01", "2025-01-01 01:55+01:00"])
def test_a_stamp_is_acknowledged(asp, stamp):
    trend("trend.csv", 6.0)
    code, out, _ = asp("track", "--series", "trend.csv", "--acknowledge", stamp, "-q")
    assert code in (0, 4)
    assert out.startswith(("No alarm", "Cannot tell"))


def test_a_blind_sensor_beside_another_is_noted(asp):
    trend("trend.csv", 1.0)
    rows = Path("trend.csv").read_text().splitlines()
    spare = ["spare [g]", *(f"{1 + number % 7 / 7:.3f}" for number in range(59)), "0"]
    Path("trend.csv").write_text("\n".join(map(",".join, zip(rows, spare, strict=True))))
    code, out, _ = asp("track", "--series", "trend.csv", "--json")
    result = json.loads(out)
    assert code == 0
    assert result["alarm"]["state"] == "none"
    assert result["sensor"]["state"] == "blind"
    assert result["sensor"]["reason"] == "spare has no value above 0 in the last row"


def test_a_watch_of_a_table(asp):
    trend("trend.csv", 6.0)
    code, out, _ = asp("watch", "trend.csv", "--once")
    assert code == 3
    assert out.startswith("ALARM since 2025-01-01T00:52:00")
    assert asp("watch", "trend.csv", "--once", "--acknowledge", "last")[0] == 0
    assert asp("watch", "trend.csv", "--once")[0] == 0
    assert Path("asperity-watch/trend.csv.json").is_file()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["track"], "no recordings are given"),
        (["track", "x.csv", "--series", "trend.csv"], "got recordings too; leave one out"),
        (["track", "--series", "trend.csv", "--report", "r.html"], "got --report too"),
        (["track", "--series", "absent.csv"], "absent.csv"),
        (["track", "--series", "trend.csv", "--acknowledge", "noon"], "is not a time stamp"),
        (["track", "--series", "trend.csv", "--out", "judged.nc"], "saved as .csv"),
        *(
            (["track", "--series", "trend.csv", *option], f"{option[0]} does not apply to a table")
            for option in (
                ["--store", "a.db"],
                ["--unit", "g"],
                ["--scale", "2"],
                ["--table", "trend.csv"],
                ["--case", "case.toml"],
                ["--forecast", "clr=0.5"],
                ["--false-alarms", "0.01"],
                ["--rate", "5000"],
                ["--channel", "a"],
                ["--band", "1000", "2000"],
                ["--shaft", "25"],
                ["--method", "modes"],
                ["--stages-from", "damping"],
                ["--machine", "a"],
                ["--point", "a"],
                ["--sensor", "a"],
                ["--workers", "1"],
            )
        ),
        (["watch", "trend.csv", "--tree", "--once"], "--tree does not apply to a table"),
        (["watch", "trend.csv", "--keep", "90d", "--once"], "--keep does not apply to a table"),
        (["watch", "trend.csv", "--rate", "50", "--once"], "--rate does not apply to a table"),
    ],
)
def test_refusals(asp, arguments, message):
    trend("trend.csv", 1.0)
    code, _, err = asp(*arguments)
    assert code == 2
    assert message in err
