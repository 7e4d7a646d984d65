"""`asperity check`, `track` and `watch` on the simulated rig."""

import json
import re
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from asperity.paper import Disturbance, RigSettings, simulate_rig

pytestmark = pytest.mark.usefixtures("coarse_search")

KEYS = {"file", "x", "crf_hz", "crf_std_hz", "crfa", "found", "reason"}  # documented in design.md


def write_rig(folder, trend, **shape):
    """Write recordings of the rig as HDF5 and their roughness; return the true CRF by file."""
    rig = simulate_rig(
        RigSettings(trend=trend, duration_s=3.0, seed=4, **shape),
        disturbance=Disturbance(snr_db=15.0),
    )
    folder.mkdir()
    rows, truth = ["file,sq_um,sq_um_std,load_n"], {}
    for recording in rig.recordings:
        name = f"{recording.name}.h5"
        with h5py.File(folder / name, "w") as file:
            data = file.create_dataset(
                "acceleration", data=recording.signal().values.astype(np.float32)
            )
            data.attrs["fs_hz"], data.attrs["unit"] = recording.rate_hz, "m/s^2"
        rows.append(
            f"{name},{1e6 * recording.sq_m:.4f},{1e6 * recording.sq_std_m:.4f},{rig.load_n:g}"
        )
        truth[name] = recording.crf_hz
    (folder / "table.csv").write_text("\n".join(rows) + "\n")
    return truth


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig") / "knee"
    return folder, write_rig(folder, "knee", repeats=2)


@pytest.mark.usefixtures("blank_figures")
def test_track_names_the_stage_and_raises_the_alarm(asp, rig):
    folder, truth = rig
    code, out, err = asp(
        "track",
        str(folder),
        "--table",
        str(folder / "table.csv"),
        "--case",
        "case.toml",
        "--report",
        "page.html",
        "--out",
        "t.csv",
        "--out",
        "t.nc",
        "--out",
        "t.parquet",
        "--figures",
        "figures",
        "--json",
    )
    result = json.loads(out)
    assert (code, err) == (3, "")
    assert result["verdict"].startswith("ALARM since sample-")
    assert len(result["recordings"]) == len(truth) == 24
    for row in result["recordings"]:
        assert set(row) >= KEYS
        assert row["crf_hz"] == pytest.approx(truth[Path(row["file"]).name], abs=50.0)
        assert row["clr_low"] < row["clr"] < row["clr_high"]
    assert (result["stages"]["source"], result["stages"]["kind"]) == ("crf", "severe")
    assert result["stages_by"]["damping"]["kind"] == "no change"
    assert (
        result["stages"]["interval"][0]
        < result["stages"]["split"]
        < result["stages"]["interval"][1]
    )
    assert len(result["stages"]["probability"]) == len(result["stages"]["labels"]) == 24
    assert result["method"] == "joint"
    assert [row["x"] for row in result["recordings"]] == sorted(
        row["x"] for row in result["recordings"]
    )
    assert Path("t.csv").read_text().count("\n") == 25
    assert {"trend-85mm.pdf", "trend-175mm.pdf", "captions.md"} < {
        path.name for path in Path("figures").iterdir()
    }
    page = Path("page.html").read_text("utf-8")
    assert page.index("ALARM") < page.index("Trend and stage") < page.index('id="limits"')
    assert re.findall(r'(?:src|href)="(?!data:|#|https://doi\.org)[^"]*', page) == []
    assert "NaN" not in out
    import pandas
    import xarray

    with xarray.open_dataset("t.nc", engine="h5netcdf") as stored:
        assert stored["density"].shape[0] == 24
        assert stored.attrs["verdict"].replace(" um", " µm") == result["verdict"]
        assert stored["crf_hz"].values.tolist() == [row["crf_hz"] for row in result["recordings"]]
    assert pandas.read_parquet("t.parquet")["file"].tolist() == [
        row["file"] for row in result["recordings"]
    ]


