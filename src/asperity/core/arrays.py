"""The array types every layer speaks, and numbers as JSON holds them."""

import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Field: TypeAlias = npt.NDArray[np.floating[Any]]
Mask: TypeAlias = npt.NDArray[np.bool_]
Codes: TypeAlias = npt.NDArray[np.int8]


def finite_or_none(value: float | None) -> float | None:
    """A number as JSON holds it: None for nan and infinity."""
    return float(value) if value is not None and math.isfinite(value) else None
