"""Random rough surfaces with a given spectrum and height distribution.

White noise is filtered in wavenumber space, so a surface is periodic along both axes. The noise
belongs to the domain, not to its cells: a seed defines one physical surface, sampled at the cell
centres of any grid that resolves it. `asperity.surface.machined` models cutting and denting.
"""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from asperity.contact.grid import Grid
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.errors import BadInput, require_positive
from asperity.surface import johnson
from asperity.surface.model import Surface, length_text, require_roughness

# Largest wavenumber times correlation length; a Gaussian spectrum is negligible beyond: exp(-81/4)
_LARGEST_WAVENUMBER = 9.0


@usual_float_errors
def gaussian_surface(
    grid: Grid,
    *,
    sq: float,
    correlation_length: float | tuple[float, float],
    direction: float = 0.0,
    rng: np.random.Generator,
) -> Surface:
    """Generate Gaussian heights with the autocorrelation Sq^2 exp(-(u/l1)^2 - (v/l2)^2).

    The autocorrelation falls to 1/e at the correlation length, and to 0.2 at Sal of ISO 25178:
    Sal = l sqrt(ln 5) = 1.27 l.

    Parameters
    ----------
    grid : grid of the heights
    sq : root-mean-square height of the sample [m]; the mean is zero
    correlation_length : l1 = l2, or (l1, l2) [m]
    direction : angle of u, the axis of l1, from x towards y [rad]
    rng : random generator; surfaces of equal seeds differ only by the factor `sq`

    Raises
    ------
    BadInput
        A correlation length is below 2 cells, the resolution of the grid, or above half the domain.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import gaussian_surface
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = gaussian_surface(grid, sq=0.5e-6, correlation_length=50e-6, rng=rng)
    >>> f"Sq {surface.heights.std() * 1e6:.2f} um"
    'Sq 0.50 um'
    """
    lengths = _lengths(grid, correlation_length, direction)
    return _filtered_noise(grid, sq, *_gaussian_spectrum(lengths, direction), rng)


def _lengths(
    grid: Grid, length: float | tuple[float, float], direction: float
) -> tuple[float, float]:
    lengths = length if isinstance(length, tuple) else (length, length)
    require_lengths(grid, lengths, direction)
    return lengths


def require_lengths(
    grid: Grid,
    lengths: tuple[float, float],
    direction: float,
    names: tuple[str, str] = ("correlation length along x", "correlation length along y"),
) -> None:
    """Raise BadInput for a length below 2 cells or above half the domain in its direction."""
    cosine = abs(np.cos(direction))
    sine = abs(np.sin(direction))
    for name, length, along in zip(names, lengths, ((cosine, sine), (sine, cosine)), strict=True):
        subject = (
            name
            if direction == 0.0
            else name.replace("along x", "along the lay").replace("along y", "across it")
        )
        require_positive(subject, length, "m")
        coarsest = 2.0 / np.hypot(along[0] / grid.spacing[0], along[1] / grid.spacing[1])
        longest = 0.5 / max(along[0] / grid.extent[0], along[1] / grid.extent[1])
        if length < coarsest * (1.0 - 1e-9):
            finer = _resolving_cells(grid, lengths, direction)
            raise BadInput(
                f"{subject} must be at least 2 cells, {length_text(coarsest)}, got "
                f"{length_text(length)}; use at least {finer[0]} x {finer[1]} cells or a longer one"
            )
        if length > longest * (1.0 + 1e-9):
            raise BadInput(
                f"{subject} must be at most half the domain, {length_text(longest)}, "
                f"got {length_text(length)}; use a larger domain or a shorter one"
            )


def _resolving_cells(grid: Grid, lengths: tuple[float, float], direction: float) -> tuple[int, int]:
    """Return cells (nx, ny) with 2 cells on each length; an axis that matters to none is kept."""
    finer, along = list(grid.cells), (abs(np.cos(direction)), abs(np.sin(direction)))
    for axis, extent in enumerate(grid.extent):
        for length, share in zip(lengths, along[:: 1 - 2 * axis], strict=True):
            if share > 1e-9:
                finer[axis] = max(finer[axis], math.ceil(2.0 * extent / length - 1e-9))
    return finer[0], finer[1]


def _gaussian_spectrum(
    lengths: tuple[float, float], direction: float
) -> tuple[Callable[[Field, Field], Field], tuple[float, float]]:
    """Return the amplitude as a function of (kx, ky), and the largest relevant kx and ky."""
    (first, second) = lengths
    cosine = np.cos(direction)
    sine = np.sin(direction)

    def amplitude(kx: Field, ky: Field) -> Field:
        along = kx * cosine + ky * sine
        across = ky * cosine - kx * sine
        return np.asarray(np.exp(-((along * first) ** 2 + (across * second) ** 2) / 8.0))

    return amplitude, (
        float(_LARGEST_WAVENUMBER * np.hypot(cosine / first, sine / second)),
        float(_LARGEST_WAVENUMBER * np.hypot(sine / first, cosine / second)),
    )


