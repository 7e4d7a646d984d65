"""Solution of a machine's contacts as a study: stored, resumable and parallel.

Identical contacts (both sides of a load zone) are solved once.
"""

import json
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas

from asperity.case import DEFAULT_SURFACES, DEFAULT_SURFACES_FINE, Case, MachineCase
from asperity.core.arrays import finite_or_none
from asperity.core.documents import Json, JsonObject
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.processes import cores
from asperity.machine import MachineContact
from asperity.machines.result import MachineResult, condition_row
from asperity.results import Run, load_run, solve_case
from asperity.solution import heats_inlet
from asperity.study import DONE, StudyPlan, StudyProgress, StudyResult, plan_points, run_study

ALL_CELLS = 1_000_000  # of all automatic grids together: about two minutes on two processors
FEWEST_CELLS = 48  # along an axis
FINE_CONTACT_GRID = 128 * 128  # cells above which a contact counts as fine: few surfaces
WORST = "worst.nc"
SOLVED_KEYS = (  # quantities of a solved contact
    *(
        *("h_central_m", "h_central_low_m", "h_central_high_m"),
        *("h_min_m", "h_min_low_m", "h_min_high_m"),
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
        "friction_coefficient_low",
        "friction_coefficient_high",
        "friction_power_w",
        "rolling_friction_power_w",
        "flash_temperature_max_k",
        "von_mises_core_pa",
    ),
    *("crf_hz", "crf_low_hz", "crf_high_hz"),
)


def machine_conditions(case: MachineCase) -> MachineResult:
    """Return the conditions of the contacts without solving them."""
    start = time.perf_counter()
    rows = tuple(condition_row(contact, case) for contact in case.contacts)
    return MachineResult(case, rows, False, time.perf_counter() - start)


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
    out : folder to store the contacts in and resume from; None: in memory
    workers, executor, progress : see `run_study`

    Raises
    ------
    BadInput
        for a case without lubricant or surface, without entrainment, or an unusable folder.
    AsperityError
        if results cannot be written.
    """
    start = time.perf_counter()
    if not case.complete:
        raise BadInput(
            f"{case.source}: solving needs [lubricant] and [surface]; add them, or use "
            "`machine_conditions`"
        )
    moving = [contact for contact in case.contacts if not contact.stands_still]
    if not moving:
        raise BadInput(f"{case.source}: no contact entrains oil; correct the speeds")
    plan, points = _plan(case, moving)
    fields = () if out is None else ("run",)
    study = run_study(
        plan, out=out, workers=workers, executor=executor, fields=fields, progress=progress
    )
    table = study.table.set_index("point")
    rows = tuple(
        {**condition_row(contact, case), **_solved_row(table, points.get(contact.name))}
        for contact in case.contacts
    )
    result = MachineResult(case, rows, True, time.perf_counter() - start, study.folder)
    if study.folder is None or result.worst.get("clr") is None:
        return result
    point = next(entry for entry in plan.cases if entry.point == points[result.worst["name"]])
    run = _worst(plan.case.with_written(point.overrides), study, point.id)
    return replace(result, run=run, seconds=time.perf_counter() - start)


def _worst(case: Case, study: StudyResult, case_id: str) -> Run:
    """Return a contact with its fields, saved as the worst one.

    It is solved again if it has several surfaces, whose dynamic stiffness the study leaves out.
    """
    case = case.among_many
    assert study.folder is not None
    path = study.folder / WORST
    if path.exists() and (stored := load_run(path)).case.text == case.text:
        return stored
    run = None
    with suppress(UnreadableFile):  # solved before runs were stored, or damaged
        run = study.run(case_id)
    if run is None or run.others or run.case.text != case.text:
        run = solve_case(case, surfaces=None, workers=cores(), strict=False)
    run.save(path)
    return run


def _plan(
    case: MachineCase, contacts: Sequence[MachineContact]
) -> tuple[StudyPlan, dict[str, int]]:
    """Return a study of the distinct contacts, and the point of each contact."""
    keys = {contact.name: json.dumps(case.contact_table(contact)) for contact in contacts}
    distinct = {keys[contact.name]: contact for contact in reversed(contacts)}
    order = list(dict.fromkeys(keys.values()))
    points = [
        {"contact": json.loads(key), **_effort(case.case(distinct[key]), ALL_CELLS // len(order))}
        for key in order
    ]
    point_numbers = {name: order.index(key) for name, key in keys.items()}
    base = case.case(contacts[0])
    seed = getattr(base.contents.surface, "seed", None)
    axes = list(dict.fromkeys(key for point in points for key in point))
    seeds = 1 if seed is None else (seed,)
    return plan_points(
        base, points, axes=axes, seeds=seeds, kind="surfaces", seeding="common"
    ), point_numbers


def _effort(case: Case, max_cells: int) -> JsonObject:
    """Return overrides for the cells and surfaces of a contact, and its own inlet shear heating."""
    smaller = _smaller_grid(case, max_cells)
    coarse = case.with_written(smaller) if smaller else case
    nx, ny = coarse.grid.cells
    surfaces = DEFAULT_SURFACES if nx * ny <= FINE_CONTACT_GRID else DEFAULT_SURFACES_FINE
    stated = case.contents.solver.surfaces
    if stated is None:
        stated = min(coarse.surface_count(), surfaces)
    effort: JsonObject = {**smaller, "solver.surfaces": stated}
    if case.lubricant is not None and case.thermal.inlet_heating is None:
        # as `solve` decides for this contact; a study decides once, from its base case
        heated = heats_inlet(case.conditions, case.lubricant, case.thermal)
        effort["thermal.inlet_heating"] = heated
    return effort


def _smaller_grid(case: Case, max_cells: int) -> JsonObject:
    """Return an override that coarsens an automatic grid without a requested accuracy."""
    section = case.contents.grid
    (nx, ny) = case.grid.cells
    if section.cells != "auto" or section.accuracy is not None or nx * ny <= max_cells:
        return {}
    ratio = math.sqrt(max_cells / (nx * ny))
    return {"grid.cells": [max(FEWEST_CELLS, 8 * int(count * ratio / 8)) for count in (nx, ny)]}


def _solved_row(table: pandas.DataFrame, point: int | None) -> JsonObject:
    """Return the solved quantities of a contact, or the reason why there are none."""
    empty = dict.fromkeys(SOLVED_KEYS)
    if point is None:
        return {**empty, "reason": "the surfaces entrain no oil: no steady film"}
    if point not in table.index:
        return {**empty, "reason": "not computed"}
    row = table.loc[point].to_dict()
    if row["status"] != DONE:
        return {**empty, "reason": str(row["reason"])}
    values = {key: _json_value(row.get(key)) for key in SOLVED_KEYS}
    return {**values, "surfaces": int(row["surfaces"]), "reason": ""}


def _json_value(value: object) -> Json:
    """Convert a table's entry to JSON."""
    value = value.item() if isinstance(value, np.generic) else value
    if value is None or isinstance(value, bool | str):
        return value
    assert isinstance(value, int | float)
    return finite_or_none(value)
