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
            c4 = s - (v + h * ((44 / 45) * v1 - (56 / 15) * v2 + (32 / 9) * v3))
            v4 = mass_acceleration(
                contact, c + h * ((44 / 45) * c1 - (56 / 15) * c2 + (32 / 9) * c3), c4
            )
            c5 = s - (
                v
                + h
                * (
                    (19372 / 6561) * v1
                    - (25360 / 2187) * v2
                    + (64448 / 6561) * v3
                    - (212 / 729) * v4
                )
            )
            v5 = mass_acceleration(
                contact,
                c
                + h
                * (
                    (19372 / 6561) * c1
                    - (25360 / 2187) * c2
                    + (64448 / 6561) * c3
                    - (212 / 729) * c4
                ),
                c5,
            )
            c6 = s - (
                v
                + h
                * (
                    (9017 / 3168) * v1
                    - (355 / 33) * v2
                    + (46732 / 5247) * v3
                    + (49 / 176) * v4
                    - (5103 / 18656) * v5
                )
            )
            v6 = mass_acceleration(
                contact,
                c
                + h
                * (
                    (9017 / 3168) * c1
                    - (355 / 33) * c2
                    + (46732 / 5247) * c3
                    + (49 / 176) * c4
                    - (5103 / 18656) * c5
                ),
                c6,
            )
            c += h * (
                (35 / 384) * c1
                + (500 / 1113) * c3
                + (125 / 192) * c4
                - (2187 / 6784) * c5
                + (11 / 84) * c6
            )
            v += h * (
                (35 / 384) * v1
                + (500 / 1113) * v3
                + (125 / 192) * v4
                - (2187 / 6784) * v5
                + (11 / 84) * v6
            )
        compression[n + 1] = c
        velocity[n + 1] = v
