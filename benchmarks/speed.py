"""Time and memory of solves: finer grids, smooth, dry, other codes, two processors at once."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import replace
from statistics import median
from time import perf_counter, process_time

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.ehl import ContactSolution, Options, solve_contact
from asperity.ehl.deflection import deflection
from asperity.lubricant import Lubricant
from asperity.solution import contact_state
from asperity.surface import Surface, flat_surface
from benchmarks.films import BARUS, REFERENCE, ball
from benchmarks.roughness_levels import SEEDS, SQ_UM, paper_case

TRIES = 3
TURNS = 5  # alternating runs of two codes


def cold(
    conditions: ContactConditions, oil: Lubricant | None, surface: Surface, tolerance: float
) -> ContactSolution:
    """Solve from the Hertz pressure without a cached elastic kernel."""
    deflection.cache_clear()
    return solve_contact(
        conditions, oil, surface, options=Options(tolerance=tolerance), strict=False
    )


def best_of(work: Callable[[], object], tries: int = TRIES) -> float:
    """Return the least time of several runs [s]; a first run, not counted, compiles the kernels."""
    work()
    times = []
    for _ in range(tries):
        began = perf_counter()
        work()
        times.append(perf_counter() - began)
    return min(times)


def _grids(*, fast: bool) -> Iterator[str]:
    yield "| cells | median solve [s] | over 256 x 256 | peak memory [GiB] |"
    yield "|---|---|---|---|"
    levels = [(sq, seed) for sq in SQ_UM for seed in SEEDS] if not fast else [(1.0, 0), (3.0, 1)]
    base = None
    for cells in (256, 512, 1024):
        chosen = levels if cells == 256 else levels[:: 5 if cells == 512 else 15]
        times = []
        for sq, seed in chosen:
            case = paper_case(sq, seed, cells)
            solution = cold(case.conditions, case.lubricant, case.surface(), 1e-4)
            times.append(solution.convergence.seconds)
        base = base or median(times)
        found = f"{median(times):.2f} | {median(times) / base:.1f} | {peak_gib(cells):.2f}"
        yield f"| {cells} x {cells} ({len(times)} solves) | {found} |"


def _against_papers_model() -> Iterator[str]:
    """Solve the same rough contacts alternately with the default model and with the paper's."""
    spent: dict[str, list[float]] = {"paper": [], "mixed": []}
    for sq_um in (SQ_UM[0], 1.0, 2.5, SQ_UM[-1]):
        for seed in SEEDS[:3]:
            case = paper_case(sq_um, seed, 256)
            surface = case.surface()
            for model, times in spent.items():
                deflection.cache_clear()
                began = process_time()
                solve_contact(
                    case.conditions,
                    case.lubricant,
                    surface,
                    options=replace(case.options, model=model),
                )
                times.append(process_time() - began)
    paper, mixed = (median(times) for times in spent.values())
    yield (
        f"Rough, 256 x 256, median of {len(spent['mixed'])} surfaces, alternating: {mixed:.2f} s"
        f" with the default model, {paper:.2f} s with the paper's; ratio {mixed / paper:.2f}."
    )


