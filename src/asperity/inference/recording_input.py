"""Recordings to observations: tracked as a series, each with the load, speed and temperature that it was made at."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from asperity.case import Case
from asperity.coupling import search_band
from asperity.inference.observations import Observation
from asperity.inference.settings import LOAD, Setting
from asperity.monitoring import ZERO_CELSIUS, Reading, Track, read_table, track_recordings
from asperity.resonance import SeriesMethod
from asperity.study import overrides_at


@dataclass(frozen=True)
class ObservedSeries:
    """What a series of recordings gave: by default nothing.

    `silent` are the names of recordings without a usable resonance, and why; `notes` what was
    taken for granted.
    """

    track: Track | None = None
    observations: tuple[Observation, ...] = ()
    silent: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def observe_recordings(
    paths: Sequence[str | Path],
    setting: Setting,
    *,
    table: str | Path | None = None,
    band_hz: tuple[float, float] | None = None,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
    shaft_hz: Sequence[float] | None = None,
    method: SeriesMethod | None = None,
    workers: int = 1,
    progress: Callable[[Reading], None] | None = None,
) -> ObservedSeries:
    """Track recordings with the present readers and methods, and put their operating points beside their resonances.

    Parameters
    ----------
    paths : files, and folders of files
    setting : says where a resonance may lie, over all loads and masses
    table : csv with the columns file, load_n, entrainment_m_s, temperature_degc, and x; what it does not say, a sidecar
        may, and else the case's own is taken
    band_hz, rate_hz, unit, channel, scale, shaft_hz, method, workers, progress : see `track_recordings`

    Raises
    ------
    BadInput
        for a table or recordings that cannot be used.
    """
    places = None if table is None else read_table(table)
    tracked = track_recordings(
        paths,
        case=setting.case,
        band_hz=band_hz or resonance_band(setting),
        rate_hz=rate_hz,
        unit=unit,
        channel=channel,
        scale=scale,
        table=places,
        shaft_hz=shaft_hz,
        method=method,
        workers=workers,
        progress=progress,
    )
    return observations_from_track(tracked, setting.case)


def resonance_band(setting: Setting) -> tuple[float, float]:
    """Where the resonance of the asperities' own spring can lie [Hz], over all loads and masses that are possible."""
    model = setting.case.vibration
    assert model is not None
    loads = next(entry for entry in setting.operating if entry.key == LOAD)
    bands = [
        search_band(
            setting.case.with_overrides(overrides_at(setting.case, [loads], [end])).conditions,
            model,
        )
        for end in (0.0, 1.0)
    ]
    low, high = bands[0][0], bands[1][1]
    mass = next((unknown for unknown in setting.unknowns if unknown.key == "mass_kg"), None)
    if mass is None:
        return low, high
    light, heavy = (float(end) for end in mass.value(np.array([-2.0, 2.0])))
    return low * float(np.sqrt(model.mass / heavy)), high * float(np.sqrt(model.mass / light))


def observations_from_track(tracked: Track, case: Case) -> ObservedSeries:
    """The resonances of a track with their operating points, and what was taken for granted."""
    heard = observations_from_rows(
        [one.row() for one in tracked.recordings], case, comparable=tracked.comparable
    )
    return replace(heard, track=tracked, notes=(*tracked.notes, *heard.notes))


def observations_from_rows(
    rows: Sequence[Mapping[str, Any]], case: Case, *, comparable: bool
) -> ObservedSeries:
    """The same of lines as `asperity track --json` and a store have them; CRFA counts where it is `comparable`."""
    observations, silent, assumed = [], [], set()
    for row in rows:
        name, std = Path(row["file"]).name, row["crf_std_hz"]
        if not row["found"]:
            silent.append((name, row["reason"]))
            continue
        if not std:
            silent.append((name, "its method states no deviation of CRF"))
            continue
        assumed |= {key for key in ("load_n", "entrainment_m_s") if row[key] is None}
        speed, celsius = row["entrainment_m_s"], row["temperature_degc"]
        crfa, crfa_std = _with_deviation(row, "crfa", "crfa_std") if comparable else (nan, nan)
        damping, damping_std = _with_deviation(row, "damping_ratio", "damping_std")
        observations.append(
            Observation(
                load_n=case.conditions.load if row["load_n"] is None else row["load_n"],
                entrainment_m_s=case.conditions.entrainment_speed if speed is None else speed,
                temperature_k=None if celsius is None else celsius + ZERO_CELSIUS,
                crf_hz=row["crf_hz"],
                crf_std_hz=std,
                crf_shared_std_hz=row.get("crf_shared_std_hz")
                or 0.0,  # lines of an older store do not say
                crfa=crfa,
                crfa_std=crfa_std,
                damping_ratio=damping,
                damping_std=damping_std,
                name=name,
                x=nan if row["x"] is None else row["x"],
            )
        )
    words = {"load_n": "load", "entrainment_m_s": "entrainment speed"}
    notes = [
        f"No table or sidecar says the {words[key]} of every recording; that of {case.source} was taken."
        for key in sorted(assumed)
    ]
    return ObservedSeries(None, tuple(observations), tuple(silent), tuple(notes))


def _with_deviation(row: Mapping[str, Any], key: str, std: str) -> tuple[float, float]:
    """A number of a line and its deviation; nan where there is none."""
    return (row[key], row[std]) if row[key] is not None and row[std] else (nan, nan)
