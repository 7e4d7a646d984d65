"""Wear in time: what it takes, kills, what jumps, grids and patches do to it, plateaus, a measured surface, rings."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from asperity import load_case, run_wear
from asperity.ageing import WearHistory, load_wear
from asperity.case import Case

ROOT = Path(__file__).parents[1]
EXAMPLE = ROOT / "examples" / "wear.toml"
MEASURED = ROOT.parent / "shared" / "data" / "surfaces" / "milled_1.opd"
KILLS, HOURS_KILLED = 10, 3.0


def case(overrides: dict[str, object] | None = None) -> Case:
    return load_case(EXAMPLE).with_overrides(overrides or {})


def worn(hours: float, overrides: dict[str, object] | None = None) -> tuple[WearHistory, float]:
    """A history and the processor time that it took."""
    began = time.process_time()
    history = run_wear(case(overrides), hours=hours)
    return history, time.process_time() - began


def coefficients(k: float) -> list[str]:
    """Of the roller, which is over-rolled more often, and of the ring."""
    return [f"{k / 20.0!r} 1/Pa", f"{k!r} 1/Pa"]


def row(history: WearHistory, *keys: str) -> str:
    """First and last of some columns, as cells of a table."""
    first, last = history.table.iloc[0], history.table.iloc[-1]
    return " | ".join(f"{first[key]:.4g} to {last[key]:.4g}" for key in keys)


def speed() -> Iterator[str]:
    history, seconds = worn(1e7 / 56.25 / 3600.0, {"grid.cells": [128, 128]})
    yield "\n## 1e7 over-rollings of the roller at 128 x 128 cells\n"
    yield "| jumps | positions | processor time [s] | sq_m | clr | volume error | jump error |"
    yield "|---|---|---|---|---|---|---|"
    yield (
        f"| {len(history.table) - 1} | {history.ageing.patches} | {seconds:.0f} | {row(history, 'sq_m', 'clr')} | "
        f"{history.volume_error:.1e} | {history.worn.error:.1e} |"
    )


def kills() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "asperity", "wear", str(EXAMPLE), "--hours", f"{HOURS_KILLED:g}", "--quiet"]
        began = time.perf_counter()
        subprocess.run([*command, "--out", f"{folder}/whole"], check=True, stdout=subprocess.DEVNULL)
        whole, rng = time.perf_counter() - began, np.random.default_rng(11)
        for _ in range(KILLS):
            process = subprocess.Popen([*command, "--out", f"{folder}/killed"], stdout=subprocess.DEVNULL)
            time.sleep(rng.uniform(0.05, 0.6) * whole)
            process.send_signal(signal.SIGKILL)
            process.wait()
        subprocess.run([*command, "--out", f"{folder}/killed"], check=True, stdout=subprocess.DEVNULL)
        one, other = (load_wear(Path(folder) / name) for name in ("whole", "killed"))
        same = one.table.equals(other.table) and all(
            np.array_equal(getattr(one.after, body).heights, getattr(other.after, body).heights)
            for body in ("first", "second")
        )
    yield f"\nKilled {KILLS} times at random moments: {'the same to the last bit' if same else 'DIFFERENT'}.\n"


def halving(*, fast: bool) -> Iterator[str]:
    yield "\n## Half the jump\n"
    yield "| cells | quantity | jump | half of it | difference [%] | jumps | half of it |"
    yield "|---|---|---|---|---|---|---|"
    for cells in (64,) if fast else (64, 128):
        grid = {"grid.cells": [cells, cells]}
        whole, half = (worn(4.0, {**grid, "wear.step": step})[0] for step in (0.05, 0.025))
        for key in ("sq_m", "clr", "solid_load_ratio"):
            one, two = (float(history.table[key].iloc[-1]) for history in (whole, half))
            counts = f"{len(whole.table) - 1} | {len(half.table) - 1}"
            yield f"| {cells} | {key} | {one:.5g} | {two:.5g} | {100.0 * (two / one - 1.0):+.2f} | {counts} |"


def grids(*, fast: bool) -> Iterator[str]:
    keys = ("sq_m", "spk_m", "clr", "solid_load_ratio", "worn_depth_2_m")
    yield "\n## Grids, 2 h\n"
    yield f"| cells | {' | '.join(keys)} | jumps | processor time [s] |"
    yield "|---|---|---|---|---|---|---|---|"
    for cells in (64, 128) if fast else (64, 128, 256):
        history, seconds = worn(2.0, {"grid.cells": [cells, cells]})
        yield f"| {cells} | {row(history, *keys)} | {len(history.table) - 1} | {seconds:.0f} |"


def patches() -> Iterator[str]:
    keys = ("sq_m", "clr", "worn_depth_2_m")
    yield "\n## Positions a jump, 4 h\n"
    yield f"| positions | {' | '.join(keys)} |"
    yield "|---|---|---|---|"
    for count in (4, 7, 14, 28):
        yield f"| {count} | {row(worn(4.0, {'wear.patches': count})[0], *keys)} |"


def plateau(*, fast: bool) -> Iterator[str]:
    """Removal alone, as long in k times time."""
    keys = ("sq_m", "ssk", "spk_m", "svk_m")
    yield "\n## Removal alone: three roughnesses, three coefficients\n"
    yield f"| sq | k of the ring [1/Pa] | hours | {' | '.join(keys)} | clr at quarters of the time | jumps |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for sq in ("1 um",) if fast else ("0.5 um", "1 um", "2 um"):
        for k, hours in ((3e-17, 200.0), (1e-16, 60.0), (3e-16, 20.0)):
            history = worn(hours, {"surface.sq": sq, "wear.k": coefficients(k)})[0]
            shares = [history.at(quarter * hours)["clr"] for quarter in (0.0, 0.25, 0.5, 0.75, 1.0)]
            told = ", ".join(f"{clr:.3f}" for clr in shares)
            yield f"| {sq} | {k:g} | {hours:g} | {row(history, *keys)} | {told} | {len(history.table) - 1} |"


def measured() -> Iterator[str]:
    if not MEASURED.is_file():
        yield f"\n{MEASURED.name} is not at hand.\n"
        return
    keys = ("sq_m", "ssk", "spk_m", "svk_m", "clr")
    surface = {"file": os.path.relpath(MEASURED, EXAMPLE.parent), "fit": "tile"}
    yield "\n## A measured surface, 10 h\n"
    yield f"| file | {' | '.join(keys)} |"
    yield "|---|---|---|---|---|---|"
    yield f"| {MEASURED.name} | {row(worn(10.0, {'surface': surface})[0], *keys)} |"


def rings() -> Iterator[str]:
    keys = ("sq_m", "clr", "crf_hz", "worn_depth_2_m")
    yield "\n## The paper's first ring for ten hours: 0.87 um are printed then\n"
    yield f"| k of the ring [1/Pa] | {' | '.join(keys)} |"
    yield "|---|---|---|---|---|"
    for k in (1e-17, 1e-16, 1e-15):
        yield f"| {k:g} | {row(worn(10.0, {'surface.sq': '0.54 um', 'wear.k': coefficients(k)})[0], *keys)} |"


def lines(*, fast: bool) -> Iterator[str]:
    if not fast:
        yield from speed()
    yield from kills()
    yield from halving(fast=fast)
    yield from grids(fast=fast)
    yield from patches()
    yield from plateau(fast=fast)
    yield from measured()
    yield from rings()
