"""Modes of a structure with its contact, and the contact's share of each."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from asperity.core.errors import AsperityError, BadInput
from asperity.structure.matrices import Structure

SETTLED = 1e-9  # relative change of a frequency at which its mode is accepted
MAX_ROUNDS = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class CoupledMode:
    """Mode of a structure with its contact.

    Parameters
    ----------
    damping_ratio : of the undamped mode shape
    contact_share : share of the contact in the strain energy of the mode, 0 to 1
    contact_shape, sensor_shape : mass-normalised approach in the contact and displacement at the
        sensor [kg^-1/2]
    stiffness, damping : of the contact in this mode [N/m, N s/m]
    """

    frequency_hz: float
    damping_ratio: float
    contact_share: float
    contact_shape: float
    sensor_shape: float
    stiffness: float
    damping: float

    def shift(self, stiffness_change: float) -> float:
        """Return the relative change of the frequency for a small one of the contact stiffness.

        Half of the contact's share of the strain energy, by Rayleigh's quotient.
        """
        return 0.5 * self.contact_share * stiffness_change


def coupled_modes(
    structure: Structure, stiffness: float, damping: float = 0.0
) -> tuple[CoupledMode, ...]:
    """Return all modes of a structure on a contact spring, by frequency.

    Parameters
    ----------
    stiffness, damping : of the contact [N/m, N s/m]

    Raises
    ------
    BadInput
        for a negative stiffness.

    Examples
    --------
    >>> from asperity.structure import Structure, coupled_modes
    >>> (mode,) = coupled_modes(Structure.single_mass(0.1), 1e8)
    >>> f"{mode.frequency_hz:.0f} Hz, share {mode.contact_share:.0%}"
    '5033 Hz, share 100%'
    """
    if not 0.0 <= stiffness < math.inf:
        raise BadInput(f"contact stiffness must be 0 N/m or more and finite, got {stiffness:g} N/m")
    approach, sensor = structure.contact, structure.sensor
    matrix = structure.stiffness + stiffness * np.outer(approach, approach)
    values, shapes = scipy.linalg.eigh(matrix, structure.mass)
    largest = max(float(values[-1]), 0.0)
    modes = []
    for value, shape in zip(values, shapes.T, strict=True):
        angular = math.sqrt(value) if value > 1e-12 * largest else 0.0
        in_contact = float(approach @ shape)
        friction = float(shape @ structure.damping @ shape) + damping * in_contact**2
        modes.append(
            CoupledMode(
                frequency_hz=angular / (2.0 * math.pi),
                damping_ratio=friction / (2.0 * angular) if angular else 0.0,
                contact_share=stiffness * in_contact**2 / angular**2 if angular else 0.0,
                contact_shape=in_contact,
                sensor_shape=float(sensor @ shape),
                stiffness=stiffness,
                damping=damping,
            )
        )
    return tuple(modes)


def settled_modes(
    structure: Structure,
    contact: Callable[[float], tuple[float, float]],
    *,
    lowest_hz: float = 0.0,
    highest_hz: float = math.inf,
    start_hz: float = 1000.0,
) -> tuple[CoupledMode, ...]:
    """Return the modes of a band with the contact's stiffness and damping at their own frequency.

    Parameters
    ----------
    contact : returns stiffness and damping [N/m, N s/m] at a frequency [Hz]
    lowest_hz, highest_hz : band of the modes
    start_hz : frequency of the first guess

    Raises
    ------
    AsperityError
        if the frequency of a mode does not settle.
    """
    first = coupled_modes(structure, *contact(start_hz))
    found = []
    for number, mode in enumerate(first):
        for _ in range(MAX_ROUNDS):
            before = mode.frequency_hz
            mode = coupled_modes(structure, *contact(before or start_hz))[number]
            if abs(mode.frequency_hz - before) <= SETTLED * max(before, 1.0):
                break
        else:
            raise AsperityError(
                f"mode {number + 1} near {mode.frequency_hz:.4g} Hz does not settle: the contact's "
                "stiffness changes too much over frequency; state it at one frequency"
            )
        found.append(mode)
    return tuple(mode for mode in found if lowest_hz <= mode.frequency_hz <= highest_hz)
