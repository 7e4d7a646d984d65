"""Damaged surface files are read or refused in one sentence, without a traceback."""

import gc
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import BadInput
from asperity.surface import describe_surface

FILES = Path(__file__).parents[2].parent / "shared" / "data" / "surfaces"
MANY = 120  # python -m benchmarks.attacks damages thousands of files
UNITS = {"xyz": ("um", "um"), "csv": ("um", "mm"), "txt": ("um", "mm"), "npy": ("um", None)}


def originals(folder):
    """Contents of a small file of each writable format and of the large shared files, if any."""
    import sdfio
    import x3pio

    x, y = np.meshgrid(np.arange(24), np.arange(16), indexing="ij")
    z = np.sin(x / 3.0) + 0.1 * y
    x3pio.write(folder / "a.x3p", 1e-6 * z.T, x_scale=2e-6, y_scale=3e-6)
    sdfio.write(folder / "a.sdf", 1e-6 * z.T, x_scale=2e-6, y_scale=2e-6)
    (folder / "a.xyz").write_text(
        "".join(f"{i} {j} {z[i, j]:.4f}\n" for j in range(16) for i in range(24))
    )
    rows = [f'"{i},5","{v:.3f}"\n'.replace(".", ",") for i, v in enumerate(z[:, 0])]
    (folder / "a.csv").write_text('"x","z"\n' + "".join(rows))
    (folder / "a.txt").write_text("\n".join(" ".join(f"{v:.4f}" for v in row) for row in z.T))
    np.save(folder / "a.npy", z)
    shared = sorted(FILES.iterdir()) if FILES.is_dir() else []
    return [
        [(path.name, path.read_bytes()) for path in paths]
        for paths in (sorted(folder.iterdir()), shared)
    ]


def damaged(content, rng):
    data = bytearray(content)
    size = len(data)
    start, length = int(rng.integers(size)), int(rng.integers(1, 2000))
    match rng.integers(6):
        case 0:  # cut short
            del data[start:]
        case 1:  # bytes flipped anywhere
            for i in rng.integers(size, size=rng.integers(1, 40)):
                data[i] = rng.integers(256)
        case 2:  # bytes flipped in the header
            for i in rng.integers(min(size, 400), size=rng.integers(1, 20)):
                data[i] = rng.integers(256)
        case 3:  # a block zeroed
            data[start : start + length] = bytes(len(data[start : start + length]))
        case 4:  # a block inserted
            data[start:start] = rng.bytes(length)
        case 5:  # a block removed
            del data[start : start + length]
    return bytes(data)


@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # failing readers leave files open
def test_damaged_files_leave_no_traceback(tmp_path, capfd):
    (tmp_path / "good").mkdir()
    (tmp_path / "bad").mkdir()
    small, large = originals(tmp_path / "good")
    rng = np.random.default_rng(20)
    outcomes = []
    for number in range(MANY):
        name, content = (
            large[number // 10 % len(large)]
            if large and number % 10 == 0
            else small[number % 7 % len(small)]
        )
        path = tmp_path / "bad" / name
        path.write_bytes(damaged(content, rng))
        outcomes.append((name, outcome(path)))
    for name, result in outcomes:
        if isinstance(result, str):
            assert name.split(".")[0] in result
            assert "\n" not in result
            assert len(result) < 400
    read = sum(isinstance(result, float) for _, result in outcomes)
    assert 0.07 * MANY < read < 0.93 * MANY  # some are refused and some are read
    assert capfd.readouterr() == ("", "")
    gc.collect()


def outcome(path):
    """Return Sq of the surface or the message of `BadInput`; other exceptions fail the test."""
    unit, lateral = UNITS.get(path.suffix[1:], (None, None))
    pixel = 1e-6 if path.name in ("a.npy", "a.txt") else None
    try:
        return describe_surface(
            path, unit=unit, lateral_unit=None if pixel else lateral, pixel=pixel
        ).parameters.sq
    except BadInput as refusal:
        return str(refusal)
