"""Array types of all layers, and the JSON form of a number."""

import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Field: TypeAlias = npt.NDArray[np.floating[Any]]
Mask: TypeAlias = npt.NDArray[np.bool_]
Codes: TypeAlias = npt.NDArray[np.int8]


def finite_or_none(value: float | None) -> float | None:
    """Return the number as a float; None if it is missing, nan or infinite (JSON has neither)."""
    return float(value) if value is not None and math.isfinite(value) else None
