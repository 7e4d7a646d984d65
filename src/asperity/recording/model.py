"""What a recording is: channels that can be read piece by piece, and facts with the place that states each.

Formats are left to one module each beside this one; which channel is meant and in what unit to
`read`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.signals import Signal
from asperity.core.third_party import suppress_output

ACCELERATION = "m/s^2"
UNKNOWN = "unknown"  # unit of values where nothing states one
FULL_SCALE = "full scale"  # what integer samples are shares of, when nothing says how much that is
BLOCK = 1 << 18  # samples read at a time
IMPOSSIBLE = 1e15  # in any unit: a damaged file's


@dataclass(frozen=True, slots=True)
class Fact:
    """Something known about a recording, and where it is stated: "file", the name of a sidecar, "command line"."""

    value: Any
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One row of samples in a file, not read yet.

    `blocks(n)` yields its values, n at a time, as they are stored, NaN where samples are missing;
    what it finds wrong on the way it says in the `notes` of the file. None stands for what the
    file does not say.
    """

    name: str
    blocks: Callable[[int], Iterator[Field]]
    samples: int | None = None
    rate_hz: float | None = None
    rate_doubt: float = 0.0  # relative standard deviation of the rate, where times state it
    rate_source: str = "file"
    rate_hint: str = ""  # what to say beside "states no sampling rate"
    unit: str | None = None
    started: datetime | None = None
    full_scale: bool = False  # values are shares of the converter's full scale


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What a reader found in a file. `notes` grows while channels are read."""

    format: str
    channels: Sequence[Channel]
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadOptions:
    """What the caller states about recordings; None leaves it to the files. Meanings as in `read_recording`."""

    rate_hz: float | None = None
    unit: str | None = None
    channel: str | None = None
    scale: float | None = None


@dataclass(frozen=True, slots=True)
class Recording(Signal):
    """A signal read from a file, with its facts.

    `facts` holds "rate", "unit", "channel", "format" and, where known, "started" and "scale", each
    with its source. Accelerations are in m/s^2 whatever the file's unit, which stays in `facts`.
    `notes` say in a sentence each what was wrong with the file.
    """

    path: Path
    facts: dict[str, Fact]
    notes: tuple[str, ...] = ()

    @property
    def comparable(self) -> bool:
        """Whether amplitudes such as CRFA can be compared with others: the values are accelerations."""
        return self.unit == ACCELERATION


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenRecording:
    """A recording whose samples are still in the file.

    `samples` is None where only reading to the end would tell; there may be more `notes` once
    `blocks` were read.
    """

    path: Path
    channel: Channel
    rate_hz: float
    unit: str
    scale: float  # of what is stored, to `unit`
    facts: dict[str, Fact]
    first_notes: tuple[str, ...]
    later_notes: list[str]  # the reader adds to them

    @property
    def notes(self) -> tuple[str, ...]:
        """What is wrong with the file, in a sentence each: what was seen so far."""
        return tuple(dict.fromkeys((*self.first_notes, *self.later_notes)))

    @property
    def rate_doubt(self) -> float:
        """Relative standard deviation of the rate: that of the file's times, where they state it."""
        return (
            self.channel.rate_doubt
            if self.facts["rate"].source == self.channel.rate_source
            else 0.0
        )

    @property
    def samples(self) -> int | None:
        """How many samples the file says it holds."""
        return self.channel.samples

    @property
    def started(self) -> datetime | None:
        """When the recording began, if anything says so."""
        return self.facts["started"].value if "started" in self.facts else None

    @property
    def comparable(self) -> bool:
        """Whether amplitudes such as CRFA can be compared with others: the values are accelerations."""
        return self.unit == ACCELERATION

    def blocks(self, samples: int = BLOCK) -> Iterator[Field]:
        """The values in `unit`, at most `samples` at a time; NaN where there is none, or one that cannot be.

        Raises
        ------
        UnreadableFile
            where the file is damaged so that nothing of this channel can be read.
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
        """All samples at once.

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
