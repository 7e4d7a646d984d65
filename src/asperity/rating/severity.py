"""Vibration severity zones A to D of ISO 20816-3:2022, from the rms velocity of 10 to 1000 Hz.

The standard holds for machines above 15 kW in situ, measured on bearing housings. Its range from 2
Hz for machines below 600 1/min is not implemented.
"""

from typing import Literal

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import require_choice

LOWEST_HZ, HIGHEST_HZ = 10.0, 1000.0
MAX_SPACING_HZ = 2.5  # line spacing (Hann taper); coarser lines extend beyond the band's lower end
# Limits of zones A, B and C [m/s]: ISO 20816-3:2022, tables A.1 and A.2, as in ISO 10816-3:2009
LIMITS = {
    "large-rigid": (2.3e-3, 4.5e-3, 7.1e-3),
    "large-flexible": (3.5e-3, 7.1e-3, 11.0e-3),
    "medium-rigid": (1.4e-3, 2.8e-3, 4.5e-3),
    "medium-flexible": (2.3e-3, 4.5e-3, 7.1e-3),
}
ZONES = {
    "A": "typical of newly commissioned machines",
    "B": "acceptable for unrestricted long-term operation",
    "C": "unsatisfactory for continuous operation; limited operation until repair",
    "D": "severe enough to damage the machine",
}


def velocity_rms(
    frequency_hz: Field,
    density: Field,
    measured: Literal["acceleration", "velocity"] = "acceleration",
) -> float:
    """Return the rms velocity from 10 to 1000 Hz [m/s], v² = Σ S_a/(2π f)² Δf or Σ S_v Δf.

    The result is nan if the lines are too coarse or end below 1000 Hz.

    Parameters
    ----------
    frequency_hz, density : power spectral density of an acceleration [(m/s²)²/Hz] or a velocity
        [(m/s)²/Hz], on evenly spaced lines from 0
    measured : which of the two

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.rating import velocity_rms
    >>> frequency_hz = np.arange(0.0, 1001.0)
    >>> f"{velocity_rms(frequency_hz, np.full(1001, 1e-3)) * 1e3:.2f} mm/s"
    '1.62 mm/s'
    """
    require_choice("measured", measured, ("acceleration", "velocity"))
    spacing = float(frequency_hz[1])
    if spacing > MAX_SPACING_HZ or frequency_hz[-1] < HIGHEST_HZ:
        return float("nan")
    inside = (frequency_hz >= LOWEST_HZ) & (frequency_hz <= HIGHEST_HZ)
    squares = density[inside]
    if measured == "acceleration":
        squares = squares / (2.0 * np.pi * frequency_hz[inside]) ** 2
    return float(np.sqrt(np.sum(squares) * spacing))


def severity_zone(velocity: float, machine_class: str) -> str:
    """Return the zone, A to D, of an rms velocity [m/s].

    Parameters
    ----------
    velocity : [m/s]
    machine_class : "large-rigid", "large-flexible", "medium-rigid" or "medium-flexible"; large:
        above 300 kW or shaft height from 315 mm, medium: above 15 kW or from 160 mm; by its support

    Raises
    ------
    BadInput
        The class is unknown.

    Examples
    --------
    >>> from asperity.rating import severity_zone
    >>> severity_zone(0.0035, "medium-rigid")
    'C'
    """
    require_choice("machine class", machine_class, tuple(LIMITS))
    return "ABCD"[int(np.searchsorted(LIMITS[machine_class], velocity))]
