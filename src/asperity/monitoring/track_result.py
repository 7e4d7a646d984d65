"""Result of tracking: a series with resonances, stages and alarm, as table, JSON and dataset."""

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
from asperity.core.displayed import Displayed
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput, install_text
from asperity.core.files import atomic_write, write_csv
from asperity.core.quantities import quantity
from asperity.core.storage import netcdf_bytes
from asperity.monitoring.forecast import FORECAST, ForecastResult
from asperity.monitoring.recording import NAMED, TrackedRecording, sensor_summary
from asperity.monitoring.states import (
    ORIGIN_REMEDY,
    SILENCE,
    causes,
    contact_state,
    crf_meaning,
    fault_sentence,
    fault_state,
    level_state,
    sensor_state,
)
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
SUFFIXES = (".csv", ".parquet", ".nc")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Track(Displayed):
    """A judged series of recordings.

    `recordings` are ordered by `x`, named `x_name`. `stages` follow from CRF, damping or both, as
    requested, and decide labels, probabilities and alarm; `stages_by` has all three. Without a
    resonance of the contact these are None and empty. `evidence` states why the line belongs to
    the contact, empty for a line of unknown origin. `problems` are reasons not to compare
    recordings; `notes` state choices made for the user. `silence_reason` states that recordings are
    overdue. `forecast` is None unless requested.
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
    evidence: str = ""
    silence_reason: str = ""
    forecast: ForecastResult | None = None

    @property
    def resonance_count(self) -> int:
        """Number of recordings with a contact resonance."""
        return sum(recording.resonance.found for recording in self.recordings)

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of its sensors; empty for a single sensor."""
        return tuple(
            dict.fromkeys(name for recording in self.recordings for name in recording.on_sensors)
        )

    def number_of(self, file: str) -> int | None:
        """Return the number of the recording that a file belongs to; None if unknown."""
        return next(
            (number for number, recording in enumerate(self.recordings) if file in recording.files),
            None,
        )

    def overdue(self, reason: str) -> "Track":
        """Return the track with recordings overdue: blind, unless an alarm is active."""
        sentence = f"{reason[:1].upper()}{reason[1:]}."
        track = replace(self, notes=(*self.notes, sentence), silence_reason=reason)
        if self.alarm.state == "alarm":
            return track
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
        return replace(track, alarm=blind)

    def with_forecast(self, forecast: ForecastResult) -> "Track":
        """Return the track with a forecast, which may raise the alarm at the last recording."""
        track = replace(self, forecast=forecast)
        if not forecast.alarm or self.alarm.state == "alarm":
            return track
        reason = forecast.sentence().rstrip(".")
        return replace(
            track, alarm=self.alarm.with_alarm_since(len(self.alarm.states) - 1, reason, FORECAST)
        )

    def verdict(self) -> str:
        """Return alarm, stage with its confidence and forecast, or why there is no result."""
        forecast = (
            "" if self.forecast is None or self.forecast.alarm else f" {self.forecast.sentence()}"
        )
        return f"{self._judgement()}{forecast}"

    def fault_sentence(self) -> str:
        """Return the fault that an alert or alarm indicates, with its evidence; "" without one."""
        return fault_sentence(fault_state(self.alarm))

    def _judgement(self) -> str:
        total = len(self.recordings)
        recordings = f"{total} recordings" if total != 1 else "1 recording"
        finding = self._without_resonance(recordings)
        if self.stages is not None:
            finding = (
                f"{self.stages.verdict.rstrip('.')}; "
                f"contact resonance found in {self.resonance_count} of {recordings}."
            )
        finding = " ".join(filter(None, [finding, sensor_summary(self.recordings)]))
        alarm = self.alarm
        meaning = crf_meaning(alarm, self.recordings)
        finding = " ".join(filter(None, [self.fault_sentence(), finding, meaning]))
        if alarm.explained:
            finding = f"{finding} {alarm.explained[0].upper()}{alarm.explained[1:]}."
        if alarm.state == "alarm":
            first = Path(self.recordings[alarm.since or 0].file).name
            return f"ALARM since {first}: {alarm.reason}. {finding}"
        if alarm.state == "alert":
            return f"Alert: {alarm.reason}. {finding}"
        if alarm.state in ("blind", "cannot-tell"):
            return f"{alarm.verdict} {finding}"
        return finding if self.stages is not None else f"No alarm: {alarm.level.reason}. {finding}"

    def _without_resonance(self, recordings: str) -> str:
        """Return the sentence without stages: no resonance, or a line of unknown origin."""
        lines = [recording.resonance.crf_hz for recording in self.recordings]
        if self.resonance_count:
            return (
                f"A line of unknown origin at {np.nanmedian(lines):.4g} Hz in "
                f"{self.resonance_count} of {recordings}; {ORIGIN_REMEDY}."
            )
        reasons = [recording.resonance.reason for recording in self.recordings]
        (kind, count), *_ = Counter(map(_without_numbers, reasons)).most_common(1)
        reason = next(reason for reason in reasons if _without_numbers(reason) == kind)
        share = f"{count} of {len(reasons)}: " if count < len(reasons) else ""
        return f"No contact resonance found in {recordings} ({share}{reason})."

    def stage_rows(self) -> list[tuple[str, str]]:
        """Return the stages by CRF, damping and both as rows, with the deciding one marked."""
        deciding = None if self.stages is None else self.stages.source
        return [
            (
                f"stage by {SOURCE_NAMES[source]}{' (deciding)' if source == deciding else ''}",
                stages.verdict,
            )
            for source, stages in self.stages_by.items()
        ]

    def scalars(self, *, all_sources: bool = True) -> dict[str, Any]:
        """Return the JSON of `asperity track`; without `all_sources` only the deciding stages."""
        stages = self.stages
        by_source = (
            self.stages_by if all_sources else {} if stages is None else {stages.source: stages}
        )
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
            "stages_by": {
                source: _stages_row(of_source) for source, of_source in by_source.items()
            },
            "alarm": self._alarm_row(),
            "contact": contact_state(self.recordings, self.evidence),
            "level": level_state(self.alarm, self.recordings),
            "sensor": sensor_state(self.alarm, self.recordings, self.silence_reason),
            "fault": fault_state(self.alarm),
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

    def _alarm_row(self) -> JsonObject:
        alarm = self.alarm
        return {
            "state": alarm.state,
            "since": None if alarm.since is None else self.recordings[alarm.since].file,
            "false_alarm_rate": alarm.false_alarm_rate,
            "reason": alarm.reason,
            "raised_by": alarm.raised_by or None,
            "explained": alarm.explained or None,
            "verdict": alarm.verdict,
            "causes": causes(alarm, self.recordings, self.silence_reason),
        }

    @property
    def table(self) -> "pandas.DataFrame":
        """One row per recording, in the order of x."""
        import pandas

        return pandas.DataFrame([flat(recording.row()) for recording in self.recordings])

    def to_dataset(self) -> "xarray.Dataset":
        """Return indicators on (recording) and spectra on (recording, frequency), CF attributes."""
        import xarray

        rows = [recording.row() for recording in self.recordings]
        variables: dict[str, object] = {}
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
        scalars = {
            key: value
            for key, value in self.scalars().items()
            if key not in ("recordings", "verdict")
        }
        attributes = {
            "Conventions": "CF-1.11",
            "title": "Contact resonance of a series of recordings",
            "source": f"asperity {version('asperity')}",
            "verdict": self.verdict(),
            "track": json.dumps(scalars),
        }
        return xarray.Dataset(variables | spectra, coordinates, attributes)

    def _spectra(self) -> tuple[dict[str, object], dict[str, object]]:
        """Return variables and coordinates of the spectra; empty without spectra."""
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
        variables: dict[str, object] = {
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
        """Write the series atomically: the table as .csv or .parquet, with spectra as .nc.

        Raises
        ------
        BadInput
            for another suffix, or a path that is not writable.
        """
        path = Path(path)
        suffix = path.suffix.lower()
        if suffix not in SUFFIXES:
            raise BadInput(
                f"a track is saved as .csv, .parquet or .nc, got {path.name}; change the suffix"
            )
        if suffix == ".csv":
            write_csv(path, self.table)
            return path
        with atomic_write(path) as part:
            if suffix == ".parquet":
                try:
                    self.table.to_parquet(part, index=False)
                except ImportError:
                    remedy = f"{install_text('recordings')}, or write a .csv"
                    raise BadInput(f"{path.name} needs pyarrow; {remedy}") from None
            else:
                packed = {"zlib": True, "complevel": 1, "shuffle": True}
                dataset = self.to_dataset()
                encoding = {name: packed for name in ("density", "kept") if name in dataset}
                part.write_bytes(netcdf_bytes(dataset, encoding))
        return path


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return a recording's row with one column per fault depth, line and band."""
    scalars = {name: value for name, value in row.items() if name not in (*NAMED, "sensors")}
    by_sensor = {
        f"{key}_{name}": value
        for name, values in row.get("sensors", {}).items()
        for key, value in values.items()
    }
    named = {
        f"{prefix}_{name}": value
        for field, prefix in NAMED.items()
        for name, value in row.get(field, {}).items()
    }
    return scalars | named | by_sensor


def _stages_row(stages: Stages) -> JsonObject:
    """Return stages as JSON; damping ratios are those at the first x, the break and the last x."""
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
    """Return a reason without numbers, so that equal reasons can be counted."""
    return re.sub(r"[-+]?\d[\d.]*", "#", reason)
