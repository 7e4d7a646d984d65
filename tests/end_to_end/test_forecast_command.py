"""Forecasts of limit crossings by `infer`, `track` and `watch`."""

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import x3pio

from asperity.case import load_case
from asperity.paper import Disturbance, RigSettings, simulate_rig
from support.emulated import CASE, SMALL

pytestmark = pytest.mark.usefixtures("coarse_search", "blank_figures")

LIMIT = ("--forecast", "clr=0.6")
QUIET = Disturbance(snr_db=20.0, modes=2)


@pytest.fixture(autouse=True)
def few_draws(monkeypatch):
    """Sample forecasts until they are rough, in a quarter of the draws."""
    monkeypatch.setattr("asperity.inference.forecast.ENOUGH", 100.0)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """Write seven recordings with steadily rising roughness and load share, too few for other
    alarms.
    """
    folder = tmp_path_factory.mktemp("rig") / "rising"
    folder.mkdir()
    simulated = simulate_rig(
        RigSettings(samples=12, repeats=1, trend="smooth", duration_s=3.0, seed=4),
        disturbance=QUIET,
    )
    rows = ["file,hours,load_n,entrainment_m_s"]
    for number, recording in enumerate(simulated.recordings[:7]):
        with h5py.File(folder / f"{number}.h5", "w") as file:
            data = file.create_dataset(
                "acceleration", data=recording.signal().values.astype(np.float32)
            )
            data.attrs["fs_hz"], data.attrs["unit"] = recording.rate_hz, "m/s^2"
        rows.append(f"{number}.h5,{10 * number},500,1.91")
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    return folder


@pytest.fixture
def series(rig, small, tmp_path):
    """Return the arguments that all commands share."""
    shutil.copytree(rig, tmp_path / "rising")
    (tmp_path / "infer.toml").write_text(load_case(CASE).with_overrides(SMALL).text, "utf-8")
    return (
        "rising",
        "--table",
        "rising/table.csv",
        "--case",
        "infer.toml",
        "--emulator",
        str(small[2]),
    )


def test_track_forecasts_a_crossing_and_raises_an_alarm(asp, series):
    code, out, err = asp("track", *series, *LIMIT, "--report", "track.html", "--json")
    result = json.loads(out)
    assert (code, err) == (3, "")
    assert result["forecast"]["alarm"] is True
    assert result["forecast"]["limit"] == {"key": "clr", "value": 0.6, "rising": True}
    assert result["alarm"]["raised_by"] == "forecast"
    assert result["alarm"]["since"].endswith("6.h5")
    assert result["verdict"].startswith("ALARM since 6.h5: CLR rises above 60.0 % within")
    page = Path("track.html").read_text("utf-8")
    assert "CLR rises above" in page
    assert (page.count('id="ahead"'), page.count("its forecast and the limit")) == (1, 1)
    code, out, _ = asp(
        "track",
        *series,
        *LIMIT,
        "--acknowledge",
        "last",
        "--report",
        "silent.html",
        "--json",
    )
    result = json.loads(out)
    assert (code, result["alarm"]["state"]) == (0, "none")
    assert result["forecast"] == {
        "sentence": (
            "No forecast: a forecast needs resonances of at least 4 recordings at different "
            "times, got 0; leave --forecast out, or record again."
        )
    }
    assert result["verdict"].endswith(result["forecast"]["sentence"])
    page = Path("silent.html").read_text("utf-8")
    assert (page.count('id="ahead"'), page.count("its forecast and the limit")) == (
        1,
        0,
    )  # stated in words, not drawn
    assert json.loads(asp("track", *series[:-2], "--json")[1])["forecast"] is None


