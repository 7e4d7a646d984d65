"""Radial and directional power spectra of roughness.

Source of the normalisation: T. D. B. Jacobs, T. Junge, L. Pastewka, Surf. Topogr. Metrol. Prop. 5
(2017) 013001.
"""

from dataclasses import dataclass

import numpy as np

from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.surface.model import MeasuredSurface, Surface

_PER_DECADE = 12  # radial bins
_SECTORS = 36  # directional bins over half a turn


@dataclass(frozen=True, slots=True)
class SurfaceSpectrum:
    """Power spectral density of roughness over wavenumber and direction.

    `wavenumber` [1/m, 2 pi over the wavelength] ascends. `density` is, for a map, the isotropic C
    [m^4] with Sq^2 = (1/2 pi) integral of q C dq, for a profile the one-dimensional C [m^3] with
    Rq^2 = (1/pi) integral of C dq. `lay` [rad] are the middles of sectors from x towards y, 0 to
    pi, and `share` the part of Sq^2 in ridges of that direction; both are empty for a profile.
    """

    wavenumber: Field
    density: Field
    lay: Field
    share: Field

    @property
    def slope(self) -> float:
        """Exponent of the density over the wavenumber; -2 (1 + H) for a self-affine map."""
        return float(np.polyfit(np.log(self.wavenumber), np.log(self.density), 1)[0])


def surface_spectrum(surface: Surface | MeasuredSurface) -> SurfaceSpectrum:
    """Compute the spectra of a levelled surface.

    Missing cells are set to the mean; axes that are not periodic have a Hann taper.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import gaussian_surface, surface_spectrum
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = gaussian_surface(grid, sq=0.5e-6, correlation_length=50e-6, rng=rng)
    >>> f"{surface_spectrum(surface).wavenumber.min():.0f} rad/m"
    '6283 rad/m'
    """
    grid = surface.grid
    if isinstance(surface, MeasuredSurface) and surface.uniform is not None:
        axis = 1 - surface.uniform
        return _profile_spectrum(
            np.nan_to_num(surface.profile - np.nanmean(surface.profile)), grid.spacing[axis]
        )
    density = _map_density(surface)
    kx, ky = _wavevectors(grid)
    k = np.hypot(kx, ky)
    inside = (k > 0.0) & (k < np.pi / max(grid.spacing))  # the same limit in all directions
    wavenumber, radial = _binned(k[inside], density[inside])
    crest = np.mod(np.arctan2(ky, kx) + np.pi / 2.0, np.pi)
    sector = np.floor(crest[inside] / np.pi * _SECTORS + 0.5).astype(int) % _SECTORS
    share: Field = np.bincount(sector, density[inside], minlength=_SECTORS).astype(np.float64)
    total = share.sum()
    lay = np.arange(_SECTORS) * np.pi / _SECTORS
    return SurfaceSpectrum(wavenumber, radial, lay, share / total if total > 0.0 else share)


def _wavevectors(grid: Grid) -> tuple[Field, Field]:
    """Return kx and ky, (nx, ny) each."""
    along = (
        2.0 * np.pi * np.fft.fftfreq(cells, spacing)
        for cells, spacing in zip(grid.cells, grid.spacing, strict=True)
    )
    kx, ky = np.meshgrid(*along, indexing="ij", copy=False)
    return kx, ky


def _map_density(surface: Surface | MeasuredSurface) -> Field:
    """Return the two-dimensional power spectral density, (nx, ny)."""
    grid = surface.grid
    (nx, ny), (dx, dy) = grid.cells, grid.spacing
    heights = np.nan_to_num(surface.heights - np.nanmean(surface.heights))
    windows = [
        np.ones(n) if periodic else _hann(n)
        for n, periodic in zip(grid.cells, grid.periodic, strict=True)
    ]
    window = np.outer(*windows)
    power = np.abs(np.fft.fft2(heights * window)) ** 2 / np.mean(window**2)  # |sum|^2
    return np.asarray(power * dx * dy / (nx * ny))


def _profile_spectrum(heights: Field, spacing: float) -> SurfaceSpectrum:
    window = _hann(heights.size)
    power = np.abs(np.fft.rfft(heights * window)) ** 2 / np.mean(window**2) * spacing / heights.size
    k = 2.0 * np.pi * np.fft.rfftfreq(heights.size, spacing)
    wavenumber, density = _binned(k[1:], power[1:])
    return SurfaceSpectrum(wavenumber, density, np.empty(0), np.empty(0))


def _hann(count: int) -> Field:
    return np.asarray(np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2)


def _binned(k: Field, density: Field) -> tuple[Field, Field]:
    """Average over bins of equal width in log k, without empty bins."""
    bins = np.floor(np.log10(k / k.min()) * _PER_DECADE + 0.5).astype(int)
    counts = np.bincount(bins)
    filled = counts > 0
    return (
        np.exp(np.bincount(bins, np.log(k))[filled] / counts[filled]),
        np.bincount(bins, density)[filled] / counts[filled],
    )
