"""National Instruments TDMS, by npTDMS."""

from pathlib import Path
from typing import Any

from asperity.errors import UnreadableFile
from asperity.quiet import first_line
from asperity.recording.common import REMEDY, Reader, facts_in, only, sliced
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
                for one in group.channels():
                    if one.data_type is None or len(one) == 0 or getattr(one.dtype, "kind", "") not in "iuf":
                        continue
                    properties = dict(opened.properties) | dict(group.properties) | dict(one.properties)
                    name = f"{group.name}/{one.name}"
                    reader = _slices(path, group.name, one.name)
                    facts = facts_in(path.name, properties)
                    channels.append(
                        Channel(name=name, blocks=sliced(reader, len(one), notes, name), samples=len(one), **facts)
                    )
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path.name} is no readable TDMS file ({first_line(error)}); {REMEDY}") from error
    return Contents(format="tdms", channels=only(channels, path.name), notes=notes)


def _slices(path: Path, group: str, channel: str) -> Reader:
    def piece(first: int, last: int) -> Any:
        import nptdms

        with nptdms.TdmsFile.open(path) as opened:
            return opened[group][channel].read_data(first, last - first)

    return piece
