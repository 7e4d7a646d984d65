"""Grooves and dents by hard particles in the oil: a part of each is cut off, the rest stands beside it.

A particle larger than the film is pressed into the surface while it passes the contact and is
dragged along by the other body: a dent without sliding, a groove with it. Marks are independent of
one another and of what they fall on, Poisson's in number; the mean and variance that they bring
are Campbell's: density times the integrals of a mark and of its square. Sources: abrasion by a
sphere and its cutting efficiency, K.-H. Zum Gahr (1987); N. R. Campbell (1909). Ours: that a
particle sinks in by a set share of what the film leaves of it, whatever load that takes.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.wear.mechanism import Change, Passage

RIDGE = 0.5  # width of the ridge on either side over the groove's own
FINE = 4.0  # points across a groove, at least: cells are divided for it
FINEST = 16
MOST_MARKS = 200_000  # in a jump
RISE = 0.1  # of Sq squared, or of the film squared where that is more, in a jump
TRACE = 0.01  # of the largest load on a line along rolling: what lies beyond is beside the track
SHARES = 50  # of sizes, for their mean


@dataclass(frozen=True, slots=True)
class Mark:
    """A groove along x with round ends, [m]; with no `length`, a dent.

    Across, a parabola of `depth` and `width`; on either side a ridge, a parabola too, half as wide
    and `ridge` high.
    """

    length: float
    width: float
    depth: float
    ridge: float

    @classmethod
    def of(cls, length: float, width: float, depth: float, cutting: float) -> "Mark":
        """A mark whose ridge holds what is not cut off, (1 - cutting) of its volume."""
        dug = cls(length, width, depth, 0.0)
        return cls(
            length, width, depth, (1.0 - cutting) * dug.dug / cls(length, width, depth, 1.0).piled
        )

    @property
    def reach(self) -> float:
        """Of the ridge's outer edge from the middle line [m]."""
        return (0.5 + RIDGE) * self.width

    @property
    def dug(self) -> float:
        """Volume of the groove [m^3]: 2/3 w h l and, of the round ends, π/8 w² h."""
        return self.depth * self.width * (2.0 / 3.0 * self.length + np.pi / 8.0 * self.width)

    @property
    def piled(self) -> float:
        """Volume of the ridge [m^3]: 2/3 of its height and width along its middle line."""
        return 2.0 / 3.0 * self.ridge * RIDGE * self.width * self._along_ridge

    @property
    def square(self) -> float:
        """Integral of the squared height [m^4]."""
        groove = self.depth**2 * self.width * (8.0 / 15.0 * self.length + np.pi / 12.0 * self.width)
        return groove + 8.0 / 15.0 * self.ridge**2 * RIDGE * self.width * self._along_ridge

    @property
    def _along_ridge(self) -> float:
        return 2.0 * self.length + np.pi * (1.0 + RIDGE) * self.width

    def heights(self, x: Field, y: Field) -> tuple[Field, Field]:
        """Groove and ridge, both 0 or more [m], at places about the middle."""
        off = np.hypot(np.maximum(np.abs(x) - 0.5 * self.length, 0.0), y) / (0.5 * self.width)
        beyond = (off - 1.0 - RIDGE) / RIDGE
        return self.depth * np.maximum(1.0 - off**2, 0.0), self.ridge * np.maximum(
            1.0 - beyond**2, 0.0
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ploughing(Parametric):
    """Marks of debris.

    `concentration` of particles larger than `smallest` in the oil (1e9 1/m^3 is 1000 in a
    millilitre), up to `largest`, of which a share d^-exponent is larger than d; `sinking` is the
    share of what of a particle is thicker than the film that is pressed into this surface,
    `cutting` that of a mark's volume that is cut off: the rest is piled up beside.
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
                f"ploughing largest must exceed smallest, got {self.largest:g} and {self.smallest:g} m"
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
        """The marks of the jump."""
        film = passage.film_inside
        on_track = track(passage)
        lower, upper = ends(passage.grid, on_track)
        expected = self.density(film) * passage.jump * float(np.prod(np.subtract(upper, lower)))
        if expected > MOST_MARKS:
            raise BadInput(
                f"ploughing would make {expected:.3g} marks in one jump, got a concentration of "
                f"{self.concentration:g} /m^3; take fewer particles, larger ones or shorter jumps"
            )
        dug, piled = np.zeros(passage.grid.cells), np.zeros(passage.grid.cells)
        rng = passage.rng
        count = int(rng.poisson(expected))
        sizes = self.sizes(rng.uniform(size=count))
        places = rng.uniform(lower, upper, size=(count, 2))
        made = 0
        for size, (x, y) in zip(sizes, places, strict=True):
            if size > film:
                stamp(
                    dug,
                    piled,
                    self.mark(float(size), film, passage),
                    (float(x), float(y)),
                    passage.grid,
                )
                made += 1
        cell = float(np.prod(passage.grid.spacing))
        loose, stays = float(piled.sum()), (1.0 - self.cutting) * float(dug.sum())
        if loose > 0.0:
            piled *= stays / loose  # cells cut ridges a little differently from grooves
        elif stays > 0.0:
            dug *= self.cutting
        facts = {"marks": float(made), "volume_m3": float(dug.sum()) * cell}
        change = piled - dug
        return Change(
            heights_change=change,
            facts=facts,
            longest=self._longest(passage, film, change[:, on_track]),
        )

    def _longest(self, passage: Passage, film: float, change: Field) -> float:
        """Over-rollings that raise Sq squared by a set share, the film's where that is more; one mark at least."""
        sizes = self.sizes((np.arange(SHARES) + 0.5) / SHARES)
        squares = [self.mark(float(size), film, passage).square for size in sizes if size > film]
        rise = self.density(film) * sum(squares) / SHARES
        if rise <= 0.0:
            return np.inf
        lower, upper = ends(passage.grid, track(passage))
        one = 1.0 / (
            self.density(film) * float(np.prod(np.subtract(upper, lower))) * len(squares) / SHARES
        )
        return max(
            one,
            RISE * max(float(np.var(passage.heights[:, track(passage)] + change)), film**2) / rise,
        )

    def density(self, film: float) -> float:
        """Particles that one over-rolling brings to an area [1/m^2]: those in the oil that the film holds."""
        return self.concentration * film

    def sizes(self, shares: Field) -> Field:
        """Diameters [m] of shares from 0 to 1 of all particles, by the distribution's inverse."""
        ratio = (self.smallest / self.largest) ** self.exponent
        return np.asarray(self.smallest * (1.0 - shares * (1.0 - ratio)) ** (-1.0 / self.exponent))

    def mark(self, size: float, film: float, passage: Passage) -> Mark:
        """What a particle leaves: as deep as it sinks in, as wide as a sphere is there, as long as it is dragged."""
        depth = self.sinking * (size - film)
        width = 2.0 * float(np.sqrt(depth * (size - depth)))
        return Mark.of(dragged(passage), width, depth, self.cutting)


def dragged(passage: Passage) -> float:
    """How far the other body slides on this one while a point passes the Hertz zone [m]: 2 a |u_s|/u, on track."""
    speed = abs(passage.material.speed)
    way = 2.0 * passage.half_width * passage.sliding_speed / speed if speed > 0.0 else np.inf
    return float(min(way, 0.5 * passage.grid.extent[0]))


def track(passage: Passage) -> slice:
    """Cells across rolling that the contact reaches: all of an endless one, else what is pressed by more than a trace.

    Of a solved point contact oil presses a little on all of its domain.
    """
    if passage.grid.periodic[1]:
        return slice(0, passage.grid.cells[1])
    borne = np.sum([patch.pressure.sum(axis=0) for patch in passage.patches], axis=0)
    pressed = np.flatnonzero(borne > TRACE * borne.max())
    return slice(int(pressed[0]), int(pressed[-1]) + 1) if pressed.size else slice(0, 0)


def ends(grid: Grid, on_track: slice) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower and upper corner of a track of those cells [m]."""
    (left, low), (right, high), step = grid.lower, grid.upper, grid.spacing[1]
    whole = on_track == slice(0, grid.cells[1])
    return (left, low if whole else low + on_track.start * step), (
        right,
        high if whole else low + on_track.stop * step,
    )


def stamp(dug: Field, piled: Field, mark: Mark, at: tuple[float, float], grid: Grid) -> None:
    """Add a mark about a place to the fields of grooves and ridges [m], in place, each cell's mean of it."""
    divided = [int(np.clip(np.ceil(FINE * step / mark.width), 1, FINEST)) for step in grid.spacing]
    spans = (0.5 * mark.length + mark.reach, mark.reach)
    cells, places = [], []
    for axis in (0, 1):
        step, low = grid.spacing[axis], grid.lower[axis]
        first, last = (
            int(np.floor((at[axis] + sign * spans[axis] - low) / step)) for sign in (-1.0, 1.0)
        )
        last = min(last, first + grid.cells[axis] - 1)
        index = np.arange(first, last + 1)
        fine = (np.arange(index.size * divided[axis]) + 0.5) / divided[axis]
        places.append(low + (first + fine) * step - at[axis])
        cells.append(index)
    keep = np.ones(cells[1].size, dtype=bool)
    if not grid.periodic[1]:
        keep = (cells[1] >= 0) & (cells[1] < grid.cells[1])
    inside = np.ix_(cells[0] % grid.cells[0], cells[1][keep] % grid.cells[1])
    shape = (cells[0].size, divided[0], cells[1].size, divided[1])
    for field, heights in zip(
        (dug, piled), mark.heights(places[0][:, None], places[1][None, :]), strict=True
    ):
        field[inside] += heights.reshape(shape).mean(axis=(1, 3))[:, keep]


PLOUGHING: dict[str, type[Ploughing]] = {"debris": Ploughing}
