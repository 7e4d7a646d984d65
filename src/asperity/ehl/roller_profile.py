"""Shape of the smooth bodies, and of a roller along its axis, in the solver's units.

The solver holds ambient pressure outside a roller: past its ends, and where its surface has dropped
so far that oil carries no pressure.
"""

from dataclasses import dataclass

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, Mask

# a²/R beyond contact; equals the gap before an inlet of 7.7 half-widths
NO_PRESSURE_GAP = 30.0
END_SHARE = 0.05  # share of the length at either end


@dataclass(frozen=True)
class RollerProfile:
    """Profile of a roller; Y in half-widths, gaps in a²/R."""

    conditions: ContactConditions
    length: float  # unit along the surface [m]
    gap: float  # unit across it [m]

    def drop(self, y: Field) -> Field:
        """Return the drop of the surface, shape (ny,); a wide gap outside the roller."""
        return np.asarray(
            np.where(self.outside(y), self._contact_drop + NO_PRESSURE_GAP, self._profile_drop(y))
        )

    def load(self, y: Field) -> Field:
        """Return the load per length, by slices, over its mean, shape (ny,)."""
        sliced = self.conditions.sliced_load
        return np.asarray(
            np.interp(y * self.length, sliced.y, sliced.line_load / sliced.line_load.mean())
        )

    def zone(self, x: Field, y: Field, share: float, spacing: tuple[float, float]) -> Mask:
        """Return the cells within `share` of the smooth dry contact by slices, shape (nx, ny).

        The central ones always belong to it.
        """
        (dx, dy) = spacing
        (low, high) = self.conditions.sliced_load.ends
        half = np.where(self.outside(y), 0.0, np.sqrt(self.load(y)))
        within = np.abs(y - 0.5 * (low + high) / self.length) <= max(
            0.5 * share * (high - low) / self.length, dy
        )
        return np.asarray(
            (np.abs(x)[:, None] <= np.maximum(share * half, dx)) & within & (half > 0.0)
        )

    def outside(self, y: Field) -> Mask:
        """Return the places outside the roller, shape (ny,)."""
        return np.asarray(
            ~self.inside(y) | (self._profile_drop(y) > self._contact_drop + NO_PRESSURE_GAP)
        )

    @staticmethod
    def central_pressure(x: Field, pressure: Field, dx: float) -> Field:
        """Return the largest pressure of every line up to its centre, shape (ny,).

        The outlet spike is excluded.
        """
        return np.asarray(pressure[x <= 0.5 * dx].max(axis=0))

    def end_values(self, y: Field, values: Field) -> Field:
        """Return values of lines on the outer twentieth at either end, with its inner border."""
        begins = (0.5 - END_SHARE) * self.conditions.line_length / self.length
        inside = self.inside(y)
        y, values = y[inside], values[inside]
        borders = [
            np.interp(place, y, values) for place in (-begins, begins) if y[0] <= place <= y[-1]
        ]
        return np.concatenate([values[np.abs(y) >= begins], borders])

    def inside(self, y: Field) -> Mask:
        """Return the places between the ends of the roller, shape (ny,)."""
        return np.asarray(np.abs(y) * self.length < self.conditions.end * (1.0 - 1e-9))

    @property
    def _contact_drop(self) -> float:
        """Largest drop at which the dry roller touches."""
        return self.conditions.sliced_load.approach / self.gap

    def _profile_drop(self, y: Field) -> Field:
        """Return the drop of the profile."""
        conditions = self.conditions
        return np.asarray(
            conditions.roller.drop(y * self.length, conditions.length or 0.0) / self.gap
        )


@dataclass(frozen=True, slots=True)
class BodyShape:
    """Shape and compliance of the smooth bodies.

    The gap grows as X^2/2 + `flatness` Y^2/2, or across a `roller` by its drop; `compliance` scales
    the half-space's deflection, V = compliance times the integral of P/distance; `aspect` is the
    Hertz half-width across over along rolling (infinite for a line); `periodic` refers to y.
    """

    flatness: float
    compliance: float
    aspect: float
    periodic: bool
    roller: RollerProfile | None = None

    def gap(self, x: Field, y: Field) -> Field:
        """Return the gap at H0 = 0, shape (x, y)."""
        across = self.flatness * (y**2 / 2.0) if self.roller is None else self.roller.drop(y)
        return np.asarray((x**2 / 2.0)[:, None] + across)

    def hertz(self, x: Field, y: Field) -> Field:
        """Return the smooth, dry pressure, for a roller by slices, shape (x, y)."""
        if self.roller is None:
            across = y / self.aspect
            return np.asarray(np.sqrt(np.maximum(1.0 - (x**2)[:, None] - across**2, 0.0)))
        load = np.where(self.roller.outside(y), 0.0, self.roller.load(y))
        return np.asarray(np.sqrt(np.maximum(load - (x**2)[:, None], 0.0)))
