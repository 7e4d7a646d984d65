"""What a mechanism of wear is told of a jump over many over-rollings, and what it answers.

A jump takes one body's track through the contact at several positions (`Patch`), removes what the
law of removal says, and then asks every mechanism in turn (`Mechanism`): what it changes is added
to the heights, its volume is booked, and its own state is kept with the run. A mechanism keeps
nothing itself and draws from the passage's `rng` alone, so that a run that was killed goes on as
if it had not been.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import Grid
from asperity.core.arrays import Field

State = Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A body's material: `youngs_modulus`, `hardness` (None: elastic) [Pa], `poisson_ratio`; its `speed` [m/s]."""

    youngs_modulus: float
    poisson_ratio: float
    hardness: float | None
    speed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Patch:
    """The contact, solved at one position of the track.

    Maps have the track's shape and lie in the body's own frame, rolled by whole cells: 0 beside
    the contact. `pressure` oil and asperities together, `asperity_pressure` that of cells where
    bodies touch, 0 elsewhere, `shear` what the other body drags along +x with [Pa]; `film` [m],
    infinite beside the contact; `temperature` [K above ambient] of this body's surface, None
    unless a law or mechanism asks for it (`needs_temperature`).
    """

    pressure: Field
    asperity_pressure: Field
    shear: Field
    film: Field
    temperature: Field | None = None


@dataclass(frozen=True, kw_only=True)
class Passage:
    """What one jump knows of one body.

    Parameters
    ----------
    body : 0 or 1, the first or the second
    grid : of the track, which repeats along x (rolling)
    heights : of the track now, what the jump's removal took already off [m], (nx, ny); positive is material
    removed : what the law of removal took off in this jump [m], 0 or more
    patches : the contact at positions that lie evenly along the track: a point's mean over them, times the track's
        length, is its integral along a passage
    material : of this body
    sliding_speed : difference of both surfaces' speeds, 0 or more [m/s]
    half_width : of the Hertz zone along rolling [m]
    overrollings : how often each point of the track has passed the contact before the jump
    jump : how often it passes in the jump; not a whole number
    seconds : that the jump lasts
    boundary_friction : shear over pressure where bodies touch
    rng : numbers of this jump, body and mechanism; the same whenever the jump is computed again
    state : what the mechanism answered last time; empty at first
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
    state: State = field(default_factory=dict)

    @property
    def film_inside(self) -> float:
        """Film that the pressure rests on: its mean over all positions, weighted with the pressure [m]."""
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
    """What a mechanism does in a jump.

    `heights_change` [m] is added to the body's heights (negative: taken off); `transferred` [m], 0
    or more, is what of it goes over to the other body, on the body's own track: its volume is
    booked as the other's gain, all else that `heights_change` sums to as worn off (or, where
    positive, as stuck on). `state` comes back next time; equal arrays must give equal answers.
    `facts` are numbers of this jump by name, SI: rows of the result hold them. `longest` is how
    many over-rollings of this body the next jump may take at most, so that what the mechanism
    changes is seen.
    """

    heights_change: Field
    state: State = field(default_factory=dict)
    facts: Mapping[str, float] = field(default_factory=dict)
    transferred: Field | None = None
    longest: float = math.inf


class Mechanism(Protocol):
    """A law that roughens: a frozen dataclass of parameters that is called once a jump and body."""

    needs_temperature: ClassVar[bool]

    def __call__(self, passage: Passage) -> Change:
        """What it changes in the jump."""
        ...