def test_watch_forecasts_keeps_the_alarm_and_stops_after_acknowledgement(asp, series):
    Path("call.py").write_text(
        "import sys; open('called.json', 'a').write(sys.stdin.read() + '\\n')\n"
    )
    command = (
        "watch",
        *series,
        *LIMIT,
        "--once",
        "--settle",
        "0",
        "--json",
        "--on-alarm",
        "python call.py",
    )
    code, out, _ = asp(*command)
    first = json.loads(out)
    assert (code, first["alarm"]["raised_by"], len(first["new"])) == (3, "forecast", 7)
    assert first["forecast"]["sentence"].rstrip(".") == first["alarm"]["reason"]
    notifications = [json.loads(line) for line in Path("called.json").read_text().splitlines()]
    assert [(event["before"], event["state"]) for event in notifications] == [
        (None, "cannot-tell"),
        ("cannot-tell", "alarm"),
    ]
    code, out, _ = asp(*command)
    again = json.loads(out)
    assert (code, again["new"], again["forecast"]) == (3, [], first["forecast"])
    assert asp("store", "rising/asperity-watch/asperity.db", "--quiet")[0] == 3
    code, out, _ = asp(*command, "--acknowledge", "last")
    acknowledged = json.loads(out)
    assert (code, acknowledged["alarm"]["state"]) == (0, "none")
    assert acknowledged["forecast"]["sentence"].startswith(
        "No forecast: a forecast needs resonances of at least 4"
    )


def test_infer_forecasts_with_a_wear_history_and_a_measured_surface(asp, series):
    code, out, _ = asp("infer", *series, *LIMIT, "--report", "infer.html", "--json")
    result = json.loads(out)
    assert code == 3
    assert result["forecast"]["sentence"].startswith("CLR rises above 60.0 %")
    assert result["forecast"]["by"]["median"] >= result["forecast"]["time"]["low"]
    assert [len(point["files"]) for point in result["points"]] == [1]  # of the last recording
    assert any("within the last tenth of the series" in note for note in result["notes"])
    rough = 1.5e-6 * np.random.default_rng(1).standard_normal((48, 48))
    x3pio.write("ring.x3p", rough, x_scale=2e-6, y_scale=2e-6)
    known = json.loads(asp("infer", *series, "--surface", "ring.x3p", "--json")[1])
    assert any(
        note.startswith("The prior of Sq is that of ring.x3p, 1.5") for note in known["notes"]
    )
    free = json.loads(asp("infer", *series, "--json")[1])
    widths = [
        run["posterior"]["sq_m"]["high"] - run["posterior"]["sq_m"]["low"] for run in (known, free)
    ]
    assert widths[0] < 0.5 * widths[1]
    Path("wear.toml").write_text((CASE.parent / "wear.toml").read_text("utf-8"), "utf-8")
    coarse = (
        "--set",
        "grid.cells=[32, 16]",
        "--set",
        "surface.correlation_length='50 um'",
        "--set",
        "wear.patches=2",
        "--workers",
        "1",
    )
    assert asp("wear", "wear.toml", "--hours", "1", "--out", "worn", "--snapshot", *coarse)[0] == 0
    code, out, _ = asp("infer", *series, *LIMIT, "--worn", "worn", "--json")
    expected = json.loads(out)["forecast"]
    assert code == 3
    assert expected["changes"] is True
    assert expected["log_odds"] != result["forecast"]["log_odds"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("track", "rising", *LIMIT), "--forecast needs a contact; give --case"),
        (("track", "rising", "--worn", "d"), "add --forecast"),
        (
            ("watch", "rising", "--emulator", "d"),
            "--emulator is used for forecasts; add --forecast",
        ),
        (
            ("watch", "rising", "--case", "infer.toml", "--forecast", "clr=2"),
            "must lie between 0 and 1",
        ),
        (
            (
                "track",
                "rising",
                "--case",
                "infer.toml",
                "--forecast",
                "hardness=1.5 GPa",
                "--worn",
                "d",
            ),
            "hardness",
        ),
    ],
)
@pytest.mark.usefixtures("series")
def test_impossible_forecasts_are_refused_before_reading(asp, arguments, message):
    code, out, err = asp(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
