"""Fixed-step Dormand-Prince integration of a mass on a contact spring over a rough profile.

State (c, v): compression c = z0 + y_i - y and velocity v = y'. Between samples y_i is a straight
line of slope s, so c' = s - v and m v' = S c + C c' - F, or S c^1.5 + C c' - F as long as c > 0
(only -F without contact). Source: J. R. Dormand and P. J. Prince, J. Comput. Appl. Math. 6 (1980)
19, the fifth-order solution.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.kernels.compiled import njit


class ContactSpring(NamedTuple):
    """Spring, damper and load, each divided by the mass.

    `hertz` selects the 3/2-power spring, which can lose contact.
    """

    spring: float
    damper: float
    load: float
    hertz: bool


@njit(cache=True, inline="always")
def mass_acceleration(contact: ContactSpring, compression: float, rate: float) -> float:
    """Return the acceleration of the mass."""
    if not contact.hertz:
        return contact.spring * compression + contact.damper * rate - contact.load
    if compression <= 0.0:
        return -contact.load
    return (
        contact.spring * compression * float(np.sqrt(compression))
        + contact.damper * rate
        - contact.load
    )


@njit(cache=True, inline="always")
def _fourth_stage(k1: float, k2: float, k3: float) -> float:
    """Return the mean slope that leads to the fourth stage."""
    return (44 / 45) * k1 - (56 / 15) * k2 + (32 / 9) * k3


@njit(cache=True, inline="always")
def _fifth_stage(k1: float, k2: float, k3: float, k4: float) -> float:
    """Return the mean slope that leads to the fifth stage."""
    return (19372 / 6561) * k1 - (25360 / 2187) * k2 + (64448 / 6561) * k3 - (212 / 729) * k4


@njit(cache=True, inline="always")
def _sixth_stage(k1: float, k2: float, k3: float, k4: float, k5: float) -> float:
    """Return the mean slope that leads to the sixth stage."""
    return (
        (9017 / 3168) * k1
        - (355 / 33) * k2
        + (46732 / 5247) * k3
        + (49 / 176) * k4
        - (5103 / 18656) * k5
    )


@njit(cache=True, inline="always")
def _fifth_order(k1: float, k3: float, k4: float, k5: float, k6: float) -> float:
    """Return the mean slope of the whole step; the second stage has no weight."""
    return (
        (35 / 384) * k1 + (500 / 1113) * k3 + (125 / 192) * k4 - (2187 / 6784) * k5 + (11 / 84) * k6
    )


@njit(cache=True, fastmath={"contract", "nsz"}, error_model="numpy")
def integrate_contact(
    contact: ContactSpring,
    slopes: Field,
    step: float,
    substeps: int,
    compression: Field,
    velocity: Field,
) -> None:
    """Fill compression and velocity at all samples from those at the first.

    `slopes` holds the slope of the profile between each two samples.
    """
    c, v = compression[0], velocity[0]
    h = step / substeps
    for n in range(slopes.size):
        s = slopes[n]
        for _ in range(substeps):
            c1 = s - v
            v1 = mass_acceleration(contact, c, c1)
            c2 = s - (v + h * (1 / 5) * v1)
            v2 = mass_acceleration(contact, c + h * (1 / 5) * c1, c2)
            c3 = s - (v + h * ((3 / 40) * v1 + (9 / 40) * v2))
            v3 = mass_acceleration(contact, c + h * ((3 / 40) * c1 + (9 / 40) * c2), c3)
            c4 = s - (v + h * _fourth_stage(v1, v2, v3))
            v4 = mass_acceleration(contact, c + h * _fourth_stage(c1, c2, c3), c4)
            c5 = s - (v + h * _fifth_stage(v1, v2, v3, v4))
            v5 = mass_acceleration(contact, c + h * _fifth_stage(c1, c2, c3, c4), c5)
            c6 = s - (v + h * _sixth_stage(v1, v2, v3, v4, v5))
            v6 = mass_acceleration(contact, c + h * _sixth_stage(c1, c2, c3, c4, c5), c6)
            c += h * _fifth_order(c1, c3, c4, c5, c6)
            v += h * _fifth_order(v1, v3, v4, v5, v6)
        compression[n + 1] = c
        velocity[n + 1] = v
