"""Running contacts: load share and its interval, against longer tracks on grids twice as fine.

Twenty random line contacts in the domain of the paper's: film ratio 0.2 to 1.5, correlation length
20 to 100 Sq, slide-to-roll ratio 0, 0.2, 1 and 2 (the faster body is rough), twelve of them with a
pressure cap of 2 GPa. The reference marches another track, of ten passages, on a grid of twice as
many cells along both axes, with steps half as long.

`--grids` marches the same track on three grids, each with 1.41 times the cells along both axes of
the one before (the middle one is the default), with the models mixed and conserving, and with steps
half as long on the middle one.

`--mixed` takes the first contacts of mixed lubrication (CLR 0.02 to 0.98), and compares the default
solution with that on 1.41 times as many cells along both axes.
"""

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from time import process_time

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.errors import AsperityError
from asperity.ehl import ContactModel
from asperity.results import Run, running_surfaces, solve_case
from asperity.transient import moving_contact, run_track
from benchmarks.chosen_grids import log_film_over
from benchmarks.roughness_levels import paper_case

COUNT = 20
SLIPS = (0.0, 0.2, 1.0, 2.0)
LONG = 10  # passages of the reference
CLOSE = 0.03
PASSAGES, CUT = 6, 2  # of the study of grids
TRIAL_CELLS, MIXED_SHARES = 600, (0.02, 0.98)  # of mixed contacts
CPU_LIMIT = 10.0  # s
MODELS: tuple[ContactModel, ...] = ("mixed", "conserving")
TIME_STEP = 2.0  # cells


def at_film_ratio(case: Case, sq: float, film_ratio: float) -> Case:
    """Return a case at the speed at which the film is `film_ratio` times Sq [m]."""
    arguments = case.conditions, case.lubricant, film_ratio * sq
    speed = scipy.optimize.brentq(log_film_over, 1e-6, 1e4, args=arguments)
    return case.with_overrides({"contact.entrainment_speed": f"{speed} m/s"})


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
        sq = self.length / self.lengths_per_sq
        case = paper_case(1.0, self.seed, 256).with_overrides(
            {
                "contact.roughness": "running",
                "contact.slip": self.slip,
                "surface.sq": f"{sq} m",
                "surface.correlation_length": f"{self.length} m",
                "material.hardness": "2 GPa" if self.capped else "20 GPa",
                "grid.cells": [256, 128],
            }
        )
        return at_film_ratio(case, sq, self.film_ratio)


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


def reference(case: Case, run: Run) -> tuple[float, float]:
    """Return the mean load share of another track on twice as many cells along both axes.

    The second number is the standard error of the mean.
    """
    assert run.running is not None
    assert case.lubricant is not None
    nx, ny = (2 * count for count in run.running.cells)
    surfaces = running_surfaces(case.on_surface(1), LONG).on_cells((min(nx, 256), min(ny, 128)))
    series = run_track(
        case.conditions,
        case.lubricant,
        surfaces,
        lambda snapshot: {"clr": snapshot.state.clr},
        passages=lambda: LONG,
        options=case.options,
    )
    means = series.passages(max(1, run.running.cut))[:, 0]
    return float(means.mean()), float(means.std(ddof=1)) / math.sqrt(series.independent(len(means)))


