"""Fatigue pits: damage accumulated below every cell over its over-rollings, and removal at failure.

After G. E. Morales-Espejel and V. Brizmer, Tribology Transactions 54 (2011) 625: stresses from
the solved pressure and traction, Dang Van's measure of their path, a Wöhler line, the
Palmgren-Miner sum, removal of failed material, and mild wear that removes damaged layers.
Assumptions of this implementation: the path is known at the patches' positions and in the
unloaded state; the half-space is smooth; pits are bowls; a jump ends before more than a few
cells fail; material that comes up from below the deepest layer is undamaged.
"""

from dataclasses import dataclass
from typing import Annotated, ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from asperity import rating, solution
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.quantities import Parameter, Parametric
from asperity.wear.mechanism import Change, Passage, Patch

Cells: TypeAlias = npt.NDArray[np.intp]
LAYERS = 8
DEEPEST = 1.0  # Hertz half-widths
# c/e = (31/3)/(10/9): exponent of life over shear stress, Lundberg and Palmgren (1947)
LUNDBERG_PALMGREN = 9.3
MIN_STRENGTH, MAX_SCATTER = 0.1, 0.3
MAX_FAILED_SHARE = 0.01  # of all cells, in a jump
# points across a bowl's radius, at least, for which cells are subdivided up to a limit
MIN_POINTS, MAX_SUBDIVISION = 8.0, 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Pits(Parametric):
    """Pits where the Palmgren-Miner sum exceeds 1; subclasses define the measure of a stress path.

    `cycles` is the number of over-rollings to failure at the `limit`; a life is cycles
    (limit/measure)^exponent, infinite below the limit. A pit is `aspect` times as wide as deep.
    `scatter` is the relative standard deviation of the limit from cell to cell, drawn once.
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
        if not 0.0 <= self.scatter <= MAX_SCATTER:
            raise BadInput(
                f"fatigue scatter must lie between 0 and {MAX_SCATTER:g}, got {self.scatter:g}; "
                "leave it out for none"
            )

    def __call__(self, passage: Passage) -> Change:
        """Return the damage of the jump and the pits of the failed material."""
        depths = layer_depths(passage.grid, passage.half_width)
        state = passage.state
        damage = np.asarray(state.get("damage", np.zeros((depths.size, *passage.grid.cells))))
        strength = np.asarray(state["strength"]) if "strength" in state else self._strength(passage)
        damage = shift_damage(damage, depths, passage.removed)
        stressed, remaining = self._add_damage(damage, depths, strength, passage)
        fullest = float(damage.max())
        failed = damage >= 1.0
        pits, damage = break_out_pits(damage, depths, failed, passage.grid, self.aspect)
        next_state = {"damage": damage} | ({"strength": strength} if self.scatter > 0.0 else {})
        dx, dy = passage.grid.spacing
        facts = {
            "measure_pa": self.reported_measure(stressed),
            "sum": fullest,
            "cells": float(np.count_nonzero(failed.any(axis=0))),
            "volume_m3": float(pits.sum() * dx * dy),
        }
        return Change(
            heights_change=-pits,
            state=next_state,
            facts=facts,
            longest=overrollings_to_failures(remaining),
        )

    def _add_damage(
        self, damage: Field, depths: Field, strength: Field, passage: Passage
    ) -> tuple[float, Field]:
        """Add the damage of the jump in place; return the largest measure and remaining lives."""
        stressed = 0.0
        remaining = np.full(damage.shape, np.inf)
        for layer, depth in enumerate(depths):
            path = stress_path(
                passage.patches, passage.grid, float(depth), passage.material.poisson_ratio
            )
            measure = self.stress_measure(path).reshape(passage.grid.cells) / strength
            stressed = max(stressed, float(measure.max()))
            rate = self.damage(measure)
            damage[layer] += passage.jump * rate
            unfailed = (rate > 0.0) & (damage[layer] < 1.0)
            np.divide(1.0 - damage[layer], rate, out=remaining[layer], where=unfailed)
        return stressed, remaining

    def stress_measure(self, path: Field) -> Field:
        """Return the measure [Pa] of stress paths (6, paths, positions); exact above the limit."""
        raise NotImplementedError

    def reported_measure(self, measure: float) -> float:
        """Return the largest measure [Pa] as results state it."""
        return measure

    def damage(self, measure: Field) -> Field:
        """Return the damage per over-rolling of a cell under a measure [Pa]; 0 up to the limit."""
        ratio = np.asarray(measure) / self.limit
        return np.where(ratio > 1.0, np.maximum(ratio, 1.0) ** self.exponent / self.cycles, 0.0)

    def _strength(self, passage: Passage) -> Field:
        if self.scatter == 0.0:
            return np.ones(passage.grid.cells)
        drawn = 1.0 + self.scatter * passage.rng.standard_normal(passage.grid.cells)
        return np.maximum(drawn, MIN_STRENGTH)


@dataclass(frozen=True, slots=True, kw_only=True)
class DangVanPits(Pits):
    """Pits by Dang Van's τ + a σ_h; the limit is τ₋₁ of reversed torsion."""

    slope: Annotated[float, Parameter(symbol="a")] = 0.3

    def __post_init__(self) -> None:
        Pits.__post_init__(self)
        if not self.slope >= 0.0:
            raise BadInput(
                f"fatigue slope must be 0 or more, got {self.slope:g}; "
                "it is 3 (torsion/bending - 1/2)"
            )

    def stress_measure(self, path: Field) -> Field:
        """Return Dang Van's measure; an upper bound where it is below the limit of any cell."""
        weakest = max(MIN_STRENGTH, 1.0 - 6.0 * self.scatter) if self.scatter > 0.0 else 1.0
        return rating.dang_van_per_path(path, self.slope, above=weakest * self.limit)

    def reported_measure(self, measure: float) -> float:
        """Return nan up to the limit, where only a bound is computed."""
        return measure if measure > self.limit else np.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class VonMisesPits(Pits):
    """Pits by the largest von Mises stress of a passage."""

    def stress_measure(self, path: Field) -> Field:
        """Return the largest von Mises stress on each path."""
        return np.asarray(solution.StressTensor(*path).von_mises.max(axis=1))


