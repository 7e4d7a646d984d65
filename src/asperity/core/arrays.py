"""Array types of all layers, and the JSON form of a number."""

import math
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from asperity.core.errors import BadInput

Field: TypeAlias = npt.NDArray[np.floating[Any]]
Mask: TypeAlias = npt.NDArray[np.bool_]
Codes: TypeAlias = npt.NDArray[np.int8]


# NumPy's own treatment of floating-point errors, whatever the caller has set: underflow is normal
# in tails of exponentials
usual_float_errors = np.errstate(divide="warn", over="warn", under="ignore", invalid="warn")


def real_array(name: str, values: npt.ArrayLike) -> Field:
    """Return numbers as an array; masked ones, which are missing, become nan.

    Raises
    ------
    BadInput
        if they are not real numbers, such as text, objects, complex numbers or truth values.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.core.arrays import real_array
    >>> real_array("heights", np.ma.masked_greater([1.0, 9.0], 5.0))
    array([ 1., nan])
    """
    array = np.ma.asanyarray(values) if np.ma.isMaskedArray(values) else np.asarray(values)
    if array.dtype.kind not in "fiu":
        raise BadInput(
            f"{name} must be real numbers, got an array of {array.dtype.name}; convert it to float"
        )
    floats = array if array.dtype.kind == "f" else array.astype(np.float64)
    return np.ma.filled(floats, np.nan)


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
