"""Folders of folders: recordings in subfolders, without results and hidden folders."""

import json

import numpy as np
import pytest

from asperity.cli import main
from asperity.core.errors import BadInput
from asperity.monitoring import TrackSettings, check_recordings, recordings_in, track_recordings


def write(path):
    path.parent.mkdir(parents=True, exist_ok=True)
    values = np.random.default_rng(len(path.name)).standard_normal(8000)
    np.savez(path, acc=values, fs=20e3, unit="m/s^2")


@pytest.fixture
def tree(tmp_path):
    for name in ("week 10/r1", "week 9/r10", "week 9/r2", "week 9/night/r1", "r7"):
        write(tmp_path / f"{name}.npz")
    for folder in (".backup", "asperity-watch", "results", "week 9/.cache", "__MACOSX"):
        write(tmp_path / folder / "r0.npz")
    (tmp_path / "results" / "asperity.db").touch()
    (tmp_path / "plant.db").touch()
    (tmp_path / "week 9" / "recordings.toml").write_text("speed_hz = 25.0")
    return tmp_path


def test_recordings_of_subfolders_are_in_natural_order(tree):
    names = [path.relative_to(tree).as_posix() for path in recordings_in([tree])]
    assert names == [
        "r7.npz",
        "week 9/night/r1.npz",
        "week 9/r2.npz",
        "week 9/r10.npz",
        "week 10/r1.npz",
    ]


def test_check_and_track_read_subfolders(tree):
    assert len(check_recordings([tree]).checked) == 5
    track = track_recordings([tree], TrackSettings(band_hz=(2e3, 4e3)))
    assert [recording.x for recording in track.recordings] == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert track.recordings[2].reading.facts["speed_hz"][1] == "recordings.toml"


def test_a_table_names_recordings_with_their_folders(tree):
    rows = ["week 9/night/r1.npz,1", "week 9/r2.npz,2", "week 9/r10.npz,3", "week 10/r1.npz,4"]
    (tree / "table.csv").write_text("\n".join(["file,time_h", *rows, "r7.npz,0.5"]))
    track = track_recordings([tree], TrackSettings(band_hz=(2e3, 4e3)), table=tree / "table.csv")
    assert [recording.x for recording in track.recordings] == [0.5, 1.0, 2.0, 3.0, 4.0]


def test_a_tree_without_recordings_is_refused(tmp_path, capsys):
    for folder in ("a/b", "c", ".hidden"):
        (tmp_path / folder).mkdir(parents=True)
    write(tmp_path / ".hidden" / "r1.npz")
    (tmp_path / "c" / "readme.txt").write_text("nothing")
    with pytest.raises(BadInput, match="contains no recordings, nor do its 3 subfolders; name"):
        recordings_in([tmp_path])
    for command in ("check", "track"):
        with pytest.raises(SystemExit) as end:
            main([command, str(tmp_path), "--json"])
        assert end.value.code == 2
        error = capsys.readouterr()
        assert "nor do its 3 subfolders" in error.out + error.err


def test_a_link_to_a_folder_above_is_not_followed(tree):
    (tree / "week 9" / "loop").symlink_to(tree)
    assert len(recordings_in([tree])) == 5
    assert json.dumps([str(path) for path in recordings_in([tree / "week 10"])]).count("r1") == 1
