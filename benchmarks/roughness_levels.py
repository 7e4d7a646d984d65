"""Convergence, time and results of the paper's contact at nine roughness levels, five surfaces.

Every solve is a cold start including the elastic kernel, on one thread; times are CPU times
with cached compiled kernels. Solves with tolerance 1e-6 give the error of the default (1e-4).
"""

import statistics
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from asperity.case import Case, load_case
from asperity.ehl import ContactSolution, Options, solve_contact
from asperity.ehl.deflection import deflection
from asperity.solution import contact_state

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
SQ_UM = (0.5, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0)
SEEDS = range(5)


@dataclass(frozen=True)
class Outcome:
    """One contact, solved to the default tolerance and, if requested, to a hundredth of it."""

    sq_um: float
    seed: int
    converged: bool
    seconds: float
    steps: int
    car: float
    car_domain: float
    clr: float
    capped_oil: float
    imbalance: float
    tight_converged: bool | None = None
    clr_error: float | None = None


def paper_case(sq_um: float, seed: int, cells: int) -> Case:
    """Return the paper's contact with one of the surfaces."""
    return load_case(CASE).with_overrides(
        {"surface.sq": f"{sq_um} um", "surface.seed": seed, "grid.cells": [cells, cells]}
    )


def solve(sq_um: float, seed: int, tolerance: float, cells: int) -> ContactSolution:
    """Solve from a cold start."""
    case = paper_case(sq_um, seed, cells)
    deflection.cache_clear()
    return solve_contact(
        case.conditions,
        case.lubricant,
        case.surface(),
        options=Options(tolerance=tolerance),
        strict=False,
    )


def outcomes(
    *, tight: bool, cells: int = 256, progress: Callable[[Outcome], None] = lambda _: None
) -> list[Outcome]:
    """Solve all levels and surfaces."""
    solve(SQ_UM[0], 0, 1e-2, 64)  # loads the compiled kernels
    results = []
    for sq_um in SQ_UM:
        for seed in SEEDS:
            began = process_time()
            solution = solve(sq_um, seed, 1e-4, cells)
            seconds = process_time() - began
            state = contact_state(solution)
            checked = solve(sq_um, seed, 1e-6, cells) if tight else None
            outcome = Outcome(
                sq_um,
                seed,
                solution.convergence.converged,
                seconds,
                solution.convergence.iterations,
                state.car,
                state.car_domain,
                state.clr,
                state.capped_oil_load_ratio,
                state.mass_flux_imbalance,
                checked.convergence.converged if checked else None,
                abs(contact_state(checked).clr - state.clr) if checked else None,
            )
            progress(outcome)
            results.append(outcome)
    return results


def fft_pair_seconds(cells: int = 512) -> float:
    """Return the median time of a real FFT and its inverse of cells x cells, as a reference."""
    import scipy.fft as fft

    field = np.random.default_rng(0).standard_normal((cells, cells))
    times = []
    for _ in range(40):
        began = process_time()
        fft.irfft2(fft.rfft2(field))
        times.append(process_time() - began)
    return statistics.median(times)


def table(results: list[Outcome]) -> list[str]:
    """Return a Markdown table, one row for each roughness level: mean ± standard deviation."""
    rows = [
        (
            "| Sq [um] | CAR [%] | CAR domain [%] | CLR [%] | load on capped oil [%] | oil"
            " imbalance [%] | converged | iterations | seconds | CLR error |"
        ),
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for sq_um in SQ_UM:
        level = [outcome for outcome in results if outcome.sq_um == sq_um]

        def spread(name: str, level: list[Outcome] = level) -> str:
            values = [100.0 * getattr(outcome, name) for outcome in level]
            return f"{statistics.mean(values):.1f} ± {statistics.stdev(values):.1f}"

        errors = [outcome.clr_error for outcome in level if outcome.clr_error is not None]
        worst = max(errors, default=None)
        tight_count = sum(bool(outcome.tight_converged) for outcome in level)
        tight = "" if worst is None else f" ({tight_count} tight)"
        rows.append(
            f"| {sq_um} | {spread('car')} | {spread('car_domain')} | {spread('clr')} |"
            f" {spread('capped_oil')} | {spread('imbalance')} |"
            f" {sum(outcome.converged for outcome in level)} of {len(level)}{tight} |"
            f" {statistics.median(outcome.steps for outcome in level):.0f} |"
            f" {statistics.median(outcome.seconds for outcome in level):.2f} |"
            f" {'-' if worst is None else f'{worst:.1e}'} |"
        )
    return rows


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the table as Markdown and the cost of a solve in FFTs."""

    def progress(outcome: Outcome) -> None:
        print(
            f"  Sq {outcome.sq_um} um, seed {outcome.seed}: {outcome.seconds:.2f} s,"
            f" CLR {outcome.clr:.4f}",
            file=sys.stderr,
        )

    yield "## Roughness levels of the paper's contact, 256 x 256\n"
    before = fft_pair_seconds()
    results = outcomes(tight=not fast, progress=progress)
    pair = statistics.mean([before, fft_pair_seconds()])
    yield from table(results)
    seconds = [outcome.seconds for outcome in results]
    median = statistics.median(seconds)
    yield (
        f"\nMedian cold solve {median:.2f} s (slowest {max(seconds):.2f} s)"
        f" = {median / pair:.0f} times a real 512 x 512 FFT and its inverse ({1e3 * pair:.2f} ms in"
        " the same run)."
    )
