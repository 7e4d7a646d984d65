"""Wear in time: what it takes, kills, what jumps, grids and positions do to it, intervals,
plateaus, rings.

Histories are kept in build/wearing and go on where they were stopped, as long as the code that
wears is the same: each call does what its time allows and says what is left.
"""

import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from asperity import load_case, run_wear
from asperity.case import Case
from asperity.core.quantities import quantity
from asperity.paper import CRF_ENDS_HZ
from asperity.report.style import BLUE, DASHED, GREEN, ON_PAGE, VERMILION, write_figure
from asperity.simulation import (
    SolvedPosition,
    WearHistory,
    WearingContact,
    WearProgress,
    body_column,
    load_wear,
)
from asperity.simulation.wear.rows import load_share
from asperity.surface.read import surface_topography
from asperity.wear import combined_roughness, positions
from benchmarks.unfinished import stamp

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "build" / "wearing"
WEARS = (
    "wear",
    "ehl",
    "solution",
    "contact",
    "kernels",
    "surface",
    "lubricant",
)  # rooms that decide a history; of their own room these:
DECIDE = ("jump", "run", "contact", "reach", "state", "tracks")
IMAGES = ROOT / "docs" / "images"
EXAMPLE = ROOT / "examples" / "wear.toml"
MEASURED = ROOT.parent / "shared" / "data" / "surfaces" / "milled_1.opd"
KILLS = 10
COARSE = ("grid.cells=[32,32]", 'surface.correlation_length="30 um"', "wear.patches=4")
KILLED = {  # what is killed: hours, and what its case differs in from the example
    "removal alone, 32 x 32 cells, 12 h": (12.0, COARSE),
    "pits, marks, scuffing and flattening, 32 x 32 cells, 0.5 h": (
        0.5,
        (
            *COARSE,
            "wear.flattening=true",
            'wear.fatigue={ law = "dang-van", limit = "200 MPa" }',
            'wear.ploughing={ law = "debris", concentration = "1e10 1/m^3" }',
            'wear.scuffing={ law = "temperature", limit = "20 K" }',
        ),
    ),
}
ENDS = (
    14  # positions at which the end of a history is looked at, the same for all that are compared
)
SHORT_S = 240.0  # of a short run
ENOUGH_CELLS = 0.85  # of the time that a part has, that is spent on histories
MANY = 14  # positions whose mean stands for the mean
SEEDS = 20
RISEN = 12.0  # hours in which pits have made up for what removal smoothed

Overrides = dict[str, object]


class OutOfTime(Exception):
    """A history that has to wait for the next call."""


class Plan(NamedTuple):
    """A history that is wanted: its folder's name, its hours, and what its case differs in from the
    example.
    """

    name: str
    hours: float
    overrides: Overrides

    @property
    def folder(self) -> str:
        """Another for every case."""
        told = json.dumps([self.hours, self.overrides], sort_keys=True)
        return f"{self.name}-{hashlib.sha256(told.encode()).hexdigest()[:8]}"


class Shelf:
    """Histories as they are kept, and time to go on with them."""

    def __init__(self, seconds: float) -> None:
        self.end = time.perf_counter() + ENOUGH_CELLS * seconds
        self.folder = KEPT / stamp(*WEARS, *(f"simulation/wear/{name}" for name in DECIDE))
        self.left: list[str] = []
        self.made = 0

    def worn(self, plan: Plan) -> tuple[WearHistory, float] | None:
        """A history and the processor time that it took in all; None where time runs out on the
        way.
        """
        folder = self.folder / plan.folder
        clock, ended = (self.folder / f"{plan.folder}.{kind}" for kind in ("json", "ended"))
        if time.perf_counter() > self.end and not ended.is_file():
            self.left.append(plan.name)
            return None
        began = time.process_time()
        spent = float(json.loads(clock.read_text("utf-8"))) if clock.is_file() else 0.0

        def told(_: WearProgress) -> None:
            clock.write_text(json.dumps(spent + time.process_time() - began), "utf-8")
            if time.perf_counter() > self.end:
                raise OutOfTime

        self.folder.mkdir(parents=True, exist_ok=True)
        try:
            history = run_wear(case(plan.overrides), hours=plan.hours, out=folder, progress=told)
        except OutOfTime:
            self.left.append(plan.name)
            return None
        ended.touch()
        return history, float(json.loads(clock.read_text("utf-8")))

    def all(self, plans: Sequence[Plan]) -> Iterator[tuple[Plan, WearHistory, float]]:
        """Those of them that are there, or that time allows."""
        for plan in plans:
            if (made := self.worn(plan)) is not None:
                self.made += 1
                yield plan, *made


