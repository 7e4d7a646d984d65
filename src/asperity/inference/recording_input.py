"""Observations from recordings: tracked as a series, each with its operating point."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path

import numpy as np

from asperity.case import Case
from asperity.core.documents import Table
from asperity.coupling import search_band, structural_resonance
from asperity.inference.observations import Observation
from asperity.inference.settings import LOAD, Setting
from asperity.monitoring import (
    ZERO_CELSIUS,
    Reading,
    Track,
    TrackSettings,
    read_table,
    track_recordings,
)
from asperity.resonance import SeriesMethod
from asperity.study import overrides_at


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingInput:
    """Options for reading and analysing recordings.

    Parameters
    ----------
    table : csv with the columns file, load_n, entrainment_m_s, temperature_degc and x; missing
        values come from sidecar files, else from the case
    band_hz : search band; None: the possible band of the contact resonance
    rate_hz, unit, channel, scale, shaft_hz, method : see `track_recordings`
    """

    table: str | Path | None = None
    band_hz: tuple[float, float] | None = None
    rate_hz: float | None = None
    unit: str | None = None
    channel: str | None = None
    scale: float | None = None
    shaft_hz: Sequence[float] | None = None
    method: SeriesMethod | None = None


@dataclass(frozen=True)
class ObservedSeries:
    """Observations of a series of recordings; empty by default.

    `excluded` are the names of recordings without a usable resonance, with reasons; `notes` state
    assumptions.
    """

    track: Track | None = None
    observations: tuple[Observation, ...] = ()
    excluded: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def observe_recordings(
    paths: Sequence[str | Path],
    setting: Setting,
    *,
    source: RecordingInput | None = None,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> ObservedSeries:
    """Track recordings and combine their resonances with their operating points.

    Parameters
    ----------
    paths : files, and folders of files
    setting : defines the possible band of the resonance, over all loads and masses
    source : table of operating points, and how to read and analyse the files; None: the defaults
    workers, progress : see `track_recordings`

    Raises
    ------
    BadInput
        for a table or recordings that cannot be used.
    """
    source = source or RecordingInput()
    tracked = track_recordings(
        paths,
        TrackSettings(
            rate_hz=source.rate_hz,
            unit=source.unit,
            channel=source.channel,
            scale=source.scale,
            band_hz=source.band_hz or resonance_band(setting),
            shaft_hz=source.shaft_hz,
            method=source.method,
            workers=workers,
        ),
        case=setting.case,
        table=None if source.table is None else read_table(source.table),
        progress=progress,
    )
    return observations_from_track(tracked, setting.case)


def resonance_band(setting: Setting) -> tuple[float, float]:
    """Return the band [Hz] that can hold the contact resonance, over all loads and masses."""
    model = setting.case.vibration
    assert model is not None
    loads = next(entry for entry in setting.operating if entry.key == LOAD)
    structure = setting.case.structure
    bands = []
    for end in (0.0, 1.0):
        at_load = setting.case.with_written(overrides_at(setting.case, [loads], [end])).conditions
        if structure is None:
            bands.append(search_band(at_load, model))
        else:
            bands.append(structural_resonance(structure, at_load, model).band_hz)
    low, high = bands[0][0], bands[1][1]
    mass = next((unknown for unknown in setting.unknowns if unknown.key == "mass_kg"), None)
    if mass is None:
        return low, high
    light, heavy = (float(end) for end in mass.value(np.array([-2.0, 2.0])))
    return low * float(np.sqrt(model.mass / heavy)), high * float(np.sqrt(model.mass / light))


def observations_from_track(tracked: Track, case: Case) -> ObservedSeries:
    """Return the resonances of a track with their operating points, and notes on assumptions."""
    series = observations_from_rows(
        [recording.row() for recording in tracked.recordings], case, comparable=tracked.comparable
    )
    return replace(series, track=tracked, notes=(*tracked.notes, *series.notes))


def observations_from_rows(
    rows: Sequence[Table], case: Case, *, comparable: bool
) -> ObservedSeries:
    """Return observations from rows of `asperity track --json` or a store.

    CRFA is used only if it is `comparable` between recordings.
    """
    observations = []
    excluded = []
    assumed = set()
    for row in rows:
        name = Path(str(row["file"])).name
        if not row["found"]:
            excluded.append((name, str(row["reason"])))
        elif not row["crf_std_hz"]:
            excluded.append((name, "its method gives no standard deviation of CRF"))
        else:
            assumed |= {key for key in ("load_n", "entrainment_m_s") if row[key] is None}
            observations.append(_observation(row, name, case, comparable=comparable))
    names = {"load_n": "load", "entrainment_m_s": "entrainment speed"}
    notes = [
        f"The {names[key]} is not given for every recording; that of {case.source} was used."
        for key in sorted(assumed)
    ]
    return ObservedSeries(None, tuple(observations), tuple(excluded), tuple(notes))


def _observation(row: Table, name: str, case: Case, *, comparable: bool) -> Observation:
    """Return the observation of a row, by default at the case's load and speed."""
    load, speed, celsius, x = (
        _number(row, key) for key in ("load_n", "entrainment_m_s", "temperature_degc", "x")
    )
    crf, crf_std = _with_deviation(row, "crf_hz", "crf_std_hz")
    crfa, crfa_std = _with_deviation(row, "crfa", "crfa_std") if comparable else (nan, nan)
    damping, damping_std = _with_deviation(row, "damping_ratio", "damping_std")
    return Observation(
        load_n=case.conditions.load if load is None else load,
        entrainment_m_s=case.conditions.entrainment_speed if speed is None else speed,
        temperature_k=None if celsius is None else celsius + ZERO_CELSIUS,
        crf_hz=crf,
        crf_std_hz=crf_std,
        # missing in rows of an older store
        crf_shared_std_hz=_number(row, "crf_shared_std_hz") or 0.0,
        crfa=crfa,
        crfa_std=crfa_std,
        damping_ratio=damping,
        damping_std=damping_std,
        name=name,
        x=nan if x is None else x,
    )


def _number(row: Table, key: str) -> float | None:
    value = row.get(key)
    return value if isinstance(value, int | float) else None


def _with_deviation(row: Table, key: str, std: str) -> tuple[float, float]:
    """Return a value of a row and its standard deviation; nan if either is missing."""
    value = _number(row, key)
    deviation = _number(row, std)
    return (value, deviation) if value is not None and deviation else (nan, nan)
