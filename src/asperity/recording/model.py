"""A recording: channels that can be read in blocks, and facts with their sources.

Each format has a module next to this one; `read` chooses the channel and the unit.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.signals import Signal
from asperity.core.third_party import suppress_output
from asperity.recording.units import velocity_scale

ACCELERATION = "m/s^2"
UNKNOWN = "unknown"  # unit of values where nothing states one
FULL_SCALE = "full scale"  # unit of integer samples whose full scale is not stated
BLOCK = 1 << 18  # samples read at a time
IMPOSSIBLE = 1e15  # in any unit: the file is damaged


@dataclass(frozen=True, slots=True)
class Fact:
    """A fact about a recording and its source: "file", the name of a sidecar, "command line"."""

    value: Any
    source: str


class ChannelFacts(TypedDict, total=False):
    """Facts about a channel that a file states, as fields of `Channel`."""

    rate_hz: float
    rate_doubt: float
    rate_source: str
    rate_hint: str
    unit: str
    sensitivity: str
    started: datetime


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One row of samples in a file, not read yet.

    `blocks(n)` yields its stored values, n at a time, NaN where samples are missing; problems found
    while reading are added to the `notes` of the file. None means that the file does not state it.
    """

    name: str
    blocks: Callable[[int], Iterator[Field]]
    samples: int | None = None
    rate_hz: float | None = None
    rate_doubt: float = 0.0  # relative standard deviation of the rate, where times state it
    rate_source: str = "file"
    rate_hint: str = ""  # added to "states no sampling rate"
    unit: str | None = None
    sensitivity: str | None = None  # of its sensor, such as 100 mV/g
    started: datetime | None = None
    full_scale: bool = False  # values are shares of the converter's full scale
    short: bool = False  # a few values, such as times of a tacho's pulses: read by name only


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """Result of a reader. `notes` grows while channels are read."""

    format: str
    channels: Sequence[Channel]
    notes: list[str] = field(default_factory=list)

    @property
    def recorded(self) -> list[Channel]:
        """Channels that are recordings of a signal."""
        return [channel for channel in self.channels if not channel.short]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadOptions:
    """Facts that the caller states, as in `read_recording`; None leaves them to the files."""

    rate_hz: float | None = None
    unit: str | None = None
    channel: str | None = None
    scale: float | None = None


@dataclass(frozen=True, slots=True)
class Recording(Signal):
    """A signal read from a file, with its facts.

    `facts` holds "rate", "unit", "channel", "format" and, where known, "started" and "scale", each
    with its source. Accelerations are in m/s^2 whatever the file's unit, which stays in `facts`.
    `notes` are sentences about problems of the file.
    """

    path: Path
    facts: dict[str, Fact]
    notes: tuple[str, ...] = ()

    @property
    def comparable(self) -> bool:
        """True for accelerations: amplitudes such as CRFA can be compared with others."""
        return self.unit == ACCELERATION


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenRecording:
    """A recording whose samples are still in the file.

    `samples` is None where only reading to the end would tell; `notes` may grow as `blocks` are
    read.
    """

    path: Path
    channel: Channel
    rate_hz: float
    unit: str
    scale: float  # from stored values to `unit`
    facts: dict[str, Fact]
    first_notes: tuple[str, ...]
    later_notes: list[str]  # the reader adds to them

    @property
    def notes(self) -> tuple[str, ...]:
        """Problems of the file found so far, one sentence each."""
        return tuple(dict.fromkeys((*self.first_notes, *self.later_notes)))

    @property
    def rate_doubt(self) -> float:
        """Relative standard deviation of the rate, where the file's times state it."""
        return (
            self.channel.rate_doubt
            if self.facts["rate"].source == self.channel.rate_source
            else 0.0
        )

    @property
    def samples(self) -> int | None:
        """Number of samples according to the file."""
        return self.channel.samples

    @property
    def started(self) -> datetime | None:
        """Start of the recording, if stated."""
        return self.facts["started"].value if "started" in self.facts else None

    @property
    def comparable(self) -> bool:
        """True for accelerations: amplitudes such as CRFA can be compared with others."""
        return self.unit == ACCELERATION

    @property
    def velocity_factor(self) -> float | None:
        """Metres per second in one `unit`; None if it is not a unit of velocity."""
        return velocity_scale(self.unit)

    def blocks(self, samples: int = BLOCK) -> Iterator[Field]:
        """Yield the values in `unit`, at most `samples` at a time; NaN where missing or impossible.

        Raises
        ------
        UnreadableFile
            where damage makes this channel unreadable.
        """
        source = self.channel.blocks(samples)
        while True:
            with suppress_output():
                block = next(source, None)
            if block is None:
                return
            values = np.asarray(block, dtype=np.float64)
            if values.size and not max(values.max(), -values.min()) < IMPOSSIBLE:
                values = np.where(np.abs(values) < IMPOSSIBLE, values, np.nan)
            yield values * self.scale if self.scale != 1.0 else values

    def read(self) -> Recording:
        """Read all samples at once.

        Raises
        ------
        UnreadableFile
            for fewer than two samples, or as `blocks`.
        """
        parts = list(self.blocks())
        values = np.concatenate(parts) if parts else np.empty(0)
        if values.size < 2:
            raise UnreadableFile(
                f"{self.path.name} holds {values.size} samples; a recording needs at least 2"
            )
        return Recording(values, self.rate_hz, self.unit, self.path, self.facts, self.notes)
