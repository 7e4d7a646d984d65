"""How severe a machine's vibration is by its velocity: zones A to D of ISO 20816-3:2022, of rms from 10 to 1000 Hz.

The standard is for machines above 15 kW in their place, measured on bearing housings. For those
below 600 1/min its range begins at 2 Hz, which is not worked out here.
"""

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import require_choice

LOWEST_HZ, HIGHEST_HZ = 10.0, 1000.0
COARSEST_HZ = (
    2.5  # spacing of lines with a Hann taper: at the lower end part of a line falls out of the band
)
# ends of zones A, B and C [m/s]: ISO 20816-3:2022, tables A.1 and A.2, the same as in ISO
# 10816-3:2009
LIMITS = {
    "large-rigid": (2.3e-3, 4.5e-3, 7.1e-3),
    "large-flexible": (3.5e-3, 7.1e-3, 11.0e-3),
    "medium-rigid": (1.4e-3, 2.8e-3, 4.5e-3),
    "medium-flexible": (2.3e-3, 4.5e-3, 7.1e-3),
}
ZONES = {
    "A": "as newly commissioned machines have it",
    "B": "acceptable for unrestricted long-term running",
    "C": "unsatisfactory for continuous running; for a limited time, until it can be mended",
    "D": "severe enough to damage the machine",
}


def velocity_rms(frequency_hz: Field, density: Field) -> float:
    """Rms velocity from 10 to 1000 Hz [m/s]: v² = Σ S_a/(2π f)² Δf; nan where the lines do not tell it.

    Parameters
    ----------
    frequency_hz, density : an acceleration's power spectral density [(m/s²)²/Hz], on evenly spaced lines from 0
    """
    spacing = float(frequency_hz[1])
    if spacing > COARSEST_HZ or frequency_hz[-1] < HIGHEST_HZ:
        return float("nan")
    inside = (frequency_hz >= LOWEST_HZ) & (frequency_hz <= HIGHEST_HZ)
    return float(
        np.sqrt(np.sum(density[inside] / (2.0 * np.pi * frequency_hz[inside]) ** 2) * spacing)
    )


def severity_zone(velocity: float, machine_class: str) -> str:
    """The zone, A to D, of an rms velocity [m/s].

    Parameters
    ----------
    machine_class : large (above 300 kW, or shaft height from 315 mm) or medium (above 15 kW, or from 160 mm), on a
        rigid or a flexible support: "large-rigid", "large-flexible", "medium-rigid", "medium-flexible"

    Raises
    ------
    BadInput
        for another class.
    """
    require_choice("machine class", machine_class, tuple(LIMITS))
    return "ABCD"[int(np.searchsorted(LIMITS[machine_class], velocity))]
