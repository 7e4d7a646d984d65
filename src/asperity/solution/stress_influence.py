"""Stresses in an elastic half-space below cell-wise constant tractions, by FFT convolution.

z points into the body. Pressure p gives σ_zz = -p on the surface; a traction q that pulls the body
along x gives σ_xz = -q. If y is not periodic, the kernels are the closed forms for a loaded
rectangle, zero-padded in both directions. If y is periodic, its wavenumber 0 is the closed form for
a loaded strip, and the others are the half-space's exact response to waves, summed over the aliases
that a traction constant over each cell excites. The module knows no contact.

All follow from three harmonic functions of a point load, φ = 1/(2πr), χ = -log(r + z)/2π, ψ = (z
log(r + z) - r)/2π, with transforms e/α, e/α², e/α³, e = exp(-αz), α² = m² + n². Source: A. E. H.
Love, Phil. Trans. A 228 (1929) 377; S. Liu, Q. Wang, J. Tribol. 124 (2002) 36, derived anew here.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from asperity.contact.grid import Grid
from asperity.core.arrays import Field

Waves = npt.NDArray[np.complexfloating]

COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "xz")
# Components that are odd in x (y), under pressure and under traction along x.
ODD_IN_X = ((False, False, False, True, False, True), (True, True, True, False, True, False))
ODD_IN_Y = (False, False, False, True, True, False)

CACHED_CELLS = 2**17  # largest grid whose kernels are cached: at most 3 MB a depth at 256 x 256
DEEP, SHALLOW = 3.5, 1.25  # depths [cells]: deeper, aliases vanish; shallower, they are too many
NEGLIGIBLE = 1e-8  # relative amplitude below which images and waves are neglected
IMAGE_REACH = 1.25  # distance along x [periods] beyond which images along y act as a strip


@dataclass(frozen=True, slots=True)
class Tractions:
    """Transformed tractions on a grid: pressure, and pull along x on the body (None if absent).

    They are in single precision, like the kernels: stresses to 1e-6, for half the time and memory.
    """

    grid: Grid
    pressure: Waves
    shear: Waves | None

    @classmethod
    def from_fields(cls, grid: Grid, pressure: Field, shear: Field | None) -> "Tractions":
        """Return the transformed tractions of fields [Pa], shape (nx, ny)."""
        return cls(
            grid, _transformed(pressure, grid), None if shear is None else _transformed(shear, grid)
        )

    def stresses(self, depth: float, poisson_ratio: float, *, cache: bool = True) -> Field:
        """Return σ_xx, σ_yy, σ_zz, σ_xy, σ_yz, σ_xz [Pa] below all cell centres, (6, nx, ny)."""
        (nx, ny) = self.grid.cells
        (_, repeats) = self.grid.periodic
        influence = _cached_influence if cache and nx * ny <= CACHED_CELLS else _influence
        kernels = influence(self.grid.cells, self.grid.spacing, repeats, depth, poisson_ratio)
        # columns of wavenumbers along y; the inverse transform takes the others as zero
        columns = kernels.shape[-1]
        stresses = np.empty((6, nx, ny), np.float32)
        for component, out in enumerate(stresses):
            waves = np.zeros((2 * nx, columns), self.pressure.dtype)
            for traction, kernel, odd in zip(
                (self.pressure, self.shear), kernels, ODD_IN_X, strict=True
            ):
                if traction is not None:
                    turn = np.complex64(1j ** (odd[component] + ODD_IN_Y[component]))
                    _accumulate(
                        waves, kernel[component], odd[component], turn * traction[:, :columns]
                    )
            along_x = scipy.fft.ifft(waves, axis=0, overwrite_x=True)[:nx]
            out[:] = scipy.fft.irfft(along_x, n=ny if repeats else 2 * ny, axis=1)[:, :ny]
        return stresses


def _transformed(field: Field, grid: Grid) -> Waves:
    (nx, ny) = grid.cells
    (_, repeats) = grid.periodic
    field = field.astype(np.float32)
    return np.asarray(
        scipy.fft.fft(scipy.fft.rfft(field, n=ny if repeats else 2 * ny, axis=1), n=2 * nx, axis=0)
    )


def _accumulate(waves: Waves, kernel: Field, odd: bool, traction: Waves) -> None:
    """Add kernel times traction.

    The kernel has wavenumbers 0 to Nyquist along x; the others mirror them.
    """
    nx = kernel.shape[0] - 1
    waves[: nx + 1] += kernel * traction[: nx + 1]
    mirrored = kernel[nx - 1 : 0 : -1] * traction[nx + 1 :]
    waves[nx + 1 :] += -mirrored if odd else mirrored


def _influence(
    cells: tuple[int, int],
    spacing: tuple[float, float],
    periodic: bool,
    depth: float,
    poisson_ratio: float,
) -> Field:
    """Return the transformed kernels at one depth, (traction, component, nx + 1, wavenumbers in y).

    Only wavenumbers that reach the depth are included. Transforms are divided by i for each axis in
    which their kernel is odd, so that they are real.
    """
    nu = poisson_ratio
    if not periodic:
        rectangles = _rectangles(cells, spacing, depth, nu).astype(np.float32)
        return _to_waves(_to_waves(rectangles, axis=-1), axis=-2)
    kernels: Field
    if depth < SHALLOW * max(spacing):
        kernels = _below_surface(cells, spacing, nu) + _images(cells, spacing, depth, nu)
    else:
        kernels = _waves(cells, spacing, depth, nu)
    kernels[..., 0] = _to_waves(_strips(cells[0], spacing[0], depth, nu)[..., None], axis=-2)[
        ..., 0
    ]
    columns = int(np.flatnonzero(kernels.any(axis=(0, 1, 2)))[-1]) + 1
    return kernels[..., :columns].astype(np.float32)


_cached_influence = lru_cache(maxsize=32)(_influence)


def clear_kernels() -> None:
    """Clear the kernel caches (50 MB after one non-periodic contact of 256 x 256 cells)."""
    _cached_influence.cache_clear()
    _below_surface.cache_clear()


# Loaded rectangles and strips
# ----------------------------------------------------------------------------------------


def _rectangles(
    cells: tuple[int, int], spacing: tuple[float, float], depth: float, nu: float
) -> Field:
    """Return the stresses at cells 0, 1, ... along x and y from a loaded cell 0.

    Shape (traction, component, nx + 1, ny + 1). Each line is the double integral over x and y of
    the expression in its comment; terms that depend on x or y alone are dropped, because they
    cancel between the corners of the rectangle.
    """
    x, y = ((np.arange(count + 2) - 0.5) * step for count, step in zip(cells, spacing, strict=True))
    corners = _Corners.at_depth(x[:, None], y[None, :], depth)
    differences = np.empty((12, cells[0] + 1, cells[1] + 1))
    integrals = *_under_pressure(corners, nu), *_under_shear(corners, nu)
    for integral, out in zip(integrals, differences, strict=True):
        along = np.diff(integral, axis=1)
        np.subtract(along[1:], along[:-1], out=out)
    differences /= 2.0 * np.pi
    return differences.reshape(2, 6, cells[0] + 1, cells[1] + 1)


class _Corners(NamedTuple):
    """Integrals of the harmonic functions at distances (x, y) from the corners of a rectangle."""

    x: Field
    y: Field
    z: float
    r: Field
    in_xz: Field  # x² + z²
    in_yz: Field  # y² + z²
    angle_x: Field  # -2π ∂xx χ
    angle_y: Field  # -2π ∂yy χ
    log_x: Field  # 2π ∂y φ
    log_y: Field  # 2π ∂x φ

    @classmethod
    def at_depth(cls, x: Field, y: Field, z: float) -> "_Corners":
        """Return the integrals at a depth z."""
        xx = x * x
        yy = y * y
        zz = z * z
        xy = x * y
        r = np.sqrt(xx + yy + zz)
        in_xz, in_yz = xx + zz, yy + zz
        numerator = xy * (xx + yy) / (r + z)
        angle_x = np.arctan2(numerator, xx * r + yy * z)
        angle_y = np.arctan2(numerator, yy * r + xx * z)
        log_x = np.arcsinh(x / np.sqrt(in_yz))
        log_y = np.arcsinh(y / np.sqrt(in_xz))
        return cls(x, y, z, r, in_xz, in_yz, angle_x, angle_y, log_x, log_y)


def _under_pressure(at: _Corners, nu: float) -> tuple[Field, ...]:
    """Return the components at corners under pressure."""
    x, y, z, r, in_xz, in_yz, angle_x, angle_y, *_ = at
    zz, xy = z * z, x * y
    across_x, across_y = z * xy / (r * in_xz), z * xy / (r * in_yz)  # -2π z ∂xx φ, -2π z ∂yy φ
    return (
        -angle_x - 2.0 * nu * angle_y + across_x,  # ∂xx χ - z ∂xx φ + 2ν ∂yy χ
        -angle_y - 2.0 * nu * angle_x + across_y,  # ∂yy χ - z ∂yy φ + 2ν ∂xx χ
        -(angle_x + angle_y) - across_x - across_y,  # ∂z φ - z ∂zz φ
        -(1.0 - 2.0 * nu) * np.log(r + z) - z / r,  # (1 - 2ν) ∂xy χ - z ∂xy φ
        zz * x / (r * in_yz),  # -z ∂yz φ
        zz * y / (r * in_xz),  # -z ∂xz φ
    )


def _under_shear(at: _Corners, nu: float) -> tuple[Field, ...]:
    """Return the components at corners under a traction along x."""
    x, y, z, r, in_xz, _, angle_x, angle_y, log_x, log_y = at
    xx, zz, xy, sunk = x * x, z * z, x * y, r + z
    return (
        2.0 * log_y
        + z * y * (xx - r * z) / (r * sunk * in_xz)
        + 2.0 * nu * y / sunk,  # 2∂x φ + z∂xxx χ - 2ν∂xyy ψ
        -z * y / (r * sunk) + 2.0 * nu * (log_y - y / sunk),  # z ∂xyy χ - 2ν ∂xxx ψ
        zz * y / (r * in_xz),  # -z ∂xz φ
        log_x - x * (2.0 * nu + z / r) / sunk,  # ∂y φ + 2ν ∂xxy ψ + z ∂xxy χ
        -z / r,  # -z ∂xy φ
        -(angle_x + angle_y) + z * xy / (r * in_xz),  # ∂z φ - z ∂xx φ
    )


def _strips(count: int, dx: float, depth: float, nu: float) -> Field:
    """Return the stresses at cells 0, 1, ... along x below an infinite strip, (2, 6, nx + 1)."""
    x = (np.arange(count + 2) - 0.5) * dx
    z = depth
    square = x * x + z * z
    angle = np.arctan2(x, z)
    beside = z * x / square
    below = z * z / square
    zero = np.zeros_like(x)
    edges = np.stack(
        [
            -angle + beside,
            -2.0 * nu * angle,
            -angle - beside,
            zero,
            zero,
            below,
            -np.log(square) - below,
            -nu * np.log(square),
            below,
            zero,
            zero,
            -angle + beside,
        ]
    )
    return (np.diff(edges, axis=-1) / np.pi).reshape(2, 6, count + 1)


@lru_cache(maxsize=2)
def _below_surface(cells: tuple[int, int], spacing: tuple[float, float], nu: float) -> Field:
    """Return the part of shallow kernels that few images omit, evaluated a little deeper by waves.

    Close to the surface the sum over aliases is long. The difference between a shallow and a deeper
    depth decays so fast along the surface that the nearest images contain all of it.
    """
    shallow_depth = SHALLOW * max(spacing)
    return _waves(cells, spacing, shallow_depth, nu) - _images(cells, spacing, shallow_depth, nu)


def _images(cells: tuple[int, int], spacing: tuple[float, float], depth: float, nu: float) -> Field:
    """Return transformed kernels of a cell and its three nearest images along y."""
    (nx, ny), (dx, dy) = cells, spacing
    reach = min(nx, int(IMAGE_REACH * ny * dy / dx) + 1)
    rectangles = _rectangles((reach, 2 * ny), spacing, depth, nu)
    kernels = np.zeros((2, 6, nx + 1, ny // 2 + 1))
    for traction, component in np.ndindex(2, 6):
        rectangle = rectangles[traction, component]
        odd = ODD_IN_Y[component]
        ahead = rectangle[:, :ny] + rectangle[:, ny:-1]
        behind = rectangle[:, ny:0:-1] + rectangle[:, :ny:-1]
        waves = scipy.fft.rfft(ahead - behind if odd else ahead + behind, axis=1)
        kernels[traction, component, : reach + 1] = waves.imag if odd else waves.real
    return _to_waves(kernels, axis=-2)


# Waves
# ----------------------------------------------------------------------------------------


def _waves(cells: tuple[int, int], spacing: tuple[float, float], depth: float, nu: float) -> Field:
    """Return transformed kernels of cells periodic along y, depth > 0.

    Shape (traction, component, nx + 1, ny//2 + 1). The column of wavenumber 0 along y is zero.
    """
    (nx, ny), (dx, dy) = cells, spacing
    kernels = np.zeros((2, 6, nx + 1, ny // 2 + 1))
    for wrap, columns in _padding_factors(cells, spacing):
        along = np.arange(wrap * nx // 2 + 1) * (2.0 * np.pi / (wrap * nx * dx))
        across = columns * (2.0 * np.pi / (ny * dy))
        cutoff = -np.log(NEGLIGIBLE) / depth
        columns, across, along = (
            columns[across < cutoff],
            across[across < cutoff],
            along[along < cutoff],
        )
        if columns.size == 0:
            continue
        waves = np.zeros((2, 6, wrap * nx // 2 + 1, columns.size))
        waves[..., : along.size, :] = _aliased(along, across, spacing, depth, nu)
        if wrap > 2:  # evaluated on a longer domain with distant images, cut to the padded one
            waves = _to_waves(_to_cells(waves)[..., : nx + 1, :], axis=-2)
        kernels[..., columns] = waves
    return kernels


def _padding_factors(
    cells: tuple[int, int], spacing: tuple[float, float]
) -> Iterator[tuple[int, npt.NDArray[np.intp]]]:
    """Yield each padding factor of the domain and the wavenumbers along y that need it.

    Images along x decay as e^(-q (wrap - 1) L) on a domain of `wrap` lengths.
    """
    (nx, ny), (dx, dy) = cells, spacing
    columns = np.arange(1, ny // 2 + 1)
    lengths = 1.0 - np.log(NEGLIGIBLE) * ny * dy / (2.0 * np.pi * columns * nx * dx)
    wraps = np.maximum(2 * np.ceil(lengths / 2.0).astype(int), 2)
    for wrap in np.unique(wraps):
        yield int(wrap), columns[wraps == wrap]


def _aliased(
    along: Field, across: Field, spacing: tuple[float, float], depth: float, nu: float
) -> Field:
    """Return the response to unit waves, averaged over cells.

    Shape (traction, component, wavenumbers along x, along y).
    """
    total = np.zeros((12, along.size, across.size))
    for m, n in _alias_waves(along, across, spacing, depth):
        (dx, dy), alpha = spacing, np.hypot(m, n)
        c = m / alpha
        s = n / alpha
        deep = alpha * depth
        wave = np.exp(-deep) * np.sinc(m * dx / (2.0 * np.pi)) * np.sinc(n * dy / (2.0 * np.pi))
        waves = *_pressure_waves(c, s, deep, wave, nu), *_shear_waves(c, s, deep, wave, nu)
        for out, term in zip(total, waves, strict=True):
            out += term
    return total.reshape(2, 6, along.size, across.size)


def _alias_waves(
    along: Field, across: Field, spacing: tuple[float, float], depth: float
) -> Iterator[tuple[Field, Field]]:
    """Yield the wavenumbers along x and y of the aliases that reach a depth."""
    (dx, dy), aliases = spacing, [(0, 0)]
    if depth < DEEP * max(spacing):
        aliases = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
    for i, j in aliases:
        m = along[:, None] + 2.0 * np.pi * i / dx
        n = across[None, :] + 2.0 * np.pi * j / dy
        if max(np.abs(m).min(), np.abs(n).min()) * depth <= -np.log(NEGLIGIBLE):
            yield m, n


def _pressure_waves(c: Field, s: Field, deep: Field, wave: Field, nu: float) -> Iterator[Field]:
    """Yield the components under a wave of pressure; its direction is (c, s)."""
    cc = c * c
    ss = s * s
    cs = c * s
    slow = wave * (1.0 - deep)
    yield -cc * slow - 2.0 * nu * ss * wave
    yield -ss * slow - 2.0 * nu * cc * wave
    yield -(1.0 + deep) * wave
    yield cs * (slow - 2.0 * nu * wave)
    yield deep * s * wave
    yield deep * c * wave


def _shear_waves(c: Field, s: Field, deep: Field, wave: Field, nu: float) -> Iterator[Field]:
    """Yield the components under a wave of traction along x; its direction is (c, s)."""
    cc, ss, cs = c * c, s * s, c * s
    yield c * (2.0 - deep * cc + 2.0 * nu * ss) * wave
    yield c * (2.0 * nu * cc - deep * ss) * wave
    yield deep * c * wave
    yield s * (1.0 - (2.0 * nu + deep) * cc) * wave
    yield -deep * cs * wave
    yield (deep * cc - 1.0) * wave


def _to_waves(kernels: Field, axis: int) -> Field:
    """Transform kernels at cells 0 ... n to wavenumbers 0 ... n of the even or odd sequence."""
    odd_axes = ODD_IN_X if axis == -2 else (ODD_IN_Y, ODD_IN_Y)
    return _by_parity(kernels, axis, odd_axes, scipy.fft.dct, scipy.fft.dst)


def _to_cells(waves: Field) -> Field:
    """Transform wavenumbers along x back to cells, the inverse of `_to_waves`."""
    return _by_parity(waves, -2, ODD_IN_X, scipy.fft.idct, scipy.fft.idst)


def _by_parity(
    values: Field,
    axis: int,
    odd: tuple[tuple[bool, ...], ...],
    even_transform: Callable[..., Field],
    odd_transform: Callable[..., Field],
) -> Field:
    out = np.zeros_like(values)
    inner = (slice(None), slice(1, -1)) if axis == -1 else (slice(1, -1), slice(None))
    for traction, component in np.ndindex(2, 6):
        block = values[traction, component]
        if odd[traction][component]:
            out[traction, component][inner] = -odd_transform(block[inner], type=1, axis=axis)
        else:
            out[traction, component] = even_transform(block, type=1, axis=axis)
    return out
