import csv
import json
from pathlib import Path

import pytest


def test_a_rig_is_written_and_tracked_to_its_true_values(asp):
    code, out, err = asp("rig", "--out", "rig", "--repeats", "1", "--duration", "5 s")
    assert (code, err) == (0, "")
    assert out.startswith("12 recordings of 5 s at 20000 Hz: true CRF from")
    command = out.split("Try next: asperity ")[1].split()
    code, out, err = asp(*command, "--json")
    found = json.loads(out)
    truth = {
        row["file"]: row
        for row in csv.DictReader(Path("rig/truth.csv").read_text("utf-8").splitlines())
    }
    assert len(found["recordings"]) == 12
    for row in found["recordings"]:
        assert row["found"]
        true = float(truth[Path(row["file"]).name]["crf_hz"])
        assert row["crf_hz"] == pytest.approx(true, abs=5.0 * row["crf_std_hz"])


def test_json_is_one_object_with_every_path(asp):
    code, out, _ = asp(
        "rig", "--out", "rig", "--samples", "2", "--repeats", "1", "--duration", "0.5 s", "--json"
    )
    result = json.loads(out)
    assert code == 0
    assert result["split_sq_m"] == 1.8e-6
    assert all(
        Path(path).is_file()
        for path in (*result["recordings"], result["table"], result["truth"], result["case"])
    )


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--duration", "10"), "--duration must be a time"),
        (("--rate", "20 rpm"), "--rate must be a frequency"),
        (("--trend", "wavy"), "knee, smooth, constant"),
        (("--format", "mp3"), "h5 or wav"),
        (("--case", "missing.toml"), "missing.toml"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(asp, arguments, named):
    code, out, err = asp("rig", "--out", "rig", *arguments)
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert named in err
    assert not Path("rig").exists() or not any(Path("rig").iterdir())


def test_a_folder_that_is_not_empty_is_left_unchanged(asp):
    Path("rig").mkdir()
    Path("rig/mine.csv").write_text("1\n")
    code, _, err = asp("rig", "--out", "rig")
    assert code == 2
    assert "not an empty folder" in err
    assert [path.name for path in Path("rig").iterdir()] == ["mine.csv"]
