"""Interface of wear mechanisms: input and result of one mechanism in a jump.

A jump solves the contact at several positions of a body's track (`Patch`), applies the law of
removal, and then calls every mechanism in turn (`Mechanism`). The mechanism's change is added to
the heights, its volume is booked, and its state is stored with the run. A mechanism keeps no
state itself and draws random numbers from the passage's `rng` only, so that an interrupted run
resumes with identical results.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol

import numpy as np

from asperity.contact.grid import Grid
from asperity.core.arrays import Field

MechanismState = Mapping[str, Field]


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Material and `speed` [m/s] of a body; `hardness` is None if elastic. Moduli in Pa."""

    youngs_modulus: float
    poisson_ratio: float
    hardness: float | None
    speed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """Contact solved at one position of the track.

    Maps have the track's shape and lie in the body's own frame, shifted by whole cells; 0 outside
    the contact. `pressure` is that of oil and asperities together, `asperity_pressure` that of
    cells where the bodies touch (0 elsewhere), `shear` the shear stress of the other body along +x
    [Pa]; `film` [m] is infinite outside the contact; `temperature` [K above ambient] is that of
    this body's surface, None unless a law or mechanism needs it (`needs_temperature`).
    """

    pressure: Field
    asperity_pressure: Field
    shear: Field
    film: Field
    temperature: Field | None = None


@dataclass(frozen=True, kw_only=True)
class Passage:
    """Input of a mechanism: one jump of one body.

    Parameters
    ----------
    body : 0 or 1, the first or the second
    grid : of the track, which repeats along x (rolling)
    heights : of the track after the jump's removal [m], shape (nx, ny); positive is material
    removed : depth that the wear law removes in this jump [m], 0 or more
    patches : contact at positions spaced evenly along the track: the mean over them, times the
        track's length, is a point's integral along a passage
    material : of this body
    sliding_speed : difference of both surfaces' speeds, 0 or more [m/s]
    half_width : of the Hertz zone along rolling [m]
    overrollings : number of times each point of the track has passed the contact before the jump
    jump : number of over-rollings in the jump; need not be whole
    seconds : duration of the jump
    boundary_friction : shear over pressure where bodies touch
    rng : random numbers of this jump, body and mechanism; identical when the jump is recomputed
    state : returned by the mechanism in the previous jump; empty at first
    """

    body: int
    grid: Grid
    heights: Field
    removed: Field
    patches: tuple[Patch, ...]
    material: Body
    sliding_speed: float
    half_width: float
    overrollings: float
    jump: float
    seconds: float
    boundary_friction: float
    rng: np.random.Generator
    state: MechanismState = field(default_factory=dict)

    @property
    def loaded_film(self) -> float:
        """Pressure-weighted mean film over all positions [m]."""
        pressed = [
            (patch.pressure[patch.pressure > 0.0], patch.film[patch.pressure > 0.0])
            for patch in self.patches
        ]
        load = sum(float(pressure.sum()) for pressure, _ in pressed)
        return (
            sum(float(pressure @ film) for pressure, film in pressed) / load if load > 0.0 else 0.0
        )


@dataclass(frozen=True, kw_only=True)
class Change:
    """Result of a mechanism in one jump.

    `heights_change` [m] is added to the body's heights (negative: removed). `transferred` [m], 0 or
    more, is the part of it that moves to the other body, on the body's own track: its volume is
    booked as the other's gain, the rest of `heights_change` as worn off (or, if positive, gained).
    `state` is passed to the next call; equal arrays must give equal results. `facts` are SI numbers
    of this jump by name, which become columns of the result. `longest` is the largest number of
    over-rollings of this body in the next jump for which the mechanism is resolved.
    """

    heights_change: Field
    state: MechanismState = field(default_factory=dict)
    facts: Mapping[str, float] = field(default_factory=dict)
    transferred: Field | None = None
    longest: float = math.inf


class Mechanism(Protocol):
    """Law that roughens a surface: a frozen dataclass of parameters, called per jump and body."""

    needs_temperature: ClassVar[bool]

    def __call__(self, passage: Passage) -> Change:
        """Return the change in this jump."""
        ...
