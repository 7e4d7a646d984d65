"""Subsurface stress: stress tensor, von Mises stress, and their largest values.

The half-space is elastic and smooth: stresses above yield show that the material yields, not the
stress it then carries. Residual stresses, and the pressure change due to traction between
dissimilar bodies, are not included.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import MIN_CELLS, Grid
from asperity.contact.hertz import ellipse_pressure
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput
from asperity.ehl import ContactSolution
from asperity.solution.stress_influence import COMPONENTS, Tractions

DEPTHS = 16  # default number of depths, including the surface
MAX_DEPTH = 2.5  # default largest depth [Hertz half-widths]
CORE = 0.1  # depth [Hertz half-widths] below which the stress does not depend on the cell size
HERTZ_CELLS = 96  # across the smooth contact; its largest stress is then accurate to 0.1 %
REFINEMENTS = 3  # largest number of depths added to locate the largest stress
MIN_DISTANCE = 0.001  # relative distance below which depths are not distinguished


@dataclass(frozen=True, slots=True)
class StressTensor:
    """Components of the stress [Pa], tension positive, of one shape; z points into the body."""

    xx: Field
    yy: Field
    zz: Field
    xy: Field
    yz: Field
    xz: Field

    @property
    def von_mises(self) -> Field:
        """Von Mises stress sqrt(3 J2) [Pa]."""
        return np.asarray(np.sqrt(3.0 * self._second_invariant))

    @property
    def max_shear(self) -> Field:
        """Half the difference of the largest and the smallest principal stress [Pa] (Tresca).

        In double precision, because Lode's angle loses half of its digits where two principal
        stresses are equal.
        """
        xx, yy, zz, xy, yz, xz = (
            np.asarray(getattr(self, name), dtype=float) for name in COMPONENTS
        )
        mean = (xx + yy + zz) / 3.0
        x, y, z = xx - mean, yy - mean, zz - mean
        third = x * y * z + 2.0 * xy * yz * xz - x * yz**2 - y * xz**2 - z * xy**2
        second = StressTensor(xx, yy, zz, xy, yz, xz)._second_invariant
        with np.errstate(divide="ignore", invalid="ignore"):
            cosine = np.where(second > 0.0, 1.5 * np.sqrt(3.0) * third / second**1.5, 1.0)
        angle = np.arccos(np.clip(cosine, -1.0, 1.0)) / 3.0  # Lode's
        return np.asarray(np.sqrt(second) * np.sin(angle + np.pi / 3.0))

    @property
    def _second_invariant(self) -> Field:
        differences = (self.xx - self.yy) ** 2 + (self.yy - self.zz) ** 2 + (self.zz - self.xx) ** 2
        return np.asarray(differences / 6.0 + self.xy**2 + self.yz**2 + self.xz**2)


@dataclass(frozen=True, slots=True)
class Peak:
    """Largest stress [Pa] and its position [m]: depth, and cell centre above it."""

    value: float
    depth: float
    x: float
    y: float


@dataclass(frozen=True, kw_only=True)
class SubsurfaceStress:
    """Stresses in one body of a contact.

    `depths` [m], shape (nz,), increasing; `von_mises` [Pa], shape (nx, ny, nz), below the cell
    centres of `grid`; `peak` is the largest von Mises stress and `shear_peak` the largest shear
    stress (half the difference of principal stresses), each located at the depths and, by
    parabolas, between them; `core` is the largest von Mises stress at least `core_depth` [m] deep.
    Where pressure and traction end abruptly, as at the edge of a capped asperity, `peak` is bounded
    only by the cell size; `core` hardly depends on it. `body` is 1 or 2.
    """

    grid: Grid
    depths: Field
    von_mises: Field
    peak: Peak
    shear_peak: Peak
    core: Peak
    core_depth: float
    body: int
    poisson_ratio: float
    tractions: Tractions = field(repr=False)

    @property
    def largest(self) -> Field:
        """Largest von Mises stress over the depths below each cell [Pa], shape (nx, ny)."""
        return np.asarray(self.von_mises.max(axis=2))

    @property
    def depth_of_largest(self) -> Field:
        """Depth of `largest` [m], shape (nx, ny)."""
        return np.asarray(self.depths[self.von_mises.argmax(axis=2)])

    @property
    def row(self) -> int:
        """Index along y of the cells above `peak`."""
        return int(np.argmin(np.abs(self.grid.y - self.peak.y)))

    @cached_property
    def section(self) -> StressTensor:
        """Full tensor in the plane along rolling through `peak`, shape (nx, nz)."""
        levels = [
            self.tractions.stresses(float(depth), self.poisson_ratio)[:, :, self.row]
            for depth in self.depths
        ]
        return StressTensor(*np.stack(levels, axis=-1))

    def tensor_at(self, depth: float) -> StressTensor:
        """Return the full tensor at any depth [m], including 0, shape (nx, ny).

        Raises
        ------
        BadInput
            for a negative depth.
        """
        (checked,) = _checked_depths(np.array([depth]))
        return StressTensor(
            *self.tractions.stresses(float(checked), self.poisson_ratio, cache=False)
        )


@usual_float_errors
def subsurface_stress(
    solution: ContactSolution,
    *,
    shear: Field | None = None,
    depths: Field | None = None,
    body: int = 1,
) -> SubsurfaceStress:
    """Compute the stresses below a solved contact.

    Parameters
    ----------
    shear : traction along x on body 1 [Pa], shape (nx, ny), such as `friction(...).shear`; body 2
        has the opposite. None for a frictionless contact
    depths : increasing depths [m], 0 or more; default `default_depths`
    body : 1 or 2; z points into it

    Raises
    ------
    BadInput
        for a shear of another shape than the pressure, invalid depths, or an invalid body.
    """
    if body not in (1, 2):
        raise BadInput(f"body must be 1 or 2, got {body!r}")
    if shear is not None and body == 2:
        shear = -shear
    return stress_below(
        solution.pressure,
        shear,
        solution.grid,
        default_depths(solution.conditions, solution.grid) if depths is None else depths,
        poisson_ratio=solution.conditions.pair.poisson_ratios[body - 1],
        body=body,
        core_depth=CORE * _half_width(solution.conditions),
    )


def hertz_stress(
    conditions: ContactConditions, depths: Field, *, body: int = 1
) -> SubsurfaceStress:
    """Compute the stresses below the smooth, dry, frictionless contact of the same conditions.

    It has its own grid.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.case import case_template, load_case
    >>> from asperity.solution import hertz_stress
    >>> contact = load_case(case_template("line"))
    >>> half_width = contact.conditions.hertz.half_widths[0]
    >>> stress = hertz_stress(contact.conditions, np.linspace(0.1, 2.0, 40) * half_width)
    >>> f"largest von Mises stress at {stress.peak.depth / half_width:.1f} half-widths"
    'largest von Mises stress at 0.7 half-widths'
    """
    line = conditions.long
    (a, b) = conditions.hertz.half_widths
    cells = HERTZ_CELLS
    reach = (1.25 * a, a if line else 1.25 * b)
    grid = Grid((cells, MIN_CELLS if line else cells), (-reach[0], -reach[1]), reach, (False, line))
    y = 0.0 * grid.y if line else grid.y
    pressure = ellipse_pressure(grid.x[:, None], y, (a, b), conditions.hertz.p_max)
    ratio = conditions.pair.poisson_ratios[body - 1]
    core = CORE * _half_width(conditions)
    return stress_below(
        pressure, None, grid, depths, poisson_ratio=ratio, body=body, core_depth=core
    )


def _half_width(conditions: ContactConditions) -> float:
    widths = conditions.hertz.half_widths
    return widths[0] if conditions.long else min(widths)


def default_depths(conditions: ContactConditions, grid: Grid) -> Field:
    """Return the surface, the core depth, and 14 depths up to 2.5 half-widths [m].

    The 14 depths are in geometric progression, starting at half a cell along x.
    """
    half_width = _half_width(conditions)
    first = 0.5 * grid.spacing[0]
    min_depth = np.geomspace(first, max(MAX_DEPTH * half_width, 10.0 * first), DEPTHS - 2)
    return np.unique(np.concatenate([[0.0, CORE * half_width], min_depth]))


def stress_below(
    pressure: Field,
    shear: Field | None,
    grid: Grid,
    depths: Field,
    *,
    poisson_ratio: float,
    body: int = 1,
    core_depth: float = 0.0,
) -> SubsurfaceStress:
    """Compute the stresses below a pressure and a traction along x, constant over each cell.

    Both [Pa], shape (nx, ny).

    Raises
    ------
    BadInput
        for fields of another shape than the grid, or invalid depths.
    """
    for name, values in (("pressure", pressure), ("shear", shear)):
        if values is not None and values.shape != grid.cells:
            raise BadInput(f"{name} must have the grid's shape {grid.cells}, got {values.shape}")
    depths = _checked_depths(depths)
    tractions = Tractions.from_fields(grid, pressure, shear)
    levels: _Levels = {}

    def evaluate(depth: float, *, cache: bool = False) -> Field:
        tensor = StressTensor(*tractions.stresses(depth, poisson_ratio, cache=cache))
        von_mises = tensor.von_mises
        levels[depth] = _peaks(tensor, von_mises, depth, grid)
        return von_mises

    von_mises = np.stack([evaluate(float(depth), cache=True) for depth in depths], axis=-1)
    core_depth = max(core_depth, float(depths[0]))
    if core_depth not in levels:
        evaluate(core_depth)
    core, _, shear_peak = (
        _largest_from(levels, measure, min_depth, grid.spacing[0], evaluate)
        for measure, min_depth in ((0, core_depth), (0, 0.0), (1, 0.0))
    )
    # over all depths evaluated so far
    peak = max((level[0] for level in levels.values()), key=lambda candidate: candidate.value)
    return SubsurfaceStress(
        grid=grid,
        depths=depths,
        von_mises=von_mises,
        peak=peak,
        shear_peak=shear_peak,
        core=core,
        core_depth=core_depth,
        body=body,
        poisson_ratio=poisson_ratio,
        tractions=tractions,
    )


def _checked_depths(depths: Field) -> Field:
    depths = np.atleast_1d(np.asarray(depths, dtype=float))
    if depths.ndim != 1 or depths.size == 0 or not np.isfinite(depths).all() or depths.min() < 0.0:
        raise BadInput(f"depths must be finite lengths of 0 m (the surface) or more, got {depths}")
    if np.any(np.diff(depths) <= 0.0):
        raise BadInput(f"depths must increase, got {depths}; sort them and remove duplicates")
    return depths


# by depth: the largest von Mises stress, the largest shear stress
_Levels = dict[float, tuple[Peak, Peak]]


def _peaks(tensor: StressTensor, von_mises: Field, depth: float, grid: Grid) -> tuple[Peak, Peak]:
    # the largest shear stress is between 1/2 and 1/sqrt(3) of the von Mises stress
    candidates = von_mises >= np.sqrt(0.75) * von_mises.max()
    shear = np.zeros_like(von_mises)
    shear[candidates] = StressTensor(
        *(getattr(tensor, name)[candidates] for name in COMPONENTS)
    ).max_shear
    first, second = (_peak(stress, depth, grid) for stress in (von_mises, shear))
    return first, second


def _peak(stress: Field, depth: float, grid: Grid) -> Peak:
    i, j = np.unravel_index(stress.argmax(), stress.shape)
    return Peak(float(stress[i, j]), depth, float(grid.x[i]), float(grid.y[j]))


def _largest_from(
    levels: _Levels,
    measure: int,
    min_depth: float,
    cell: float,
    evaluate: Callable[[float], object],
) -> Peak:
    """Return the largest of a measure from a depth on, refined between depths by parabolas.

    Depths are not refined to less than a cell along x, where the cells limit the resolution.
    """
    for _ in range(REFINEMENTS):
        depths = sorted(depth for depth in levels if depth >= min_depth)
        values = [levels[depth][measure].value for depth in depths]
        top = int(np.argmax(values))
        if not 0 < top < len(depths) - 1 or depths[top + 1] - depths[top - 1] < cell:
            break
        around = slice(top - 1, top + 2)
        depth = _peak_depth(depths[around], values[around])
        if depth is None:
            break
        evaluate(depth)
    return max(
        (level[measure] for depth, level in levels.items() if depth >= min_depth),
        key=lambda peak: peak.value,
    )


def _peak_depth(depths: list[float], values: list[float]) -> float | None:
    """Return the depth of a parabola's vertex; None if level or beside one of its three depths."""
    # the logarithm makes geometric depths equidistant; the surface needs a shift
    shift = depths[1]
    a, b, c = np.log(np.array(depths) + shift)
    fa, fb, fc = values
    left = (b - a) * (fb - fc)
    right = (b - c) * (fb - fa)
    if left == right:
        return None
    vertex = b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right)
    if min(abs(vertex - a), abs(vertex - b), abs(vertex - c)) < MIN_DISTANCE:
        return None
    return float(np.exp(vertex) - shift)
