"""The paper's contact, defined by hand, for most of the tests."""

from dataclasses import dataclass

import numpy as np

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian
from asperity.surface import gaussian_surface

RADIUS, ETA0 = 5.4e-3, 0.096


@dataclass(frozen=True)
class FirstPrinted:
    """Density law of Dowson and Higginson (1966) with unrounded coefficients."""

    rho0: float = 880.0

    def __call__(self, p):
        return self.rho0 * (5.9e8 + 1.34 * p) / (5.9e8 + p)

    def slope(self, p):
        return self.rho0 * 0.34 * 5.9e8 / (5.9e8 + p) ** 2


def contact(*, speed=1.91, **changes):
    given = {
        "pair": ElasticPair((200e9, 200e9), (0.3, 0.3)),
        "geometry": "line",
        "radius": RADIUS,
        "load": 500.0,
        "length": 0.01,
        "surface_speeds": (1.1 * speed, 0.9 * speed),
    }
    return ContactConditions(**(given | changes))


def barus(alpha=18.2e-9):
    return Lubricant(
        viscosity=Barus(ETA0, alpha), density=DowsonHigginson(880.0), rheology=Newtonian()
    )


def grid(cells, x=(-4.5, 1.9), y=(-1.6, 1.6)):
    """Return a grid; `x` and `y` are in Hertz half-widths."""
    a = contact().hertz.half_widths[0]
    return Grid(cells, (x[0] * a, y[0] * a), (x[1] * a, y[1] * a))


def rough(on, sq, seed=5, correlation_length=20e-6):
    return gaussian_surface(
        on, sq=sq, correlation_length=correlation_length, rng=np.random.default_rng(seed)
    )
