"""What a track is: recordings in their order with resonance, stage and alarm, as table, JSON and dataset."""

import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.core.arrays import finite_or_none
from asperity.core.errors import BadInput
from asperity.core.files import atomic_write, write_csv
from asperity.core.quantities import quantity
from asperity.core.storage import netcdf_bytes
from asperity.monitoring.forecast import FORECAST, Foretold
from asperity.monitoring.recording import NAMED, TrackedRecording, heard_in_words
from asperity.monitoring.silence import SILENCE
from asperity.monitoring.target import Target
from asperity.trend import SOURCE_NAMES, Alarm, AlarmState, Stages, StageSource

if TYPE_CHECKING:
    import pandas
    import xarray

NUMBERS = (
    "x",
    "x_std",
    "crf_hz",
    "crf_std_hz",
    "crf_shared_std_hz",
    "crf_reference_hz",
    "crfa",
    "crfa_std",
    "damping_ratio",
    "damping_std",
    "clr",
    "clr_low",
    "clr_high",
    "severe_probability",
    "duration_s",
    "rate_hz",
)
TEXTS = ("file", "reason", "damping_reason", "label", "started")
ENDINGS = (".csv", ".parquet", ".nc")


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """A series of recordings, judged.

    `recordings` in the order of `x`; `x_name` says what that is. `stages` is read from CRF,
    damping or both, as asked for, and decides labels, probabilities and alarm; `stages_by` has all
    three. None and none where no resonance was found at all. `problems` are sentences for which
    recordings should not be compared; `notes` say what was chosen for the user. `forecast` is what
    is foretold of it, None where nothing was asked.
    """

    recordings: tuple[TrackedRecording, ...]
    x_name: str
    target: Target
    method: str
    stages: Stages | None
    stages_by: Mapping[StageSource, Stages]
    alarm: Alarm
    comparable: bool
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    forecast: Foretold | None = None

    @property
    def resonance_count(self) -> int:
        """In how many recordings a contact resonance was found."""
        return sum(recording.resonance.found for recording in self.recordings)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of its sensors; none of one sensor."""
        return tuple(dict.fromkeys(name for one in self.recordings for name in one.on_sensors))

    def number_of(self, file: str) -> int | None:
        """Which recording a file is of, None for none."""
        return next(
            (number for number, one in enumerate(self.recordings) if file in one.files), None
        )

    def silent(self, reason: str) -> "Track":
        """The same where no recording comes any more, for a `reason`: blind, unless an alarm stands."""
        noted = replace(self, notes=(*self.notes, f"{reason[:1].upper()}{reason[1:]}."))
        if self.alarm.state == "alarm":
            return noted
        states: tuple[AlarmState, ...] = (*self.alarm.states[:-1], "blind")
        since = len(states) - 1
        blind = replace(
            self.alarm,
            state="blind",
            states=states,
            since=since,
            reason=reason,
            raised_by=SILENCE,
            explained="",
        )
        return replace(noted, alarm=blind)

    def foretold(self, forecast: Foretold) -> "Track":
        """The same with a forecast, which raises the alarm with the last recording where it is one."""
        track = replace(self, forecast=forecast)
        if not forecast.alarm or self.alarm.state == "alarm":
            return track
        reason = forecast.sentence().rstrip(".")
        return replace(
            track, alarm=self.alarm.with_alarm_since(len(self.alarm.states) - 1, reason, FORECAST)
        )

    def verdict(self) -> str:
        """The stage with its confidence, or that these recordings cannot tell, and why; and what is foretold."""
        ahead = (
            "" if self.forecast is None or self.forecast.alarm else f" {self.forecast.sentence()}"
        )
        return f"{self._verdict()}{ahead}"

    def _verdict(self) -> str:
        total = len(self.recordings)
        several = f"{total} recordings" if total != 1 else "1 recording"
        seen = self._without_resonance(several)
        if self.stages is not None:
            seen = f"{self.stages.verdict.rstrip('.')}; contact resonance found in {self.resonance_count} of {several}."
        seen = " ".join(filter(None, [seen, heard_in_words(self.recordings)]))
        alarm = self.alarm
        if alarm.explained:
            seen = f"{seen} {alarm.explained[0].upper()}{alarm.explained[1:]}."
        if alarm.state == "alarm":
            first = Path(self.recordings[alarm.since or 0].file).name
            return f"ALARM since {first}: {alarm.reason}. {seen}"
        if alarm.state == "alert":
            return f"Alert: {alarm.reason}. {seen}"
        if alarm.state == "blind" or (alarm.state == "cannot-tell" and self.stages is not None):
            return f"{alarm.verdict} {seen}"
        return seen

    def _without_resonance(self, several: str) -> str:
        """That no contact resonance was found in several recordings, and the commonest reason."""
        reasons = [recording.resonance.reason for recording in self.recordings]
        (kind, count), *_ = Counter(map(_without_numbers, reasons)).most_common(1)
        reason = next(reason for reason in reasons if _without_numbers(reason) == kind)
        share = f"{count} of {len(reasons)}: " if count < len(reasons) else ""
        return f"These recordings cannot tell: no contact resonance found in {several} ({share}{reason})."

    def stage_rows(self) -> list[tuple[str, str]]:
        """What CRF, damping and both say of the stage, the deciding one marked."""
        decides = None if self.stages is None else self.stages.source
        return [
            (
                f"stage by {SOURCE_NAMES[source]}{', which decides' if source == decides else ''}",
                stages.verdict,
            )
            for source, stages in self.stages_by.items()
        ]

    def scalars(self, *, every_way: bool = True) -> dict[str, Any]:
        """Everything that `asperity track --json` prints; without `every_way` only the stage that decides."""
        stages = self.stages
        ways = self.stages_by if every_way else {} if stages is None else {stages.source: stages}
        return {
            "verdict": self.verdict(),
            "recordings": [recording.row() for recording in self.recordings],
            "stages": {
                "source": None if stages is None else stages.source,
                "kind": None if stages is None else stages.kind,
                "split": None if stages is None else finite_or_none(stages.split),
                "interval": list(stages.interval) if stages is not None and stages.found else None,
                "probability": [
                    finite_or_none(recording.severe_probability) for recording in self.recordings
                ],
                "labels": [recording.label for recording in self.recordings],
                "evidence": {}
                if stages is None
                else {k: finite_or_none(v) for k, v in stages.evidence.items()},
            },
            "stages_by": {source: _in_json(told) for source, told in ways.items()},
            "alarm": self._alarm(),
            "forecast": None if self.forecast is None else self.forecast.scalars(),
            "x": self.x_name,
            "band_hz": list(self.target.band_hz),
            "band_source": self.target.source,
            "full_load_crf_hz": self.target.full_load_crf_hz,
            "method": self.method,
            "crfa_comparable": self.comparable,
            "problems": list(self.problems),
            "notes": list(self.notes),
        }

    def _alarm(self) -> dict[str, Any]:
        alarm = self.alarm
        return {
            "state": alarm.state,
            "since": None if alarm.since is None else self.recordings[alarm.since].file,
            "false_alarm_rate": alarm.false_alarm_rate,
            "reason": alarm.reason,
            "raised_by": alarm.raised_by or None,
            "explained": alarm.explained or None,
            "verdict": alarm.verdict,
        }

    @property
    def table(self) -> "pandas.DataFrame":
        """One row a recording, in the order of x."""
        import pandas

        return pandas.DataFrame([flat(recording.row()) for recording in self.recordings])

    def to_dataset(self) -> "xarray.Dataset":
        """Indicators on (recording), spectra on (recording, frequency), with CF attributes."""
        import xarray

        rows = [recording.row() for recording in self.recordings]
        variables: dict[str, Any] = {}
        for key in NUMBERS:
            values = np.array(
                [np.nan if row[key] is None else row[key] for row in rows], dtype=float
            )
            variables[key] = (("recording",), values, quantity(key).attributes)
        for key in TEXTS:
            variables[key] = (
                ("recording",),
                np.array([row[key] or "" for row in rows], dtype=object),
            )
        variables["found"] = (
            ("recording",),
            np.array([row["found"] for row in rows], dtype=np.int8),
        )
        spectra, coordinates = self._spectra()
        stated = {
            key: value
            for key, value in self.scalars().items()
            if key not in ("recordings", "verdict")
        }
        attributes = {
            "Conventions": "CF-1.11",
            "title": "Contact resonance of a series of recordings",
            "source": f"asperity {version('asperity')}",
            "verdict": self.verdict(),
            "track": json.dumps(stated),
        }
        return xarray.Dataset(variables | spectra, coordinates, attributes)

    def _spectra(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Variables and coordinates of the spectra; none where no recording has one."""
        first = next(
            (recording.reading.spectrum for recording in self.recordings if recording.clean), None
        )
        if first is None:
            return {}, {}
        density = np.full((len(self.recordings), first.density.size), np.nan, np.float32)
        kept = np.zeros(density.shape, np.int8)
        for number, recording in enumerate(self.recordings):
            if recording.clean is not None:
                density[number], kept[number] = (
                    recording.clean.spectrum.density,
                    recording.clean.kept,
                )
        spectral = {"long_name": "averaged power spectral density", "units": first.unit}
        flags = {"flag_values": np.array([0, 1], np.int8), "flag_meanings": "removed kept"}
        variables = {
            "density": (("recording", "frequency"), density, spectral),
            "kept": (
                ("recording", "frequency"),
                kept,
                {"long_name": "line of the spectrum counts", **flags},
            ),
        }
        return variables, {
            "frequency": ("frequency", first.frequency_hz, quantity("frequency_hz").attributes)
        }

    def save(self, path: str | Path) -> Path:
        """Write the series whole or not at all: .csv or .parquet the table, .nc the spectra too.

        Raises
        ------
        BadInput
            for another ending, or a path that cannot be written to.
        """
        path = Path(path)
        suffix = path.suffix.lower()
        if suffix not in ENDINGS:
            raise BadInput(
                f"a track is kept as .csv, .parquet or .nc, got {path.name}; change its ending"
            )
        if suffix == ".csv":
            write_csv(path, self.table)
            return path
        with atomic_write(path) as part:
            if suffix == ".parquet":
                try:
                    self.table.to_parquet(part, index=False)
                except ImportError:
                    remedy = "pip install 'asperity[recordings]', or write a .csv"
                    raise BadInput(f"{path.name} needs pyarrow; {remedy}") from None
            else:
                packed = {"zlib": True, "complevel": 1, "shuffle": True}
                dataset = self.to_dataset()
                encoding = {name: packed for name in ("density", "kept") if name in dataset}
                part.write_bytes(netcdf_bytes(dataset, encoding))
        return path


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """A recording's line with a column for each fault's depth, each line and each band."""
    rest = {name: value for name, value in row.items() if name not in (*NAMED, "sensors")}
    heard = {
        f"{key}_{name}": value
        for name, said in row.get("sensors", {}).items()
        for key, value in said.items()
    }
    kinds = {
        f"{kind}_{name}": value
        for several, kind in NAMED.items()
        for name, value in row.get(several, {}).items()
    }
    return rest | kinds | heard


def _in_json(stages: Stages) -> dict[str, Any]:
    """What one way to read the stage says; the damping ratios are those at the first place, the break and the last."""
    return {
        "kind": stages.kind,
        "split": finite_or_none(stages.split),
        "interval": list(stages.interval) if stages.found else None,
        "slopes": [finite_or_none(slope) for slope in stages.slopes],
        "damping": [finite_or_none(ratio) for ratio in stages.damping],
        "evidence": {name: finite_or_none(value) for name, value in stages.evidence.items()},
        "verdict": stages.verdict,
    }


def _without_numbers(reason: str) -> str:
    """A reason without its numbers, so that equal ones can be counted."""
    return re.sub(r"[-+]?\d[\d.]*", "#", reason)
