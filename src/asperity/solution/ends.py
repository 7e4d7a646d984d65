"""Load, pressure and film of a solved roller along its length, and the values at its ends.

Both bodies are elastic half-spaces. The free end surface of a real roller, which softens a flush
edge, is not modelled. Without relief the pressure on an end is singular and grows with the number
of cells, so that no value is given.
"""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.ehl import ContactSolution, Scales
from asperity.ehl.roller_profile import RollerProfile

MIN_LOADED = 0.01  # share of the mean load per length from which a line of cells counts as loaded
# Load per length on an end (by slices) over the mean, from which the end counts as loaded and its
# lines of cells must be close.
LOADED_END = 0.2
MAX_SPACING = {"edge_pressure": 0.5, "end_film": 0.25}  # of lines at loaded ends [half-widths]
MAX_RELATIVE_ERROR = 0.5  # largest error of an end value, over the value, that is reported


@dataclass(frozen=True, slots=True, kw_only=True)
class EndValue:
    """Value at a roller's ends on the grid, with its error (None if unknown).

    `reason` is the reason why the value is not determined; empty if it is.
    """

    on_grid: float
    error: float | None
    reason: str

    @property
    def value(self) -> float | None:
        """Value, or None if it is not determined."""
        return None if self.reason else self.on_grid

    @property
    def bar(self) -> float | None:
        """Error of the value, or None if the value is not determined."""
        return None if self.reason else self.error


@dataclass(frozen=True, slots=True, kw_only=True)
class AxialDistribution:
    """Load per length [N/m], pressures [Pa] and minimum gap [m] of each line of cells at y [m].

    `pressure` is the largest of a line. `dome` is the largest up to mid-contact, before the outlet
    spike of the oil, which depends on the cells along x everywhere and is no property of the ends.
    `length` [m] is the length between the chamfers, `load` [N] the sum over all lines.
    `edge_pressure` [Pa] is the largest dome and `end_film` [m] the minimum gap on the outer
    twentieth of the length at either end; None if that lies outside the grid.
    """

    y: Field
    line_load: Field
    pressure: Field
    dome: Field
    gap: Field
    length: float
    load: float
    edge_pressure: EndValue | None
    end_film: EndValue | None

    @property
    def middle_pressure(self) -> float:
        """Dome pressure at mid-length [Pa]; 0 outside the grid."""
        return float(np.interp(0.0, self.y, self.dome, left=0.0, right=0.0))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """End values that this solution does not determine, one sentence with the reason each."""
        figures = {"edge_pressure_pa": self.edge_pressure, "end_film_m": self.end_film}
        return tuple(
            f"The {quantity(key).name} is not determined: {figure.reason}."
            for key, figure in figures.items()
            if figure is not None and figure.reason
        )

    @property
    def largest_line_load(self) -> float:
        """Largest load per length [N/m]."""
        return float(self.line_load.max())

    @property
    def loaded_share(self) -> float:
        """Share of the length that carries more than 1 % of the mean load per length."""
        loaded = np.count_nonzero(self.line_load > MIN_LOADED * self.load / self.length)
        return float(min(1.0, loaded * (self.y[1] - self.y[0]) / self.length))

    @property
    def load_centre(self) -> float:
        """Distance of the load's centre from mid-length [m]."""
        return float((self.line_load * self.y).sum() / self.line_load.sum())

    @property
    def moment(self) -> float:
        """Tilting moment [N m]: load times its distance from mid-length."""
        return self.load * self.load_centre


def axial_distribution(solution: ContactSolution) -> AxialDistribution | None:
    """Evaluate a solved roller along its length; None for another geometry."""
    conditions = solution.conditions
    grid = solution.grid
    if conditions.geometry != "roller":
        return None
    scales = Scales.from_conditions(conditions, solution.lubricant)
    profile = RollerProfile(conditions, scales.length, scales.gap)
    y = grid.y / scales.length
    central_pressure = profile.central_pressure(grid.x, solution.pressure, grid.spacing[0])
    gap = solution.gap.min(axis=0)
    on_roller = profile.inside(y)
    pressures = profile.end_values(y, central_pressure)
    films = profile.end_values(y, gap)
    end_values = (
        {"edge_pressure": float(pressures.max()), "end_film": float(films.min())}
        if films.size
        else {}
    )
    at_ends = {name: _at_end(solution, name, value) for name, value in end_values.items()}
    return AxialDistribution(
        y=grid.y[on_roller],
        line_load=solution.pressure[:, on_roller].sum(axis=0) * grid.spacing[0],
        pressure=solution.pressure[:, on_roller].max(axis=0),
        dome=central_pressure[on_roller],
        gap=gap[on_roller],
        length=conditions.line_length,
        load=float(solution.pressure[:, on_roller].sum()) * grid.spacing[0] * grid.spacing[1],
        edge_pressure=at_ends.get("edge_pressure"),
        end_film=at_ends.get("end_film"),
    )


def _at_end(solution: ContactSolution, name: str, value: float) -> EndValue:
    error = solution.convergence.error
    error_bar = None if error is None else getattr(error, name)
    return EndValue(
        on_grid=value, error=error_bar, reason=_why_not(solution, name, value, error_bar)
    )


def _why_not(solution: ContactSolution, name: str, value: float, error_bar: float | None) -> str:
    """Return the reason why an end value is not determined; empty if it is."""
    conditions = solution.conditions
    load = solution.conditions.sliced_load
    spacing = solution.grid.spacing[1] / conditions.hertz.half_widths[0]
    hardness = conditions.hardness
    if name == "edge_pressure" and hardness is not None and value >= hardness * (1.0 - 1e-6):
        return ""  # the cap is the limit
    if name == "edge_pressure" and load.sharp:
        return (
            "the profile relieves the ends too little, so that the pressure of elastic "
            "half-spaces is singular there and grows with the number of cells"
        )
    if solution.lubricant is None and name == "end_film":
        return ""
    limit = MAX_SPACING[name]
    if load.on_end > LOADED_END and spacing > limit * (1.0 + 1e-9):
        required = int(np.ceil(solution.grid.cells[1] * spacing / limit))
        return (
            f"the lines of cells are {spacing:.2g} half-widths apart, but loaded ends require "
            f"{limit:g}; use {required} cells along the roller"
        )
    scale = conditions.hertz.p_max if name == "edge_pressure" else solution.options.contact_film
    if error_bar is None or error_bar <= MAX_RELATIVE_ERROR * max(value, scale):
        return ""
    entry = quantity({"edge_pressure": "edge_pressure_pa", "end_film": "end_film_m"}[name])
    return (
        f"its value on this grid, {entry.text(value)}, is too far from the value extrapolated "
        f"from coarser grids; use {2 * solution.grid.cells[1]} cells along the roller"
    )
