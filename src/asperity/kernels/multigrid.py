"""Algebraic multigrid for a five-point stencil: blocks of two by two, relaxed on every level.

All levels lie one after another in flat arrays, so that one call runs through all of them: calling
many small kernels takes longer than running them. Rows are scaled by the sum of their entries'
magnitudes, so that single precision suffices on every level.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit
from asperity.kernels.line_relaxation import (
    LineFactors,
    aggregate_stencil,
    factor_lines,
    relax_zebra,
)
from asperity.kernels.stencils import OuterNeighbours, Stencil


class GridHierarchy(NamedTuple):
    """Levels from the first coarse grid on, stored flat; `inverse` is a matrix on the last one.

    `places` holds for each level its cells along x and y, and its offsets in arrays of cells, of
    even and of odd lines. `weight` is the scale of its rows, 0 in empty blocks, and `inverse_scale`
    one over it; `even` and `odd` are the factors of its lines, (5, cells); `residual` and `change`
    are work arrays.
    """

    places: np.ndarray
    stencil: Field
    inverse_scale: Field
    weight: Field
    even: Field
    odd: Field
    residual: Field
    change: Field
    inverse: Field


@njit(cache=True)
def _grid(flat: Field, places: np.ndarray, k: int) -> Field:
    """Return the view of a flat field on level `k`."""
    nx, ny, start = places[k, 0], places[k, 1], places[k, 2]
    return flat[start : start + nx * ny].reshape((nx, ny))


@njit(cache=True)
def _stencil(hierarchy: GridHierarchy, k: int) -> Stencil:
    """Return the stencil of level `k`."""
    parts, places = hierarchy.stencil, hierarchy.places
    return Stencil(
        _grid(parts[0], places, k),
        _grid(parts[1], places, k),
        _grid(parts[2], places, k),
        _grid(parts[3], places, k),
        _grid(parts[4], places, k),
    )


@njit(cache=True)
def _lines(flat: Field, nx: int, count: int, start: int, empty: Field) -> LineFactors:
    """Return the factors of every second line of a level."""
    end = start + nx * count
    return LineFactors(
        flat[0, start:end].reshape((nx, count)),
        flat[1, start:end].reshape((nx, count)),
        flat[2, start:end].reshape((nx, count)),
        flat[3, start:end].reshape((nx, count)),
        flat[4, start:end].reshape((nx, count)),
        empty,
        empty,
    )


@njit(cache=True)
def _both_lines(hierarchy: GridHierarchy, k: int, empty: Field) -> tuple[LineFactors, LineFactors]:
    """Return the factors of the even and the odd lines of level `k`."""
    nx, ny, _, even, odd = hierarchy.places[k]
    return _lines(hierarchy.even, nx, (ny + 1) // 2, even, empty), _lines(
        hierarchy.odd, nx, ny // 2, odd, empty
    )


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def restrict_scaled(residual: Field, weight: Field, inverse_scale: Field, out: Field) -> None:
    """Sum residuals, times `weight`, over blocks of one or two cells, times `inverse_scale`."""
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
                out[ci, cj] = (line[2 * cj] + line[2 * cj + 1]) * inverse_scale[ci, cj]
            if ny % 2 == 1:
                out[ci, -1] = line[-1] * inverse_scale[ci, -1]
        else:
            for cj in range(cy):
                out[ci, cj] = line[cj] * inverse_scale[ci, cj]


@njit(cache=True)
def add_prolonged(coarse: Field, weight: Field, out: Field) -> None:
    """Add to every cell with a weight its block's value."""
    (nx, ny), (cx, cy) = out.shape, coarse.shape
    along, across = 2 if cx < nx else 1, 2 if cy < ny else 1
    empty, line = weight.dtype.type(0.0), np.empty(ny, out.dtype)
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
                out[i, j] += line[j] if weight[i, j] > empty else empty


