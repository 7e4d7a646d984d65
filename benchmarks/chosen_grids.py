"""Hard-steel contacts on the grid that is chosen for them, against one finer by 1.5 in both directions.

Fifty random ones: cap 5 to 8 GPa, Hertz's pressure 1 to 2.5 GPa, film ratio 0.1 to 2; lines, balls and ellipses. Asks
how many are solved, how long that takes, and whether CLR is within its error bar of the finer grid's.

    python -m benchmarks.chosen_grids [--count 50] [--model mixed] [--most 150]
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from threadpoolctl import threadpool_limits

from asperity.conditions import ContactConditions, ElasticPair
from asperity.ehl import (
    ContactModel,
    Options,
    Texture,
    auto_grid,
    contact_state,
    least_film,
    solve_contact,
    undetermined,
)
from asperity.grid import Grid
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.surface import gaussian_surface

FINER = 1.5
FEWEST_CELLS = 8
PAIR = ElasticPair((206e9, 206e9), (0.3, 0.3))


@dataclass(frozen=True)
class Sample:
    """A contact, its oil, and its roughness: Sq, correlation lengths [m] and seed."""

    conditions: ContactConditions
    oil: Lubricant
    texture: Texture
    seed: int


@dataclass(frozen=True)
class Outcome:
    """How a solve went: cells, whether it converged, seconds, CLR, its interval, and whether the grid can tell it."""

    cells: tuple[int, int]
    converged: bool
    seconds: float
    clr: float
    interval: tuple[float, float] | None
    determined: bool

    @property
    def told(self) -> str:
        """CLR and its interval in words."""
        ends = "no interval" if self.interval is None else f"{self.interval[0]:.3f} to {self.interval[1]:.3f}"
        return f"{self.clr:.3f} ({ends}{'' if self.determined else ', not determined'})"


def samples(count: int, seed: int = 14) -> Iterator[Sample]:
    """Random contacts; film ratios come from the speed."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        geometry = ("line", "point", "elliptic")[number % 3]
        radius, sq = rng.uniform(4e-3, 20e-3), rng.uniform(0.05e-6, 0.5e-6)
        oil = Lubricant(
            viscosity=Roelands(rng.uniform(5e-3, 60e-3), rng.uniform(14e-9, 24e-9)),
            density=DowsonHigginson(860.0),
            rheology=Newtonian(),
        )
        slow = ContactConditions(
            pair=PAIR,
            geometry=geometry,
            radius=(radius, radius * rng.uniform(2.0, 20.0)) if geometry == "elliptic" else radius,
            length=0.01 if geometry == "line" else None,
            load=100.0,
            surface_speeds=(1.0, 1.0),
            hardness=rng.uniform(5e9, 8e9),
        )
        power = 2.0 if geometry == "line" else 3.0
        pressed = replace(slow, load=100.0 * (rng.uniform(1e9, 2.5e9) / slow.hertz.p_max) ** power)
        film = np.exp(rng.uniform(np.log(0.1), np.log(2.0))) * sq
        speed = scipy.optimize.brentq(_film_over, 1e-6, 1e4, args=(pressed, oil, film))
        a = pressed.hertz.half_widths[0]
        length = a / rng.uniform(3.0, 12.0)
        lengths = length, length * rng.uniform(1.0, 4.0)
        conditions = replace(pressed, surface_speeds=(1.1 * speed, 0.9 * speed))
        least = (2.1 * lengths[0], 2.1 * lengths[1])
        yield Sample(conditions, oil, Texture(sq=sq, lengths=lengths, least=least), number)


def _film_over(speed: float, conditions: ContactConditions, oil: Lubricant, film: float) -> float:
    return float(np.log(least_film(replace(conditions, surface_speeds=(speed, speed)), oil) / film))


def solved(sample: Sample, model: ContactModel, most: int, finer: float = 1.0) -> Outcome:
    """On the chosen grid, or on one finer by a factor in both directions."""
    grid = auto_grid(sample.conditions, sample.oil, sample.texture)
    if finer != 1.0:
        nx, ny = (max(FEWEST_CELLS, 8 * round(finer * n / 8)) for n in grid.cells)
        grid = Grid((nx, ny), grid.lower, grid.upper, grid.periodic)
    surface = gaussian_surface(
        grid,
        sq=sample.texture.sq,
        correlation_length=sample.texture.lengths,
        rng=np.random.default_rng(sample.seed),
    )
    began = time.perf_counter()
    solution = solve_contact(
        sample.conditions,
        sample.oil,
        surface,
        options=Options(model=model, max_iterations=most),
        strict=False,
    )
    seconds = time.perf_counter() - began
    state = contact_state(solution)
    interval = None if state.error is None else state.error.clr.interval
    determined = state.error is not None and undetermined(solution, state.error.clr) is None
    return Outcome(grid.cells, solution.convergence.converged, seconds, state.clr, interval, determined)


def summary(pairs: Sequence[tuple[Outcome, Outcome]]) -> str:
    """Solved, seconds, and how many of those solved on both grids hold the finer one's CLR in their bar."""
    chosen, both = [one for one, _ in pairs], [(one, two) for one, two in pairs if one.converged and two.converged]
    seconds = [one.seconds for one in chosen]
    off = [abs(one.clr - two.clr) for one, two in both]
    told = [(one, two) for one, two in both if one.determined and one.interval is not None]
    held = sum(one.interval is not None and one.interval[0] <= two.clr <= one.interval[1] for one, two in told)
    return (
        f"{sum(one.converged for one in chosen)} of {len(chosen)} solved on the chosen grid, median "
        f"{np.median(seconds):.1f} s, longest {max(seconds):.1f} s; of {len(both)} solved on both, {len(told)} are "
        f"determined, {held} of them hold the finer CLR in their interval; difference "
        f"median {np.median(off) if off else np.nan:.3f}, largest {max(off, default=np.nan):.3f}"
    )


def main() -> None:
    """Solve them and print a table."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.chosen_grids", description=__doc__)
    arguments.add_argument("--count", type=int, default=50)
    arguments.add_argument("--model", default="mixed")
    arguments.add_argument("--most", type=int, default=150, help="Newton steps on a grid")
    wanted = arguments.parse_args()
    print("| contact | lambda | p_h [GPa] | cells | converged | s | CLR | finer: converged | s | CLR |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    pairs = []
    with threadpool_limits(1):
        for number, sample in enumerate(samples(wanted.count)):
            one, two = (solved(sample, wanted.model, wanted.most, finer) for finer in (1.0, FINER))
            pairs.append((one, two))
            ratio = least_film(sample.conditions, sample.oil) / sample.texture.sq
            print(
                f"| {number} {sample.conditions.geometry} | {ratio:.2f} | {sample.conditions.hertz.p_max / 1e9:.2f} | "
                f"{one.cells[0]} x {one.cells[1]} | {one.converged} | {one.seconds:.1f} | {one.told} | "
                f"{two.converged} | {two.seconds:.1f} | {two.told} |",
                flush=True,
            )
    print(f"\n{summary(pairs)}")


if __name__ == "__main__":
    main()
