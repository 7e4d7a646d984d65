"""Content of a surface file before conversion of units and checks."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field

X, COLUMNS = "x", "columns"  # of a file, of a table: the direction of rolling


@dataclass(frozen=True, slots=True, kw_only=True)
class RawMap:
    """Content of a file: `heights` (nx, ny) in `unit` and `pixel` in `lateral_unit`.

    Units are None if not stated, `pixel` if the caller must give it. Heights of shape (n, 1) are a
    profile. `rolling_along` is the direction in the file that becomes x, the rolling direction.
    """

    heights: Field
    pixel: tuple[float, float] | None
    format: str
    unit: str | None = None
    lateral_unit: str | None = None
    notes: tuple[str, ...] = ()
    rolling_along: str = X


def map_of_rows(rows: npt.ArrayLike, form: str) -> RawMap:
    """Return the map of a table of heights: a row per y, the largest first, a column per x."""
    return RawMap(
        heights=x_first(np.asarray(rows)[::-1]), pixel=None, format=form, rolling_along=COLUMNS
    )


def x_first(rows: npt.ArrayLike) -> Field:
    """Transpose rows of constant y to shape (nx, ny)."""
    return np.ascontiguousarray(np.ma.filled(np.ma.asarray(rows, dtype=np.float64), np.nan).T)
