"""Generated surfaces have the requested properties over 20 seeds; a seed gives the same surface on
every machine.
"""

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.surface import (
    correlation_lengths,
    gaussian_surface,
    ground_surface,
    non_gaussian_surface,
    run_in_surface,
    sandblasted_surface,
    self_affine_surface,
    surface_parameters,
    surface_spectrum,
)

SEEDS = range(20)


def grid(cells=256, side=512e-6):
    return Grid((cells, cells), (0.0, 0.0), (side, side), (True, True))


def moments(heights):
    z = heights / np.std(heights)
    return float(np.mean(z**3)), float(np.mean(z**4))


@pytest.mark.parametrize("direction", [0.0, 0.6])
def test_gaussian_surfaces_have_the_requested_sq_and_correlation_lengths(direction):
    requested = (20e-6, 10e-6)
    surfaces = [
        gaussian_surface(
            grid(),
            sq=1e-6,
            correlation_length=requested,
            direction=direction,
            rng=np.random.default_rng(seed),
        )
        for seed in SEEDS
    ]
    assert [surface.sq for surface in surfaces] == pytest.approx([1e-6] * 20, rel=1e-12)
    found = np.mean([correlation_lengths(surface, direction) for surface in surfaces], axis=0)
    assert found == pytest.approx(requested, rel=0.05)


@pytest.mark.parametrize(
    ("skewness", "kurtosis"), [(-1.0, 5.0), (0.5, 3.2), (0.0, 2.0), (-2.0, 9.0), (0.0, 3.0)]
)
def test_non_gaussian_surfaces_have_the_requested_moments_in_every_sample(skewness, kurtosis):
    requested, found = (20e-6, 10e-6), []
    for seed in SEEDS:
        surface = non_gaussian_surface(
            grid(),
            sq=0.5e-6,
            skewness=skewness,
            kurtosis=kurtosis,
            correlation_length=requested,
            rng=np.random.default_rng(seed),
        )
        assert surface.sq == pytest.approx(0.5e-6, rel=1e-12)
        assert moments(surface.heights) == pytest.approx((skewness, kurtosis), rel=0.01, abs=0.01)
        found.append(correlation_lengths(surface))
    assert np.mean(found, axis=0) == pytest.approx(requested, rel=0.05)


@pytest.mark.parametrize("hurst", [0.3, 0.8])
def test_self_affine_surfaces_have_the_slope_of_their_hurst_exponent(hurst):
    densities = []
    for seed in SEEDS:
        surface = self_affine_surface(
            grid(), sq=1e-6, hurst=hurst, cutoffs=(8e-6, 200e-6), rng=np.random.default_rng(seed)
        )
        spectrum = surface_spectrum(surface)
        densities.append(spectrum.density)
    inside = (spectrum.wavenumber > 2.0 * np.pi / 150e-6) & (
        spectrum.wavenumber < 2.0 * np.pi / 9e-6
    )
    slope = np.polyfit(
        np.log(spectrum.wavenumber[inside]), np.log(np.mean(densities, axis=0)[inside]), 1
    )[0]
    assert slope == pytest.approx(-2.0 * (1.0 + hurst), abs=0.05)


@pytest.mark.parametrize("share", [0.2, 0.6])
def test_a_run_in_surface_has_the_requested_plateau(share):
    surface = run_in_surface(
        grid(),
        sq=1e-6,
        correlation_length=12e-6,
        plateau_share=share,
        plateau_roughness=0.0,
        rng=np.random.default_rng(3),
    )
    top = surface.heights.max()
    assert np.mean(surface.heights > top - 1e-12) == pytest.approx(share, abs=1e-3)
    assert surface.sq == pytest.approx(1e-6, rel=1e-12)
    rough = surface_parameters(
        run_in_surface(
            grid(),
            sq=1e-6,
            correlation_length=12e-6,
            plateau_share=share,
            rng=np.random.default_rng(3),
        )
    )
    assert rough.ssk < -0.2
    assert rough.svk > 3.0 * rough.spk


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 135.0])
def test_a_ground_surface_has_the_requested_lay(degrees):
    lay = np.radians(degrees)
    found = []
    for seed in range(4):
        surface = ground_surface(
            grid(),
            sq=1e-6,
            groove_width=12e-6,
            groove_length=120e-6,
            direction=lay,
            rng=np.random.default_rng(seed),
        )
        spectrum = surface_spectrum(surface)
        # directions of a lay are equal modulo 180 degrees: average at twice the angle
        found.append(0.5 * np.angle(np.sum(spectrum.share * np.exp(2j * spectrum.lay))))
        along, across = correlation_lengths(surface, lay)
        assert along > 4.0 * across
        assert surface.sq == pytest.approx(1e-6, rel=1e-12)
        assert surface_parameters(surface).ssk < -0.3  # deep grooves, no high peaks
    deviation = np.degrees(np.angle(np.mean(np.exp(2j * (np.array(found) - lay)))) / 2.0)
    assert abs(deviation) < 3.0


