"""Rough surfaces that run through a contact, each at its own speed: where they are at any time.

Each lies on a track that repeats along rolling. What has moved by whole cells is the same numbers
further on; between them heights are interpolated by their own Fourier series, which on a track
that repeats is exact for every wave that the cells can show: nothing is smeared however long it
runs.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.surface.model import Surface, flat_surface
from asperity.surface.prepare import CompositeSurface

Spectrum: TypeAlias = npt.NDArray[np.complexfloating[Any, Any]]

WHOLE = 1e-9  # of a cell: closer to a whole number of cells is one


@dataclass(frozen=True)
class MovingSurfaces:
    """Two surfaces that face each other and run along x at `speeds` [m/s], seen through the contact's `grid`.

    Each one's own grid is its track: it begins where the contact's does, has its cells, is as long
    or longer, and repeats along x. The second lies face down, turned over about x, so its y runs
    back.

    Raises
    ------
    BadInput
        for a track that is shorter than the contact, or has other cells.
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
    def of(cls, composite: CompositeSurface) -> "MovingSurfaces":
        """Two surfaces as they stand in a contact, their ends joined."""
        return cls(composite.first, composite.second, composite.speeds, composite.first.grid)

    @classmethod
    def one_rough(
        cls,
        surface: Surface,
        speeds: tuple[float, float],
        grid: Grid | None = None,
        *,
        first: bool = True,
    ) -> "MovingSurfaces":
        """All roughness on the first surface, or on the second, and seen by the contact as it lies here.

        The contact's grid is the surface's own, unless given.
        """
        flat, grid = flat_surface(surface.grid), grid or surface.grid
        if first:
            return cls(surface, flat, speeds, grid)
        return cls(flat, Surface(surface.heights[:, ::-1], surface.grid), speeds, grid)

    @property
    def rough(self) -> tuple[bool, bool]:
        """Which of the two has any height that differs."""
        return bool(np.ptp(self.first.heights) > 0.0), bool(np.ptp(self.second.heights) > 0.0)

    @property
    def uniform(self) -> bool:
        """Whether nothing varies along y."""
        return all(
            bool(np.all(surface.heights == surface.heights[:, :1]))
            for surface in (self.first, self.second)
        )

    def at(self, time: float) -> Surface:
        """What the gap sees after `time` [s]: the sum of both, on the contact's grid."""
        first, second = (self._seen(index, time) for index in (0, 1))
        return Surface(first + second[:, ::-1], self.grid)

    def lowered(self, first: Field, second: Field) -> "MovingSurfaces":
        """The same surfaces, their heights lower by so much on each track [m]."""
        return MovingSurfaces(
            Surface(self.first.heights - first, self.first.grid),
            Surface(self.second.heights - second, self.second.grid),
            self.speeds,
            self.grid,
        )

    def on_track(self, index: int, field: Field, time: float) -> Field:
        """What a field on the contact's grid at `time` [s] is on the track of surface 0 or 1, and nothing beside it.

        What straddles two cells of the track is shared between them, so that its sum is kept and
        its sign.
        """
        surface = (self.first, self.second)[index]
        cells = self.speeds[index] * time / self.grid.spacing[0]
        whole, part = round(cells), 0.0
        if abs(cells - whole) >= WHOLE:
            whole = int(np.floor(cells))
            part = cells - whole
        track = np.zeros(surface.grid.cells)
        track[: self.grid.cells[0]] = field if index == 0 else field[:, ::-1]
        here = np.roll(track, -whole, axis=0)
        return np.asarray((1.0 - part) * here + part * np.roll(here, -1, axis=0))

    def passage(self, index: int) -> float:
        """Time in which surface 0 or 1 runs its whole track [s]; infinite for one that stands still."""
        surface, speed = (self.first, self.second)[index], abs(self.speeds[index])
        return surface.grid.extent[0] / speed if speed > 0.0 else float("inf")

    def _seen(self, index: int, time: float) -> Field:
        heights = (self.first, self.second)[index].heights
        cells = self.speeds[index] * time / self.grid.spacing[0]
        return moved(heights, cells, self._spectra[index])[: self.grid.cells[0]]

    @cached_property
    def _spectra(self) -> tuple[Spectrum, Spectrum]:
        return scipy.fft.rfft(self.first.heights, axis=0), scipy.fft.rfft(
            self.second.heights, axis=0
        )


def moved(heights: Field, cells: float, spectrum: Spectrum) -> Field:
    """Heights that repeat along the first axis, moved on by a number of `cells`; `spectrum` is their rfft along it."""
    whole = round(cells)
    if abs(cells - whole) < WHOLE:
        return np.roll(heights, whole, axis=0)
    count = heights.shape[0]
    wave = np.arange(spectrum.shape[0])
    phase = np.exp(-2j * np.pi * np.mod(wave * (cells / count), 1.0))
    if count % 2 == 0:
        phase[-1] = np.cos(np.pi * cells)  # the shortest wave is known at its crests only
    return np.asarray(scipy.fft.irfft(spectrum * phase[:, None], n=count, axis=0))


def track_grid(grid: Grid, lengths: int = 1) -> Grid:
    """A track of so many lengths of the contact's grid, closed along rolling."""
    (nx, ny), (left, front), (right, back) = grid.cells, grid.lower, grid.upper
    return replace(
        grid,
        cells=(lengths * nx, ny),
        lower=(left, front),
        upper=(left + lengths * (right - left), back),
        periodic=(True, grid.periodic[1]),
    )
