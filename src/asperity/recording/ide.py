"""enDAQ (Mide) recorders' .IDE, by idelib: several rates in one file, so a channel has to be chosen."""

from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from asperity.apart import read_apart
from asperity.recording.common import REMEDY, refused_as, sliced
from asperity.recording.model import Channel, Contents


def is_ide(head: bytes) -> bool:
    """Whether a file is EBML, as IDE is."""
    return head[:4] == b"\x1a\x45\xdf\xa3"


def read(path: Path) -> Contents:
    """Channels named as the recorder does: "8.0 X (100g)"; formulas in a file are evaluated, so it is read apart."""
    notes: list[str] = []
    path = path.absolute()
    channels = []
    for channel, sub, facts in read_apart(path, "asperity.recording.ide:listed", remedy=REMEDY, library="idelib"):
        piece = partial(_piece, path, channel, sub)
        channels.append(Channel(blocks=sliced(piece, facts["samples"], notes, facts["name"]), **facts))
    return Contents(format="enDAQ ide", channels=channels, notes=notes)


def _piece(path: Path, channel: int, subchannel: int, first: int, last: int) -> Any:
    place = (channel, subchannel, first, last)
    return read_apart(path, "asperity.recording.ide:piece", *place, remedy=REMEDY)


def listed(path: Path) -> list[tuple[int, int, dict[str, Any]]]:
    """Number of channel and subchannel, and what the file states, of all that hold samples."""
    import idelib

    found: list[tuple[int, int, dict[str, Any]]] = []
    with refused_as(path, "no readable IDE recording"), idelib.importFile(str(path)) as data:
        for channel in data.channels.values():
            for sub in channel.subchannels:
                events = sub.getSession()
                if len(events) < 2:
                    continue
                facts = {
                    "name": f"{channel.id}.{sub.id} {sub.name}",
                    "samples": len(events),
                    "rate_hz": float(events.getSampleRate()),
                    "rate_source": "file (mean over the recording)",
                    "unit": str(sub.units[1]) or None,
                    "started": _utc(data.lastUtcTime),
                }
                found.append((int(channel.id), int(sub.id), facts))
    return found


_opened: dict[tuple[Path, int], Any] = {}  # the last file: opening reads its whole index, once is enough


def piece(path: Path, channel: int, subchannel: int, first: int, last: int) -> Any:
    """Samples from `first` up to `last`, without it."""
    import idelib

    key = (path, path.stat().st_mtime_ns)
    if key not in _opened:
        while _opened:
            _opened.popitem()[1].close()
        _opened[key] = idelib.importFile(str(path))
    events = _opened[key].channels[channel].subchannels[subchannel].getSession()
    values = events.arraySlice(first, last)[1]
    if last >= len(events):
        _opened.pop(key).close()
    return values


def _utc(seconds: Any) -> datetime | None:
    """None for a recorder whose clock was never set, and began at 1970."""
    return datetime.fromtimestamp(float(seconds), UTC).replace(tzinfo=None) if seconds and seconds > 1e9 else None
