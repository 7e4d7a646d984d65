"""Wear histories: time, kills, effect of jump, grid and positions, coverage, plateaus, rings.

Histories are stored in build/wearing and resume where they were stopped as long as the wear code is
the same: each call does as much as its time allows and reports the unfinished ones.
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
from asperity.wear import positions, surfaces_at
from benchmarks.unfinished import stamp

ROOT = Path(__file__).parents[1]
KEPT = ROOT / "build" / "wearing"
PACKAGES = (  # that determine a history
    "wear",
    "ehl",
    "solution",
    "contact",
    "kernels",
    "surface",
    "lubricant",
)
MODULES = ("jump", "run", "contact", "reach", "state", "tracks")  # likewise, of simulation.wear
IMAGES = ROOT / "docs" / "images"
EXAMPLE = ROOT / "examples" / "wear.toml"
MEASURED = ROOT.parent / "shared" / "data" / "surfaces" / "milled_1.opd"
KILLS = 10
COARSE = ("grid.cells=[32,32]", 'surface.correlation_length="30 um"', "wear.patches=4")
KILLED = {  # killed histories: hours, and changes from the example
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
END_POSITIONS = 14  # positions that are evaluated at the end of each compared history
SHORT_S = 240.0  # time of a short run
HISTORY_TIME_SHARE = 0.85  # share of a part's time spent on histories
MANY = 14  # positions whose mean represents the true mean
SEEDS = 20
RISE_HOURS = 12.0  # hours until pits have restored the roughness that removal smoothed

Overrides = dict[str, object]


class OutOfTime(Exception):
    """A history that remains unfinished in this call."""


class Plan(NamedTuple):
    """A planned history: name of its folder, hours, and changes from the example."""

    name: str
    hours: float
    overrides: Overrides

    @property
    def folder(self) -> str:
        """Name of the folder, unique for each case."""
        identity = json.dumps([self.hours, self.overrides], sort_keys=True)
        return f"{self.name}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"


class Store:
    """Stored histories, and the time to resume them."""

    def __init__(self, seconds: float) -> None:
        self.end = time.perf_counter() + HISTORY_TIME_SHARE * seconds
        self.folder = KEPT / stamp(*PACKAGES, *(f"simulation/wear/{name}" for name in MODULES))
        self.left: list[str] = []
        self.made = 0

    def worn(self, plan: Plan) -> tuple[WearHistory, float] | None:
        """Return a history and its total CPU time; None if the time runs out."""
        folder = self.folder / plan.folder
        clock, ended = (self.folder / f"{plan.folder}.{kind}" for kind in ("json", "ended"))
        if time.perf_counter() > self.end and not ended.is_file():
            self.left.append(plan.name)
            return None
        began = time.process_time()
        spent = float(json.loads(clock.read_text("utf-8"))) if clock.is_file() else 0.0

        def progress(_: WearProgress) -> None:
            clock.write_text(json.dumps(spent + time.process_time() - began), "utf-8")
            if time.perf_counter() > self.end:
                raise OutOfTime

        self.folder.mkdir(parents=True, exist_ok=True)
        try:
            history = run_wear(
                case(plan.overrides), hours=plan.hours, out=folder, progress=progress
            )
        except OutOfTime:
            self.left.append(plan.name)
            return None
        ended.touch()
        return history, float(json.loads(clock.read_text("utf-8")))

    def all(self, plans: Sequence[Plan]) -> Iterator[tuple[Plan, WearHistory, float]]:
        """Yield the histories that are stored or that the time allows."""
        for plan in plans:
            if (made := self.worn(plan)) is not None:
                self.made += 1
                yield plan, *made


def case(overrides: Overrides) -> Case:
    return load_case(EXAMPLE).with_overrides(overrides)


def coefficients(k: float) -> list[str]:
    """Return the wear coefficients of roller and ring; the roller is over-rolled more often."""
    return [f"{k / 20.0!r} 1/Pa", f"{k!r} 1/Pa"]


def heads(*keys: str) -> str:
    """Return headings of columns, with display units, as cells of a table."""
    return " | ".join(quantity(key).label for key in keys)


def shown(moment: Mapping[str, float], *keys: str) -> str:
    """Format quantities of one time as cells of a table."""
    return " | ".join(f"{quantity(key).factor * moment[key]:.4g}" for key in keys)


def row(history: WearHistory, *keys: str) -> str:
    """Format first and last values of columns as cells of a table."""
    first, last = history.table.iloc[0], history.table.iloc[-1]
    return " | ".join(f"{shown(first, key)} to {shown(last, key)}" for key in keys)


def solved_at(history: WearHistory, count: int, seed: int) -> list[SolvedPosition]:
    """Solve the contact at the end of a history at `count` positions."""
    ageing: WearingContact = history.contact
    surfaces = history.final_surfaces
    cells = (surfaces.first.grid.cells[0], surfaces.second.grid.cells[0])
    places = positions(cells, ageing.surfaces.rough, count, 0, seed)
    solutions = (ageing.solver(surfaces_at(surfaces, place)) for place in places)
    return [solution for solution in solutions if isinstance(solution, SolvedPosition)]


def end_mean(history: WearHistory) -> str:
    """Return mean CLR and standard error at the end, over more positions than a jump solves."""
    clr = 100.0 * np.array([solved.state.clr for solved in solved_at(history, END_POSITIONS, 99)])
    return f"{np.mean(clr):.2f} ± {np.std(clr, ddof=1) / np.sqrt(len(clr)):.1f}"


def speed(store: Store) -> Iterator[str]:
    yield "\n## 1e7 over-rollings of the roller at 128 x 128 cells\n"
    yield (
        "| hours | jumps | positions | CPU time [s] | per jump [s] | by two processes [s] | "
        f"{heads('sq_m', 'clr')} | volume error | jump error |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    whole = 1e7 / 56.25 / 3600.0
    fast: Overrides = {"grid.cells": [128, 128], "wear.patches": 4, "wear.step": 0.1}
    for _, history, seconds in store.all([Plan("speed", whole, fast)]):
        jumps, patches = len(history.table) - 1, history.contact.patches
        busier_share = -(-patches // 2) / patches  # of a jump's positions, for two processes
        yield (
            f"| {history.hours:.1f} | {jumps} | {patches} | {seconds:.0f} | {seconds / jumps:.2f} |"
            f" {seconds * busier_share:.0f} | {row(history, 'sq_m', 'clr')} |"
            f" {history.volume_error:.1e} | {history.worn.error:.1e} |"
        )


def kills() -> Iterator[str]:
    yield "\n## Histories killed at random times\n"
    yield "| history | jumps | kills | numbers and surfaces |"
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
        outcome = "identical to the last bit" if same else "DIFFERENT"
        yield f"| {name} | {len(whole.table) - 1} | {times} | {outcome} |"


def _killed(
    folder: Path, hours: float, overrides: Sequence[str]
) -> tuple[int, WearHistory, WearHistory]:
    """Run a history undisturbed and another that is killed and resumed.

    Returns the number of kills during the run, and both histories.
    """
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
    undisturbed, killed = (load_wear(folder / name) for name in ("whole", "killed"))
    return times, undisturbed, killed


def jumps(store: Store) -> Iterator[str]:
    yield "\n## Effect of jump length and number of positions, 2 h\n"
    yield (
        f"| cells | step | positions | jumps | {heads('sq_m', 'spk_m', 'clr')} of"
        f" {END_POSITIONS} positions | seconds |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    settings = [(64, 0.1, 7), (64, 0.05, 7), (64, 0.025, 7), (64, 0.05, 4), (64, 0.05, 14)]
    plans = [
        Plan(
            f"jumps-{cells}-{step}-{count}",
            2.0,
            {"grid.cells": [cells] * 2, "wear.step": step, "wear.patches": count},
        )
        for cells, step, count in settings
    ]
    for plan, history, seconds in store.all(plans):
        _, cells, step, count = plan.name.split("-")
        last = history.table.iloc[-1]
        yield (
            f"| {cells} | {step} | {count} | {len(history.table) - 1} | {1e6 * last['sq_m']:.5f} | "
            f"{1e6 * last['spk_m']:.4f} | {end_mean(history)} | {seconds:.0f} |"
        )


def grids(store: Store) -> Iterator[str]:
    keys = ("clr", "sq_m", "spk_m", "worn_depth_2_m")
    yield "\n## Effect of the grid, 1 h\n"
    yield (
        f"| cells | {heads(*keys)} | {heads('clr')} of {END_POSITIONS} positions | jumps |"
        " CPU time [s] |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    plans = [Plan(f"grid-{cells}", 1.0, {"grid.cells": [cells] * 2}) for cells in (64, 128, 256)]
    for plan, history, seconds in store.all(plans):
        count = len(history.table) - 1
        cells = plan.name.removeprefix("grid-")
        yield f"| {cells} | {row(history, *keys)} | {end_mean(history)} | {count} | {seconds:.0f} |"


def intervals() -> Iterator[str]:
    """Measure the coverage of the interval over a jump's positions on new surfaces."""
    covered, mean, of_mean, widths, all_others = 0, 0, 0, [], 0
    for seed in range(SEEDS):
        new = run_wear(case({"surface.seed": seed, "grid.cells": [96, 32]}), hours=1e-9)
        few, many = solved_at(new, new.contact.patches, seed), solved_at(new, MANY, 1000 + seed)
        shares, others = ([solved.state.clr for solved in group] for group in (few, many))
        share = load_share(few)
        assert share.interval is not None  # a coarser grid exists for these cells
        low, high = share.interval
        widths.append(high - low)
        covered += sum(low <= other <= high for other in others)
        all_others += len(others)
        mean += low <= float(np.mean(others)) <= high
        off = float(np.std(shares, ddof=1)) / np.sqrt(len(shares))
        of_mean += abs(float(np.mean(shares)) - float(np.mean(others))) <= 1.9432 * off
    yield (
        f"\n## Coverage of the CLR interval over a jump's positions, {SEEDS} surfaces, 96 x 32"
        " cells\n"
    )
    yield "| quantity | covered [%] | nominal [%] |"
    yield "|---|---|---|"
    yield (
        f"| CLR at a further position (`clr_low`, `clr_high`) | {100 * covered / all_others:.0f} |"
        " 90 |"
    )
    yield (
        f"| mean of {MANY} positions (`clr_low`, `clr_high`) | {100 * mean / SEEDS:.0f} | 90 or"
        " more |"
    )
    yield (
        f"| mean of {MANY} positions (`clr_mean_low`, `clr_mean_high`) |"
        f" {100 * of_mean / SEEDS:.0f} | 90 |"
    )
    yield f"\nMean width of the interval: {np.mean(widths):.3f}.\n"


