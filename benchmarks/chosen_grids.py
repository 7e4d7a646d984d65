"""Hard-steel contacts on automatic grids, against grids finer by 1.5 in both directions.

Fifty random lines, balls and ellipses: cap 5 to 8 GPa, Hertz pressure 1 to 2.5 GPa, film ratio 0.1
to 2. Measures how many converge, the time, and whether the error bar of CLR covers the finer grid.
"""

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import scipy

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import ContactModel, Options, Texture, auto_grid, least_film, solve_contact
from asperity.lubricant import DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state, undetermined
from asperity.surface import gaussian_surface
from benchmarks.unfinished import stamp

COUNT, FEW = 50, range(3, 9)  # these take seconds; the third takes minutes on the finer grid
MOST = 150  # Newton steps per grid
LEFT_S = 30.0  # reserve of a part's time for the solves under way at its end
KEPT = Path("build/chosen_grids")
ROOMS = ("ehl", "kernels", "lubricant", "surface")  # packages whose code determines the results
FINER = 1.5
FEWEST_CELLS = 8
PAIR = ElasticPair((206e9, 206e9), (0.3, 0.3))


@dataclass(frozen=True)
class Sample:
    """A contact, its oil and its roughness: Sq, correlation lengths [m] and seed."""

    conditions: ContactConditions
    oil: Lubricant
    texture: Texture
    seed: int


@dataclass(frozen=True)
class Outcome:
    """Convergence, CPU time [s], CLR, its interval, and whether the grid determines CLR."""

    cells: tuple[int, int]
    converged: bool
    seconds: float
    clr: float
    interval: tuple[float, float] | None
    determined: bool

    @property
    def clr_text(self) -> str:
        """CLR and its interval as text."""
        ends = (
            "no interval"
            if self.interval is None
            else f"{self.interval[0]:.3f} to {self.interval[1]:.3f}"
        )
        doubts = ("" if self.determined else ", not determined") + (
            "" if self.converged else ", not converged"
        )
        return f"{self.clr:.3f} ({ends}{doubts})"


def samples(count: int, seed: int = 14) -> Iterator[Sample]:
    """Yield random contacts; the speed sets the film ratio."""
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
        speed = scipy.optimize.brentq(log_film_over, 1e-6, 1e4, args=(pressed, oil, film))
        a = pressed.hertz.half_widths[0]
        length = a / rng.uniform(3.0, 12.0)
        lengths = length, length * rng.uniform(1.0, 4.0)
        conditions = replace(pressed, surface_speeds=(1.1 * speed, 0.9 * speed))
        least = (2.1 * lengths[0], 2.1 * lengths[1])
        yield Sample(conditions, oil, Texture(sq=sq, lengths=lengths, least=least), number)


def log_film_over(
    speed: float, conditions: ContactConditions, oil: Lubricant, film: float
) -> float:
    return float(np.log(least_film(replace(conditions, surface_speeds=(speed, speed)), oil) / film))


def solved(sample: Sample, model: ContactModel, most: int, finer: float = 1.0) -> Outcome:
    """Solve on the automatic grid, refined by `finer` in both directions."""
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
    began = time.process_time()
    solution = solve_contact(
        sample.conditions,
        sample.oil,
        surface,
        options=Options(model=model, max_iterations=most),
        strict=False,
    )
    seconds = time.process_time() - began
    state = contact_state(solution)
    interval = None if state.error is None else state.error.clr.interval
    determined = state.error is not None and undetermined(solution, state.error.clr) is None
    return Outcome(
        grid.cells, solution.convergence.converged, seconds, state.clr, interval, determined
    )


def summary(pairs: Sequence[tuple[Outcome, Outcome]]) -> str:
    """Return convergence, time, and coverage of the finer grid's CLR.

    Coverage counts the contacts that converged on both grids.
    """
    chosen, both = (
        [coarse for coarse, _ in pairs],
        [(coarse, fine) for coarse, fine in pairs if coarse.converged and fine.converged],
    )
    seconds = [coarse.seconds for coarse in chosen]
    off = [abs(coarse.clr - fine.clr) for coarse, fine in both]
    determined_pairs = [
        (coarse, fine) for coarse, fine in both if coarse.determined and coarse.interval is not None
    ]
    covering = sum(
        coarse.interval is not None and coarse.interval[0] <= fine.clr <= coarse.interval[1]
        for coarse, fine in determined_pairs
    )
    return (
        f"{sum(outcome.converged for outcome in chosen)} of {len(chosen)} solved on the"
        f" automatic grid, median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s; of"
        f" {len(both)} solved on both,"
        f" {len(determined_pairs)} are determined, {covering} of these contain the finer CLR in"
        " their"
        " interval;"
        f" difference median {np.median(off) if off else np.nan:.3f}, largest"
        f" {max(off, default=np.nan):.3f}"
    )


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """Yield the table as Markdown: all contacts solved by this code, and more while time is
    left.
    """
    end = time.perf_counter() + seconds - LEFT_S
    every = dict(enumerate(samples(COUNT)))
    pairs = kept_pairs({number: every[number] for number in (FEW if fast else every)}, end)
    yield ("## Hard steel on the automatic grid and on one finer by 1.5 in both directions\n")
    yield f"Sample: {len(pairs)} contacts.\n"
    yield "| contact | film ratio | p_h [GPa] | cells | time [s] | CLR | finer: time [s] | CLR |"
    yield "|---|---|---|---|---|---|---|---|"
    for number, (coarse, fine) in pairs.items():
        conditions, oil, sq = every[number].conditions, every[number].oil, every[number].texture.sq
        cells = " | ".join(f"{solve.seconds:.1f} | {solve.clr_text}" for solve in (coarse, fine))
        yield (
            f"| {number} {conditions.geometry} | {least_film(conditions, oil) / sq:.2f} | "
            f"{conditions.hertz.p_max / 1e9:.2f} | {coarse.cells[0]} x {coarse.cells[1]} | {cells}"
            " |"
        )
    yield f"\n{summary(list(pairs.values()))}"


def kept_pairs(requested: dict[int, Sample], end: float) -> dict[int, tuple[Outcome, Outcome]]:
    """Return each stored contact on both grids, and those that the time allows to solve."""
    path = KEPT / f"{stamp(*ROOMS)}.json"
    kept = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    for number, sample in requested.items():
        if str(number) not in kept and time.perf_counter() < end:
            kept[str(number)] = [
                asdict(solved(sample, "mixed", MOST, finer)) for finer in (1.0, FINER)
            ]
            KEPT.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(kept), "utf-8")
    return {
        int(number): (Outcome(**coarse), Outcome(**fine))
        for number, (coarse, fine) in sorted(kept.items(), key=_number)
    }


def _number(entry: tuple[str, object]) -> int:
    return int(entry[0])