FATIGUE: dict[str, type[Pits]] = {"dang-van": DangVanPits, "von-mises": VonMisesPits}


def overrollings_to_failures(remaining: Field) -> float:
    """Return the over-rollings until MAX_FAILED_SHARE more cells fail; at least 1.

    `remaining` holds the over-rollings of each layer of each cell.
    """
    lives = remaining.min(axis=0).ravel()
    index = int(MAX_FAILED_SHARE * lives.size)
    return max(float(np.partition(lives, index)[index]), 1.0)


def layer_depths(grid: Grid, half_width: float) -> Field:
    """Return the depths of damage layers [m]: geometric, half a cell to the Hertz half-width."""
    first = 0.5 * min(grid.spacing)
    return np.geomspace(first, max(DEEPEST * half_width, 2.0 * first), LAYERS)


def stress_path(
    patches: tuple[Patch, ...], grid: Grid, depth: float, poisson_ratio: float
) -> Field:
    """Compute stresses at a depth below every cell, unloaded and at each position [Pa].

    The shape is (6, cells, positions + 1).
    """
    path = np.zeros((6, grid.cells[0] * grid.cells[1], len(patches) + 1))
    around = Grid(grid.cells, grid.lower, grid.upper, (False, grid.periodic[1]))
    for position, patch in enumerate(patches, start=1):
        shift = _to_the_middle(patch.pressure)
        pressure, shear = (np.roll(field, shift, axis=0) for field in (patch.pressure, patch.shear))
        below = solution.Tractions.from_fields(around, pressure, shear).stresses(
            depth, poisson_ratio
        )
        path[:, :, position] = np.roll(below, -shift, axis=1).reshape(6, -1)
    return path


def _to_the_middle(pressure: Field) -> int:
    """Return the shift along x, in cells, that moves the contact to the middle of its track.

    The contact then does not wrap around the ends.
    """
    count = pressure.shape[0]
    harmonic = np.exp(2j * np.pi * np.arange(count) / count) @ pressure.sum(axis=1)
    position = float(np.angle(harmonic)) / (2.0 * np.pi) * count
    shift: int = round((count - 1) / 2 - position)
    return shift


