"""Layer of oil that the bodies carry into a contact."""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive


@dataclass(frozen=True, slots=True)
class InletLayer:
    """Thickness of the oil on both bodies together before the contact, at ambient pressure.

    Parameters
    ----------
    thickness : [m], at each place of `y`; a single one is uniform
    y : places across rolling [m], increasing; constant beyond the ends

    Raises
    ------
    BadInput
        for a thickness that is not positive, or places that do not increase.
    """

    thickness: tuple[float, ...]
    y: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        for thickness in self.thickness:
            require_positive("inlet layer", thickness, "m")
        if len(self.thickness) != len(self.y) or np.any(np.diff(self.y) <= 0.0):
            raise BadInput(
                f"an inlet layer needs a thickness for each place of an increasing y, got "
                f"{len(self.thickness)} for {len(self.y)}"
            )

    @classmethod
    def uniform(cls, thickness: float) -> "InletLayer":
        """Return a layer of one thickness [m]."""
        return cls((float(thickness),))

    def thickness_at(self, y: Field) -> Field:
        """Return the thickness [m] at places across rolling [m]; any shape."""
        return np.interp(y, self.y, self.thickness)

    def scaled(self, length: float, gap: float) -> "InletLayer":
        """Return the layer in other units of length across rolling and of thickness [m]."""
        return InletLayer(
            tuple(thickness / gap for thickness in self.thickness),
            tuple(place / length for place in self.y),
        )