PLATEAU_EXTENT = {  # k of the ring times hours [h/Pa] until the plateau
    "0.5 um": 3e-15,
    "1 um": 6e-15,
    "2 um": 9e-15,
}
COEFFICIENTS = (1e-16, 3e-17, 3e-16)  # k of the ring [1/Pa]; all but the first run a short time
PLATEAUS = tuple(
    (sq, k, (extent if k == COEFFICIENTS[0] else min(PLATEAU_EXTENT.values()) / 3.0) / k)
    for k in COEFFICIENTS
    for sq, extent in PLATEAU_EXTENT.items()
)
TIMES_K = (0.0, 3e-16, 1e-15, 3e-15, 6e-15, 9e-15)  # k times hours in the table


def plateau_plan(sq: str, k: float, hours: float) -> Plan:
    overrides: Overrides = {
        "surface.sq": sq,
        "surface.correlation_length": "30 um",
        "wear.k": coefficients(k),
        "grid.cells": [32, 32],
        "wear.patches": 4,
    }
    return Plan(f"plateau-{sq.replace(' ', '')}-{k:g}", hours, overrides)


def plateau(store: Store) -> Iterator[str]:
    """Yield the wear by removal alone over k times time."""
    keys = ("sq_m", "ssk", "spk_m", "svk_m", "clr", "h_mean_m")
    yield (
        "\n## Removal alone: three roughnesses, three coefficients (32 x 32 cells, correlation"
        " length 30 um)\n"
    )
    yield f"| sq | k of the ring [1/Pa] | hours | k times hours | {heads(*keys)} | jumps |"
    yield f"|---|---|---|---|{'---|' * len(keys)}---|"
    done = {
        plan.name: history
        for plan, history, _ in store.all([plateau_plan(*settings) for settings in PLATEAUS])
    }
    for sq, k, hours in PLATEAUS:
        if (history := done.get(plateau_plan(sq, k, hours).name)) is None:
            continue
        for k_hours in TIMES_K:
            if k_hours <= k * hours * (1.0 + 1e-9):
                moment = history.values_at(min(k_hours / k, hours))
                numbers = f"{k_hours / k:g} | {k_hours:g} | {shown(moment, *keys)}"
                yield f"| {sq} | {k:g} | {numbers} | {len(history.table) - 1} |"
    if done:
        draw_plateaus(done)


