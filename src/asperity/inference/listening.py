"""Recordings to observations: tracked as a series, each with the load, speed and temperature that it was made at."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isnan
from pathlib import Path

import numpy as np

from asperity.case import Case
from asperity.coupling import search_band
from asperity.inference.observations import Observation
from asperity.inference.settings import LOAD, Setting
from asperity.study import overrides_at
from asperity.tracking import ZERO_CELSIUS, Reading, Track, read_table, track_recordings
from asperity.wear import SeriesMethod


@dataclass(frozen=True)
class Listened:
    """What a series of recordings gave: by default nothing.

    `silent` are the names of recordings without a usable resonance, and why; `notes` what was taken for granted.
    """

    track: Track | None = None
    observations: tuple[Observation, ...] = ()
    silent: tuple[tuple[str, str], ...] = ()
    notes: tuple[str, ...] = ()


def listen(
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
) -> Listened:
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
        band_hz=band_hz or band_of(setting),
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
    return observed(tracked, setting.case)


def band_of(setting: Setting) -> tuple[float, float]:
    """Where the resonance of the asperities' own spring can lie [Hz], over all loads and masses that are possible."""
    model = setting.case.vibration
    assert model is not None
    loads = next(entry for entry in setting.operating if entry.key == LOAD)
    bands = [
        search_band(setting.case.with_overrides(overrides_at(setting.case, [loads], [end])).conditions, model)
        for end in (0.0, 1.0)
    ]
    low, high = bands[0][0], bands[1][1]
    mass = next((unknown for unknown in setting.unknowns if unknown.key == "mass_kg"), None)
    if mass is None:
        return low, high
    light, heavy = (float(end) for end in mass.value(np.array([-2.0, 2.0])))
    return low * float(np.sqrt(model.mass / heavy)), high * float(np.sqrt(model.mass / light))


def observed(tracked: Track, case: Case) -> Listened:
    """The resonances of a track with their operating points, and what was taken for granted."""
    observations, silent, assumed = [], [], set()
    for recording in tracked.recordings:
        name, resonance = Path(recording.file).name, recording.resonance
        if not resonance.found:
            silent.append((name, resonance.reason))
            continue
        if isnan(resonance.crf_std) or resonance.crf_std <= 0.0:
            silent.append((name, f"the method {resonance.method} states no deviation of CRF"))
            continue
        met = recording.operating
        load, speed, celsius = met.load_n, met.entrainment_m_s, met.temperature_degc
        assumed |= {key for key in ("load_n", "entrainment_m_s") if getattr(met, key) is None}
        damping, damping_std = recording.damping
        high = tracked.comparable and resonance.crfa_std > 0.0
        observations.append(
            Observation(
                load_n=case.conditions.load if load is None else load,
                entrainment_m_s=case.conditions.entrainment_speed if speed is None else speed,
                temperature_k=None if celsius is None else celsius + ZERO_CELSIUS,
                crf_hz=resonance.crf_hz,
                crf_std_hz=resonance.crf_std,
                crfa=resonance.crfa if high else np.nan,
                crfa_std=resonance.crfa_std if high else np.nan,
                damping_ratio=damping if damping_std > 0.0 else np.nan,
                damping_std=damping_std if damping_std > 0.0 else np.nan,
                name=name,
                x=recording.x,
            )
        )
    words = {"load_n": "load", "entrainment_m_s": "entrainment speed"}
    notes = [
        f"No table or sidecar says the {words[key]} of every recording; that of {case.source} was taken."
        for key in sorted(assumed)
    ]
    return Listened(tracked, tuple(observations), tuple(silent), (*tracked.notes, *notes))
