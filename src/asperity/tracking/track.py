"""A series of recordings as one: indicators, trend, stages, alarm, and one sentence on all of it.

Reading is left to `listen`, the methods to `asperity.wear`; what is said here is how they are put together.
"""

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Field
from asperity.case import Case
from asperity.errors import BadInput
from asperity.files import whole_file
from asperity.recording import ACCELERATION
from asperity.tracking.files import Place, Table, read_table, recordings_in
from asperity.tracking.listen import WINDOW, Asked, Heard, common_spacing, listen_to_all
from asperity.tracking.target import Target, search_target
from asperity.wear import (
    FEWEST_RECORDINGS,
    Alarm,
    CleanSpectrum,
    RecordingFacts,
    Resonance,
    Stages,
    asperity_load_share,
    comparability,
    no_resonance,
    remove_lines,
    series_resonances,
    split_stages,
    trend_alarm,
)

if TYPE_CHECKING:
    import pandas
    import xarray

ALERT, DANGER = 0.5, 0.9  # probability of severe wear
IN_A_ROW = 3
QUIET_SHARE = 0.05  # rms over the series' median, below which the machine was off
MOST_TOGETHER = 400  # recordings separated at once: memory grows with their square, time with their cube
SAME_LINES = 0.25  # of a line, by which the highest lines of two spectra may differ and still be laid on one another
ALONE = "modes"  # method where there are too few recordings for the joint separation


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracked:
    """One recording of a series.

    `resonance` is not found, with its reason, for a recording that could not be used. `clr` and its 90 % interval are
    the contact model's reading of the CRF, nan without one. `severe` is the probability of the severe stage, `label`
    the stage's name; `level` that of the alarm.
    """

    file: str
    x: float
    x_std: float
    heard: Heard
    clean: CleanSpectrum | None
    resonance: Resonance
    load_n: float | None = None
    speed_hz: float | None = None
    clr: float = np.nan
    clr_interval: tuple[float, float] = (np.nan, np.nan)
    severe: float = np.nan
    label: str = "none"
    level: str = "none"

    def row(self) -> dict[str, Any]:
        """Its line of the table, by the names of `asperity track --json`; None where there is nothing."""
        found, quality = self.resonance, self.heard.quality
        return {
            "file": self.file,
            "x": _finite(self.x),
            "x_std": _finite(self.x_std),
            "crf_hz": _finite(found.crf_hz),
            "crf_std_hz": _finite(found.crf_std_hz),
            "crfa": _finite(found.crfa),
            "crfa_std": _finite(found.crfa_std),
            "found": found.found,
            "reason": found.reason,
            "clr": _finite(self.clr),
            "clr_low": _finite(self.clr_interval[0]),
            "clr_high": _finite(self.clr_interval[1]),
            "severe_probability": _finite(self.severe),
            "label": self.label,
            "level": self.level,
            "started": self.heard.started or None,
            "rate_hz": _finite(self.heard.rate_hz),
            "unit": self.heard.unit or None,
            "duration_s": None if quality is None else quality.duration_s,
            "rms": None if quality is None else _finite(quality.rms),
            "load_n": self.load_n,
            "speed_hz": self.speed_hz,
            "remarks": "; ".join(quality.remarks) if quality is not None else "",
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """A series of recordings, judged.

    `recordings` in the order of `x`; `x_name` says what that is. `stages` is None where no resonance was found at all.
    `problems` are sentences for which recordings should not be compared; `notes` say what was chosen for the user.
    """

    recordings: tuple[Tracked, ...]
    x_name: str
    target: Target
    method: str
    stages: Stages | None
    alarm: Alarm
    comparable: bool
    problems: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def found(self) -> int:
        """In how many recordings a contact resonance was found."""
        return sum(one.resonance.found for one in self.recordings)

    @property
    def alarmed(self) -> bool:
        """Whether the verdict is an alarm."""
        return self.alarm.level == "alarm"

    def verdict(self) -> str:
        """One sentence: the stage with its confidence, or that these recordings cannot tell, and why."""
        total = len(self.recordings)
        several = f"{total} recordings" if total != 1 else "1 recording"
        if self.stages is None:
            reasons = Counter(_kind(one.resonance.reason) for one in self.recordings)
            (kind, count), *_ = reasons.most_common(1)
            reason = next(one.resonance.reason for one in self.recordings if _kind(one.resonance.reason) == kind)
            share = f"{count} of {total}: " if count < total else ""
            return f"These recordings cannot tell: no contact resonance found in {several} ({share}{reason})."
        heard = f"contact resonance found in {self.found} of {several}"
        level = {"alarm": "ALARM: ", "alert": "Alert: "}.get(self.alarm.level, "")
        return f"{level}{self.stages.verdict.rstrip('.')}; {heard}."

    def scalars(self) -> dict[str, Any]:
        """Everything that `asperity track --json` prints."""
        stages = self.stages
        return {
            "verdict": self.verdict(),
            "recordings": [one.row() for one in self.recordings],
            "stages": {
                "kind": None if stages is None else stages.kind,
                "split": None if stages is None else _finite(stages.split),
                "interval": None if stages is None else _finite_pair(stages.interval),
                "probability": [_finite(one.severe) for one in self.recordings],
                "labels": [one.label for one in self.recordings],
                "evidence": {} if stages is None else {k: _finite(v) for k, v in stages.evidence.items()},
            },
            "alarm": {"level": self.alarm.level, "verdict": self.alarm.verdict},
            "x": self.x_name,
            "band_hz": list(self.target.band_hz),
            "band_source": self.target.source,
            "full_load_crf_hz": self.target.full_load_crf_hz,
            "method": self.method,
            "crfa_comparable": self.comparable,
            "problems": list(self.problems),
            "notes": list(self.notes),
        }

    def table(self) -> "pandas.DataFrame":
        """One row a recording, in the order of x."""
        import pandas

        return pandas.DataFrame([one.row() for one in self.recordings])

    def to_dataset(self) -> "xarray.Dataset":
        """Indicators on (recording), spectra on (recording, frequency), with CF attributes."""
        import json
        from importlib.metadata import version

        import xarray

        rows = [one.row() for one in self.recordings]
        variables: dict[str, Any] = {}
        for key, (text, unit) in _COLUMNS.items():
            values = np.array([np.nan if row[key] is None else row[key] for row in rows], dtype=float)
            variables[key] = (("recording",), values, {"long_name": text, "units": unit})
        for key in ("file", "reason", "label", "started"):
            variables[key] = (("recording",), np.array([row[key] or "" for row in rows], dtype=object))
        variables["found"] = (("recording",), np.array([row["found"] for row in rows], dtype=np.int8))
        coordinates: dict[str, Any] = {}
        drawn = [one for one in self.recordings if one.clean is not None]
        if drawn:
            first = drawn[0].heard.spectrum
            assert first is not None
            density = np.full((len(rows), first.density.size), np.nan, np.float32)
            kept = np.zeros(density.shape, np.int8)
            for number, one in enumerate(self.recordings):
                if one.clean is not None:
                    density[number], kept[number] = one.clean.spectrum.density, one.clean.kept
            spectral = {"long_name": "averaged power spectral density", "units": first.unit}
            variables["density"] = (("recording", "frequency"), density, spectral)
            meaning = {"long_name": "line of the spectrum counts", "flag_values": np.array([0, 1], np.int8)}
            variables["kept"] = (("recording", "frequency"), kept, meaning | {"flag_meanings": "removed kept"})
            axis = {"long_name": "frequency", "units": "Hz"}
            coordinates["frequency"] = ("frequency", first.frequency_hz, axis)
        told = {key: value for key, value in self.scalars().items() if key not in ("recordings", "verdict")}
        attributes = {
            "Conventions": "CF-1.11",
            "title": "Contact resonance of a series of recordings",
            "source": f"asperity {version('asperity')}",
            "verdict": self.verdict(),
            "track": json.dumps(told),
        }
        return xarray.Dataset(variables, coordinates, attributes)

    def save(self, path: str | Path) -> Path:
        """Write the series whole or not at all: .csv or .parquet the table, .nc the spectra too.

        Raises
        ------
        BadInput
            for another ending, or a path that cannot be written to.
        """
        path = Path(path)
        suffix = path.suffix.lower()
        if suffix not in (".csv", ".parquet", ".nc"):
            raise BadInput(f"a track is kept as .csv, .parquet or .nc, got {path.name}; change its ending")
        with whole_file(path) as part:
            if suffix == ".csv":
                self.table().to_csv(part, index=False, lineterminator="\n")
            elif suffix == ".parquet":
                _require_pyarrow(path)
                self.table().to_parquet(part, index=False)
            else:
                packed = {"zlib": True, "complevel": 1, "shuffle": True}
                dataset = self.to_dataset()
                encoding = {name: packed for name in ("density", "kept") if name in dataset}
                dataset.to_netcdf(part, engine="h5netcdf", encoding=encoding)
        return path


_COLUMNS = {
    "x": ("place in the series", "1"),
    "x_std": ("standard deviation of x", "1"),
    "crf_hz": ("contact resonance frequency", "Hz"),
    "crf_std_hz": ("standard deviation of the contact resonance frequency", "Hz"),
    "crfa": ("contact resonance amplitude", "(m/s^2)^2/Hz"),
    "crfa_std": ("standard deviation of the contact resonance amplitude", "(m/s^2)^2/Hz"),
    "clr": ("load share of asperities as the model reads it", "1"),
    "clr_low": ("lower end of its 90 % interval", "1"),
    "clr_high": ("upper end of its 90 % interval", "1"),
    "severe_probability": ("probability of the severe stage", "1"),
    "duration_s": ("length of the record", "s"),
    "rate_hz": ("sampling rate", "Hz"),
}


def track_recordings(
    paths: Sequence[str | Path],
    *,
    case: Case | None = None,
    band_hz: tuple[float, float] | None = None,
    rate_hz: float | None = None,
    unit: str | None = None,
    channel: str | None = None,
    scale: float | None = None,
    x: Sequence[float] | None = None,
    table: str | Path | None = None,
    shaft_hz: Sequence[float] | None = None,
    method: str | None = None,
    detector: str = "bayesian",
    workers: int = 1,
    progress: Callable[[Heard], None] | None = None,
) -> Track:
    """From files to stages: read, check, spectrum, indicators, trend, stages, alarm.

    Parameters
    ----------
    paths : files, and folders of files
    case : its contact model says where the resonance may lie, and what load share a CRF stands for
    band_hz : where to look instead; without either, the paper's contact stands in, and `notes` say so
    rate_hz, unit, channel, scale : as `read_recording` takes them, for all recordings alike
    x : place of each recording in the series, shape (recordings,); or `table`, a csv as `read_table` takes it;
        otherwise the hours since the first, where all say when they began, or their number
    shaft_hz : speeds of shafts whose harmonics are removed; None finds them
    method : of `series_resonances`; None takes "joint" from 6 recordings on, and of fewer says that one spectrum
        cannot tell whose resonance it shows
    detector : of `split_stages`
    workers : processes that read at the same time
    progress : called with each file that was read

    Raises
    ------
    BadInput
        where nothing can be read at all, or something given does not fit.
    """
    target = search_target(case, band_hz)
    files = recordings_in(paths)
    places = _placed(files, x, read_table(table) if table is not None else None)
    asked = Asked(rate_hz=rate_hz, unit=unit, channel=channel, scale=scale)
    spacing = common_spacing(files, asked, target)
    heard: list[Heard | None] = [None] * len(files)
    for number, one in listen_to_all(files, asked, target, spacing, workers=workers, progress=progress):
        heard[number] = one
    done = [one for one in heard if one is not None]
    if all(one.spectrum is None and one.quality is None for one in done):
        others = f" (and so on for {len(done) - 1} more files)" if len(done) > 1 else ""
        raise BadInput(f"{done[0].reason}{others}")
    x_name, named = places
    return judge(done, target, named, x_name, shaft_hz=shaft_hz, method=method, detector=detector)


def judge(
    heard: Sequence[Heard],
    target: Target,
    places: Mapping[str, Place] | None = None,
    x_name: str = "",
    *,
    shaft_hz: Sequence[float] | None = None,
    method: str | None = None,
    detector: str = "bayesian",
) -> Track:
    """What recordings say together that have been listened to; otherwise as `track_recordings`."""
    notes = [f"The band is {target.source}."] if target.assumed else []
    if places is None:
        places, x_name = _in_time(heard)
    x = np.array([places[one.file].x for one in heard])
    order = np.argsort(x, kind="stable")
    series = [heard[number] for number in order]
    series = _without_silence(series)
    series, others = _on_one_grid(series)
    notes += others
    used = [number for number, one in enumerate(series) if one.usable]
    cleaned = [remove_lines(_spectrum(series[number]), shaft_hz=shaft_hz) for number in used]
    chosen = method or ("joint" if len(used) >= FEWEST_RECORDINGS else ALONE)
    if method is None and chosen != "joint" and used:
        notes.append(
            f"The joint separation, which tells the contact from the machine by what moves, needs {FEWEST_RECORDINGS} "
            f"recordings and has {len(used)}; --method {chosen} takes for the contact's what stands out of each."
        )
    groups = -(-len(used) // MOST_TOGETHER) if chosen == "joint" else 1
    if groups > 1:
        notes.append(f"{len(used)} recordings were separated in {groups} groups, each spread over the whole series.")
    resonances = _resonances(cleaned, target, chosen, groups)
    if method is None and chosen == ALONE:
        resonances = tuple(_whose(resonance) for resonance in resonances)
    by_number = dict(zip(used, zip(cleaned, resonances, strict=True), strict=True))
    tracked = []
    for number, one in enumerate(series):
        place = places[one.file]
        clean, resonance = by_number.get(number, (None, None))
        tracked.append(
            Tracked(
                file=one.file,
                x=place.x,
                x_std=place.x_std or 0.0,
                heard=one,
                clean=clean,
                resonance=resonance or _unheard(one.reason, target, chosen),
                load_n=place.load_n,
                speed_hz=place.speed_hz,
            )
        )
    comparable = bool(used) and all(series[number].unit == ACCELERATION for number in used)
    return _staged(tracked, x_name, target, chosen, detector, comparable, notes)


def _staged(
    tracked: list[Tracked],
    x_name: str,
    target: Target,
    method: str,
    detector: str,
    comparable: bool,
    notes: list[str],
) -> Track:
    x = np.array([one.x for one in tracked])
    crf = np.array([one.resonance.crf_hz for one in tracked])
    crf_std = np.array([one.resonance.crf_std for one in tracked])
    stages = None
    severe: Field = np.full(x.size, np.nan)
    labels: tuple[str, ...] = ("none",) * x.size
    if np.isfinite(crf).any():
        stages = split_stages(
            x,
            crf,
            np.array([one.resonance.crfa for one in tracked]) if comparable else None,
            crf_std_hz=np.where(np.isfinite(crf_std), crf_std, 0.0),
            x_std=np.array([one.x_std for one in tracked]),
            detector=detector,
            unit=_unit_of(x_name),
        )
        severe = np.where(np.isfinite(crf), stages.probability, np.nan)
        labels = stages.labels
    raised = trend_alarm(severe, alert=ALERT, danger=DANGER, in_a_row=IN_A_ROW, thing="the probability of severe wear")
    full = target.full_load_crf_hz
    if full is not None:
        share = asperity_load_share(crf, np.where(np.isfinite(crf_std), crf_std, 0.0), full)
        intervals = list(zip(share.interval[0].tolist(), share.interval[1].tolist(), strict=True))
        tracked = [
            replace(one, clr=float(clr), clr_interval=interval)
            for one, clr, interval in zip(tracked, share.clr, intervals, strict=True)
        ]
    tracked = [
        replace(one, severe=float(probability), label=label, level=level)
        for one, probability, label, level in zip(tracked, severe, labels, raised.levels, strict=True)
    ]
    facts = [
        RecordingFacts(
            name=Path(one.file).name,
            rate_hz=one.heard.rate_hz,
            segment=one.heard.spectrum.segment,
            window=WINDOW,
            unit=one.heard.unit,
            duration_s=one.heard.spectrum.duration_s,
            speed_hz=one.speed_hz,
            load_n=one.load_n,
        )
        for one in tracked
        if one.heard.spectrum is not None and one.clean is not None
    ]
    if not comparable and facts:
        units = ", ".join(sorted({one.heard.unit for one in tracked if one.clean is not None}))
        notes.append(f"CRFA is not comparable with other series: its unit is {units}, not m/s^2. CRF is.")
    notes.extend(_copies(tracked))
    return Track(
        recordings=tuple(tracked),
        x_name=x_name,
        target=target,
        method=method,
        stages=stages,
        alarm=raised,
        comparable=comparable,
        problems=comparability(facts),
        notes=tuple(notes),
    )


def _copies(tracked: Sequence[Tracked]) -> list[str]:
    """A sentence for each recording whose spectrum is another's: one of them is a copy."""
    sampled = []
    for one in tracked:
        if one.heard.spectrum is not None:
            density = one.heard.spectrum.density
            sampled.append((density[:: max(1, density.size // 16)][1:], Path(one.file).name))
    sampled.sort(key=lambda pair: float(pair[0].sum()))
    return [
        f"{name} and {other} hold the same samples; leave one of them out."
        for (one, name), (two, other) in pairwise(sampled)
        if one.shape == two.shape and np.allclose(one, two, rtol=1e-4, atol=0.0)
    ]


def _placed(
    files: Sequence[Path], x: Sequence[float] | None, table: Table | None
) -> tuple[str, dict[str, Place] | None]:
    """The name of x, and the place of each file where the caller states it."""
    if x is not None and table is not None:
        raise BadInput("x and table both say where recordings stand; give one of them")
    if x is not None:
        if len(x) != len(files):
            raise BadInput(f"x needs one value for each of {len(files)} recordings, got {len(x)}")
        return "x", {str(file): Place(x=float(value)) for file, value in zip(files, x, strict=True)}
    if table is not None:
        return table.x_name, {str(file): table.place(file) for file in files}
    return "", None


def _in_time(heard: Sequence[Heard]) -> tuple[dict[str, Place], str]:
    """Hours since the first recording, where all say when they began and not all at once; their number otherwise."""
    times = [one.time for one in heard]
    known = [time for time in times if time is not None]
    if len(known) == len(heard) and len(set(known)) > 1:
        first = min(known)
        hours = [(time - first).total_seconds() / 3600.0 for time in known]
        return {one.file: Place(x=hour) for one, hour in zip(heard, hours, strict=True)}, "time_h"
    return {one.file: Place(x=float(number)) for number, one in enumerate(heard, 1)}, "recording"


def _without_silence(series: list[Heard]) -> list[Heard]:
    """Recordings far quieter than the series are off: of a machine at rest an accelerometer still hears the hall."""
    by_unit: dict[str, list[float]] = {}
    for one in series:
        if one.usable and one.quality is not None:
            by_unit.setdefault(one.unit, []).append(one.quality.rms)
    judged = []
    for one in series:
        usual = float(np.median(by_unit[one.unit])) if one.usable else 0.0
        if one.usable and one.quality is not None and one.quality.rms < QUIET_SHARE * usual:
            share = 100.0 * one.quality.rms / usual
            reason = f"the machine was off, or the sensor disconnected: rms is {share:.1g} % of the series' median"
            one = replace(one, reason=reason)
        judged.append(one)
    return judged


def _on_one_grid(series: list[Heard]) -> tuple[list[Heard], list[str]]:
    """All usable spectra on the frequencies that most of them have; the others are left out, with the reason."""
    grids = Counter(
        (one.spectrum.segment, round(one.rate_hz)) for one in series if one.usable and one.spectrum is not None
    )
    if not grids:
        return series, []
    (segment, rate), _ = grids.most_common(1)[0]
    first = next(
        one.spectrum
        for one in series
        if one.usable and one.spectrum is not None and (one.spectrum.segment, round(one.rate_hz)) == (segment, rate)
    )
    laid: list[Heard] = []
    left_out = 0
    for one in series:
        if not one.usable or one.spectrum is None:
            laid.append(one)
            continue
        same = one.spectrum.frequency_hz.shape == first.frequency_hz.shape
        apart = abs(one.spectrum.frequency_hz[-1] - first.frequency_hz[-1]) if same else np.inf
        if apart <= SAME_LINES * first.spacing_hz:
            laid.append(replace(one, spectrum=replace(one.spectrum, frequency_hz=first.frequency_hz)))
        else:
            reason = f"sampled at {one.rate_hz:g} Hz where the series has {rate:g} Hz; track it apart"
            laid.append(replace(one, reason=reason))
            left_out += 1
    notes = (
        [f"{left_out} of {len(series)} recordings have another sampling rate and were left out."] if left_out else []
    )
    return laid, notes


def _spectrum(one: Heard) -> Any:
    assert one.spectrum is not None
    return one.spectrum


def _resonances(cleaned: list[CleanSpectrum], target: Target, method: str, groups: int) -> tuple[Resonance, ...]:
    """One a spectrum; each group takes every so-manieth spectrum, so that all see the whole series."""
    found: list[Resonance | None] = [None] * len(cleaned)
    for first in range(min(groups, len(cleaned))):
        mine = cleaned[first::groups]
        found[first::groups] = series_resonances(
            [one.spectrum for one in mine],
            band_hz=target.band_hz,
            method=method,
            kept=[one.kept for one in mine],
        )
    return tuple(one for one in found if one is not None)


def _whose(resonance: Resonance) -> Resonance:
    """A line that stands out of one spectrum may as well be a structure's: on real bearings it mostly is."""
    if not resonance.found:
        return resonance
    reason = (
        f"a line at {resonance.crf_hz:.0f} Hz stands out, but one spectrum cannot tell whether it is the contact's or "
        "the machine's"
    )
    nothing = no_resonance(reason, resonance.band_hz, resonance.method, resonance.floor, resonance.evidence)
    return replace(nothing, background=resonance.background)


def _unheard(reason: str, target: Target, method: str) -> Resonance:
    return no_resonance(reason, target.band_hz, method)


def _unit_of(x_name: str) -> str:
    """The unit at the end of a heading such as sq_um."""
    ending = x_name.rpartition("_")[2]
    return (
        ending if ending in ("um", "mm", "nm", "m", "h", "s", "min", "d", "km", "cycles") and ending != x_name else ""
    )


def _kind(reason: str) -> str:
    """A reason without its numbers, so that equal ones can be counted."""
    return re.sub(r"[-+]?\d[\d.]*", "#", reason)


def _require_pyarrow(path: Path) -> None:
    try:
        import pyarrow  # noqa: F401
    except ImportError:
        raise BadInput(f"{path.name} needs pyarrow; pip install 'asperity[recordings]', or write a .csv") from None


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _finite_pair(pair: tuple[float, float]) -> list[float] | None:
    return [float(end) for end in pair] if np.isfinite(pair).all() else None
