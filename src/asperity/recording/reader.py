"""Helpers of the readers: rate, unit and start among named values; arrays as channels."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any, Protocol, Unpack

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line
from asperity.recording.model import Channel, ChannelFacts
from asperity.recording.sensitivity import sensitivity_text
from asperity.recording.units import RATE_NAMES, START_NAMES, STEP_NAMES, UNIT_NAMES, stated

FEWEST_SAMPLES = 64  # of an array that is a channel; shorter ones describe it
FEWEST_PULSES = 4  # of an array that may hold times of pulses
MOST_CHANNELS = 512  # an array with more columns is not a recording
REMEDY = "copy or export it again"


@contextmanager
def reject_as(path: Path, description: str) -> Iterator[None]:
    """Raise UnreadableFile for any error of a library: "NAME is `description`"."""
    try:
        yield
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(
            f"{path.name} is {description} ({first_line(error)}); {REMEDY}"
        ) from error


def stated_facts(name: str, attributes: Mapping[str, object]) -> ChannelFacts:
    """Return `rate_hz`, `rate_source`, `unit`, `sensitivity`, `started` of a channel, if stated.

    Raises
    ------
    UnreadableFile
        for several rates that differ, or an impossible one.
    """
    rates: dict[str, float] = {}
    for key, value in stated(attributes.items(), RATE_NAMES | STEP_NAMES):
        number = _number(value)
        if number is None:
            continue
        if not 0.0 < number < 1e12:
            raise UnreadableFile(
                f"{name} states {key} = {number:g}, which is not a sampling rate or step; {REMEDY}"
            )
        rates[key] = number if stated([(key, value)], RATE_NAMES) else 1.0 / number
    facts: ChannelFacts = {}
    if rates:
        key, rate = next(iter(rates.items()))
        conflicting = next((k for k, r in rates.items() if abs(r / rate - 1.0) > 1e-4), None)
        if conflicting is not None:
            raise UnreadableFile(
                f"{name} states two sampling rates, {key} and {conflicting}; give it without "
                f"one of them"
            )
        facts = {"rate_hz": rounded_rate(rate, 1e-9), "rate_source": f"file ({key})"}
    for _, value in stated(attributes.items(), UNIT_NAMES):
        text = _text(value)
        if text:
            facts["unit"] = text
    if sensitivity := sensitivity_text(attributes.items()):
        facts["sensitivity"] = sensitivity
    for _, value in stated(attributes.items(), START_NAMES):
        started = parse_time(value)
        if started is not None:
            facts["started"] = started
    return facts


def rounded_rate(rate: float, rounding: float) -> float:
    """Return the whole number of hertz, if just one lies within the relative `rounding`."""
    rounded = float(round(rate))
    return rounded if rounded > 0.0 and abs(rounded / rate - 1.0) <= rounding < 0.5 / rate else rate


def parse_time(value: object) -> datetime | None:
    """Return a time as written in files, in UTC if it states its zone; None if it is no time."""
    if isinstance(value, datetime):
        return _in_utc(value)
    if isinstance(value, np.datetime64):
        seconds = value.astype("datetime64[us]").astype(object)
        return seconds if isinstance(seconds, datetime) else None
    text = (_text(value) or "").strip()
    for form in _TIMES:
        try:
            return datetime.strptime(text, form)
        except ValueError:
            continue
    try:
        return _in_utc(datetime.fromisoformat(text))
    except (ValueError, OverflowError):
        return None


def _in_utc(time: datetime) -> datetime:
    """Return the time in UTC without its zone: local times jump when clocks change."""
    return time if time.tzinfo is None else time.astimezone(UTC).replace(tzinfo=None)


_TIMES = (
    "%Y.%m.%d.%H.%M.%S",  # IMS file names
    "%H:%M:%S.%f %d %b %Y",  # CETR
    "%H:%M:%S %d %b %Y",
    "%d %b %Y %H:%M:%S",
    "%d-%b-%y %H:%M:%S",  # UFF
    "%d-%b-%Y %H:%M:%S",
    "%d.%m.%Y %H:%M:%S",
    "%d.%m.%Y %H:%M:%S.%f",
    "%d.%m.%Y %H:%M:%S,%f",
    "%d.%m.%Y %H:%M",
    "%d.%m.%y %H:%M:%S",
    "%m/%d/%Y %I:%M:%S %p",  # with AM and PM the month comes first
    "%m/%d/%Y %I:%M:%S.%f %p",
    "%m/%d/%Y %I:%M %p",
    "%Y/%m/%d %H:%M:%S.%f",
    "%Y/%m/%d %H:%M:%S",
)


def _number(value: object) -> float | None:
    try:
        array = np.asarray(value.decode() if isinstance(value, bytes) else value)
        return float(array.reshape(-1)[0]) if array.size == 1 else None
    except (TypeError, ValueError, UnicodeDecodeError):
        return None


def _text(value: object) -> str | None:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.reshape(-1)[0]
    if isinstance(value, bytes):
        value = value.decode("utf-8", errors="replace")
    return value.strip() if isinstance(value, str) and value.strip() else None


Reader = Callable[[int, int], npt.ArrayLike]  # first sample, one after the last -> those samples


def sliced_blocks(
    read: Reader, samples: int, notes: list[str], name: str
) -> Callable[[int], Iterator[Field]]:
    """Return a function that yields blocks of a sliceable array; data after damage is left out."""

    def blocks(size: int) -> Iterator[Field]:
        for first in range(0, samples, size):
            try:
                block = np.asarray(
                    read(first, min(first + size, samples)), dtype=np.float64
                ).reshape(-1)
            except Exception as error:
                if first == 0:
                    raise UnreadableFile(
                        f"{name} cannot be read ({first_line(error)}); {REMEDY}"
                    ) from error
                notes.append(
                    f"damaged after sample {first} of {samples}; samples before that were read"
                )
                return
            yield block
            if block.size == 0:
                return

    return blocks


class StoredArray(Protocol):
    """Array whose samples are read by slices."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values along each axis."""
        ...

    def __getitem__(self, where: tuple[int | slice, ...], /) -> Any:
        """Return some values."""
        ...


