"""Profile of a roller along its length, and its load distribution by the slice model.

Each slice deflects as if the load were uniform over the loaded length. This is accurate enough for
the design of a grid and for an initial guess, not for the pressure at the ends.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from asperity.contact.hertz import line_contact
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive

LOGARITHM_FLOOR = 1e-6  # smallest 1 - (2y/L)² of a logarithm without an end drop
MAX_TILT = 0.05  # rad
STEEP_CHAMFER = 0.1  # slope above which a chamfer carries no load
# 0.3033 of b/L by Johns and Gohar: deflection of a strip's end relative to its middle
END_RATIO = 0.5 * math.exp(-0.5)
SHARP_END_LOAD = 0.8  # end over mean load per length, above which the end pressure is singular
SLICES = 400
BISECTIONS = 60


@dataclass(frozen=True, kw_only=True)
class RollerShape:
    """Profile drop of a roller along its length L, the sum over both bodies of the contact.

    The drop at y from the middle is `amplitude` ln(1/(1 - k s²)), s = (2|y| - `flat`)/(L - `flat`)
    beyond the straight middle, plus (|y| - `flat`/2)²/2 over `crown_radius`. k is 1, or such that
    the drop at the end is `end_drop`. L is the length between the chamfers. `tilt` opens the gap
    towards +y. By default the roller is straight.

    Parameters
    ----------
    amplitude : amplitude of the logarithm [m]
    end_drop : drop of the logarithm at the roller's end [m]; None: no end drop, the logarithm is
        limited to 13.8 amplitudes
    crown_radius : radius of a circular crown [m]; None: no crown
    flat : length of the straight middle [m]
    chamfer : length of the chamfer at each end, along the roller [m]
    chamfer_angle : angle of the chamfer to the roller's side [rad]
    tilt : misalignment in the plane of the roller's axis and the load [rad]

    Raises
    ------
    BadInput
        A length is negative, an end drop has no logarithm, or the tilt exceeds 0.05 rad.
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
                "chamfer_angle must lie between 0 and 90 degrees, got "
                f"{math.degrees(self.chamfer_angle):g}"
            )
        if not abs(self.tilt) <= MAX_TILT:
            raise BadInput(
                f"tilt must lie between -0.05 and 0.05 rad, got {self.tilt:g} rad; bearings "
                "tolerate 0.001"
            )

    @classmethod
    def johns_gohar(
        cls, load: float, length: float, radius: float, reduced_modulus: float
    ) -> "RollerShape":
        """Return the logarithmic profile that distributes a load [N] evenly over a length [m].

        z = w'/(πE*) ln{1/[1 - (1 - 0.3033 b/a)(2y/L)²]} with the Hertz half-width b and a = L/2.
        Unlike Lundberg's profile its end drop is finite.
        Source: P. M. Johns, R. Gohar, Tribology International 14 (1981) 131.
        """
        amplitude = load / length / (math.pi * reduced_modulus)
        half_width = line_contact(load, length, radius, reduced_modulus).half_widths[0]
        return cls(
            amplitude=amplitude,
            end_drop=-amplitude * math.log(END_RATIO * 2.0 * half_width / length),
        )

    @classmethod
    def iso(cls, diameter: float, length: float) -> "RollerShape":
        """Return the ISO 16281 profile for a cylindrical roller of unknown profile; one contact."""
        if length <= 2.5 * diameter:
            return cls(amplitude=0.00035 * diameter)
        return cls(amplitude=0.0005 * diameter, flat=length - 2.5 * diameter)

    def tilted(self, tilt: float) -> "RollerShape":
        """Return a copy with another tilt [rad]."""
        return replace(self, tilt=tilt)

    def between_chamfers(self, length: float) -> float:
        """Return the length [m] between the chamfers; BadInput if the parts exceed the length."""
        between = length - 2.0 * self.chamfer
        if between <= self.flat:
            parts = f"chamfers of 2 x {self.chamfer:g} m and a straight middle of {self.flat:g} m"
            raise BadInput(f"a roller of {length:g} m has no room for {parts}; shorten them")
        return between

    def ends(self, length: float) -> float:
        """Return half of the length [m] that can carry load; a steep chamfer carries none."""
        between = self.between_chamfers(length)
        return 0.5 * (between if math.tan(self.chamfer_angle) > STEEP_CHAMFER else length)

    def drop(self, y: Field, length: float) -> Field:
        """Return the drop of the surface [m] at y from the middle [m]; constant beyond the ends."""
        between = self.between_chamfers(length)
        side = np.minimum(np.abs(y), between / 2.0)
        from_flat = np.maximum(side - self.flat / 2.0, 0.0)
        drop = self.tilt * y
        if self.amplitude > 0.0:
            k = 1.0 if self.end_drop is None else -math.expm1(-self.end_drop / self.amplitude)
            argument = 1.0 - k * (2.0 * from_flat / (between - self.flat)) ** 2
            drop = drop - self.amplitude * np.log(np.maximum(argument, LOGARITHM_FLOOR))
        if self.crown_radius is not None:
            drop = drop + from_flat**2 / (2.0 * self.crown_radius)
        on_chamfer = np.clip(np.abs(y) - between / 2.0, 0.0, self.chamfer)
        return np.asarray(drop + math.tan(self.chamfer_angle) * on_chamfer)


