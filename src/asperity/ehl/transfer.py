"""Cell-centred fields from one grid to another of the same size: means downwards, straight lines upwards."""

from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from asperity.arrays import Field


def averaged(field: Field, cells: tuple[int, int]) -> Field:
    """A field on fewer cells, each the mean over its area."""
    return _moved(field, *(_averaging(fine, coarse) for fine, coarse in zip(field.shape, cells, strict=True)))


def interpolated(field: Field, cells: tuple[int, int]) -> Field:
    """A field on more cells, bilinear between cell centres; y wraps round, x ends level."""
    (coarse_x, coarse_y), (nx, ny) = field.shape, cells
    return _moved(field, _interpolation(coarse_x, nx, wraps=False), _interpolation(coarse_y, ny, wraps=True))


def _moved(field: Field, along: Any, across: Any) -> Field:
    return np.asarray((across @ (along @ field).T).T, order="C")


@lru_cache(maxsize=64)
def _averaging(fine: int, coarse: int) -> Any:
    """Share of each fine cell in each coarse one, shape (coarse, fine)."""
    edges = np.union1d(np.arange(fine + 1) / fine, np.arange(coarse + 1) / coarse)
    middles = (edges[1:] + edges[:-1]) / 2.0
    rows, columns = (middles * coarse).astype(int), (middles * fine).astype(int)
    return scipy.sparse.coo_array((np.diff(edges) * coarse, (rows, columns)), shape=(coarse, fine)).tocsr()


@lru_cache(maxsize=64)
def _interpolation(coarse: int, fine: int, *, wraps: bool) -> Any:
    """Weights of the coarse centres on both sides of each fine one, shape (fine, coarse)."""
    place = (np.arange(fine) + 0.5) * (coarse / fine) - 0.5
    left = np.floor(place).astype(int)
    sides = np.concatenate([left, left + 1])
    sides = sides % coarse if wraps else np.clip(sides, 0, coarse - 1)
    weights = np.concatenate([1.0 - (place - left), place - left])
    return scipy.sparse.coo_array((weights, (np.tile(np.arange(fine), 2), sides)), shape=(fine, coarse)).tocsr()
