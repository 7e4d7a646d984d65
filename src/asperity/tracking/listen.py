"""From files to spectra: each is read once, checked and averaged on the way, several at a time.

What the spectra mean together is left to `track`.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from asperity.errors import BadInput, UnreadableFile
from asperity.processes import leave_interrupts_to_the_parent
from asperity.recording import Gauge, Quality, open_recording
from asperity.signals import Spectrum, averaged_spectrum
from asperity.tracking.target import Target

WINDOW = "hann"
FINEST_HZ = 0.5  # spacing of lines: shaft harmonics a few hertz apart stay apart
PIECES = 8  # of a record, averaged, as long as lines stay LINES_IN_WIDTH times narrower than the resonance
LINES_IN_WIDTH = 16
WORTH_A_POOL = 32 << 20  # bytes in all; starting processes takes a second


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What the caller states about all recordings alike; None leaves it to the files."""

    rate_hz: float | None = None
    unit: str | None = None
    channel: str | None = None
    scale: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """What listening to one file gave. Without a `spectrum`, `reason` says why; `quality` may still be known.

    `facts` are texts by name, each with its source; `started` is in ISO form or empty.
    """

    file: str
    spectrum: Spectrum | None
    quality: Quality | None
    rate_hz: float
    unit: str
    facts: dict[str, tuple[str, str]]
    started: str
    reason: str

    @property
    def usable(self) -> bool:
        """Whether its spectrum counts."""
        return self.spectrum is not None and not self.reason

    @property
    def time(self) -> datetime | None:
        """When the recording began."""
        return datetime.fromisoformat(self.started) if self.started else None


def listen(path: Path, asked: Asked, target: Target, spacing_hz: float) -> Heard:
    """Read a file once: its facts, its quality, its averaged spectrum. What is wrong with it becomes the reason."""
    nothing = Heard(
        file=str(path), spectrum=None, quality=None, rate_hz=np.nan, unit="", facts={}, started="", reason=""
    )
    try:
        opened = open_recording(path, **asdict(asked))
    except BadInput as refusal:
        return replace(nothing, reason=str(refusal))
    known = replace(
        nothing,
        rate_hz=opened.rate_hz,
        unit=opened.unit,
        facts={name: (_text(fact.value), fact.source) for name, fact in opened.facts.items()},
        started=opened.started.isoformat() if opened.started else "",
    )
    gauge = Gauge()
    try:
        spectrum: Spectrum | None = averaged_spectrum(
            gauge.watch(opened.blocks()),
            opened.rate_hz,
            opened.unit,
            segment=segment(opened.rate_hz, spacing_hz),
            window=WINDOW,
        )
        failed = ""
    except UnreadableFile as refusal:
        return replace(known, reason=str(refusal))
    except BadInput as refusal:
        spectrum, failed = None, str(refusal)
    quality = gauge.quality(opened, width_hz=target.width_hz, band_hz=target.band_hz)
    return replace(known, spectrum=spectrum, quality=quality, reason="; ".join(quality.faults) or failed)


def _text(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def segment(rate_hz: float, spacing_hz: float) -> int:
    """Samples of a piece whose lines are about `spacing_hz` apart, a length that transforms fast."""
    from scipy.fft import next_fast_len

    return int(next_fast_len(max(8, round(rate_hz / spacing_hz)), real=True))


def common_spacing(paths: Sequence[Path], asked: Asked, target: Target) -> float:
    """Distance of the lines [Hz] that suits a whole series, from the length of its first, middle and last recording."""
    lengths = []
    for path in {paths[0], paths[len(paths) // 2], paths[-1]}:
        try:
            opened = open_recording(path, **asdict(asked))
        except BadInput:
            continue
        if opened.samples is not None:
            lengths.append(opened.samples / opened.rate_hz)
    if not lengths:
        return FINEST_HZ
    return max(FINEST_HZ, min(PIECES / median(lengths), target.width_hz / LINES_IN_WIDTH))


def listen_to_all(
    paths: Sequence[Path],
    asked: Asked,
    target: Target,
    spacing_hz: float,
    *,
    workers: int = 1,
    progress: Callable[[Heard], None] | None = None,
) -> Iterator[tuple[int, Heard]]:
    """Number and result of each file, as they are done; in processes of their own where that is worth it."""
    jobs = [(path, asked, target, spacing_hz) for path in paths]
    if min(workers, len(paths)) < 2 or sum(_size(path) for path in paths) < WORTH_A_POOL:
        for number, job in enumerate(jobs):
            heard = listen(*job)
            if progress is not None:
                progress(heard)
            yield number, heard
        return
    pool = ProcessPoolExecutor(min(workers, len(paths)), get_context("spawn"), leave_interrupts_to_the_parent)
    try:
        waiting = {pool.submit(listen, *job): number for number, job in enumerate(jobs)}
        for done in as_completed(waiting):
            heard = done.result()
            if progress is not None:
                progress(heard)
            yield waiting[done], heard
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0


# Kept between runs ---------------------------------------------------------------------------------------------------


def keep(heard: Heard, path: Path) -> None:
    """Write what was heard, to be read by `kept`; the caller sees to it that it is written whole."""
    density = np.empty(0) if heard.spectrum is None else heard.spectrum.density
    told: dict[str, Any] = asdict(replace(heard, spectrum=None))
    if heard.spectrum is not None:
        told["spectrum"] = {
            name: getattr(heard.spectrum, name)
            for name in ("unit", "duration_s", "segment", "window", "resolution_hz", "averages")
        }
    with path.open("wb") as file:
        np.savez(file, density=density, told=json.dumps(told))


def kept(path: Path) -> Heard:
    """What `keep` wrote.

    Raises
    ------
    UnreadableFile
        for anything else.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            density, told = content["density"], json.loads(str(content["told"]))
        quality = told.pop("quality")
        spectrum = told.pop("spectrum")
        told["facts"] = {name: (value, source) for name, (value, source) in told["facts"].items()}
        if spectrum is not None:
            lines = np.arange(density.size) * (told["rate_hz"] / spectrum["segment"])
            spectrum = Spectrum(frequency_hz=lines, density=density, **spectrum)
        if quality is not None:
            quality = Quality(**quality | {name: tuple(quality[name]) for name in ("faults", "remarks")})
        return Heard(spectrum=spectrum, quality=quality, **told)
    except Exception as error:
        raise UnreadableFile(f"{path} is damaged; delete it, and its recording is read again") from error
