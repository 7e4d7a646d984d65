"""Grooves and dents by hard particles in the oil: part of each is cut off, the rest is piled up.

A particle larger than the film is pressed into the surface while it passes the contact and is
dragged along by the other body: a dent without sliding, a groove with it. Marks are independent
of one another and of the surface, and their number is Poisson distributed; mean and variance
follow Campbell's theorem: density times the integrals of a mark and of its square. Sources:
abrasion by a sphere and its cutting efficiency, K.-H. Zum Gahr (1987); N. R. Campbell (1909).
Assumption of this implementation: a particle is pressed in by a set share of its excess over the
film, whatever load that takes.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.wear.mechanism import Change, Passage

RIDGE_WIDTH = 0.5  # width of the ridge on either side, relative to the groove
MIN_POINTS = 4.0  # points across a groove, at least: cells are subdivided to reach it
MAX_SUBDIVISION = 16
MAX_MARKS = 200_000  # in a jump
MAX_VARIANCE_RISE = 0.1  # in a jump, relative to Sq squared, or the film squared if larger
LOADED_SHARE = 0.01  # of the largest load on a line along rolling: lines below it are unloaded
SIZE_CLASSES = 50  # for means over particle sizes


@dataclass(frozen=True, slots=True)
class WearMark:
    """Groove along x with round ends, lengths in m; a dent if `length` is 0.

    Its cross-section is a parabola of `depth` and `width` with a parabolic ridge on either side,
    half as wide and `ridge` high.
    """

    length: float
    width: float
    depth: float
    ridge: float

    @classmethod
    def with_ridge(cls, length: float, width: float, depth: float, cutting: float) -> "WearMark":
        """Create a mark whose ridge holds the volume not cut off, (1 - cutting) of the groove."""
        dug = cls(length, width, depth, 0.0)
        return cls(
            length, width, depth, (1.0 - cutting) * dug.dug / cls(length, width, depth, 1.0).piled
        )

    @property
    def reach(self) -> float:
        """Distance of the ridge's outer edge from the centre line [m]."""
        return (0.5 + RIDGE_WIDTH) * self.width

    @property
    def dug(self) -> float:
        """Volume of the groove [m^3]: 2/3 w h l and, of the round ends, π/8 w² h."""
        return self.depth * self.width * (2.0 / 3.0 * self.length + np.pi / 8.0 * self.width)

    @property
    def piled(self) -> float:
        """Volume of the ridge [m^3]: 2/3 of its height and width along its centre line."""
        return 2.0 / 3.0 * self.ridge * RIDGE_WIDTH * self.width * self._along_ridge

    @property
    def square(self) -> float:
        """Integral of the squared height [m^4]."""
        groove = self.depth**2 * self.width * (8.0 / 15.0 * self.length + np.pi / 12.0 * self.width)
        return groove + 8.0 / 15.0 * self.ridge**2 * RIDGE_WIDTH * self.width * self._along_ridge

    @property
    def _along_ridge(self) -> float:
        return 2.0 * self.length + np.pi * (1.0 + RIDGE_WIDTH) * self.width

    def heights(self, x: Field, y: Field) -> tuple[Field, Field]:
        """Return groove depth and ridge height, both 0 or more [m], at points about the centre."""
        radius = np.hypot(np.maximum(np.abs(x) - 0.5 * self.length, 0.0), y) / (0.5 * self.width)
        ridge_offset = (radius - 1.0 - RIDGE_WIDTH) / RIDGE_WIDTH
        return self.depth * np.maximum(1.0 - radius**2, 0.0), self.ridge * np.maximum(
            1.0 - ridge_offset**2, 0.0
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ploughing(Parametric):
    """Marks of debris particles.

    `concentration` of particles larger than `smallest` in the oil (1e9 1/m^3 is 1000 per
    millilitre), up to `largest`; the share larger than d is d^-exponent. `sinking` is the share of
    a particle's excess over the film that is pressed into this surface, `cutting` the share of a
    mark's volume that is cut off: the rest is piled up in ridges.
    """

    needs_temperature: ClassVar[bool] = False

    concentration: Annotated[float, Parameter("1/m^3", "c", "ploughing concentration")]
    smallest: Annotated[float, Parameter("m", "d₁", "ploughing smallest")] = 4e-6
    largest: Annotated[float, Parameter("m", "d₂", "ploughing largest")] = 30e-6
    exponent: Annotated[float, Parameter(symbol="n", positive="ploughing exponent")] = 3.0
    sinking: float = 0.1
    cutting: float = 0.3

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        if not self.smallest < self.largest:
            raise BadInput(
                f"ploughing largest must exceed smallest, got {self.largest:g} and "
                f"{self.smallest:g} m"
            )
        if not 0.0 < self.sinking <= 0.5:
            raise BadInput(
                f"ploughing sinking must lie between 0 and 0.5, got {self.sinking:g}; it is a share"
            )
        if not 0.0 <= self.cutting <= 1.0:
            raise BadInput(
                f"ploughing cutting must lie between 0 and 1, got {self.cutting:g}; it is a share"
            )

    def __call__(self, passage: Passage) -> Change:
        """Return the marks of the jump."""
        film = passage.loaded_film
        track_cells = loaded_columns(passage)
        dug = np.zeros(passage.grid.cells)
        piled = np.zeros(passage.grid.cells)
        marks = self._drawn_marks(passage, film, track_bounds(passage.grid, track_cells))
        for mark, at in marks:
            add_mark(dug, piled, mark, at, passage.grid)
        cell = float(np.prod(passage.grid.spacing))
        loose = float(piled.sum())
        stays = (1.0 - self.cutting) * float(dug.sum())
        if loose > 0.0:
            piled *= stays / loose  # the grid discretises ridges and grooves differently
        elif stays > 0.0:
            dug *= self.cutting
        facts = {"marks": float(len(marks)), "volume_m3": float(dug.sum()) * cell}
        change = piled - dug
        return Change(
            heights_change=change,
            facts=facts,
            longest=self._longest(passage, film, change[:, track_cells]),
        )

    def _drawn_marks(
        self, passage: Passage, film: float, track: tuple[tuple[float, float], tuple[float, float]]
    ) -> list[tuple[WearMark, tuple[float, float]]]:
        """Draw the marks of the jump and their centres [m] on a track from corner to corner."""
        lower, upper = track
        expected = self.density(film) * passage.jump * float(np.prod(np.subtract(upper, lower)))
        if expected > MAX_MARKS:
            raise BadInput(
                f"ploughing would make {expected:.3g} marks in one jump, got a concentration of "
                f"{self.concentration:g} /m^3; use fewer or larger particles, or shorter jumps"
            )
        count = int(passage.rng.poisson(expected))
        sizes = self.sizes(passage.rng.uniform(size=count))
        centres = passage.rng.uniform(lower, upper, size=(count, 2))
        return [
            (self.mark(float(size), film, passage), (float(x), float(y)))
            for size, (x, y) in zip(sizes, centres, strict=True)
            if size > film
        ]

    def _longest(self, passage: Passage, film: float, change: Field) -> float:
        """Return the over-rollings for MAX_VARIANCE_RISE; at least one mark."""
        sizes = self.sizes((np.arange(SIZE_CLASSES) + 0.5) / SIZE_CLASSES)
        squares = [self.mark(float(size), film, passage).square for size in sizes if size > film]
        rise = self.density(film) * sum(squares) / SIZE_CLASSES
        if rise <= 0.0:
            return np.inf
        lower, upper = track_bounds(passage.grid, loaded_columns(passage))
        per_mark = 1.0 / (
            self.density(film)
            * float(np.prod(np.subtract(upper, lower)))
            * len(squares)
            / SIZE_CLASSES
        )
        return max(
            per_mark,
            MAX_VARIANCE_RISE
            * max(float(np.var(passage.heights[:, loaded_columns(passage)] + change)), film**2)
            / rise,
        )

    def density(self, film: float) -> float:
        """Return the particles that one over-rolling brings per area [1/m^2]: those in the film."""
        return self.concentration * film

    def sizes(self, shares: Field) -> Field:
        """Return diameters [m] at quantiles 0 to 1 of the size distribution."""
        ratio = (self.smallest / self.largest) ** self.exponent
        return np.asarray(self.smallest * (1.0 - shares * (1.0 - ratio)) ** (-1.0 / self.exponent))

    def mark(self, size: float, film: float, passage: Passage) -> WearMark:
        """Return the mark of a particle: its depth, a sphere's width there, and its drag length."""
        depth = self.sinking * (size - film)
        width = 2.0 * float(np.sqrt(depth * (size - depth)))
        return WearMark.with_ridge(drag_length(passage), width, depth, self.cutting)


def drag_length(passage: Passage) -> float:
    """Return the sliding distance on this body during a passage of the Hertz zone [m]: 2 a |u_s|/u.

    It is limited to half the track.
    """
    speed = abs(passage.material.speed)
    length = 2.0 * passage.half_width * passage.sliding_speed / speed if speed > 0.0 else np.inf
    return float(min(length, 0.5 * passage.grid.extent[0]))


def loaded_columns(passage: Passage) -> slice:
    """Return the slice of cells across rolling that carry load; all cells of a line contact.

    The pressure of a solved point contact is slightly positive everywhere, so columns that carry
    less than LOADED_SHARE of the largest column load are left out.
    """
    if passage.grid.periodic[1]:
        return slice(0, passage.grid.cells[1])
    column_load = np.sum([patch.pressure.sum(axis=0) for patch in passage.patches], axis=0)
    loaded = np.flatnonzero(column_load > LOADED_SHARE * column_load.max())
    return slice(int(loaded[0]), int(loaded[-1]) + 1) if loaded.size else slice(0, 0)


def track_bounds(grid: Grid, track_cells: slice) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return lower and upper corner of a track of those cells [m]."""
    (left, low) = grid.lower
    (right, high) = grid.upper
    step = grid.spacing[1]
    full_width = track_cells == slice(0, grid.cells[1])
    return (left, low if full_width else low + track_cells.start * step), (
        right,
        high if full_width else low + track_cells.stop * step,
    )


def add_mark(dug: Field, piled: Field, mark: WearMark, at: tuple[float, float], grid: Grid) -> None:
    """Add a mark at a point to the fields of grooves and ridges [m], in place, as cell means."""
    rows, x = _points_under(grid, 0, mark, at[0])
    columns, y = _points_under(grid, 1, mark, at[1])
    keep = np.ones(columns.size, dtype=bool)
    if not grid.periodic[1]:
        keep = (columns >= 0) & (columns < grid.cells[1])
    inside = np.ix_(rows % grid.cells[0], columns[keep] % grid.cells[1])
    shape = (rows.size, x.size // rows.size, columns.size, y.size // columns.size)
    for field, heights in zip((dug, piled), mark.heights(x[:, None], y[None, :]), strict=True):
        field[inside] += heights.reshape(shape).mean(axis=(1, 3))[:, keep]


def _points_under(
    grid: Grid, axis: int, mark: WearMark, centre: float
) -> tuple[npt.NDArray[np.intp], Field]:
    """Return the cells under a mark along an axis, and points in them from the mark's centre."""
    step = grid.spacing[axis]
    low = grid.lower[axis]
    divided = int(np.clip(np.ceil(MIN_POINTS * step / mark.width), 1, MAX_SUBDIVISION))
    span = 0.5 * mark.length + mark.reach if axis == 0 else mark.reach
    first, last = (int(np.floor((centre + sign * span - low) / step)) for sign in (-1.0, 1.0))
    cells = np.arange(first, min(last, first + grid.cells[axis] - 1) + 1)
    fine = (np.arange(cells.size * divided) + 0.5) / divided
    return cells, low + (first + fine) * step - centre


PLOUGHING: dict[str, type[Ploughing]] = {"debris": Ploughing}