def case(overrides: Overrides) -> Case:
    return load_case(EXAMPLE).with_overrides(overrides)


def coefficients(k: float) -> list[str]:
    """Of the roller, which is over-rolled more often, and of the ring."""
    return [f"{k / 20.0!r} 1/Pa", f"{k!r} 1/Pa"]


def heads(*keys: str) -> str:
    """Of some columns, as cells of a table, with the units that people read."""
    return " | ".join(quantity(key).label for key in keys)


def told(moment: Mapping[str, float], *keys: str) -> str:
    """Some numbers of a moment, as cells of a table."""
    return " | ".join(f"{quantity(key).factor * moment[key]:.4g}" for key in keys)


def row(history: WearHistory, *keys: str) -> str:
    """First and last of some columns, as cells of a table."""
    first, last = history.table.iloc[0], history.table.iloc[-1]
    return " | ".join(f"{told(first, key)} to {told(last, key)}" for key in keys)


def solved_at(history: WearHistory, count: int, seed: int) -> list[SolvedPosition]:
    """The contact at the history's end, at so many positions."""
    ageing: WearingContact = history.contact
    surfaces = history.final_surfaces
    cells = (surfaces.first.grid.cells[0], surfaces.second.grid.cells[0])
    places = positions(cells, ageing.surfaces.rough, count, 0, seed)
    return [
        one
        for place in places
        if isinstance(one := ageing.solver(combined_roughness(surfaces, place)), SolvedPosition)
    ]


def end_mean(history: WearHistory) -> str:
    """CLR of the worn surfaces over many positions, which a jump's own have not the number for, and
    its deviation.
    """
    clr = 100.0 * np.array([one.state.clr for one in solved_at(history, ENDS, 99)])
    return f"{np.mean(clr):.2f} ± {np.std(clr, ddof=1) / np.sqrt(len(clr)):.1f}"


