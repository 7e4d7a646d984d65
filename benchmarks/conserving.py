"""Mass-conserving cavitation: rigid films, 16 static contacts on three surfaces, the same in
motion, cost.

The rigid films are those of `tests/validation/test_cavitation.py`, which compares them with closed
forms and quadratures. Every steady solve is a cold start; times are CPU times. One pass has as
many steps as the domain has cells along rolling.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, product
from statistics import mean, median
from time import process_time
from typing import NamedTuple

import numpy as np

from asperity.case import Case
from asperity.ehl import ContactSolution, FilmBoundary, solve_contact, solve_film
from asperity.ehl.outcome import CONSERVING, MIXED, PAPER
from asperity.solution import LoadSharing, sharing_by_film
from asperity.solution.state import balance_of
from asperity.surface import MovingSurfaces
from asperity.transient import Snapshot, moving_contact
from benchmarks.roughness_levels import paper_case

SQ_UM, LENGTHS_UM, CAPS_GPA, SEEDS = (0.5, 1.0, 2.5, 4.0), (40, 80), (0.7, 2.0), (7, 8, 9)
FILMS_NM = (5, 20, 50, 100, 200)


def lines(*, fast: bool) -> Iterator[str]:
    """Yield all tables as Markdown; `fast` uses one surface of three."""
    yield "## Mass-conserving cavitation\n"
    yield from rigid_films()
    yield ""
    yield from standing(SEEDS[:1] if fast else SEEDS)
    yield ""
    yield from moving(SEEDS[:1] if fast else SEEDS)
    yield ""
    yield from cost()


def rigid_films() -> Iterator[str]:
    """Yield a parabolic slider and a pocketed slider over cells (physics: p = 0 where the film
    ruptures).
    """
    yield "| rigid film | cells | p_max error | flow error | flow variation | Newton steps |"
    yield "|---|---|---|---|---|---|"
    for cells in (100, 400, 1600):
        x = (np.arange(cells) + 0.5) / cells
        length, least = 76.2e-3, 25.4e-6
        film = solve_film(
            least * (1.0 + (2.0 * x - 1.0) ** 2),
            spacing=length / cells,
            entrainment_speed=4.57 / 2.0,
            viscosity=0.039,
            boundary=FilmBoundary(ends=(3364.14, 0.0)),
        )
        peak, flow = film.pressure.max() / 3.594269e6 - 1.0, film.flux.mean() / 6.547565e-5 - 1.0
        vary = np.ptp(film.flux) / film.flux.mean()
        yield (
            f"| parabolic slider | {cells} | {100 * peak:.4f} % | {flow:.1e} | {vary:.1e} |"
            f" {film.steps} |"
        )
    for cells in (100, 400, 1600):
        x = (np.arange(cells) + 0.5) / cells * 20e-3
        film = solve_film(
            np.where((x > 4e-3) & (x < 10e-3), 2e-6, 1e-6),
            spacing=20e-3 / cells,
            entrainment_speed=0.5,
            viscosity=0.01,
            boundary=FilmBoundary(ends=(1e5, 1e5)),
        )
        peak, flow = film.pressure.max() / 350e3 - 1.0, film.flux.mean() / 5.002083e-7 - 1.0
        vary = np.ptp(film.flux) / film.flux.mean()
        yield (
            f"| slider with a pocket | {cells} | {100 * peak:.4f} % | {flow:.1e} | {vary:.1e} |"
            f" {film.steps} |"
        )


class Contact(NamedTuple):
    """One of the 16 contacts on one of the surfaces."""

    sq_um: float
    length_um: int
    cap_gpa: float
    seed: int

    def case(self, cells: int) -> Case:
        """Return the paper's contact with this surface and cap."""
        return paper_case(self.sq_um, self.seed, cells).with_overrides(
            {
                "surface.correlation_length": [f"{self.length_um} um"] * 2,
                "material.hardness": f"{self.cap_gpa} GPa",
                "model": CONSERVING,
            }
        )


def contacts(seeds: tuple[int, ...]) -> Iterator[Contact]:
    """Yield all roughness levels of all surfaces."""
    yield from (
        Contact(*level, seed) for seed in seeds for level in product(SQ_UM, LENGTHS_UM, CAPS_GPA)
    )


def lost(solution: ContactSolution) -> float:
    """Return the sum of oil lost by cells, over the throughflow."""
    balance = balance_of(solution)
    dx, dy = balance.problem.spacing
    return abs(float(balance.outflow.sum()) * dx * dy / balance.throughflow)


