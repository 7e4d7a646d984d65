"""Files are written atomically: hostile links, permissions, threads and long names."""

import os
from concurrent.futures import ThreadPoolExecutor
from stat import S_IMODE

import pytest

from asperity.core.errors import AsperityError
from asperity.core.files import atomic_write, write_text


def test_a_link_with_the_name_of_the_temporary_file_is_not_followed(tmp_path, monkeypatch):
    victim = tmp_path / "victim"
    victim.write_text("untouched")
    folder = tmp_path / "shared"
    folder.mkdir()
    monkeypatch.setattr(os, "urandom", bytes)  # foretold
    (folder / f".run.txt.{bytes(8).hex()}.part").symlink_to(victim)
    (folder / f".run.txt.{os.getpid()}.part").symlink_to(victim)
    with pytest.raises(AsperityError, match="File exists"):
        write_text(folder / "run.txt", "new")
    assert victim.read_text() == "untouched"


def test_temporary_names_differ(tmp_path):
    with atomic_write(tmp_path / "a") as first, atomic_write(tmp_path / "a") as second:
        assert first != second
        assert str(os.getpid()) not in {first.suffixes[-2], second.suffixes[-2]}


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o664])
def test_an_existing_file_keeps_its_permissions(tmp_path, mode):
    path = tmp_path / "secret.txt"
    path.write_text("old")
    path.chmod(mode)
    write_text(path, "new")
    assert path.read_text() == "new"
    assert S_IMODE(path.stat().st_mode) == mode


def test_a_new_file_has_the_usual_permissions(tmp_path):
    (tmp_path / "usual").write_text("")
    write_text(tmp_path / "new", "")
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_threads_write_one_file_without_failures(tmp_path):
    path = tmp_path / "shared.txt"
    contents = {f"{number:05}" * 1000 for number in range(400)}
    with ThreadPoolExecutor(8) as pool:
        assert len([*pool.map(lambda text: write_text(path, text), contents)]) == 400
    assert path.read_text() in contents
    assert [entry.name for entry in tmp_path.iterdir()] == ["shared.txt"]


@pytest.mark.parametrize("name", ["a" * 250 + ".csv", "ä" * 125 + ".nc"])
def test_names_of_any_length_are_written(tmp_path, name):
    write_text(tmp_path / name, "text")
    assert (tmp_path / name).read_text() == "text"


def test_nothing_is_left_behind_after_an_error(tmp_path):
    with pytest.raises(ValueError, match="stop"), atomic_write(tmp_path / "a"):
        raise ValueError("stop")
    assert not [*tmp_path.iterdir()]
