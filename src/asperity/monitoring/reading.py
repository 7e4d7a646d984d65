"""Reading of recordings: each file is read once, checked and averaged to a spectrum, in parallel.

`judgement` judges the spectra of a series.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from io import BytesIO
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.processes import ignore_interrupts
from asperity.core.signals import Spectrum, averaged_spectrum
from asperity.core.storage import CONTENT_ENTRY, append_digest, strip_digest, unpack_arrays
from asperity.monitoring.auxiliary_channels import (
    AuxiliaryData,
    bands,
    envelope_and_lines,
    fault_rates,
    lines,
    order_tracked,
    read_auxiliary,
)
from asperity.monitoring.files import RecordingPlace
from asperity.monitoring.target import Target
from asperity.rating import velocity_rms
from asperity.recording import (
    OpenRecording,
    Quality,
    ReadOptions,
    SampleStatistics,
    open_recording,
    read_sidecar,
)
from asperity.vibration import Envelope

WINDOW = "hann"
FINEST_HZ = 0.5  # least spacing of lines: resolves shaft harmonics a few hertz apart
# averages of a record, while lines stay LINES_IN_WIDTH times narrower than the resonance
PIECES = 8
LINES_IN_WIDTH = 16
MIN_POOL_BYTES = 32 << 20  # total size from which parallel reading is worth a second of start-up


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Result of reading one file; without a `spectrum`, `reason` states why.

    `sensor` is its name, empty if not stated. `bands` are rms in bands, `lines` rms at the
    frequencies of faults and meshes with two harmonics. `rate_doubt` is the relative standard
    deviation of the sampling rate. `facts` are texts by name with their sources; `started` is in
    ISO format or empty. `depths` are the modulation depths of the envelope at fault frequencies;
    `velocity` is rms from 10 to 1000 Hz [m/s], nan for short recordings and for values other than
    accelerations and velocities.
    """

    file: str
    sensor: str = ""
    spectrum: Spectrum | None = None
    quality: Quality | None = None
    rate_hz: float = np.nan
    rate_doubt: float = 0.0
    unit: str = ""
    facts: dict[str, tuple[str, str]] = field(default_factory=dict)
    started: str = ""
    velocity: float = np.nan
    depths: dict[str, float] = field(default_factory=dict)
    lines: dict[str, float] = field(default_factory=dict)
    bands: dict[str, float] = field(default_factory=dict)
    reason: str = ""

    @property
    def refused(self) -> bool:
        """True if nothing could be read."""
        return self.spectrum is None and self.quality is None

    @property
    def usable(self) -> bool:
        """True if its spectrum can be used."""
        return self.spectrum is not None and not self.reason

    @property
    def time(self) -> datetime | None:
        """Start of the recording; None if unknown."""
        return datetime.fromisoformat(self.started) if self.started else None


def channels_in(channel: str | None) -> list[str | None]:
    """Return the requested channels; a name with a comma has to be given as a number."""
    names = [] if channel is None else [name.strip() for name in channel.split(",") if name.strip()]
    if len(set(names)) < len(names):
        raise BadInput(f"channel {channel} names a channel twice; name each once")
    return [*names] or [None]


def read_spectrum(
    path: Path,
    options: ReadOptions,
    target: Target,
    spacing_hz: float,
    place: RecordingPlace | None = None,
) -> Reading:
    """Read facts, quality and averaged spectrum of a file; faults become its `reason`."""
    try:
        opened = open_recording(path, **asdict(options))
    except BadInput as refusal:
        return Reading(file=str(path), sensor=_sensor_of_refused(path, place), reason=str(refusal))
    partial = _with_facts(path, opened, place)
    auxiliary = read_auxiliary(opened, place)
    rates_hz = fault_rates(opened, auxiliary, target)
    statistics = SampleStatistics()
    envelope = Envelope(opened.rate_hz)
    blocks = statistics.without_stuck(statistics.pass_through(opened.blocks()))
    spectrum, failed = None, ""
    try:
        spectrum = averaged_spectrum(
            envelope.watch(blocks) if rates_hz else blocks,
            opened.rate_hz,
            opened.unit,
            segment=segment_length(opened.rate_hz, spacing_hz),
            window=WINDOW,
        )
    except UnreadableFile as refusal:
        return replace(partial, reason=str(refusal))
    except BadInput as refusal:
        failed = str(refusal)
    quality = statistics.quality(opened, width_hz=target.width_hz, band_hz=target.band_hz)
    reading = replace(
        partial,
        spectrum=spectrum,
        quality=replace(quality, remarks=(*quality.remarks, *auxiliary.remarks)),
        facts=partial.facts | auxiliary.facts,
        depths=envelope.depths(rates_hz),
        reason="; ".join(quality.faults) or failed,
    )
    if spectrum is not None:
        reading = _with_levels(reading, spectrum, opened, rates_hz)
    return _with_order_tracking(reading, opened, auxiliary, rates_hz, spacing_hz)


