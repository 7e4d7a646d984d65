"""Parameters of maps and profiles against surfalize, an independent implementation, and closed
forms for sinusoids.
"""

import numpy as np
import pytest
import surfalize
from surfalize.profile import Profile

from asperity.contact.grid import Grid
from asperity.surface import (
    MeasuredSurface,
    Surface,
    bearing_curve,
    correlation_lengths,
    gaussian_surface,
    non_gaussian_surface,
    profile_parameters,
    surface_parameters,
)

AREAL = {  # name: surfalize's unit (um and %) in SI
    **dict.fromkeys(("sa", "sq", "sp", "sv", "sz", "sal", "sk", "spk", "svk"), 1e-6),
    **dict.fromkeys(("ssk", "sku", "sdq", "str_"), 1.0),
    **dict.fromkeys(("sdr", "smr1", "smr2"), 1e-2),
}
LINEAR = {
    **dict.fromkeys(("ra", "rq", "rp", "rv", "rz", "rt", "rk", "rpk", "rvk"), 1e-6),
    **dict.fromkeys(("rsk", "rku", "rdq"), 1.0),
    **dict.fromkeys(("rmr1", "rmr2"), 1e-2),
}


def grid(cells=(240, 180), size=(240e-6, 220e-6)):
    return Grid(cells, (0.0, 0.0), size, (False, False))


def sample_surface(kind, seed=4):
    rng = np.random.default_rng(seed)
    if kind == "gaussian":
        return gaussian_surface(grid(), sq=0.8e-6, correlation_length=(9e-6, 6e-6), rng=rng)
    return non_gaussian_surface(
        grid(), sq=2e-6, skewness=-1.2, kurtosis=5.5, correlation_length=(14e-6, 5e-6), rng=rng
    )


# the test surface intentionally has different pixel sizes
@pytest.mark.filterwarnings("ignore:The surface has different pixel size")
@pytest.mark.parametrize("kind", ["gaussian", "pitted"])
def test_areal_parameters_agree_with_surfalize(kind):
    surface = sample_surface(kind)
    ours = surface_parameters(surface)
    dx, dy = surface.grid.spacing
    theirs = surfalize.Surface(surface.heights.T * 1e6, dx * 1e6, dy * 1e6)
    for name, unit in AREAL.items():
        expected = getattr(theirs, name.rstrip("_").capitalize())() * unit
        assert getattr(ours, name) == pytest.approx(expected, rel=0.01), name
    curve = bearing_curve(surface.heights)
    for height in (-1e-6, 0.0, 0.7e-6):
        assert curve.material_ratio(height) == pytest.approx(
            theirs.Smr(height * 1e6) / 100.0, rel=0.01
        )


@pytest.mark.parametrize("kind", ["gaussian", "pitted"])
def test_profile_parameters_agree_with_surfalize(kind):
    profile = np.concatenate(sample_surface(kind).heights.T[::20])  # concatenated rows
    profile -= profile.mean()
    ours, theirs = profile_parameters(profile, 0.5e-6), Profile(profile * 1e6, 0.5)
    for name, unit in LINEAR.items():
        assert getattr(ours, name) == pytest.approx(
            getattr(theirs, name.capitalize())() * unit, rel=0.01
        ), name


def test_the_bearing_curve_of_a_sinusoid():
    """Heights follow the arcsine law. The core line is the secant over the flattest 40 %, fitted on
    either side.
    """
    on = Grid((4000, 16), (0.0, 0.0), (100e-6, 0.4e-6), (True, True))
    found = surface_parameters(
        Surface(1e-6 * np.sin(2.0 * np.pi * on.x / 20e-6)[:, None] * np.ones(16), on)
    )
    assert (found.sp, found.sv, found.sz) == pytest.approx((1e-6, 1e-6, 2e-6), rel=1e-5)
    share = np.linspace(0.0, 0.4, 4001)
    slope = np.polyfit(share, 1e-6 * np.cos(np.pi * share), 1)[0]
    assert found.sk == pytest.approx(-slope, rel=1e-3)
    curve = bearing_curve(np.sin(2.0 * np.pi * (np.arange(4000) + 0.5) / 4000))
    assert curve.material_ratio(0.5) == pytest.approx(1.0 / 3.0, abs=1e-3)
    assert curve.height_at(0.25) == pytest.approx(np.sqrt(0.5), abs=2e-3)


