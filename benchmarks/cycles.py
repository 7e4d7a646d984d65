"""Time of a contact over a cycle of 329 angles, in which oil turns round twice, and its accuracy.

The paper's contact with its load, radius and speeds varied as by a cam with flat follower.
"""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from asperity.case import load_case
from asperity.contact.cycle import OperatingCycle
from asperity.simulation import CycleResult, solve_cycle

PAPER = Path(__file__).parents[1] / "examples" / "paper.toml"
ANGLES, PERIOD = 329, 0.03


def cam_like() -> OperatingCycle:
    """Return a cycle of 100 to 700 N, radii of 4 to 8 mm, entrainment from 2.9 to -0.16 m/s."""
    phase = np.linspace(0.0, 2.0 * np.pi, ANGLES)
    return OperatingCycle(
        times=phase / (2.0 * np.pi) * PERIOD,
        loads=400.0 + 300.0 * np.cos(phase),
        speeds=np.c_[2.0 + 3.0 * np.cos(phase), -0.2 + np.cos(2.0 * phase)],
        radii=0.006 + 0.002 * np.cos(phase),
    )


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` solves the rough contact at 4 instants in place of 12."""
    workers = min(2, os.cpu_count() or 1)
    begin, cpu = time.perf_counter(), os.times()
    result = solve_cycle(load_case(PAPER), cam_like(), instants=4 if fast else 12, workers=workers)
    spent = os.times()
    own = sum(spent[:2]) - sum(cpu[:2])
    children = sum(spent[2:4]) - sum(cpu[2:4])
    yield "## A cycle of 329 angles"
    yield "| quantity | value |"
    yield "|---|---|"
    yield from _rows(result)
    yield f"| processes | {workers} |"
    yield f"| by the clock [s] | {time.perf_counter() - begin:.0f} |"
    yield f"| CPU time of the films, of the rough contacts [s] | {own:.0f}, {children:.0f} |"


def _rows(result: CycleResult) -> Iterator[str]:
    clr = result.mean_clr
    yield f"| time steps of the film, not converged | {result.film.steps}, {result.film.failed} |"
    yield f"| largest relative load error | {result.film.load_error:.1e} |"
    yield f"| minimum film [µm] | {1e6 * result.thinnest[1]:.4f} |"
    yield f"| rough contacts, not solved | {len(result.instants)}, {len(result.failures)} |"
    if clr.value is not None and clr.low is not None and clr.high is not None:
        low, mean, high = (100.0 * share for share in (clr.low, clr.value, clr.high))
        yield f"| mean CLR [%] | {mean:.1f} ({low:.1f} to {high:.1f}) |"


if __name__ == "__main__":
    for line in lines(fast="--fast" in sys.argv):
        print(line)
