"""A five-point stencil summed over blocks of two by two again and again, and all these grids relaxed in turns.

The grids stand one behind the other in flat arrays, so that one call goes through all of them:
between calls of many small kernels more time passes than in them. Rows are scaled by the sum of
their entries' sizes, so that single precision holds the coarsest as well as the finest.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit
from asperity.kernels.line_relaxation import Lines, aggregate_stencil, factor_lines, relax_zebra
from asperity.kernels.stencils import Far, Stencil


class Nest(NamedTuple):
    """Grids from the first coarser one on, flat; the last one's `inverse` is a matrix.

    `places` holds for each its cells along x and y, and where it begins in arrays of cells, of
    even and of odd lines. `over` is one over what its rows are scaled by, `weight` that scale, 0
    in blocks without any cells; `even` and `odd` are the factors of its lines, (5, cells),
    `residual` and `change` what goes round.
    """

    places: np.ndarray
    stencil: Field
    over: Field
    weight: Field
    even: Field
    odd: Field
    residual: Field
    change: Field
    inverse: Field


@njit(cache=True)
def _grid(flat: Field, places: np.ndarray, k: int) -> Field:
    """A flat field on grid `k`."""
    nx, ny, start = places[k, 0], places[k, 1], places[k, 2]
    return flat[start : start + nx * ny].reshape((nx, ny))


@njit(cache=True)
def _stencil(nest: Nest, k: int) -> Stencil:
    parts, places = nest.stencil, nest.places
    return Stencil(
        _grid(parts[0], places, k),
        _grid(parts[1], places, k),
        _grid(parts[2], places, k),
        _grid(parts[3], places, k),
        _grid(parts[4], places, k),
    )


@njit(cache=True)
def _lines(flat: Field, nx: int, count: int, start: int, nothing: Field) -> Lines:
    """Factors of every second line of a grid."""
    end = start + nx * count
    return Lines(
        flat[0, start:end].reshape((nx, count)),
        flat[1, start:end].reshape((nx, count)),
        flat[2, start:end].reshape((nx, count)),
        flat[3, start:end].reshape((nx, count)),
        flat[4, start:end].reshape((nx, count)),
        nothing,
        nothing,
    )


@njit(cache=True)
def _both_lines(nest: Nest, k: int, nothing: Field) -> tuple[Lines, Lines]:
    nx, ny, _, even, odd = nest.places[k]
    return _lines(nest.even, nx, (ny + 1) // 2, even, nothing), _lines(
        nest.odd, nx, ny // 2, odd, nothing
    )


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def summed(residual: Field, weight: Field, over: Field, out: Field) -> None:
    """Sum residuals, times `weight`, over blocks of one or two cells along each axis, times `over` of the block."""
    (nx, ny), (cx, cy) = residual.shape, out.shape
    along, across = 2 if cx < nx else 1, 2 if cy < ny else 1
    line = np.empty(ny, residual.dtype)
    for ci in range(cx):
        i = along * ci
        for j in range(ny):
            line[j] = residual[i, j] * weight[i, j]
        if along == 2 and i + 1 < nx:
            for j in range(ny):
                line[j] += residual[i + 1, j] * weight[i + 1, j]
        if across == 2:
            for cj in range(ny // 2):
                out[ci, cj] = (line[2 * cj] + line[2 * cj + 1]) * over[ci, cj]
            if ny % 2 == 1:
                out[ci, cy - 1] = line[ny - 1] * over[ci, cy - 1]
        else:
            for cj in range(cy):
                out[ci, cj] = line[cj] * over[ci, cj]


@njit(cache=True)
def handed_on(coarse: Field, weight: Field, out: Field) -> None:
    """Add to every cell with a weight its block's value."""
    (nx, ny), (cx, cy) = out.shape, coarse.shape
    along, across = 2 if cx < nx else 1, 2 if cy < ny else 1
    nothing, line = weight.dtype.type(0.0), np.empty(ny, out.dtype)
    for ci in range(cx):
        if across == 2:
            for cj in range(ny // 2):
                line[2 * cj] = coarse[ci, cj]
                line[2 * cj + 1] = coarse[ci, cj]
            if ny % 2 == 1:
                line[ny - 1] = coarse[ci, cy - 1]
        else:
            for j in range(ny):
                line[j] = coarse[ci, j]
        for i in range(along * ci, min(along * (ci + 1), nx)):
            for j in range(ny):
                out[i, j] += line[j] if weight[i, j] > nothing else nothing


@njit(cache=True)
def nest_blocks(stencil: Stencil, weight: Field, least_pivot: float, nest: Nest) -> bool:
    """Fill a nest in from the finest grid's stencil, its rows times `weight`; whether its last grid has an inverse."""
    nothing = np.empty((0, 0), weight.dtype)
    last, finer, rows = len(nest.places) - 1, stencil, weight
    for k in range(last + 1):
        nx, ny = nest.places[k, 0], nest.places[k, 1]
        coarse = Stencil(
            np.empty((nx, ny)),
            np.empty((nx, ny)),
            np.empty((nx, ny)),
            np.empty((nx, ny)),
            np.empty((nx, ny)),
        )
        fx, fy = rows.shape
        aggregate_stencil(finer, rows, (2 if nx < fx else 1, 2 if ny < fy else 1), coarse)
        scaled, over, kept = (
            _stencil(nest, k),
            _grid(nest.over, nest.places, k),
            _grid(nest.weight, nest.places, k),
        )
        _scale(coarse, scaled, over, kept)
        if k < last:
            even, odd = _both_lines(nest, k, nothing)
            factor_lines(scaled, Far(nothing, nothing), 0, least_pivot, even)
            factor_lines(scaled, Far(nothing, nothing), 1, least_pivot, odd)
        finer, rows = scaled, kept
    found: bool = invert(finer, nest.inverse)
    return found


@njit(cache=True)
def _scale(coarse: Stencil, scaled: Stencil, over: Field, weight: Field) -> None:
    """Divide rows by the sum of their entries' sizes; a block without any cells has the row of an identity."""
    nx, ny = over.shape
    for i in range(nx):
        for j in range(ny):
            centre, west, east = coarse.centre[i, j], coarse.west[i, j], coarse.east[i, j]
            north, south = coarse.north[i, j], coarse.south[i, j]
            size = abs(centre) + abs(west) + abs(east) + abs(north) + abs(south)
            scaled.centre[i, j], scaled.west[i, j], scaled.east[i, j] = (
                centre / size,
                west / size,
                east / size,
            )
            scaled.north[i, j], scaled.south[i, j] = north / size, south / size
            over[i, j] = 1.0 / size
            weight[i, j] = 0.0 if centre == 1.0 and size == 1.0 else size


@njit(cache=True)
def invert(stencil: Stencil, out: Field) -> bool:
    """The inverse of a stencil's matrix, by Gauss and Jordan with pivots; whether there is one."""
    nx, ny = stencil.centre.shape
    count = nx * ny
    matrix, order = np.zeros((count, count)), np.arange(count)
    for i in range(nx):
        for j in range(ny):
            row = i * ny + j
            matrix[row, row] += stencil.centre[i, j]
            if i > 0:
                matrix[row, row - ny] += stencil.west[i, j]
            if i < nx - 1:
                matrix[row, row + ny] += stencil.east[i, j]
            matrix[row, i * ny + (j + 1) % ny] += stencil.north[i, j]
            matrix[row, i * ny + (j + ny - 1) % ny] += stencil.south[i, j]
    for k in range(count):
        pivot = k
        for row in range(k + 1, count):
            if abs(matrix[row, k]) > abs(matrix[pivot, k]):
                pivot = row
        if not abs(matrix[pivot, k]) > 0.0:
            return False
        if pivot != k:
            order[k], order[pivot] = order[pivot], order[k]
            for column in range(count):
                matrix[k, column], matrix[pivot, column] = matrix[pivot, column], matrix[k, column]
        own = 1.0 / matrix[k, k]
        matrix[k, k] = 1.0
        for column in range(count):
            matrix[k, column] *= own
        for row in range(count):
            factor = matrix[row, k]
            if row != k and factor != 0.0:
                matrix[row, k] = 0.0
                for column in range(count):
                    matrix[row, column] -= factor * matrix[k, column]
    for k in range(count):  # rows were taken in another order: columns of the inverse go back
        for row in range(count):
            out[row, order[k]] = matrix[row, k]
    return True


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _times(matrix: Field, vector: Field, out: Field) -> None:
    for row in range(len(out)):
        total = vector.dtype.type(0.0)
        for column in range(len(vector)):
            total += matrix[row, column] * vector[column]
        out[row] = total


@njit(cache=True)
def answer_nested(nest: Nest, residual: Field, weight: Field, turns: int, change: Field) -> None:
    """Add to `change` about what answers the finest grid's residual, one number a block of its cells.

    On every grid but the last the coarser one's answer and its own lines, `turns` of both.
    """
    places, last = nest.places, len(nest.places) - 1
    nothing, taken, k = np.empty((0, 0), weight.dtype), np.zeros(last + 1, np.int64), 0
    summed(residual, weight, _grid(nest.over, places, 0), _grid(nest.residual, places, 0))
    while k >= 0:
        here, answer = _grid(nest.residual, places, k), _grid(nest.change, places, k)
        if k == last:
            _times(nest.inverse, here.reshape(here.size), answer.reshape(answer.size))
            k -= 1
            continue
        stencil, own = _stencil(nest, k), _grid(nest.weight, places, k)
        even, odd = _both_lines(nest, k, nothing)
        if taken[k] > 0:
            handed_on(_grid(nest.change, places, k + 1), own, answer)
            relax_zebra(stencil, Far(nothing, nothing), even, odd, here, answer)
        else:
            answer[:] = 0.0
        if taken[k] == turns:
            taken[k] = 0
            k -= 1
            continue
        left = here
        if taken[k] > 0:
            left = np.empty_like(here)
            _leave(stencil, here, answer, left)
        taken[k] += 1
        k += 1
        summed(left, own, _grid(nest.over, places, k), _grid(nest.residual, places, k))
    handed_on(_grid(nest.change, places, 0), weight, change)


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _leave(stencil: Stencil, residual: Field, change: Field, left: Field) -> None:
    """What a stencil leaves of a residual after a change."""
    nx, ny = residual.shape
    last = ny - 1
    for i in range(nx):
        for j in range(ny):
            left[i, j] = residual[i, j] - stencil.centre[i, j] * change[i, j]
        for j in range(last):
            left[i, j] -= stencil.north[i, j] * change[i, j + 1]
        for j in range(1, ny):
            left[i, j] -= stencil.south[i, j] * change[i, j - 1]
        left[i, last] -= stencil.north[i, last] * change[i, 0]
        left[i, 0] -= stencil.south[i, 0] * change[i, last]
        if i > 0:
            for j in range(ny):
                left[i, j] -= stencil.west[i, j] * change[i - 1, j]
        if i < nx - 1:
            for j in range(ny):
                left[i, j] -= stencil.east[i, j] * change[i + 1, j]