def standing(seeds: tuple[int, ...]) -> Iterator[str]:
    """Yield snapshots of all models at 128 x 128."""
    solved: dict[int, int] = defaultdict(int)
    ratios, seconds, worst = [], [], 0.0
    shares: dict[tuple[str, float], list[LoadSharing]] = defaultdict(list)
    for contact in contacts(seeds):
        case = contact.case(128)
        surface, options = case.surface(), case.options
        spent = {}
        for model in (PAPER, MIXED, CONSERVING):
            began = process_time()
            solution = solve_contact(
                case.conditions,
                case.lubricant,
                surface,
                options=replace(options, model=model),
                strict=False,
            )
            spent[model] = process_time() - began
            if solution.convergence.converged:
                shares[model, contact.sq_um].append(sharing_by_film(solution))
        if solution.convergence.converged:
            solved[contact.seed] += 1
            worst = max(worst, lost(solution))
        ratios.append(spent[CONSERVING] / spent[MIXED])
        seconds.append(spent[CONSERVING])
    solved_counts = ", ".join(f"{solved[seed]} of 16 on surface {seed}" for seed in seeds)
    yield (
        f"Static, 128 x 128: solved {solved_counts}. Net oil loss at most"
        f" {worst:.1e} of the throughflow. From a cold start: median {median(seconds):.2f} s"
        f" (longest {max(seconds):.1f} s), {median(ratios):.1f} times the default model (longest"
        f" {max(ratios):.0f} times).\n"
    )
    yield from _shares(shares)


def _shares(shares: dict[tuple[str, float], list[LoadSharing]]) -> Iterator[str]:
    films = " | ".join(f"L({film} nm)" for film in FILMS_NM)
    yield f"| Sq um | model | CLR_s | CAR_s | {films} | cavitated | oil um | contacts |"
    yield "|---" * (7 + len(FILMS_NM)) + "|"
    for (model, sq), found in sorted(shares.items(), key=lambda item: item[0][1]):

        def spread(values: list[float], scale: float = 1.0) -> str:
            return f"{scale * mean(values):.2f} ± {scale * float(np.std(values)):.2f}"

        below = " | ".join(
            spread([sharing.below[index] for sharing in found]) for index in range(len(FILMS_NM))
        )
        yield (
            f"| {sq:g} | {model} | {spread([sharing.clr_solid for sharing in found])} |"
            f" {spread([sharing.car_solid for sharing in found])} | {below} |"
            f" {spread([sharing.cavitated for sharing in found])} |"
            f" {spread([sharing.oil for sharing in found], 1e6)} | {len(found)} |"
        )


def moving(seeds: tuple[int, ...]) -> Iterator[str]:
    """Yield one pass of every contact at 64 x 64."""
    taken = accepted = 0
    first_bad, worst = [], 0.0
    shares: dict[tuple[str, float], list[LoadSharing]] = defaultdict(list)
    for contact in contacts(seeds):
        for snapshot in islice(_steps(contact.case(64)), 1, 65):
            good, taken = snapshot.solution.convergence.converged, taken + 1
            accepted += good
            if not good:
                first_bad.append((contact, snapshot.number))
            else:
                worst = max(worst, snapshot.state.mass_flux_imbalance)
        shares["moving", contact.sq_um].append(sharing_by_film(snapshot.solution))
    yield (
        f"Moving, 64 x 64, one pass: {accepted} of {taken} steps accepted"
        f" ({100 * accepted / taken:.1f} %); in accepted steps the oil lost and gained by cells of"
        " the Hertz zone"
        f" is at most {worst:.1e} of the oil carried there."
    )
    yield f"First steps not accepted: {first_bad[:5]}\n" if first_bad else ""
    yield from _shares(shares)


def _steps(case: Case) -> Iterator[Snapshot]:
    surfaces = MovingSurfaces.one_rough(case.surface(), case.conditions.surface_speeds)
    yield from moving_contact(case.conditions, case.lubricant, surfaces, options=case.options)


def cost() -> Iterator[str]:
    """Yield seconds per step in motion on three grids, Sq 1 and 2.5 um."""
    yield "| cells | seconds per step, Sq 1 um | Sq 2.5 um | Newton steps |"
    yield "|---|---|---|---|"
    for cells in (64, 128, 256):
        spent, newton = [], []
        for sq in (1.0, 2.5):
            steps = _steps(Contact(sq, 40, 2.0, 7).case(cells))
            next(steps)
            began = process_time()
            newton += [snapshot.solution.convergence.iterations for snapshot in islice(steps, 6)]
            spent.append((process_time() - began) / 6.0)
        yield f"| {cells} x {cells} | {spent[0]:.2f} | {spent[1]:.2f} | {mean(newton):.0f} |"
