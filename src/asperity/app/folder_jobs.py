"""Jobs of worker processes: read the folders of studies and histories for the page."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from asperity.app.contact_jobs import Ticket, solve_fully
from asperity.app.contact_result import ContactMaps, ContactResult, map_fields
from asperity.case import Case
from asperity.core.arrays import Field
from asperity.simulation import (
    MotionFrame,
    WearFrame,
    WearHistory,
    is_wear_folder,
    load_history,
    load_wear,
)
from asperity.study import StudyOverview, StudyResult, group_means, load_study

MAX_FRAMES = 60  # steps of a history whose maps are shown
WEAR_CURVES = (
    "sq_m",
    "clr",
    "worn_depth_1_m",
    "worn_depth_2_m",
    "friction_coefficient",
    "crf_hz",
)
MOTION_CURVES = ("clr", "car", "h_central_m", "friction_coefficient")


class StudyAxis(NamedTuple):
    """A swept quantity: key, unit, names of its values if not numeric, logarithmic or not."""

    key: str
    unit: str
    names: tuple[str, ...]
    logarithmic: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class StudyData:
    """A study as the page shows it.

    `axes` are the swept quantities, `values` their numbers by key, (rows,); `outputs` columns of
    the table by key, (rows,), SI; `numbers` the case number of each row; `means` x, mean, low and
    high by axis and output.
    """

    verdict: str
    notes: tuple[str, ...]
    axes: tuple[StudyAxis, ...]
    values: dict[str, Field]
    outputs: dict[str, Field]
    numbers: tuple[int, ...]
    means: dict[tuple[str, str], tuple[Field, Field, Field, Field]]
    changed: tuple[dict[str, object], ...]  # overrides of each row's case, by key


def open_study(ticket: Ticket, folder: Path) -> StudyData:  # noqa: ARG001
    """Load a study: its usable rows and their means."""
    overview = StudyOverview(_study(folder, _stamp(folder)))
    axes = overview.axes
    outputs = {key: overview.used[key].to_numpy(dtype=float) for key in overview.outputs}
    means = {}
    for axis in axes:
        for key, column in outputs.items():
            finite = np.isfinite(column)
            means[axis.key, key] = group_means(
                key, axis.values[finite], column[finite], binned=axis.binned
            )
    numbers = tuple(int(number) for number in overview.used["number"])
    plan = overview.result.plan
    missing = overview.result.missing
    notes = (
        (f"{missing} of {len(plan.cases)} cases have not been computed yet.",) if missing else ()
    )
    return StudyData(
        verdict=overview.verdict(),
        notes=(
            *notes,
            *(
                f"{reason.text} ({reason.number} cases: {reason.cases})."
                for reason in overview.reasons
            ),
        ),
        axes=tuple(StudyAxis(axis.key, axis.unit, axis.names, axis.logarithmic) for axis in axes),
        values={axis.key: axis.values for axis in axes},
        outputs=outputs,
        numbers=numbers,
        means=means,
        changed=tuple(dict(plan.cases[number].overrides) for number in numbers),
    )


def solve_row(ticket: Ticket, folder: Path, number: int) -> ContactResult:
    """Solve the contact of one case of a study."""
    plan = _study(folder, _stamp(folder)).plan
    return solve_fully(ticket, plan.case.with_written(plan.cases[number].overrides))


def _stamp(folder: Path) -> float:
    """Return the time of the last change in a folder."""
    return max(path.stat().st_mtime for path in (folder, *folder.iterdir()))


@lru_cache(maxsize=2)
def _study(folder: Path, stamp: float) -> StudyResult:  # noqa: ARG001 - invalidates the cache
    return load_study(folder)


@dataclass(frozen=True, kw_only=True, eq=False)
class HistoryData:
    """A history as the page shows it: curves over time, SI by key, and maps at some times.

    `clock` is the key of the time quantity; `times` and `names` belong to the maps.
    """

    verdict: str
    notes: tuple[str, ...]
    clock: str
    time: Field
    curves: dict[str, Field]
    names: tuple[str, ...]
    times: tuple[float, ...]
    maps: tuple[ContactMaps, ...]


def open_history(ticket: Ticket, folder: Path) -> HistoryData:  # noqa: ARG001
    """Load a history of motion or wear: its curves, and maps evenly spaced over its steps."""
    if is_wear_folder(folder):
        return _wear_data(load_wear(folder))
    history = load_history(folder)
    stride = -(-len(history.frames) // MAX_FRAMES) if history.frames else 1
    frames = history.frames[::stride]
    table = history.table
    return HistoryData(
        verdict=history.verdict(),
        notes=history.notes,
        clock="time_s",
        time=table["time_s"].to_numpy(dtype=float),
        curves={key: table[key].to_numpy(dtype=float) for key in MOTION_CURVES if key in table},
        names=tuple(f"Step {frame.number}" for frame in frames),
        times=tuple(frame.time for frame in frames),
        maps=tuple(_picture(history.case, frame) for frame in frames),
    )


def _wear_data(history: WearHistory) -> HistoryData:
    table = history.table
    return HistoryData(
        verdict=history.verdict(),
        notes=history.notes,
        clock="hours",
        time=table["hours"].to_numpy(dtype=float),
        curves={
            key: table[key].to_numpy(dtype=float)
            for key in WEAR_CURVES
            if bool(table[key].notna().any())
        },
        names=tuple(f"Wear step {frame.number}" for frame in history.frames),
        times=tuple(frame.hours for frame in history.frames),
        maps=tuple(_picture(history.case, frame) for frame in history.frames),
    )


def _picture(case: Case, frame: MotionFrame | WearFrame) -> ContactMaps:
    """Return the maps of a frame; cells without pressure or contact are cavitated."""
    touching = frame.in_contact
    cavitated = (frame.pressure <= 0.0) & ~touching & (case.lubricant is not None)
    return ContactMaps(
        **map_fields(case.conditions, case.grid, frame.gap, frame.pressure, touching, cavitated)
    )
