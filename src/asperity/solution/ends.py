"""A solved roller read along its length: what presses on its ends, where the load lies, how thin the film is there.

Both bodies are elastic half-spaces: that a real roller's end is a free surface, which softens a
flush edge, is left out. The pressure on an end without relief is singular there, and grows with
the number of cells: none is given then.
"""

from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.ehl import ContactSolution, Scales
from asperity.ehl.roller_profile import RollerProfile

LOADED = 0.01  # of the mean load per length, from which a place counts as loaded
# load per length on an end by slices, over the mean, from which it bears, and needs close lines of
# cells
BEARING = 0.2
CLOSE = {"edge_pressure": 0.5, "end_film": 0.25}  # half-widths that those may lie apart there
WIDEST = 0.5  # bar of a figure, over the figure, that still tells something


@dataclass(frozen=True, slots=True, kw_only=True)
class AtEnd:
    """A figure of a roller's ends as it is on the grid, and how far it may be off; None where nothing tells.

    `why` says why it is not determined; empty where it is.
    """

    on_grid: float
    error: float | None
    why: str

    @property
    def value(self) -> float | None:
        """The figure where it is determined."""
        return None if self.why else self.on_grid

    @property
    def bar(self) -> float | None:
        """Its error bar."""
        return None if self.why else self.error


@dataclass(frozen=True, slots=True, kw_only=True)
class AlongRoller:
    """Load per length [N/m], pressures [Pa] and least gap [m] of every line of cells on the roller, at y [m].

    `pressure` is the largest of a line, `dome` the largest up to the middle, before the spike that
    oil has at the outlet: the spike grows with the cells along x wherever it is, and is no matter
    of the ends. `length` [m] is that between the chamfers, `load` [N] what all lines carry.
    `edge_pressure` [Pa] is the largest dome and `end_film` [m] the least gap on the outer
    twentieth of the length, of either end; None where that is off the grid.
    """

    y: Field
    line_load: Field
    pressure: Field
    dome: Field
    gap: Field
    length: float
    load: float
    edge_pressure: AtEnd | None
    end_film: AtEnd | None

    @property
    def middle_pressure(self) -> float:
        """The dome at the middle of the length [Pa]; 0 where that is off the grid."""
        return float(np.interp(0.0, self.y, self.dome, left=0.0, right=0.0))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Which figures of the ends this solution cannot tell, and why, a sentence each."""
        figures = {"edge_pressure_pa": self.edge_pressure, "end_film_m": self.end_film}
        return tuple(
            f"The {quantity(key).name} is not determined: {figure.why}."
            for key, figure in figures.items()
            if figure is not None and figure.why
        )

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


def along_roller(solution: ContactSolution) -> AlongRoller | None:
    """A solved roller along its length; None for a contact of another geometry."""
    conditions, grid = solution.conditions, solution.grid
    if conditions.geometry != "roller":
        return None
    scales = Scales.from_conditions(conditions, solution.lubricant)
    along, y = RollerProfile(conditions, scales.length, scales.gap), grid.y / scales.length
    dome, gap = (
        along.central_pressure(grid.x, solution.pressure, grid.spacing[0]),
        solution.gap.min(axis=0),
    )
    on, pressures, films = along.inside(y), along.end_values(y, dome), along.end_values(y, gap)
    found = (
        {"edge_pressure": float(pressures.max()), "end_film": float(films.min())}
        if films.size
        else {}
    )
    at_ends = {name: _at_end(solution, name, value) for name, value in found.items()}
    return AlongRoller(
        y=grid.y[on],
        line_load=solution.pressure[:, on].sum(axis=0) * grid.spacing[0],
        pressure=solution.pressure[:, on].max(axis=0),
        dome=dome[on],
        gap=gap[on],
        length=conditions.line_length,
        load=float(solution.pressure[:, on].sum()) * grid.spacing[0] * grid.spacing[1],
        edge_pressure=at_ends.get("edge_pressure"),
        end_film=at_ends.get("end_film"),
    )


def _at_end(solution: ContactSolution, name: str, value: float) -> AtEnd:
    error = solution.convergence.error
    bar = None if error is None else getattr(error, name)
    return AtEnd(on_grid=value, error=bar, why=_why_not(solution, name, value, bar))


def _why_not(solution: ContactSolution, name: str, value: float, bar: float | None) -> str:
    """Why a figure of the ends is not determined; empty where it is."""
    conditions, load = solution.conditions, solution.conditions.sliced_load
    apart = solution.grid.spacing[1] / conditions.hertz.half_widths[0]
    hardness = conditions.hardness
    if name == "edge_pressure" and hardness is not None and value >= hardness * (1.0 - 1e-6):
        return ""  # the cap is the limit
    if name == "edge_pressure" and load.sharp:
        return (
            "the roller's shape falls back too little for its ends, where the pressure of elastic half-spaces has no "
            "limit and grows with the number of cells"
        )
    if solution.lubricant is None and name == "end_film":
        return ""
    if load.on_end > BEARING and apart > CLOSE[name] * (1.0 + 1e-9):
        wanted = int(np.ceil(solution.grid.cells[1] * apart / CLOSE[name]))
        return (
            f"its lines of cells lie {apart:.2g} half-widths apart, where loaded ends need {CLOSE[name]:g}; take "
            f"{wanted} cells along the roller"
        )
    least = conditions.hertz.p_max if name == "edge_pressure" else solution.options.contact_film
    if bar is None or bar <= WIDEST * max(value, least):
        return ""
    entry = quantity({"edge_pressure": "edge_pressure_pa", "end_film": "end_film_m"}[name])
    return (
        f"on this grid it is {entry.text(value)}, too far from what coarser and coarser grids lead to; take "
        f"{2 * solution.grid.cells[1]} cells along the roller"
    )
