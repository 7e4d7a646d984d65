"""National Instruments TDMS, by npTDMS."""

from pathlib import Path
from typing import Any

from asperity.errors import UnreadableFile
from asperity.quiet import first_line
from asperity.recording.common import REMEDY, Reader, facts_in, required, sliced
from asperity.recording.model import Channel, Contents


def is_tdms(head: bytes) -> bool:
    """Whether a file begins like TDMS or its index."""
    return head[:4] in (b"TDSm", b"TDSh")


def read(path: Path) -> Contents:
    """Channels "group/channel"; step, unit and start are the waveform's own properties."""
    import nptdms

    notes: list[str] = []
    channels = []
    try:
        with nptdms.TdmsFile.open(path) as opened:
            if opened.file_status.incomplete_final_segment:
                notes.append("cut short: its last segment is not complete")
            for group in opened.groups():
                for channel in group.channels():
                    if (
                        channel.data_type is None
                        or len(channel) == 0
                        or getattr(channel.dtype, "kind", "") not in "iuf"
                    ):
                        continue
                    properties = dict(opened.properties) | dict(group.properties) | dict(channel.properties)
                    name = f"{group.name}/{channel.name}"
                    reader = _slices(path, group.name, channel.name)
                    facts = facts_in(path.name, properties)
                    channels.append(
                        Channel(
                            name=name, blocks=sliced(reader, len(channel), notes, name), samples=len(channel), **facts
                        )
                    )
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path.name} is no readable TDMS file ({first_line(error)}); {REMEDY}") from error
    return Contents(format="tdms", channels=required(channels, path.name), notes=notes)


def _slices(path: Path, group: str, channel: str) -> Reader:
    def piece(first: int, last: int) -> Any:
        import nptdms

        with nptdms.TdmsFile.open(path) as opened:
            return opened[group][channel].read_data(first, last - first)

    return piece