def measured(store: Store) -> Iterator[str]:
    """Compare reported parameters of a measured surface with SurfaceTopography's."""
    if not MEASURED.is_file():
        yield f"\n{MEASURED.name} is not available.\n"
        return
    keys = ("sq_m", "ssk", "spk_m", "svk_m")
    surface = {"file": os.path.relpath(MEASURED, EXAMPLE.parent), "fit": "tile"}
    yield "\n## A measured surface, 3 h at 128 x 128 cells\n"
    yield (
        f"| {MEASURED.name} | {heads(*keys)} | Sq by SurfaceTopography [µm] | Ssk of its heights |"
    )
    yield f"|---|{'---|' * len(keys)}---|---|"
    for _, history, _ in store.all(
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
        yield f"\nJumps: {len(history.table) - 1}.\n"


def rings(store: Store) -> Iterator[str]:
    keys = ("sq_m", "clr", "crf_hz", "worn_depth_2_m")
    yield "\n## The paper's first ring after ten hours, removal alone (published: 0.87 um)\n"
    yield f"| k of the ring [1/Pa] | {heads(*keys)} |"
    yield "|---|---|---|---|---|"
    most = 1e-15
    for _, history, _ in store.all([Plan("ring", 1.0, {**PAPERS, "wear.k": coefficients(most)})]):
        new = history.values_at(0.0)
        for k in (1e-18, 1e-17, 1e-16):  # the same history, as wear depends on k times time
            end = history.values_at(10.0 * k / most)
            cells = (f"{shown(new, key)} to {shown(end, key)}" for key in keys)
            yield f"| {k:g} | {' | '.join(cells)} |"


PAPERS: Overrides = {
    "surface.sq": "0.54 um",
    "grid.cells": [64, 32],
    "grid.x": [-3.0, 1.6],
    "wear.patches": 5,
}


def debris_rings(store: Store) -> Iterator[str]:
    """Yield the first ring after ten hours in contaminated oil, for three seeds."""
    keys = ("sq_1_m", "sq_2_m", "clr", "crf_hz")
    marks: Overrides = {"law": "debris", "concentration": "1.74e10 1/m^3", "sinking": 0.2}
    yield (
        "\n## The paper's first ring in contaminated oil (code 21), ten hours, three seeds"
        " (published: 0.54 to 0.87 um)\n"
    )
    yield f"| seed | {heads(*keys)} | minimum Sq of the ring |"
    yield "|---|---|---|---|---|---|"
    for seed in (7, 8, 9):
        overrides = PAPERS | {
            "surface.seed": seed,
            "wear.k": ["1e-18 1/Pa", "3e-17 1/Pa"],
            "wear.ploughing": marks,
        }
        for _, history, _ in store.all([Plan(f"debris-{seed}", 10.0, overrides)]):
            yield f"| {seed} | {row(history, *keys)} | {1e6 * history.table['sq_2_m'].min():.4g} |"


def falls_and_rises(store: Store) -> Iterator[str]:
    """Yield Sq under removal from the start and pits once the fatigue sums are full."""
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
    for _, history, _ in store.all([Plan("falls-and-rises", RISE_HOURS, overrides)]):
        for hours in (0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0):
            if hours <= RISE_HOURS:
                moment = history.values_at(hours)
                yield f"| {hours:g} | {shown(moment, *keys)} |"
        draw_rise(history)


COLOURS = {"0.5um": BLUE, "1um": GREEN, "2um": VERMILION}
STROKES = {1e-16: "-", 3e-17: "--", 3e-16: ":"}


@ON_PAGE.drawing()
def draw_plateaus(histories: Mapping[str, WearHistory]) -> None:
    """Draw parameters and CLR over k times hours: one colour for each Sq, one stroke for each k."""
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
    """Draw Sq and CRF over hours, for removal with fatigue."""
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
    """Yield the tables, always in the same order: docs/theory/wear.md includes them by number."""
    store = Store(min(seconds, SHORT_S) if fast else seconds)
    checks = [*intervals(), *kills()]  # first, as these cannot be resumed
    for part in (speed, plateau, falls_and_rises, debris_rings, rings, jumps, grids, measured):
        yield from part(store)
    yield from checks
    yield f"Sample: {store.made} histories."
    if store.left:
        yield f"\nUnfinished; the same command resumes them: {', '.join(store.left)}.\n"
