"""Reading recordings: which format a file has, which channel is meant, and what states its rate and unit.

Nothing is guessed: what neither the file, nor a sidecar beside it, nor the caller states is asked
for.
"""

import math
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from asperity.core.errors import BadInput, UnreadableFile, require_positive
from asperity.core.files import require_file
from asperity.core.limits import require_unpacked
from asperity.core.third_party import first_line, suppress_output
from asperity.recording import hdf5, ide, matlab, parquet, tdms, text, uff, wav
from asperity.recording import numpy_files as numpys
from asperity.recording import sandboxed as foreign
from asperity.recording.model import (
    ACCELERATION,
    FULL_SCALE,
    UNKNOWN,
    Channel,
    Contents,
    Fact,
    OpenRecording,
    ReadOptions,
    Recording,
)
from asperity.recording.reader import MOST_CHANNELS, REMEDY, parse_time
from asperity.recording.sidecar import OF_THE_MACHINE, OPERATING, stated_beside
from asperity.recording.units import acceleration_scale

_SAME = 1e-4  # relative difference up to which two stated rates agree
_HEAD = 4096


@dataclass(frozen=True, slots=True)
class _Format:
    """How a format is known, by its first bytes; which names promise it; who reads it.

    `library` is somebody else's that reads it, in a process of its own; `package` is where that
    comes from.
    """

    known: Callable[[bytes], bool]
    suffixes: tuple[str, ...]
    read: Callable[[Path], Contents]
    library: str | None = None
    package: str | None = None

    def contents(self, path: Path) -> Contents:
        """All channels of a file, by its own reader."""
        return (
            self.read(path)
            if self.library is None
            else foreign.contents(path, self.read.__module__, self.library)
        )


FORMATS = (  # in the order in which they are tried; text comes after all of them
    _Format(wav.is_wav, ("wav", "rf64", "flac"), wav.read, "soundfile", "soundfile"),
    _Format(matlab.is_matlab, ("mat",), matlab.read, "scipy.io", "scipy"),
    _Format(hdf5.is_hdf5, ("h5", "hdf5", "hdf", "mat", "nc"), hdf5.read, "h5py", "h5py"),
    _Format(tdms.is_tdms, ("tdms",), tdms.read, "nptdms", "npTDMS"),
    _Format(parquet.is_parquet, ("parquet", "pq"), parquet.read, "pyarrow.parquet", "pyarrow"),
    _Format(ide.is_ide, ("ide",), ide.read, "idelib", "idelib"),
    _Format(numpys.is_npy, ("npy",), numpys.read_npy),
    _Format(numpys.is_npz, ("npz",), numpys.read_npz),
    _Format(uff.is_uff, ("uff", "unv", "u58", "bunv"), uff.read, "pyuff", "pyuff"),
)
_TEXT = _Format(text.looks_like_text, tuple(text.SUFFIXES), text.read)
SUFFIXES = {suffix for form in FORMATS for suffix in form.suffixes} | text.SUFFIXES


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


def open_recording(path: str | Path, **stated: Any) -> OpenRecording:
    """Open one channel of a recording, its samples still in the file; otherwise as `read_recording`."""
    with suppress_output():
        return _chosen(Path(path), read_contents(Path(path)), ReadOptions(**stated))


def open_channels(path: str | Path, **stated: Any) -> list[OpenRecording]:
    """Every channel of a recording, opened as by `open_recording`; only the one named, where one is."""
    path, options = Path(path), ReadOptions(**stated)
    with suppress_output():
        contents = read_contents(path)
        if (
            options.channel is not None
            or "channel" in stated_beside(path)[0]
            or len(contents.channels) == 1
        ):
            return [_chosen(path, contents, options)]
        every = [
            _chosen(path, contents, replace(options, channel=channel.name))
            for channel in contents.channels
        ]
    return [
        replace(opened, facts=opened.facts | {"channel": Fact(opened.channel.name, "file")})
        for opened in every
    ]


def other_channel(path: Path, name: str) -> Channel:
    """A channel as it is in the file, whatever a sidecar states of the vibration: a tacho, a load, a temperature."""
    with suppress_output():
        return _channel(path, read_contents(path), name)


