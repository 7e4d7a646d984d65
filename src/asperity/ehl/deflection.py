"""How an elastic half-space gives way under pressure: an exact cell-to-cell convolution by FFT.

V = c ∫∫ P/distance, every cell's pressure constant. Aperiodic axes are zero padded. Where y repeats, wavenumber 0 in
y is the plane-strain logarithm averaged over a cell and every other wavenumber q the cell's integral of 2 K₀(q|X|),
summed over the aliases that a pressure constant over each cell excites; else Love's closed form for a rectangle.
Source: K. L. Johnson, Contact Mechanics (1985), eqs 2.24b and 3.25; the Fourier transform of 1/r along y.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy

from asperity.arrays import Field

BETWEEN, THROUGH = 1, 2  # where a mirror across y stands: behind the last line of cells, or in its middle
COSINES: dict[int, Literal[2, 3]] = {BETWEEN: 2, THROUGH: 3}  # transforms into those counted from the mirror on
FAR = 8  # cells along x beyond which the compliance counts as a background
ALL_OF_K0 = 40.0  # to which its integral from 0 is π/2 to the last digit
NEAR_ALIASES, FAR_ALIASES, NEAR_CELLS = 200, 2, 3


@dataclass(frozen=True, slots=True)
class Deflection:
    """Compliance of every cell on every other.

    `spectrum` is the transformed kernel, in double and in single precision, `padded` the lengths it was transformed at
    and `row` the compliance of cells 0, 1, ... along x on one line, shape (nx,). With a `mirror` (0 for none) cells end
    there, and their image presses too.
    """

    cells: tuple[int, int]
    padded: tuple[int, int]
    spectrum: tuple[Field, Field]
    row: Field
    mirror: int = 0

    def __call__(self, pressure: Field) -> Field:
        """Surface displacement V of a pressure P, both dimensionless, shape (nx, ny) and of one precision."""
        waves = self._waves(pressure)
        waves *= self.spectrum[pressure.dtype == np.float32]
        return self._field(waves)

    def undone(self, displacement: Field) -> Field:
        """About the pressure that displaces the surface so and leaves all around it where it was, shape (nx, ny)."""
        waves = self._waves(displacement)
        waves /= np.abs(self.spectrum[displacement.dtype == np.float32])  # a line contact's mean has a sign of its own
        return self._field(waves)

    def _waves(self, field: Field) -> np.ndarray:
        """Of a padded field; with a mirror those along x of cosines across, counted from there."""
        long, wide = self.padded
        if self.mirror:
            cosines = scipy.fft.dct(field[:, ::-1], type=COSINES[self.mirror], n=wide, axis=1)
            return np.asarray(scipy.fft.rfft(cosines, n=long, axis=0))
        return np.asarray(scipy.fft.fft(scipy.fft.rfft(field, n=wide, axis=1), n=long, axis=0, overwrite_x=True))

    def _field(self, waves: np.ndarray) -> Field:
        """What has these waves, (nx, ny)."""
        (nx, ny), (long, wide) = self.cells, self.padded
        if self.mirror:
            cosines = scipy.fft.irfft(waves, n=long, axis=0, overwrite_x=True)[:nx]
            return np.ascontiguousarray(scipy.fft.idct(cosines, type=COSINES[self.mirror], axis=1)[:, ny - 1 :: -1])
        return np.asarray(scipy.fft.irfft(scipy.fft.ifft(waves, axis=0, overwrite_x=True)[:nx], n=wide, axis=1)[:, :ny])

    def among(self, lines: int) -> "Deflection":
        """The same among that many neighbouring lines along x, none longer than the grid is."""
        (_, ny), (_, wide) = self.cells, self.padded
        kernel = scipy.fft.ifft(self.spectrum[0], axis=0)[:lines].real
        long = scipy.fft.next_fast_len(2 * lines - 1)
        spectrum = np.ascontiguousarray(scipy.fft.fft(_mirrored(kernel, long), axis=0).real)
        return Deflection((lines, ny), (long, wide), (spectrum, spectrum.astype(np.float32)), self.row[:lines])

    @property
    def near(self) -> Field:
        """Compliance of cells 0, 1, 2 along x and of the first far one: what the preconditioner keeps of the kernel."""
        return self.row[[0, 1, 2, min(FAR, self.row.size - 1)]].copy()


@lru_cache(maxsize=16)
def deflection(
    cells: tuple[int, int], spacing: tuple[float, float], compliance: float, periodic: bool, mirror: int = 0
) -> Deflection:
    """Compliance of a grid, up to a mirror if there is one; spacing in Hertz half-widths."""
    nx, ny = cells
    # zero padded to no less than twice the length: the outlet must not feel the inlet
    padded = scipy.fft.next_fast_len(2 * nx - 1), ny if periodic else scipy.fft.next_fast_len(2 * ny - 1, real=True)
    if mirror:
        lines = 2 * ny + 1 - mirror
        padded = scipy.fft.next_fast_len(2 * nx - 1, real=True), scipy.fft.next_fast_len(lines, real=True)
        kernel = compliance * _love_kernel((nx, lines), spacing)
        row = kernel[:, 0].copy()
        spectrum = scipy.fft.rfft(_mirrored(_cosines(kernel, padded[1], mirror), padded[0]), axis=0).real
    elif periodic:
        kernel = 2.0 * compliance * _line_kernel(cells, spacing)
        row = scipy.fft.irfft(kernel, n=ny, axis=1)[:, 0]
        spectrum = scipy.fft.fft(_mirrored(kernel, padded[0]), axis=0).real
    else:
        kernel = compliance * _love_kernel(cells, spacing)
        row = kernel[:, 0].copy()
        spectrum = scipy.fft.rfft2(_mirrored(_mirrored(kernel, padded[0]).T, padded[1]).T).real
    both = np.ascontiguousarray(spectrum), spectrum.astype(np.float32)
    for array in (*both, row):
        array.flags.writeable = False
    return Deflection(cells, padded, both, row, mirror)


def _cosines(kernel: Field, count: int, mirror: int) -> Field:
    """The waves across y of a kernel of distances 0, 1, ..., made even about 0: whole ones, or halves in between."""
    if mirror == BETWEEN:
        return np.asarray(scipy.fft.dct(kernel, type=1, n=count + 1, axis=1)[:, :count])
    return np.asarray(scipy.fft.dct(kernel, type=3, n=count, axis=1))


def _mirrored(kernel: Field, length: int) -> Field:
    """A kernel of distances 0, 1, ... along the first axis, made even about 0 on a ring of `length`."""
    ring = np.zeros((length, kernel.shape[1]))
    ring[: len(kernel)] = kernel
    ring[length - len(kernel) + 1 :] = kernel[:0:-1]
    return ring


def _line_kernel(cells: tuple[int, int], spacing: tuple[float, float]) -> Field:
    """(1/2) ∫∫ 1/distance over each cell of a line contact, transformed along y, shape (nx, ny//2 + 1)."""
    (nx, ny), (dx, dy) = cells, spacing
    cell = np.arange(nx)
    kernel = np.zeros((nx, ny // 2 + 1))
    edges = (np.arange(nx + 1) - 0.5) * dx
    kernel[:, 0] = -np.diff(edges * np.log(np.abs(edges)) - edges)
    waves = np.arange(ny // 2 + 1)
    for alias in range(-NEAR_ALIASES, NEAR_ALIASES + 1):
        number = waves + alias * ny
        real = number != 0
        if not real.any():  # one line of cells has the mean alone
            continue
        wavenumber = 2.0 * np.pi * np.abs(number[real]) / (ny * dy)
        excited = np.sinc(number[real] / ny)
        if 0.5 * dx * wavenumber.min() >= ALL_OF_K0:  # all of it lies over the cell itself
            kernel[0, real] += np.pi / wavenumber * excited
            continue
        count = nx if abs(alias) <= FAR_ALIASES else min(NEAR_CELLS, nx)
        kernel[:count, real] += _k0_over_cells(wavenumber, cell[:count], dx) * excited
    return kernel


def _k0_over_cells(wavenumber: Field, cell: np.ndarray, dx: float) -> Field:
    """∫ K₀(q|x|) dx over each cell, shape (cells, wavenumbers)."""
    edges = (np.arange(cell.size + 1) - 0.5) * dx
    argument = np.abs(edges)[:, None] * wavenumber
    integral = np.full(argument.shape, np.pi / 2.0)
    short = argument < ALL_OF_K0
    integral[short] = scipy.special.iti0k0(argument[short])[1]
    integral[0] *= -1.0  # the first edge lies left of the origin
    return np.asarray(np.diff(integral, axis=0) / wavenumber)


def _love_kernel(cells: tuple[int, int], spacing: tuple[float, float]) -> Field:
    """∫∫ 1/distance over each cell, shape (nx, ny)."""
    x, y = (((np.arange(n + 1) - 0.5) * d) for n, d in zip(cells, spacing, strict=True))
    x, y = x[:, None], y[None, :]
    corners = x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y))
    return np.asarray(np.diff(np.diff(corners, axis=0), axis=1))
