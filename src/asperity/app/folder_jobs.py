"""What workers do with studies and histories: read their folders, and make of them what the page shows."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.app.contact_jobs import Ticket, solve_fully
from asperity.app.contact_result import Answer, Picture, picture_parts
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

MOST_FRAMES = 60  # steps of a history whose maps are shown
OF_WEAR = (
    "sq_m",
    "clr",
    "worn_depth_1_m",
    "worn_depth_2_m",
    "friction_coefficient",
    "crf_hz",
)  # what of a worn one's
OF_STEPS = ("clr", "car", "h_central_m", "friction_coefficient")  # what a history's curves show


class Scatter(NamedTuple):
    """A swept quantity: its key, unit, the names of its places where it is no number, and whether it crowds low."""

    key: str
    unit: str
    names: tuple[str, ...]
    logarithmic: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Swept:
    """A study as the page shows it.

    `axes` are what was swept, `values` their numbers by key, (rows,); `outputs` columns of the
    table by key, (rows,), SI, and `numbers` the number of each row's case. `means` are x, mean,
    low and high by axis and output.
    """

    verdict: str
    notes: tuple[str, ...]
    axes: tuple[Scatter, ...]
    values: dict[str, Field]
    outputs: dict[str, Field]
    numbers: tuple[int, ...]
    means: dict[tuple[str, str], tuple[Field, Field, Field, Field]]
    changed: tuple[dict[str, Any], ...]  # of each row, what its case differs in, by key


def open_study(ticket: Ticket, folder: Path) -> Swept:  # noqa: ARG001
    """A study's rows that may be used, with their means."""
    overview = StudyOverview(_study(folder, _stamp(folder)))
    axes = overview.axes
    outputs = {key: overview.used[key].to_numpy(dtype=float) for key in overview.outputs}
    means = {}
    for axis in axes:
        for key, column in outputs.items():
            known = np.isfinite(column)
            means[axis.key, key] = group_means(
                axis.values[known], column[known], binned=axis.binned
            )
    numbers = tuple(int(number) for number in overview.used["number"])
    plan = overview.result.plan
    missing = overview.result.missing
    notes = (
        (f"{missing} of {len(plan.cases)} cases have not been computed yet.",) if missing else ()
    )
    return Swept(
        verdict=overview.verdict(),
        notes=(
            *notes,
            *(
                f"{reason.text} ({reason.number} cases: {reason.cases})."
                for reason in overview.reasons
            ),
        ),
        axes=tuple(Scatter(axis.key, axis.unit, axis.names, axis.logarithmic) for axis in axes),
        values={axis.key: axis.values for axis in axes},
        outputs=outputs,
        numbers=numbers,
        means=means,
        changed=tuple(dict(plan.cases[number].overrides) for number in numbers),
    )


def solve_row(ticket: Ticket, folder: Path, number: int) -> Answer:
    """The contact of one case of a study, solved anew."""
    plan = _study(folder, _stamp(folder)).plan
    return solve_fully(ticket, plan.case.with_overrides(plan.cases[number].overrides))


def _stamp(folder: Path) -> float:
    """When a folder last changed."""
    return max(path.stat().st_mtime for path in (folder, *folder.iterdir()))


@lru_cache(maxsize=2)
def _study(folder: Path, stamp: float) -> StudyResult:  # noqa: ARG001 - one that has grown is read anew
    return load_study(folder)


@dataclass(frozen=True, kw_only=True, eq=False)
class Moved:
    """A history as the page shows it: curves over time, SI by key, and maps of some moments.

    `clock` is the key of the quantity that time is; `times` the moments that have maps, `names`
    what they are called.
    """

    verdict: str
    notes: tuple[str, ...]
    clock: str
    time: Field
    curves: dict[str, Field]
    names: tuple[str, ...]
    times: tuple[float, ...]
    pictures: tuple[Picture, ...]


def open_history(ticket: Ticket, folder: Path) -> Moved:  # noqa: ARG001
    """A history's curves, and maps evenly over its steps; of a contact that wears, over its hours."""
    if is_wear_folder(folder):
        return _worn(load_wear(folder))
    history = load_history(folder)
    every = -(-len(history.frames) // MOST_FRAMES) if history.frames else 1
    frames = history.frames[::every]
    table = history.table
    return Moved(
        verdict=history.verdict(),
        notes=history.notes,
        clock="time_s",
        time=table["time_s"].to_numpy(dtype=float),
        curves={key: table[key].to_numpy(dtype=float) for key in OF_STEPS if key in table},
        names=tuple(f"Step {frame.number}" for frame in frames),
        times=tuple(frame.time for frame in frames),
        pictures=tuple(_picture(history.case, frame) for frame in frames),
    )


def _worn(history: WearHistory) -> Moved:
    table = history.table
    return Moved(
        verdict=history.verdict(),
        notes=history.notes,
        clock="hours",
        time=table["hours"].to_numpy(dtype=float),
        curves={
            key: table[key].to_numpy(dtype=float)
            for key in OF_WEAR
            if bool(table[key].notna().any())
        },
        names=tuple(f"Jump {frame.number}" for frame in history.frames),
        times=tuple(frame.hours for frame in history.frames),
        pictures=tuple(_picture(history.case, frame) for frame in history.frames),
    )


def _picture(case: Case, frame: MotionFrame | WearFrame) -> Picture:
    """The maps of a moment; cells without pressure or contact have ruptured, as in a contact at rest."""
    touching = frame.in_contact
    ruptured = (frame.pressure <= 0.0) & ~touching & (case.lubricant is not None)
    return Picture(
        **picture_parts(case.conditions, case.grid, frame.gap, frame.pressure, touching, ruptured)
    )
