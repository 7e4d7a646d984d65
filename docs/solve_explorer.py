"""Solve the contacts of the static explorer: `python docs/solve_explorer.py [--workers N]`.

Writes `docs/explorer/contacts.json` (conditions, version, numbers) and `contacts.png` (maps). The
paper's contact is solved in a snapshot, with its roughness held still, at every combination of
speed, roughness and load. All contacts share one surface, scaled to its Sq.
"""

import argparse
import json
import math
import os
import re
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image
from threadpoolctl import threadpool_limits

from asperity.case import Case, load_case
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.ehl import ContactSolution
from asperity.paper import papers_text
from asperity.results import Run, solve_case
from asperity.surface import Surface, gaussian_surface

FOLDER = Path(__file__).parent / "explorer"
NUMBERS, MAPS = FOLDER / "contacts.json", FOLDER / "contacts.png"

SPEEDS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)  # entrainment speed [m/s]
ROUGHNESSES = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)  # Sq [um]
LOADS = (125.0, 250.0, 500.0, 1000.0, 2000.0)  # [N]
KEYS = (
    "clr",
    "clr_low",
    "clr_high",
    "car",
    "car_error",
    "lambda_ratio",
    "crf_hz",
    "crf_low_hz",
    "crf_high_hz",
    "h_mean_m",
    "h_min_m",
    "p_max_pa",
    "friction_coefficient",
    "friction_coefficient_low",
    "friction_coefficient_high",
    "converged",
    "determined",
)
DIGITS = 5  # significant digits of a stored number

CELL = 3e-6  # side of a square cell [m]: from 4 um on, CLR of many contacts is not determined
LENGTH = 20e-6  # correlation length [m]
ACROSS = 80  # cells across rolling, periodic
UPSTREAM, DOWNSTREAM = 300, 110  # cells of the surface on either side of the contact's centre
SEED = 6  # of seeds 1 to 12 the one whose Sq in the Hertz zones is closest to the whole surface's
WINDOW = (-138e-6, 120e-6, -72e-6, 72e-6)  # extent of the stored maps: x, then y [m]

# Levels of a map: film thickness on a logarithmic, pressure on a linear scale. Level 0 is a cell in
# contact in the film's map, and a cavitated cell in the pressure's.
LEVELS = 64
FILM_ENDS = (5e-9, 20e-6)  # [m]
PRESSURE_END = 2e9  # [Pa]: the pressure cap


class Point(NamedTuple):
    """Operating point: entrainment speed [m/s], Sq [um], load [N]."""

    speed: float
    sq: float
    load: float


@dataclass(frozen=True)
class Contact:
    """Numbers of a solved contact by catalogue key, its verdict, and its maps of levels."""

    numbers: Mapping[str, Any]
    film: npt.NDArray[np.uint8]
    pressure: npt.NDArray[np.uint8]


def points() -> list[Point]:
    """Return the operating points in the order in which they are stored."""
    return [Point(*values) for values in product(SPEEDS, ROUGHNESSES, LOADS)]


@cache
def master_surface() -> Field:
    """Return the heights of the common surface of unit Sq, around the contact's centre."""
    grid = Grid(
        (UPSTREAM + DOWNSTREAM, ACROSS),
        lower=(-UPSTREAM * CELL, -ACROSS / 2 * CELL),
        upper=(DOWNSTREAM * CELL, ACROSS / 2 * CELL),
    )
    rng = np.random.default_rng(SEED)
    return gaussian_surface(grid, sq=1.0, correlation_length=LENGTH, rng=rng).heights


def case_of(point: Point) -> Case:
    """Return the paper's case at an operating point, with a flooded inlet on square cells."""
    written: dict[str, object] = {
        "contact.load": f"{point.load} N",
        "contact.entrainment_speed": f"{point.speed} m/s",
        "contact.roughness": "standing",
        "surface.sq": f"{point.sq} um",
        "grid.cells": "auto",
        "thermal.inlet_heating": True,
    }
    chosen = _without_limits().with_written(written)
    a = chosen.conditions.hertz.half_widths[0]
    upstream = math.ceil(-chosen.grid.lower[0] / CELL)
    downstream = math.ceil(max(chosen.grid.upper[0], WINDOW[1]) / CELL)
    side = ACROSS / 2 * CELL / a
    return chosen.with_written(
        {
            "grid.cells": [upstream + downstream, ACROSS],
            "grid.x": [-upstream * CELL / a, downstream * CELL / a],
            "grid.y": [-side, side],
        }
    )


