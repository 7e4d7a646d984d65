"""Dang Van criterion below a solved contact."""

from dataclasses import dataclass

import numpy as np

from asperity import rating
from asperity.contact.hertz import ellipse_pressure
from asperity.core.arrays import Field
from asperity.machines.rating_facts import Rating, machine_rating
from asperity.results import Run
from asperity.solution import SubsurfaceStress, stress_below


@dataclass(frozen=True)
class DangVan:
    """Dang Van stress below a solved contact over depth [Pa].

    `depths` [m]; `solved` of the rough contact, `smooth` of the Hertz contact with the same
    friction coefficient; `core_depth`, below which the cell size has no effect; `slope` a; `limit`
    τ₋₁ [Pa].
    """

    depths: Field
    solved: Field
    smooth: Field
    core_depth: float
    slope: float
    limit: float

    def ratings(self) -> tuple[Rating, ...]:
        """Return the largest stress in the core, above it and if smooth, and the safety."""
        core = self.depths >= self.core_depth
        return (
            machine_rating("dang_van_pa", float(self.solved[core].max())),
            machine_rating("dang_van_shallow_pa", float(self.solved[~core].max())),
            machine_rating("dang_van_smooth_pa", float(self.smooth.max())),
            machine_rating("dang_van_safety", self.limit / float(self.solved[core].max())),
        )


def dang_van_below(run: Run, limits: tuple[float, float]) -> DangVan:
    """Compute the Dang Van stress of material that passes below a solved contact.

    Parameters
    ----------
    run : the solved contact
    limits : fatigue limits of the material in reversed torsion and reversed bending [Pa]

    Raises
    ------
    BadInput
        for limits that no metal has.
    """
    slope = rating.dang_van_slope(*limits)
    stress, solution = run.stress, run.solution
    grid, conditions = solution.grid, solution.conditions
    hertz, y = conditions.hertz, grid.y if conditions.geometry != "line" else 0.0 * grid.y
    pressure = ellipse_pressure(grid.x[:, None], y, hertz.half_widths, hertz.p_max)
    friction = 0.0 if run.friction is None else run.friction.coefficient
    smooth = stress_below(
        pressure,
        friction * pressure,
        grid,
        stress.depths,
        poisson_ratio=stress.poisson_ratio,
        body=stress.body,
    )
    rough, ideal = (_over_depth(field, slope) for field in (stress, smooth))
    return DangVan(stress.depths, rough, ideal, stress.core_depth, slope, limits[0])


def _over_depth(stress: SubsurfaceStress, slope: float) -> Field:
    """Return the largest Dang Van stress over all lines along rolling at each depth."""
    largest = []
    for depth in stress.depths:
        levels = stress.tractions.stresses(float(depth), stress.poisson_ratio, cache=False)
        paths = np.concatenate(
            [np.swapaxes(levels, 1, 2), np.zeros((6, levels.shape[2], 1))], axis=2
        )
        largest.append(rating.dang_van(paths, slope))
    return np.array(largest)
