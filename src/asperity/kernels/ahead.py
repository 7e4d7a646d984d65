"""Compilation of a rough contact's kernels before its first solve, on two processors.

One process goes through the list of kernels from its start, another from its end, until they meet:
what one has compiled, the other loads from the cache.
"""

import subprocess
import sys
from collections.abc import Callable
from importlib import import_module

import numpy as np

from asperity.core.arrays import Field
from asperity.core.processes import cores
from asperity.kernels.compiled import compile_for, is_cached, is_compiled
from asperity.kernels.line_relaxation import LineFactors
from asperity.kernels.load_sharing import CellState, ContactBounds
from asperity.kernels.reynolds import Faces, Film, Liquid, PressureChange, Rows
from asperity.kernels.stencils import OuterNeighbours, Stencil
from asperity.kernels.step_limits import StepBounds

Call = tuple[Callable[..., object], tuple[object, ...]]  # a kernel, and arguments of its types
BACKWARDS = "from asperity.kernels.ahead import calls, compile_calls; compile_calls(calls()[::-1])"
# Kernels of a rough contact on a usual grid with the types of their arguments, as in `_samples`;
# both precisions of a kernel in succession, since two processes do not store one kernel at a time.
KERNELS = """
reynolds.jacobian_product rows film faces d change pair x d
reynolds.jacobian_product rows_s film_s faces_s s change_s pair x s
reynolds.fill_film liquid d x pair film
face_mobilities.face_mobilities film d n mask_line faces
reynolds.net_outflow d d faces line x x d
reynolds.fluid_diagonal film faces line x x d
reynolds.limited_outflow d d d x d
reynolds.limited_outflow s s s x s
load_sharing.outflow_by_pressure film faces x x x d
load_sharing.mark_opening state bounds mask
load_sharing.fill_contact_rows state bounds mask mask codes d mask
load_sharing.mark_sealed state bounds codes mask d mask
load_sharing.fill_oil_rows state bounds d d codes
load_sharing.fix_film_gap mask film
load_sharing.extend_lubrication d x codes mask_line d_pair codes d
load_sharing.limiter d d d x x d
load_sharing.limiter_slopes d d d s s
load_sharing.limiter_slopes d d d d d
shear_stress.march_shear_stress d d d d x d
reynolds.convert_precision s d x
reynolds.convert_precision d d x
step_limits.limit_steps d d step_bounds d d d
line_relaxation.aggregate_stencil stencil_s s cells stencil
line_relaxation.factor_lines stencil_s outer n x factors
line_relaxation.restrict s s cells d
line_relaxation.prolong d s cells s
stencils.own_stencil rows_s film_s faces_s s x pair stencil_s
line_relaxation.relax_zebra stencil_s outer factors factors s s
"""


def calls() -> list[Call]:
    """Return the kernels, each with arguments of the types that a rough contact gives it."""
    samples, found = _samples(), []
    for line in KERNELS.split("\n")[1:-1]:
        name, *arguments = line.split()
        module, _, kernel = name.partition(".")
        given = tuple(samples[argument] for argument in arguments)
        found.append((getattr(import_module(f"asperity.kernels.{module}"), kernel), given))
    return found


def _samples() -> dict[str, object]:
    """Return an argument of each type: d and s are arrays in double and single precision."""
    d, s, codes = np.empty((1, 1)), np.empty((1, 1), np.float32), np.empty((1, 1), np.int8)
    samples = {"d": d, "line": d[0], "d_pair": (d, d), "mask": d > 0.0, "mask_line": d[0] > 0.0}
    samples |= {"s": s, "codes": codes, "x": 1.0, "n": 1, "pair": (1.0, 1.0), "cells": (1, 1)}
    for a, end in ((d, ""), (s, "_s")):
        samples |= {f"film{end}": Film._make([a] * 8), f"rows{end}": Rows(codes, a, 1.0)}
        samples |= {f"faces{end}": _faces(a), f"change{end}": PressureChange(a, a)}
        samples[f"stencil{end}"] = Stencil._make([a] * 5)
    samples |= {"liquid": Liquid._make([d] * 6), "state": CellState._make([d] * 6)}
    samples |= {
        "bounds": ContactBounds(1.0, 1.0, 1.0, 1.0),
        "step_bounds": StepBounds(1.0, 1.0, True),
    }
    return samples | {"outer": OuterNeighbours(s, s), "factors": LineFactors._make([s] * 7)}


def _faces(a: Field) -> Faces:
    return Faces._make([*[a] * 6, a[0], a[0], *[a] * 4, 1])


def compile_calls(to_compile: list[Call], report: Callable[[int, int], None] | None = None) -> None:
    """Compile kernels in turn, or load them from the cache."""
    for number, (kernel, arguments) in enumerate(to_compile):
        if report is not None:
            report(number, len(to_compile))
        compile_for(kernel, arguments)


def compile_ahead(report: Callable[[int, int], None]) -> None:
    """Compile all kernels; `report` gets their number and total.

    Do nothing if one is stored, or where none can be stored for later processes.
    """
    to_compile = calls()
    kernels = [kernel for kernel, _ in to_compile]
    if any(map(is_compiled, kernels)) or not all(map(is_cached, kernels)):
        return
    if cores() < 2:
        compile_calls(to_compile, report)
        return
    helper = subprocess.Popen(
        [sys.executable, "-c", f"import sys; sys.path[:] = sys.argv[1:]; {BACKWARDS}", *sys.path],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        compile_calls(to_compile, report)
    finally:
        helper.kill()
        helper.wait()
