"""A solved roller read along its length: what presses on its ends, where the load lies, how thin the film is there.

Both bodies are elastic half-spaces: that a real roller's end is a free surface, which softens a flush edge, is left
out. The pressure on an end without relief is singular there, and grows with the number of cells.
"""

from dataclasses import dataclass

import numpy as np

from asperity.arrays import Field
from asperity.ehl.solution import ContactSolution

END = 0.05  # share of the length, at either end, that counts as the end
LOADED = 0.01  # of the mean load per length, from which a place counts as loaded


@dataclass(frozen=True, slots=True, kw_only=True)
class AlongRoller:
    """Load per length [N/m], largest pressure [Pa] and least gap [m] of every line of cells on the roller, at y [m].

    `length` [m] is that between the chamfers, `load` [N] what all lines carry.
    """

    y: Field
    line_load: Field
    pressure: Field
    gap: Field
    length: float
    load: float

    @property
    def edge_pressure(self) -> float:
        """Largest pressure on the outer twentieth of the length, of either end [Pa]; 0 where that is off the grid."""
        return float(self.pressure[self._outer].max(initial=0.0))

    @property
    def end_film(self) -> float | None:
        """Least gap on the same [m]; None where that is off the grid."""
        return float(self.gap[self._outer].min()) if self._outer.any() else None

    @property
    def largest_line_load(self) -> float:
        """[N/m]."""
        return float(self.line_load.max())

    @property
    def loaded_share(self) -> float:
        """Share of the length that carries more than a hundredth of the mean load per length."""
        loaded = np.count_nonzero(self.line_load > LOADED * self.load / self.length)
        return float(min(1.0, loaded * (self.y[1] - self.y[0]) / self.length))

    @property
    def load_centre(self) -> float:
        """Where the load acts [m from the middle]."""
        return float((self.line_load * self.y).sum() / self.line_load.sum())

    @property
    def moment(self) -> float:
        """What the load's place has to be held against [N m]: load times its distance from the middle."""
        return self.load * self.load_centre

    @property
    def _outer(self) -> Field:
        return np.asarray(np.abs(self.y) >= (0.5 - END) * self.length)


def along_roller(solution: ContactSolution) -> AlongRoller | None:
    """A solved roller along its length; None for a contact of another geometry."""
    conditions, grid = solution.conditions, solution.grid
    if conditions.geometry != "roller":
        return None
    on = np.abs(grid.y) < conditions.end
    pressure = solution.pressure[:, on]
    return AlongRoller(
        y=grid.y[on],
        line_load=pressure.sum(axis=0) * grid.spacing[0],
        pressure=pressure.max(axis=0),
        gap=solution.gap[:, on].min(axis=0),
        length=conditions.line_length,
        load=float(pressure.sum()) * grid.spacing[0] * grid.spacing[1],
    )