class SlicedLoad(NamedTuple):
    """Load per length [N/m] at positions y along a roller [m], and the approach [m]."""

    y: Field
    line_load: Field
    approach: float

    @property
    def peak(self) -> float:
        """Maximum over mean load per length."""
        return float(self.line_load.max() / self.line_load.mean())

    @property
    def on_end(self) -> float:
        """Load per length on the more loaded end over the mean."""
        return float(max(self.line_load[0], self.line_load[-1]) / self.line_load.mean())

    @property
    def sharp(self) -> bool:
        """True if an end is loaded so much that the pressure of half-spaces is singular there."""
        return self.on_end > SHARP_END_LOAD

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the loaded length [m]."""
        loaded = self.y[self.line_load > 0.0]
        half = 0.5 * (self.y[1] - self.y[0])
        return float(loaded[0] - half), float(loaded[-1] + half)


@lru_cache(maxsize=64)
def sliced_load(
    shape: RollerShape, length: float, load: float, radius: float, reduced_modulus: float
) -> SlicedLoad:
    """Compute the load distribution along a dry roller by independent slices.

    A slice under w' deflects by w'/(πE*) (2 ln(2 l/a) + 1), like the middle of a strip of the
    loaded length l. Source: K. L. Johnson, Contact Mechanics (1985), section 5.6.

    Examples
    --------
    >>> from asperity.contact.rollers import RollerShape, sliced_load
    >>> shape = RollerShape(crown_radius=2.0)
    >>> sliced = sliced_load(shape, length=0.01, load=1000.0, radius=0.01, reduced_modulus=227e9)
    >>> f"{sliced.line_load.max() / 1e3:.0f} N/mm"
    '214 N/mm'
    """
    between = shape.between_chamfers(length)
    y = between * ((np.arange(SLICES) + 0.5) / SLICES - 0.5)
    drop = shape.drop(y, length)
    stiffness = math.pi * reduced_modulus
    loaded_length, mean = between, load / between
    low = float(drop.min())
    high = float(drop.min()) + 1e4 * mean / stiffness
    for _ in range(BISECTIONS):
        approach = 0.5 * (low + high)
        deflection = np.maximum(approach - drop, 0.0)
        line_load = np.full(SLICES, mean)
        for _ in range(8):
            half_width = np.sqrt(4.0 * line_load * radius / stiffness)
            line_load = (
                stiffness
                * deflection
                / (2.0 * np.log(2.0 + 2.0 * loaded_length / np.maximum(half_width, 1e-12)) + 1.0)
            )
        loaded_length = max(float((line_load > 0.0).mean()), 1.0 / SLICES) * between
        low, high = (approach, high) if line_load.mean() < mean else (low, approach)
    return SlicedLoad(y, line_load * (mean / line_load.mean()), approach)
