"""A machine's contacts solved: each a case of a study, kept as it ends, resumed, and spread over processes.

Contacts that are the same (both sides of a load zone) are solved once.
"""

import json
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas

from asperity.case import Case, MachineCase
from asperity.core.arrays import finite_or_none
from asperity.core.errors import BadInput
from asperity.core.processes import cores
from asperity.machine import MachineContact
from asperity.machines.result import MachineResult, condition_row
from asperity.results import Run, load_run, solve_case
from asperity.study import DONE, StudyPlan, StudyProgress, plan_points, run_study

ALL_CELLS = 1_000_000  # of chosen grids together: about two minutes on two processors
FEWEST_CELLS = 48  # along an axis
# surfaces that a contact's numbers are means of, unless [solver] says: few where their cells are
# many
MANY_SURFACES, FEW_SURFACES, FINE_GRID = 5, 3, 128 * 128
WORST = "worst.nc"
SOLVED = (  # what is read off every solved contact
    *(
        "h_central_m",
        "h_min_m",
        "lambda_ratio",
        "clr",
        "clr_low",
        "clr_high",
        "car",
        "determined",
        "surfaces",
    ),
    *(
        "p_max_pa",
        "friction_coefficient",
        "friction_power_w",
        "flash_temperature_max_k",
        "von_mises_core_pa",
    ),
    *("crf_hz", "crf_low_hz", "crf_high_hz"),
)


def machine_conditions(case: MachineCase) -> MachineResult:
    """The contacts' conditions alone; nothing is solved."""
    begun = time.perf_counter()
    rows = tuple(condition_row(contact, case) for contact in case.contacts)
    return MachineResult(case, rows, False, time.perf_counter() - begun)


def solve_machine(
    case: MachineCase,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> MachineResult:
    """Solve every contact of a machine.

    Parameters
    ----------
    case : from `load_machine`
    out : folder that keeps the contacts as they end, and to go on from; None: in memory
    workers, executor, progress : as of `run_study`

    Raises
    ------
    BadInput
        for a case that lacks what solving needs, or whose contacts draw no oil in; a folder that cannot be used.
    AsperityError
        if results cannot be written.
    """
    begun = time.perf_counter()
    if not case.complete:
        raise BadInput(
            f"{case.source}: solving needs [lubricant] and [surface]; add them, or ask for a dry run"
        )
    drawn = [contact for contact in case.contacts if not contact.stands_still]
    if not drawn:
        raise BadInput(f"{case.source}: no contact draws oil in; correct the speeds")
    plan, places = _plan(case, drawn)
    found = run_study(plan, out=out, workers=workers, executor=executor, progress=progress)
    table = found.table.set_index("point")
    rows = tuple(
        {**condition_row(contact, case), **_solved(table, places.get(contact.name))}
        for contact in case.contacts
    )
    result = MachineResult(case, rows, True, time.perf_counter() - begun, found.folder)
    if found.folder is None or result.worst.get("clr") is None:
        return result
    point = next(entry for entry in plan.cases if entry.point == places[result.worst["name"]])
    run = _opened(plan.case.with_overrides(point.overrides), found.folder / WORST)
    return replace(result, run=run, seconds=time.perf_counter() - begun)


def _opened(case: Case, path: Path) -> Run:
    """A contact with its fields: kept before, or solved now and kept."""
    if path.exists():
        kept = load_run(path)
        if kept.case.text == case.text:
            return kept
    run = solve_case(case, surfaces=None, workers=cores(), strict=False)
    run.save(path)
    return run


def _plan(
    case: MachineCase, contacts: Sequence[MachineContact]
) -> tuple[StudyPlan, dict[str, int]]:
    """A study of the contacts that differ, and which of its points each contact is."""
    keys = {contact.name: json.dumps(case.contact_table(contact)) for contact in contacts}
    different = {keys[contact.name]: contact for contact in reversed(contacts)}
    order = list(dict.fromkeys(keys.values()))
    points = [
        {"contact": json.loads(key), **_effort(case.case(different[key]), ALL_CELLS // len(order))}
        for key in order
    ]
    places = {name: order.index(key) for name, key in keys.items()}
    base = case.case(contacts[0])
    seed = getattr(base.contents.surface, "seed", None)
    axes = list(dict.fromkeys(key for point in points for key in point))
    seeds = 1 if seed is None else (seed,)
    return plan_points(
        base, points, axes=axes, seeds=seeds, kind="surfaces", seeding="common"
    ), places


def _effort(case: Case, most: int) -> dict[str, Any]:
    """Cells and surfaces of a contact."""
    smaller = _smaller_grid(case, most)
    coarse = case.with_overrides(smaller) if smaller else case
    nx, ny = coarse.grid.cells
    wait = MANY_SURFACES if nx * ny <= FINE_GRID else FEW_SURFACES
    stated = case.contents.solver.surfaces
    return {
        **smaller,
        "solver.surfaces": min(coarse.surface_count(), wait) if stated is None else stated,
    }


def _smaller_grid(case: Case, most: int) -> dict[str, Any]:
    """Cells in place of a chosen grid's, where those are too many and no accuracy was asked for."""
    section, (nx, ny) = case.contents.grid, case.grid.cells
    if section.cells != "auto" or section.accuracy is not None or nx * ny <= most:
        return {}
    smaller = math.sqrt(most / (nx * ny))
    return {"grid.cells": [max(FEWEST_CELLS, 8 * int(count * smaller / 8)) for count in (nx, ny)]}


def _solved(table: pandas.DataFrame, point: int | None) -> dict[str, Any]:
    """What was solved of a contact, or why it was not."""
    nothing = dict.fromkeys(SOLVED)
    if point is None:
        return {**nothing, "reason": "the surfaces draw no oil in here: no steady film"}
    if point not in table.index:
        return {**nothing, "reason": "not computed"}
    row = table.loc[point]
    if row["status"] != DONE:
        return {**nothing, "reason": str(row["reason"])}
    return {key: _plain(row.get(key)) for key in SOLVED} | {
        "surfaces": int(_plain(row["surfaces"])),
        "reason": "",
    }


def _plain(value: Any) -> Any:
    """A table's entry as JSON has it."""
    if value is None or isinstance(value, bool):
        return value
    if hasattr(value, "item"):
        value = value.item()
    return value if isinstance(value, bool | str) else finite_or_none(value)
