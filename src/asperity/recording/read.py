"""Reading of recordings: detects the format, selects the channel, and resolves rate and unit.

Nothing is guessed: facts that neither the file, nor its sidecar, nor the caller states are
requested.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

from asperity.core.errors import BadInput, UnreadableFile, install_text, require_positive
from asperity.core.files import require_file
from asperity.core.limits import require_plausible_size
from asperity.core.third_party import first_line, suppress_output
from asperity.recording import (
    hdf5,
    ide,
    matlab,
    numpy_files,
    parquet,
    sandboxed,
    tdms,
    text,
    uff,
    wav,
)
from asperity.recording.conversion import convert
from asperity.recording.model import Channel, Contents, Fact, OpenRecording, ReadOptions, Recording
from asperity.recording.reader import MOST_CHANNELS, REMEDY, parse_time
from asperity.recording.sidecar import MACHINE_KEYS, OPERATING_KEYS, read_sidecar
from asperity.recording.text_header import looks_like_text

_SAME_RATE = 1e-4  # relative difference of rates that agree
_HEAD_BYTES = 4096


@dataclass(frozen=True, slots=True)
class _Format:
    """Recording format: recognition by the first bytes, expected suffixes, and reader.

    `library` is a third-party one that reads it in a separate process; `package` provides it.
    """

    recognises: Callable[[bytes], bool]
    suffixes: tuple[str, ...]
    read: Callable[[Path], Contents]
    library: str | None = None
    package: str | None = None

    def contents(self, path: Path) -> Contents:
        """Read the list of channels with this format's reader."""
        return (
            self.read(path)
            if self.library is None
            else sandboxed.contents(path, self.read.__module__, self.library)
        )


FORMATS = (  # tried in this order; text is last
    _Format(wav.is_wav, ("wav", "rf64", "flac"), wav.read, "soundfile", "soundfile"),
    _Format(matlab.is_matlab, ("mat",), matlab.read, "scipy.io", "scipy"),
    _Format(hdf5.is_hdf5, ("h5", "hdf5", "hdf", "mat", "nc"), hdf5.read, "h5py", "h5py"),
    _Format(tdms.is_tdms, ("tdms",), tdms.read, "nptdms", "npTDMS"),
    _Format(parquet.is_parquet, ("parquet", "pq"), parquet.read, "pyarrow.parquet", "pyarrow"),
    _Format(ide.is_ide, ("ide",), ide.read, "idelib", "idelib"),
    _Format(numpy_files.is_npy, ("npy",), numpy_files.read_npy),
    _Format(numpy_files.is_npz, ("npz",), numpy_files.read_npz),
    _Format(uff.is_uff, ("uff", "unv", "u58", "bunv"), uff.read, "pyuff", "pyuff"),
)
_TEXT = _Format(looks_like_text, tuple(text.SUFFIXES), text.read)
SUFFIXES = {suffix for form in FORMATS for suffix in form.suffixes} | text.SUFFIXES


def read_recording(
    path: str | Path,
    *,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
) -> Recording:
    """Read one channel of a recording completely; accelerations in m/s^2.

    Parameters
    ----------
    path : csv and other text, npy, npz, mat, wav, tdms, uff 58, hdf5, parquet or enDAQ ide,
        recognised by content
    rate_hz : samples per second, for files that do not state it
    unit : of the values, such as "g", for files that do not state it
    channel : name or number (from 1) of the channel, where the file has several
    scale : value of a stored 1 in `unit`: "g at full scale" for integer wav, g per volt for volts

    Raises
    ------
    UnreadableFile
        for a file that is missing, damaged, in no known format or without a time record.
    BadInput
        for a rate or channel that is not stated, or one that contradicts the file.
    """
    return open_recording(path, rate_hz=rate_hz, unit=unit, channel=channel, scale=scale).read()


def open_recording(path: str | Path, **stated: Any) -> OpenRecording:
    """Open one channel of a recording, its samples still in the file; as `read_recording`."""
    with suppress_output():
        return _open_chosen(Path(path), read_contents(Path(path)), ReadOptions(**stated))


def open_channels(path: str | Path, **stated: Any) -> list[OpenRecording]:
    """Open every channel of a recording as `open_recording` does; only the named one, if any."""
    path, options = Path(path), ReadOptions(**stated)
    with suppress_output():
        contents = read_contents(path)
        if (
            options.channel is not None
            or "channel" in read_sidecar(path)[0]
            or len(contents.recorded) == 1
        ):
            return [_open_chosen(path, contents, options)]
        opened_channels = [
            _open_chosen(path, contents, replace(options, channel=channel.name))
            for channel in contents.recorded
        ]
    return [
        replace(opened, facts=opened.facts | {"channel": Fact(opened.channel.name, "file")})
        for opened in opened_channels
    ]


def raw_channel(path: Path, name: str) -> Channel:
    """Return a channel without the sidecar's facts on vibration: a tacho, load or temperature."""
    with suppress_output():
        return _channel(path, read_contents(path), name)


def read_contents(path: Path) -> Contents:
    """Return the list of channels of a file.

    Raises
    ------
    UnreadableFile
        for a file that is missing, damaged, in no known format or without a time record.
    """
    chosen = _recognised(path)
    try:
        contents = chosen.contents(path)
    except BadInput:
        raise
    except ImportError:
        raise UnreadableFile(
            f"{path.name} needs {chosen.package} to be read; {install_text('recordings')}"
        ) from None
    except MemoryError:
        raise UnreadableFile(
            f"{path.name} claims more data than fits into memory; {REMEDY}"
        ) from None
    except Exception as error:
        raise UnreadableFile(f"{path.name} is damaged ({first_line(error)}); {REMEDY}") from error
    if len(contents.channels) > MOST_CHANNELS:
        raise UnreadableFile(
            f"{path.name} holds {len(contents.channels)} channels, more than {MOST_CHANNELS}; "
            f"{REMEDY}"
        )
    require_plausible_size(
        path, 8.0 * sum(channel.samples or 0 for channel in contents.channels), REMEDY
    )
    if not contents.recorded:
        raise UnreadableFile(
            f"{path.name} holds no row of samples; give a file with a recording in it"
        )
    return contents