def columns(
    name: str, array: StoredArray, notes: list[str], **facts: Unpack[ChannelFacts]
) -> Iterator[Channel]:
    """Yield the channels of a sliceable array: one row, or several along its shorter axis.

    Raises
    ------
    UnreadableFile
        for more than two axes, or too many channels.
    """
    shape = tuple(int(n) for n in array.shape if n != 1) or (int(np.prod(array.shape)),)
    if len(shape) > 2 or 0 in shape:
        return
    count = 1 if len(shape) == 1 else min(shape)
    samples = max(shape)
    if count > MOST_CHANNELS or (len(shape) == 2 and len(array.shape) != 2):
        raise UnreadableFile(
            f"{name} is an array of {shape[0]} x {shape[1]}: not a recording; give one row per "
            f"channel"
        )
    for k in range(count):
        label = name if len(shape) == 1 else f"{name}[{k + 1}]"
        blocks = sliced_blocks(partial(_row, array, k), samples, notes, label)
        yield Channel(name=label, blocks=blocks, samples=samples, **facts)


def _row(array: StoredArray, k: int, first: int, last: int) -> Field:
    """Return samples along the longest axis of an array, at `k` along any other."""
    along = int(np.argmax(array.shape))
    where = (slice(first, last) if axis == along else k for axis in range(len(array.shape)))
    return np.asarray(array[tuple(where)])


def holds_series(shape: tuple[int, ...], kind: str) -> bool:
    """Return whether an array holds samples, or at least a `short` row such as times of pulses."""
    size = int(np.prod(shape, dtype=object))
    few = size >= FEWEST_PULSES and kind == "f" and sum(n != 1 for n in shape) == 1
    return size > FEWEST_SAMPLES or few


def numeric(array: object) -> bool:
    """Return whether an array holds real numbers."""
    return getattr(getattr(array, "dtype", None), "kind", "?") in "iuf"
