"""Array types of all layers, and the JSON form of a number."""

import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Field: TypeAlias = npt.NDArray[np.floating[Any]]
Mask: TypeAlias = npt.NDArray[np.bool_]
Codes: TypeAlias = npt.NDArray[np.int8]


def finite_or_none(value: float | None) -> float | None:
    """Return the number as a float; None if it is missing, nan or infinite (JSON has neither).

    Examples
    --------
    >>> from asperity.core.arrays import finite_or_none
    >>> finite_or_none(1.5)
    1.5
    >>> print(finite_or_none(float("nan")))
    None
    """
    return float(value) if value is not None and math.isfinite(value) else None
