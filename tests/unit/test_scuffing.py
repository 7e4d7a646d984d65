"""Scuffing: limit, closed-form threshold, and transfer of material."""

from dataclasses import replace

import numpy as np
import pytest

from asperity import BadInput
from asperity.rating import flash_rise
from asperity.wear.scuffing import PressureShearScuffing, TemperatureScuffing
from support.passages import hertz_patches, passage, track

P_MAX, MU = 1e9, 0.1


def sliding_passage(**given):
    grid = track()
    patches = hertz_patches(grid, 50e-6, P_MAX, 4, friction=MU, asperities=1.0)
    waves = 1e-4 * np.cos(0.1 * np.arange(grid.cells[0]))[:, None] + np.zeros(
        grid.cells
    )  # effectively unlimited roughness
    return passage(
        grid, patches, **({"removed": np.full(grid.cells, 1e-9), "heights": waves} | given)
    )


def test_below_the_limit_nothing_scuffs():
    change = PressureShearScuffing(limit=1.0001 * MU * P_MAX**2)(sliding_passage())
    assert not change.heights_change.any()
    assert not change.transferred.any()
    assert change.facts["load_share"] == 0.0


def test_a_cell_scuffs_if_pressure_times_shear_exceeds_the_limit():
    """μ p² > limit; for a Hertz pressure within x² < a² (1 - limit/(μ p_max²))."""
    grid = track((400, 8))
    (patch,) = hertz_patches(grid, 50e-6, P_MAX, 1, friction=MU, asperities=1.0)
    exceeds_limit = PressureShearScuffing(limit=0.36 * MU * P_MAX**2).exceeds_limit(patch)
    assert np.array_equal(exceeds_limit[:, 0], np.abs(grid.x) < 0.8 * 50e-6)


def test_removal_is_multiplied_by_the_factor_and_the_volume_transferred():
    """For a scuffed load share s: (factor - 1) s of the law's removal, of which `transfer` passes
    over.
    """
    jump = sliding_passage()
    change = PressureShearScuffing(limit=0.25 * MU * P_MAX**2, factor=1000.0, transfer=0.3)(jump)
    load = sum(patch.asperity_pressure for patch in jump.patches)
    scuffed_load = sum(
        np.where(patch.pressure > 0.5 * P_MAX, patch.asperity_pressure, 0.0)
        for patch in jump.patches
    )
    expected = (
        999.0 * np.divide(scuffed_load, load, out=np.zeros_like(load), where=load > 0.0) * 1e-9
    )
    np.testing.assert_allclose(-change.heights_change, expected, rtol=1e-12)
    np.testing.assert_array_equal(change.transferred, -0.3 * change.heights_change)
    volume = -change.heights_change.sum() * float(np.prod(jump.grid.spacing))
    assert change.facts["volume_m3"] == pytest.approx(volume, rel=1e-12, abs=0.0)
    assert change.facts["load_share"] == pytest.approx(
        scuffed_load.sum() / load.sum(), rel=1e-12, abs=0.0
    )


def test_scuffing_removes_a_tenth_of_sq_per_solve():
    scuffing = PressureShearScuffing(limit=0.25 * MU * P_MAX**2)
    slow, fast = (
        scuffing(sliding_passage(removed=np.full((64, 32), depth))) for depth in (1e-9, 1e-6)
    )
    sq = float(np.std(sliding_passage().heights))
    assert -slow.heights_change.min() < 0.1 * sq
    assert -fast.heights_change.min() == pytest.approx(0.1 * sq, rel=1e-9)
    assert fast.longest == pytest.approx(slow.longest / 1000.0, rel=1e-9)
    assert fast.longest / 1e5 == pytest.approx(
        0.1 * sq / (-slow.heights_change.min() * 1000.0), rel=1e-9
    )
    assert PressureShearScuffing(limit=1e30)(sliding_passage()).longest == np.inf


def test_jumps_of_a_smooth_body_are_limited_by_the_film():
    """Without its own Sq, the film thickness is the scale; without a film, 10 nm."""
    scuffing = PressureShearScuffing(limit=0.25 * MU * P_MAX**2)
    smooth = sliding_passage(heights=np.zeros(track().cells), removed=np.full(track().cells, 1e-6))
    assert -scuffing(smooth).heights_change.min() == pytest.approx(0.1 * 0.5e-6, rel=1e-9, abs=0.0)
    dry = replace(
        smooth,
        patches=tuple(replace(patch, film=np.zeros_like(patch.film)) for patch in smooth.patches),
    )
    assert -scuffing(dry).heights_change.min() == pytest.approx(0.1 * 1e-8, rel=1e-9, abs=0.0)


def test_the_temperature_threshold_is_bloks():
    """Friction just above that at which Blok's rise equals the limit scuffs; just below does
    not.
    """
    line_load, width, speeds = 0.5 * np.pi * 50e-6 * P_MAX, 50e-6, (2.0, 1.5)
    threshold = 100.0 / flash_rise(1.0, line_load, width, speeds)
    scuffing = TemperatureScuffing(limit=100.0)
    for friction, share in ((0.999 * threshold, False), (1.001 * threshold, True)):
        expected_rise = flash_rise(friction, line_load, width, speeds)
        scuffed = [
            replace(patch, temperature=expected_rise * patch.pressure / patch.pressure.max())
            for patch in hertz_patches(track((65, 8)), width, P_MAX, 1, asperities=1.0)
        ]
        assert scuffing.exceeds_limit(scuffed[0]).any() == share


def test_only_touching_cells_scuff():
    grid = track()
    (patch,) = hertz_patches(grid, 50e-6, P_MAX, 1, friction=MU, asperities=0.0)
    hot_patch = replace(patch, temperature=np.full(grid.cells, 1e3))
    assert not TemperatureScuffing(limit=100.0).exceeds_limit(hot_patch).any()
    assert not PressureShearScuffing(limit=1.0).exceeds_limit(hot_patch).any()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"limit": -5.0}, "scuffing limit must be positive"),
        ({"limit": 100.0, "factor": 0.5}, "scuffing factor must be 1 or more"),
        ({"limit": 100.0, "transfer": 1.5}, "scuffing transfer must lie between 0 and 1"),
    ],
)
def test_invalid_scuffing_settings_are_refused(wrong, message):
    with pytest.raises(BadInput, match=message):
        TemperatureScuffing(**wrong)


def test_a_missing_temperature_is_requested():
    with pytest.raises(BadInput, match="needs the flash temperature"):
        TemperatureScuffing(limit=100.0)(sliding_passage())