def shift_damage(damage: Field, depths: Field, removed: Field) -> Field:
    """Return damage at the same depths below a surface lowered by `removed` [m], shape (nx, ny).

    Values between layers are interpolated; a further layer, extrapolated by the same ratio, is
    undamaged.
    """
    if not np.any(removed):
        return damage.copy()
    deeper = np.append(depths, depths[-1] ** 2 / depths[-2])
    extended = np.concatenate([damage, np.zeros_like(damage[:1])])
    depth = np.minimum(depths[:, None, None] + removed, deeper[-1])
    below = np.clip(np.searchsorted(deeper, depth), 1, depths.size)
    weight = np.maximum((depth - deeper[below - 1]) / (deeper[below] - deeper[below - 1]), 0.0)
    upper, lower = (np.take_along_axis(extended, index, axis=0) for index in (below - 1, below))
    return np.asarray(upper + weight * (lower - upper))


def break_out_pits(
    damage: Field, depths: Field, failed: Mask, grid: Grid, aspect: float
) -> tuple[Field, Field]:
    """Return the pit depths [m], 0 or more, and the remaining damage below the new surface.

    Every failed cell loses a bowl, -z (1 - r²/R²), from the deepest failed layer z, 2R = aspect z;
    where bowls overlap, the deeper counts. Failed layers then take the damage of the layer below
    them; the deepest becomes undamaged.
    """
    pits = np.zeros(grid.cells)
    if not failed.any():
        return pits, damage
    deepest = np.where(failed.any(axis=0), depths.size - 1 - failed[::-1].argmax(axis=0), -1)
    remaining = damage.copy()
    for layer in np.unique(deepest[deepest >= 0]):
        cells = deepest == layer
        bowl, (half_x, half_y) = _bowl(float(depths[layer]), grid, aspect)
        for i, j in np.argwhere(cells):
            rows = _window(int(i), half_x, grid.cells[0], True)
            columns = _window(int(j), half_y, *_along_y(grid))
            inside = np.ix_(rows[0], columns[0])
            pits[inside] = np.maximum(pits[inside], bowl[np.ix_(rows[1], columns[1])])
        remaining[: layer + 1, cells] = damage[layer + 1, cells] if layer + 1 < depths.size else 0.0
    return pits, shift_damage(remaining, depths, pits)


def _along_y(grid: Grid) -> tuple[int, bool]:
    return grid.cells[1], grid.periodic[1]


def _bowl(depth: float, grid: Grid, aspect: float) -> tuple[Field, tuple[int, int]]:
    """Return the cell means of a bowl about the middle cell, and the cells on either side."""
    radius = 0.5 * aspect * depth
    (half_x, x), (half_y, y) = (
        _bowl_points(radius, step, count)
        for step, count in zip(grid.spacing, grid.cells, strict=True)
    )
    square = (x[:, None] ** 2 + y[None, :] ** 2) / radius**2
    cells = (2 * half_x + 1, -1, 2 * half_y + 1, y.size // (2 * half_y + 1))
    bowl = np.maximum(1.0 - square, 0.0).reshape(cells).mean(axis=(1, 3))
    if not bowl.any():  # much narrower than a cell
        bowl[half_x, half_y] = 1.0
    if all(2.0 * radius < extent for extent in grid.extent):
        bowl *= 0.5 * np.pi * radius**2 / float(bowl.sum() * np.prod(grid.spacing))
    return depth * bowl, (half_x, half_y)


def _bowl_points(radius: float, step: float, count: int) -> tuple[int, Field]:
    """Return the cells on either side of a bowl's middle along an axis, and points in all cells."""
    half = min(int(np.ceil(radius / step - 0.5)), (count - 1) // 2)
    divided = int(np.clip(np.ceil(MIN_POINTS * step / radius), 1, MAX_SUBDIVISION))
    fine = (np.arange((2 * half + 1) * divided) + 0.5) / divided
    return half, (fine - half - 0.5) * step


def _window(at: int, half: int, count: int, repeats: bool) -> tuple[Cells, Cells]:
    """Return the cells of a window about one, and their indices in the window, cut at open ends."""
    offsets = np.arange(-half, half + 1)
    cells = at + offsets
    if repeats:
        return cells % count, offsets + half
    inside = (cells >= 0) & (cells < count)
    return cells[inside], (offsets + half)[inside]
