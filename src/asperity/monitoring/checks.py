"""Check of recordings before tracking: content and usability."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from asperity.case import Case, MachineCase
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput
from asperity.monitoring.files import recordings_in
from asperity.monitoring.reading import channels_in
from asperity.monitoring.target import Target, search_target
from asperity.recording import OpenRecording, Quality, check_recording, open_channels


class CheckedRecording(NamedTuple):
    """A channel of a recording, read to its end."""

    recording: OpenRecording
    quality: Quality

    def scalars(self) -> JsonObject:
        """Return its row of `asperity check --json`."""
        recording, quality = self
        numbers = (
            "samples",
            "duration_s",
            "rms",
            "peak",
            "offset",
            "missing",
            "gaps",
            "clipped",
            "stuck",
        )
        return {
            "file": str(recording.path),
            "channel": recording.channel.name,
            "usable": quality.usable,
            "off": quality.off,
            "rate_hz": recording.rate_hz,
            "unit": recording.unit,
            **{name: getattr(quality, name) for name in numbers},
            "crfa_comparable": recording.comparable,
            "facts": {
                name: {"value": str(fact.value), "source": fact.source}
                for name, fact in recording.facts.items()
            },
            "faults": list(quality.faults),
            "remarks": list(quality.remarks),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingChecks:
    """Recordings checked for a search target; `refused` are unreadable files with the reason."""

    checked: tuple[CheckedRecording, ...]
    refused: tuple[tuple[Path, str], ...]
    target: Target

    def verdict(self) -> str:
        """Return how many are usable, and the faults of the others."""
        total = len(self.checked) + len(self.refused)
        if total == 1 and self.checked:
            recording, quality = self.checked[0]
            judged = "can be used." if quality.usable else f"cannot be used: {quality.faults[0]}."
            return f"{recording.path.name}: {judged}"
        files = {checked.recording.path for checked in self.checked}
        noun = "channels" if len(files) < len(self.checked) else "recordings"
        unusable = [checked.quality for checked in self.checked if not checked.quality.usable]
        reasons = dict.fromkeys(quality.faults[0].partition(":")[0] for quality in unusable)
        sentence = f"{len(self.checked) - len(unusable)} of {total} {noun} can be used"
        return f"{sentence}{': ' if reasons else ''}{'; '.join(reasons)}."

    def scalars(self) -> JsonObject:
        """Return the JSON of `asperity check`."""
        return {
            "verdict": self.verdict(),
            "recordings": [checked.scalars() for checked in self.checked],
            "refused": [{"file": str(path), "reason": reason} for path, reason in self.refused],
            "band_hz": list(self.target.band_hz),
            "width_hz": self.target.width_hz,
        }


def check_recordings(
    files: Sequence[Path],
    *,
    case: Case | MachineCase | None = None,
    band_hz: tuple[float, float] | None = None,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
) -> RecordingChecks:
    """Read recordings to their end and check whether the search target can be found in them.

    Parameters
    ----------
    files : recordings, or folders of them; unreadable files are in `refused`
    case, band_hz : as in `search_target`
    rate_hz, unit, channel, scale : as in `read_recording`, several channels separated by commas;
        without `channel` all channels are checked

    Raises
    ------
    BadInput
        as `search_target`, or for a folder without recordings.
    """
    target = search_target(case, band_hz)
    present = [file for file in files if file.exists()]
    absent = [file for file in files if not file.exists()]
    checked: list[CheckedRecording] = []
    refused: list[tuple[Path, str]] = []
    for path in [*(recordings_in(present) if present else []), *absent]:
        try:
            for name in channels_in(channel):
                for opened in open_channels(
                    path, rate_hz=rate_hz, unit=unit, channel=name, scale=scale
                ):
                    quality = check_recording(
                        opened, width_hz=target.width_hz, band_hz=target.band_hz
                    )
                    checked.append(CheckedRecording(opened, quality))
        except BadInput as error:
            refused.append((path, str(error)))
    return RecordingChecks(checked=tuple(checked), refused=tuple(refused), target=target)
