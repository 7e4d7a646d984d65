"""National Instruments TDMS, by npTDMS."""

from functools import partial
from pathlib import Path

import numpy.typing as npt

from asperity.recording.model import Channel, Contents
from asperity.recording.reader import numeric, reject_as, sliced_blocks, stated_facts


def is_tdms(head: bytes) -> bool:
    """Return whether a file starts like TDMS or its index."""
    return head[:4] in (b"TDSm", b"TDSh")


def read(path: Path) -> Contents:
    """Read channels "group/channel"; step, unit and start are the waveform's own properties."""
    import nptdms

    notes: list[str] = []
    channels = []
    with reject_as(path, "not a readable TDMS file"), nptdms.TdmsFile.open(path) as opened:
        if opened.file_status.incomplete_final_segment:
            notes.append("cut short: its last segment is not complete")
        for group in opened.groups():
            for channel in group.channels():
                if channel.data_type is None or len(channel) == 0 or not numeric(channel):
                    continue
                facts = stated_facts(
                    path.name, {**opened.properties, **group.properties, **channel.properties}
                )
                name = f"{group.name}/{channel.name}"
                samples = len(channel)
                blocks = sliced_blocks(
                    partial(_slice, path, group.name, channel.name), samples, notes, name
                )
                channels.append(Channel(name=name, blocks=blocks, samples=samples, **facts))
    return Contents(format="tdms", channels=channels, notes=notes)


def _slice(path: Path, group: str, channel: str, first: int, last: int) -> npt.ArrayLike:
    import nptdms

    with nptdms.TdmsFile.open(path) as opened:
        samples: npt.ArrayLike = opened[group][channel].read_data(first, last - first)
    return samples
