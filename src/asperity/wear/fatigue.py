"""Pits by fatigue: damage summed below every cell over its over-rollings, and material that breaks out when it is full.

After G. E. Morales-Espejel and V. Brizmer, Tribology Transactions 54 (2011) 625: stresses from the
solved pressure and traction, Dang Van's measure of their path, a Wöhler line, Palmgren and Miner's
sum, removal of what has failed, and mild wear that takes damaged layers away. Ours: the path is
known at the patches' positions and the unloaded state; the half-space is smooth; the shape of the
bowl; that a jump ends before more than a few cells fail; material from a layer below the deepest
is as new.
"""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from asperity import rating, solution
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.wear.mechanism import Change, Passage, Patch

Cells: TypeAlias = npt.NDArray[np.signedinteger[Any]]
LAYERS = 8
DEEPEST = 1.0  # Hertz half-widths
LUNDBERG_PALMGREN = (
    9.3  # c/e = (31/3)/(10/9): exponent of life over shear stress, Lundberg and Palmgren (1947)
)
WEAKEST, MOST_SCATTER = 0.1, 0.3
FEW = 0.01  # of all cells, that a jump may let fail
FINE, FINEST = (
    8.0,
    16,
)  # points across a bowl's radius, at least: cells are divided for it, into so many at most


@dataclass(frozen=True, slots=True, kw_only=True)
class Pits(Parametric):
    """Pits where Palmgren and Miner's sum passes 1, by a measure that subclasses take of each path of stress.

    `cycles` are the over-rollings that a cell bears at the `limit`; a life is cycles
    (limit/measure)^exponent, below the limit endless. A pit is `aspect` times as wide as it is
    deep. `scatter` is the standard deviation of the limit from cell to cell, relative, drawn once.
    """

    needs_temperature: ClassVar[bool] = False

    limit: Annotated[float, Parameter("Pa", "b", "fatigue limit")]
    cycles: Annotated[float, Parameter(symbol="N", positive="fatigue cycles")] = 1e7
    exponent: Annotated[float, Parameter(symbol="m", positive="fatigue exponent")] = (
        LUNDBERG_PALMGREN
    )
    aspect: Annotated[float, Parameter(positive="fatigue aspect")] = 3.0
    scatter: float = 0.0

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        if not 0.0 <= self.scatter <= MOST_SCATTER:
            raise BadInput(
                f"fatigue scatter must lie between 0 and {MOST_SCATTER:g}, got {self.scatter:g}; leave it out for none"
            )

    def __call__(self, passage: Passage) -> Change:
        """Damage of the jump, and the pits of what it filled."""
        depths = layers(passage.grid, passage.half_width)
        state = passage.state
        damage = np.asarray(state.get("damage", np.zeros((depths.size, *passage.grid.cells))))
        strength = np.asarray(state["strength"]) if "strength" in state else self._strength(passage)
        damage = sunk(damage, depths, passage.removed)
        stressed, left = 0.0, np.full(damage.shape, np.inf)
        for layer, depth in enumerate(depths):
            path = stress_path(
                passage.patches, passage.grid, float(depth), passage.material.poisson_ratio
            )
            measure = self.measured(path).reshape(passage.grid.cells) / strength
            stressed = max(stressed, float(measure.max()))
            rate = self.damage(measure)
            damage[layer] += passage.jump * rate
            np.divide(
                1.0 - damage[layer],
                rate,
                out=left[layer],
                where=(rate > 0.0) & (damage[layer] < 1.0),
            )
        fullest = float(damage.max())
        failed = damage >= 1.0
        pits, damage = broken_out(damage, depths, failed, passage.grid, self.aspect)
        kept = {"damage": damage} | ({"strength": strength} if self.scatter > 0.0 else {})
        dx, dy = passage.grid.spacing
        facts = {
            "measure_pa": self.known(stressed),
            "sum": fullest,
            "cells": float(np.count_nonzero(failed.any(axis=0))),
            "volume_m3": float(pits.sum() * dx * dy),
        }
        return Change(heights_change=-pits, state=kept, facts=facts, longest=soon(left))

    def measured(self, path: Field) -> Field:
        """The measure of each path [Pa], of stresses of shape (6, paths, positions), as far as it passes the limit."""
        raise NotImplementedError

    def known(self, measure: float) -> float:
        """The largest measure [Pa] as a result states it."""
        return measure

    def damage(self, measure: Field) -> Field:
        """Share of its life that one over-rolling takes of a cell under a measure [Pa]; 0 up to the limit."""
        ratio = np.asarray(measure) / self.limit
        return np.where(ratio > 1.0, np.maximum(ratio, 1.0) ** self.exponent / self.cycles, 0.0)

    def _strength(self, passage: Passage) -> Field:
        if self.scatter == 0.0:
            return np.ones(passage.grid.cells)
        drawn = 1.0 + self.scatter * passage.rng.standard_normal(passage.grid.cells)
        return np.maximum(drawn, WEAKEST)


