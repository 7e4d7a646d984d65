"""From files to spectra: each is read once, checked and averaged on the way, several at a time.

What the spectra mean together is left to `track`.
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

from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.processes import ignore_interrupts
from asperity.core.signals import Spectrum, averaged_spectrum
from asperity.core.storage import append_digest, strip_digest
from asperity.monitoring.auxiliary_channels import bands, beside, heard_at, lines, rates, steady
from asperity.monitoring.files import Place
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
FINEST_HZ = 0.5  # spacing of lines: shaft harmonics a few hertz apart stay apart
# of a record, averaged, as long as lines stay LINES_IN_WIDTH times narrower than the resonance
PIECES = 8
LINES_IN_WIDTH = 16
WORTH_A_POOL = 32 << 20  # bytes in all; starting processes takes a second


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """What reading one file gave. Without a `spectrum`, `reason` says why; `quality` may still be known.

    `sensor` says which of several heard it, where a table or sidecar does. `bands` are rms in
    bands, and `lines` at the rates of faults and meshes, each with two harmonics. `rate_doubt` is
    the relative standard deviation of the rate. `facts` are texts by name, each with its source;
    `started` is in ISO form or empty. `depths` are how deep the envelope is modulated at the rates
    of faults, where a sidecar states those; `velocity` is rms, 10 to 1000 Hz [m/s], nan of what is
    no acceleration or too short to tell.
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
        """Whether it is no recording at all, or one that nothing could be read of."""
        return self.spectrum is None and self.quality is None

    @property
    def usable(self) -> bool:
        """Whether its spectrum counts."""
        return self.spectrum is not None and not self.reason

    @property
    def time(self) -> datetime | None:
        """When the recording began."""
        return datetime.fromisoformat(self.started) if self.started else None


def channels_in(channel: str | None) -> list[str | None]:
    """The channels that are asked for; one whose name has a comma in it goes by its number."""
    names = [] if channel is None else [name.strip() for name in channel.split(",") if name.strip()]
    if len(set(names)) < len(names):
        raise BadInput(f"channel {channel} names one twice; name each once")
    return [*names] or [None]


def read_spectrum(
    path: Path, options: ReadOptions, target: Target, spacing_hz: float, place: Place | None = None
) -> Reading:
    """Read a file once: its facts, its quality, its averaged spectrum. What is wrong with it becomes the reason."""
    try:
        opened = open_recording(path, **asdict(options))
    except BadInput as refusal:
        return Reading(file=str(path), sensor=_sensor_of_refused(path, place), reason=str(refusal))
    known = Reading(
        file=str(path),
        rate_hz=opened.rate_hz,
        rate_doubt=opened.rate_doubt,
        unit=opened.unit,
        facts={name: (_text(fact.value), fact.source) for name, fact in opened.facts.items()},
        started=opened.started.isoformat() if opened.started else "",
        sensor=_sensor(opened, place),
    )
    told = beside(opened, place)
    rates_hz = rates(opened, told, target)
    gauge, envelope = SampleStatistics(), Envelope(opened.rate_hz)
    blocks = gauge.without_stuck(gauge.pass_through(opened.blocks()))
    segment = segment_length(opened.rate_hz, spacing_hz)
    try:
        spectrum: Spectrum | None = averaged_spectrum(
            envelope.watch(blocks) if rates_hz else blocks,
            opened.rate_hz,
            opened.unit,
            segment=segment,
            window=WINDOW,
        )
        failed = ""
    except UnreadableFile as refusal:
        return replace(known, reason=str(refusal))
    except BadInput as refusal:
        spectrum, failed = None, str(refusal)
    quality = gauge.quality(opened, width_hz=target.width_hz, band_hz=target.band_hz)
    depths, remarks = envelope.depths(rates_hz), [*quality.remarks, *told.remarks]
    heard: dict[str, Any] = {}
    if spectrum is not None:
        frequency_hz, density = spectrum.frequency_hz, spectrum.density
        heard = {
            "bands": bands(opened, frequency_hz, density),
            "lines": lines(frequency_hz, density, rates_hz),
        }
        if opened.comparable:
            heard["velocity"] = velocity_rms(frequency_hz, density)
    try:
        even = steady(opened, told) if rates_hz else None
        if even is not None:
            depths, heard["lines"] = heard_at(
                rates_hz, *even, opened.unit, segment_length(even[1], spacing_hz)
            )
    except BadInput as refusal:
        remarks.append(str(refusal))
    return replace(
        known,
        spectrum=spectrum,
        quality=replace(quality, remarks=tuple(remarks)),
        facts=known.facts | told.facts,
        depths=depths,
        reason="; ".join(quality.faults) or failed,
        **heard,
    )


