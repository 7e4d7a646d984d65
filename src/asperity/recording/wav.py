"""WAV and its kin, by soundfile (libsndfile)."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arrays import Field
from asperity.errors import UnreadableFile
from asperity.quiet import first_line
from asperity.recording.common import REMEDY, required
from asperity.recording.model import Channel, Contents


def is_wav(head: bytes) -> bool:
    """RIFF, RF64 or big-endian RIFX, holding WAVE; FLAC."""
    return (head[:4] in (b"RIFF", b"RF64", b"RIFX") and head[8:12] == b"WAVE") or head[:4] == b"fLaC"


def read(path: Path) -> Contents:
    """Channels "1", "2" ...; integer samples are shares of full scale, as the format gives them no unit."""
    import soundfile

    notes: list[str] = []
    try:
        with soundfile.SoundFile(path) as opened:
            rate, count, frames, kind = opened.samplerate, opened.channels, opened.frames, opened.subtype
    except (soundfile.SoundFileError, RuntimeError, TypeError) as error:
        raise UnreadableFile(f"{path.name} is no readable sound file ({first_line(error)}); {REMEDY}") from error
    if rate <= 0 or not 0 < count <= 64:
        raise UnreadableFile(f"{path.name} states {rate} Hz and {count} channels, which cannot be; {REMEDY}")
    whole = _stated_frames(path)
    if whole is not None and frames < whole:
        notes.append(f"cut short: {frames} of {whole} samples are there")
    integer = kind not in ("FLOAT", "DOUBLE")

    def blocks(number: int) -> Any:
        def read_blocks(size: int) -> Iterator[Field]:
            with soundfile.SoundFile(path) as sound:
                while True:
                    block = sound.read(size, dtype="float64", always_2d=True)
                    if block.shape[0] == 0:
                        return
                    yield np.ascontiguousarray(block[:, number])

        return read_blocks

    channels = (
        Channel(
            name=str(number + 1),
            blocks=blocks(number),
            samples=frames,
            rate_hz=float(rate),
            rate_source="file (header)",
            full_scale=integer,
        )
        for number in range(count)
    )
    return Contents(
        format=f"wav, {kind.lower().replace('_', ' ')}", channels=required(channels, path.name), notes=notes
    )


def _stated_frames(path: Path) -> int | None:
    """How many samples the header of a plain RIFF file promises; None where it does not say (streams, RF64)."""
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
