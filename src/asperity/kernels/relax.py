"""Cheap approximate inverses of a five-point stencil: line relaxation along x and aggregation onto a coarse grid.

All lines are eliminated side by side, so that the innermost loop runs along the contiguous axis.
"""

from typing import NamedTuple

from numba import njit

from asperity.arrays import Field, Mask
from asperity.kernels.reynolds import Stencil


class Lines(NamedTuple):
    """Thomas factors of every x line: elimination factors and inverse pivots."""

    lower: Field
    inverse: Field


@njit(cache=True)
def factor_lines(stencil: Stencil, lines: Lines) -> None:
    """Eliminate all x lines of the stencil, in place of `lines`."""
    nx, ny = stencil.centre.shape
    for j in range(ny):
        lines.lower[0, j] = 0.0
        lines.inverse[0, j] = 1.0 / stencil.centre[0, j]
    for i in range(1, nx):
        for j in range(ny):
            factor = stencil.west[i, j] * lines.inverse[i - 1, j]
            lines.lower[i, j] = factor
            lines.inverse[i, j] = 1.0 / (stencil.centre[i, j] - factor * stencil.east[i - 1, j])


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def relax_lines(stencil: Stencil, lines: Lines, residual: Field, correction: Field, parity: int, work: Field) -> None:
    """Solve every second x line, starting with `parity`, the others held; in place of `correction`."""
    nx, ny = residual.shape
    north, south, east = stencil.north, stencil.south, stencil.east
    for i in range(nx):
        for j in range(parity, ny, 2):
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            value = residual[i, j] - north[i, j] * correction[i, jn] - south[i, j] * correction[i, js]
            if i > 0:
                value -= lines.lower[i, j] * work[i - 1, j]
            work[i, j] = value
    for j in range(parity, ny, 2):
        correction[nx - 1, j] = work[nx - 1, j] * lines.inverse[nx - 1, j]
    for i in range(nx - 2, -1, -1):
        for j in range(parity, ny, 2):
            correction[i, j] = (work[i, j] - east[i, j] * correction[i + 1, j]) * lines.inverse[i, j]


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def stencil_residual(stencil: Stencil, residual: Field, correction: Field, out: Field) -> None:
    """What the stencil leaves of `residual` after `correction`."""
    nx, ny = residual.shape
    for i in range(nx):
        for j in range(ny):
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            value = residual[i, j] - stencil.centre[i, j] * correction[i, j]
            value -= stencil.north[i, j] * correction[i, jn] + stencil.south[i, j] * correction[i, js]
            if i > 0:
                value -= stencil.west[i, j] * correction[i - 1, j]
            if i < nx - 1:
                value -= stencil.east[i, j] * correction[i + 1, j]
            out[i, j] = value


@njit(cache=True)
def aggregate_stencil(stencil: Stencil, scale: Field, active: Mask, factor: int, out: Stencil) -> None:
    """Sum the unscaled rows of active cells over blocks of factor x factor; couplings to inactive cells are dropped."""
    nx, ny = active.shape
    out.centre[:] = 0.0
    out.west[:] = 0.0
    out.east[:] = 0.0
    out.north[:] = 0.0
    out.south[:] = 0.0
    for i in range(nx):
        for j in range(ny):
            if not active[i, j]:
                continue
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            ci, cj = i // factor, j // factor
            out.centre[ci, cj] += stencil.centre[i, j] * scale[i, j]
            if i > 0 and active[i - 1, j]:
                if (i - 1) // factor == ci:
                    out.centre[ci, cj] += stencil.west[i, j] * scale[i, j]
                else:
                    out.west[ci, cj] += stencil.west[i, j] * scale[i, j]
            if i < nx - 1 and active[i + 1, j]:
                if (i + 1) // factor == ci:
                    out.centre[ci, cj] += stencil.east[i, j] * scale[i, j]
                else:
                    out.east[ci, cj] += stencil.east[i, j] * scale[i, j]
            if active[i, jn]:
                if jn // factor == cj:
                    out.centre[ci, cj] += stencil.north[i, j] * scale[i, j]
                else:
                    out.north[ci, cj] += stencil.north[i, j] * scale[i, j]
            if active[i, js]:
                if js // factor == cj:
                    out.centre[ci, cj] += stencil.south[i, j] * scale[i, j]
                else:
                    out.south[ci, cj] += stencil.south[i, j] * scale[i, j]
    for ci in range(out.centre.shape[0]):
        for cj in range(out.centre.shape[1]):
            if out.centre[ci, cj] == 0.0:
                out.centre[ci, cj] = 1.0


@njit(cache=True)
def restrict(residual: Field, scale: Field, active: Mask, factor: int, out: Field) -> None:
    """Sum unscaled residuals of active cells over blocks."""
    out[:] = 0.0
    nx, ny = residual.shape
    for i in range(nx):
        for j in range(ny):
            if active[i, j]:
                out[i // factor, j // factor] += residual[i, j] * scale[i, j]


@njit(cache=True)
def prolong(coarse: Field, active: Mask, factor: int, out: Field) -> None:
    """Give every active cell its block's value, and zero to the others."""
    nx, ny = out.shape
    for i in range(nx):
        for j in range(ny):
            out[i, j] = coarse[i // factor, j // factor] if active[i, j] else 0.0
