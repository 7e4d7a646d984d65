"""A folder watched: each recording is read once as it arrives, and the series judged anew.

What was read is kept in files of its own, so that a watch can stop at any moment and go on later.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path
from time import sleep, time

from asperity.case import Case
from asperity.errors import BadInput, UnreadableFile
from asperity.files import make_folder
from asperity.kept import read_json, write_json
from asperity.recording import ReadOptions
from asperity.tracking.alarm_log import LOG, AlarmLog
from asperity.tracking.alarming import LAST
from asperity.tracking.files import Place, read_table, recordings_in
from asperity.tracking.model import Track
from asperity.tracking.reading import Reading, common_spacing, load_reading, read_spectra, save_reading
from asperity.tracking.target import Target, search_target
from asperity.tracking.track import judge
from asperity.wear import FALSE_ALARMS, Detector, SeriesMethod, StageSource

MEMORY = "heard"  # folder beside the results, a file a recording
SETTINGS = "watch.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """What is new: files just read, and the series with them; None as long as there is none.

    `waiting` files have changed so lately that they may still be written.
    """

    new: tuple[Reading, ...]
    track: Track | None
    waiting: int = 0


def watch_folder(
    folder: str | Path,
    out: str | Path,
    *,
    case: Case | None = None,
    band_hz: tuple[float, float] | None = None,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
    table: str | Path | None = None,
    shaft_hz: Sequence[float] | None = None,
    method: SeriesMethod | None = None,
    detector: Detector = "bayesian",
    stages_from: StageSource = "crf",
    false_alarm_rate: float = FALSE_ALARMS,
    acknowledge: str | None = None,
    once: bool = False,
    every_s: float = 5.0,
    settle_s: float = 2.0,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> Iterator[Update]:
    """Yield an update at the start and whenever recordings have arrived; for ever, unless `once`.

    Parameters
    ----------
    folder : where recordings arrive
    out : folder for what was read; made if need be. A later watch with the same `out` goes on from there
    every_s : seconds between two looks
    settle_s : seconds for which a file must have stayed unchanged before it is read: it may still be written
    acknowledge : as `track_recordings`; kept in `out`, and every judgement with it: an alarm stands until then
    others : as `track_recordings`; a recording that is not in `table` yet waits until it is

    Raises
    ------
    BadInput
        for a folder that is none, or other settings than those `out` was begun with.
    """
    folder, out = Path(folder), Path(out)
    if not folder.is_dir():
        raise BadInput(f"{folder} is not a folder; name the folder where recordings arrive")
    target = search_target(case, band_hz)
    memory = _Memory(out, target, ReadOptions(rate_hz=rate_hz, unit=unit, channel=channel, scale=scale))
    log = AlarmLog(out / LOG)
    judging = partial(
        judge,
        shaft_hz=shaft_hz,
        method=method,
        detector=detector,
        stages_from=stages_from,
        false_alarm_rate=false_alarm_rate,
    )
    first = True
    while True:
        present = _present(folder)
        unread = [path for path in present if memory.recall(path) is None]
        arrived = [path for path in unread if _settled(path, settle_s)]
        new = memory.read(arrived, workers, progress)
        readings = [reading for path in present if (reading := memory.recall(path)) is not None]
        if new or first:
            placed, places, x_name = _placed(readings, table)
            judged = partial(judging, placed, target, places, x_name)
            track = _kept(judged, log, new, acknowledge if first else None) if placed else None
            yield Update(new=new, track=track, waiting=len(unread) - len(arrived))
        if once:
            return
        first = False
        sleep(every_s)


def _placed(readings: list[Reading], table: str | Path | None) -> tuple[list[Reading], dict[str, Place] | None, str]:
    """The recordings that the table knows by now, where they stand, and the name of x."""
    if table is None or not readings:
        return readings, None, ""
    named = read_table(table)
    known = [reading for reading in readings if named.row(Path(reading.file)) is not None]
    return known, named.placed([Path(reading.file) for reading in known]), named.x_name


def _kept(judged: Callable[..., Track], log: AlarmLog, new: tuple[Reading, ...], acknowledge: str | None) -> Track:
    """A judgement as the log leaves it, an acknowledgement taken first."""
    track = judged(acknowledge=acknowledge)
    names = {Path(recording.file).name for recording in track.recordings}
    if acknowledge is not None:
        log.acknowledge(track.recordings[-1].file if acknowledge == LAST else acknowledge)
    if log.acknowledged in names:
        track = judged(acknowledge=log.acknowledged)
    return log.judged(track, [reading.file for reading in new])


class _Memory:
    """What was read so far, on disk and, as far as this run has needed it, at hand."""

    def __init__(self, out: Path, target: Target, options: ReadOptions) -> None:
        self.folder, self.target, self.options = out / MEMORY, target, options
        self.settings = out / SETTINGS
        self._loaded: dict[str, Reading] = {}
        make_folder(self.folder)
        self.expected = {"band_hz": [round(end, 6) for end in target.band_hz]} | asdict(options)
        remedy = "delete its folder, and recordings are read again"
        begun = read_json(self.settings, remedy) if self.settings.is_file() else self.expected
        self.spacing_hz: float | None = begun.get("spacing_hz")
        for name, value in self.expected.items():
            if begun.get(name) != value:
                raise BadInput(
                    f"{out} was begun with {name} {begun.get(name)}, now it is {value}; "
                    "go on with the same, or choose another out"
                )

    def recall(self, path: Path) -> Reading | None:
        """What this version of the file gave; None for one not read yet."""
        key = _key(path)
        if key not in self._loaded and (self.folder / key).is_file():
            try:
                self._loaded[key] = load_reading(self.folder / key)
            except UnreadableFile:
                (self.folder / key).unlink()  # cut short by a crash: read it again
        return self._loaded.get(key)

    def read(self, paths: list[Path], workers: int, progress: Callable[[Reading], None] | None) -> tuple[Reading, ...]:
        """Read files, and keep what each gave as soon as it is there."""
        if not paths:
            return ()
        if self.spacing_hz is None:
            self.spacing_hz = common_spacing(paths, self.options, self.target)
            write_json(self.settings, self.expected | {"spacing_hz": self.spacing_hz})
        keys = [_key(path) for path in paths]  # before reading: what changes meanwhile is read again
        reader = read_spectra(paths, self.options, self.target, self.spacing_hz, workers=workers, progress=progress)
        for number, reading in reader:
            save_reading(reading, self.folder / keys[number])
            self._loaded[keys[number]] = reading
        return tuple(self._loaded[key] for key in keys)


def _present(folder: Path) -> list[Path]:
    try:
        return recordings_in([folder])
    except BadInput:  # nothing there yet
        return []


def _key(path: Path) -> str:
    """A name for this version of a file: another size or time makes another."""
    status = path.stat()
    return sha256(f"{path.name} {status.st_size} {status.st_mtime_ns}".encode()).hexdigest()[:32] + ".npz"


def _settled(path: Path, seconds: float) -> bool:
    status = path.stat()
    return status.st_size > 0 and time() - status.st_mtime >= seconds