@dataclass(frozen=True, slots=True, kw_only=True)
class DangVanPits(Pits):
    """By Dang Van's τ + a σ_h, whose limit is τ₋₁ of reversed torsion."""

    slope: Annotated[float, Parameter(symbol="a")] = 0.3

    def __post_init__(self) -> None:
        Pits.__post_init__(self)
        if not self.slope >= 0.0:
            raise BadInput(
                f"fatigue slope must be 0 or more, got {self.slope:g}; it is 3 (torsion/bending - 1/2)"
            )

    def measured(self, path: Field) -> Field:
        """Dang Van's measure; a bound where that is below the limit of any cell."""
        weakest = max(WEAKEST, 1.0 - 6.0 * self.scatter) if self.scatter > 0.0 else 1.0
        return rating.dang_van_per_path(path, self.slope, above=weakest * self.limit)

    def known(self, measure: float) -> float:
        """Not a number up to the limit, where only a bound is computed."""
        return measure if measure > self.limit else np.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class VonMisesPits(Pits):
    """By the largest von Mises stress of a passage."""

    def measured(self, path: Field) -> Field:
        """The largest von Mises stress on each path."""
        return np.asarray(solution.StressTensor(*path).von_mises.max(axis=1))


FATIGUE: dict[str, type[Pits]] = {"dang-van": DangVanPits, "von-mises": VonMisesPits}


def soon(left: Field) -> float:
    """Over-rollings after which few more cells have failed, of what is left to each layer of each."""
    lives = left.min(axis=0).ravel()
    few = int(FEW * lives.size)
    return max(float(np.partition(lives, few)[few]), 1.0)


def layers(grid: Grid, half_width: float) -> Field:
    """Depths that damage is summed at [m]: from half a cell to the Hertz half-width, in equal ratios."""
    first = 0.5 * min(grid.spacing)
    return np.geomspace(first, max(DEEPEST * half_width, 2.0 * first), LAYERS)


def stress_path(
    patches: tuple[Patch, ...], grid: Grid, depth: float, poisson_ratio: float
) -> Field:
    """Stresses at a depth below every cell, unloaded and at each position [Pa], shape (6, cells, positions + 1)."""
    path = np.zeros((6, grid.cells[0] * grid.cells[1], len(patches) + 1))
    around = Grid(grid.cells, grid.lower, grid.upper, (False, grid.periodic[1]))
    for position, patch in enumerate(patches, start=1):
        ahead = _to_the_middle(patch.pressure)
        pressure, shear = (np.roll(field, ahead, axis=0) for field in (patch.pressure, patch.shear))
        below = solution.Tractions.from_fields(around, pressure, shear).stresses(
            depth, poisson_ratio
        )
        path[:, :, position] = np.roll(below, -ahead, axis=1).reshape(6, -1)
    return path


def _to_the_middle(pressure: Field) -> int:
    """Cells to roll by along x until the contact lies in the middle of its track: its ends are not one place then."""
    count = pressure.shape[0]
    turned = np.exp(2j * np.pi * np.arange(count) / count) @ pressure.sum(axis=1)
    at = float(np.angle(turned)) / (2.0 * np.pi) * count
    ahead: int = round((count - 1) / 2 - at)
    return ahead