def non_gaussian_surface(
    grid: Grid,
    *,
    sq: float,
    skewness: float,
    kurtosis: float,
    correlation_length: float | tuple[float, float],
    direction: float = 0.0,
    rng: np.random.Generator,
) -> Surface:
    """Generate heights whose sample has the given skewness, kurtosis and correlation lengths.

    A Gaussian surface is translated by the Johnson curve (SU or SB) that gives its sample both
    moments. Translation shortens correlations, so the Gaussian surface has longer ones and the
    autocorrelation of the result falls to 1/e at the given lengths. Sources: N. L. Johnson,
    Biometrika 36 (1949) 149; the polynomial of correlations of M. Grigoriu, J. Eng. Mech. 110
    (1984) 610.

    Parameters
    ----------
    grid, sq, correlation_length, direction, rng : as for `gaussian_surface`
    skewness : Ssk; negative for deep pits and flat peaks
    kurtosis : Sku; 3 for Gaussian heights, more for rare high peaks or deep pits

    Raises
    ------
    BadInput
        The moments are impossible (kurtosis below 1 + skewness^2) or not attainable by this sample;
        and as `gaussian_surface`.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import height_parameters, non_gaussian_surface
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> rng = np.random.default_rng(1)
    >>> surface = non_gaussian_surface(
    ...     grid, sq=0.5e-6, skewness=-1.0, kurtosis=5.0, correlation_length=50e-6, rng=rng
    ... )
    >>> f"Ssk {height_parameters(surface).ssk:.1f}, Sku {height_parameters(surface).sku:.1f}"
    'Ssk -1.0, Sku 5.0'
    """
    if not kurtosis > 1.0 + skewness**2:
        raise BadInput(
            f"kurtosis must be above 1 + skewness^2 = {1.0 + skewness**2:.4g}, got {kurtosis:g}; "
            "raise it, or reduce the skewness"
        )
    lengths = _lengths(grid, correlation_length, direction)
    stretch = johnson.stretch(skewness, kurtosis)
    longer = (lengths[0] * stretch, lengths[1] * stretch)
    gaussian = _filtered_noise(grid, 1.0, *_gaussian_spectrum(longer, direction), rng).heights
    curve, moments = johnson.fit(*johnson.histogram(gaussian), skewness, kurtosis)
    if (
        abs(moments[0] - skewness) > 0.02 * max(1.0, abs(skewness))
        or abs(moments[1] - kurtosis) > 0.02 * kurtosis
    ):
        raise BadInput(
            f"this sample cannot have a skewness of {skewness:g} and a kurtosis of {kurtosis:g} "
            f"(nearest: {moments[0]:.3g} and {moments[1]:.3g}); use a larger domain, shorter "
            "correlation lengths or less extreme values"
        )
    return Surface.scaled(curve(gaussian), grid, sq)


def run_in_surface(
    grid: Grid,
    *,
    sq: float,
    correlation_length: float | tuple[float, float],
    plateau_share: float,
    plateau_roughness: float = 0.1,
    direction: float = 0.0,
    rng: np.random.Generator,
) -> Surface:
    """Generate a Gaussian surface with peaks worn to a plateau, as by running-in or plateau honing.

    z = min(z1, c + r z2): above the height c the rough surface z1 is replaced by the finer
    roughness z2 of the plateau. Source: the two processes of ISO 13565-3.

    Parameters
    ----------
    grid, sq, correlation_length, direction, rng : as for `gaussian_surface`; the lengths are those
        of z1
    plateau_share : share of the surface on the plateau, above 0 and below 1; determines c
    plateau_roughness : r, Sq of the plateau over that of z1; its correlation lengths are half as
        long, as far as the grid resolves them

    Raises
    ------
    BadInput
        The share is out of range or the roughness negative; and as `gaussian_surface`.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import height_parameters, run_in_surface
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> surface = run_in_surface(
    ...     grid,
    ...     sq=0.5e-6,
    ...     correlation_length=50e-6,
    ...     plateau_share=0.6,
    ...     rng=np.random.default_rng(1),
    ... )
    >>> f"Ssk {height_parameters(surface).ssk:.1f}"
    'Ssk -2.4'
    """
    if not 0.0 < plateau_share < 1.0:
        raise BadInput(
            f"plateau_share must lie between 0 and 1, got {plateau_share:g}; a run-in "
            "surface has about 0.4"
        )
    if not 0.0 <= plateau_roughness <= 1.0:
        raise BadInput(
            f"plateau_roughness must lie between 0 and 1, got {plateau_roughness:g}; 0.1 is usual"
        )
    lengths = _lengths(grid, correlation_length, direction)
    rough = _filtered_noise(grid, 1.0, *_gaussian_spectrum(lengths, direction), rng).heights
    finer = (lengths[0] / 2.0, lengths[1] / 2.0)
    fine = _filtered_noise(grid, 1.0, *_gaussian_spectrum(finer, direction), rng).heights
    heights = np.minimum(rough, np.quantile(rough, 1.0 - plateau_share) + plateau_roughness * fine)
    return Surface.scaled(heights, grid, sq)