def _sensor(opened: OpenRecording, place: Place | None) -> str:
    """Who heard a recording, as the table says it or else what stands beside it."""
    if place is not None and place.sensor is not None:
        return place.sensor
    return str(opened.facts["sensor"].value) if "sensor" in opened.facts else ""


def _sensor_of_refused(path: Path, place: Place | None) -> str:
    """Who heard what cannot be read, as far as table and sidecar say it."""
    if place is not None and place.sensor is not None:
        return place.sensor
    try:
        return str(read_sidecar(path)[0].get("sensor", ""))
    except BadInput:
        return ""


def _text(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def segment_length(rate_hz: float, spacing_hz: float) -> int:
    """Samples of a piece whose lines are about `spacing_hz` apart, a length that transforms fast."""
    return int(scipy.fft.next_fast_len(max(8, round(rate_hz / spacing_hz)), real=True))


def common_spacing(paths: Sequence[Path], options: ReadOptions, target: Target) -> float:
    """Distance of the lines [Hz] that suits a whole series, from the length of its first, middle and last recording."""
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
    return max(FINEST_HZ, min(PIECES / median(lengths), target.width_hz / LINES_IN_WIDTH))


def read_channels(
    paths: Sequence[Path],
    options: ReadOptions,
    target: Target,
    spacing_hz: float,
    *,
    places: Mapping[str, Place] | None = None,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> Iterator[tuple[int, Reading]]:
    """Number and result of each file on each channel that is asked for, in turn; of several each is a sensor.

    Files of a channel come in their order, however long each takes; in processes of their own
    where that is worth it.
    """
    channels, told = channels_in(options.channel), progress or (lambda _: None)
    workers = workers if sum(_size(path) for path in paths) >= WORTH_A_POOL else 1
    for channel in channels:
        of_one = replace(options, channel=channel)
        jobs = [(path, of_one, target, spacing_hz, (places or {}).get(str(path))) for path in paths]
        for number, reading in _done(jobs, workers):
            told(reading)
            of_several = replace(reading, sensor=f"{reading.sensor} {channel}".strip())
            yield number, of_several if len(channels) > 1 else reading


def _done(jobs: Sequence[tuple[Any, ...]], workers: int) -> Iterator[tuple[int, Reading]]:
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


# Kept between runs
# ---------------------------------------------------------------------------------------------------


def reading_bytes(reading: Reading) -> bytes:
    """A reading as bytes with their digest, to be read by `reading_from`."""
    density = np.empty(0) if reading.spectrum is None else reading.spectrum.density
    content: dict[str, Any] = asdict(replace(reading, spectrum=None))
    if reading.spectrum is not None:
        kept = ("unit", "duration_s", "segment", "window", "resolution_hz", "averages")
        content["spectrum"] = {name: getattr(reading.spectrum, name) for name in kept}
    packed = BytesIO()
    np.savez(packed, density=density, told=np.array(json.dumps(content)))
    return append_digest(packed.getvalue())


def reading_from(packed: bytes, name: str) -> Reading:
    """What `reading_bytes` made.

    Raises
    ------
    UnreadableFile
        for anything else.
    """
    remedy = "its recording is read again"
    body = BytesIO(strip_digest(packed, name, remedy))
    try:
        with np.load(body, allow_pickle=False) as stored:
            density, content = stored["density"], json.loads(str(stored["told"]))
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
    except Exception as error:
        raise UnreadableFile(f"{name} is no reading of a recording; {remedy}") from error


def any_of(readings: list[Reading]) -> list[Reading]:
    """The same; BadInput where nothing could be read of any."""
    if all(reading.spectrum is None and reading.quality is None for reading in readings):
        others = f" (and so on for {len(readings) - 1} more files)" if len(readings) > 1 else ""
        raise BadInput(f"{readings[0].reason}{others}")
    return readings