def read_contents(path: Path) -> Contents:
    """All channels of a file.

    Raises
    ------
    UnreadableFile
        for a file that is missing, damaged, in no known format or without a time record.
    """
    if path.is_dir():
        raise UnreadableFile(f"{path} is a folder; name the files in it")
    require_file(path)
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise UnreadableFile(
            f"{path} cannot be opened: {error.strerror}; check its permissions"
        ) from None
    if not head:
        raise UnreadableFile(f"{path.name} is empty; {REMEDY}")
    suffix = path.suffix[1:].lower()
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06")) and (packed := _packed(path)):
        raise UnreadableFile(f"{path.name} is {packed}")
    chosen = next((form for form in FORMATS if form.known(head)), None)
    if chosen is None:
        if suffix == "mat" and not text.looks_like_text(head):
            chosen = FORMATS[1]  # MATLAB 4 has no header
        elif any(suffix in form.suffixes for form in FORMATS):
            raise UnreadableFile(
                f"{path.name} is named {suffix} but does not begin like one; {REMEDY}"
            )
        elif not text.looks_like_text(head):
            raise UnreadableFile(
                f"{path.name} is in no format of recordings that asperity knows; export it as wav or csv"
            )
    chosen = chosen or _TEXT
    try:
        contents = chosen.contents(path)
    except BadInput:
        raise
    except ImportError:
        raise UnreadableFile(
            f"{path.name} needs {chosen.package} to be read; pip install 'asperity[recordings]'"
        ) from None
    except MemoryError:
        raise UnreadableFile(
            f"{path.name} claims more data than fits into memory; {REMEDY}"
        ) from None
    except Exception as error:
        raise UnreadableFile(f"{path.name} is damaged ({first_line(error)}); {REMEDY}") from error
    if len(contents.channels) > MOST_CHANNELS:
        raise UnreadableFile(
            f"{path.name} holds {len(contents.channels)} channels, {MOST_CHANNELS} at most; {REMEDY}"
        )
    require_unpacked(path, 8.0 * sum(channel.samples or 0 for channel in contents.channels), REMEDY)
    if not contents.channels:
        raise UnreadableFile(
            f"{path.name} holds no row of samples; give a file with a recording in it"
        )
    return contents


def _packed(path: Path) -> str:
    """What a zip file is, by what lies in it, and what to do with it; empty of an npz, or one too damaged to tell."""
    with suppress(OSError, BadZipFile), ZipFile(path) as packed:
        names = packed.namelist()
        if any(name.startswith("xl/") for name in names):
            return "an Excel workbook; save the sheet that holds the recording as csv"
        if not all(name.endswith(".npy") for name in names) or not names:
            return f"a zip archive of {len(names)} files; unpack it, and name what was in it"
    return ""


def _chosen(path: Path, contents: Contents, options: ReadOptions) -> OpenRecording:
    beside, sidecar = stated_beside(path)
    stated = {key: Fact(value, sidecar) for key, value in beside.items()}
    given = {key: value for key, value in asdict(options).items() if value is not None}
    stated |= {key: Fact(value, "command line") for key, value in given.items()}
    selected = _channel(path, contents, stated["channel"].value if "channel" in stated else None)
    source = stated["channel"].source if "channel" in stated else "file (its only one)"
    facts = {"format": Fact(contents.format, "file"), "channel": Fact(selected.name, source)}
    notes: list[str] = []
    facts["rate"] = _rate(path, selected, stated.get("rate_hz"))
    total = 1.0
    if "scale" in stated:
        total = float(stated["scale"].value)
        if not 0.0 < abs(total) < math.inf:
            raise BadInput(
                f"scale must be finite and not 0, got {total:g}; give scale, what a stored 1 stands for"
            )
        facts["scale"] = Fact(total, stated["scale"].source)
    facts["unit"] = _unit(path, selected, stated.get("unit"), scaled="scale" in stated)
    unit_text = str(facts["unit"].value)
    metres = None if _is_force(selected.name, unit_text) else acceleration_scale(unit_text)
    if metres is not None:
        total, unit_text = total * metres, ACCELERATION
    elif unit_text == "g":
        unit_text = "gram-force"
        notes.append(f"g is taken as grams of force, because the channel is called {selected.name}")
    facts |= {key: stated[key] for key in (*OPERATING, *OF_THE_MACHINE) if key in stated}
    named = parse_time(path.name) or parse_time(path.stem)
    if "started" in stated:
        facts["started"] = stated["started"]
    elif selected.started is not None or named is not None:
        facts["started"] = Fact(
            selected.started or named, "file" if selected.started is not None else "file name"
        )
    return OpenRecording(
        path=path,
        channel=selected,
        rate_hz=float(facts["rate"].value),
        unit=unit_text,
        scale=total,
        facts=facts,
        first_notes=tuple(notes),
        later_notes=contents.notes,
    )