def _recognised(path: Path) -> _Format:
    """Return the format of a file by its first bytes, or else its suffix."""
    head = _first_bytes(path)
    suffix = path.suffix[1:].lower()
    if head.startswith((b"PK\x03\x04", b"PK\x05\x06")) and (archive := _zip_contents(path)):
        raise UnreadableFile(f"{path.name} is {archive}")
    chosen = next((form for form in FORMATS if form.recognises(head)), None)
    if chosen is not None:
        return chosen
    if suffix == "mat" and not looks_like_text(head):
        return FORMATS[1]  # MATLAB 4 has no header
    if any(suffix in form.suffixes for form in FORMATS):
        raise UnreadableFile(f"{path.name} is named {suffix} but does not begin like one; {REMEDY}")
    if not looks_like_text(head):
        raise UnreadableFile(
            f"{path.name} is in no supported recording format; export it as wav or csv"
        )
    return _TEXT


def _first_bytes(path: Path) -> bytes:
    if path.is_dir():
        raise UnreadableFile(f"{path} is a folder; name the files in it")
    require_file(path)
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise UnreadableFile(
            f"{path} cannot be opened: {error.strerror}; check its permissions"
        ) from None
    if not head:
        raise UnreadableFile(f"{path.name} is empty; {REMEDY}")
    return head


def _zip_contents(path: Path) -> str:
    """Describe a zip file that is not an npz, with a remedy; empty for npz or a damaged file."""
    with suppress(OSError, BadZipFile), ZipFile(path) as archive:
        names = archive.namelist()
        if any(name.startswith("xl/") for name in names):
            return "an Excel workbook; save the sheet that holds the recording as csv"
        if not all(name.endswith(".npy") for name in names) or not names:
            return f"a zip archive of {len(names)} files; unpack it and name a file in it"
    return ""


def _open_chosen(path: Path, contents: Contents, options: ReadOptions) -> OpenRecording:
    stated = _stated_facts(path, options)
    requested = stated.get("channel", Fact(None, "file (its only one)"))
    selected = _channel(path, contents, requested.value)
    facts = {
        "format": Fact(contents.format, "file"),
        "channel": Fact(selected.name, requested.source),
        "rate": _rate(path, selected, stated.get("rate_hz")),
    }
    conversion = convert(path, selected, stated)
    facts |= conversion.facts
    facts |= {key: stated[key] for key in (*OPERATING_KEYS, *MACHINE_KEYS) if key in stated}
    started = stated.get("started") or _start(path, selected)
    if started is not None:
        facts["started"] = started
    return OpenRecording(
        path=path,
        channel=selected,
        rate_hz=float(facts["rate"].value),
        unit=conversion.unit,
        scale=conversion.scale,
        facts=facts,
        first_notes=conversion.notes,
        later_notes=contents.notes,
    )


def _stated_facts(path: Path, options: ReadOptions) -> dict[str, Fact]:
    """Return the facts of the sidecar and of the caller, which take precedence."""
    sidecar_facts, sidecar = read_sidecar(path)
    stated_options = {key: value for key, value in asdict(options).items() if value is not None}
    return {key: Fact(value, sidecar) for key, value in sidecar_facts.items()} | {
        key: Fact(value, "command line") for key, value in stated_options.items()
    }


def _start(path: Path, channel: Channel) -> Fact | None:
    """Return the start stated in the file or by its name, or None."""
    if channel.started is not None:
        return Fact(channel.started, "file")
    from_name = parse_time(path.name) or parse_time(path.stem)
    return None if from_name is None else Fact(from_name, "file name")


def _channel(path: Path, contents: Contents, requested: str | None) -> Channel:
    channels = sorted(contents.channels, key=lambda channel: channel.short)
    names = [channel.name for channel in channels]
    if requested is None:
        channels = contents.recorded
        names = [channel.name for channel in channels]
        if len(channels) == 1:
            return channels[0]
        rates = sorted({channel.rate_hz for channel in channels if channel.rate_hz is not None})
        differing = f" of {len(rates)} rates" if len(rates) > 1 else ""
        raise BadInput(
            f"{path.name} holds {len(channels)} channels{differing} ({_listed(names)}); give "
            f"channel, one of them"
        )
    for candidate in (requested, requested.strip()):
        if candidate in names:
            return channels[names.index(candidate)]
    lowercase = requested.strip().lower()
    matching = [channel for channel in channels if lowercase in _short_names(channel.name)]
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
    """Return other names of a channel: COF for 1/COF, gs for bearing.gs, 8.0 for 8.0 X (100g)."""
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
        if (
            stated is not None
            and rate is not None
            and abs(rate / channel.rate_hz - 1.0) > _SAME_RATE
        ):
            raise BadInput(
                f"{path.name} states {channel.rate_hz:g} Hz in its "
                f"{channel.rate_source.removeprefix('file ').strip('()')}, the {stated.source} "
                f"{rate:g} Hz; remove the wrong one"
            )
        return Fact(float(channel.rate_hz), channel.rate_source)
    if stated is None:
        raise BadInput(
            f"{path.name} states no sampling rate{channel.rate_hint}; give `rate_hz`, "
            f"or state it as rate_hz in {path.name}.toml beside it"
        )
    return Fact(rate, stated.source)
