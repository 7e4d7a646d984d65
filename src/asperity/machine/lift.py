"""Lift of a cam over its angle: harmonic, or a table of measured or designed lifts."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import BadInput

FEWEST_LIFTS = 12  # of a table, for a curvature
ON_BASE = 1e-3  # of the largest lift, below which the follower is on the base circle
MOST_DECIMALS = 8  # of a lift in mm
MAX_SPAN = math.tau  # rad


class LiftLaw(Protocol):
    """Interface of a lift law; angles [rad] from the nose."""

    @property
    def largest(self) -> float:
        """Largest lift [m]."""

    @property
    def ends(self) -> tuple[float, float]:
        """Angles between which contacts are evaluated: one flank where both are alike."""

    @property
    def symmetric(self) -> bool:
        """True if both flanks are alike."""

    def __call__(self, angle: float, derivative: int = 0) -> float:
        """Return the lift [m] or a derivative by the angle [m]; 0 on the base circle."""


@dataclass(frozen=True)
class HarmonicLift:
    """Lift s = (L/2)(1 + cos(π θ/β)) up to the half angle β."""

    largest: float
    half_angle: float
    symmetric: bool = True

    @property
    def ends(self) -> tuple[float, float]:
        """Nose and start of the lift."""
        return 0.0, self.half_angle

    def __call__(self, angle: float, derivative: int = 0) -> float:
        """Return the lift or a derivative [m]."""
        rate = math.pi / self.half_angle
        phase = rate * angle
        if abs(angle) > self.half_angle * (1.0 + 1e-12):
            return 0.0
        bend = 0.5 * self.largest * rate**derivative
        return (
            bend * (1.0 + math.cos(phase)),
            -bend * math.sin(phase),
            -bend * math.cos(phase),
        )[derivative]


@dataclass(frozen=True)
class TabulatedLift:
    """Lift by a table, as a smoothing spline; the nose is at its maximum.

    Curvature is a second derivative, which amplifies rounding: the spline deviates from the lifts
    by as much as their last decimal allows. `table` holds pairs of angle [rad], from any origin,
    and lift [m].

    Raises
    ------
    BadInput
        Fewer than twelve pairs, angles that do not rise or exceed a turn, negative lifts, or lifts
        whose maximum is at an end of the table.
    """

    table: tuple[tuple[float, float], ...]
    symmetric: bool = False

    def __post_init__(self) -> None:
        if len(self.table) < FEWEST_LIFTS:
            raise BadInput(
                f"lift_table must have at least {FEWEST_LIFTS} lifts, got {len(self.table)}; give "
                "one every degree or two"
            )
        angles, lifts = np.array(self.table).T
        if not np.all(np.isfinite(angles)) or not np.all(np.diff(angles) > 0.0):
            raise BadInput("lift_table must have rising angles in its first column; sort it")
        if angles[-1] - angles[0] > MAX_SPAN:
            span = math.degrees(angles[-1] - angles[0])
            raise BadInput(
                f"lift_table spans {span:.0f} deg, more than a turn; give one lift, in degrees of "
                "the cam"
            )
        if not np.all(np.isfinite(lifts)) or lifts.min() < -ON_BASE * lifts.max():
            raise BadInput(
                f"lift_table has a lift of {1e3 * lifts.min():.4g} mm; give positive ones"
            )
        if lifts.argmax() in (0, lifts.size - 1):
            raise BadInput(
                "lift_table has its largest lift at an end; give both flanks, and begin a table "
                "over a full turn on the base circle"
            )

    @cached_property
    def _spline(self) -> "tuple[scipy.interpolate.UnivariateSpline, float]":
        """Spline of the lift over the angle, and the angle of the nose."""
        angles, lifts = np.array(self.table).T
        allowed = angles.size * (_resolution(lifts) / math.sqrt(12.0)) ** 2
        spline = scipy.interpolate.UnivariateSpline(angles, lifts, k=5, s=allowed)
        top = int(lifts.argmax())
        nose = scipy.optimize.minimize_scalar(
            lambda angle: -float(spline([angle])[0]),
            bounds=(angles[top - 1], angles[top + 1]),
            method="bounded",
            options={"xatol": 1e-9},
        ).x
        return spline, float(nose)

    @property
    def largest(self) -> float:
        """Largest lift [m]."""
        return self(0.0)

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Start and end of the lift."""
        angles, lifts = np.array(self.table).T
        above = np.flatnonzero(lifts > ON_BASE * lifts.max())
        first = angles[max(above[0] - 1, 0)]
        last = angles[min(above[-1] + 1, angles.size - 1)]
        return float(first - self._spline[1]), float(last - self._spline[1])

    @property
    def rounding(self) -> float:
        """Root mean square of the table's lifts about the spline [m]."""
        angles, lifts = np.array(self.table).T
        return float(np.sqrt(np.mean((self._spline[0](angles) - lifts) ** 2)))

    def __call__(self, angle: float, derivative: int = 0) -> float:
        """Return the lift or a derivative [m]."""
        first, last = self.ends
        tolerance = 1e-9
        if not first - tolerance <= angle <= last + tolerance:
            return 0.0
        spline, nose = self._spline
        inside = min(max(angle, first), last)
        return float(spline([inside + nose], derivative)[0])


def _resolution(lifts: Field) -> float:
    """Return the largest step of 1, 2 or 5 in a decimal of which all lifts are multiples [m]."""
    steps = (factor * 10.0**-decimals for decimals in range(MOST_DECIMALS) for factor in (5, 2, 1))
    millimetres = 1e3 * lifts
    for step in steps:
        if np.allclose(np.round(millimetres / step) * step, millimetres, rtol=0.0, atol=1e-9):
            break
    return 1e-3 * step


def lift_law(
    lift: float | None, half_angle: float | None, table: Sequence[tuple[float, float]] | None
) -> LiftLaw:
    """Return the lift law of a cam; BadInput unless it is stated in exactly one way."""
    if table is not None:
        stated = [name for name, value in (("lift", lift), ("half_angle", half_angle)) if value]
        if stated:
            raise BadInput(f"lift_table and {stated[0]} both state the lift; give one of them")
        return TabulatedLift(tuple((float(angle), float(value)) for angle, value in table))
    if lift is None or half_angle is None:
        missing = "lift" if lift is None else "half_angle"
        raise BadInput(f"{missing} is missing; give lift and half_angle, or a lift_table")
    return HarmonicLift(lift, half_angle)
