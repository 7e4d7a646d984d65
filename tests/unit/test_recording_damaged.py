"""Damaged recordings: read or refused in one sentence, and never a traceback."""

import gc
import resource
import subprocess
import sys
from time import perf_counter

import h5py
import numpy as np
import pytest
import soundfile

from asperity.core import sandbox as apart
from asperity.core.errors import BadInput, UnreadableFile
from asperity.recording import check_recording, open_channels, read_recording
from support.recordings import RATE, SHARED, damaged, vibration, write_all

MANY = 250  # the benchmark takes 500


@pytest.mark.filterwarnings(
    "ignore"
)  # readers that fail leave files open, and say so when they are collected
def test_damaged_recordings_leave_no_traceback(tmp_path, capfd):
    said = write_all(tmp_path, vibration(1500))
    contents = [(name, (tmp_path / name).read_bytes()) for name in said]
    if SHARED.is_dir():
        contents.append(
            (
                "endaq.ide",
                (SHARED / "vibration" / "endaq" / "ActTest_009.IDE").read_bytes()[:100_000],
            )
        )
    rng = np.random.default_rng(8)
    (tmp_path / "bad").mkdir()
    outcomes = []
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in range(MANY):
        name, content = contents[number % len(contents)]
        path = tmp_path / "bad" / f"{number}-{name}"
        path.write_bytes(damaged(content, rng))
        began = perf_counter()
        outcomes.append((path.name, outcome(path, said.get(name, {}))))
        assert perf_counter() - began < 10.0, path.name
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 20  # kB
    for name, told in outcomes:
        if isinstance(told, str):
            assert name in told
            assert "\n" not in told
            assert len(told) < 500
    read = sum(isinstance(told, int) for _, told in outcomes)
    assert 0.2 * MANY < read < 0.9 * MANY  # neither everything refused nor everything swallowed
    gc.collect()
    assert capfd.readouterr() == ("", "")


def outcome(path, beside):
    """How many samples were read, or the sentence that refuses them; anything else is the traceback
    not to be seen.
    """
    try:
        return sum(check_recording(one).samples for one in open_channels(path, **beside))
    except BadInput as refusal:
        return str(refusal)


LIBRARIES = ("soundfile", "scipy.io", "h5py", "nptdms", "pyarrow", "idelib", "pyuff")


def test_no_library_of_somebody_elses_reads_a_recording_in_our_process(tmp_path):
    said = write_all(tmp_path, vibration(300))
    probe = (
        "import sys\nfrom pathlib import Path\nfrom asperity.recording import open_channels\nfor"
        " name, beside in eval(sys.argv[1]).items():\n    open_channels(name,"
        f" **beside)[0].read()\nprint(*[library for library in {LIBRARIES!r} if library in"
        " sys.modules])"
    )
    command = [sys.executable, "-c", probe, repr(said)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout == "\n", done.stderr


def with_text(path, at, *changed):
    """An HDF5 file with samples and text, whose bytes at a mark are changed."""
    with h5py.File(path, "w") as file:
        file["text"] = [b"abc", b"d"]
        file.create_dataset("x", data=np.zeros(100)).attrs["fs"] = 2e4
    content = bytearray(path.read_bytes())
    place = content.index(at[0]) + at[1]
    content[place : place + len(changed)] = bytes(changed)
    path.write_bytes(content)
    return path


def test_hdf5_that_crashes_its_library_is_refused_and_the_next_file_read(tmp_path):
    with pytest.raises(UnreadableFile, match="its reader crashed"):
        read_recording(
            with_text(tmp_path / "bad.h5", (b"\x19\x01", 1), 0x66)
        )  # text of a kind that is none
    assert read_recording(with_text(tmp_path / "good.h5", (b"\x19\x01", 1), 1)).values.size == 100


def test_hdf5_that_hangs_its_library_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "BASE_SECONDS", 1.0)
    with pytest.raises(UnreadableFile, match="took longer than 1 s"):
        read_recording(
            with_text(tmp_path / "bad.h5", (b"GCOL", 24), 0)
        )  # a heap whose next piece is itself


def test_damaged_flac_is_read_to_its_damage_or_refused(tmp_path):
    path = tmp_path / "x.flac"
    soundfile.write(path, vibration(300_000) / 16.0, int(RATE), subtype="PCM_16")
    whole = path.read_bytes()
    middle = len(whole) * 19 // 20
    path.write_bytes(whole[:middle] + bytes(200) + whole[middle + 200 :])
    told = open_channels(path, unit="g", scale=16.0)[0].read()
    assert told.values.size == 262_144
    assert told.notes == ("damaged after sample 262144 of 300000; samples before that were read",)
    path.write_bytes(whole[:9000] + bytes(200) + whole[9200:])
    with pytest.raises(UnreadableFile, match=r"x\.flac cannot be read"):
        open_channels(path, unit="g", scale=16.0)[0].read()


def test_threads_that_read_several_files_at_a_time_get_what_one_alone_does(tmp_path):
    rng = np.random.default_rng(3)
    arrays = [rng.standard_normal((40_000, 2)) for _ in range(7)]
    for number, array in enumerate(arrays):
        with h5py.File(tmp_path / f"{number}.h5", "w") as file:
            file.create_dataset("x", data=array).attrs["fs"] = RATE
    opened = [channel for n in range(7) for channel in open_channels(tmp_path / f"{n}.h5")]
    sources = [channel.blocks(10_000) for channel in opened]
    blocks = [
        [next(source) for source in sources] for _ in range(4)
    ]  # more files in turn than are kept open
    for number in range(14):
        values = np.concatenate([turn[number] for turn in blocks])
        np.testing.assert_array_equal(values, arrays[number // 2][:, number % 2])
    assert all(next(source, None) is None for source in sources)