@cache
def _without_limits() -> Case:
    """Return the paper's case without the ends of its domain, which are then chosen."""
    return load_case(re.sub(r"(?m)^[xy] = \[.*$", "", papers_text()))


def solve(point: Point) -> Contact:
    """Solve the contact at an operating point."""
    case = case_of(point)
    with threadpool_limits(1):
        run = solve_case(case, surface=surface_of(case, point.sq), strict=False)
    return Contact(numbers_of(run), *maps_of(run.solution))


def surface_of(case: Case, sq: float) -> Surface:
    """Return the common surface on the grid of a case, scaled to Sq [um]."""
    start = UPSTREAM + round(case.grid.lower[0] / CELL)
    heights = 1e-6 * sq * master_surface()[start : start + case.grid.cells[0]]
    return Surface(heights, case.grid)


def numbers_of(run: Run) -> dict[str, Any]:
    """Return the stored numbers of a run and its verdict."""
    values = run.quantities(map(quantity, KEYS))
    numbers = {key: _rounded(value) for key, value in values.items()}
    return numbers | {"verdict": run.verdict()}


def _rounded(value: Any) -> Any:
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value


def maps_of(solution: ContactSolution) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8]]:
    """Return film and pressure in the window as levels, with image rows from the top down."""
    (x0, y0), (x1, x2, y1, y2) = solution.grid.lower, WINDOW
    rows = slice(round((x1 - x0) / CELL), round((x2 - x0) / CELL))
    columns = slice(round((y1 - y0) / CELL), round((y2 - y0) / CELL))
    thinnest, thickest = map(math.log, FILM_ENDS)
    films = (np.log(solution.gap) - thinnest) / (thickest - thinnest)
    film = _levels(films, ~solution.in_contact)
    pressure = _levels(solution.pressure / PRESSURE_END, ~solution.cavitated)
    return film[rows, columns].T[::-1], pressure[rows, columns].T[::-1]


def _levels(shares: Field, valid: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Return shares of a scale as levels from 1, and 0 where they are not valid."""
    top = LEVELS - 1
    levels = np.clip(1.0 + np.rint(shares * (top - 1)), 1, top)
    return np.where(valid, levels, 0).astype(np.uint8)


def description() -> dict[str, Any]:
    """Return the conditions, axes and scales of the stored contacts."""
    return {
        "version": version("asperity"),
        "case": case_of(Point(2.0, 1.0, 500.0)).text,
        "axes": {"speed": SPEEDS, "sq": ROUGHNESSES, "load": LOADS},
        "cell_m": CELL,
        "correlation_length_m": LENGTH,
        "seed": SEED,
        "window_m": WINDOW,
        "levels": LEVELS,
        "film_ends_m": FILM_ENDS,
        "pressure_end_pa": PRESSURE_END,
        "half_widths_m": [
            case_of(Point(2.0, 1.0, load)).conditions.hertz.half_widths[0] for load in LOADS
        ],
    }


def _timed(point: Point) -> tuple[Contact, float]:
    start = time.process_time()
    return solve(point), time.process_time() - start


def solved(workers: int) -> Iterator[tuple[Contact, float]]:
    """Yield each contact and its processor time [s]."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    with ProcessPoolExecutor(workers) as pool:
        for number, outcome in enumerate(pool.map(_timed, points()), 1):
            print(number, points()[number - 1], f"{outcome[1]:.2f} s", flush=True)  # noqa: T201
            yield outcome


def main() -> None:
    """Solve all contacts and write their numbers and maps."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=1)
    outcomes = list(solved(parser.parse_args().workers))
    contacts = [contact for contact, _ in outcomes]
    tiles = [np.concatenate([contact.film, contact.pressure]) for contact in contacts]
    per_row = len(ROUGHNESSES) * len(LOADS)
    sheet = np.concatenate(
        [np.concatenate(tiles[k : k + per_row], axis=1) for k in range(0, len(tiles), per_row)]
    )
    FOLDER.mkdir(exist_ok=True)
    Image.fromarray(sheet).save(MAPS, optimize=True)
    contents = description() | {"processor_s": round(sum(seconds for _, seconds in outcomes))}
    head = json.dumps(contents, indent=1, ensure_ascii=False)[:-2]
    rows = ",\n".join(json.dumps(contact.numbers, ensure_ascii=False) for contact in contacts)
    NUMBERS.write_text(f'{head},\n "contacts": [\n{rows}\n]}}\n', "utf-8")


if __name__ == "__main__":
    main()
