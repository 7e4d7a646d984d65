"""Stress peaks below sliding Hertz contacts on several grids, and the time to compute stress.

docs/theory/stress.md quotes the results.
"""

from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np

from asperity.case import load_case
from asperity.contact.grid import Grid
from asperity.results import solve_case
from asperity.solution import SubsurfaceStress, friction_and_heat, subsurface_stress
from asperity.solution.flash import moving_source
from asperity.solution.stress import stress_below
from asperity.solution.stress_influence import clear_kernels

EXAMPLES = Path(__file__).parents[1] / "examples"
FRICTIONS = (0.0, 0.1, 0.2, 0.3, 0.4)
NU = 0.3


def lines(*, fast: bool) -> Iterator[str]:
    """Yield the tables as Markdown."""
    yield "## Stress below the surface\n"
    yield (
        "Largest von Mises stress [p_h] and its depth [a] below sliding Hertz contacts, nu = 0.3:\n"
    )
    cells = (64, 128, 256) if fast else (64, 128, 256, 512)
    yield "| contact | f | " + " | ".join(f"{n} cells" for n in cells) + " |"
    yield "|---|---|" + "---|" * len(cells)
    for name, solve in (("line", _line), ("point", _point)):
        for friction in FRICTIONS:
            peaks = [solve(friction, n).peak for n in cells]
            shown = " | ".join(f"{peak.value:.4f} at {peak.depth:.3f}" for peak in peaks)
            yield f"| {name} | {friction:g} | {shown} |"
    yield "\nLargest shear stress without friction: " + ", ".join(
        f"{name} {peak.value:.4f} p_h at {peak.depth:.3f} a"
        for name, peak in (
            ("line", _line(0.0, 256).shear_peak),
            ("point", _point(0.0, 256).shear_peak),
        )
    )
    yield "\nCPU time [s] with new and with cached kernels:\n"
    yield (
        "| case | cells | solve | friction and heat, new | stress, new | friction and heat, cached"
        " | stress, cached |"
    )
    yield "|---|---|---|---|---|---|---|"
    for file, count in (("paper.toml", 256), ("ball-on-disc.toml", 256)):
        case = load_case(EXAMPLES / file).with_overrides(
            {"grid.cells": [count, count], "vibration": "none"}
        )
        solution = solve_case(case, strict=False).solution  # compiles the kernels
        friction_and_heat(solution)
        started = process_time()
        solution = solve_case(case, strict=False).solution
        times = [process_time() - started]
        moving_source.cache_clear()
        clear_kernels()
        for _ in range(2):
            started = process_time()
            rubbing = friction_and_heat(solution, thermal=case.thermal)[0]
            heated = process_time()
            subsurface_stress(solution, shear=rubbing.shear)
            times += [heated - started, process_time() - heated]
        yield (
            f"| {file} | {count} x {count} | "
            + " | ".join(f"{value:.2f}" for value in times)
            + " |"
        )


def _depths(spacing: float) -> np.ndarray:
    return np.concatenate([[0.0], np.geomspace(spacing / 2.0, 2.5, 15)])


def _line(friction: float, cells: int) -> SubsurfaceStress:
    grid = Grid((cells, 8), (-2.0, -2.0), (2.0, 2.0))
    pressure = np.repeat(np.sqrt(np.maximum(1.0 - grid.x**2, 0.0))[:, None], 8, axis=1)
    return stress_below(pressure, friction * pressure, grid, _depths(4.0 / cells), poisson_ratio=NU)


def _point(friction: float, cells: int) -> SubsurfaceStress:
    grid = Grid((cells, cells), (-2.0, -2.0), (2.0, 2.0), (False, False))
    pressure = np.sqrt(np.maximum(1.0 - grid.x[:, None] ** 2 - grid.y**2, 0.0))
    return stress_below(pressure, friction * pressure, grid, _depths(4.0 / cells), poisson_ratio=NU)
