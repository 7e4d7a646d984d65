"""Zeros with which a universal file fills its last line are no samples."""

import numpy as np
import pytest

from asperity.recording import read_recording
from support.recordings import SHARED, uff_set, vibration, write_uff

SAMPLES = 4001  # one more than whole lines of four


def padded_ascii(path, values):
    """Write a file and fill its last line of four numbers with zeros."""
    write_uff(path, uff_set(values, binary=0))
    lines = path.read_text().splitlines()
    last = max(number for number, line in enumerate(lines) if "e+" in line or "e-" in line)
    lines[last] = lines[last].rstrip() + 3 * f"{0.0:20.11e}"
    path.write_text("\n".join([*lines, ""]))


def padded_binary(path, values):
    """Write a file whose header states three samples fewer than its binary block holds."""
    write_uff(path, uff_set(np.concatenate([values, np.zeros(3)])))
    content = path.read_bytes()
    stated = f"{SAMPLES + 3:10d}".encode()
    assert content.count(stated) == 1
    path.write_bytes(content.replace(stated, f"{SAMPLES:10d}".encode()))


@pytest.mark.parametrize("write", [padded_ascii, padded_binary])
def test_padding_of_the_last_line_is_no_sample(tmp_path, write):
    values = vibration(SAMPLES)
    write(tmp_path / "a.uff", values)
    read = read_recording(tmp_path / "a.uff")
    assert read.values == pytest.approx(values, rel=1e-9)
    assert read.notes == ()


def test_other_values_beyond_the_stated_samples_are_remarked(tmp_path):
    write_uff(tmp_path / "a.uff", uff_set(vibration(SAMPLES + 9)))
    content = (tmp_path / "a.uff").read_bytes()
    stated, fewer = (f"{number:10d}".encode() for number in (SAMPLES + 9, SAMPLES))
    (tmp_path / "a.uff").write_bytes(content.replace(stated, fewer))
    read = read_recording(tmp_path / "a.uff")
    assert read.values.size == SAMPLES
    assert read.notes == ("9 values beyond the stated 4001 samples were left out",)


def test_a_measured_file_has_its_stated_samples():
    file = SHARED / "vibration" / "uff" / "Sample_UFF58b_bin.uff"
    if not file.is_file():
        pytest.skip(f"{file.name} is not beside the repository")
    import pyuff

    sets = pyuff.UFF(str(file))
    records = [sets.read_sets(n) for n, kind in enumerate(sets.get_set_types()) if kind == 58]
    for number, record in enumerate(records, 1):
        if int(record["func_type"]) == 1:
            read = read_recording(file, channel=str(number))
            assert read.values.size == int(record["num_pts"])
