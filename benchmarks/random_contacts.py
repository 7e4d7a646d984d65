"""Robustness: six hundred random running contacts, their refusals, convergence and time.

Line, ball and ellipse on automatic grids; Hertz pressure 0.3 to 2.5 GPa, radius 2 to 50 mm, film
ratio 0.1 to 3 (set by the speed), correlation length 1/30 to 1/2 of the half-width and 12 to 120
Sq, pressure cap 2 to 8 GPa or none, slide-to-roll ratio 0 to 2, the roughness on the first, the
second or both bodies. They are solved on the default cells of `solve` unless `--cells` states
other ones.

`python -m benchmarks.random_contacts` prints a row for each contact, and a summary.
"""

import argparse
import math
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from time import process_time

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import Case, case_template, load_case
from asperity.core.errors import AsperityError, BadInput, NotConverged
from asperity.results import solve_case
from benchmarks.running import at_film_ratio

COUNT = 600
KINDS = ("line", "point", "elliptic")
SOLVED, REFUSED, UNSOLVED, FAILED = "solved", "refused", "not converged", "internal error"
REFERENCE_LOAD = 100.0  # N, to find the load of a Hertz pressure


@dataclass(frozen=True)
class Outcome:
    """Result of a contact: kind, CPU time [s], load share if solved, and a remark."""

    kind: str
    seconds: float
    clr: float | None = None
    remark: str = ""


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def contact(number: int) -> Case:
    """Return a contact, with the load and the speed of its Hertz pressure and film ratio."""
    rng = np.random.default_rng([38, number])
    between = partial(_between, rng)
    geometry, radius = KINDS[number % 3], between(2e-3, 50e-3)
    cap = [None, between(2e9, 8e9)][int(rng.random() < 0.75)]
    keys: dict[str, object] = {
        "contact.geometry": geometry,
        "contact.radius": f"{radius} m",
        "contact.load": f"{REFERENCE_LOAD} N",
        "contact.slip": [0.0, 1.0, float(rng.uniform(0.0, 2.0))][number // 3 % 3],
        "material.hardness": "none" if cap is None else f"{cap} Pa",
        "lubricant.viscosity.eta0": f"{between(3e-3, 0.3)} Pa s",
        "lubricant.viscosity.alpha": f"{rng.uniform(10.0, 25.0)} 1/GPa",
        "surface.seed": number,
        "motion.rough": ("first", "second", "both")[number // 9 % 3],
    }
    if geometry == "elliptic":
        keys["contact.radius"] = [f"{radius} m", f"{radius * between(1.5, 20.0)} m"]
    text = case_template("line").partition("[vibration]")[0]
    if keys["contact.geometry"] != "line":
        text = text.replace('length = "10 mm"', "# length").replace('"line"', '"point"')
    case = load_case(text).with_overrides(keys)
    power = 2.0 if geometry == "line" else 3.0
    load = REFERENCE_LOAD * (between(0.3e9, 2.5e9) / case.conditions.hertz.p_max) ** power
    case = case.with_overrides({"contact.load": f"{load} N"})
    length = case.conditions.hertz.half_widths[0] / between(2.0, 30.0)
    sq = length / between(12.0, 120.0)
    case = case.with_overrides(
        {
            "surface.sq": f"{sq} m",
            "surface.correlation_length": [f"{length} m", f"{length * between(1.0, 4.0)} m"],
        }
    )
    return at_film_ratio(case, sq, between(0.1, 3.0))


def outcome(number: int, cells: int | None) -> Outcome:
    """Solve a contact."""
    began = process_time()
    try:
        case = contact(number)
        if cells is not None:
            case = case.with_overrides({"solver.running_cells": cells})
        run = solve_case(case, surfaces=None, strict=True)
    except NotConverged as error:
        return Outcome(UNSOLVED, process_time() - began, remark=str(error))
    except BadInput as error:
        return Outcome(REFUSED, process_time() - began, remark=str(error))
    except AsperityError as error:
        return Outcome(FAILED, process_time() - began, remark=f"{type(error).__name__}: {error}")
    except Exception:  # noqa: BLE001 - counted, whatever it is
        last = traceback.format_exc().strip().splitlines()[-1]
        return Outcome(FAILED, process_time() - began, remark=last)
    return Outcome(SOLVED, process_time() - began, run.state.clr, run.undetermined or "")


def rows(count: int, first: int = 0, cells: int | None = None) -> Iterator[str]:
    """Yield a row for each contact, then the summary."""
    outcomes = []
    yield "| contact | outcome | CPU [s] | CLR | remark |"
    yield "|---|---|---|---|---|"
    for number in range(first, first + count):
        with threadpool_limits(1):
            result = outcome(number, cells)
        outcomes.append(result)
        clr = "" if result.clr is None else f"{result.clr:.3f}"
        yield f"| {number} | {result.kind} | {result.seconds:.1f} | {clr} | {result.remark} |"
    yield ""
    seconds = np.array([result.seconds for result in outcomes])
    counts = {
        kind: sum(result.kind == kind for result in outcomes)
        for kind in (SOLVED, REFUSED, UNSOLVED, FAILED)
    }
    counts["solved but CLR not determined"] = sum(
        result.kind == SOLVED and bool(result.remark) for result in outcomes
    )
    listed = ", ".join(f"{number} {kind}" for kind, number in counts.items())
    quantiles = np.quantile(seconds, (0.5, 0.9, 0.99))
    yield (
        f"Of {count} contacts: {listed}. CPU time: median {quantiles[0]:.1f} s, 90 % within "
        f"{quantiles[1]:.1f} s, 99 % within {quantiles[2]:.1f} s, longest {seconds.max():.1f} s."
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cells", type=int)
    chosen = parser.parse_args()
    for line in rows(chosen.count, chosen.first, chosen.cells):
        print(line, flush=True)
