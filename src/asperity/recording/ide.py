"""enDAQ (Mide) recorders' .IDE, by idelib: several rates in one file, so a channel has to be chosen."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from asperity.recording.common import refused_as, sliced
from asperity.recording.model import Channel, Contents


def is_ide(head: bytes) -> bool:
    """Whether a file is EBML, as IDE is."""
    return head[:4] == b"\x1a\x45\xdf\xa3"


def read(path: Path) -> Contents:
    """Channels named as the recorder does: "8.0 X (100g)"."""
    import idelib

    notes: list[str] = []
    channels = []
    with refused_as(path, "no readable IDE recording"), idelib.importFile(str(path)) as data:
        for channel in data.channels.values():
            for sub in channel.subchannels:
                events = sub.getSession()
                if len(events) < 2:
                    continue
                name = f"{channel.id}.{sub.id} {sub.name}"
                channels.append(
                    Channel(
                        name=name,
                        blocks=sliced(_slices(path, channel.id, sub.id), len(events), notes, name),
                        samples=len(events),
                        rate_hz=float(events.getSampleRate()),
                        rate_source="file (mean over the recording)",
                        unit=str(sub.units[1]) or None,
                        started=_utc(data.lastUtcTime),
                    )
                )
    return Contents(format="enDAQ ide", channels=channels, notes=notes)


def _slices(path: Path, channel: int, subchannel: int) -> Any:
    held: list[Any] = []

    def piece(first: int, last: int) -> Any:
        import idelib

        if not held:  # opening reads the whole index: once is enough
            held.append(idelib.importFile(str(path)))
        events = held[0].channels[channel].subchannels[subchannel].getSession()
        values = events.arraySlice(first, last)[1]
        if last >= len(events):
            held.pop().close()
        return values

    return piece


def _utc(seconds: Any) -> datetime | None:
    """None for a recorder whose clock was never set, and began at 1970."""
    return datetime.fromtimestamp(float(seconds), UTC).replace(tzinfo=None) if seconds and seconds > 1e9 else None
