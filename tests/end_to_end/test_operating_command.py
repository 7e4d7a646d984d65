"""`asperity track` and `watch` with load, speed or oil temperature given for the recordings."""

import json
from pathlib import Path

import numpy as np

MANY = 24


def write_recordings(folder, loads, sidecar=False):
    """Write noise of 0.1 s whose level follows load; the load is in a table or in sidecars."""
    Path(folder).mkdir()
    rows = ["file,load_n,temperature_degc"]
    for number, load in enumerate(loads):
        rng = np.random.default_rng(number)
        name = f"s-{number:03}.npz"
        values = (load / 500.0) * rng.standard_normal(2000)
        np.savez(Path(folder) / name, acc=values, fs=20e3, unit="m/s^2")
        rows.append(f"{name},{load:g},{60 + number % 2}")
        if sidecar:
            Path(folder, f"{name}.toml").write_text(
                f"load_n = {load:g}\ntemperature_degc = {60 + number % 2}\n"
            )
    Path(f"{folder}.csv").write_text("\n".join(rows))


def test_a_stated_load_explains_a_step_in_level(asp):
    loads = [500.0] * 12 + [1200.0] * 12
    write_recordings("in", loads)
    unknown = json.loads(asp("track", "in", "--json")[1])
    code, out, _ = asp("track", "in", "--table", "in.csv", "--json")
    given = json.loads(out)
    assert "the level (rms) rose to" in unknown["alarm"]["reason"]
    assert unknown["alarm"]["explained"] is None
    assert code == 0  # without a resonance, but with a level
    assert given["contact"]["state"] == "not-seen"
    assert "and has stayed there" not in given["alarm"]["reason"]
    assert "load from 500 to 1200 N explains it" in given["alarm"]["explained"]
    assert given["alarm"]["explained"] in given["verdict"].replace("The level", "the level")
    assert [row["load_n"] for row in given["recordings"]] == loads
    assert given["recordings"][1]["temperature_degc"] == 61.0
    write_recordings("beside", loads, sidecar=True)
    beside = json.loads(asp("track", "beside", "--json")[1])
    assert beside["alarm"]["explained"] == given["alarm"]["explained"]


def test_watch_reads_loads_from_a_growing_table(asp):
    write_recordings("in", [500.0] * 12 + [1200.0] * 12)
    code, out, _ = asp("watch", "in", "--table", "in.csv", "--once", "--settle", "0", "--json")
    result = json.loads(out)
    assert code == 0
    assert "load from 500 to 1200 N explains it" in result["alarm"]["explained"]


def test_a_load_with_another_name_or_unit_is_refused(asp):
    write_recordings("in", [500.0] * 2)
    Path("kilo.csv").write_text("file,x,load_kn\ns-000.npz,1,0.5\ns-001.npz,2,0.5\n")
    code, _, err = asp("track", "in", "--table", "kilo.csv")
    assert code == 2
    assert "has a column load_kn; use load_n with that unit" in err
    for name, meant in (
        ("speed_rpm", "speed_hz or entrainment_m_s"),
        ("oil_temperature", "temperature_degc"),
    ):
        Path("other.csv").write_text(f"file,{name}\ns-000.npz,1500\ns-001.npz,1500\n")
        code, _, err = asp("track", "in", "--table", "other.csv")
        assert code == 2
        assert f"has a column {name}; use {meant} with that unit" in err
