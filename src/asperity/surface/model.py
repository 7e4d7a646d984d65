"""Rough surfaces on a grid, generated and measured."""

import math
from dataclasses import dataclass, replace

import numpy as np

from asperity.contact.grid import Grid
from asperity.core.arrays import Field, real_array
from asperity.core.displayed import Displayed
from asperity.core.errors import BadInput, require_positive

UNKNOWN_LENGTH = "unknown"  # as text, of a length that is not finite
MAX_HEIGHT = 1e3  # m
MIN_SQ = 1e-15  # m, the size of an atomic nucleus


def require_roughness(sq: float) -> float:
    """Return an Sq [m]; raise BadInput unless a surface can be scaled to it."""
    if require_positive("sq", sq, "m") < MIN_SQ:
        raise BadInput(
            f'sq must be at least {MIN_SQ:g} m, got {sq:.3g} m; raise it, or take kind = "flat"'
        )
    return sq


def _heights(name: str, values: Field) -> Field:
    """Return heights [m], nan where they are missing; raise BadInput for numbers that are none."""
    heights = real_array(name, values)
    highest = float(np.max(np.abs(heights), initial=0.0, where=np.isfinite(heights)))
    if highest > MAX_HEIGHT:
        raise BadInput(
            f"{name} must be heights of at most {MAX_HEIGHT:g} m, got {highest:.3g} m; convert "
            "them to metres"
        )
    return heights


def _require_finite(heights: Field) -> None:
    missing = int(np.count_nonzero(~np.isfinite(heights)))
    if missing:
        raise BadInput(
            f"surface has {missing} heights that are missing or not finite; fill or crop them first"
        )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Surface(Displayed):
    """Composite roughness: heights [m], shape (nx, ny), x along rolling, positive towards material.

    Raises
    ------
    BadInput
        The shape is not the grid's, or a height is missing, not a real number, or over
        a kilometre.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import Surface
    >>> grid = Grid(cells=(64, 32), lower=(0.0, 0.0), upper=(2e-3, 1e-3))
    >>> heights = np.where(grid.x[:, np.newaxis] < 1e-3, 1e-6, -1e-6) * np.ones(32)
    >>> Surface(heights, grid).sq
    1e-06
    """

    heights: Field
    grid: Grid

    def __post_init__(self) -> None:
        object.__setattr__(self, "heights", _heights("heights", self.heights))
        if self.heights.shape != self.grid.cells:
            raise BadInput(
                f"heights must have the grid's shape {self.grid.cells}, got {self.heights.shape}; "
                "resample them onto the grid"
            )
        _require_finite(self.heights)

    @classmethod
    def scaled(cls, heights: Field, grid: Grid, sq: float) -> "Surface":
        """Remove the mean of heights and scale them to `sq` [m]."""
        heights = real_array("heights", heights)
        _require_finite(heights)
        heights = np.ascontiguousarray(heights - heights.mean())
        with np.errstate(over="ignore"):
            spread = float(np.std(heights))
        if not 0.0 < spread < math.inf:
            raise BadInput(
                "heights must differ by finite amounts to be scaled to sq, got a standard "
                f"deviation of {spread:g}; correct them"
            )
        return cls(heights * (require_roughness(sq) / spread), grid)

    @property
    def sq(self) -> float:
        """Root-mean-square height about the mean [m]."""
        return float(np.std(self.heights))


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredSurface:
    """Measured map as stored in its file, in metres.

    `heights` [m] have shape (nx, ny), nan for missing cells; `grid` is centred on zero and not
    periodic. `name` and `format` are those of the file; `notes` are warnings, a sentence each.
    `uniform` is the axis along which a profile is extended unchanged; None for a map.
    `rolling_along` is the direction in the file that became x, the rolling direction: `x`, or
    `columns` of a table.

    Raises
    ------
    BadInput
        The shape is not the grid's, no height is valid, or they are not real numbers below 1 km.
    """

    heights: Field
    grid: Grid
    name: str
    format: str
    notes: tuple[str, ...] = ()
    uniform: int | None = None
    rolling_along: str = "x"

    def __post_init__(self) -> None:
        object.__setattr__(self, "heights", _heights(self.name, self.heights))
        if self.heights.shape != self.grid.cells:
            raise BadInput(
                f"{self.name} must have its grid's shape {self.grid.cells}, got "
                f"{self.heights.shape}"
            )
        if not np.isfinite(self.heights).any():
            raise BadInput(
                f"{self.name} holds no valid height among its {self.heights.size}; measure it again"
            )

    @property
    def is_map(self) -> bool:
        """True for a map, False for a profile extended unchanged along one axis."""
        return self.uniform is None

    @property
    def missing(self) -> float:
        """Share of missing cells, 0 to 1."""
        return float(np.mean(~np.isfinite(self.heights)))

    @property
    def sq(self) -> float:
        """Root-mean-square height about the mean [m] of the valid cells."""
        return float(np.nanstd(self.heights))

    @property
    def surface(self) -> Surface:
        """Heights as a `Surface`; missing cells raise `BadInput`."""
        return Surface(self.heights, self.grid)

    @property
    def profile(self) -> Field:
        """Heights [m] of a profile, shape (n,); of a map, its middle row along x."""
        return self.heights[0] if self.uniform == 0 else self.heights[:, self.heights.shape[1] // 2]

    def turned(self) -> "MeasuredSurface":
        """Return the surface rotated by 90 degrees counter-clockwise, so that x becomes y."""
        (x0, y0) = self.grid.lower
        (x1, y1) = self.grid.upper
        grid = replace(
            self.grid,
            cells=self.grid.cells[::-1],
            lower=(-y1, x0),
            upper=(-y0, x1),
            periodic=self.grid.periodic[::-1],
        )
        uniform = None if self.uniform is None else 1 - self.uniform
        return replace(
            self,
            heights=np.ascontiguousarray(self.heights[:, ::-1].T),
            grid=grid,
            uniform=uniform,
            rolling_along=_ACROSS[self.rolling_along],
        )


_ACROSS = {"x": "y", "y": "x", "columns": "rows", "rows": "columns"}


def flat_surface(grid: Grid) -> Surface:
    """Return a perfectly smooth surface."""
    return Surface(np.zeros(grid.cells), grid)


def length_text(metres: float) -> str:
    """Format a length with four digits in the unit that suits its size.

    Examples
    --------
    >>> from asperity.surface import length_text
    >>> length_text(0.25e-3)
    '250 um'
    """
    if not math.isfinite(metres):
        return UNKNOWN_LENGTH
    for unit, size in (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)):
        if abs(metres) >= 0.9995 * size:
            return f"{metres / size:.4g} {unit}"
    return f"{metres / 1e-9:.4g} nm"


def area_text(metres: tuple[float, float]) -> str:
    """Format two lengths as a size: 358 x 179 um; unknown ones in words."""
    longest = max((length for length in metres if math.isfinite(length)), default=0.0)
    unit, size = next(
        ((u, s) for u, s in (("mm", 1e-3), ("um", 1e-6)) if longest >= s), ("nm", 1e-9)
    )
    numbers = (f"{m / size:.4g}" if math.isfinite(m) else UNKNOWN_LENGTH for m in metres)
    return f"{' x '.join(numbers)} {unit}"
