"""Rough surfaces that move through a contact, each at its own speed.

Each surface has a track that is periodic along rolling. A shift by whole cells is exact; other
shifts interpolate with the Fourier series of the heights, which is exact for all waves that the
cells resolve, so that heights are not smeared over time.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.surface.model import Surface, flat_surface

ComplexField: TypeAlias = npt.NDArray[np.complex128]

WHOLE_CELL_TOLERANCE = 1e-9  # cells


@dataclass(frozen=True)
class MovingSurfaces:
    """Two facing surfaces that move along x at `speeds` [m/s] through the contact's `grid`.

    The grid of each surface is its track: it begins with the contact's grid, has the same cells, is
    at least as long, and is periodic along x. The second surface lies face down, turned over about
    x, so its y axis is reversed.

    Raises
    ------
    BadInput
        A track is shorter than the contact, or has other cells.
    """

    first: Surface
    second: Surface
    speeds: tuple[float, float]
    grid: Grid

    def __post_init__(self) -> None:
        for name, surface in (("first", self.first), ("second", self.second)):
            track = surface.grid
            same = np.allclose(track.spacing, self.grid.spacing, rtol=1e-9, atol=0.0)
            if (
                not same
                or track.cells[1] != self.grid.cells[1]
                or track.cells[0] < self.grid.cells[0]
            ):
                raise BadInput(
                    f"the {name} surface's track must have the contact's cells and be as long, got "
                    f"{track.cells} cells of {track.spacing[0]:.4g} m for {self.grid.cells} of "
                    f"{self.grid.spacing[0]:.4g} m; make it on the contact's grid"
                )

    @classmethod
    def one_rough(
        cls,
        surface: Surface,
        speeds: tuple[float, float],
        grid: Grid | None = None,
        *,
        first: bool = True,
    ) -> "MovingSurfaces":
        """Put all roughness on the first or the second surface, in its present orientation.

        The contact's grid is the surface's own unless given.
        """
        flat, grid = flat_surface(surface.grid), grid or surface.grid
        if first:
            return cls(surface, flat, speeds, grid)
        return cls(flat, Surface(surface.heights[:, ::-1], surface.grid), speeds, grid)

    @property
    def rough(self) -> tuple[bool, bool]:
        """True for each surface that is not flat."""
        return bool(np.ptp(self.first.heights) > 0.0), bool(np.ptp(self.second.heights) > 0.0)

    @property
    def uniform(self) -> bool:
        """True if no height varies along y."""
        return all(
            bool(np.all(surface.heights == surface.heights[:, :1]))
            for surface in (self.first, self.second)
        )

    def composite_at(self, time: float) -> Surface:
        """Return the composite roughness at `time` [s], the sum of both on the contact's grid."""
        first, second = self.speeds
        return self.composite_displaced((first * time, second * time))

    def composite_displaced(self, distances: tuple[float, float]) -> Surface:
        """Return the composite roughness when both bodies have moved by `distances` [m] along x."""
        first, second = (self._heights_displaced(*moved) for moved in enumerate(distances))
        return Surface(first + second[:, ::-1], self.grid)

    def earlier(self, seconds: float) -> "MovingSurfaces":
        """Return the surfaces as they were: after these seconds they are as now."""
        first, second = (
            Surface(
                shift_periodic(
                    surface.heights,
                    -self.speeds[index] * seconds / self.grid.spacing[0],
                    self._spectra[index],
                ),
                surface.grid,
            )
            for index, surface in enumerate((self.first, self.second))
        )
        return MovingSurfaces(first, second, self.speeds, self.grid)

    def on_cells(self, cells: tuple[int, int]) -> "MovingSurfaces":
        """Return the same roughness on fewer cells, without the waves that these do not resolve."""
        (nx, ny) = self.grid.cells

        def resampled(surface: Surface) -> Surface:
            track = surface.grid
            count = (round(track.cells[0] * cells[0] / nx), cells[1])
            heights = _fewer_periodic(surface.heights, count[0])
            fewer = _fewer_periodic if track.periodic[1] else _fewer_mirrored
            return Surface(fewer(heights.T, count[1]).T.copy(), replace(track, cells=count))

        if cells[0] > nx or cells[1] > ny:
            raise BadInput(f"cells must be at most {self.grid.cells}, got {cells}")
        grid = replace(self.grid, cells=cells)
        return MovingSurfaces(resampled(self.first), resampled(self.second), self.speeds, grid)

    def lowered(self, first: Field, second: Field) -> "MovingSurfaces":
        """Return the surfaces with the heights of each track lowered by these fields [m]."""
        return MovingSurfaces(
            Surface(self.first.heights - first, self.first.grid),
            Surface(self.second.heights - second, self.second.grid),
            self.speeds,
            self.grid,
        )

    def project_on_track(self, index: int, field: Field, time: float) -> Field:
        """Project a field on the contact's grid at `time` [s] onto the track of surface 0 or 1.

        The field is zero outside the contact. A value between two cells of the track is divided
        between them, which preserves the sum and the sign.
        """
        surface = (self.first, self.second)[index]
        cells = self.speeds[index] * time / self.grid.spacing[0]
        shift, fraction = round(cells), 0.0
        if abs(cells - shift) >= WHOLE_CELL_TOLERANCE:
            shift = int(np.floor(cells))
            fraction = cells - shift
        track = np.zeros(surface.grid.cells)
        track[: self.grid.cells[0]] = field if index == 0 else field[:, ::-1]
        shifted = np.roll(track, -shift, axis=0)
        return np.asarray((1.0 - fraction) * shifted + fraction * np.roll(shifted, -1, axis=0))

    def passage_time(self, index: int) -> float:
        """Return the time of one passage of the track of surface 0 or 1 [s]; infinite at rest."""
        surface = (self.first, self.second)[index]
        speed = abs(self.speeds[index])
        return surface.grid.extent[0] / speed if speed > 0.0 else float("inf")

    def _heights_displaced(self, index: int, distance: float) -> Field:
        heights = (self.first, self.second)[index].heights
        cells = distance / self.grid.spacing[0]
        return shift_periodic(heights, cells, self._spectra[index])[: self.grid.cells[0]]

    @cached_property
    def _spectra(self) -> tuple[ComplexField, ComplexField]:
        return scipy.fft.rfft(self.first.heights, axis=0), scipy.fft.rfft(
            self.second.heights, axis=0
        )


