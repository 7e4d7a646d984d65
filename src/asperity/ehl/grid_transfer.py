"""Transfer of cell-centred fields between grids: averaging, linear and cubic interpolation."""

from functools import lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import scipy

from asperity.core.arrays import Field, Mask

AnyField = TypeVar("AnyField", Field, Mask)
Index = npt.NDArray[np.intp]


def average(field: Field, cells: tuple[int, int]) -> Field:
    """Return a field on fewer cells, each the mean over its area."""
    return _apply(
        field,
        *(_averaging_matrix(fine, coarse) for fine, coarse in zip(field.shape, cells, strict=True)),
    )


def mirror_field(field: AnyField, lines: int) -> AnyField:
    """Return a field extended to `lines` lines of cells by its mirror image."""
    missing = lines - field.shape[1]
    return np.concatenate([field, field[:, :missing][:, ::-1]], axis=1)


def interpolate(field: Field, cells: tuple[int, int], *, cubic: bool = False) -> Field:
    """Return a field on more cells, bilinear between cell centres or `cubic` along both axes.

    y is periodic; x extends as a constant. A cubic overshoots where the field bends sharply.
    """
    (coarse_x, coarse_y) = field.shape
    (nx, ny) = cells
    weights = _cubic_weights if cubic else _linear_weights
    return _apply(
        field, weights(coarse_x, nx, periodic=False), weights(coarse_y, ny, periodic=True)
    )


def _apply(field: Field, along: scipy.sparse.csr_array, across: scipy.sparse.csr_array) -> Field:
    """Apply matrices along both axes."""
    return np.asarray((across @ (along @ field).T).T, order="C")


@lru_cache(maxsize=64)
def _averaging_matrix(fine: int, coarse: int) -> scipy.sparse.csr_array:
    """Return the share of each fine cell in each coarse one, shape (coarse, fine)."""
    edges = np.union1d(np.arange(fine + 1) / fine, np.arange(coarse + 1) / coarse)
    middles = (edges[1:] + edges[:-1]) / 2.0
    rows = (middles * coarse).astype(int)
    columns = (middles * fine).astype(int)
    return scipy.sparse.coo_array(
        (np.diff(edges) * coarse, (rows, columns)), shape=(coarse, fine)
    ).tocsr()


@lru_cache(maxsize=64)
def _linear_weights(coarse: int, fine: int, *, periodic: bool) -> scipy.sparse.csr_array:
    """Return the weights of the coarse centres beside each fine one, shape (fine, coarse)."""
    left, offset = _left_centre(coarse, fine)
    return _weight_matrix(np.stack([1.0 - offset, offset]), left, coarse, periodic=periodic)


@lru_cache(maxsize=64)
def _cubic_weights(coarse: int, fine: int, *, periodic: bool) -> scipy.sparse.csr_array:
    """Return the Lagrange weights of four coarse centres for each fine one, (fine, coarse)."""
    left, t = _left_centre(coarse, fine)
    weights = [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
    return _weight_matrix(np.stack(weights), left - 1, coarse, periodic=periodic)


def _left_centre(coarse: int, fine: int) -> tuple[Index, Field]:
    """Return the coarse centre left of each fine one, and the offset from it in coarse cells."""
    position = (np.arange(fine) + 0.5) * (coarse / fine) - 0.5
    left = np.floor(position).astype(int)
    return left, np.asarray(position - left)


def _weight_matrix(
    weights: Field, first: Index, coarse: int, *, periodic: bool
) -> scipy.sparse.csr_array:
    """Return weights, (points, fine), of consecutive coarse centres as a matrix, (fine, coarse).

    `first` is the first of those centres.
    """
    points, fine = weights.shape
    centres = (first + np.arange(points)[:, None]).ravel()
    centres = centres % coarse if periodic else np.clip(centres, 0, coarse - 1)
    return scipy.sparse.coo_array(
        (weights.ravel(), (np.tile(np.arange(fine), points), centres)), shape=(fine, coarse)
    ).tocsr()
