"""Damaged recordings are read or refused in one sentence, never with a traceback."""

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

MANY = 120  # the benchmark uses 500


@pytest.mark.filterwarnings("ignore")  # failing readers leave files open and warn when collected
def test_damaged_recordings_leave_no_traceback(tmp_path, capfd):
    inputs = write_all(tmp_path, vibration(1500))
    contents = [(name, (tmp_path / name).read_bytes()) for name in inputs]
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
        outcomes.append((path.name, outcome(path, inputs.get(name, {}))))
        assert perf_counter() - began < 10.0, path.name
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 1 << 20  # kB
    for name, result in outcomes:
        if isinstance(result, str):
            assert name in result
            assert "\n" not in result
            assert len(result) < 500
    read = sum(isinstance(result, int) for _, result in outcomes)
    assert 0.2 * MANY < read < 0.9 * MANY  # neither all refused nor all accepted
    gc.collect()
    assert capfd.readouterr() == ("", "")


def outcome(path, options):
    """Number of samples read or the message of the refusal; other exceptions propagate."""
    try:
        return sum(
            check_recording(recording).samples for recording in open_channels(path, **options)
        )
    except BadInput as refusal:
        return str(refusal)


LIBRARIES = ("soundfile", "scipy.io", "h5py", "nptdms", "pyarrow", "idelib", "pyuff")


def test_third_party_libraries_read_recordings_in_a_separate_process(tmp_path):
    inputs = write_all(tmp_path, vibration(300))
    probe = (
        "import sys\nfrom pathlib import Path\nfrom asperity.recording import open_channels\nfor"
        " name, beside in eval(sys.argv[1]).items():\n    open_channels(name,"
        f" **beside)[0].read()\nprint(*[library for library in {LIBRARIES!r} if library in"
        " sys.modules])"
    )
    command = [sys.executable, "-c", probe, repr(inputs)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout == "\n", done.stderr


def hdf5_with_text(path, marker, *changed):
    """An HDF5 file with samples and text whose bytes at a marker are changed."""
    with h5py.File(path, "w") as file:
        file["text"] = [b"abc", b"d"]
        file.create_dataset("x", data=np.zeros(100)).attrs["fs"] = 2e4
    content = bytearray(path.read_bytes())
    position = content.index(marker[0]) + marker[1]
    content[position : position + len(changed)] = bytes(changed)
    path.write_bytes(content)
    return path


def test_hdf5_that_crashes_its_library_is_refused_and_the_next_file_read(tmp_path):
    with pytest.raises(UnreadableFile, match="its reader crashed"):
        read_recording(
            hdf5_with_text(tmp_path / "bad.h5", (b"\x19\x01", 1), 0x66)
        )  # invalid string type
    assert (
        read_recording(hdf5_with_text(tmp_path / "good.h5", (b"\x19\x01", 1), 1)).values.size == 100
    )


def test_hdf5_that_hangs_its_library_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(apart, "BASE_SECONDS", 1.0)
    with pytest.raises(UnreadableFile, match="took longer than 1 s"):
        read_recording(
            hdf5_with_text(tmp_path / "bad.h5", (b"GCOL", 24), 0)
        )  # a heap whose next block is itself


def test_damaged_flac_is_read_to_the_damage_or_refused(tmp_path):
    path = tmp_path / "x.flac"
    soundfile.write(path, vibration(300_000) / 16.0, int(RATE), subtype="PCM_16")
    intact = path.read_bytes()
    middle = len(intact) * 19 // 20
    path.write_bytes(intact[:middle] + bytes(200) + intact[middle + 200 :])
    recording = open_channels(path, unit="g", scale=16.0)[0].read()
    assert recording.values.size == 262_144
    assert recording.notes == (
        "damaged after sample 262144 of 300000; samples before that were read",
    )
    path.write_bytes(intact[:9000] + bytes(200) + intact[9200:])
    with pytest.raises(UnreadableFile, match=r"x\.flac cannot be read"):
        open_channels(path, unit="g", scale=16.0)[0].read()


def test_concurrent_threads_read_the_same_values_as_one(tmp_path):
    rng = np.random.default_rng(3)
    arrays = [rng.standard_normal((40_000, 2)) for _ in range(7)]
    for number, array in enumerate(arrays):
        with h5py.File(tmp_path / f"{number}.h5", "w") as file:
            file.create_dataset("x", data=array).attrs["fs"] = RATE
    opened = [channel for n in range(7) for channel in open_channels(tmp_path / f"{n}.h5")]
    sources = [channel.blocks(10_000) for channel in opened]
    blocks = [
        [next(source) for source in sources] for _ in range(4)
    ]  # more files than are kept open at a time
    for number in range(14):
        values = np.concatenate([block[number] for block in blocks])
        np.testing.assert_array_equal(values, arrays[number // 2][:, number % 2])
    assert all(next(source, None) is None for source in sources)