def test_damping_determines_the_stage_on_request(asp, rig):
    folder, _ = rig
    series = (str(folder), "--table", str(folder / "table.csv"), "--case", "case.toml")
    by_damping = json.loads(asp("track", *series, "--stages-from", "damping", "--json")[1])
    assert by_damping["stages_by"]["crf"]["kind"] == "severe"  # as in the test above
    assert by_damping["stages"]["source"] == "damping"
    assert (
        by_damping["stages"]["kind"] == by_damping["stages_by"]["damping"]["kind"] == "no change"
    )  # of the rig's sphere
    assert by_damping["alarm"]["state"] == "none"
    out = asp("track", *series, "--stages-from", "both")[1]
    assert "stage by CRF and damping (deciding)" in out
    assert "damping does not change" in out


def test_a_long_series_is_fitted_in_groups(asp, rig, monkeypatch):
    folder, truth = rig
    monkeypatch.setattr("asperity.monitoring.judgement.MAX_GROUP", 12)
    result = json.loads(asp("track", str(folder), "--case", "case.toml", "--json")[1])
    for row in result["recordings"]:
        assert row["crf_hz"] == pytest.approx(truth[Path(row["file"]).name], abs=50.0)
    assert any("24 recordings were separated into 2 groups" in note for note in result["notes"])


def test_track_reports_its_assumptions_and_omissions(asp, rig):
    folder, _ = rig
    shutil.copytree(folder, "copy")
    with h5py.File("copy/sample-01-test-1.h5", "r+") as file:
        file["acceleration"][:] *= 1e-3
    Path("copy/sample-01-test-2.h5").write_bytes(b"not HDF5")
    code, out, _ = asp("track", "copy", "--method", "peak", "--out", "t.csv")
    assert code in (0, 3, 4)
    assert "band" in out
    assert "paper's contact, because neither a case nor a band was given" in out
    assert "machine was off" in out
    assert "named h5 but does not begin like one" in out
    assert Path("t.csv").is_file()


def test_a_copy_is_named_and_too_few_positions_give_no_stage(asp, rig, tmp_path):
    folder, _ = rig
    few = tmp_path / "few"
    few.mkdir()
    for file in sorted(folder.glob("*.h5"))[:3]:
        shutil.copy(file, few)
    shutil.copy(file, few / "copy.h5")
    code, out, _ = asp("track", str(few), "--method", "peak", "--rate", "20 kHz", "--json")
    result = json.loads(out)
    assert code == 4  # undetermined
    assert any("copy.h5" in note and "hold the same samples" in note for note in result["notes"])
    assert result["stages"]["probability"] == [None] * 4
    assert "± nan" not in asp("track", str(few), "--method", "peak")[1]


def test_constant_wear_raises_no_alarm(asp, tmp_path):
    write_rig(tmp_path / "still", "constant", repeats=1)
    code, out, _ = asp(
        "track", "still", "--table", "still/table.csv", "--case", "case.toml", "--json"
    )
    assert code == 0
    assert json.loads(out)["stages"]["kind"] == "no change"


def test_recordings_without_a_resonance_give_no_verdict(asp):
    rng = np.random.default_rng(1)
    for number in range(7):
        np.savez(f"noise-{number}.npz", acc=rng.standard_normal(40_000), fs=20e3, unit="m/s^2")
    code, out, _ = asp(
        "track", *(f"noise-{number}.npz" for number in range(7)), "--case", "case.toml"
    )
    assert code == 4
    assert out.startswith("Cannot tell: baseline incomplete: 7 of 8 points. No contact resonance")


