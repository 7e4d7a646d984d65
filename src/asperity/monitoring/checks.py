"""What many recordings hold and whether they can be used, before anything is tracked."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from asperity.case import Case, MachineCase
from asperity.core.errors import BadInput
from asperity.monitoring.files import recordings_in
from asperity.monitoring.reading import channels_in
from asperity.monitoring.target import Target, search_target
from asperity.recording import OpenRecording, Quality, check_recording, open_channels


class CheckedRecording(NamedTuple):
    """A channel of a recording, read to its end."""

    recording: OpenRecording
    quality: Quality

    def scalars(self) -> dict[str, Any]:
        """Its line of `asperity check --json`."""
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
    """Recordings judged for a resonance that is looked for; `refused` are files that could not be read, and why."""

    checked: tuple[CheckedRecording, ...]
    refused: tuple[tuple[Path, str], ...]
    target: Target

    def verdict(self) -> str:
        """How many can be used, and what is wrong with the others."""
        total = len(self.checked) + len(self.refused)
        if total == 1 and self.checked:
            recording, quality = self.checked[0]
            judged = "can be used." if quality.usable else f"cannot be used: {quality.faults[0]}."
            return f"{recording.path.name}: {judged}"
        files = {checked.recording.path for checked in self.checked}
        things = "channels" if len(files) < len(self.checked) else "recordings"
        bad = [checked.quality for checked in self.checked if not checked.quality.usable]
        reasons = dict.fromkeys(quality.faults[0].partition(":")[0] for quality in bad)
        sentence = f"{len(self.checked) - len(bad)} of {total} {things} can be used"
        return f"{sentence}{': ' if reasons else ''}{'; '.join(reasons)}."

    def scalars(self) -> dict[str, Any]:
        """What `asperity check --json` prints."""
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
    """Read recordings to their end and judge them for the resonance of a case, in a band, or of the paper's contact.

    Parameters
    ----------
    files : recordings, or folders of them; what cannot be read is in `refused`
    case, band_hz : as for `search_target`
    rate_hz, unit, channel, scale : as for `read_recording`, several channels with commas between them; without
        `channel` every one is checked

    Raises
    ------
    BadInput
        as `search_target`, or for a folder without recordings.
    """
    target = search_target(case, band_hz)
    there, absent = (
        [file for file in files if file.exists()],
        [file for file in files if not file.exists()],
    )
    checked: list[CheckedRecording] = []
    refused: list[tuple[Path, str]] = []
    for path in [*(recordings_in(there) if there else []), *absent]:
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
