"""Damaged files: with flipped, cut or overwritten bytes, a file is rejected or read unchanged."""

import json
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.core.errors import BadInput
from asperity.core.storage import digest

if TYPE_CHECKING:
    from asperity.recording import OpenRecording

SHARED = Path(__file__).parents[2].parent / "shared" / "data"
RECORDINGS = ("mfpt-formats/*", "mfpt/*.mat", "endaq/*", "uff/*", "ims/*")
SURFACES = ("surfaces/*",)
LARGEST = 3_000_000  # bytes; larger originals take too long a thousand times
SMALL = {"grid.cells": [32, 24], "surface.correlation_length": "40 um"}


def damaged(content: bytes, rng: random.Random) -> bytes:
    """Return the content with one random kind of damage, as from disks and transfers."""
    changed, size = bytearray(content), len(content)
    kind = rng.randrange(7)
    at = rng.randrange(size)
    if kind <= 2:  # most often one bit; every third of these in the header
        at = at if kind else rng.randrange(min(size, 4096))
        changed[at] ^= 1 << rng.randrange(8)
    elif kind == 3:
        del changed[at:]
    elif kind == 4:
        end = min(size, at + rng.choice((4, 64, 4096)))
        changed[at:end] = bytes(end - at)
    elif kind == 5:
        end = min(size, at + rng.choice((4, 64, 4096)))
        changed[at:end] = rng.randbytes(end - at)
    else:
        other = rng.randrange(size)
        changed[at:at] = changed[other : other + 512]
    return bytes(changed)


# Results
# -------------------------------------------------------------------------------------------------


def make_results(folder: Path) -> None:
    """Create a small run, history and study."""
    from asperity.paper import papers_case
    from asperity.results import solve_case
    from asperity.simulation import run_history
    from asperity.study import plan_study, run_study

    case = papers_case().with_overrides(SMALL)
    solve_case(case, strict=False).save(folder / "run.nc")
    run_history(case, steps=3, every=1, out=folder / "history", strict=False)
    swept = case.with_overrides({"study": {"sq": ["1 um", "2 um"], "seeds": 2}})
    run_study(plan_study(swept), out=folder / "study", workers=1, fields=("pressure", "gap"))


def results_text(folder: Path, which: str) -> str:
    """Return all numbers of a result as text to compare."""
    from asperity.results import load_run
    from asperity.simulation import load_history
    from asperity.study import load_study

    def text(values: Any) -> str:
        return json.dumps(values, default=str, sort_keys=True)

    if which == "run.nc":
        run = load_run(folder / which)
        fields = (run.solution.pressure, run.solution.gap, run.solution.surface.heights)
        return text([run.verdict(), run.case.text, [digest(field) for field in fields]])
    if which == "history":
        moved = load_history(folder / which)
        values = {key: value for key, value in moved.scalars().items() if key != "folder"}
        held = [[digest(np.asarray(part)) for part in frame] for frame in moved.frames]
        return text(
            [values, moved.table.to_dict(), moved.case.text, held, digest(dict(moved.memory or {}))]
        )
    result = load_study(folder / which)
    maps = [digest(result.maps(case.id)) for case in result.plan.cases]
    return text(
        [result.table.to_dict(), result.plan.points, [case.id for case in result.plan.cases], maps]
    )


def results(folder: Path) -> Callable[[int], str | None]:
    """Return a function that damages one file of a result, chosen by number."""
    make_results(folder)
    expected = {which: results_text(folder, which) for which in ("run.nc", "history", "study")}
    files = {which: sorted(_files(folder / which)) for which in expected}

    def attack(number: int) -> str | None:
        rng = random.Random(number)
        which = ("run.nc", "history", "study")[number % 3]
        path = rng.choice(files[which])
        whole = path.read_bytes()
        path.write_bytes(damaged(whole, rng))
        try:
            return (
                None
                if results_text(folder, which) == expected[which]
                else f"{path.name}: silently different"
            )
        except BadInput as refusal:
            return too_long(refusal)
        finally:
            path.write_bytes(whole)

    return attack


def _files(path: Path) -> Iterator[Path]:
    if path.is_file():
        yield path
    else:
        yield from (file for file in path.rglob("*") if file.is_file() and "lock" not in file.name)


def too_long(refusal: BadInput) -> str | None:
    """Return the fault of an error message that is too long, or None."""
    text = str(refusal)
    return f"refusal of {len(text)} characters" if len(text) > 500 or "\n" in text else None


# Measurements
# -------------------------------------------------------------------------------------------------


def originals(folder: Path) -> list[Path]:
    """Return measured files of every format if present, otherwise generated ones."""
    found = [
        path
        for pattern in (*(f"vibration/{recordings}" for recordings in RECORDINGS), *SURFACES)
        for path in sorted(SHARED.glob(pattern))
        if path.is_file() and path.stat().st_size < LARGEST
    ]
    return found or _made(folder)


def _made(folder: Path) -> list[Path]:
    import h5py
    import numpy as np
    import pandas
    import scipy.io
    import soundfile
    import x3pio

    values = np.random.default_rng(1).standard_normal(5000)
    np.save(folder / "a.npy", values)
    np.savez(folder / "a.npz", x=values, rate_hz=2e4)
    scipy.io.savemat(folder / "a.mat", {"x": values, "rate": 2e4}, do_compression=True)
    soundfile.write(folder / "a.wav", values / 10.0, 20000)
    pandas.DataFrame({"x": values}).to_parquet(folder / "a.parquet")
    pandas.DataFrame({"time (s)": np.arange(5000) / 2e4, "x (g)": values}).to_csv(
        folder / "a.csv", index=False
    )
    with h5py.File(folder / "a.h5", "w") as file:
        file.create_dataset("x", data=values, compression="gzip").attrs["sampling_rate_hz"] = 2e4
    x3pio.write(folder / "b.x3p", values[:4900].reshape(70, 70) * 1e-6, x_scale=1e-6, y_scale=1e-6)
    np.savetxt(folder / "b.txt", values[:4900].reshape(70, 70))
    return sorted(path for path in folder.iterdir() if path.is_file())


def measured(folder: Path) -> Callable[[int], str | None]:
    """Return a function that damages a recording or surface, which is then read or rejected."""
    from asperity.surface import read_surface

    files = originals(folder)
    contents = {path: path.read_bytes() for path in files}

    def attack(number: int) -> str | None:
        rng = random.Random(number)
        path = files[number % len(files)]
        copy = folder / f"damaged-{path.name}"
        copy.write_bytes(damaged(contents[path], rng))
        surface = path.parent.name == "surfaces" or path.name.startswith("b.")
        try:
            if surface:
                read_surface(copy)
            else:
                for opened in channels(copy)[:2]:
                    opened.read()
        except BadInput as refusal:
            return too_long(refusal)
        finally:
            copy.unlink()
        return None

    return attack


def channels(path: Path) -> "list[OpenRecording]":
    """Open all channels of a recording; supply a sampling rate if the file has none."""
    from asperity.recording import open_channels

    try:
        return open_channels(path)
    except BadInput as refusal:
        if "states no sampling rate" not in str(refusal):
            raise
        return open_channels(path, rate_hz=2e4)
