"""Load share over film ratio and slope: snapshots, running roughness, and published laws.

The contact is the paper's with a pressure cap of 2 GPa and slide-to-roll ratio 0.2; the rough body
moves. The film ratio is set by the speed, the slope by the correlation length over Sq.

`python -m benchmarks.load_share FILE` writes the table as CSV.
"""

import csv
import math
import sys
from collections.abc import Iterator
from itertools import product
from pathlib import Path

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.ehl import film_numbers, least_film
from asperity.results import solve_case
from benchmarks.running import Sample

FILM_RATIOS = (0.25, 0.5, 1.0, 1.5)
LENGTHS_PER_SQ = (20.0, 40.0, 80.0)
LENGTH = 25e-6  # correlation length [m]
CELLS, CONSERVING_CELLS = 3600, 1800  # the second model costs more
COLUMNS = (
    "film_ratio",
    "lengths_per_sq",
    "sdq",
    "snapshot",
    "snapshot_low",
    "snapshot_high",
    "running",
    "running_low",
    "running_high",
    "conserving",
    "conserving_low",
    "conserving_high",
    "masjedi_khonsari",
    "olver_spikes",
)


def masjedi_khonsari(case: Case) -> float:
    """Return the asperities' share of the load of a line contact (statistical roughness).

    Source: Masjedi and Khonsari, J. Tribol. 134 (2012) 011503, the asperity load ratio in percent;
    hardness over modulus 0.01 to 0.03, roughness up to 5e-5 of the radius.
    """
    assert case.lubricant is not None
    conditions = case.conditions
    numbers = film_numbers(conditions, case.lubricant)
    modulus, radius = conditions.pair.effective_modulus, conditions.radius_along_rolling
    assert conditions.hardness is not None
    hardness, roughness = conditions.hardness / modulus, case.surface().sq / radius
    load, speed, material = numbers.load, numbers.speed, numbers.material
    rough = (
        4470.0 * roughness**6.015 * hardness**1.168 * load**0.485 * speed**-3.741 * material**-2.898
    )
    return float(0.01 * 0.005 * load**-0.408 * speed**-0.088 * material**0.103 * math.log1p(rough))


def olver_spikes(film_ratio: float) -> float:
    """Return the weight of boundary friction, 1/(1 + Λ)²: Proc. IMechE J 212 (1998) 321."""
    return 1.0 / (1.0 + film_ratio) ** 2


def contacts() -> Iterator[Sample]:
    """Yield the contacts."""
    for lengths_per_sq, film_ratio in product(LENGTHS_PER_SQ, FILM_RATIOS):
        yield Sample(film_ratio, LENGTH, lengths_per_sq, slip=0.2, capped=True, seed=0)


def shares(sample: Sample) -> dict[str, object]:
    """Return a row of the table."""
    case = sample.case()
    variants: dict[str, dict[str, object]] = {
        "snapshot": {"contact.roughness": "standing"},
        "running": {"solver.running_cells": CELLS},
        "conserving": {"model": "conserving", "solver.running_cells": CONSERVING_CELLS},
    }
    assert case.lubricant is not None
    film_ratio = least_film(case.conditions, case.lubricant) / case.surface().sq
    row: dict[str, object] = {
        "film_ratio": film_ratio,
        "lengths_per_sq": sample.lengths_per_sq,
    }
    for name, overrides in variants.items():
        run = solve_case(case.with_overrides(overrides), surfaces=None, strict=False)
        numbers = run.scalars()  # of snapshots, means over surfaces
        row |= {
            name: numbers["clr"],
            f"{name}_low": numbers["clr_low"],
            f"{name}_high": numbers["clr_high"],
        }
        row.setdefault("sdq", run.own_scalars["rms_slope"])  # of the full grid
    return row | {
        "masjedi_khonsari": masjedi_khonsari(case),
        "olver_spikes": olver_spikes(film_ratio),
    }


def write(path: Path) -> None:
    """Write the table, a row as soon as it is known."""
    with path.open("w", encoding="utf-8", newline="") as file, threadpool_limits(1):
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for sample in contacts():
            row = {
                key: "" if value is None else f"{value:.4g}"
                for key, value in shares(sample).items()
            }
            table.writerow(row)
            file.flush()
            print(row, flush=True)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