def speed(shelf: Shelf) -> Iterator[str]:
    yield "\n## 1e7 over-rollings of the roller at 128 x 128 cells\n"
    yield (
        "| hours | jumps | positions | processor time [s] | a jump [s] | of two processes [s] | "
        f"{heads('sq_m', 'clr')} | volume error | jump error |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    whole = 1e7 / 56.25 / 3600.0
    fast: Overrides = {"grid.cells": [128, 128], "wear.patches": 4, "wear.step": 0.1}
    for _, history, seconds in shelf.all([Plan("speed", whole, fast)]):
        jumps, patches = len(history.table) - 1, history.contact.patches
        abreast = -(-patches // 2) / patches  # of a jump's positions, that the busier of two solves
        yield (
            f"| {history.hours:.1f} | {jumps} | {patches} | {seconds:.0f} | {seconds / jumps:.2f} |"
            f" {seconds * abreast:.0f} | {row(history, 'sq_m', 'clr')} | {history.volume_error:.1e}"
            f" | {history.worn.error:.1e} |"
        )


def kills() -> Iterator[str]:
    yield "\n## Killed while they ran, at random moments\n"
    yield "| history | jumps | times killed | numbers and surfaces |"
    yield "|---|---|---|---|"
    for name, (hours, overrides) in KILLED.items():
        with tempfile.TemporaryDirectory() as folder:
            times, whole, killed = _killed(Path(folder), hours, overrides)
        same = whole.table.equals(killed.table) and all(
            np.array_equal(
                getattr(whole.final_surfaces, body).heights,
                getattr(killed.final_surfaces, body).heights,
            )
            for body in ("first", "second")
        )
        outcome = "the same to the last bit" if same else "DIFFERENT"
        yield f"| {name} | {len(whole.table) - 1} | {times} | {outcome} |"


def _killed(
    folder: Path, hours: float, overrides: Sequence[str]
) -> tuple[int, WearHistory, WearHistory]:
    """How often a history was killed as it ran, one that was let alone, and that one at its end."""
    changes = [word for override in overrides for word in ("--set", override)]
    command = [
        sys.executable,
        "-m",
        "asperity",
        "wear",
        str(EXAMPLE),
        "--hours",
        f"{hours:g}",
        *changes,
        "--quiet",
    ]
    command += ["--workers", "1", "--out"]
    began, rng, times = time.perf_counter(), np.random.default_rng(11), 0
    subprocess.run([*command, str(folder / "whole")], check=True, stdout=subprocess.DEVNULL)
    whole = time.perf_counter() - began
    for _ in range(KILLS):
        process = subprocess.Popen([*command, str(folder / "killed")], stdout=subprocess.DEVNULL)
        time.sleep(rng.uniform(0.05, 0.3) * whole)
        times += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
    subprocess.run([*command, str(folder / "killed")], check=True, stdout=subprocess.DEVNULL)
    one, other = (load_wear(folder / name) for name in ("whole", "killed"))
    return times, one, other


def jumps(shelf: Shelf) -> Iterator[str]:
    yield "\n## Half the jump, and fewer or more positions, 2 h\n"
    yield (
        f"| cells | step | positions | jumps | {heads('sq_m', 'spk_m', 'clr')} of {ENDS} positions"
        " | seconds |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    ways = [(64, 0.1, 7), (64, 0.05, 7), (64, 0.025, 7), (64, 0.05, 4), (64, 0.05, 14)]
    plans = [
        Plan(
            f"jumps-{cells}-{step}-{count}",
            2.0,
            {"grid.cells": [cells] * 2, "wear.step": step, "wear.patches": count},
        )
        for cells, step, count in ways
    ]
    for plan, history, seconds in shelf.all(plans):
        _, cells, step, count = plan.name.split("-")
        last = history.table.iloc[-1]
        yield (
            f"| {cells} | {step} | {count} | {len(history.table) - 1} | {1e6 * last['sq_m']:.5f} | "
            f"{1e6 * last['spk_m']:.4f} | {end_mean(history)} | {seconds:.0f} |"
        )


def grids(shelf: Shelf) -> Iterator[str]:
    keys = ("clr", "sq_m", "spk_m", "worn_depth_2_m")
    yield "\n## Grids, 1 h\n"
    yield (
        f"| cells | {heads(*keys)} | {heads('clr')} of {ENDS} positions | jumps | processor time"
        " [s] |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    plans = [Plan(f"grid-{cells}", 1.0, {"grid.cells": [cells] * 2}) for cells in (64, 128, 256)]
    for plan, history, seconds in shelf.all(plans):
        count = len(history.table) - 1
        cells = plan.name.removeprefix("grid-")
        yield f"| {cells} | {row(history, *keys)} | {end_mean(history)} | {count} | {seconds:.0f} |"


def intervals() -> Iterator[str]:
    """How often the interval over a jump's positions holds: new surfaces of several seeds."""
    one_more, mean, of_mean, widths, all_others = 0, 0, 0, [], 0
    for seed in range(SEEDS):
        new = run_wear(case({"surface.seed": seed, "grid.cells": [96, 32]}), hours=1e-9)
        few, many = solved_at(new, new.contact.patches, seed), solved_at(new, MANY, 1000 + seed)
        shares, others = ([one.state.clr for one in found] for found in (few, many))
        share = load_share(few)
        assert share.interval is not None  # these cells have coarser ones to be compared with
        low, high = share.interval
        widths.append(high - low)
        one_more += sum(low <= other <= high for other in others)
        all_others += len(others)
        mean += low <= float(np.mean(others)) <= high
        off = float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
        of_mean += abs(float(np.mean(shares)) - float(np.mean(others))) <= 1.9432 * off
    yield f"\n## The interval of CLR over a jump's positions, {SEEDS} surfaces on 96 x 32 cells\n"
    yield "| what it should hold | how often it does [%] | asked [%] |"
    yield "|---|---|---|"
    yield (
        f"| CLR at a further position (`clr_low`, `clr_high`) | {100 * one_more / all_others:.0f} |"
        " 90 |"
    )
    yield f"| the mean of {MANY} positions, by the same | {100 * mean / SEEDS:.0f} | 90 or more |"
    yield (
        f"| the mean of {MANY} positions, by `clr_mean_low`, `clr_mean_high` |"
        f" {100 * of_mean / SEEDS:.0f} | 90 |"
    )
    yield f"\nThe interval is {np.mean(widths):.3f} wide on average.\n"


LASTING = {
    "0.5 um": 3e-15,
    "1 um": 6e-15,
    "2 um": 9e-15,
}  # k of the ring times hours [h/Pa], to the plateau
CLOCKS = (
    1e-16,
    3e-17,
    3e-16,
)  # k of the ring [1/Pa]; those but the first so far as tells that they are clocks
PLATEAUS = tuple(
    (sq, k, (lasting if k == CLOCKS[0] else min(LASTING.values()) / 3.0) / k)
    for k in CLOCKS
    for sq, lasting in LASTING.items()
)
TIMES_K = (0.0, 3e-16, 1e-15, 3e-15, 6e-15, 9e-15)  # at which a plateau's curves are told


def plateau_plan(sq: str, k: float, hours: float) -> Plan:
    overrides: Overrides = {
        "surface.sq": sq,
        "surface.correlation_length": "30 um",
        "wear.k": coefficients(k),
        "grid.cells": [32, 32],
        "wear.patches": 4,
    }
    return Plan(f"plateau-{sq.replace(' ', '')}-{k:g}", hours, overrides)


def plateau(shelf: Shelf) -> Iterator[str]:
    """Removal alone, as long in k times time."""
    keys = ("sq_m", "ssk", "spk_m", "svk_m", "clr", "h_mean_m")
    yield (
        "\n## Removal alone: three roughnesses, three coefficients (32 x 32 cells, correlation"
        " length 30 um)\n"
    )
    yield f"| sq | k of the ring [1/Pa] | hours | k times hours | {heads(*keys)} | jumps |"
    yield f"|---|---|---|---|{'---|' * len(keys)}---|"
    done = {
        plan.name: history
        for plan, history, _ in shelf.all([plateau_plan(*one) for one in PLATEAUS])
    }
    for sq, k, hours in PLATEAUS:
        if (history := done.get(plateau_plan(sq, k, hours).name)) is None:
            continue
        for turned in TIMES_K:
            if turned <= k * hours * (1.0 + 1e-9):
                moment = history.values_at(min(turned / k, hours))
                numbers = f"{turned / k:g} | {turned:g} | {told(moment, *keys)}"
                yield f"| {sq} | {k:g} | {numbers} | {len(history.table) - 1} |"
    if done:
        draw_plateaus(done)


def measured(shelf: Shelf) -> Iterator[str]:
    """A measured surface: parameters as reported, and as SurfaceTopography finds them in the
    written files.
    """
    if not MEASURED.is_file():
        yield f"\n{MEASURED.name} is not at hand.\n"
        return
    keys = ("sq_m", "ssk", "spk_m", "svk_m")
    surface = {"file": os.path.relpath(MEASURED, EXAMPLE.parent), "fit": "tile"}
    yield "\n## A measured surface, 3 h at 128 x 128 cells\n"
    yield (
        f"| {MEASURED.name} | {heads(*keys)} | Sq by SurfaceTopography [µm] | Ssk from its"
        " heights |"
    )
    yield f"|---|{'---|' * len(keys)}---|---|"
    for _, history, _ in shelf.all(
        [Plan("measured", 3.0, {"surface": surface, "grid.cells": [128, 128]})]
    ):
        for name, when in ((-2, "new"), (-1, "after")):
            line = history.table.iloc[0 if when == "new" else -1]
            theirs = surface_topography().open_topography(str(history.files[name])).topography()
            heights = theirs.heights() - np.mean(theirs.heights())
            sq = float(theirs.rms_height_from_area())
            numbers = " | ".join(
                f"{quantity(key).factor * line[body_column(key, 1)]:.6g}" for key in keys
            )
            yield f"| {when} | {numbers} | {1e6 * sq:.6g} | {np.mean(heights**3) / sq**3:.6g} |"
        yield f"\nIn {len(history.table) - 1} jumps.\n"


def rings(shelf: Shelf) -> Iterator[str]:
    keys = ("sq_m", "clr", "crf_hz", "worn_depth_2_m")
    yield "\n## The paper's first ring for ten hours, removal alone: 0.87 um are printed then\n"
    yield f"| k of the ring [1/Pa] | {heads(*keys)} |"
    yield "|---|---|---|---|---|"
    most = 1e-15
    for _, history, _ in shelf.all([Plan("ring", 1.0, {**PAPERS, "wear.k": coefficients(most)})]):
        new = history.values_at(0.0)
        for k in (1e-18, 1e-17, 1e-16):  # the same history, as k is its clock
            then = history.values_at(10.0 * k / most)
            yield (
                f"| {k:g} |"
                f" {' | '.join(f'{told(new, key)} to {told(then, key)}' for key in keys)} |"
            )


PAPERS: Overrides = {
    "surface.sq": "0.54 um",
    "grid.cells": [64, 32],
    "grid.x": [-3.0, 1.6],
    "wear.patches": 5,
}


def debris_rings(shelf: Shelf) -> Iterator[str]:
    """The first ring in dirty oil, for ten hours, of three seeds: 0.87 um are printed then."""
    keys = ("sq_1_m", "sq_2_m", "clr", "crf_hz")
    marks: Overrides = {"law": "debris", "concentration": "1.74e10 1/m^3", "sinking": 0.2}
    yield (
        "\n## The paper's first ring in dirty oil (code 21), three seeds: 0.54 to 0.87 um in ten"
        " hours are printed\n"
    )
    yield f"| seed | {heads(*keys)} | least of the ring |"
    yield "|---|---|---|---|---|---|"
    for seed in (7, 8, 9):
        overrides = PAPERS | {
            "surface.seed": seed,
            "wear.k": ["1e-18 1/Pa", "3e-17 1/Pa"],
            "wear.ploughing": marks,
        }
        for _, history, _ in shelf.all([Plan(f"debris-{seed}", 10.0, overrides)]):
            yield f"| {seed} | {row(history, *keys)} | {1e6 * history.table['sq_2_m'].min():.4g} |"


def falls_and_rises(shelf: Shelf) -> Iterator[str]:
    """Removal at once, and pits as soon as sums are full."""
    keys = ("sq_m", "sq_1_m", "sq_2_m", "spk_m", "svk_m", "ssk", "clr", "crf_hz")
    overrides: Overrides = {
        "grid.cells": [32, 32],
        "surface.correlation_length": "30 um",
        "wear.patches": 5,
        "wear.fatigue": {"law": "dang-van", "limit": "260 MPa"},
    }
    yield (
        "\n## Sq falls, then rises: removal, and pits by fatigue (260 MPa; 32 x 32 cells,"
        " correlation length 30 um)\n"
    )
    yield f"| hours | {heads(*keys)} |"
    yield f"|---|{'---|' * len(keys)}"
    for _, history, _ in shelf.all([Plan("falls-and-rises", RISEN, overrides)]):
        for hours in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0):
            if hours <= RISEN:
                moment = history.values_at(hours)
                yield f"| {hours:g} | {told(moment, *keys)} |"
        draw_rise(history)


COLOURS = {"0.5um": BLUE, "1um": GREEN, "2um": VERMILION}
STROKES = {1e-16: "-", 3e-17: "--", 3e-16: ":"}


@ON_PAGE.drawing()
def draw_plateaus(histories: Mapping[str, WearHistory]) -> None:
    """Parameters of both bodies and CLR over k times hours, a colour each Sq, a stroke each k."""
    figure = Figure(figsize=(ON_PAGE.double, 4.8))
    figure.subplots_adjust(left=0.075, right=0.985, top=0.97, bottom=0.18, wspace=0.32, hspace=0.32)
    keys = ("sq_m", "ssk", "spk_m", "svk_m", "clr", "h_mean_m")
    for axes, key in zip(figure.subplots(2, 3).ravel(), keys, strict=True):
        for name, history in histories.items():
            _, sq, k = name.split("-", 2)
            table = history.table
            axes.plot(
                1e16 * float(k) * table["hours"],
                quantity(key).factor * table[key],
                STROKES[float(k)],
                color=COLOURS[sq],
                linewidth=1.2,
                label=(
                    f"Sq {sq.removesuffix('um')} µm"
                    if float(k) == 1e-16 and key == "sq_m"
                    else None
                ),
            )
        axes.set(ylabel=quantity(key).label, xlabel="k times hours [1e-16 h/Pa]")
    figure.legend(loc="lower center", ncols=3)
    write_figure(figure, IMAGES / "wear-plateau.png")


@ON_PAGE.drawing()
def draw_rise(history: WearHistory) -> None:
    """Sq and CRF over hours, of removal beside fatigue."""
    figure = Figure(figsize=(ON_PAGE.double, 2.9))
    figure.subplots_adjust(left=0.075, right=0.985, top=0.96, bottom=0.17, wspace=0.22)
    left, right = figure.subplots(1, 2)
    table = history.table
    for key, name, colour in (
        ("sq_m", "both", BLUE),
        ("sq_2_m", "ring", GREEN),
        ("sq_1_m", "roller", VERMILION),
    ):
        left.plot(table["hours"], 1e6 * table[key], color=colour, label=name)
    left.legend()
    left.set(xlabel=quantity("hours").axis, ylabel=quantity("sq_m").label)
    ends = (table[key] for key in ("crf_mean_low_hz", "crf_mean_high_hz"))
    right.fill_between(table["hours"], *ends, color=BLUE, alpha=0.25, linewidth=0)
    right.plot(table["hours"], table["crf_hz"], color=BLUE)
    for end in CRF_ENDS_HZ:
        right.axhline(end, color=VERMILION, linestyle=DASHED, linewidth=0.9)
    right.set(xlabel=quantity("hours").axis, ylabel=quantity("crf_hz").label, ylim=(2000.0, 4000.0))
    write_figure(figure, IMAGES / "wear-falls-and-rises.png")


def lines(*, fast: bool, seconds: float) -> Iterator[str]:
    """The same tables in the same order at any length: docs/theory/wear.md includes them by
    number.
    """
    shelf = Shelf(min(seconds, SHORT_S) if fast else seconds)
    checks = [*intervals(), *kills()]  # first, as they do not go on another time
    for part in (speed, plateau, falls_and_rises, debris_rings, rings, jumps, grids, measured):
        yield from part(shelf)
    yield from checks
    yield f"Sample: {shelf.made} histories."
    if shelf.left:
        yield (
            "\nNot at their end for want of time; the same command goes on with them:"
            f" {', '.join(shelf.left)}.\n"
        )
