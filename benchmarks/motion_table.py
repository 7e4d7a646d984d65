"""Load and area shares, load by film, films and resonances over roughness, for three models of one
contact.

The paper's contact with a cap of 0.7 GPa and a correlation length of 40 um: snapshot and moving
contact of the mixed model, moving contact of the conserving model. Means over one passage of the
rough surface after oil has crossed the domain once; mean and standard deviation over seeds. Results
are stored in build/motion_table.csv and reused: `python -m benchmarks.motion_table --cells 64
--seeds 0 1 2`.
"""

import argparse
import csv
import math
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.contact.hertz import point_stiffness
from asperity.core.errors import NotConverged
from asperity.solution import FILMS, clr_below, roller_depth, sharing_by_film, tangent_stiffness
from asperity.solution.stiffness import approach_of
from asperity.transient import Snapshot, moving_contact, step_seconds
from benchmarks.roughness_levels import paper_case

KEPT = Path(__file__).parents[1] / "build" / "motion_table.csv"
SQ_UM = (0.5, 1.0, 2.5, 4.0)
SEEDS = (0, 1, 2)
SNAPSHOT, MIXED, CONSERVING = "mixed snapshot", "mixed moving", "conserving moving"
MODELS = {MIXED: "mixed", CONSERVING: "conserving"}
KINDS: dict[str, type] = {
    "model": str,
    "cells": int,
    "seed": int,
    "steps": int,
    "bad": int,
}  # all other columns are numbers
LOAD_STEP = 0.02
MOMENTS = 2  # times in a passage at which the tangent stiffness is computed


@dataclass(frozen=True)
class Outcome:
    """Means of one surface's passage, SI; `bad` counts steps not converged.

    `tangent_hz` and `shared_hz` are resonances.
    """

    model: str
    cells: int
    sq_um: float
    seed: int
    clr: float
    car: float
    floor: float
    below_20: float
    below_50: float
    below_100: float
    below_200: float
    h_min: float
    h_mean: float
    cavitated: float
    approach_std: float
    tangent_hz: float
    shared_hz: float
    steps: int
    bad: int
    seconds: float


def table_case(sq_um: float, seed: int, cells: int) -> Case:
    """Return the paper's contact with the table's cap and correlation length."""
    case = paper_case(sq_um, seed, cells)
    return case.with_overrides(
        {"material.hardness": "0.7 GPa", "surface.correlation_length": "40 um"}
    )


