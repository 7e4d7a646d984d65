"""Coupling of measured receptances by the contact: displacement per force over frequency.

`approach` is the receptance of the contact, approach of the bodies per pair of forces that press
them together; `transfer` that from these forces to the sensor. All are complex [m/N] at the same
frequencies, measured without the contact's spring. `spring` is the contact's k + iωc [N/m].
Sources: R. E. D. Bishop and D. C. Johnson, The Mechanics of Vibration (1960).
"""

import numpy as np
import scipy
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.core.errors import BadInput


def coupled_receptance(
    sensor: ArrayLike, transfer: ArrayLike, approach: ArrayLike, spring: ArrayLike
) -> Field:
    """Return the receptance of the sensor with the contact, from that without, `sensor`."""
    free, across, relative, stiffness = map(np.asarray, (sensor, transfer, approach, spring))
    return np.asarray(free - across**2 * stiffness / (1.0 + stiffness * relative))


def transfer_of_roughness(transfer: ArrayLike, approach: ArrayLike, spring: ArrayLike) -> Field:
    """Return the displacement of the sensor per displacement that roughness imposes."""
    across, relative, stiffness = map(np.asarray, (transfer, approach, spring))
    return np.asarray(across * stiffness / (1.0 + stiffness * relative))


def share_of_receptance(
    frequencies_hz: ArrayLike, approach: ArrayLike, stiffness: float
) -> list[tuple[float, float]]:
    """Return frequency [Hz] and contact's share of the strain energy of every coupled mode.

    Modes lie where 1 + k Re H vanishes and H passes smoothly; the share is -2 H/(ω dH/dω) there.
    Values between the frequencies follow a cubic spline through 1/Re H, which has no poles at the
    modes of the structure without contact but at its antiresonances. The frequencies must lie
    closer together than the contact moves a mode.

    Parameters
    ----------
    frequencies_hz : increasing, shape (n,)
    approach : receptance of the contact without its spring [m/N], (n,)
    stiffness : of the contact [N/m]

    Raises
    ------
    BadInput
        for fewer than four frequencies, or frequencies that do not increase.
    """
    frequency_hz = np.asarray(frequencies_hz, dtype=float)
    receptance = np.real(np.asarray(approach))
    if frequency_hz.size < 4 or np.any(np.diff(frequency_hz) <= 0.0):
        raise BadInput(
            "receptances need four or more increasing frequencies; sort and complete them"
        )
    values = 1.0 / receptance
    inverse = scipy.interpolate.CubicSpline(frequency_hz, values)
    slope = inverse.derivative()
    # 1/H falls between its poles; across a pole it rises
    falling = np.append(np.diff(values) < 0.0, False)
    roots = inverse.solve(-stiffness, extrapolate=False)
    before = np.searchsorted(frequency_hz, roots, side="right") - 1
    # of H = 1/q, H/(dH/df) = -q/q'
    return [
        (float(root), float(2.0 * inverse(root) / (root * slope(root))))
        for root, place in zip(roots, before, strict=True)
        if falling[place] and slope(root) < 0.0
    ]
