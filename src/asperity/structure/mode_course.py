"""Mode of a structure that follows the contact, over the contact's stiffness."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.structure.matrices import Structure
from asperity.structure.modes import CoupledMode, coupled_modes
from asperity.structure.receptance import Receptances, receptance_modes

STIFFNESSES = 97  # of the grid; the frequency between them is within 1e-6
LOWEST_HZ, HIGHEST_HZ = 50.0, 20_000.0  # of the mode at the largest stiffness
MIN_CONTACT_SHARE = 0.05  # of the strain energy: modes with less say little about the contact


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactMode:
    """Mode with the largest mean share of the contact, over the contact's stiffness.

    Arrays of shape (n,): `stiffness` of the contact [N/m], increasing; `frequency_hz`;
    `damping_ratio` of the structure alone; `contact_shape` [kg^-1/2].
    """

    stiffness: Field
    frequency_hz: Field
    damping_ratio: Field
    contact_shape: Field

    @cached_property
    def _log_frequency(self) -> "scipy.interpolate.PchipInterpolator":
        return scipy.interpolate.PchipInterpolator(
            np.log(self.stiffness), np.log(self.frequency_hz), extrapolate=True
        )

    def log_frequency(self, log_stiffness: ArrayLike) -> Field:
        """Return ln of the frequency [Hz] at ln of the stiffness [N/m]; any shape."""
        return np.asarray(self._log_frequency(np.asarray(log_stiffness)))

    def log_slope(self, log_stiffness: ArrayLike) -> Field:
        """Return d ln frequency/d ln stiffness: half of the contact's share."""
        return np.asarray(self._log_frequency.derivative()(np.asarray(log_stiffness)))

    def total_damping(self, log_stiffness: ArrayLike, damping: ArrayLike) -> Field:
        """Return the damping ratio with a contact's damping [N s/m]."""
        place = np.asarray(log_stiffness)
        own, shape = (
            np.interp(place, np.log(self.stiffness), values)
            for values in (self.damping_ratio, self.contact_shape)
        )
        angular = 2.0 * np.pi * np.exp(self.log_frequency(place))
        return np.asarray(own + np.asarray(damping) * shape**2 / (2.0 * angular))

    def stiffness_at(self, frequency_hz: ArrayLike) -> Field:
        """Return the stiffness [N/m] at which the mode has a frequency, within the grid's ends."""
        logs = np.interp(
            np.log(np.asarray(frequency_hz)), np.log(self.frequency_hz), np.log(self.stiffness)
        )
        return np.asarray(np.exp(logs))


def contact_mode(structure: Structure | Receptances, lowest: float, highest: float) -> ContactMode:
    """Return the mode with the largest mean share of the contact between two stiffnesses.

    Parameters
    ----------
    lowest, highest : stiffness of the contact [N/m]

    Raises
    ------
    BadInput
        if the structure has no mode from 50 Hz to 20 kHz that can be followed.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.structure import Structure, contact_mode
    >>> mode = contact_mode(Structure.single_mass(0.1), 1e7, 1e8)
    >>> f"{mode.frequency_hz[-1]:.0f} Hz, slope {mode.log_slope(np.log(5e7)):.2f}"
    '5033 Hz, slope 0.50'
    """
    grid = np.geomspace(lowest, highest, STIFFNESSES)
    by_stiffness = [_modes(structure, float(stiffness)) for stiffness in grid]
    courses = [
        course
        for number, mode in enumerate(by_stiffness[-1])
        if LOWEST_HZ <= mode.frequency_hz <= HIGHEST_HZ
        and (
            course := [modes[number] for modes in by_stiffness]
            if isinstance(structure, Structure)
            else _followed(by_stiffness, mode, grid)
        )
    ]
    if not courses:
        raise BadInput(
            f"the structure has no mode from {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz that can be "
            f"followed over contacts of {1e-6 * lowest:.3g} to {1e-6 * highest:.3g} N/um; correct "
            "its masses or springs, or measure its receptances over a wider band"
        )
    best = max(courses, key=lambda course: np.mean([mode.contact_share for mode in course]))
    frequencies, ratios, shapes = (
        np.array([getattr(mode, name) for mode in best])
        for name in ("frequency_hz", "damping_ratio", "contact_shape")
    )
    return ContactMode(
        stiffness=grid,
        frequency_hz=np.maximum.accumulate(frequencies),
        damping_ratio=ratios,
        contact_shape=np.abs(shapes),  # eigenvectors have either sign
    )


def _followed(
    by_stiffness: Sequence[Sequence[CoupledMode]], last: CoupledMode, grid: Field
) -> list[CoupledMode]:
    """Follow a mode of receptances from the largest stiffness down; empty where it is lost.

    Its frequency falls by at most half of the relative change of the stiffness.
    """
    course, largest = [last], 0.5 * float(np.log(grid[1] / grid[0]))
    for modes in reversed(by_stiffness[:-1]):
        expected = course[-1].frequency_hz
        candidates = [
            mode
            for mode in modes
            if -1.05 * largest <= np.log(mode.frequency_hz / expected) <= 0.05 * largest
        ]
        if not candidates:
            return []
        course.append(min(candidates, key=lambda mode: abs(mode.frequency_hz - expected)))
    return course[::-1]


def _modes(structure: Structure | Receptances, stiffness: float) -> tuple[CoupledMode, ...]:
    if isinstance(structure, Receptances):
        return receptance_modes(structure, lambda _: (stiffness, 0.0))
    return coupled_modes(structure, stiffness)
