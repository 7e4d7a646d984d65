"""Approximate inverses of a stencil: line relaxation along x, and aggregation onto a coarse grid.

Every second x line is stored in its own arrays and all of them are eliminated together, so that the
innermost loop runs along a contiguous axis. Aggregation takes five-point stencils only. All arrays
of a call share one precision, which is also that of the arithmetic.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit
from asperity.kernels.stencils import OuterNeighbours, Stencil


class LineFactors(NamedTuple):
    """LU factors of every second x line of a stencil, and its couplings across; (nx, lines).

    `far_lower` and `far_east` belong to cells two away; shape (0, 0) for five-point stencils.
    """

    lower: Field
    inverse: Field
    east: Field
    north: Field
    south: Field
    far_lower: Field
    far_east: Field


@njit(cache=True)
def factor_lines(
    stencil: Stencil, far: OuterNeighbours, parity: int, least_pivot: float, lines: LineFactors
) -> None:
    """Factor every second x line, starting with `parity`, into `lines`.

    If the number of lines on the ring is odd, the first and the last are not coupled. A pivot below
    the share `least_pivot` of its row's entries along x is raised to it; 0 disables this.
    """
    seven_point = lines.far_east.size > 0
    nx, ny = stencil.centre.shape
    unity, least = stencil.centre.dtype.type(1.0), stencil.centre.dtype.type(least_pivot)
    count = lines.lower.shape[1]
    for i in range(nx):
        for k in range(count):
            j = 2 * k + parity
            lines.north[i, k] = stencil.north[i, j]
            lines.south[i, k] = stencil.south[i, j]
            lines.east[i, k] = stencil.east[i, j]
            pivot, west = stencil.centre[i, j], stencil.west[i, j]
            if seven_point:
                lines.far_east[i, k] = far.east[i, j]
                lines.far_lower[i, k] = 0.0
            if seven_point and i > 1:
                factor = far.west[i, j] * lines.inverse[i - 2, k]
                west -= factor * lines.east[i - 2, k]
                pivot -= factor * lines.far_east[i - 2, k]
                lines.far_lower[i, k] = factor
            if i > 0:
                factor = west * lines.inverse[i - 1, k]
                pivot -= factor * lines.east[i - 1, k]
                if seven_point:
                    lines.east[i, k] -= factor * lines.far_east[i - 1, k]
                lines.lower[i, k] = factor
            else:
                lines.lower[i, k] = 0.0
            if least > 0.0:
                row = abs(stencil.west[i, j]) + abs(stencil.centre[i, j]) + abs(stencil.east[i, j])
                pivot = max(pivot, least * row)
            lines.inverse[i, k] = unity / pivot
        if ny % 2 == 1 and parity == 0:
            lines.north[i, count - 1] = 0.0
            lines.south[i, 0] = 0.0


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def relax_lines(
    lines: LineFactors, parity: int, residual: Field, others: Field, change: Field
) -> None:
    """Solve every second x line for its residual, the lines between fixed at `others`."""
    nx, count = residual.shape
    other_lines, seven_point = others.shape[1], lines.far_east.size > 0
    for i in range(nx):
        for k in range(count):
            change[i, k] = residual[i, k]
        if other_lines > 0:
            if parity == 0:
                for k in range(min(count, other_lines)):
                    change[i, k] -= lines.north[i, k] * others[i, k]
                for k in range(1, count):
                    change[i, k] -= lines.south[i, k] * others[i, k - 1]
                change[i, 0] -= lines.south[i, 0] * others[i, other_lines - 1]
            else:
                for k in range(count):
                    change[i, k] -= lines.south[i, k] * others[i, k]
                for k in range(min(count, other_lines - 1)):
                    change[i, k] -= lines.north[i, k] * others[i, k + 1]
                if count == other_lines:
                    change[i, count - 1] -= lines.north[i, count - 1] * others[i, 0]
        if i > 0:
            for k in range(count):
                change[i, k] -= lines.lower[i, k] * change[i - 1, k]
        if seven_point and i > 1:
            for k in range(count):
                change[i, k] -= lines.far_lower[i, k] * change[i - 2, k]
    for k in range(count):
        change[nx - 1, k] *= lines.inverse[nx - 1, k]
    for i in range(nx - 2, -1, -1):
        if seven_point and i < nx - 2:
            for k in range(count):
                change[i, k] -= lines.far_east[i, k] * change[i + 2, k]
        for k in range(count):
            change[i, k] = (change[i, k] - lines.east[i, k] * change[i + 1, k]) * lines.inverse[
                i, k
            ]


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def split_residual(
    stencil: Stencil,
    far: OuterNeighbours,
    residual: Field,
    correction: Field,
    even: Field,
    odd: Field,
) -> None:
    """Fill `even` and `odd` lines with the residual that remains after `correction`."""
    nx, ny = residual.shape
    left = np.empty(ny, residual.dtype)
    last, seven_point = ny - 1, far.west.size > 0
    for i in range(nx):
        for j in range(ny):
            left[j] = residual[i, j] - stencil.centre[i, j] * correction[i, j]
        for j in range(last):
            left[j] -= stencil.north[i, j] * correction[i, j + 1]
        for j in range(1, ny):
            left[j] -= stencil.south[i, j] * correction[i, j - 1]
        left[last] -= stencil.north[i, last] * correction[i, 0]
        left[0] -= stencil.south[i, 0] * correction[i, last]
        if i > 0:
            for j in range(ny):
                left[j] -= stencil.west[i, j] * correction[i - 1, j]
        if i < nx - 1:
            for j in range(ny):
                left[j] -= stencil.east[i, j] * correction[i + 1, j]
        if seven_point and i > 1:
            for j in range(ny):
                left[j] -= far.west[i, j] * correction[i - 2, j]
        if seven_point and i < nx - 2:
            for j in range(ny):
                left[j] -= far.east[i, j] * correction[i + 2, j]
        for k in range(odd.shape[1]):
            even[i, k] = left[2 * k]
            odd[i, k] = left[2 * k + 1]
        if ny % 2 == 1:
            even[i, ny // 2] = left[last]


@njit(cache=True)
def relax_zebra(
    stencil: Stencil,
    far: OuterNeighbours,
    even: LineFactors,
    odd: LineFactors,
    residual: Field,
    change: Field,
) -> None:
    """Improve `change` in place by zebra line relaxation: even, odd and even lines in turn."""
    nx, kind = residual.shape[0], residual.dtype
    even_lines, odd_lines = even.lower.shape[1], odd.lower.shape[1]
    rest_even, rest_odd = np.empty((nx, even_lines), kind), np.empty((nx, odd_lines), kind)
    by_even, by_odd = np.empty((nx, even_lines), kind), np.empty((nx, odd_lines), kind)
    split_residual(stencil, far, residual, change, rest_even, rest_odd)
    relax_lines(even, 0, rest_even, np.empty((nx, 0), kind), by_even)
    relax_lines(odd, 1, rest_odd, by_even, by_odd)
    relax_lines(even, 0, rest_even, by_odd, by_even)
    add_lines(by_even, by_odd, change)


@njit(cache=True)
def add_lines(even: Field, odd: Field, out: Field) -> None:
    """Add even and odd x lines to the field they were split from."""
    nx, ny = out.shape
    for i in range(nx):
        for k in range(odd.shape[1]):
            out[i, 2 * k] += even[i, k]
            out[i, 2 * k + 1] += odd[i, k]
        if ny % 2 == 1:
            out[i, ny - 1] += even[i, ny // 2]


@njit(cache=True)
def aggregate_stencil(
    stencil: Stencil, weight: Field, block: tuple[int, int], out: Stencil
) -> None:
    """Sum the rows, times `weight`, over blocks of cells.

    Cells without weight and couplings to them are left out; a block without weight gets an identity
    row.
    """
    nx, ny = weight.shape
    cx, cy = out.centre.shape
    west, east = np.zeros(ny, weight.dtype), np.zeros(ny, weight.dtype)
    north, south = np.empty(ny, weight.dtype), np.empty(ny, weight.dtype)
    nothing = weight.dtype.type(0.0)
    for part in out:
        part[:] = 0.0
    for i in range(nx):
        ci = i // block[0]
        inside_west, inside_east = i > ci * block[0], i + 1 < (ci + 1) * block[0]
        if i > 0:
            for j in range(ny):
                west[j] = (
                    stencil.west[i, j] * weight[i, j] if weight[i - 1, j] > nothing else nothing
                )
        if i < nx - 1:
            for j in range(ny):
                east[j] = (
                    stencil.east[i, j] * weight[i, j] if weight[i + 1, j] > nothing else nothing
                )
        else:
            east[:] = nothing
        for j in range(ny):
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            north[j] = stencil.north[i, j] * weight[i, j] if weight[i, jn] > nothing else nothing
            south[j] = stencil.south[i, j] * weight[i, j] if weight[i, js] > nothing else nothing
        for cj in range(cy):
            first, end = cj * block[1], min((cj + 1) * block[1], ny)
            own, to_west, to_east = 0.0, 0.0, 0.0
            for j in range(first, end):
                own += stencil.centre[i, j] * weight[i, j]
                to_west += west[j]
                to_east += east[j]
            for j in range(first, end - 1):
                own += north[j]
            for j in range(first + 1, end):
                own += south[j]
            if inside_west:
                own += to_west
            else:
                out.west[ci, cj] += to_west
            if inside_east:
                own += to_east
            else:
                out.east[ci, cj] += to_east
            if cy > 1:
                out.north[ci, cj] += north[end - 1]
                out.south[ci, cj] += south[first]
            else:
                own += north[end - 1] + south[first]
            out.centre[ci, cj] += own
    for ci in range(cx):
        for cj in range(cy):
            if out.centre[ci, cj] == 0.0:
                out.centre[ci, cj] = 1.0


@njit(cache=True)
def restrict(residual: Field, weight: Field, block: tuple[int, int], out: Field) -> None:
    """Sum residuals, times `weight`, over blocks."""
    nx, ny = residual.shape
    out[:] = 0.0
    for i in range(nx):
        ci = i // block[0]
        for cj in range(out.shape[1]):
            total = 0.0
            for j in range(cj * block[1], min((cj + 1) * block[1], ny)):
                total += residual[i, j] * weight[i, j]
            out[ci, cj] += total


@njit(cache=True)
def prolong(coarse: Field, weight: Field, block: tuple[int, int], out: Field) -> None:
    """Give every cell with a weight its block's value, and zero to the others."""
    nx, ny = out.shape
    nothing = weight.dtype.type(0.0)
    for i in range(nx):
        ci = i // block[0]
        for cj in range(coarse.shape[1]):
            value = weight.dtype.type(coarse[ci, cj])
            for j in range(cj * block[1], min((cj + 1) * block[1], ny)):
                out[i, j] = value if weight[i, j] > nothing else nothing