@usual_float_errors
def self_affine_surface(
    grid: Grid, *, sq: float, hurst: float, cutoffs: tuple[float, float], rng: np.random.Generator
) -> Surface:
    """Generate Gaussian heights with the spectrum C(q) ~ q^(-2 (1 + H)) between two wavelengths.

    The spectrum is constant above the longest wavelength (roll-off) and zero below the shortest.
    Source: B. N. J. Persson et al., J. Phys.: Condens. Matter 17 (2005) R1, section 2.

    Parameters
    ----------
    grid : grid of the heights
    sq : root-mean-square height of the sample [m]; the mean is zero
    hurst : H, above 0 and at most 1
    cutoffs : shortest and longest wavelength of the power law [m]
    rng : random generator

    Raises
    ------
    BadInput
        The Hurst exponent is out of range, or the cut-offs are swapped, below 2 cells or beyond the
        domain.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.contact.grid import Grid
    >>> from asperity.surface import self_affine_surface
    >>> grid = Grid(cells=(64, 64), lower=(0.0, 0.0), upper=(1e-3, 1e-3), periodic=(True, True))
    >>> surface = self_affine_surface(
    ...     grid, sq=0.5e-6, hurst=0.8, cutoffs=(50e-6, 500e-6), rng=np.random.default_rng(1)
    ... )
    >>> f"Sq {surface.heights.std() * 1e6:.2f} um"
    'Sq 0.50 um'
    """
    if not 0.0 < hurst <= 1.0:
        raise BadInput(
            f"hurst must lie above 0 and be at most 1, got {hurst:g}; machined metal has about 0.8"
        )
    shortest, longest = cutoffs
    coarsest = 2.0 * max(grid.spacing)
    domain = min(grid.extent)
    if not coarsest <= shortest < longest <= domain:
        finer = _resolving_cells(grid, (shortest, shortest), 0.0) if shortest > 0.0 else grid.cells
        raise BadInput(
            f"cutoffs must rise from at least 2 cells, {length_text(coarsest)}, to at most the "
            f"domain, {length_text(domain)}, got {length_text(shortest)} to "
            f"{length_text(longest)}; change them or the grid"
            + ("" if shortest >= coarsest else f" to at least {finer[0]} x {finer[1]} cells")
        )
    k_short = 2.0 * np.pi / shortest
    k_long = 2.0 * np.pi / longest

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
    """Filter white noise, sampled as the spectrum needs, and evaluate it at the cell centres."""
    require_roughness(sq)
    # odd counts have no Nyquist wave, so every wave has a conjugate
    highest = _largest_modes(grid, largest_wavenumbers)
    noise = rng.standard_normal([2 * m + 1 for m in highest])
    modes = [np.fft.ifftshift(np.arange(-m, m + 1)) for m in highest]
    kx, ky = (2.0 * np.pi / extent * m for m, extent in zip(modes, grid.extent, strict=True))
    waves = np.fft.fft2(noise) * amplitude(*np.ix_(kx, ky)) * _cell_centre_phases(kx, ky, grid)
    waves[0, 0] = 0.0  # zero mean
    resolved = [np.abs(m) < cells / 2.0 for m, cells in zip(modes, grid.cells, strict=True)]
    retained = np.ix_(*(m[inside] for m, inside in zip(modes, resolved, strict=True)))
    spectrum = np.zeros(grid.cells, dtype=complex)
    spectrum[retained] = waves[np.ix_(*resolved)]
    return Surface.scaled(np.fft.ifft2(spectrum).real, grid, sq)


def _largest_modes(grid: Grid, largest_wavenumbers: tuple[float, float]) -> list[int]:
    """Return the number of periods in the domain of the shortest wave along each axis."""
    return [
        int(np.ceil(k * extent / (2.0 * np.pi)))
        for k, extent in zip(largest_wavenumbers, grid.extent, strict=True)
    ]


def _cell_centre_phases(kx: Field, ky: Field, grid: Grid) -> npt.NDArray[np.complex128]:
    """Return the phases of waves half a cell from the corner, where the noise starts."""
    dx, dy = grid.spacing
    return np.outer(np.exp(0.5j * kx * dx), np.exp(0.5j * ky * dy))