def _with_facts(path: Path, opened: OpenRecording, place: RecordingPlace | None) -> Reading:
    """Return a reading with the facts that do not need the samples."""
    return Reading(
        file=str(path),
        rate_hz=opened.rate_hz,
        rate_doubt=opened.rate_doubt,
        unit=opened.unit,
        facts={name: (_text(fact.value), fact.source) for name, fact in opened.facts.items()},
        started=opened.started.isoformat() if opened.started else "",
        sensor=_sensor(opened, place),
    )


def _with_levels(
    reading: Reading, spectrum: Spectrum, opened: OpenRecording, rates_hz: Mapping[str, float]
) -> Reading:
    """Add the levels in bands, of lines and, if it is known, of velocity."""
    frequency_hz = spectrum.frequency_hz
    density = spectrum.density
    return replace(
        reading,
        bands=bands(opened, frequency_hz, density),
        lines=lines(frequency_hz, density, rates_hz),
        velocity=_velocity(opened, frequency_hz, density),
    )


def _velocity(opened: OpenRecording, frequency_hz: Field, density: Field) -> float:
    """Return the rms velocity [m/s] of an acceleration or a velocity; nan for other units."""
    if opened.comparable:
        return velocity_rms(frequency_hz, density)
    factor = opened.velocity_factor
    return np.nan if factor is None else velocity_rms(frequency_hz, factor**2 * density, "velocity")


def _with_order_tracking(
    reading: Reading,
    opened: OpenRecording,
    auxiliary: AuxiliaryData,
    rates_hz: Mapping[str, float],
    spacing_hz: float,
) -> Reading:
    """Replace depths and lines by those at constant speed, if the shaft's angle is known."""
    try:
        resampled = order_tracked(opened, auxiliary) if rates_hz else None
        if resampled is None:
            return reading
        values, rate_hz = resampled
        depths, harmonics = envelope_and_lines(
            rates_hz, values, rate_hz, opened.unit, segment_length(rate_hz, spacing_hz)
        )
    except BadInput as refusal:
        assert reading.quality is not None
        remarks = (*reading.quality.remarks, str(refusal))
        return replace(reading, quality=replace(reading.quality, remarks=remarks))
    return replace(reading, depths=depths, lines=harmonics)


def _sensor(opened: OpenRecording, place: RecordingPlace | None) -> str:
    """Return the sensor of a recording, from the table or else the sidecar."""
    if place is not None and place.sensor is not None:
        return place.sensor
    return str(opened.facts["sensor"].value) if "sensor" in opened.facts else ""


def _sensor_of_refused(path: Path, place: RecordingPlace | None) -> str:
    """Return the sensor of an unreadable file, from the table or else the sidecar."""
    if place is not None and place.sensor is not None:
        return place.sensor
    try:
        return str(read_sidecar(path)[0].get("sensor", ""))
    except BadInput:
        return ""