def _channel(path: Path, contents: Contents, requested: str | None) -> Channel:
    channels = contents.channels
    names = [channel.name for channel in channels]
    if requested is None:
        if len(channels) == 1:
            return channels[0]
        rates = sorted({channel.rate_hz for channel in channels if channel.rate_hz is not None})
        differing = f" of {len(rates)} rates" if len(rates) > 1 else ""
        raise BadInput(
            f"{path.name} holds {len(channels)} channels{differing} ({_listed(names)}); give channel, one of them"
        )
    for fits in (requested, requested.strip()):
        if fits in names:
            return channels[names.index(fits)]
    plain = requested.strip().lower()
    matching = [channel for channel in channels if plain in _short_names(channel.name)]
    if len(matching) == 1:
        return matching[0]
    if matching:
        raise BadInput(
            f"{path.name} has {len(matching)} channels {requested!r}; "
            f"give {_listed([channel.name for channel in matching])}"
        )
    if requested.strip().isdecimal() and 0 < int(requested) <= len(channels):
        return channels[int(requested) - 1]
    raise BadInput(f"{path.name} has no channel {requested!r}; it has {_listed(names)}")


def _short_names(name: str) -> set[str]:
    """What else a channel may be called: COF for 1/COF, gs for bearing.gs, 8.0 for 8.0 X (100g)."""
    return {
        part.lower()
        for part in (name.split("/")[-1], name.split("/")[-1].split(".")[-1], name.split(" ")[0])
    }


def _listed(names: list[str]) -> str:
    listed = ", ".join(names[:8])
    return listed if len(names) <= 8 else f"{listed} and {len(names) - 8} more"


def _rate(path: Path, channel: Channel, stated: Fact | None) -> Fact:
    rate = None if stated is None else require_positive("sampling rate", float(stated.value), "Hz")
    if channel.rate_hz is not None:
        if stated is not None and rate is not None and abs(rate / channel.rate_hz - 1.0) > _SAME:
            raise BadInput(
                f"{path.name} states {channel.rate_hz:g} Hz in its "
                f"{channel.rate_source.removeprefix('file ').strip('()')}, the {stated.source} says {rate:g} Hz; "
                "leave out the wrong one"
            )
        return Fact(float(channel.rate_hz), channel.rate_source)
    if stated is None:
        raise BadInput(
            f"{path.name} states no sampling rate{channel.rate_hint}; give rate_hz, "
            f"or state it as rate_hz in {path.name}.toml beside it"
        )
    return Fact(rate, stated.source)


def _unit(path: Path, channel: Channel, stated: Fact | None, *, scaled: bool) -> Fact:
    if stated is None:
        if channel.full_scale:
            return Fact(FULL_SCALE, "file (integer samples)")
        return Fact(UNKNOWN, "nobody") if channel.unit is None else Fact(channel.unit, "file")
    if channel.full_scale and not scaled:
        raise BadInput(
            f"{path.name} holds shares of full scale, so a unit needs its scale; "
            f"give scale, the {stated.value} at full scale"
        )
    if channel.full_scale or channel.unit is None or scaled:
        return stated
    if not _same_unit(channel.unit, stated.value):
        raise BadInput(
            f"{path.name} states its unit as {channel.unit}, the {stated.source} says {stated.value}; "
            "leave it out, or give its scale too"
        )
    return Fact(stated.value, "file")


def _same_unit(unit: str, other: str) -> bool:
    first, second = acceleration_scale(unit), acceleration_scale(other)
    return unit.strip().lower() == other.strip().lower() or (first is not None and first == second)


def _is_force(name: str, unit: str) -> bool:
    """Friction testers write forces in g: not an acceleration where the channel is called a force."""
    last = name.split("/")[-1].split(".")[-1]
    return unit == "g" and re.fullmatch(r"(?i)F[xyznfrt]?|.*(force|load|kraft).*", last) is not None
