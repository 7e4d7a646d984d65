"""Elastic deflection of a half-space: exact cell-to-cell convolution by FFT.

V = c ∫∫ P/distance, the pressure constant over each cell. Aperiodic axes are zero padded. If y is
periodic, wavenumber 0 in y is the plane-strain logarithm averaged over a cell and every other
wavenumber q the cell's integral of 2 K₀(q|X|), summed over all aliases that a pressure constant
over each cell excites; otherwise Love's closed form for a rectangle. Source: K. L. Johnson, Contact
Mechanics (1985), eqs 2.24b and 3.25; the Fourier transform of 1/r along y.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import numpy as np
import scipy

from asperity.core.arrays import Field

MIRROR_BETWEEN, MIRROR_THROUGH = 1, 2  # mirror behind the last line of cells, or in its middle
COSINES: dict[int, Literal[2, 3]] = {
    MIRROR_BETWEEN: 2,
    MIRROR_THROUGH: 3,
}  # type of the cosine transform
FAR_CELLS = 8  # distance along x from which cells count as far
K0_CUTOFF = 32.0  # the integral of K₀ from 0 to here is π/2 to 3e-15
POLYNOMIAL_FROM, DEGREE = 3.0, 14  # argument from which a polynomial is used, and its degree
ALIASES = 18  # terms on either side


@dataclass(frozen=True, slots=True)
class Deflection:
    """Influence of every cell on every other.

    `spectrum` is the transformed kernel in double and in single precision, `padded` the transform
    lengths and `row` the compliance of cells 0, 1, ... along x on one line, shape (nx,). With a
    `mirror` (0 for none) the grid ends there, and its image is loaded too.
    """

    cells: tuple[int, int]
    padded: tuple[int, int]
    spectrum: tuple[Field, Field]
    row: Field
    mirror: int = 0

    def __call__(self, pressure: Field) -> Field:
        """Return the displacement V of a pressure P, both dimensionless, shape (nx, ny).

        It is computed in the precision of the pressure.
        """
        waves = self._waves(pressure)
        waves *= self.spectrum[pressure.dtype == np.float32]
        return self._field(waves)

    def approximate_inverse(self, displacement: Field) -> Field:
        """Return approximately the pressure of a displacement, zero around it, shape (nx, ny)."""
        waves = self._waves(displacement)
        # a line contact's mean value may be negative
        waves /= np.abs(self.spectrum[displacement.dtype == np.float32])
        return self._field(waves)

    def _waves(self, field: Field) -> np.ndarray:
        """Return the transform of a padded field.

        With a mirror, it is a cosine transform along y, counted from the mirror.
        """
        long, wide = self.padded
        if self.mirror:
            cosines = scipy.fft.dct(field[:, ::-1], type=COSINES[self.mirror], n=wide, axis=1)
            return np.asarray(scipy.fft.rfft(cosines, n=long, axis=0))
        return np.asarray(
            scipy.fft.fft(scipy.fft.rfft(field, n=wide, axis=1), n=long, axis=0, overwrite_x=True)
        )

    def _field(self, waves: np.ndarray) -> Field:
        """Return the field of a transform, (nx, ny)."""
        (nx, ny) = self.cells
        (long, wide) = self.padded
        if self.mirror:
            cosines = scipy.fft.irfft(waves, n=long, axis=0, overwrite_x=True)[:nx]
            return np.ascontiguousarray(
                scipy.fft.idct(cosines, type=COSINES[self.mirror], axis=1)[:, ny - 1 :: -1]
            )
        return np.asarray(
            scipy.fft.irfft(scipy.fft.ifft(waves, axis=0, overwrite_x=True)[:nx], n=wide, axis=1)[
                :, :ny
            ]
        )

    def restrict_to(self, lines: int) -> "Deflection":
        """Return the deflection on that many adjacent lines along x, at most the whole grid."""
        (_, ny) = self.cells
        (_, wide) = self.padded
        kernel = scipy.fft.ifft(self.spectrum[0], axis=0)[:lines].real
        long = scipy.fft.next_fast_len(2 * lines - 1)
        spectrum = np.ascontiguousarray(scipy.fft.fft(_even_extension(kernel, long), axis=0).real)
        return Deflection(
            (lines, ny), (long, wide), (spectrum, spectrum.astype(np.float32)), self.row[:lines]
        )

    @property
    def next_compliance(self) -> float:
        """Compliance of a cell to the next one along x, less that to a far one."""
        _, following, _, far = self.local_compliance
        return float(following - far)

    @property
    def local_compliance(self) -> Field:
        """Compliance of cells 0, 1, 2 along x and of the first far one, for preconditioning."""
        return self.row[[0, 1, 2, min(FAR_CELLS, self.row.size - 1)]].copy()


@lru_cache(maxsize=16)
def deflection(
    cells: tuple[int, int],
    spacing: tuple[float, float],
    compliance: float,
    periodic: bool,
    mirror: int = 0,
) -> Deflection:
    """Return the influence of a grid, up to a mirror if any; spacing in Hertz half-widths."""
    if mirror:
        padded, row, spectrum = _mirrored_kernel(cells, spacing, compliance, mirror)
    else:
        kernel_of = _periodic_kernel if periodic else _bounded_kernel
        padded, row, spectrum = kernel_of(cells, spacing, compliance)
    spectra = np.ascontiguousarray(spectrum), spectrum.astype(np.float32)
    for array in (*spectra, row):
        array.flags.writeable = False
    return Deflection(cells, padded, spectra, row, mirror)


# Transform lengths, compliance along one line, and transformed kernel. Aperiodic axes are padded to
# at least twice the length: circular convolution would couple both ends.
_Kernel = tuple[tuple[int, int], Field, Field]


def _mirrored_kernel(
    cells: tuple[int, int], spacing: tuple[float, float], compliance: float, mirror: int
) -> _Kernel:
    """Return the kernel of a grid that ends at a mirror."""
    lines = 2 * cells[1] + 1 - mirror
    padded = (
        scipy.fft.next_fast_len(2 * cells[0] - 1, real=True),
        scipy.fft.next_fast_len(lines, real=True),
    )
    kernel = compliance * _love_kernel((cells[0], lines), spacing)
    waves = _even_extension(_cosine_waves(kernel, padded[1], mirror), padded[0])
    return padded, kernel[:, 0].copy(), scipy.fft.rfft(waves, axis=0).real


def _periodic_kernel(
    cells: tuple[int, int], spacing: tuple[float, float], compliance: float
) -> _Kernel:
    """Return the kernel of a grid that repeats along y."""
    padded = scipy.fft.next_fast_len(2 * cells[0] - 1), cells[1]
    kernel = 2.0 * compliance * _line_kernel(cells, spacing)
    row = scipy.fft.irfft(kernel, n=cells[1], axis=1)[:, 0]
    return padded, row, scipy.fft.fft(_even_extension(kernel, padded[0]), axis=0).real


def _bounded_kernel(
    cells: tuple[int, int], spacing: tuple[float, float], compliance: float
) -> _Kernel:
    """Return the kernel of a grid without periodic axes."""
    padded = (
        scipy.fft.next_fast_len(2 * cells[0] - 1),
        scipy.fft.next_fast_len(2 * cells[1] - 1, real=True),
    )
    kernel = compliance * _love_kernel(cells, spacing)
    extended = _even_extension(_even_extension(kernel, padded[0]).T, padded[1]).T
    return padded, kernel[:, 0].copy(), scipy.fft.rfft2(extended).real


def _cosine_waves(kernel: Field, count: int, mirror: int) -> Field:
    """Return the cosine transform across y of a kernel, for a mirror between or on lines."""
    if mirror == MIRROR_BETWEEN:
        return np.asarray(scipy.fft.dct(kernel, type=1, n=count + 1, axis=1)[:, :count])
    return np.asarray(scipy.fft.dct(kernel, type=3, n=count, axis=1))


def _even_extension(kernel: Field, length: int) -> Field:
    """Extend a kernel of distances 0, 1, ... evenly along the first axis on a ring of `length`."""
    ring = np.zeros((length, kernel.shape[1]))
    ring[: len(kernel)] = kernel
    ring[length - len(kernel) + 1 :] = kernel[:0:-1]
    return ring


def _line_kernel(cells: tuple[int, int], spacing: tuple[float, float]) -> Field:
    """Return (1/2) ∫∫ 1/distance over each cell of a line contact, transformed along y.

    Shape (nx, ny//2 + 1).
    """
    (nx, ny), (dx, dy) = cells, spacing
    kernel = np.empty((nx, ny // 2 + 1))
    edges = (np.arange(nx + 1) - 0.5) * dx
    kernel[:, 0] = -np.diff(edges * np.log(np.abs(edges)) - edges)
    # proportional to the size of cells, which changes with load and radius during a cycle
    np.multiply(_wave_kernel(cells, float(f"{dy / dx:.13g}")), dx, out=kernel[:, 1:])
    return kernel


@lru_cache(maxsize=4)
def _wave_kernel(cells: tuple[int, int], dy: float) -> Field:
    """Return the waves of `_line_kernel` for cells of length 1 and width `dy`.

    Shape (nx, ny//2).
    """
    (nx, ny) = cells
    wave = np.arange(1, ny // 2 + 1) / ny  # waves per cell
    integral = _integral_beyond(wave, np.arange(nx) + 0.5, dy)
    integral *= np.sin(np.pi * wave) * dy / (2.0 * np.pi**2)
    kernel: Field = -np.diff(integral, axis=0)
    kernel[0] *= 2.0  # its other half
    kernel.flags.writeable = False
    return kernel


def _integral_beyond(wave: Field, edges: Field, dy: float) -> Field:
    """Return the integral of all aliases beyond the centre of the first cell and beyond edges."""
    integral = np.zeros((edges.size + 1, wave.size))
    for alias, weight in _aliases(wave):
        integral[0] += (np.pi / 2.0) * weight
        wavenumber = alias * (2.0 * np.pi / dy)
        count = int(K0_CUTOFF / wavenumber.min(initial=np.inf) + 0.5)
        if count > 0:
            argument = np.outer(edges[:count], wavenumber)
            row, column = np.nonzero(argument < K0_CUTOFF)
            integral[row + 1, column] += weight[column] * _k0_integral(argument[row, column])
    return integral


def _aliases(wave: Field) -> Iterator[tuple[Field, Field]]:
    """Yield the aliases of waves up to half a wave per cell, and their weights.

    A pressure constant over each cell excites them all. The transform of a cell over the wavenumber
    is sin(π wave) dy/(2 π²) times 1/(wave + n)² with the sign of (-1)^n (wave + n). Both tails, n
    to ±∞, alternate, and their terms decay so smoothly that ALIASES terms give the sum to (3 +
    √8)^-ALIASES. Source: H. Cohen, F. Rodriguez Villegas, D. Zagier, Exp. Math. 9 (2000) 3.
    """
    yield wave, 1.0 / wave**2
    total = (3.0 + np.sqrt(8.0)) ** ALIASES
    total = 0.5 * (total + 1.0 / total)
    term, factor = -1.0, -total
    for k in range(ALIASES):
        factor = term - factor
        for alias, weight in ((k + 1.0 + wave, -factor / total), (k + 1.0 - wave, factor / total)):
            yield alias, weight / alias**2
        term *= (k + ALIASES) * (k - ALIASES) / ((k + 0.5) * (k + 1.0))


def _k0_integral(argument: Field) -> Field:
    """Return ∫ K₀ from each argument to infinity; arguments up to K0_CUTOFF, of any shape."""
    centre, reach, series = _k0_polynomial()
    inverse = 1.0 / argument.clip(POLYNOMIAL_FROM)
    normalised = (inverse - centre) / reach
    integral = np.full(argument.shape, series[-1])
    for coefficient in series[-2::-1]:
        integral *= normalised
        integral += coefficient
    integral *= np.sqrt(inverse) * np.exp(-argument)
    small = argument < POLYNOMIAL_FROM
    integral[small] = np.pi / 2.0 - scipy.special.iti0k0(argument[small])[1]
    return integral


@lru_cache(maxsize=1)
def _k0_polynomial() -> tuple[float, float, Field]:
    """Return √z exp(z) ∫ K₀ from z to infinity as a polynomial in (1/z - centre)/reach.

    Returns centre, reach and coefficients; interpolates (to 3e-14 of the integral from 0) ∫ exp(z -
    z cosh t)/cosh t dt over t > 0, by the trapezoidal rule.
    """
    centre = 0.5 * (1.0 / POLYNOMIAL_FROM + 1.0 / K0_CUTOFF)
    reach = 0.5 * (1.0 / POLYNOMIAL_FROM - 1.0 / K0_CUTOFF)
    cosh = np.cosh(0.125 * np.arange(40))

    def scaled(normalised: Any) -> Any:
        z = 1.0 / (centre + reach * normalised)
        ordinates = np.exp(-np.outer(z, cosh - 1.0)) / cosh
        return 0.125 * np.sqrt(z) * (ordinates.sum(axis=1) - 0.5 * ordinates[:, 0])

    chebyshev = np.polynomial.chebyshev
    return centre, reach, np.asarray(chebyshev.cheb2poly(chebyshev.chebinterpolate(scaled, DEGREE)))


def _love_kernel(cells: tuple[int, int], spacing: tuple[float, float]) -> Field:
    """Return ∫∫ 1/distance over each cell, shape (nx, ny)."""
    x, y = (((np.arange(n + 1) - 0.5) * d) for n, d in zip(cells, spacing, strict=True))
    x, y = x[:, None], y[None, :]
    corners = x * np.arcsinh(y / np.abs(x)) + y * np.arcsinh(x / np.abs(y))
    return np.asarray(np.diff(np.diff(corners, axis=0), axis=1))