def _text(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def segment_length(rate_hz: float, spacing_hz: float) -> int:
    """Return the samples per segment for lines about `spacing_hz` apart, fast to transform."""
    return int(scipy.fft.next_fast_len(max(8, round(rate_hz / spacing_hz)), real=True))


def common_spacing(paths: Sequence[Path], options: ReadOptions, target: Target) -> float:
    """Return the line spacing [Hz] of a series, by length of first, middle and last recording."""
    lengths = []
    first = replace(options, channel=channels_in(options.channel)[0])
    for path in {paths[0], paths[len(paths) // 2], paths[-1]}:
        try:
            opened = open_recording(path, **asdict(first))
        except BadInput:
            continue
        if opened.samples is not None:
            lengths.append(opened.samples / opened.rate_hz)
    if not lengths:
        return FINEST_HZ
    return line_spacing(median(lengths), target)


def line_spacing(duration_s: float, target: Target) -> float:
    """Return the line spacing [Hz] for recordings of a length."""
    return max(FINEST_HZ, min(PIECES / duration_s, target.width_hz / LINES_IN_WIDTH))


def read_channels(
    paths: Sequence[Path],
    options: ReadOptions,
    target: Target,
    spacing_hz: float,
    *,
    places: Mapping[str, RecordingPlace] | None = None,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> Iterator[tuple[int, Reading]]:
    """Yield number and reading of each file, channel by channel; several channels are sensors.

    The order of files is kept. Large series are read in parallel processes.
    """
    channels = channels_in(options.channel)
    report = progress or (lambda _: None)
    workers = workers if sum(_size(path) for path in paths) >= MIN_POOL_BYTES else 1
    for channel in channels:
        of_channel = replace(options, channel=channel)
        jobs = [
            (path, of_channel, target, spacing_hz, (places or {}).get(str(path))) for path in paths
        ]
        for number, reading in _run(jobs, workers):
            report(reading)
            if len(channels) > 1:
                reading = replace(reading, sensor=f"{reading.sensor} {channel}".strip())
            yield number, reading


def _run(jobs: Sequence[tuple[Any, ...]], workers: int) -> Iterator[tuple[int, Reading]]:
    if min(workers, len(jobs)) < 2:
        for number, job in enumerate(jobs):
            yield number, read_spectrum(*job)
        return
    pool = ProcessPoolExecutor(min(workers, len(jobs)), get_context("spawn"), ignore_interrupts)
    try:
        yield from enumerate(pool.map(read_spectrum, *zip(*jobs, strict=True)))
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0


# Storage
# ----------------------------------------------------------------------------------------------


def pack_reading(reading: Reading) -> bytes:
    """Pack a reading as bytes with a digest, for `unpack_reading`."""
    density = np.empty(0) if reading.spectrum is None else reading.spectrum.density
    content = asdict(replace(reading, spectrum=None))
    if reading.spectrum is not None:
        names = ("unit", "duration_s", "segment", "window", "resolution_hz", "averages")
        content["spectrum"] = {name: getattr(reading.spectrum, name) for name in names}
    packed = BytesIO()
    entries: dict[str, Any] = {"density": density, CONTENT_ENTRY: np.array(json.dumps(content))}
    np.savez(packed, **entries)
    return append_digest(packed.getvalue())


def unpack_reading(packed: bytes, name: str) -> Reading:
    """Unpack the result of `pack_reading`.

    Raises
    ------
    UnreadableFile
        if the content is damaged.
    """
    remedy = "its recording is read again"
    try:
        arrays = unpack_arrays(strip_digest(packed, name, remedy), name, remedy)
        density = arrays["density"]
        content = json.loads(str(arrays[CONTENT_ENTRY]))
        quality = content.pop("quality")
        spectrum = content.pop("spectrum")
        content["facts"] = {
            name: (value, source) for name, (value, source) in content["facts"].items()
        }
        if spectrum is not None:
            lines = np.arange(density.size) * (content["rate_hz"] / spectrum["segment"])
            spectrum = Spectrum(frequency_hz=lines, density=density, **spectrum)
        if quality is not None:
            quality = Quality(
                **quality | {name: tuple(quality[name]) for name in ("faults", "remarks")}
            )
        return Reading(spectrum=spectrum, quality=quality, **content)
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{name} is not a stored reading; {remedy}") from error


def require_readable(readings: list[Reading]) -> list[Reading]:
    """Return the readings; raise BadInput if nothing could be read."""
    if all(reading.refused for reading in readings):
        others = f" (and {len(readings) - 1} more files)" if len(readings) > 1 else ""
        raise BadInput(f"{readings[0].reason}{others}")
    return readings