def test_check_reports_good_and_bad_files(asp, rig):
    folder, _ = rig
    good = str(folder / "sample-01-test-1.h5")
    np.savez("off.npz", acc=np.zeros(30_000), fs=20e3, unit="V")
    Path("cut.wav").write_bytes(b"RIFF")
    code, out, err = asp("check", good, "off.npz", "--json")
    result = json.loads(out)
    assert (code, err) == (0, "")
    assert [row["usable"] for row in result["recordings"]] == [True, False]
    assert result["recordings"][0]["facts"]["rate"] == {
        "value": "20000.0",
        "source": "file (fs_hz)",
    }
    assert result["recordings"][1]["off"]
    code, out, err = asp("check", good, "off.npz", "cut.wav", "missing.wav")
    assert code == 2
    assert out.startswith("1 of 4 recordings can be used: the machine was off")
    assert "cut.wav" in err
    assert "missing.wav" in err
    assert err.count("\n") == 1
    code, out, _ = asp("check", good)
    assert (code, out.splitlines()[0]) == (0, "sample-01-test-1.h5: can be used.")


NESTED = ("depths", "lines", "bands", "sensors")  # parts of a row


@pytest.mark.usefixtures("blank_figures")
def test_watch_reads_each_file_once_and_resumes(asp, rig):
    folder, _ = rig
    files = sorted(folder.glob("*.h5"))
    Path("in").mkdir()
    arguments = ("watch", "in", "--once", "--settle", "0", "--case", "case.toml", "--json")
    assert json.loads(asp(*arguments)[1])["new"] == []
    for file in files[:8]:
        shutil.copy(file, "in")
    first = json.loads(asp(*arguments)[1])
    assert len(first["new"]) == len(first["recordings"]) == 8
    assert json.loads(asp(*arguments)[1])["new"] == []
    shutil.copy(files[8], "in")
    second = json.loads(asp(*arguments)[1])
    assert [Path(file).name for file in second["new"]] == [files[8].name]
    assert len(second["recordings"]) == 9
    for name in ("track.csv", "track.nc", "report.html"):
        assert Path("in/asperity-watch", name).is_file()
    direct = json.loads(asp("track", str(Path("in").resolve()), "--case", "case.toml", "--json")[1])
    for row, stored in zip(direct["recordings"], second["recordings"], strict=True):
        assert row.keys() == stored.keys()
        for key, value in row.items():
            # stored spectra have single precision
            expected = pytest.approx(value, rel=1e-5) if isinstance(value, float) else value
            assert key in NESTED or stored[key] == expected
    code, _, err = asp(*arguments, "--unit", "g")
    assert code == 2
    assert "was begun with unit None" in err


def test_watch_waits_for_a_file_that_is_still_being_written(asp, rig):
    folder, _ = rig
    Path("in").mkdir()
    shutil.copyfile(folder / "sample-01-test-1.h5", "in/a.h5")
    result = json.loads(asp("watch", "in", "--once", "--settle", "60", "--json")[1])
    assert result["new"] == []
    assert result["waiting"] == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("track", "bare.npy"), "states no sampling rate"),
        (("track", "empty"), "contains no recordings"),
        (("track", "missing"), "missing does not exist"),
        (
            ("track", "bare.npy", "--rate", "20000", "--out", "t.txt"),
            "--out must be a file that ends in .csv, .parquet or .nc",
        ),
        (
            ("track", "bare.npy", "--rate", "20000", "--band", "4000", "2000"),
            "band must go from low to high",
        ),
        (("track", "bare.npy", "--rate", "20000", "--method", "guess"), "method must be one of"),
        (
            ("track", "bare.npy", "--rate", "20000", "--stages-from", "width"),
            "crf, damping, both, got 'width'",
        ),
        (("watch", "empty", "--once", "--stages-from", "width"), "crf, damping, both, got 'width'"),
        (
            ("track", "bare.npy", "--rate", "20000", "--table", "t.csv"),
            "t.csv has no row for bare.npy",
        ),
        (("watch", "bare.npy"), "is not a folder"),
    ],
)
def test_invalid_arguments_are_refused_in_one_sentence(asp, arguments, message):
    np.save("bare.npy", np.random.default_rng(0).standard_normal(40_000))
    Path("empty").mkdir()
    Path("t.csv").write_text("file,sq_um\na.npy,1.0\n")
    code, out, err = asp(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
