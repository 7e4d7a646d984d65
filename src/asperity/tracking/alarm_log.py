"""What a watch has said, a line a judgement, and which alarm of it still stands.

Lines are appended and handed to the disk at once; a line cut short by a crash is passed over.
"""

import json
import os
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from asperity.errors import BadInput
from asperity.tracking.model import Track

LOG = "alarms.jsonl"


class Standing(NamedTuple):
    """An alarm that nobody has acknowledged: the recording that raised it, why, by what."""

    file: str
    reason: str
    raised_by: str


class AlarmLog:
    """The judgements of one watch, in one file.

    `acknowledged` is the name of the recording up to which somebody has looked, None for none; `standing` the alarm
    that stands since.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.acknowledged: str | None = None
        self.standing: Standing | None = None
        for entry in self._entries():
            self._take(entry)

    def acknowledge(self, file: str) -> None:
        """Somebody has looked at everything up to this recording."""
        self._append({"acknowledged": Path(file).name})

    def judged(self, track: Track, new: list[str]) -> Track:
        """Keep a judgement; the track with the alarm that stands, where this judgement would have dropped it."""
        if self.standing is not None and track.alarm.state != "alarm":
            files = [recording.file for recording in track.recordings]
            since = files.index(self.standing.file) if self.standing.file in files else 0
            held = replace(
                track.alarm,
                state="alarm",
                since=since,
                reason=f"{self.standing.reason}; raised before and not acknowledged",
                raised_by=self.standing.raised_by,
            )
            track = replace(track, alarm=held)
        said = track.scalars()
        self._append({"verdict": said["verdict"], **said["alarm"], "new": new, "recordings": len(track.recordings)})
        return track

    def _take(self, entry: dict[str, Any]) -> None:
        if "acknowledged" in entry:
            self.acknowledged, self.standing = str(entry["acknowledged"]), None
        elif entry.get("state") == "alarm" and self.standing is None:
            self.standing = Standing(str(entry["since"]), str(entry["reason"]), str(entry["raised_by"]))

    def _append(self, entry: dict[str, Any]) -> None:
        self._take(entry)
        line = json.dumps({"time": datetime.now(UTC).isoformat(timespec="seconds")} | entry, allow_nan=False)
        try:
            with self.path.open("a+b") as file:
                cut = file.tell() > 0 and not _ends_a_line(file.fileno(), file.tell())
                file.write(("\n" if cut else "").encode() + line.encode() + b"\n")
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise BadInput(
                f"cannot write {self.path}: {error.strerror}; free its disk, or choose another out"
            ) from None

    def _entries(self) -> Iterator[dict[str, Any]]:
        if not self.path.is_file():
            return
        for line in self.path.read_text("utf-8", errors="replace").splitlines():
            try:
                entry = json.loads(line)
            except ValueError:
                continue  # cut short by a crash
            if isinstance(entry, dict):
                yield entry


def _ends_a_line(descriptor: int, size: int) -> bool:
    return os.pread(descriptor, 1, size - 1) == b"\n"