@njit(cache=True)
def build_hierarchy(
    stencil: Stencil, weight: Field, least_pivot: float, hierarchy: GridHierarchy
) -> bool:
    """Build all levels from the finest stencil; return whether the last one is invertible.

    The rows of the stencil are multiplied by `weight`.
    """
    empty = np.empty((0, 0), weight.dtype)
    last, finer, rows = len(hierarchy.places) - 1, stencil, weight
    for k in range(last + 1):
        nx, ny = hierarchy.places[k, 0], hierarchy.places[k, 1]
        parts = np.empty((5, nx, ny))
        coarse = Stencil(parts[0], parts[1], parts[2], parts[3], parts[4])
        fx, fy = rows.shape
        aggregate_stencil(finer, rows, (2 if nx < fx else 1, 2 if ny < fy else 1), coarse)
        scaled, inverse_scale, kept = (
            _stencil(hierarchy, k),
            _grid(hierarchy.inverse_scale, hierarchy.places, k),
            _grid(hierarchy.weight, hierarchy.places, k),
        )
        _scale(coarse, scaled, inverse_scale, kept)
        if k < last:
            even, odd = _both_lines(hierarchy, k, empty)
            factor_lines(scaled, OuterNeighbours(empty, empty), 0, least_pivot, even)
            factor_lines(scaled, OuterNeighbours(empty, empty), 1, least_pivot, odd)
        finer, rows = scaled, kept
    invertible: bool = invert(finer, hierarchy.inverse)
    return invertible


@njit(cache=True)
def _scale(coarse: Stencil, scaled: Stencil, inverse_scale: Field, weight: Field) -> None:
    """Divide rows by the sum of their entries' magnitudes; an empty block has an identity row."""
    nx, ny = inverse_scale.shape
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
            inverse_scale[i, j] = 1.0 / size
            weight[i, j] = 0.0 if centre == 1.0 and size == 1.0 else size


@njit(cache=True)
def _dense(stencil: Stencil) -> Field:
    """Return a stencil's matrix."""
    nx, ny = stencil.centre.shape
    matrix = np.zeros((nx * ny, nx * ny))
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
    return matrix


@njit(cache=True)
def _eliminate(matrix: Field, k: int) -> None:
    """Scale row `k` by its pivot and subtract it from all others, in place."""
    count = len(matrix)
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


@njit(cache=True)
def invert(stencil: Stencil, out: Field) -> bool:
    """Invert a stencil's matrix by Gauss-Jordan elimination; return False if it is singular."""
    matrix = _dense(stencil)
    count = len(matrix)
    order = np.arange(count)
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
        _eliminate(matrix, k)
    for k in range(count):  # undo the row permutation in the columns of the inverse
        for row in range(count):
            out[row, order[k]] = matrix[row, k]
    return True


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _multiply(matrix: Field, vector: Field, out: Field) -> None:
    """Fill `out` with `matrix` times `vector`."""
    for row in range(len(out)):
        total = vector.dtype.type(0.0)
        for column in range(len(vector)):
            total += matrix[row, column] * vector[column]
        out[row] = total


@njit(cache=True)
def apply_hierarchy(
    hierarchy: GridHierarchy, residual: Field, weight: Field, cycles: int, change: Field
) -> None:
    """Add to `change` the approximate correction for a residual, one value per finest block.

    Every level but the last alternates the coarser correction and its own line relaxation, `cycles`
    times.
    """
    places, last = hierarchy.places, len(hierarchy.places) - 1
    empty, cycles_done, k = np.empty((0, 0), weight.dtype), np.zeros(last + 1, np.int64), 0
    restrict_scaled(
        residual,
        weight,
        _grid(hierarchy.inverse_scale, places, 0),
        _grid(hierarchy.residual, places, 0),
    )
    while k >= 0:
        rhs, answer = _grid(hierarchy.residual, places, k), _grid(hierarchy.change, places, k)
        if k == last:
            _multiply(hierarchy.inverse, rhs.reshape(rhs.size), answer.reshape(answer.size))
            k -= 1
            continue
        stencil, own = _stencil(hierarchy, k), _grid(hierarchy.weight, places, k)
        even, odd = _both_lines(hierarchy, k, empty)
        if cycles_done[k] > 0:
            add_prolonged(_grid(hierarchy.change, places, k + 1), own, answer)
            relax_zebra(stencil, OuterNeighbours(empty, empty), even, odd, rhs, answer)
        else:
            answer[:] = 0.0
        if cycles_done[k] == cycles:
            cycles_done[k] = 0
            k -= 1
            continue
        left = rhs
        if cycles_done[k] > 0:
            left = np.empty_like(rhs)
            _remaining_residual(stencil, rhs, answer, left)
        cycles_done[k] += 1
        k += 1
        restrict_scaled(
            left,
            own,
            _grid(hierarchy.inverse_scale, places, k),
            _grid(hierarchy.residual, places, k),
        )
    add_prolonged(_grid(hierarchy.change, places, 0), weight, change)


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def _remaining_residual(stencil: Stencil, residual: Field, change: Field, left: Field) -> None:
    """Fill `left` with the residual that remains after a change."""
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
