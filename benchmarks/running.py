"""Running contacts: load share and its interval, against the same tracks on grids twice as fine.

Twenty random line contacts in the domain of the paper's: film ratio 0.2 to 1.5, correlation length
20 to 100 Sq, slide-to-roll ratio 0, 0.2, 1 and 2 (the rough body moves), half of them with a
pressure cap of 2 GPa. The reference marches the first track on a grid of twice as many cells along
both axes, with steps half as long.
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.errors import AsperityError
from asperity.ehl import least_film
from asperity.results import Run, solve_case
from asperity.transient import run_track
from benchmarks.roughness_levels import paper_case

COUNT = 20
SLIPS = (0.0, 0.2, 1.0, 2.0)
FILM_OF_SPEED = 0.68  # exponent, to find the speed of a film


@dataclass(frozen=True)
class Sample:
    """A contact of the sample: correlation length [m] and its ratio to Sq."""

    film_ratio: float
    length: float
    lengths_per_sq: float
    slip: float
    capped: bool
    seed: int

    def case(self) -> Case:
        """Return the case, at the speed that gives the film ratio."""
        sq, speed = self.length / self.lengths_per_sq, 1.91
        for _ in range(20):
            case = paper_case(1.0, self.seed, 256).with_overrides(
                {
                    "contact.roughness": "running",
                    "contact.entrainment_speed": f"{speed} m/s",
                    "contact.slip": self.slip,
                    "surface.sq": f"{sq} m",
                    "surface.correlation_length": f"{self.length} m",
                    "material.hardness": "2 GPa" if self.capped else "20 GPa",
                    "grid.cells": [256, 128],
                }
            )
            assert case.lubricant is not None
            factor = self.film_ratio * sq / least_film(case.conditions, case.lubricant)
            if abs(factor - 1.0) < 1e-3:
                break
            speed *= factor ** (1.0 / FILM_OF_SPEED)
        return case


def samples(count: int = COUNT) -> Iterator[Sample]:
    """Yield the random contacts."""
    rng = np.random.default_rng(38)
    for number in range(count):
        yield Sample(
            film_ratio=float(np.exp(rng.uniform(math.log(0.2), math.log(1.5)))),
            length=float(rng.uniform(14e-6, 40e-6)),
            lengths_per_sq=float(rng.uniform(20.0, 100.0)),
            slip=SLIPS[number % 4],
            capped=number % 8 < 4,
            seed=number,
        )


def reference(case: Case, run: Run) -> float:
    """Return the mean load share of the first track on twice as many cells along both axes."""
    assert run.running is not None
    assert case.lubricant is not None
    nx, ny = (2 * count for count in run.running.cells)
    surfaces = case.moving_surfaces().on_cells((min(nx, 256), min(ny, 128)))
    passages = (len(run.running.series) - 1) // run.running.steps_per_passage
    series = run_track(
        case.conditions,
        case.lubricant,
        surfaces,
        lambda snapshot: {"clr": snapshot.state.clr},
        passages=passages,
        options=case.options,
    )
    return float(series.passages(run.running.cut).mean())


def rows(count: int) -> Iterator[str]:
    """Yield table rows; the reference's difference is to the fine grid on the same track."""
    yield (
        "| film ratio | l/Sq | slip | cap | snapshot | CLR (90 % interval) | std over time | fine "
        "grid, first track | twice as fine | within ± | time [s], reference |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    inside, close, known = 0, 0, 0
    for sample in samples(count):
        began = process_time()
        label = f"{sample.film_ratio:.2f} | {sample.lengths_per_sq:.0f} | {sample.slip:g} | "
        label += "2 GPa" if sample.capped else "none"
        try:
            with threadpool_limits(1):
                case = sample.case()
                run = solve_case(case, surfaces=3)
                between = process_time()
                finer = reference(case, run)
        except AsperityError as error:
            yield f"| {label} | {error} | | | | | | |"
            continue
        assert run.running is not None
        error, running = run.error.clr, run.running
        assert error.low is not None
        assert error.high is not None
        settled = np.array(running.series)[1 + running.cut * running.steps_per_passage :]
        track, grid = float(settled.mean()), running.clr.grid
        change = abs(finer - track)
        inside, known = inside + (change <= max(grid, 0.005)), known + 1
        close += change <= 0.03
        yield (
            f"| {label} | {running.snapshot_clr:.3f} | {run.state.clr:.3f} ({error.low:.3f} to "
            f"{error.high:.3f}) | {running.clr_std:.3f} | {track:.3f} | {finer:.3f} | {grid:.3f} | "
            f"{between - began:.1f}, {process_time() - between:.1f} |"
        )
    yield ""
    yield (
        f"Within the interval's grid part: {inside} of {known}; within 0.03: {close} of {known}."
    )


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the lines of this part of the benchmark."""
    yield "## Running contacts against grids twice as fine"
    yield ""
    yield from rows(4 if fast else COUNT)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    for line in rows(parser.parse_args().count):
        print(line, flush=True)
