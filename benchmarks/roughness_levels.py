"""The paper's contact at nine roughness levels on five surfaces each: how it converges, what it
costs, what comes out.

Every solve starts cold, with the elastic kernel built anew, on one thread, in processor time.
Compiled kernels are cached. The tight solves (tolerance 1e-6) tell how far off the default ones
(1e-4) are.
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
    """One contact, solved to the default tolerance and, if asked, 100 times tighter."""

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
    """The paper's contact with one of the surfaces."""
    return load_case(CASE).with_overrides(
        {"surface.sq": f"{sq_um} um", "surface.seed": seed, "grid.cells": [cells, cells]}
    )


def solve(sq_um: float, seed: int, tolerance: float, cells: int) -> ContactSolution:
    """One cold solve."""
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
    *, tight: bool, cells: int = 256, told: Callable[[Outcome], None] = lambda _: None
) -> list[Outcome]:
    """All levels and surfaces."""
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
            told(outcome)
            results.append(outcome)
    return results


def fft_pair_seconds(cells: int = 512) -> float:
    """Median time of one real FFT and back of cells x cells, the machine's yardstick."""
    import scipy.fft as fft

    field = np.random.default_rng(0).standard_normal((cells, cells))
    times = []
    for _ in range(40):
        began = process_time()
        fft.irfft2(fft.rfft2(field))
        times.append(process_time() - began)
    return statistics.median(times)


def table(results: list[Outcome]) -> list[str]:
    """A Markdown table, a row a roughness level: means over seeds, standard deviation behind ±."""
    rows = [
        (
            "| Sq [um] | CAR [%] | CAR domain [%] | CLR [%] | load on capped oil [%] | oil"
            " imbalance [%] | converged | steps | seconds | CLR off by |"
        ),
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for sq_um in SQ_UM:
        level = [one for one in results if one.sq_um == sq_um]

        def spread(name: str, level: list[Outcome] = level) -> str:
            values = [100.0 * getattr(one, name) for one in level]
            return f"{statistics.mean(values):.1f} ± {statistics.stdev(values):.1f}"

        worst = max((one.clr_error for one in level if one.clr_error is not None), default=None)
        tight = (
            "" if worst is None else f" ({sum(bool(one.tight_converged) for one in level)} tight)"
        )
        rows.append(
            f"| {sq_um} | {spread('car')} | {spread('car_domain')} | {spread('clr')} |"
            f" {spread('capped_oil')} | {spread('imbalance')} |"
            f" {sum(one.converged for one in level)} of {len(level)}{tight} |"
            f" {statistics.median(one.steps for one in level):.0f} |"
            f" {statistics.median(one.seconds for one in level):.2f} |"
            f" {'-' if worst is None else f'{worst:.1e}'} |"
        )
    return rows


def lines(*, fast: bool) -> Iterator[str]:
    """The table as Markdown, and what a solve takes in transforms."""

    def told(one: Outcome) -> None:
        print(
            f"  Sq {one.sq_um} um, seed {one.seed}: {one.seconds:.2f} s, CLR {one.clr:.4f}",
            file=sys.stderr,
        )

    yield "## Roughness levels of the paper's contact, 256 x 256\n"
    before = fft_pair_seconds()
    results = outcomes(tight=not fast, told=told)
    pair = statistics.mean([before, fft_pair_seconds()])
    yield from table(results)
    median = statistics.median(one.seconds for one in results)
    yield (
        f"\nMedian cold solve {median:.2f} s (slowest {max(one.seconds for one in results):.2f} s)"
        f" = {median / pair:.0f} times one real 512 x 512 FFT and back ({1e3 * pair:.2f} ms in the"
        " same run)."
    )
