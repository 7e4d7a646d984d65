"""enDAQ (Mide) recorders' .IDE files, by idelib: several rates per file, so name a channel.

Formulas in a file are evaluated.
"""

from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy.typing as npt

from asperity.recording.model import Channel, Contents
from asperity.recording.reader import reject_as, sliced_blocks


def is_ide(head: bytes) -> bool:
    """Return whether a file is EBML, as IDE is."""
    return head[:4] == b"\x1a\x45\xdf\xa3"


def read(path: Path) -> Contents:
    """Read channels named as the recorder does: "8.0 X (100g)".

    The file stays open: opening it reads its whole index.
    """
    import idelib

    notes: list[str] = []
    channels = []
    with reject_as(path, "not a readable IDE recording"):
        data = idelib.importFile(str(path))
        for channel in data.channels.values():
            for sub in channel.subchannels:
                events = sub.getSession()
                if len(events) < 2:
                    continue
                name = f"{channel.id}.{sub.id} {sub.name}"
                samples = len(events)
                entry = Channel(
                    name=name,
                    blocks=sliced_blocks(partial(_slice, events), samples, notes, name),
                    samples=samples,
                    rate_hz=float(events.getSampleRate()),
                    rate_source="file (mean over the recording)",
                    unit=str(sub.units[1]) or None,
                    started=_utc(data.lastUtcTime),
                )
                channels.append(entry)
    return Contents(format="enDAQ ide", channels=channels, notes=notes)


def _slice(events: Any, first: int, last: int) -> npt.ArrayLike:
    samples: npt.ArrayLike = events.arraySlice(first, last)[1]
    return samples


def _utc(seconds: float | None) -> datetime | None:
    """Return the time; None for a recorder whose clock was never set and started at 1970."""
    return (
        datetime.fromtimestamp(float(seconds), UTC).replace(tzinfo=None)
        if seconds and seconds > 1e9
        else None
    )
