"""A roller along its length, in the solver's units: how its surface falls back, what it may carry, where it ends.

A place is beyond the roller past its ends, and where its surface has fallen back so far that no
oil between the bodies carries any pressure: there the solver holds ambient pressure.
"""

from dataclasses import dataclass

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field, Mask

# a²/R from where the dry roller still touches: as far as before an inlet of 7.7 half-widths
FAR_APART = 30.0
END = 0.05  # share of the length, at either end, that counts as the end


@dataclass(frozen=True)
class Along:
    """Of a roller under these conditions; Y in half-widths, lengths across the gap in a²/R."""

    conditions: ContactConditions
    length: float  # unit along the surface [m]
    gap: float  # unit across it [m]

    def drop(self, y: Field) -> Field:
        """How far the surface falls back, shape (ny,); beyond the roller there is none, and the gap is wide."""
        return np.asarray(np.where(self.beyond(y), self._touching + FAR_APART, self._drop(y)))

    def load(self, y: Field) -> Field:
        """Load per length by slices over its mean, shape (ny,)."""
        sliced = self.conditions.sliced_load
        return np.asarray(
            np.interp(y * self.length, sliced.y, sliced.line_load / sliced.line_load.mean())
        )

    def zone(self, x: Field, y: Field, share: float, spacing: tuple[float, float]) -> Mask:
        """Cells within `share` of the smooth, dry contact by slices, at least the middle ones, shape (nx, ny)."""
        (dx, dy), (low, high) = spacing, self.conditions.sliced_load.ends
        half = np.where(self.beyond(y), 0.0, np.sqrt(self.load(y)))
        within = np.abs(y - 0.5 * (low + high) / self.length) <= max(
            0.5 * share * (high - low) / self.length, dy
        )
        return np.asarray(
            (np.abs(x)[:, None] <= np.maximum(share * half, dx)) & within & (half > 0.0)
        )

    def beyond(self, y: Field) -> Mask:
        """Places past the roller, shape (ny,)."""
        return np.asarray(~self.on(y) | (self._drop(y) > self._touching + FAR_APART))

    @staticmethod
    def dome(x: Field, pressure: Field, dx: float) -> Field:
        """Largest pressure of every line of cells up to its middle, before oil's spike at the outlet, shape (ny,)."""
        return np.asarray(pressure[x <= 0.5 * dx].max(axis=0))

    def at_ends(self, y: Field, values: Field) -> Field:
        """Values of lines on the outer twentieth of the length at either end, and where it begins."""
        begins, on = (0.5 - END) * self.conditions.line_length / self.length, self.on(y)
        y, values = y[on], values[on]
        borders = [
            np.interp(place, y, values) for place in (-begins, begins) if y[0] <= place <= y[-1]
        ]
        return np.concatenate([values[np.abs(y) >= begins], borders])

    def on(self, y: Field) -> Mask:
        """Places between the ends of the roller, shape (ny,)."""
        return np.asarray(np.abs(y) * self.length < self.conditions.end * (1.0 - 1e-9))

    @property
    def _touching(self) -> float:
        """Drop down to which the dry roller touches."""
        return self.conditions.sliced_load.approach / self.gap

    def _drop(self, y: Field) -> Field:
        conditions = self.conditions
        return np.asarray(
            conditions.roller.drop(y * self.length, conditions.length or 0.0) / self.gap
        )
