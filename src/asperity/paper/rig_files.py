"""Writing of a simulated rig: recordings, table of samples, true values and case."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np
import scipy

from asperity.core.errors import BadInput
from asperity.core.files import atomic_write, write_text
from asperity.core.signals import Signal
from asperity.paper.rig import WRITERS_AT_ONCE, Rig
from asperity.paper.rig_recording import RigRecording

RecordingFormat = Literal["h5", "wav"]


def write_rig(
    rig: Rig,
    folder: str | Path,
    *,
    file_format: RecordingFormat = "h5",
    progress: Callable[[int, int], None] | None = None,
) -> list[Path]:
    """Write all recordings of a rig, with tables and case; return the recordings' paths.

    Besides the recordings it writes table.csv (known to a test engineer: file, Sq and its standard
    deviation in um, load, roller speed), truth.csv (true CRF, CRFA, damping, CLR, Sq and SNR) and
    rig.toml, the case.

    Parameters
    ----------
    file_format : "h5", 32-bit floats with rate and unit; "wav", 32-bit floats in m/s^2, with the
        rate only
    progress : called with the numbers of recordings written and in total

    Raises
    ------
    BadInput
        for an unknown format, or a folder that is not empty or cannot be created.
    """
    if file_format not in WRITERS:
        raise BadInput(
            f"the format of a rig's recordings must be {' or '.join(WRITERS)}, got {file_format!r}"
        )
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInput(
                f"{folder} is not empty, and its files would be read as recordings; choose a new "
                "folder"
            )
    except OSError as error:
        raise BadInput(
            f"cannot create the folder {folder}: {error.strerror}; choose another"
        ) from None
    paths = [folder / f"{recording.name}.{file_format}" for recording in rig.recordings]

    def write(recording: RigRecording, path: Path) -> None:
        with atomic_write(path) as part:
            WRITERS[file_format](part, recording.signal())

    pool = ThreadPoolExecutor(max_workers=WRITERS_AT_ONCE)
    try:
        for number, _ in enumerate(pool.map(write, rig.recordings, paths), 1):
            if progress is not None:
                progress(number, len(paths))
    finally:
        pool.shutdown(cancel_futures=True)
    _write_tables(rig, paths, folder)
    write_text(folder / "rig.toml", rig.case_text)
    return paths


def _write_tables(rig: Rig, paths: Sequence[Path], folder: Path) -> None:
    hours_column = () if rig.hours is None else ("hours",)
    measured: list[tuple[str, ...]] = [
        ("file", *hours_column, "sq_um", "sq_um_std", "load_n", "speed_hz")
    ]
    truth: list[tuple[str, ...]] = [
        (
            "file",
            "sample",
            "repeat",
            "true_sq_um",
            "clr",
            "crf_hz",
            "crfa",
            "damping_ratio",
            "snr_db",
        )
    ]
    for recording, path in zip(rig.recordings, paths, strict=True):
        sq, sq_std, true_sq = (
            1e6 * m for m in (recording.sq_m, recording.sq_std_m, recording.true_sq_m)
        )
        hours = () if rig.hours is None else (f"{rig.hours[recording.sample - 1]:.6g}",)
        measured.append(
            (
                path.name,
                *hours,
                f"{sq:.4g}",
                f"{sq_std:.3g}",
                f"{rig.load_n:g}",
                f"{rig.shaft_hz[0]:g}",
            )
        )
        values = (
            true_sq,
            recording.clr,
            recording.crf_hz,
            recording.crfa,
            recording.damping_ratio,
            recording.snr_db,
        )
        truth.append(
            (
                path.name,
                str(recording.sample),
                str(recording.repeat),
                *(f"{value:.6g}" for value in values),
            )
        )
    for name, rows in (("table.csv", measured), ("truth.csv", truth)):
        write_text(folder / name, "".join(",".join(row) + "\n" for row in rows))


def _write_hdf5(path: Path, signal: Signal) -> None:
    import h5py

    buffer = BytesIO()  # in memory, because the HDF5 library crashes on a full disk
    with h5py.File(buffer, "w") as file:
        values = file.create_dataset("acceleration", data=signal.values.astype(np.float32))
        values.attrs["sampling_rate_hz"] = signal.rate_hz
        values.attrs["unit"] = signal.unit
    path.write_bytes(buffer.getvalue())


def _write_wav(path: Path, signal: Signal) -> None:
    if signal.rate_hz != round(signal.rate_hz):
        raise BadInput(
            f"a wav file needs an integer sampling rate, got {signal.rate_hz:g} Hz; use h5"
        )
    scipy.io.wavfile.write(path, round(signal.rate_hz), signal.values.astype(np.float32))


WRITERS: dict[RecordingFormat, Callable[[Path, Signal], None]] = {
    "h5": _write_hdf5,
    "wav": _write_wav,
}
