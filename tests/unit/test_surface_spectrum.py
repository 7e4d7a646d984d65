import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.surface import (
    MeasuredSurface,
    Surface,
    flat_surface,
    gaussian_surface,
    surface_spectrum,
)

BOTH = (True, True)


def test_the_density_integrates_to_sq_squared():
    """Sq^2 = (1/4 pi^2) integral of C d2q; the ring averages omit only the corners of the plane."""
    grid = Grid((256, 256), (0.0, 0.0), (256e-6, 256e-6), BOTH)
    surface = gaussian_surface(
        grid, sq=1.3e-6, correlation_length=8e-6, rng=np.random.default_rng(1)
    )
    spectrum = surface_spectrum(surface)
    q, c = spectrum.wavenumber, spectrum.density
    assert np.sqrt(np.trapezoid(c * q**2, np.log(q)) / (2.0 * np.pi)) == pytest.approx(
        1.3e-6, rel=0.03
    )
    # closed form of the Gaussian autocorrelation: C = pi l^2 Sq^2 exp(-(q l)^2/4)
    band = (q > 5e4) & (q < 4e5)
    expected = np.pi * (8e-6) ** 2 * (1.3e-6) ** 2 * np.exp(-((q * 8e-6) ** 2) / 4.0)
    assert np.mean(np.log(c[band] / expected[band])) == pytest.approx(0.0, abs=0.1)


def test_tapering_the_edges_conserves_power():
    grid = Grid((256, 256), (0.0, 0.0), (256e-6, 256e-6), (False, False))
    sq = []
    for seed in range(8):
        surface = gaussian_surface(
            grid, sq=1.3e-6, correlation_length=8e-6, rng=np.random.default_rng(seed)
        )
        spectrum = surface_spectrum(surface)
        power = np.trapezoid(spectrum.density * spectrum.wavenumber**2, np.log(spectrum.wavenumber))
        sq.append(np.sqrt(power / (2.0 * np.pi)))
    assert np.mean(sq) == pytest.approx(1.3e-6, rel=0.03)


@pytest.mark.parametrize("degrees", [0, 45, 90, 150])
def test_the_lay_follows_the_direction_of_the_ridges(degrees):
    grid = Grid((128, 128), (0.0, 0.0), (128e-6, 128e-6), (False, False))
    across = grid.y[None, :] * np.cos(np.radians(degrees)) - grid.x[:, None] * np.sin(
        np.radians(degrees)
    )
    spectrum = surface_spectrum(Surface(1e-6 * np.cos(2.0 * np.pi * across / 10e-6), grid))
    assert np.degrees(spectrum.lay[np.argmax(spectrum.share)]) == pytest.approx(degrees, abs=2.6)
    assert spectrum.share.sum() == pytest.approx(1.0)


def test_the_spectrum_of_a_profile_integrates_to_rq_squared():
    rng = np.random.default_rng(4)
    z = np.convolve(rng.standard_normal(5000), np.ones(12), "valid")[:, None] * np.ones(8) * 1e-7
    grid = Grid(z.shape, (0.0, 0.0), (z.shape[0] * 1e-6, 8e-6), (False, False))
    measured = MeasuredSurface(z, grid, "line.hfm", "xyz", uniform=1)
    spectrum = surface_spectrum(measured)
    rq = np.sqrt(
        np.trapezoid(spectrum.density * spectrum.wavenumber, np.log(spectrum.wavenumber)) / np.pi
    )
    assert rq == pytest.approx(measured.sq, rel=0.1)
    assert spectrum.lay.size == 0


def test_a_flat_surface_has_no_power():
    spectrum = surface_spectrum(flat_surface(Grid((32, 32), (0.0, 0.0), (1e-4, 1e-4), BOTH)))
    assert not spectrum.density.any()
    assert not spectrum.share.any()
