"""The shape of a roller along its length, and how it shares a load by slices: pure functions of SI numbers.

A slice answers as if the load were even on all of the loaded length: what a grid or a first guess
has to know, not what presses on the ends. Knows neither oil nor grid.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from asperity.contact.hertz import line_contact
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

OUTERMOST = 1e-6  # of 1 - (2y/L)²: as near to the end as a logarithm without an end drop goes
STEEPEST_TILT = 0.05  # rad
STEEP = 0.1  # slope of a chamfer from which the roller ends where it begins
END_SHARE = 0.5 * math.exp(
    -0.5
)  # 0.3033 of b/L: Johns and Gohar's, the deflection of a strip's end against its middle
SHARP = 0.8  # load per length on an end, over the mean, from which its pressure has no limit
SLICES = 400
ROUNDS = 60


@dataclass(frozen=True, kw_only=True)
class RollerShape:
    """How far a roller's surface falls back along its length L, both bodies of the contact together.

    The drop at y from the middle is `amplitude` ln(1/(1 - k s²)), s = (2|y| - `flat`)/(L - `flat`)
    beyond the straight middle, with k = 1 or what makes the drop at the end `end_drop`; and (|y| -
    `flat`/2)²/2 over `crown_radius`. L is the length between the chamfers. `tilt` opens the gap
    towards +y. All 0: a straight roller.

    Parameters
    ----------
    amplitude : of the logarithm [m]
    end_drop : of the logarithm at the roller's end [m]; None: it has none, and is cut off at 13.8 amplitudes
    crown_radius : of a circular crown [m]; None: there is none
    flat : length of the straight middle [m]
    chamfer : length along the roller of the bevel at each end [m]
    chamfer_angle : of the bevel to the roller's side [rad]
    tilt : of the roller against the other body, in the plane of its axis and the load [rad]

    Raises
    ------
    BadInput
        for a negative length, an end drop without a logarithm, or a tilt beyond 0.05 rad.
    """

    amplitude: float = 0.0
    end_drop: float | None = None
    crown_radius: float | None = None
    flat: float = 0.0
    chamfer: float = 0.0
    chamfer_angle: float = math.pi / 4.0
    tilt: float = 0.0

    def __post_init__(self) -> None:
        for name in ("amplitude", "flat", "chamfer"):
            if not 0.0 <= (value := getattr(self, name)) < math.inf:
                raise BadInput(
                    f"{name} must be 0 m or more, got {value:g} m; leave it out for none"
                )
        for name in ("end_drop", "crown_radius"):
            if (value := getattr(self, name)) is not None:
                require_positive(name, value, "m")
        if self.end_drop is not None and self.amplitude == 0.0:
            raise BadInput(
                f"end_drop of {self.end_drop:g} m belongs to a logarithm; give its amplitude too"
            )
        if not 0.0 < self.chamfer_angle < math.pi / 2.0:
            raise BadInput(
                f"chamfer_angle must lie between 0 and 90 degrees, got {math.degrees(self.chamfer_angle):g}"
            )
        if not abs(self.tilt) <= STEEPEST_TILT:
            raise BadInput(
                f"tilt must lie between -0.05 and 0.05 rad, got {self.tilt:g} rad; bearings bear 0.001"
            )

    @classmethod
    def johns_gohar(
        cls, load: float, length: float, radius: float, reduced_modulus: float
    ) -> "RollerShape":
        """The logarithm under which a load [N] lies evenly on a length [m], its ends rounded (Lundberg's is not).

        z = w'/(πE*) ln{1/[1 - (1 - 0.3033 b/a)(2y/L)²]} with b Hertz's half-width and a = L/2.
        Source: P. M. Johns, R. Gohar, Tribology International 14 (1981) 131.
        """
        amplitude = load / length / (math.pi * reduced_modulus)
        half_width = line_contact(load, length, radius, reduced_modulus).half_widths[0]
        return cls(
            amplitude=amplitude,
            end_drop=-amplitude * math.log(END_SHARE * 2.0 * half_width / length),
        )

    @classmethod
    def iso(cls, diameter: float, length: float) -> "RollerShape":
        """The profile that ISO 16281 takes where a cylindrical roller's is not known; of one contact."""
        if length <= 2.5 * diameter:
            return cls(amplitude=0.00035 * diameter)
        return cls(amplitude=0.0005 * diameter, flat=length - 2.5 * diameter)

    def tilted(self, tilt: float) -> "RollerShape":
        """The same, tilted [rad]."""
        return replace(self, tilt=tilt)

    def between_chamfers(self, length: float) -> float:
        """Length [m] of a roller of that length between its chamfers; BadInput where its parts are longer than it."""
        between = length - 2.0 * self.chamfer
        if between <= self.flat:
            parts = f"chamfers of 2 x {self.chamfer:g} m and a straight middle of {self.flat:g} m"
            raise BadInput(f"a roller of {length:g} m has no room for {parts}; shorten them")
        return between

    def ends(self, length: float) -> float:
        """Half of the length [m] of a roller that can bear: a steep chamfer ends it, as no cell shows its beginning."""
        between = self.between_chamfers(length)
        return 0.5 * (between if math.tan(self.chamfer_angle) > STEEP else length)

    def drop(self, y: Field, length: float) -> Field:
        """How far the surface falls back [m] at y from the middle [m]; past the ends as far as at them."""
        between = self.between_chamfers(length)
        side = np.minimum(np.abs(y), between / 2.0)
        beyond = np.maximum(side - self.flat / 2.0, 0.0)
        found = self.tilt * y
        if self.amplitude > 0.0:
            k = 1.0 if self.end_drop is None else -math.expm1(-self.end_drop / self.amplitude)
            open_share = 1.0 - k * (2.0 * beyond / (between - self.flat)) ** 2
            found = found - self.amplitude * np.log(np.maximum(open_share, OUTERMOST))
        if self.crown_radius is not None:
            found = found + beyond**2 / (2.0 * self.crown_radius)
        bevel = np.clip(np.abs(y) - between / 2.0, 0.0, self.chamfer)
        return np.asarray(found + math.tan(self.chamfer_angle) * bevel)


class SlicedLoad(NamedTuple):
    """Load per length [N/m] at places along a roller [m], and the approach that it takes [m]."""

    y: Field
    line_load: Field
    approach: float

    @property
    def peak(self) -> float:
        """Largest load per length over the mean of the whole length."""
        return float(self.line_load.max() / self.line_load.mean())

    @property
    def on_end(self) -> float:
        """Load per length on the more loaded end over the mean of the whole length."""
        return float(max(self.line_load[0], self.line_load[-1]) / self.line_load.mean())

    @property
    def sharp(self) -> bool:
        """Whether an end is so loaded that the pressure of half-spaces has no limit there."""
        return self.on_end > SHARP

    @property
    def ends(self) -> tuple[float, float]:
        """Where the loaded length begins and ends [m]."""
        loaded, half = self.y[self.line_load > 0.0], 0.5 * (self.y[1] - self.y[0])
        return float(loaded[0] - half), float(loaded[-1] + half)


@lru_cache(maxsize=64)
def sliced_load(
    shape: RollerShape, length: float, load: float, radius: float, reduced_modulus: float
) -> SlicedLoad:
    """The load along a dry roller by slices that know nothing of one another.

    A slice under w' gives way by w'/(πE*) (2 ln(2 l/a) + 1), as the middle of a strip of the
    loaded length l does. Source: K. L. Johnson, Contact Mechanics (1985), section 5.6.
    """
    between = shape.between_chamfers(length)
    y = between * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
    drop = shape.drop(y, length)
    stiffness = math.pi * reduced_modulus
    loaded, mean = between, load / between
    low, high = float(drop.min()), float(drop.min()) + 1e4 * mean / stiffness
    for _ in range(ROUNDS):
        approach = 0.5 * (low + high)
        pressed = np.maximum(approach - drop, 0.0)
        found = np.full(SLICES, mean)
        for _ in range(8):
            half_width = np.sqrt(4.0 * found * radius / stiffness)
            found = (
                stiffness
                * pressed
                / (2.0 * np.log(2.0 + 2.0 * loaded / np.maximum(half_width, 1e-12)) + 1.0)
            )
        loaded = max(float((found > 0.0).mean()), 1.0 / SLICES) * between
        low, high = (approach, high) if found.mean() < mean else (low, approach)
    return SlicedLoad(y, found * (mean / found.mean()), approach)
