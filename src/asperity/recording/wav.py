"""WAV and related files, by soundfile (libsndfile)."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import REMEDY, reject_as


def is_wav(head: bytes) -> bool:
    """Return whether a file is RIFF, RF64 or big-endian RIFX with WAVE, or FLAC."""
    return (head[:4] in (b"RIFF", b"RF64", b"RIFX") and head[8:12] == b"WAVE") or head[
        :4
    ] == b"fLaC"


def read(path: Path) -> Contents:
    """Read channels "1", "2" ...; integer samples are shares of full scale, without a unit."""
    import soundfile

    notes: list[str] = []
    with reject_as(path, "not a readable sound file"), soundfile.SoundFile(path) as opened:
        rate = opened.samplerate
        count = opened.channels
        frames = opened.frames
        kind = opened.subtype
    if rate <= 0 or not 0 < count <= 64:
        raise UnreadableFile(
            f"{path.name} states {rate} Hz and {count} channels, which is impossible; {REMEDY}"
        )
    stated_frames = _stated_frames(path)
    if stated_frames is not None and frames < stated_frames:
        notes.append(f"cut short: {frames} of {stated_frames} samples present")

    def blocks(number: int, size: int) -> Iterator[Field]:
        done = 0
        try:
            with soundfile.SoundFile(path) as sound:
                while (block := sound.read(size, dtype="float64", always_2d=True)).size:
                    done += block.shape[0]
                    yield np.ascontiguousarray(block[:, number])
        except soundfile.LibsndfileError as error:
            if done == 0:
                raise UnreadableFile(
                    f"{path.name} cannot be read ({first_line(error)}); {REMEDY}"
                ) from error
            notes.append(f"damaged after sample {done} of {frames}; samples before that were read")

    channels = [
        Channel(
            name=str(number + 1),
            blocks=partial(blocks, number),
            samples=frames,
            rate_hz=float(rate),
            rate_source="file (header)",
            full_scale=kind not in ("FLOAT", "DOUBLE"),
        )
        for number in range(count)
    ]
    return Contents(format=f"wav, {kind.lower().replace('_', ' ')}", channels=channels, notes=notes)


def _stated_frames(path: Path) -> int | None:
    """Return the number of samples in the header of a plain RIFF file; None if not stated.

    Streams and RF64 do not state it.
    """
    with path.open("rb") as file:
        if file.read(4) != b"RIFF":
            return None
        file.seek(12)
        step = 0
        while len(start := file.read(8)) == 8:
            size = int.from_bytes(start[4:], "little")
            if start[:4] == b"data":
                return None if size >= 0xFFFFFF00 or not step else size // step
            if start[:4] == b"fmt ":
                step = int.from_bytes(file.read(size)[12:14], "little")
                size = 0
            file.seek(size + size % 2, 1)
    return None
