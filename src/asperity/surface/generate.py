"""Random rough surfaces with a wanted spectrum, by seed.

White noise is filtered in wavenumber space, so a surface repeats along both axes. The noise belongs to the domain, not
to its cells: one seed gives one physical surface, sampled at the cell centres of whatever grid resolves it.
"""

from collections.abc import Callable

import numpy as np

from asperity.arrays import Field
from asperity.errors import BadInput, require_positive
from asperity.grid import Grid
from asperity.surface.model import Surface, length_text

_LARGEST_WAVENUMBER = 9.0  # times the correlation length: beyond it a Gaussian spectrum holds exp(-81/4), nothing


def gaussian_surface(
    grid: Grid, *, sq: float, correlation_length: float | tuple[float, float], rng: np.random.Generator
) -> Surface:
    """Gaussian heights with a Gaussian autocorrelation: R(x, y) = Sq^2 exp(-(x/lx)^2 - (y/ly)^2).

    The correlation length is where the autocorrelation has fallen to 1/e. ISO 25178's Sal is another length, where it
    has fallen to 0.2: Sal = lx sqrt(ln 5) = 1.27 lx.

    Parameters
    ----------
    grid : where the heights are wanted
    sq : root-mean-square height of this very sample [m]; the mean is zero
    correlation_length : lx = ly, or (lx, ly) [m]
    rng : the only source of chance; seeds that are equal give surfaces that differ by the factor of `sq` alone

    Raises
    ------
    BadInput
        for a correlation length below 2 cells, which the grid cannot show, or above half the domain, which then
        holds no sample of the roughness.
    """
    lengths = correlation_length if isinstance(correlation_length, tuple) else (correlation_length, correlation_length)
    for axis, length, spacing, extent in zip("xy", lengths, grid.spacing, grid.extent, strict=True):
        require_positive(f"correlation length along {axis}", length, "m")
        if length < 2.0 * spacing:
            raise BadInput(
                f"correlation length along {axis} must be at least 2 cells, {length_text(2.0 * spacing)}, "
                f"got {length_text(length)}; use more cells or a longer one"
            )
        if length > extent / 2.0:
            raise BadInput(
                f"correlation length along {axis} must be at most half the domain, {length_text(extent / 2.0)}, "
                f"got {length_text(length)}; use a larger domain or a shorter one"
            )
    lx, ly = lengths

    def amplitude(kx: Field, ky: Field) -> Field:
        return np.exp(-((kx * lx) ** 2 + (ky * ly) ** 2) / 8.0)

    return _filtered_noise(grid, sq, amplitude, (_LARGEST_WAVENUMBER / lx, _LARGEST_WAVENUMBER / ly), rng)


def self_affine_surface(
    grid: Grid, *, sq: float, hurst: float, cutoffs: tuple[float, float], rng: np.random.Generator
) -> Surface:
    """Gaussian heights with a power-law spectrum: C(q) ~ q^(-2 (1 + H)) between two wavelengths.

    Waves longer than the longest have the spectrum of the longest (roll-off plateau), waves shorter than the shortest
    are absent. Source: B. N. J. Persson et al., J. Phys.: Condens. Matter 17 (2005) R1, section 2.

    Parameters
    ----------
    grid : where the heights are wanted
    sq : root-mean-square height of this very sample [m]; the mean is zero
    hurst : H, above 0 and at most 1
    cutoffs : shortest and longest wavelength of the power law [m]
    rng : the only source of chance

    Raises
    ------
    BadInput
        for a Hurst exponent out of range, or cut-offs that are swapped, below 2 cells or beyond the domain.
    """
    if not 0.0 < hurst <= 1.0:
        raise BadInput(f"hurst must lie above 0 and at most at 1, got {hurst:g}; machined metal has about 0.8")
    shortest, longest = cutoffs
    coarsest, domain = 2.0 * max(grid.spacing), min(grid.extent)
    if not coarsest <= shortest < longest <= domain:
        raise BadInput(
            f"cutoffs must rise from at least 2 cells, {length_text(coarsest)}, to at most the domain, "
            f"{length_text(domain)}, got {length_text(shortest)} to {length_text(longest)}; change them or the grid"
        )
    k_short, k_long = 2.0 * np.pi / shortest, 2.0 * np.pi / longest

    def amplitude(kx: Field, ky: Field) -> Field:
        k = np.hypot(kx, ky)
        power_law = (np.maximum(k, k_long) / k_long) ** (-(1.0 + hurst))
        return np.where(k <= k_short * (1.0 + 1e-9), power_law, 0.0)

    return _filtered_noise(grid, sq, amplitude, (k_short, k_short), rng)


def _filtered_noise(
    grid: Grid,
    sq: float,
    amplitude: Callable[[Field, Field], Field],
    largest_wavenumbers: tuple[float, float],
    rng: np.random.Generator,
) -> Surface:
    """White noise on as many samples as the spectrum needs, filtered, then evaluated at the grid's cell centres."""
    require_positive("sq", sq, "m")
    # an odd count has no Nyquist wave, so every wave of the noise has its conjugate
    highest = [
        int(np.ceil(k * extent / (2.0 * np.pi))) for k, extent in zip(largest_wavenumbers, grid.extent, strict=True)
    ]
    noise = rng.standard_normal([2 * m + 1 for m in highest])
    modes = [np.fft.ifftshift(np.arange(-m, m + 1)) for m in highest]
    wavenumbers = [
        np.asarray(2.0 * np.pi / extent * m, dtype=np.float64) for m, extent in zip(modes, grid.extent, strict=True)
    ]
    # samples sit at cell centres, half a cell from the corner that the noise starts at
    phases = [np.exp(0.5j * k * spacing) for k, spacing in zip(wavenumbers, grid.spacing, strict=True)]
    waves = np.fft.fft2(noise) * amplitude(wavenumbers[0][:, None], wavenumbers[1][None, :]) * np.outer(*phases)
    waves[0, 0] = 0.0  # roughness is measured from its mean
    kept = [np.abs(m) < cells / 2.0 for m, cells in zip(modes, grid.cells, strict=True)]
    spectrum = np.zeros(grid.cells, dtype=complex)
    spectrum[np.ix_(modes[0][kept[0]], modes[1][kept[1]])] = waves[np.ix_(*kept)]
    heights = np.fft.ifft2(spectrum).real
    heights -= heights.mean()
    return Surface(heights * (sq / np.std(heights)), grid)
