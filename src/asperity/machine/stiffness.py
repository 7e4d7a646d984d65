"""Stiffness matrix of the balls between two rigid rings."""

import numpy as np

from asperity.core.arrays import Field

EXPONENT = 1.5  # of the load over the approach of both rings


def tangent_stiffness(
    loads: Field, contact_angles: Field, positions: Field, stiffness: float, groove_distance: float
) -> Field:
    """Return d(force)/d(shift) of the inner ring, shape (3, 3).

    Rows and columns: radial and axial [N/m], and tilt times the arm of the groove's centres.

    Parameters
    ----------
    loads, contact_angles : of the balls [N], [rad]
    positions : of the balls, from the direction of the radial load [rad]
    stiffness : load over approach to the power 3/2 [N/m^1.5]
    groove_distance : of the groove centres without load [m]
    """
    approaches = (loads / stiffness) ** (1.0 / EXPONENT)
    cosines = np.cos(positions)
    across, along = np.cos(contact_angles), np.sin(contact_angles)
    normal = np.stack([across * cosines, along, along * cosines])
    tangential = np.stack([-along * cosines, across, across * cosines])
    of_contacts = EXPONENT * stiffness * np.sqrt(approaches)
    of_forces = loads / (groove_distance + approaches)
    return np.asarray((normal * of_contacts) @ normal.T + (tangential * of_forces) @ tangential.T)