def test_a_sandblasted_surface_has_no_lay_and_pits_of_the_crater_radius():
    surfaces = [
        sandblasted_surface(grid(), sq=1e-6, crater_radius=12e-6, rng=np.random.default_rng(seed))
        for seed in SEEDS
    ]
    assert [surface.sq for surface in surfaces] == pytest.approx([1e-6] * 20, rel=1e-12)
    lengths = np.mean([correlation_lengths(surface) for surface in surfaces], axis=0)
    assert lengths[0] == pytest.approx(lengths[1], rel=0.03)
    # autocorrelation of craters z = -R (1 - u)^2 (1 - 4 u), summed over random radii
    x = np.linspace(-4.0, 4.0, 401)
    u = np.minimum((x[:, None] ** 2 + x[None, :] ** 2) / 4.0, 1.0)
    power = np.abs(np.fft.fft2((1.0 - u) ** 2 * (1.0 - 4.0 * u), (1024, 1024))) ** 2
    autocorrelation, lags = np.fft.ifft2(power).real[:500, 0], np.arange(500) * 0.02
    radii = np.clip(1.0 + 0.25 * np.random.default_rng(0).standard_normal(2000), 0.25, 1.75)
    correlation = np.sum([r**4 * np.interp(lags / r, lags, autocorrelation) for r in radii], axis=0)
    distance = np.interp(-np.exp(-1.0), -correlation / correlation[0], lags)
    assert lengths[0] == pytest.approx(12e-6 * distance, rel=0.03)


@pytest.mark.parametrize(
    "make",
    [
        lambda g, r: gaussian_surface(
            g, sq=1e-6, correlation_length=(40e-6, 20e-6), direction=0.4, rng=r
        ),
        lambda g, r: ground_surface(
            g, sq=1e-6, groove_width=40e-6, groove_length=200e-6, direction=1.2, rng=r
        ),
        lambda g, r: sandblasted_surface(g, sq=1e-6, crater_radius=30e-6, rng=r),
    ],
)
def test_a_finer_grid_shows_the_same_physical_surface(make):
    coarse, fine = (make(grid(cells), np.random.default_rng(5)).heights for cells in (64, 192))
    # the middle of three fine cells has the centre of the coarse cell; only mean and Sq of the
    # sample differ
    slope, offset = np.polyfit(fine[1::3, 1::3].ravel(), coarse.ravel(), 1)
    assert slope == pytest.approx(1.0, abs=0.03)
    assert abs(offset) < 0.03e-6
    np.testing.assert_allclose(coarse, slope * fine[1::3, 1::3] + offset, atol=1e-9)


REFERENCE = {
    "gaussian": lambda g, r: gaussian_surface(
        g, sq=1e-6, correlation_length=(60e-6, 40e-6), direction=0.3, rng=r
    ),
    "non-gaussian": lambda g, r: non_gaussian_surface(
        g, sq=1e-6, skewness=-1.0, kurtosis=5.0, correlation_length=40e-6, rng=r
    ),
    "self-affine": lambda g, r: self_affine_surface(
        g, sq=1e-6, hurst=0.8, cutoffs=(40e-6, 200e-6), rng=r
    ),
    "ground": lambda g, r: ground_surface(
        g, sq=1e-6, groove_width=80e-6, groove_length=200e-6, rng=r
    ),
    "sandblasted": lambda g, r: sandblasted_surface(g, sq=1e-6, crater_radius=40e-6, rng=r),
    "run-in": lambda g, r: run_in_surface(
        g, sq=1e-6, correlation_length=40e-6, plateau_share=0.4, rng=r
    ),
}
# heights [nm] of cells (0, 0), (9, 20) and (31, 5) of 32 x 32, seed 11, from the first version
RECORDED = {
    "gaussian": (1509.002, 1498.335, -557.237),
    "ground": (-88.253, -1098.159, 1369.805),
    "non-gaussian": (1286.951, 921.592, -1227.375),
    "run-in": (701.175, 938.895, -1519.719),
    "sandblasted": (174.981, -2246.358, -1502.463),
    "self-affine": (-305.593, 1585.679, -816.499),
}


@pytest.mark.parametrize("kind", REFERENCE)
def test_a_seed_gives_the_same_surface_on_any_machine(kind):
    heights = REFERENCE[kind](grid(32), np.random.default_rng(11)).heights
    assert [1e9 * heights[cell] for cell in ((0, 0), (9, 20), (31, 5))] == pytest.approx(
        RECORDED[kind], rel=1e-4, abs=0.01
    )
