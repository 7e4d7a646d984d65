"""Motion of the sensor on a structure for roughness that passes its contact."""

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.structure.matrices import Structure
from asperity.structure.receptance import Receptances

MATRIX_ENTRIES = 2**21  # of the systems solved at a time


def sensor_response(
    structure: Structure | Receptances,
    stiffness: ArrayLike,
    damping: ArrayLike,
    frequencies_hz: ArrayLike,
) -> npt.NDArray[np.complex128]:
    """Return the displacement of the sensor per displacement that roughness imposes, shape (n,).

    Parameters
    ----------
    stiffness, damping : of the contact [N/m, N s/m], one or (n,)
    frequencies_hz : (n,); 0 beyond the ends of measured receptances

    Examples
    --------
    >>> from asperity.structure import Structure, sensor_response
    >>> abs(sensor_response(Structure.single_mass(0.1), 1e8, 50.0, [10.0, 1000.0])).round(3)
    array([1.   , 1.041])
    """
    frequency_hz = np.atleast_1d(np.asarray(frequencies_hz, dtype=float))
    spring = np.asarray(stiffness) + 2j * np.pi * frequency_hz * np.asarray(damping)
    if isinstance(structure, Receptances):
        return structure.response(spring, frequency_hz)
    parts = max(1, frequency_hz.size * structure.mass.size // MATRIX_ENTRIES)
    rows = np.array_split(np.arange(frequency_hz.size), parts)
    return np.concatenate([_solved(structure, spring[part], frequency_hz[part]) for part in rows])


def _solved(
    structure: Structure, spring: npt.NDArray[np.complex128], frequency_hz: Field
) -> npt.NDArray[np.complex128]:
    angular = 2.0 * np.pi * frequency_hz[:, None, None]
    dynamic = (
        structure.stiffness
        + 1j * angular * structure.damping
        - angular**2 * structure.mass
        + spring[:, None, None] * np.outer(structure.contact, structure.contact)
    )
    moved = np.linalg.solve(dynamic, spring[:, None, None] * structure.contact[:, None])
    return np.asarray(moved[:, :, 0] @ structure.sensor)