def rows(count: int) -> Iterator[str]:
    """Yield table rows."""
    yield (
        "| film ratio | l/Sq | slip | cap | snapshot | CLR (90 % interval) | std over time | "
        "reference ± standard error | inside | change | time [s], reference |"
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
                run = solve_case(case, surfaces=None, strict=False)
                between = process_time()
                finer, scatter = reference(case, run)
        except AsperityError as error:
            yield f"| {label} | {error} | | | | | | |"
            continue
        assert run.running is not None
        clr = run.error.clr
        assert clr.low is not None
        assert clr.high is not None
        held = clr.low - scatter <= finer <= clr.high + scatter
        change = abs(finer - run.state.clr)
        inside, close, known = inside + held, close + (change <= CLOSE), known + 1
        standing = "–" if run.snapshot_clr is None else f"{run.snapshot_clr:.3f}"
        yield (
            f"| {label} | {standing} | {run.state.clr:.3f} ({clr.low:.3f} to "
            f"{clr.high:.3f}) | {run.running.clr_std:.3f} | {finer:.3f} ± {scatter:.3f} | "
            f"{'yes' if held else 'no'} | {change:.3f} | {between - began:.1f}, "
            f"{process_time() - between:.1f} |"
        )
    yield ""
    yield (
        f"Reference within the interval, widened by its standard error: {inside} of {known}; "
        f"within {CLOSE} of the load share: {close} of {known}."
    )


def mean_share(case: Case, model: ContactModel, cells: tuple[int, int], time_step: float) -> float:
    """Return the mean load share of the case's track over the last passages."""
    assert case.lubricant is not None
    surfaces = running_surfaces(case, PASSAGES).on_cells(cells)
    crossing = 2.0 * case.conditions.hertz.half_widths[0] / surfaces.grid.spacing[0]
    steps = round(PASSAGES * crossing / time_step)
    contact = moving_contact(
        case.conditions,
        case.lubricant,
        surfaces,
        time_step=time_step,
        options=replace(case.options, model=model, tolerance=1e-2),
    )
    shares = [snapshot.state.clr for snapshot in islice(contact, steps + 1)]
    return float(np.mean(shares[1 + steps * CUT // PASSAGES :]))


def study_of_grids(case: Case, model: ContactModel) -> Iterator[str]:
    """Yield load shares on three grids, extrapolated, and with steps half as long; CPU time [s].

    The extrapolation assumes errors of first order in the cell, as two differences scatter too much
    to find an order.
    """
    began = process_time()
    nx, ny = case.running_cells()
    shapes = [
        (round(nx * factor / 2) * 2, round(ny * factor / 2) * 2)
        for factor in (math.sqrt(0.5), 1.0, math.sqrt(2.0))
    ]
    shares = [mean_share(case, model, cells, TIME_STEP) for cells in shapes]
    limit = shares[2] + (shares[2] - shares[0])
    half_step = mean_share(case, model, shapes[1], 0.5 * TIME_STEP)
    yield from (f"{share:.3f}" for share in (*shares, limit, half_step))
    yield f"{process_time() - began:.0f}"


def grid_rows(first: int, count: int) -> Iterator[str]:
    """Yield a table row per contact from `first` on."""
    yield (
        "| film ratio | l/Sq | slip | cap | "
        + " | ".join(
            f"{model}: coarse | middle | fine | limit | middle, half steps | CPU [s]"
            for model in MODELS
        )
        + " |"
    )
    yield "|---" * (4 + 6 * len(MODELS)) + "|"
    for sample in islice(samples(count), first, None):
        row = [f"{sample.film_ratio:.2f}", f"{sample.lengths_per_sq:.0f}", f"{sample.slip:g}"]
        row.append("2 GPa" if sample.capped else "none")
        with threadpool_limits(1):
            case = sample.case()
            for model in MODELS:
                try:
                    row += study_of_grids(case, model)
                except AsperityError as error:
                    row += [str(error), "", "", "", "", ""]
        yield f"| {' | '.join(row)} |"


def _on_two_grids(case: Case) -> tuple[Run, float, Run] | None:
    """Return a mixed contact on default cells, its CPU time, and on a finer grid."""

    def solved(cells: int | None) -> Run:
        chosen = case if cells is None else case.with_overrides({"solver.running_cells": cells})
        return solve_case(chosen, surfaces=None, strict=False)

    if not MIXED_SHARES[0] < solved(TRIAL_CELLS).state.clr < MIXED_SHARES[1]:
        return None
    began = process_time()
    run = solved(None)
    seconds = process_time() - began
    return run, seconds, solved(2 * math.prod(run.solution.grid.cells))


def mixed_rows(count: int, first: int = 0) -> Iterator[str]:
    """Yield a row per mixed contact: default grid, and 1.41 times the cells along each axis."""
    yield "| film ratio | l/Sq | slip | CLR (90 %) | determined | CPU [s] | finer | change |"
    yield "|---|---|---|---|---|---|---|---|"
    known = 0
    changes: list[float] = []
    for sample in islice(samples(first + 5 * count), first, None):
        if len(changes) == count:
            break
        with threadpool_limits(1):
            pair = _on_two_grids(sample.case())
        if pair is None:
            continue
        run, seconds, finer = pair
        clr = run.error.clr
        assert clr.low is not None
        assert clr.high is not None
        changes.append(finer.state.clr - run.state.clr)
        known += run.determined and seconds <= CPU_LIMIT
        yield (
            f"| {sample.film_ratio:.2f} | {sample.lengths_per_sq:.0f} | {sample.slip:g} | "
            f"{run.state.clr:.3f} ({clr.low:.3f} to {clr.high:.3f}) | "
            f"{'yes' if run.determined else run.undetermined or 'not converged'} | {seconds:.1f} | "
            f"{finer.state.clr:.3f} | {changes[-1]:+.3f} |"
        )
    yield ""
    yield (
        f"Determined within {CPU_LIMIT:g} s: {known} of {count}. Change on the finer grid: mean "
        f"{np.mean(changes):+.3f}, mean absolute {np.mean(np.abs(changes)):.3f}, largest "
        f"{np.abs(changes).max():.3f}."
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--grids", action="store_true")
    parser.add_argument("--mixed", action="store_true")
    chosen = parser.parse_args()
    if chosen.grids:
        table = grid_rows(chosen.first, chosen.count)
    elif chosen.mixed:
        table = mixed_rows(chosen.count, chosen.first)
    else:
        table = rows(chosen.count)
    for line in table:
        print(line, flush=True)
