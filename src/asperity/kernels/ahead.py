"""Compilation of a rough contact's kernels before its first solve, on two processors.

One process goes through the list of kernels from its start, another from its end, until they meet:
what one has compiled, the other loads from the cache.
"""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from asperity.core.processes import cores
from asperity.kernels import face_mobilities, line_relaxation, load_sharing, reynolds, stencils
from asperity.kernels.compiled import is_cached, is_compiled
from asperity.kernels.line_relaxation import LineFactors
from asperity.kernels.load_sharing import CellState, ContactBounds
from asperity.kernels.reynolds import Faces, Film, Liquid, PressureChange, Rows
from asperity.kernels.shear_stress import march_shear_stress
from asperity.kernels.stencils import OuterNeighbours, Stencil
from asperity.kernels.step_limits import StepBounds, limit_steps

Call = tuple[Any, tuple[Any, ...]]  # a kernel, and arguments of the types that it is called with
BACKWARDS = "from asperity.kernels.ahead import calls, compile_calls; compile_calls(calls()[::-1])"


def calls() -> list[Call]:
    """Return a call of every kernel that a rough contact on a usual grid needs."""
    d, s = np.empty((1, 1)), np.empty((1, 1), np.float32)
    mask, codes, pair, cells = d > 0.0, np.empty((1, 1), np.int8), (1.0, 1.0), (1, 1)
    x, line, shut = 1.0, d[0], (d > 0.0)[0]
    film, face, rows = ({kind: make(of) for kind, of in (("d", d), ("s", s))} for make in _MAKERS)
    state, bounds = CellState(*[d] * 6), ContactBounds(*[x] * 4)
    stencil, outer, factors = Stencil(*[s] * 5), OuterNeighbours(s, s), LineFactors(*[s] * 7)
    jacobian = {
        kind: (rows[kind], film[kind], face[kind], of, PressureChange(of, of), pair, x, of)
        for kind, of in (("d", d), ("s", s))
    }
    return [
        (reynolds.jacobian_product, jacobian["s"]),
        (reynolds.jacobian_product, jacobian["d"]),
        (reynolds.fill_film, (Liquid(*[d] * 6), d, x, pair, film["d"])),
        (face_mobilities.face_mobilities, (film["d"], d, 1, shut, face["d"])),
        (reynolds.net_outflow, (d, d, face["d"], line, x, x, d)),
        (reynolds.fluid_diagonal, (film["d"], face["d"], line, x, x, d)),
        (reynolds.limited_outflow, (d, d, d, x, d)),
        (reynolds.limited_outflow, (s, s, s, x, s)),
        (reynolds.convert_precision, (s, d, x)),
        (reynolds.convert_precision, (d, d, x)),
        (load_sharing.outflow_by_pressure, (film["d"], face["d"], x, x, x, d)),
        (load_sharing.mark_opening, (state, bounds, mask)),
        (load_sharing.fill_contact_rows, (state, bounds, mask, mask, codes, d, mask)),
        (load_sharing.mark_sealed, (state, bounds, codes, mask, d, mask)),
        (load_sharing.fill_oil_rows, (state, bounds, d, d, codes)),
        (load_sharing.fix_film_gap, (mask, film["d"])),
        (load_sharing.extend_lubrication, (d, x, codes, shut, (d, d), codes, d)),
        (load_sharing.limiter, (d, d, d, x, x, d)),
        (load_sharing.limiter_slopes, (d, d, d, s, s)),
        (load_sharing.limiter_slopes, (d, d, d, d, d)),
        (march_shear_stress, (d, d, d, d, x, d)),
        (limit_steps, (d, d, StepBounds(x, x, True), d, d, d)),
        (line_relaxation.aggregate_stencil, (stencil, s, cells, Stencil(*[d] * 5))),
        (line_relaxation.factor_lines, (stencil, outer, 1, x, factors)),
        (line_relaxation.restrict, (s, s, cells, d)),
        (line_relaxation.prolong, (d, s, cells, s)),
        (stencils.own_stencil, (rows["s"], film["s"], face["s"], s, x, pair, stencil)),
        (line_relaxation.relax_zebra, (stencil, outer, factors, factors, s, s)),
    ]


_MAKERS: tuple[Callable[[Any], Any], ...] = (
    lambda a: Film._make([a] * 8),
    lambda a: Faces._make([a] * 6 + [a[0]] * 2 + [a] * 4 + [1]),
    lambda a: Rows(np.empty((1, 1), np.int8), a, 1.0),
)


def compile_calls(to_compile: list[Call], report: Callable[[int, int], None] | None = None) -> None:
    """Compile kernels in turn, or load them from the cache."""
    for number, (kernel, arguments) in enumerate(to_compile):
        if report is not None:
            report(number, len(to_compile))
        kernel.compile(tuple(map(numba.typeof, arguments)))


def compile_ahead(report: Callable[[int, int], None]) -> None:
    """Compile all kernels if none is; do nothing where the cache is not writable.

    Called with the number of compiled kernels and their total.
    """
    to_compile = calls()
    kernels = [kernel for kernel, _ in to_compile]
    if cores() < 2 or not all(map(is_cached, kernels)) or any(map(is_compiled, kernels)):
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
