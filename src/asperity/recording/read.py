"""Reading recordings: which format a file has, which channel is meant, and what states its rate and unit.

Nothing is guessed: what neither the file, nor a sidecar beside it, nor the caller states is asked for.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from asperity.errors import BadInput, UnreadableFile, require_positive
from asperity.quiet import first_line, quietly
from asperity.recording import hdf5, ide, matlab, numpys, parquet, tdms, text, uff, wav
from asperity.recording.common import REMEDY, when
from asperity.recording.model import (
    ACCELERATION,
    FULL_SCALE,
    UNKNOWN,
    Channel,
    Contents,
    Fact,
    OpenRecording,
    Recording,
)
from asperity.recording.sidecar import beside
from asperity.recording.units import acceleration_scale

_SAME = 1e-4  # relative difference up to which two stated rates agree
_HEAD = 4096


@dataclass(frozen=True, slots=True)
class _Format:
    """How a format is known, by its first bytes; which names promise it; who reads it."""

    known: Callable[[bytes], bool]
    suffixes: tuple[str, ...]
    read: Callable[[Path], Contents]
    library: str | None = None


FORMATS = (  # in the order in which they are tried; text comes after all of them
    _Format(wav.is_wav, ("wav", "rf64", "flac"), wav.read, "soundfile"),
    _Format(matlab.is_matlab, ("mat",), matlab.read),
    _Format(hdf5.is_hdf5, ("h5", "hdf5", "hdf", "mat", "nc"), hdf5.read),
    _Format(tdms.is_tdms, ("tdms",), tdms.read, "npTDMS"),
    _Format(parquet.is_parquet, ("parquet", "pq"), parquet.read, "pyarrow"),
    _Format(ide.is_ide, ("ide",), ide.read, "idelib"),
    _Format(numpys.is_npy, ("npy",), numpys.read_npy),
    _Format(numpys.is_npz, ("npz",), numpys.read_npz),
    _Format(uff.is_uff, ("uff", "unv", "u58", "bunv"), uff.read, "pyuff"),
)
SUFFIXES = {suffix for one in FORMATS for suffix in one.suffixes} | text.SUFFIXES


def read_recording(
    path: str | Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
) -> Recording:
    """Read one channel of a recording whole; accelerations in m/s^2.

    Parameters
    ----------
    path : csv and other text, npy, npz, mat, wav, tdms, uff 58, hdf5, parquet or enDAQ ide, known by its content
    rate_hz : samples a second, for files that do not state it
    unit : of the values, such as "g", for files that do not state it
    channel : name or number (from 1) of the channel, where the file has several
    scale : what a stored 1 stands for, in `unit`: "g at full scale" for integer wav, g per volt for volts

    Raises
    ------
    UnreadableFile
        for a file that is missing, damaged, in no known format or without a time record.
    BadInput
        for a rate or channel that nothing states, or one that contradicts what the file states.
    """
    return open_recording(path, rate_hz=rate_hz, unit=unit, channel=channel, scale=scale).read()


def open_recording(
    path: str | Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
) -> OpenRecording:
    """Open one channel of a recording, its samples still in the file; otherwise as `read_recording`."""
    path = Path(path)
    with quietly():
        contents = read_contents(path)
        return _chosen(path, contents, rate_hz=rate_hz, unit=unit, channel=channel, scale=scale)


def open_channels(path: str | Path, **given: Any) -> list[OpenRecording]:
    """Every channel of a recording, opened as by `open_recording`; only the one named, where one is."""
    path = Path(path)
    with quietly():
        contents = read_contents(path)
        stated, _ = beside(path)
        if given.get("channel") is not None or "channel" in stated or len(contents.channels) == 1:
            return [_chosen(path, contents, **given)]
        every = [_chosen(path, contents, **given | {"channel": one.name}) for one in contents.channels]
        return [replace(one, facts=one.facts | {"channel": Fact(one.channel.name, "file")}) for one in every]


def read_contents(path: Path) -> Contents:
    """All channels of a file.

    Raises
    ------
    UnreadableFile
        for a file that is missing, damaged, in no known format or without a time record.
    """
    if not path.is_file():
        said = "is a folder; name the files in it" if path.is_dir() else "does not exist; check its name"
        raise UnreadableFile(f"{path} {said}")
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise UnreadableFile(f"{path} cannot be opened: {error.strerror}; check its permissions") from None
    if not head:
        raise UnreadableFile(f"{path.name} is empty; {REMEDY}")
    suffix = path.suffix[1:].lower()
    chosen = next((one for one in FORMATS if one.known(head)), None)
    if chosen is None:
        if suffix == "mat" and not text.looks_like_text(head):
            chosen = FORMATS[1]  # MATLAB 4 has no header
        elif any(suffix in one.suffixes for one in FORMATS):
            raise UnreadableFile(f"{path.name} is named {suffix} but does not begin like one; {REMEDY}")
        elif not text.looks_like_text(head):
            raise UnreadableFile(
                f"{path.name} is in no format of recordings that asperity knows; export it as wav or csv"
            )
    reader, library = (text.read, None) if chosen is None else (chosen.read, chosen.library)
    try:
        return reader(path)
    except (UnreadableFile, BadInput):
        raise
    except ImportError:
        raise UnreadableFile(f"{path.name} needs {library} to be read; pip install 'asperity[recordings]'") from None
    except MemoryError:
        raise UnreadableFile(f"{path.name} claims more data than fits into memory; {REMEDY}") from None
    except Exception as error:
        raise UnreadableFile(f"{path.name} is damaged ({first_line(error)}); {REMEDY}") from error


def _chosen(
    path: Path,
    contents: Contents,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
) -> OpenRecording:
    stated, sidecar = beside(path)
    asked, asked_by = (channel, "command line") if channel is not None else (stated.get("channel"), sidecar)
    one = _channel(path, contents, asked)
    facts = {
        "format": Fact(contents.format, "file"),
        "channel": Fact(one.name, asked_by if asked is not None else "file (its only one)"),
    }
    notes: list[str] = []
    facts["rate"] = _rate(path, one, rate_hz, (stated.get("rate_hz"), sidecar))
    factor = scale if scale is not None else stated.get("scale")
    if factor is not None:
        facts["scale"] = Fact(float(factor), "command line" if scale is not None else sidecar)
    facts["unit"] = _unit(path, one, unit, (stated.get("unit"), sidecar), scaled=factor is not None)
    unit_text = str(facts["unit"].value)
    total = 1.0 if factor is None else float(factor)
    metres = None if _is_force(one.name, unit_text) else acceleration_scale(unit_text)
    if metres is not None:
        total, unit_text = total * metres, ACCELERATION
    elif unit_text == "g":
        unit_text = "gram-force"
        notes.append(f"g is taken as grams of force, because the channel is called {one.name}")
    began = _start(path, one, (stated.get("started"), sidecar))
    if began is not None:
        facts["started"] = began
    return OpenRecording(
        path=path,
        channel=one,
        rate_hz=float(facts["rate"].value),
        unit=unit_text,
        scale=total,
        facts=facts,
        first_notes=tuple(notes),
        later_notes=contents.notes,
    )


def _channel(path: Path, contents: Contents, asked: str | None) -> Channel:
    channels = contents.channels
    names = [one.name for one in channels]
    if asked is None:
        if len(channels) == 1:
            return channels[0]
        rates = sorted({one.rate_hz for one in channels if one.rate_hz is not None})
        differing = f" of {len(rates)} rates" if len(rates) > 1 else ""
        raise BadInput(
            f"{path.name} holds {len(channels)} channels{differing} ({_listed(names)}); give channel, one of them"
        )
    for fits in (asked, asked.strip()):
        if fits in names:
            return channels[names.index(fits)]
    plain = asked.strip().lower()
    meant = [one for one in channels if plain in _short_names(one.name)]
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise BadInput(f"{path.name} has {len(meant)} channels {asked!r}; give {_listed([one.name for one in meant])}")
    if asked.strip().isdigit() and 0 < int(asked) <= len(channels):
        return channels[int(asked) - 1]
    raise BadInput(f"{path.name} has no channel {asked!r}; it has {_listed(names)}")


def _short_names(name: str) -> set[str]:
    """What else a channel may be called: COF for 1/COF, gs for bearing.gs, 8.0 for 8.0 X (100g)."""
    return {part.lower() for part in (name.split("/")[-1], name.split("/")[-1].split(".")[-1], name.split(" ")[0])}


def _listed(names: list[str]) -> str:
    shown = ", ".join(names[:8])
    return shown if len(names) <= 8 else f"{shown} and {len(names) - 8} more"


def _rate(path: Path, one: Channel, given: float | None, sidecar: tuple[float | None, str]) -> Fact:
    if given is not None:
        require_positive("sampling rate", given, "Hz")
    others = [(given, "command line"), sidecar]
    rate, source = next(((value, name) for value, name in others if value is not None), (None, ""))
    if one.rate_hz is not None:
        if rate is not None and abs(rate / one.rate_hz - 1.0) > _SAME:
            raise BadInput(
                f"{path.name} states {one.rate_hz:g} Hz in its {one.rate_source.removeprefix('file ').strip('()')}, "
                f"the {source} says {rate:g} Hz; leave out the wrong one"
            )
        return Fact(float(one.rate_hz), one.rate_source)
    if rate is None:
        raise BadInput(
            f"{path.name} states no sampling rate{one.rate_hint}; give rate_hz, "
            f"or state it as rate_hz in {path.name}.toml beside it"
        )
    return Fact(float(rate), source)


def _unit(path: Path, one: Channel, given: str | None, sidecar: tuple[str | None, str], *, scaled: bool) -> Fact:
    others = [(given, "command line"), sidecar]
    unit, source = next(((value, name) for value, name in others if value is not None), (None, ""))
    if one.full_scale:
        if unit is not None and not scaled:
            raise BadInput(
                f"{path.name} holds shares of full scale, so a unit needs its scale; "
                f"give scale, the {unit} at full scale"
            )
        return Fact(unit or FULL_SCALE, source or "file (integer samples)")
    if one.unit is not None and unit is not None and not scaled and not _same_unit(one.unit, unit):
        raise BadInput(
            f"{path.name} states its unit as {one.unit}, the {source} says {unit}; leave it out, or give its scale too"
        )
    if unit is not None:
        return Fact(unit, source if one.unit is None or scaled else "file")
    return Fact(UNKNOWN, "nobody") if one.unit is None else Fact(one.unit, "file")


def _same_unit(one: str, other: str) -> bool:
    first, second = acceleration_scale(one), acceleration_scale(other)
    return one.strip().lower() == other.strip().lower() or (first is not None and first == second)


def _is_force(name: str, unit: str) -> bool:
    """Friction testers write forces in g: not an acceleration where the channel is called a force."""
    last = name.split("/")[-1].split(".")[-1]
    return unit == "g" and re.fullmatch(r"(?i)F[xyznfrt]?|.*(force|load|kraft).*", last) is not None


def _start(path: Path, one: Channel, sidecar: tuple[Any, str]) -> Fact | None:
    if sidecar[0] is not None:
        return Fact(*sidecar)
    if one.started is not None:
        return Fact(one.started, "file")
    named = when(path.name) or when(path.stem)
    return None if named is None else Fact(named, "file name")
