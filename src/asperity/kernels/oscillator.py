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
def _third_stage(k1: float, k2: float) -> float:
    """Return the mean slope that leads to the third stage."""
    return (3 / 40) * k1 + (9 / 40) * k2


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


@njit(cache=True, inline="always")
def _slopes(contact: ContactSpring, s: float, c: float, v: float) -> tuple[float, float]:
    """Return the slopes of compression and velocity."""
    rate = s - v
    return rate, mass_acceleration(contact, c, rate)


@njit(cache=True, inline="always")
def _step(contact: ContactSpring, s: float, h: float, c: float, v: float) -> tuple[float, float]:
    """Return compression and velocity after a step of length `h` on a slope `s`."""
    c1, v1 = _slopes(contact, s, c, v)
    c2, v2 = _slopes(contact, s, c + h * (1 / 5) * c1, v + h * (1 / 5) * v1)
    c3, v3 = _slopes(contact, s, c + h * _third_stage(c1, c2), v + h * _third_stage(v1, v2))
    c4, v4 = _slopes(
        contact, s, c + h * _fourth_stage(c1, c2, c3), v + h * _fourth_stage(v1, v2, v3)
    )
    c5, v5 = _slopes(
        contact, s, c + h * _fifth_stage(c1, c2, c3, c4), v + h * _fifth_stage(v1, v2, v3, v4)
    )
    c6, v6 = _slopes(
        contact,
        s,
        c + h * _sixth_stage(c1, c2, c3, c4, c5),
        v + h * _sixth_stage(v1, v2, v3, v4, v5),
    )
    return c + h * _fifth_order(c1, c3, c4, c5, c6), v + h * _fifth_order(v1, v3, v4, v5, v6)


@njit(cache=True, fastmath={"contract", "nsz"})
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
        for _ in range(substeps):
            c, v = _step(contact, slopes[n], h, c, v)
        compression[n + 1] = c
        velocity[n + 1] = v
