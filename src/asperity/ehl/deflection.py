"""How an elastic half-space gives way under a pressure that repeats in y: an exact cell-to-cell convolution by FFT.

x is aperiodic (zero padded), y periodic. Wavenumber 0 in y is the plane-strain logarithm -ln|X|/π, averaged over a
cell; every other wavenumber q is the cell's integral of K₀(q|X|)/π, summed over the aliases that a pressure constant
over each cell excites. Source: K. L. Johnson, Contact Mechanics (1985), eq 2.24b for the logarithm; the Fourier
transform of 1/r along y for the rest.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.arrays import Field

FAR = 8  # cells along x beyond which the compliance counts as a background
NEAR_ALIASES, FAR_ALIASES, NEAR_CELLS = 200, 2, 3


@dataclass(frozen=True, slots=True)
class Deflection:
    """Compliance of every cell on every other.

    `spectrum` shape (2 nx, ny//2 + 1); `row` the compliance of cells 0, 1, ... along x on one line, shape (nx + 1,).
    """

    cells: tuple[int, int]
    spectrum: Field
    row: Field

    def __call__(self, pressure: Field) -> Field:
        """Surface displacement V of a pressure P, both dimensionless, shape (nx, ny)."""
        import scipy.fft as fft

        nx, ny = self.cells
        waves = fft.fft(fft.rfft(pressure, axis=1), n=2 * nx, axis=0, overwrite_x=True)
        waves *= self.spectrum  # zero padded to twice nx: the outlet must not feel the inlet
        return np.asarray(fft.irfft(fft.ifft(waves, axis=0, overwrite_x=True)[:nx], n=ny, axis=1))

    @property
    def near(self) -> Field:
        """Compliance of cells 0, 1, 2 along x and of the first far one: what the preconditioner keeps of the kernel."""
        return self.row[[0, 1, 2, min(FAR, self.row.size - 1)]].copy()


@lru_cache(maxsize=16)
def line_deflection(cells: tuple[int, int], spacing: tuple[float, float]) -> Deflection:
    """Compliance of a line contact's grid; spacing in Hertz half-widths."""
    import scipy.fft as fft

    (nx, ny), (dx, dy) = cells, spacing
    cell = np.arange(nx + 1)
    kernel = np.zeros((nx + 1, ny // 2 + 1))
    edges = (np.arange(nx + 2) - 0.5) * dx
    primitive = edges * np.log(np.abs(edges)) - edges
    kernel[:, 0] = -np.diff(primitive) / np.pi
    waves = np.arange(ny // 2 + 1)
    for alias in range(-NEAR_ALIASES, NEAR_ALIASES + 1):
        number = waves + alias * ny
        real = number != 0
        wavenumber = 2.0 * np.pi * np.abs(number[real]) / (ny * dy)
        count = nx + 1 if abs(alias) <= FAR_ALIASES else min(NEAR_CELLS, nx + 1)
        kernel[:count, real] += _k0_over_cells(wavenumber, cell[:count], dx) * np.sinc(number[real] / ny)
    mirrored = np.concatenate([kernel, kernel[nx - 1 : 0 : -1]])
    spectrum = np.ascontiguousarray(fft.fft(mirrored, axis=0).real)
    row = np.asarray(fft.irfft(kernel, n=ny, axis=1))[:, 0].copy()
    spectrum.flags.writeable = row.flags.writeable = False
    return Deflection(cells, spectrum, row)


def _k0_over_cells(wavenumber: Field, cell: np.ndarray, dx: float) -> Field:
    """(1/π) ∫ K₀(q|x|) dx over each cell, shape (cells, wavenumbers)."""
    from scipy.special import iti0k0

    edges = (np.arange(cell.size + 1) - 0.5) * dx
    argument = np.abs(edges)[:, None] * wavenumber
    integral = np.where(argument < 500.0, iti0k0(np.minimum(argument, 500.0))[1], np.pi / 2.0)
    integral[0] *= -1.0  # the first edge lies left of the origin
    return np.asarray(np.diff(integral, axis=0) / (wavenumber * np.pi))