def peak_gib(cells: int) -> float:
    """Return the peak memory [GiB] of a process that solves the paper's contact once."""
    code = (
        "import resource; from benchmarks.speed import cold; from benchmarks.roughness_levels"
        f" import paper_case; case = paper_case(1.0, 0, {cells}); cold(case.conditions,"
        " case.lubricant, case.surface(), 1e-4);"
        " print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return int(done.stdout) / 1024.0**2


def _smooth() -> Iterator[str]:
    case = paper_case(1.0, 0, 256)
    seconds = best_of(lambda: cold(case.conditions, case.lubricant, flat_surface(case.grid), 1e-4))
    yield f"Smooth line contact, 256 x 256 cells, solved on one line: {seconds:.3f} s."
    for (load_number, oil_number, name), (central, least) in list(REFERENCE.items())[:2]:
        conditions, unit = ball(load_number, oil_number)
        a = conditions.hertz.half_widths[0]
        grid = Grid((257, 257), (-4.5 * a, -3.0 * a), (1.5 * a, 3.0 * a), periodic=(False, False))
        solution = cold(conditions, BARUS, flat_surface(grid), 1e-4)
        seconds = best_of(lambda c=conditions, g=grid: cold(c, BARUS, flat_surface(g), 1e-4))  # type: ignore[misc]
        middle = float(np.interp(0.0, grid.x, solution.gap[:, 128])) / unit
        off = [
            100.0 * (film / reference - 1.0)
            for film, reference in ((middle, central), (solution.gap.min() / unit, least))
        ]
        yield (
            f"Smooth ball, M {load_number}, L {oil_number}, {name}, 257 x 257: {seconds:.2f} s; "
            f"deviation from the reference: central film {off[0]:+.2f} %, minimum film"
            f" {off[1]:+.2f} %."
        )


def _dry() -> Iterator[str]:
    yield ""
    yield (
        "| dry, rough, elastic, to 1e-8 | asperity [s] | kernel cached [s] | tamaas [s] | asperity"
        " over tamaas |"
    )
    yield "|---|---|---|---|---|"
    for cells in (256, 512):
        for sq_um, seed in ((0.5, 2), (1.0, 0), (3.0, 1)):
            yield f"| {cells} x {cells}, Sq {sq_um} um | {_against_tamaas(sq_um, seed, cells)} |"
    yield ""
    conditions, surface = elastic_case(1.0, 0, 256)
    try:
        seconds = _contact_mechanics_seconds(surface, conditions)
        yield (
            f"ContactMechanics, Sq 1.0 um, 256 x 256, periodic both ways, to 1e-8: {seconds:.3f} s."
        )
    except ImportError:
        yield "ContactMechanics is not installed here."
    yield (
        "SlipPy 0.5.2, the only open code for the rough point contact, requires NumPy below 1.21"
        " and thus Python 3.9 or older: it cannot be installed with asperity."
    )


def elastic_case(sq_um: float, seed: int, cells: int) -> tuple[ContactConditions, Surface]:
    """Return the paper's contact without a pressure cap."""
    case = paper_case(sq_um, seed, cells)
    return replace(case.conditions, hardness=None), case.surface()


def _against_tamaas(sq_um: float, seed: int, cells: int) -> str:
    """Return the least CPU times of alternating runs of both codes, and their ratio."""
    conditions, surface = elastic_case(sq_um, seed, cells)
    options = Options(tolerance=1e-8)
    works = {
        "cold": lambda: cold(conditions, None, surface, 1e-8),
        "cached": lambda: solve_contact(conditions, None, surface, options=options),
    }
    with suppress(ImportError):
        works["tamaas"] = _tamaas_solver(surface, conditions)
    spent: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(1 + TURNS):
        for name, work in works.items():
            began = process_time()
            work()
            spent[name].append(process_time() - began)
    least = {name: min(times[1:]) for name, times in spent.items()}
    twin = (
        f"{least['tamaas']:.3f} | {least['cold'] / least['tamaas']:.2f}"
        if "tamaas" in least
        else "not installed | -"
    )
    return f"{least['cold']:.3f} | {least['cached']:.3f} | {twin}"


def _tamaas_solver(surface: Surface, conditions: ContactConditions) -> Callable[[], object]:
    """Return a function that solves the same heights by tamaas, periodic in both directions."""
    import tamaas as tm

    grid = surface.grid
    form = -(grid.x[:, None] ** 2) / (2.0 * conditions.radius_along_rolling) * np.ones(grid.cells)
    pressure = conditions.line_load / grid.extent[0]

    def solve() -> None:  # a new model each time: a used one starts from its last solution
        model = tm.Model(tm.model_type.basic_2d, list(grid.extent), list(grid.cells))
        model.E, model.nu = conditions.pair.reduced_modulus, 0.0
        solver = tm.PolonskyKeerRey(model, surface.heights + form, 1e-8)
        solver.solve(pressure)

    tm.set_log_level(tm.LogLevel.error)
    return solve


def _contact_mechanics_seconds(surface: Surface, conditions: ContactConditions) -> float:
    from ContactMechanics import PeriodicFFTElasticHalfSpace
    from ContactMechanics.Factory import make_system
    from SurfaceTopography import Topography

    grid = surface.grid
    form = -(grid.x[:, None] ** 2) / (2.0 * conditions.radius_along_rolling) * np.ones(grid.cells)
    topography = Topography(surface.heights + form, grid.extent, periodic=True)
    substrate = PeriodicFFTElasticHalfSpace(
        grid.cells, conditions.pair.reduced_modulus, grid.extent
    )
    load = conditions.line_load * grid.extent[1]

    def solve() -> None:
        system = make_system(substrate=substrate, surface=topography)
        result = system.minimize_proxy(
            external_force=load, pentol=1e-8 * load / np.prod(grid.cells)
        )
        if not result.success:
            raise RuntimeError("ContactMechanics did not converge")

    return best_of(solve)


def _one_solve(seed: int) -> float:
    case = paper_case(1.0, seed, 256)
    surface = case.surface()
    cold(case.conditions, case.lubricant, surface, 1e-4)
    began = perf_counter()
    for _ in range(4):
        cold(case.conditions, case.lubricant, surface, 1e-4)
    return perf_counter() - began


def _two_processors() -> Iterator[str]:
    if (os.cpu_count() or 1) < 2:
        yield "Only one processor: no comparison."
        return
    alone = sum(_one_solve(seed) for seed in (0, 1))
    with ProcessPoolExecutor(2) as pool:
        together = max(pool.map(_one_solve, (0, 1)))
    yield f"Two solves on two processors: {alone / together:.2f} times as fast as sequentially."


def _error_bars(*, fast: bool) -> Iterator[str]:
    """Count how often the stated error covers the difference to a grid twice as fine."""
    covered, cases, factors = {"car": 0, "clr": 0, "h_central": 0}, 0, []
    for sq in SQ_UM[:: 4 if fast else 1]:
        for seed in (0, 1) if fast else SEEDS:
            coarse, fine = (paper_case(sq, seed, cells) for cells in (256, 512))
            here, finer = (
                cold(case.conditions, case.lubricant, case.surface(), 1e-4)
                for case in (coarse, fine)
            )
            error, state, truth = here.convergence.error, contact_state(here), contact_state(finer)
            assert error is not None
            cases += 1
            for name in covered:
                off = abs(getattr(state, name) - getattr(truth, name))
                covered[name] += bool(off <= getattr(error, name))
                if off > 0.0:
                    factors.append(getattr(error, name) / off)
    counts = ", ".join(f"{name} in {count}" for name, count in covered.items())
    yield (
        f"For {cases} contacts at 256 x 256 the stated error covers the difference to 512 x 512:"
        f" {counts}; it is {median(factors):.1f} times that difference (median)."
    )


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the figures as Markdown."""
    yield "## Time and memory of a solve"
    yield ""
    yield from _grids(fast=fast)
    yield ""
    for part in (
        _against_papers_model(),
        _smooth(),
        _dry(),
        _two_processors(),
        _error_bars(fast=fast),
    ):
        yield from part
