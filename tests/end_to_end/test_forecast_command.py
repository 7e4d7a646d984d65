"""When a limit is crossed, as a user asks for it: of `infer`, and of a series that is tracked or
watched.
"""

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

LIMIT = ("--forecast", "clr=0.75")
QUIET = Disturbance(snr_db=20.0, modes=2)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """Seven recordings of a contact whose roughness, and load share, rise steadily: too few for any
    other alarm.
    """
    folder = tmp_path_factory.mktemp("rig") / "rising"
    folder.mkdir()
    found = simulate_rig(
        RigSettings(samples=12, repeats=1, trend="smooth", duration_s=3.0, seed=4),
        disturbance=QUIET,
    )
    rows = ["file,hours,load_n,entrainment_m_s"]
    for number, one in enumerate(found.recordings[:7]):
        with h5py.File(folder / f"{number}.h5", "w") as file:
            data = file.create_dataset("acceleration", data=one.signal().values.astype(np.float32))
            data.attrs["fs_hz"], data.attrs["unit"] = one.rate_hz, "m/s^2"
        rows.append(f"{number}.h5,{10 * number},500,1.91")
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    return folder


@pytest.fixture
def asked(rig, small, tmp_path):
    """What all commands are given."""
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


def test_a_track_foretells_and_the_forecast_is_an_alarm(asp, asked):
    code, out, err = asp("track", *asked, *LIMIT, "--report", "track.html", "--json")
    said = json.loads(out)
    assert (code, err) == (3, "")
    assert said["forecast"]["alarm"] is True
    assert said["forecast"]["limit"] == {"key": "clr", "value": 0.75, "rising": True}
    assert said["alarm"]["raised_by"] == "forecast"
    assert said["alarm"]["since"].endswith("6.h5")
    assert said["verdict"].startswith("ALARM since 6.h5: CLR rises above 75.0 % within")
    page = Path("track.html").read_text("utf-8")
    assert "CLR rises above" in page
    assert (page.count('id="ahead"'), page.count("its forecast and the limit")) == (1, 1)
    code, out, _ = asp(
        "track", *asked, *LIMIT, "--acknowledge", "last", "--report", "silent.html", "--json"
    )
    said = json.loads(out)
    assert (code, said["alarm"]["state"]) == (0, "none")
    assert said["forecast"] == {
        "sentence": (
            "No forecast: a forecast needs resonances of at least 4 recordings at different "
            "times, got 0; leave --forecast out, or record again."
        )
    }
    assert said["verdict"].endswith(said["forecast"]["sentence"])
    page = Path("silent.html").read_text("utf-8")
    assert (page.count('id="ahead"'), page.count("its forecast and the limit")) == (
        1,
        0,
    )  # said, not drawn
    assert json.loads(asp("track", *asked[:-2], "--json")[1])["forecast"] is None


def test_a_watch_foretells_keeps_it_and_stops_when_somebody_has_looked(asp, asked):
    Path("call.py").write_text(
        "import sys; open('called.json', 'a').write(sys.stdin.read() + '\\n')\n"
    )
    command = (
        "watch",
        *asked,
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
    told = [json.loads(line) for line in Path("called.json").read_text().splitlines()]
    assert [(one["before"], one["state"]) for one in told] == [
        (None, "cannot-tell"),
        ("cannot-tell", "alarm"),
    ]
    code, out, _ = asp(*command)
    again = json.loads(out)
    assert (code, again["new"], again["forecast"]) == (3, [], first["forecast"])
    assert asp("store", "rising/asperity-watch/asperity.db", "--quiet")[0] == 3
    code, out, _ = asp(*command, "--acknowledge", "last")
    looked = json.loads(out)
    assert (code, looked["alarm"]["state"]) == (0, "none")
    assert looked["forecast"]["sentence"].startswith(
        "No forecast: a forecast needs resonances of at least 4"
    )


def test_infer_foretells_with_a_wear_history_and_a_measured_surface(asp, asked):
    code, out, _ = asp("infer", *asked, *LIMIT, "--report", "infer.html", "--json")
    said = json.loads(out)
    assert code == 3
    assert said["forecast"]["sentence"].startswith("CLR rises above 75.0 %")
    assert said["forecast"]["by"]["median"] >= said["forecast"]["time"]["low"]
    assert [len(point["files"]) for point in said["points"]] == [1]  # of the last recording
    assert any("within the last tenth of the series" in note for note in said["notes"])
    rough = 1.5e-6 * np.random.default_rng(1).standard_normal((48, 48))
    x3pio.write("ring.x3p", rough, x_scale=2e-6, y_scale=2e-6)
    known = json.loads(asp("infer", *asked, "--surface", "ring.x3p", "--json")[1])
    assert any(
        note.startswith("The prior of Sq is that of ring.x3p, 1.5") for note in known["notes"]
    )
    free = json.loads(asp("infer", *asked, "--json")[1])
    widths = [
        one["posterior"]["sq_m"]["high"] - one["posterior"]["sq_m"]["low"] for one in (known, free)
    ]
    assert widths[0] < 0.5 * widths[1]
    Path("wear.toml").write_text((CASE.parent / "wear.toml").read_text("utf-8"), "utf-8")
    coarse = (
        "--set",
        "grid.cells=[32, 16]",
        "--set",
        "surface.correlation_length='50 um'",
        "--workers",
        "1",
    )
    assert asp("wear", "wear.toml", "--hours", "1", "--out", "worn", *coarse)[0] == 0
    code, out, _ = asp("infer", *asked, *LIMIT, "--worn", "worn", "--json")
    expected = json.loads(out)["forecast"]
    assert code == 3
    assert expected["changes"] is True
    assert expected["log_odds"] != said["forecast"]["log_odds"]


@pytest.mark.parametrize(
    ("arguments", "said"),
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
@pytest.mark.usefixtures("asked")
def test_what_cannot_be_foretold_is_refused_before_anything_is_read(asp, arguments, said):
    code, out, err = asp(*arguments)
    assert (code, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
