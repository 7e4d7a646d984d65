"""Check of recordings before tracking: content and usability."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

from asperity.case import Case, MachineCase
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput
from asperity.monitoring.auxiliary_channels import fault_rates, read_auxiliary
from asperity.monitoring.files import recordings_in
from asperity.monitoring.reading import channels_in
from asperity.monitoring.suitability import USES, Suitability, good_for, suitabilities
from asperity.monitoring.target import Target, search_target
from asperity.recording import (
    OpenRecording,
    Quality,
    SampleStatistics,
    name_order_remark,
    open_channels,
)


class CheckedRecording(NamedTuple):
    """A channel of a recording, read to its end, and for what it is good."""

    recording: OpenRecording
    quality: Quality
    uses: Mapping[str, Suitability]

    def scalars(self) -> JsonObject:
        """Return its row of `asperity check --json`."""
        recording, quality, uses = self
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
            "good_for": {name: asdict(use) for name, use in uses.items()},
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
            recording, quality, uses = self.checked[0]
            if quality.usable:
                return f"{recording.path.name}: can be used."
            others = good_for(uses)
            purpose = "" if others == "nothing" else " for a contact resonance"
            ending = "" if others == "nothing" else f"; good for: {others}"
            return f"{recording.path.name}: cannot be used{purpose}: {quality.faults[0]}{ending}."
        files = {checked.recording.path for checked in self.checked}
        noun = "channels" if len(files) < len(self.checked) else "recordings"
        unusable = [checked.quality for checked in self.checked if not checked.quality.usable]
        reasons = dict.fromkeys(quality.faults[0].partition(":")[0] for quality in unusable)
        sentence = f"{len(self.checked) - len(unusable)} of {total} {noun} can be used"
        return f"{sentence}{': ' if reasons else ''}{'; '.join(reasons)}.{self._other_uses()}"

    def _other_uses(self) -> str:
        """Return for what those are good that cannot be used for a contact resonance."""
        unusable = [checked.uses for checked in self.checked if not checked.quality.usable]
        counts = {
            label: sum(uses[name].possible for uses in unusable) for name, label in USES.items()
        }
        parts = [f"{label} ({count})" for label, count in counts.items() if count]
        return f" Other uses: {', '.join(parts)}." if parts else ""

    def scalars(self) -> JsonObject:
        """Return the JSON of `asperity check`."""
        return {
            "verdict": self.verdict(),
            "recordings": [checked.scalars() for checked in self.checked],
            "refused": [{"file": str(path), "reason": reason} for path, reason in self.refused],
            "band_hz": list(self.target.band_hz),
            "width_hz": self.target.width_hz,
        }


def _check(opened: OpenRecording, target: Target) -> CheckedRecording:
    """Read a channel to its end and judge it."""
    statistics = SampleStatistics()
    for _ in statistics.pass_through(opened.blocks()):
        pass
    auxiliary = read_auxiliary(opened, None)
    uses = suitabilities(opened, statistics, target, fault_rates(opened, auxiliary, target))
    quality = statistics.quality(opened, width_hz=target.width_hz, band_hz=target.band_hz)
    remarks = (*quality.remarks, *auxiliary.remarks)
    return CheckedRecording(opened, replace(quality, remarks=remarks), uses)


def _with_name_order(checked: Sequence[CheckedRecording]) -> list[CheckedRecording]:
    """Add the remark on dates in names to recordings that do not state their start."""
    undated = [entry.recording.path for entry in checked if entry.recording.started is None]
    remark = name_order_remark(list(dict.fromkeys(undated)))
    return [
        entry._replace(quality=replace(entry.quality, remarks=(*entry.quality.remarks, remark)))
        if remark and entry.recording.path in undated
        else entry
        for entry in checked
    ]


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
    """Read recordings to their end and check for what they are good.

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
                channels = open_channels(
                    path, rate_hz=rate_hz, unit=unit, channel=name, scale=scale
                )
                checked.extend(_check(opened, target) for opened in channels)
        except BadInput as error:
            refused.append((path, str(error)))
    checked = _with_name_order(checked)
    return RecordingChecks(checked=tuple(checked), refused=tuple(refused), target=target)