def shift_periodic(heights: Field, cells: float, spectrum: ComplexField) -> Field:
    """Shift periodic heights by a number of cells along axis 0; `spectrum` is their rfft."""
    nearest = round(cells)
    if abs(cells - nearest) < WHOLE_CELL_TOLERANCE:
        return np.roll(heights, nearest, axis=0)
    count = heights.shape[0]
    wave = np.arange(spectrum.shape[0])
    phase = np.exp(-2j * np.pi * np.mod(wave * (cells / count), 1.0))
    if count % 2 == 0:
        phase[-1] = np.cos(np.pi * cells)  # the Nyquist wave is sampled at its crests only
    return np.asarray(scipy.fft.irfft(spectrum * phase[:, None], n=count, axis=0))


def _fewer_periodic(heights: Field, count: int) -> Field:
    """Return periodic heights at the centres of `count` cells along axis 0."""
    cells = heights.shape[0]
    if count == cells:
        return heights
    waves = np.arange((count + 1) // 2)  # without the Nyquist wave
    shift = np.exp(1j * np.pi * waves * (1.0 / count - 1.0 / cells))  # of the cells' centres
    spectrum = scipy.fft.rfft(heights, axis=0)[: waves.size] * shift[:, None]
    return np.asarray(scipy.fft.irfft(spectrum * (count / cells), n=count, axis=0))


def _fewer_mirrored(heights: Field, count: int) -> Field:
    """Return heights that need not be periodic at the centres of `count` cells along axis 0."""
    cosines = scipy.fft.dct(heights, axis=0, norm="forward")[:count]
    return np.asarray(scipy.fft.idct(cosines, n=count, axis=0, norm="forward"))


def track_grid(grid: Grid, lengths: int = 1) -> Grid:
    """Return a track of several lengths of the contact's grid, periodic along rolling."""
    (nx, ny) = grid.cells
    (left, front) = grid.lower
    (right, back) = grid.upper
    return replace(
        grid,
        cells=(lengths * nx, ny),
        lower=(left, front),
        upper=(left + lengths * (right - left), back),
        periodic=(True, grid.periodic[1]),
    )