def sunk(damage: Field, depths: Field, removed: Field) -> Field:
    """Damage at the same depths below a surface that is lower by `removed` [m], (nx, ny): what lay deeper comes up.

    Between layers it is interpolated; one more layer, as far down again in ratio, is as new.
    """
    if not np.any(removed):
        return damage.copy()
    deeper = np.append(depths, depths[-1] ** 2 / depths[-2])
    known = np.concatenate([damage, np.zeros_like(damage[:1])])
    wanted = np.minimum(depths[:, None, None] + removed, deeper[-1])
    below = np.clip(np.searchsorted(deeper, wanted), 1, depths.size)
    share = np.maximum((wanted - deeper[below - 1]) / (deeper[below] - deeper[below - 1]), 0.0)
    upper, lower = (np.take_along_axis(known, index, axis=0) for index in (below - 1, below))
    return np.asarray(upper + share * (lower - upper))


def broken_out(
    damage: Field, depths: Field, failed: Mask, grid: Grid, aspect: float
) -> tuple[Field, Field]:
    """Pits [m], 0 or more, and the damage that is left, both below the new surface.

    Every cell that has failed loses a bowl, -z (1 - r²/R²), from the deepest layer z that failed,
    2R = aspect z; where bowls overlap, the deeper counts. Layers that failed are then as damaged
    as the one below them, the deepest as new.
    """
    pits = np.zeros(grid.cells)
    if not failed.any():
        return pits, damage
    deepest = np.where(failed.any(axis=0), depths.size - 1 - failed[::-1].argmax(axis=0), -1)
    kept = damage.copy()
    for layer in np.unique(deepest[deepest >= 0]):
        here = deepest == layer
        bowl, (half_x, half_y) = _bowl(float(depths[layer]), grid, aspect)
        for i, j in np.argwhere(here):
            rows, columns = (
                _window(int(i), half_x, grid.cells[0], True),
                _window(int(j), half_y, *_along_y(grid)),
            )
            inside = np.ix_(rows[0], columns[0])
            pits[inside] = np.maximum(pits[inside], bowl[np.ix_(rows[1], columns[1])])
        kept[: layer + 1, here] = damage[layer + 1, here] if layer + 1 < depths.size else 0.0
    return pits, sunk(kept, depths, pits)


def _along_y(grid: Grid) -> tuple[int, bool]:
    return grid.cells[1], grid.periodic[1]


def _bowl(depth: float, grid: Grid, aspect: float) -> tuple[Field, tuple[int, int]]:
    """Each cell's mean of a bowl about the middle one of an odd number of cells; how many there are on either side."""
    radius = 0.5 * aspect * depth
    halves, places = [], []
    for step, count in zip(grid.spacing, grid.cells, strict=True):
        half = min(int(np.ceil(radius / step - 0.5)), (count - 1) // 2)
        divided = int(np.clip(np.ceil(FINE * step / radius), 1, FINEST))
        fine = (np.arange((2 * half + 1) * divided) + 0.5) / divided
        places.append((fine - half - 0.5) * step)
        halves.append((half, divided))
    (half_x, divided_x), (half_y, divided_y) = halves
    square = (places[0][:, None] ** 2 + places[1][None, :] ** 2) / radius**2
    cells = (2 * half_x + 1, divided_x, 2 * half_y + 1, divided_y)
    bowl = np.maximum(1.0 - square, 0.0).reshape(cells).mean(axis=(1, 3))
    if not bowl.any():  # far narrower than a cell
        bowl[half_x, half_y] = 1.0
    if all(2.0 * radius < extent for extent in grid.extent):
        bowl *= 0.5 * np.pi * radius**2 / float(bowl.sum() * np.prod(grid.spacing))
    return depth * bowl, (half_x, half_y)


def _window(at: int, half: int, count: int, repeats: bool) -> tuple[Cells, Cells]:
    """Cells of a window about one, and which of the window's own they are; beyond an end that does not repeat: none."""
    offsets = np.arange(-half, half + 1)
    cells = at + offsets
    if repeats:
        return cells % count, offsets + half
    inside = (cells >= 0) & (cells < count)
    return cells[inside], (offsets + half)[inside]
