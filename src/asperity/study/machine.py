"""A machine's contacts solved: each a case of a study, kept as it ends, resumed, and spread over processes.

Contacts that are the same (both sides of a load zone) are solved once.
"""

import json
import math
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas

from asperity.arrays import finite_or_none
from asperity.case import Case, MachineCase
from asperity.errors import BadInput
from asperity.machine import MachineContact
from asperity.quantities import quantity
from asperity.results import BOUNDARY_FROM, FULL_FILM_BELOW
from asperity.study.evaluate import DONE
from asperity.study.execute import StudyProgress, run_study
from asperity.study.plan import StudyPlan, plan_points

ALL_CELLS = 1_000_000  # of chosen grids together: about two minutes on two processors
FEWEST_CELLS = 48  # along an axis
SOLVED = (  # what is read off every solved contact
    *("h_central_m", "h_min_m", "lambda_ratio", "clr", "car", "determined", "p_max_pa"),
    *("friction_coefficient", "friction_power_w", "flash_temperature_max_k", "von_mises_core_pa", "crf_hz"),
)


@dataclass(frozen=True)
class MachineResult:
    """A machine's contacts, a row each; `folder` keeps them. Solved numbers are absent where none was solved."""

    case: MachineCase
    rows: tuple[dict[str, Any], ...]
    solved: bool
    seconds: float
    folder: Path | None = None

    @property
    def failures(self) -> list[dict[str, Any]]:
        """The contacts that were not solved, each with its `reason`."""
        return [row for row in self.rows if row.get("reason")]

    @property
    def worst(self) -> dict[str, Any]:
        """The contact to look at first.

        Of solved ones that whose asperities carry most; in full film the one with the least film ratio, of smooth ones
        the least film; not solved, that of the largest Hertz pressure.
        """

        def badness(row: Mapping[str, Any]) -> tuple[float, ...]:
            if row.get("clr") is None:
                return -1.0, 0.0, row["p_hertz_pa"]
            share = row["clr"] if row["clr"] >= FULL_FILM_BELOW else 0.0
            film = row["h_min_m"] if row["lambda_ratio"] is None else row["lambda_ratio"]
            return share, -film, row["p_hertz_pa"]

        return max(self.rows, key=badness)

    def scalars(self) -> dict[str, Any]:
        """What `machine --json` prints."""
        return {
            "verdict": self.verdict(),
            "contacts": list(self.rows),
            "frequencies": self.case.machine.frequencies,
            "worst": self.worst["name"],
            "notes": list(self.case.notes),
            "seconds": self.seconds,
        }

    def verdict(self) -> str:
        """What a tribologist would conclude, in a sentence."""
        worst, title = self.worst, self.case.machine.title()
        if not self.solved:
            sliding = ""
            if worst["slide_to_roll"]:
                sliding = f", slide-to-roll ratio {quantity('slide_to_roll').text(worst['slide_to_roll'])}"
            pressure = quantity("hertz_pressure_pa").text(worst["p_hertz_pa"])
            return f"{title}: most heavily pressed is {worst['name']}, Hertz pressure {pressure}{sliding}; not solved."
        if worst.get("clr") is None:
            return f"{title}: NOT SOLVED, {len(self.failures)} of {len(self.rows)} contacts failed."
        regimes = [_regime(row) for row in self.rows if row.get("clr") is not None]
        part = "" if len(set(regimes)) == 1 else f" at {regimes.count(_regime(worst))} of {len(self.rows)} contacts"
        failed = f"; {len(self.failures)} of {len(self.rows)} contacts were NOT SOLVED" if self.failures else ""
        doubt = "" if worst["determined"] else " (not determined on this grid)"
        film = "" if worst["lambda_ratio"] is None else f", {quantity('lambda_ratio').named(worst['lambda_ratio'])}"
        heat = quantity("flash_temperature_max_k")
        flash = f", {heat.name} {heat.text(worst['flash_temperature_max_k'])}" if worst["slide_to_roll"] else ""
        return (
            f"{title}: {_regime(worst)}{part}; worst is {worst['name']}, where asperities carry "
            f"{quantity('clr').text(worst['clr'])} of the load{doubt} on a film of "
            f"{quantity('h_central_m').text(worst['h_central_m'])}{film}{flash}{failed}."
        )


