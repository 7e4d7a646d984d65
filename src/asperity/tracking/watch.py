"""A folder watched: each recording is listened to once as it arrives, and the series judged anew.

What was heard is kept in files of its own, so that a watch can stop at any moment and go on later.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from hashlib import sha256
from pathlib import Path
from time import sleep, time
from typing import Any

from asperity.case import Case
from asperity.errors import BadInput, UnreadableFile
from asperity.files import make_folder, whole_file
from asperity.tracking.files import read_table, recordings_in
from asperity.tracking.listen import Asked, Heard, common_spacing, keep, kept, listen_to_all
from asperity.tracking.target import Target, search_target
from asperity.tracking.track import Track, judge

MEMORY = "heard"  # folder beside the results, a file a recording
SETTINGS = "watch.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """What is new: files just listened to, and the series with them; None as long as there is none.

    `waiting` files have changed so lately that they may still be written.
    """

    new: tuple[Heard, ...]
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
    method: str | None = None,
    detector: str = "bayesian",
    once: bool = False,
    every_s: float = 5.0,
    settle_s: float = 2.0,
    workers: int = 1,
    progress: Callable[[Heard], None] | None = None,
) -> Iterator[Update]:
    """Yield an update at the start and whenever recordings have arrived; for ever, unless `once`.

    Parameters
    ----------
    folder : where recordings arrive
    out : folder for what was heard; made if need be. A later watch with the same `out` goes on from there
    every_s : seconds between two looks
    settle_s : seconds for which a file must have stayed unchanged before it is read: it may still be written
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
    asked = Asked(rate_hz=rate_hz, unit=unit, channel=channel, scale=scale)
    memory = _Memory(out, target, asked)
    first = True
    while True:
        present = _present(folder)
        unheard = [path for path in present if memory.recall(path) is None]
        arrived = [path for path in unheard if _settled(path, settle_s)]
        new = memory.listen(arrived, workers, progress)
        heard = [one for path in present if (one := memory.recall(path)) is not None]
        if new or first:
            track = None
            if table is not None and heard:
                places = read_table(table)
                heard = [one for one in heard if Path(one.file).name in places.places]
                known = {one.file: places.place(Path(one.file)) for one in heard}
                if heard:
                    track = judge(
                        heard, target, known, places.x_name, shaft_hz=shaft_hz, method=method, detector=detector
                    )
            elif heard:
                track = judge(heard, target, shaft_hz=shaft_hz, method=method, detector=detector)
            yield Update(new=new, track=track, waiting=len(unheard) - len(arrived))
        if once:
            return
        first = False
        sleep(every_s)


class _Memory:
    """What was heard so far, on disk and, as far as this run has needed it, at hand."""

    def __init__(self, out: Path, target: Target, asked: Asked) -> None:
        self.folder, self.target, self.asked = out / MEMORY, target, asked
        self.settings = out / SETTINGS
        self.spacing_hz: float | None = None
        self._at_hand: dict[str, Heard] = {}
        make_folder(self.folder)
        wanted = self._wanted()
        if self.settings.is_file():
            begun = _read_json(self.settings)
            self.spacing_hz = begun.get("spacing_hz")
            differing = next((name for name in wanted if begun.get(name) != wanted[name]), None)
            if differing is not None:
                raise BadInput(
                    f"{out} was begun with {differing} {begun.get(differing)}, now it is {wanted[differing]}; "
                    "go on with the same, or choose another --out"
                )

    def _wanted(self) -> dict[str, Any]:
        return {"band_hz": [round(end, 6) for end in self.target.band_hz]} | asdict(self.asked)

    def recall(self, path: Path) -> Heard | None:
        """What this version of the file gave; None for one not listened to yet."""
        key = _key(path)
        if key not in self._at_hand and (self.folder / key).is_file():
            try:
                self._at_hand[key] = kept(self.folder / key)
            except UnreadableFile:
                (self.folder / key).unlink()  # cut short by a crash: listen again
        return self._at_hand.get(key)

    def listen(
        self, paths: Sequence[Path], workers: int, progress: Callable[[Heard], None] | None
    ) -> tuple[Heard, ...]:
        """Listen to files, and keep what each gave as soon as it is there."""
        if not paths:
            return ()
        if self.spacing_hz is None:
            self.spacing_hz = common_spacing(paths, self.asked, self.target)
            with whole_file(self.settings) as part:
                part.write_text(json.dumps(self._wanted() | {"spacing_hz": self.spacing_hz}, indent=2), "utf-8")
        keys = [_key(path) for path in paths]  # before reading: what changes meanwhile is read again
        for number, heard in listen_to_all(
            paths, self.asked, self.target, self.spacing_hz, workers=workers, progress=progress
        ):
            with whole_file(self.folder / keys[number]) as part:
                keep(heard, part)
            self._at_hand[keys[number]] = heard
        return tuple(self._at_hand[key] for key in keys)


def _present(folder: Path) -> list[Path]:
    try:
        return recordings_in([folder])
    except BadInput:  # nothing there yet
        return []


def _key(path: Path) -> str:
    """A name for this version of a file: another size or time makes another."""
    found = path.stat()
    return sha256(f"{path.name} {found.st_size} {found.st_mtime_ns}".encode()).hexdigest()[:32] + ".npz"


def _settled(path: Path, seconds: float) -> bool:
    found = path.stat()
    return found.st_size > 0 and time() - found.st_mtime >= seconds


def _read_json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError):
        content = None
    if not isinstance(content, dict):
        raise UnreadableFile(f"{path} is damaged; delete its folder, and recordings are read again")
    return content