def outcomes(model: str, sq_um: float, seed: int, cells: int) -> Iterator[Outcome]:
    """Yield the moving contact of a model, preceded by its snapshot for the mixed model."""
    case = table_case(sq_um, seed, cells).with_overrides({"model": MODELS[model]})
    assert case.lubricant is not None
    surfaces = case.moving_surfaces()
    passage = surfaces.passage_time(0) / step_seconds(case.conditions, surfaces, 1.0)
    last = cells + math.ceil(passage)
    began = perf_counter()
    settled: list[Snapshot] = []
    bad = 0
    for snapshot in islice(
        moving_contact(case.conditions, case.lubricant, surfaces, options=case.options), last + 1
    ):
        bad += not snapshot.solution.convergence.converged
        if snapshot.number == 0 and model == MIXED:
            yield _outcome(
                SNAPSHOT, case, sq_um, seed, [snapshot], [snapshot], 0, perf_counter() - began
            )
        if snapshot.number > cells:
            settled.append(snapshot)
    moments = settled[:: len(settled) // MOMENTS][:MOMENTS]
    yield _outcome(model, case, sq_um, seed, settled, moments, bad, perf_counter() - began)


def _outcome(
    model: str,
    case: Case,
    sq_um: float,
    seed: int,
    rows: list[Snapshot],
    moments: list[Snapshot],
    bad: int,
    seconds: float,
) -> Outcome:
    def mean(values: Iterable[float]) -> float:
        return float(np.mean(list(values)))

    conditions, mass = case.conditions, case.vibration.mass if case.vibration else math.nan
    sharing = [sharing_by_film(snapshot.solution) for snapshot in rows]
    clr = mean(snapshot.clr_solid for snapshot in sharing)
    spring = point_stiffness(
        clr * conditions.load, conditions.radius_along_rolling, conditions.pair.reduced_modulus
    )
    below = [mean(clr_below(snapshot.solution, film) for snapshot in rows) for film in FILMS]
    stiffness = [found for snapshot in moments if (found := _tangent(snapshot)) is not None]
    return Outcome(
        model,
        case.grid.cells[0],
        sq_um,
        seed,
        clr,
        mean(shares.car_solid for shares in sharing),
        mean(shares.clr_floor for shares in sharing),
        below[0],
        below[1],
        below[2],
        below[3],
        h_min=mean(snapshot.state.h_min for snapshot in rows),
        h_mean=mean(snapshot.state.h_mean for snapshot in rows),
        cavitated=mean(shares.cavitated for shares in sharing),
        approach_std=float(np.std([snapshot.solution.rigid_approach for snapshot in rows])),
        tangent_hz=math.sqrt(mean(stiffness) / mass) / (2.0 * math.pi) if stiffness else math.nan,
        shared_hz=math.sqrt(spring / mass) / (2.0 * math.pi) if clr > 0.0 else math.nan,
        steps=len(rows),
        bad=bad,
        seconds=seconds,
    )


def _tangent(snapshot: Snapshot) -> float | None:
    try:
        return tangent_stiffness(snapshot.solution).total
    except NotConverged:
        return None


def tangent_in_motion(
    sq_um: float, seed: int, cells: int, model: str = MIXED
) -> tuple[float, float]:
    """Return the resonance [Hz] from the tangent stiffness in motion, and from the snapshot's
    stiffness.

    The latter is the mean at MOMENTS times. In motion: the same passage with 2 % less and 2 % more
    load; difference of loads over difference of mean approaches.
    """
    case = table_case(sq_um, seed, cells).with_overrides({"model": MODELS[model]})
    assert case.lubricant is not None
    conditions, mass = case.conditions, case.vibration.mass if case.vibration else math.nan
    surfaces, depth = case.moving_surfaces(), roller_depth(conditions)
    last = cells + math.ceil(surfaces.passage_time(0) / step_seconds(conditions, surfaces, 1.0))
    approaches = []
    for load in ((1.0 - LOAD_STEP) * conditions.load, (1.0 + LOAD_STEP) * conditions.load):
        pressed = replace(conditions, load=load)
        taken = islice(
            moving_contact(pressed, case.lubricant, surfaces, options=case.options), last + 1
        )
        approaches.append(
            float(
                np.mean(
                    [
                        approach_of(snapshot.solution, depth)
                        for snapshot in taken
                        if snapshot.number > cells
                    ]
                )
            )
        )
    stiffness = 2.0 * LOAD_STEP * conditions.load / (approaches[1] - approaches[0])
    compute(cells, [seed], [model], [sq_um])
    return (
        math.sqrt(stiffness / mass) / (2.0 * math.pi),
        kept()[model, cells, sq_um, seed].tangent_hz,
    )


def kept() -> dict[tuple[str, int, float, int], Outcome]:
    """Return stored results by model, cells, Sq and seed."""
    if not KEPT.exists():
        return {}
    with KEPT.open(newline="") as file:
        rows = list(csv.DictReader(file))
    found = []
    for row in rows:
        values: dict[str, Any] = {
            field.name: KINDS.get(field.name, float)(row[field.name]) for field in fields(Outcome)
        }
        found.append(Outcome(**values))
    return {
        (outcome.model, outcome.cells, outcome.sq_um, outcome.seed): outcome for outcome in found
    }


def compute(
    cells: int, seeds: Iterable[int], models: Iterable[str], sq_um: Iterable[float] = SQ_UM
) -> None:
    """Compute what is not stored yet; store each result at once."""
    models, sq_um = list(models), list(sq_um)
    for seed in seeds:
        for sq in sq_um:
            for model in models:
                if (model, cells, sq, seed) in kept():
                    continue
                for outcome in outcomes(model, sq, seed, cells):
                    KEPT.parent.mkdir(exist_ok=True)
                    new = not KEPT.exists()
                    with KEPT.open("a", newline="") as file:
                        writer = csv.DictWriter(file, [field.name for field in fields(Outcome)])
                        if new:
                            writer.writeheader()
                        writer.writerow(asdict(outcome))


COLUMNS = (  # heading, field, scale, digits
    ("CLR_s", "clr", 1.0, 3),
    ("CAR_s", "car", 1.0, 3),
    ("L(floor)", "floor", 1.0, 3),
    ("L(20 nm)", "below_20", 1.0, 3),
    ("L(50 nm)", "below_50", 1.0, 3),
    ("L(100 nm)", "below_100", 1.0, 3),
    ("L(200 nm)", "below_200", 1.0, 3),
    ("h_min [nm]", "h_min", 1e9, 1),
    ("h_mean [um]", "h_mean", 1e6, 2),
    ("cavitated", "cavitated", 1.0, 3),
    ("CRF from share [Hz]", "shared_hz", 1.0, 0),
    ("CRF from tangent [Hz]", "tangent_hz", 1.0, 0),
)


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the table as Markdown; `fast` uses one seed at 64 cells."""
    KEPT.unlink(missing_ok=True)  # measure again
    compute(64, SEEDS[:1] if fast else SEEDS, MODELS)
    yield "## One contact, three models"
    yield ""
    yield from table()


def table() -> Iterator[str]:
    """Yield the stored results; values in brackets: the same surfaces on the coarsest grid."""
    found = kept()
    yield (
        f"| Sq [um] | model | cells | surfaces | {' | '.join(name for name, *_ in COLUMNS)} | not"
        " converged |"
    )
    yield "|" + "---|" * (len(COLUMNS) + 5)
    coarsest = min((outcome.cells for outcome in found.values()), default=0)
    for sq in SQ_UM:
        for model in (SNAPSHOT, *MODELS):
            for cells in sorted({outcome.cells for outcome in found.values()}):
                rows = [
                    outcome
                    for outcome in found.values()
                    if (outcome.model, outcome.cells, outcome.sq_um) == (model, cells, sq)
                ]
                if not rows:
                    continue
                same = (
                    [found[model, coarsest, sq, outcome.seed] for outcome in rows]
                    if cells > coarsest
                    else []
                )
                shown = " | ".join(
                    _shown(rows, same, name, scale, digits) for _, name, scale, digits in COLUMNS
                )
                steps = sum(outcome.steps + cells for outcome in rows)
                bad = f"{sum(outcome.bad for outcome in rows)} of {steps}"
                yield (
                    f"| {sq:g} | {model} | {cells} | {len(rows)} | {shown} |"
                    f" {'-' if model == SNAPSHOT else bad} |"
                )


def _shown(rows: list[Outcome], same: list[Outcome], name: str, scale: float, digits: int) -> str:
    values, coarse = (
        np.array([getattr(outcome, name) for outcome in some]) * scale for some in (rows, same)
    )
    values, coarse = values[np.isfinite(values)], coarse[np.isfinite(coarse)]
    if values.size == 0:
        return "-"
    spread = f" ± {np.std(values, ddof=1):.{digits}f}" if values.size > 1 else ""
    few = f", of {values.size}" if values.size < len(rows) else ""
    bracket = f" ({np.mean(coarse):.{digits}f})" if coarse.size else ""
    return f"{np.mean(values):.{digits}f}{spread}{few}{bracket}"


def main() -> None:
    """Compute a part of the table and print all stored results."""
    arguments = argparse.ArgumentParser(
        prog="python -m benchmarks.motion_table", description=__doc__
    )
    arguments.add_argument("--cells", type=int, default=64)
    arguments.add_argument("--seeds", type=int, nargs="*", default=SEEDS)
    arguments.add_argument("--sq", type=float, nargs="*", default=SQ_UM)
    arguments.add_argument("--models", nargs="*", choices=list(MODELS), default=list(MODELS))
    parsed = arguments.parse_args()
    with threadpool_limits(1):
        compute(parsed.cells, parsed.seeds, parsed.models, parsed.sq)
    print("\n".join(table()))


if __name__ == "__main__":
    main()