def machine_conditions(case: MachineCase) -> MachineResult:
    """The contacts' conditions alone; nothing is solved."""
    begun = time.perf_counter()
    rows = tuple(_conditions(contact, case) for contact in case.contacts)
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
        raise BadInput(f"{case.source}: solving needs [lubricant] and [surface]; add them, or ask for a dry run")
    drawn = [contact for contact in case.contacts if not contact.stands_still]
    if not drawn:
        raise BadInput(f"{case.source}: no contact draws oil in; correct the speeds")
    plan, places = _plan(case, drawn)
    found = run_study(plan, out=out, workers=workers, executor=executor, progress=progress)
    table = found.table.set_index("point")
    rows = tuple(
        {**_conditions(contact, case), **_solved(table, places.get(contact.name))} for contact in case.contacts
    )
    return MachineResult(case, rows, True, time.perf_counter() - begun, found.folder)


def _plan(case: MachineCase, contacts: Sequence[MachineContact]) -> tuple[StudyPlan, dict[str, int]]:
    """A study of the contacts that differ, and which of its points each contact is."""
    keys = {contact.name: json.dumps(case.contact_table(contact)) for contact in contacts}
    different = {keys[contact.name]: contact for contact in reversed(contacts)}
    order = list(dict.fromkeys(keys.values()))
    points = [
        {"contact": json.loads(key), **_smaller_grid(case.case(different[key]), ALL_CELLS // len(order))}
        for key in order
    ]
    places = {name: order.index(key) for name, key in keys.items()}
    base = case.case(contacts[0])
    seed = getattr(base.contents.surface, "seed", None)
    axes = list(dict.fromkeys(key for point in points for key in point))
    seeds = 1 if seed is None else (seed,)
    return plan_points(base, points, axes=axes, seeds=seeds, seeding="common"), places


def _smaller_grid(case: Case, most: int) -> dict[str, Any]:
    """Cells in place of a chosen grid's, where those are too many and no accuracy was asked for."""
    section, (nx, ny) = case.contents.grid, case.grid.cells
    if section.cells != "auto" or section.accuracy is not None or nx * ny <= most:
        return {}
    smaller = math.sqrt(most / (nx * ny))
    return {"grid.cells": [max(FEWEST_CELLS, 8 * int(count * smaller / 8)) for count in (nx, ny)]}


def _conditions(contact: MachineContact, case: MachineCase) -> dict[str, Any]:
    """A contact's row, as far as it is known before it is solved."""
    speeds = contact.surface_speeds
    return {
        "name": contact.name,
        "bodies": list(contact.bodies),
        "position": contact.position,
        "load_n": contact.load,
        "line_load_n_m": contact.line_load,
        "radius_m": list(contact.radius) if isinstance(contact.radius, tuple) else contact.radius,
        "length_m": contact.length,
        "u1_m_s": speeds[0],
        "u2_m_s": speeds[1],
        "entrainment_m_s": contact.entrainment_speed,
        "slide_to_roll": contact.slide_to_roll,
        "p_hertz_pa": contact.hertz(case.pair).p_max,
        "overrolling_hz": list(contact.overrolling_hz),
    }


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
    return {key: _plain(row.get(key)) for key in SOLVED} | {"reason": ""}


def _plain(value: Any) -> Any:
    """A table's entry as JSON has it."""
    if value is None or isinstance(value, bool):
        return value
    if hasattr(value, "item"):
        value = value.item()
    return value if isinstance(value, bool | str) else finite_or_none(value)


def _regime(row: Mapping[str, Any]) -> str:
    if row["clr"] < FULL_FILM_BELOW:
        return "full film"
    return "boundary lubrication" if row["clr"] >= BOUNDARY_FROM else "mixed lubrication"
