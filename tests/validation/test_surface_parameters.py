"""ISO 25178 parameters against closed forms, and the slope against SurfaceTopography."""

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.third_party import surface_topography
from asperity.surface import (
    MeasuredSurface,
    Surface,
    flat_surface,
    gaussian_surface,
    self_affine_surface,
)
from asperity.surface import surface_parameters as parameters

BOTH, NEITHER = (True, True), (False, False)


def grid(cells=(256, 256), size=(256e-6, 256e-6), periodic=BOTH):
    return Grid(cells, (0.0, 0.0), size, periodic)


def gaussian(seed, length=(8e-6, 8e-6), on=None):
    return gaussian_surface(
        on or grid(), sq=1e-6, correlation_length=length, rng=np.random.default_rng(seed)
    )


def correlation(surface):
    spectrum = np.abs(np.fft.fft2(surface.heights)) ** 2
    return np.fft.ifft2(spectrum).real / spectrum.sum() * spectrum.size


def test_a_sinusoid():
    g = grid((400, 64), (100e-6, 32e-6))
    amplitude, wavelength = 2e-6, 20e-6
    found = parameters(
        Surface(amplitude * np.sin(2 * np.pi * g.x / wavelength)[:, None] * np.ones(64), g)
    )
    assert found.sq == pytest.approx(amplitude / np.sqrt(2.0), rel=1e-9)
    assert found.sa == pytest.approx(amplitude * 2.0 / np.pi, rel=1e-3)
    assert found.ssk == pytest.approx(0.0, abs=1e-9)
    assert found.sku == pytest.approx(1.5, rel=1e-9)
    assert found.sdq == pytest.approx(found.sq * 2.0 * np.pi / wavelength, rel=1e-3)
    assert found.sal == pytest.approx(np.arccos(0.2) / (2.0 * np.pi) * wavelength, rel=1e-3)
    assert found.str_bounded  # the autocorrelation does not decay along the grooves
    assert found.str_ <= found.sal / 16e-6


def test_gaussian_surfaces_have_gaussian_heights():
    found = [parameters(gaussian(seed)) for seed in range(8)]
    assert np.mean([p.sa for p in found]) == pytest.approx(np.sqrt(2.0 / np.pi) * 1e-6, rel=0.01)
    assert np.mean([p.ssk for p in found]) == pytest.approx(0.0, abs=0.08)
    assert np.mean([p.sku for p in found]) == pytest.approx(3.0, abs=0.12)


@pytest.mark.parametrize("length", [(8e-6, 8e-6), (6e-6, 12e-6)])
def test_gaussian_surfaces_have_the_slope_and_lengths_of_their_autocorrelation(length):
    """R = exp(-(x/lx)^2 - (y/ly)^2): Sdq^2 = 2 Sq^2 (1/lx^2 + 1/ly^2), Sal = lx sqrt(ln 5), Str =
    lx/ly.
    """
    on = grid((512, 256), (256e-6, 256e-6))
    mean = np.mean(
        [np.fft.fftshift(correlation(gaussian(seed, length, on))) for seed in range(12)], axis=0
    )
    # Sal and Str of single samples scatter, so the autocorrelation is averaged over samples
    assert np.interp(length[0], on.x - on.x[256], mean[:, 128]) == pytest.approx(
        np.exp(-1.0), abs=0.02
    )
    assert np.interp(length[1], on.y - on.y[128], mean[256]) == pytest.approx(
        np.exp(-1.0), abs=0.02
    )
    found = [parameters(gaussian(seed, length, on)) for seed in range(12)]
    slope = 1e-6 * np.sqrt(2.0 / length[0] ** 2 + 2.0 / length[1] ** 2)
    assert np.mean([p.sdq for p in found]) == pytest.approx(slope, rel=0.01)
    assert np.mean([p.sal for p in found]) == pytest.approx(
        length[0] * np.sqrt(np.log(5.0)), rel=0.06
    )
    assert np.mean([p.str_ for p in found]) == pytest.approx(length[0] / length[1], abs=0.12)


@pytest.mark.parametrize("hurst", [0.3, 0.8])
def test_self_affine_surfaces_have_the_requested_power_law(hurst):
    g = grid((256, 256), (256e-6, 256e-6))
    spectrum = np.mean(
        [
            np.abs(
                np.fft.fft2(
                    self_affine_surface(
                        g, sq=1e-6, hurst=hurst, cutoffs=(4e-6, 64e-6), rng=r
                    ).heights
                )
            )
            ** 2
            for r in np.random.default_rng(3).spawn(6)
        ],
        axis=0,
    )
    k = np.fft.fftfreq(256, 1e-6)
    k = np.hypot(k[:, None], k[None, :])
    law, plateau = (k > 1.1 / 64e-6) & (k < 0.95 / 4e-6), (k > 0) & (k < 0.95 / 64e-6)
    slope = np.polyfit(np.log(k[law]), np.log(spectrum[law]), 1)[0]
    assert slope == pytest.approx(-2.0 * (1.0 + hurst), abs=0.05)
    ring = (k > 0.95 / 64e-6) & (k < 1.1 / 64e-6)
    assert spectrum[plateau].mean() == pytest.approx(spectrum[ring].mean(), rel=0.5)  # roll-off
    assert spectrum[k > 1.01 / 4e-6].max() < 1e-20 * spectrum.max()


@pytest.mark.parametrize("periodic", [BOTH, NEITHER])
def test_the_slope_agrees_with_surfacetopography(periodic):
    heights = gaussian(5).heights[:200, :120]
    g = grid((200, 120), (300e-6, 120e-6), periodic)
    found = parameters(Surface(heights, g))
    twin = surface_topography().Topography(
        heights - heights.mean(), (300e-6, 120e-6), periodic=periodic[0]
    )
    assert found.sdq == pytest.approx(twin.rms_gradient(), rel=0.01)


def test_missing_cells_hardly_change_the_parameters():
    heights = gaussian(6).heights
    g = grid(periodic=NEITHER)
    holed = np.where(np.random.default_rng(1).random(heights.shape) < 0.2, np.nan, heights)
    whole, found = (
        parameters(Surface(heights, g)),
        parameters(MeasuredSurface(holed, g, "map.x3p", "x3p")),
    )
    for name, tolerance in {
        "sa": 0.02,
        "sq": 0.02,
        "sku": 0.02,
        "sdq": 0.02,
        "sal": 0.01,
        "str_": 0.03,
    }.items():
        assert getattr(found, name) == pytest.approx(getattr(whole, name), rel=tolerance), name


def test_transposing_the_map_does_not_change_its_parameters():
    surface = gaussian(7, (6e-6, 12e-6))
    turned = Surface(np.ascontiguousarray(surface.heights.T), surface.grid)
    original, transposed = parameters(surface), parameters(turned)
    assert original.sal == pytest.approx(transposed.sal, rel=1e-9)
    assert original.str_ == pytest.approx(transposed.str_, rel=1e-9)


def test_a_flat_surface_has_no_texture():
    found = parameters(flat_surface(grid()))
    assert (found.sa, found.sq, found.sdq) == (0.0, 0.0, 0.0)
    assert np.isnan([found.ssk, found.sku, found.sal, found.str_]).all()