def test_the_developed_area_of_a_sinusoid():
    on = Grid((2000, 16), (0.0, 0.0), (20e-6, 0.16e-6), (True, True))
    k, amplitude = 2.0 * np.pi / 10e-6, 2e-6
    found = surface_parameters(Surface(amplitude * np.sin(k * on.x)[:, None] * np.ones(16), on))
    arc = np.mean(
        np.sqrt(1.0 + (amplitude * k * np.cos(np.linspace(0.0, 2.0 * np.pi, 100_001)[:-1])) ** 2)
    )
    assert found.sdr == pytest.approx(arc - 1.0, rel=1e-4)


def test_the_profile_of_a_sinusoid():
    x = (np.arange(5000) + 0.3) * 0.1e-6
    found = profile_parameters(1e-6 * np.sin(2.0 * np.pi * x / 20e-6), 0.1e-6)
    assert found.rq == pytest.approx(1e-6 / np.sqrt(2.0), rel=1e-6)
    assert found.ra == pytest.approx(2e-6 / np.pi, rel=1e-4)
    assert found.rz == pytest.approx(2e-6, rel=1e-3)
    assert found.rsm == pytest.approx(20e-6, rel=1e-4)
    assert found.rdq == pytest.approx(found.rq * 2.0 * np.pi / 20e-6, rel=1e-3)
    assert found.rku == pytest.approx(1.5, rel=1e-4)


def test_ripples_below_a_tenth_of_rz_are_not_counted():
    x = np.arange(5000) * 0.1e-6
    ripple = np.sin(2.0 * np.pi * x / 20e-6) + 0.15 * np.sin(2.0 * np.pi * x / 1e-6)
    assert profile_parameters(1e-6 * ripple, 0.1e-6).rsm == pytest.approx(20e-6, rel=0.01)


def test_missing_points_of_a_profile_are_ignored():
    z = np.sin(np.arange(4000) / 30.0) * 1e-6
    holed = z.copy()
    holed[1000:1040] = np.nan
    whole, found = profile_parameters(z, 1e-6), profile_parameters(holed, 1e-6)
    assert found.rq == pytest.approx(whole.rq, rel=0.01)
    assert found.rdq == pytest.approx(whole.rdq, rel=0.01)


def test_correlation_lengths_of_a_rotated_lay():
    on = Grid((512, 512), (0.0, 0.0), (1024e-6, 1024e-6), (True, True))
    surface = gaussian_surface(
        on, sq=1e-6, correlation_length=(24e-6, 10e-6), direction=0.6, rng=np.random.default_rng(1)
    )
    assert correlation_lengths(surface, 0.6) == pytest.approx((24e-6, 10e-6), rel=0.04)
    assert correlation_lengths(surface, 0.6 + np.pi / 2.0) == pytest.approx(
        (10e-6, 24e-6), rel=0.04
    )


def test_a_measured_profile_is_uniform_in_every_areal_parameter():
    z = np.sin(np.arange(800) / 10.0)[:, None] * np.ones(8) * 1e-6
    on = Grid((800, 8), (0.0, 0.0), (800e-6, 8e-6), (False, False))
    found = surface_parameters(MeasuredSurface(z, on, "line.hfm", "xyz", uniform=1))
    assert found.sq == pytest.approx(1e-6 / np.sqrt(2.0), rel=0.01)
    assert found.sal == pytest.approx(10e-6 * np.arccos(0.2), rel=0.01)
