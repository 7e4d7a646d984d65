"""Hard-steel contacts on the grid that is chosen for them, against one finer by 1.5 in both
directions.

Fifty random ones: cap 5 to 8 GPa, Hertz's pressure 1 to 2.5 GPa, film ratio 0.1 to 2; lines, balls
and ellipses. Asks how many are solved, how long that takes, and whether CLR is within its error
bar of the finer grid's.
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

COUNT, FEW = 50, range(3, 9)  # those take seconds, the third minutes on the finer grid
MOST = 150  # Newton steps on a grid
LEFT_S = 30.0  # of a part's time, for what is under way when it ends
KEPT = Path("build/chosen_grids")
ROOMS = ("ehl", "kernels", "lubricant", "surface")  # whose code decides
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
    """How a solve went: whether it converged, processor time [s], CLR, its interval, whether the
    grid can tell it.
    """

    cells: tuple[int, int]
    converged: bool
    seconds: float
    clr: float
    interval: tuple[float, float] | None
    determined: bool

    @property
    def told(self) -> str:
        """CLR and its interval in words."""
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
    """Solved, seconds, and how many of those solved on both grids hold the finer one's CLR in their
    bar.
    """
    chosen, both = (
        [one for one, _ in pairs],
        [(one, two) for one, two in pairs if one.converged and two.converged],
    )
    seconds = [one.seconds for one in chosen]
    off = [abs(one.clr - two.clr) for one, two in both]
    told = [(one, two) for one, two in both if one.determined and one.interval is not None]
    held = sum(
        one.interval is not None and one.interval[0] <= two.clr <= one.interval[1]
        for one, two in told
    )
    return (
        f"{sum(one.converged for one in chosen)} of {len(chosen)} solved on the chosen grid, median"
        f" {np.median(seconds):.1f} s, longest {max(seconds):.1f} s; of {len(both)} solved on both,"
        f" {len(told)} are determined, {held} of them hold the finer CLR in their interval;"
        f" difference median {np.median(off) if off else np.nan:.3f}, largest"
        f" {max(off, default=np.nan):.3f}"
    )


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """The table as Markdown: all contacts solved so far by this code, as many more as there is time
    for.
    """
    end = time.perf_counter() + seconds - LEFT_S
    every = dict(enumerate(samples(COUNT)))
    pairs = kept_pairs({number: every[number] for number in (FEW if fast else every)}, end)
    yield (
        "## Hard steel on the grid that is chosen for it, and on one finer by 1.5 in both"
        " directions\n"
    )
    yield f"Sample: {len(pairs)} contacts.\n"
    yield "| contact | film ratio | p_h [GPa] | cells | time [s] | CLR | finer: time [s] | CLR |"
    yield "|---|---|---|---|---|---|---|---|"
    for number, (one, two) in pairs.items():
        conditions, oil, sq = every[number].conditions, every[number].oil, every[number].texture.sq
        cells = " | ".join(f"{solve.seconds:.1f} | {solve.told}" for solve in (one, two))
        yield (
            f"| {number} {conditions.geometry} | {least_film(conditions, oil) / sq:.2f} | "
            f"{conditions.hertz.p_max / 1e9:.2f} | {one.cells[0]} x {one.cells[1]} | {cells} |"
        )
    yield f"\n{summary(list(pairs.values()))}"


def kept_pairs(wanted: dict[int, Sample], end: float) -> dict[int, tuple[Outcome, Outcome]]:
    """Each contact on both grids, as they are kept, and those that time allows."""
    path = KEPT / f"{stamp(*ROOMS)}.json"
    kept = json.loads(path.read_text("utf-8")) if path.is_file() else {}
    for number, sample in wanted.items():
        if str(number) not in kept and time.perf_counter() < end:
            kept[str(number)] = [
                asdict(solved(sample, "mixed", MOST, finer)) for finer in (1.0, FINER)
            ]
            KEPT.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(kept), "utf-8")
    return {
        int(number): (Outcome(**one), Outcome(**two))
        for number, (one, two) in sorted(kept.items(), key=_number)
    }


def _number(entry: tuple[str, object]) -> int:
    return int(entry[0])
