"""Cell-centred fields from one grid to another of the same size: means downwards, lines or cubics upwards."""

from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from asperity.core.arrays import Field


def averaged(field: Field, cells: tuple[int, int]) -> Field:
    """A field on fewer cells, each the mean over its area."""
    return _moved(
        field, *(_averaging(fine, coarse) for fine, coarse in zip(field.shape, cells, strict=True))
    )


def mirrored(field: Any, lines: int) -> Any:
    """A field on so many lines of cells, of which it holds the first half: the others are their mirror image."""
    beyond = lines - field.shape[1]
    return np.concatenate([field, field[:, :beyond][:, ::-1]], axis=1)


def interpolated(field: Field, cells: tuple[int, int], *, cubic: bool = False) -> Field:
    """A field on more cells, bilinear between cell centres, or `cubic` along both; y wraps round, x ends level.

    A cubic overshoots where the field bends sharply.
    """
    (coarse_x, coarse_y), (nx, ny) = field.shape, cells
    weights = _cubic if cubic else _interpolation
    return _moved(field, weights(coarse_x, nx, wraps=False), weights(coarse_y, ny, wraps=True))


def _moved(field: Field, along: Any, across: Any) -> Field:
    return np.asarray((across @ (along @ field).T).T, order="C")


@lru_cache(maxsize=64)
def _averaging(fine: int, coarse: int) -> Any:
    """Share of each fine cell in each coarse one, shape (coarse, fine)."""
    edges = np.union1d(np.arange(fine + 1) / fine, np.arange(coarse + 1) / coarse)
    middles = (edges[1:] + edges[:-1]) / 2.0
    rows, columns = (middles * coarse).astype(int), (middles * fine).astype(int)
    return scipy.sparse.coo_array(
        (np.diff(edges) * coarse, (rows, columns)), shape=(coarse, fine)
    ).tocsr()


@lru_cache(maxsize=64)
def _interpolation(coarse: int, fine: int, *, wraps: bool) -> Any:
    """Weights of the coarse centres on both sides of each fine one, shape (fine, coarse)."""
    left, beyond = _left_of(coarse, fine)
    return _gathered(np.stack([1.0 - beyond, beyond]), left, coarse, wraps=wraps)


@lru_cache(maxsize=64)
def _cubic(coarse: int, fine: int, *, wraps: bool) -> Any:
    """Weights of the two coarse centres on either side of each fine one, shape (fine, coarse): Lagrange's."""
    left, t = _left_of(coarse, fine)
    weights = [
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    ]
    return _gathered(np.stack(weights), left - 1, coarse, wraps=wraps)


def _left_of(coarse: int, fine: int) -> tuple[Any, Field]:
    """The coarse centre on the left of each fine one, and how far beyond it that is, in coarse cells."""
    place = (np.arange(fine) + 0.5) * (coarse / fine) - 0.5
    left = np.floor(place).astype(int)
    return left, np.asarray(place - left)


def _gathered(weights: Field, first: Any, coarse: int, *, wraps: bool) -> Any:
    """Weights, (points, fine), of neighbouring coarse centres from the `first` on as a matrix, (fine, coarse)."""
    points, fine = weights.shape
    centres = (first + np.arange(points)[:, None]).ravel()
    centres = centres % coarse if wraps else np.clip(centres, 0, coarse - 1)
    return scipy.sparse.coo_array(
        (weights.ravel(), (np.tile(np.arange(fine), points), centres)), shape=(fine, coarse)
    ).tocsr()
