from dataclasses import replace

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.surface import (
    CompositeSurface,
    MeasuredSurface,
    SurfaceConditioning,
    count_places,
    gaussian_surface,
    level,
    prepare_surface,
    step_sentence,
)


def measured(heights, pixel=1e-6):
    half = tuple(n * pixel / 2.0 for n in heights.shape)
    grid = Grid(heights.shape, tuple(-h for h in half), half, periodic=(False, False))
    return MeasuredSurface(heights, grid, "map.x3p", "x3p")


def rough(cells=(300, 240), seed=2, pixel=1e-6, length=8e-6):
    grid = Grid(cells, (0.0, 0.0), (cells[0] * pixel, cells[1] * pixel))
    return gaussian_surface(
        grid, sq=1e-6, correlation_length=length, rng=np.random.default_rng(seed)
    ).heights


def contact(cells=(96, 64), size=(120e-6, 80e-6), periodic=(False, True)):
    return Grid(cells, (-0.7 * size[0], -0.5 * size[1]), (0.3 * size[0], 0.5 * size[1]), periodic)


def form_on(cells):
    x, y = np.meshgrid(
        np.linspace(0.0, 1.0, cells[0]), np.linspace(0.0, 1.0, cells[1]), indexing="ij"
    )
    return 76e-3 + 1e-6 * (30.0 * x - 12.0 * y + 5.0 * x**2 - 7.0 * x * y + 3.0 * y**2)


def test_a_pure_form_leaves_no_residual_despite_missing_cells():
    heights = form_on((120, 90))
    heights[10:30, 40:60] = np.nan
    levelled, step = level(measured(heights), "quadratic")
    assert np.nanmax(np.abs(levelled.heights)) < 1e-15
    np.testing.assert_array_equal(np.isnan(levelled.heights), np.isnan(heights))
    assert "quadratic form" in step


def test_form_removal_does_not_change_the_roughness():
    roughness = rough()
    levelled, _ = level(measured(roughness), "quadratic")
    formed, _ = level(measured(roughness + form_on(roughness.shape)), "quadratic")
    np.testing.assert_allclose(formed.heights, levelled.heights, atol=1e-14)


def test_a_plane_leaves_curvature_and_no_form_leaves_tilt():
    cells = (60, 50)
    x = np.linspace(-1.0, 1.0, cells[0])[:, None] * np.ones(cells[1])
    assert level(measured(x * 1e-6), "none")[0].sq == pytest.approx(np.std(x * 1e-6))
    assert level(measured(x * 1e-6), "plane")[0].sq < 1e-20
    assert level(measured(x**2 * 1e-6), "plane")[0].sq == pytest.approx(np.std(x**2 * 1e-6))


def test_the_contact_is_cut_from_the_centre_of_the_map():
    heights = rough()
    grid = contact((120, 80), periodic=(False, False))
    prepared = prepare_surface(
        measured(heights), grid, conditioning=SurfaceConditioning(form="none")
    )
    middle = heights[90:210, 80:160]
    np.testing.assert_allclose(prepared.surface.heights, middle - middle.mean(), atol=1e-12)


def test_interpolation_follows_a_wave():
    x, y = np.meshgrid(np.arange(300) - 149.5, np.arange(240) - 119.5, indexing="ij")

    def wave(x, y):
        return 1e-6 * np.cos(2.0 * np.pi * x / 20e-6) * np.cos(2.0 * np.pi * y / 24e-6)

    grid = Grid((200, 160), (-60e-6, -40e-6), (60e-6, 40e-6), periodic=(False, False))
    prepared = prepare_surface(
        measured(wave(x * 1e-6, y * 1e-6)), grid, conditioning=SurfaceConditioning(form="none")
    )
    expected = wave(grid.x[:, None], grid.y[None, :])
    np.testing.assert_allclose(prepared.surface.heights, expected - expected.mean(), atol=2e-9)


@pytest.mark.parametrize(
    ("wavelength", "passed"), [(40e-6, 1.0), (12.5e-6, 1.0), (8e-6, 0.0), (3.7e-6, 0.0)]
)
def test_a_coarser_grid_keeps_only_the_waves_it_can_resolve(wavelength, passed):
    x = (np.arange(800) - 399.5)[:, None] * np.ones(200) * 1e-6
    heights = np.cos(2.0 * np.pi * x / wavelength)
    grid = Grid(
        (48, 16), (-120e-6, -40e-6), (120e-6, 40e-6), periodic=(False, False)
    )  # 5 um cells resolve waves from 10 um
    resampled = prepare_surface(
        measured(heights), grid, conditioning=SurfaceConditioning(form="none")
    ).surface.heights
    expected = passed * np.cos(2.0 * np.pi * grid.x / wavelength)
    np.testing.assert_allclose(resampled[:, 8], expected - expected.mean(), atol=0.005)


def test_the_ends_of_a_periodic_axis_match():
    heights = rough(seed=4)
    grid = contact()
    prepared = prepare_surface(measured(heights), grid).surface.heights
    steps = np.std(np.diff(prepared, axis=1))
    assert np.std(prepared[:, 0] - prepared[:, -1]) < 1.5 * steps
    open_ended = prepare_surface(
        measured(heights), replace(grid, periodic=(False, False))
    ).surface.heights
    assert np.std(open_ended[:, 0] - open_ended[:, -1]) > 5.0 * steps


@pytest.mark.parametrize("grooved", [False, True])
def test_blending_the_ends_keeps_the_roughness_of_isotropic_and_grooved_surfaces(grooved):
    blended, unblended = [], []
    for seed in range(24):
        heights = rough(seed=seed, length=4e-6)
        if grooved:
            heights = heights[:, :1] * np.ones(heights.shape[1])
        closed = prepare_surface(
            measured(heights), contact((120, 80)), conditioning=SurfaceConditioning(form="none")
        ).surface.heights
        blended.append(np.var(closed[:, :10]))
        unblended.append(np.var(closed[:, 10:]))
    assert np.mean(blended) / np.mean(unblended) == pytest.approx(1.0, abs=0.1)


def test_holes_are_filled_from_their_surroundings():
    truth = rough(length=20e-6)
    holed = truth.copy()
    holed[np.random.default_rng(1).random(holed.shape) < 0.1] = np.nan
    grid = contact((120, 80))
    complete, filled = (
        prepare_surface(measured(h), grid, conditioning=SurfaceConditioning(form="none"))
        for h in (truth, holed)
    )
    assert np.std(filled.surface.heights - complete.surface.heights) < 0.01 * complete.surface.sq
    assert any("missing cells" in step and "10 %" in step for step in filled.steps)
    assert not any("missing cells" in step for step in complete.steps)
    sentences = list(map(step_sentence, filled.steps))
    assert all(text.startswith(("The preparation ", "The surface has ")) for text in sentences)


def test_too_many_holes_are_refused():
    heights = rough()
    heights[:, 100:150] = np.nan
    with pytest.raises(BadInput, match=r"misses .* % of the cells"):
        prepare_surface(measured(heights), contact())


def test_a_map_smaller_than_the_contact_is_refused_with_both_sizes_or_tiled_on_request():
    small = measured(rough((80, 130)))
    with pytest.raises(
        BadInput, match=r"80 x 130 um, smaller than the contact's 120 x 80 um.*smaller grid"
    ):
        prepare_surface(small, contact())
    tiled = prepare_surface(
        small, contact((120, 80)), conditioning=SurfaceConditioning(form="none"), fit="tile"
    )
    heights = tiled.surface.heights
    # 20 cells on either side lie outside the map and mirror its edge
    np.testing.assert_allclose(heights[:20], heights[20:40][::-1], atol=1e-12)
    assert any("mirrored" in step for step in tiled.steps)


def test_scaling_gives_the_requested_sq_and_changes_nothing_else():
    as_measured, scaled = (
        prepare_surface(measured(rough()), contact(), sq=sq) for sq in (None, 2.5e-6)
    )
    assert scaled.surface.sq == pytest.approx(2.5e-6, rel=1e-12)
    factor = 2.5e-6 / as_measured.surface.sq
    np.testing.assert_allclose(
        scaled.surface.heights, factor * as_measured.surface.heights, rtol=1e-9
    )
    assert all(abs(p.surface.heights.mean()) < 1e-18 for p in (as_measured, scaled))


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ({"form": "sphere"}, "form"),
        ({"fit": "stretch"}, "fit"),
        ({"sq": -1e-6}, "sq"),
        ({"outliers": "mend"}, "outliers"),
        ({"s_filter": 1e-6}, "s_filter must be at least 2 pixels"),
        ({"s_filter": 80e-6, "l_filter": 20e-6}, "s_filter must be shorter"),
    ],
)
def test_unknown_options_are_refused(option, message):
    others = {name: value for name, value in option.items() if name in ("fit", "sq")}
    settings = {name: value for name, value in option.items() if name not in others}
    with pytest.raises(BadInput, match=message):
        prepare_surface(
            measured(rough()), contact(), conditioning=SurfaceConditioning(**settings), **others
        )


def test_a_flat_map_cannot_be_scaled():
    with pytest.raises(BadInput, match="flat"):
        prepare_surface(measured(np.full((300, 240), 1e-3)), contact(), sq=1e-6)


def profile(length=400e-6, pixel=1e-6, seed=2):
    n = round(length / pixel)
    line = rough((n, 64), seed=seed, pixel=pixel)[:, 0]
    grid = Grid((n, 8), (-length / 2.0, -4.0 * pixel), (length / 2.0, 4.0 * pixel), (False, False))
    return MeasuredSurface(line[:, None] * np.ones(8), grid, "line.hfm", "xyz", uniform=1)


def test_a_profile_is_extended_along_y():
    prepared = prepare_surface(
        profile(), contact((120, 64)), conditioning=SurfaceConditioning(form="none")
    )
    heights = prepared.surface.heights
    np.testing.assert_allclose(heights, heights[:, :1] * np.ones(64), atol=1e-18)
    line = profile().profile[140:260]
    np.testing.assert_allclose(heights[:, 0], line - line.mean(), atol=1e-12)
    assert any("extended unchanged along y" in step for step in prepared.steps)


def test_a_turned_profile_is_periodic_along_y_and_extended_along_x():
    prepared = prepare_surface(
        profile(), contact((64, 96)), conditioning=SurfaceConditioning(turn=True)
    )
    heights = prepared.surface.heights
    np.testing.assert_allclose(heights, heights[:1] * np.ones((64, 1)), atol=1e-18)
    assert abs(heights[0, 0] - heights[0, -1]) < 4.0 * np.std(np.diff(heights[0]))


def test_a_profile_shorter_than_the_contact_is_refused_or_mirrored_on_request():
    with pytest.raises(BadInput, match=r"profile of 80 um, shorter than the contact's 120 um"):
        prepare_surface(profile(80e-6), contact())
    prepared = prepare_surface(
        profile(80e-6),
        contact((120, 64)),
        conditioning=SurfaceConditioning(form="none"),
        fit="tile",
    )
    np.testing.assert_allclose(
        prepared.surface.heights[:20], prepared.surface.heights[20:40][::-1], atol=1e-12
    )


def test_resampling_keeps_the_spectrum_up_to_0_9_of_the_nyquist_wavenumber():
    grid = Grid(
        (100, 80), (-100e-6, -80e-6), (100e-6, 80e-6), (False, False)
    )  # 2 um cells over 1 um pixels
    fine = Grid((200, 160), (-100e-6, -80e-6), (100e-6, 80e-6), (False, False))
    heights = rough(length=2e-6)
    coarse, same = (
        prepare_surface(measured(heights), g, conditioning=SurfaceConditioning(form="none")).surface
        for g in (grid, fine)
    )
    window = np.outer(np.hanning(100), np.hanning(80))
    resampled = np.abs(np.fft.fft2(coarse.heights * window))[:45, :36]
    truth = np.abs(np.fft.fft2(same.heights * np.kron(window, np.ones((2, 2)))))[:45, :36] / 4.0
    assert np.sum(resampled**2) / np.sum(truth**2) == pytest.approx(1.0, abs=0.01)
    assert np.sum(resampled[30:40] ** 2) / np.sum(truth[30:40] ** 2) == pytest.approx(1.0, abs=0.03)


def test_turning_a_map_turns_the_prepared_surface():
    heights = rough((300, 300))
    square = contact((80, 80), (80e-6, 80e-6), periodic=(False, False))
    unturned, turned = (
        prepare_surface(
            measured(heights), square, conditioning=SurfaceConditioning(turn=turn)
        ).surface
        for turn in (False, True)
    )
    np.testing.assert_allclose(turned.heights, unturned.heights[:, ::-1].T, atol=1e-12)


def test_two_surfaces_add_up_face_to_face():
    first, second = (prepare_surface(measured(rough(seed=s)), contact()).surface for s in (1, 2))
    both = CompositeSurface(first, second, (2.2, 1.8))
    np.testing.assert_allclose(both.surface.heights, first.heights + second.heights[:, ::-1])
    assert both.surface.sq == pytest.approx(np.hypot(first.sq, second.sq), rel=0.1)
    other = prepare_surface(measured(rough(seed=2)), contact((64, 64))).surface
    with pytest.raises(BadInput, match="one grid"):
        CompositeSurface(first, other, (2.2, 1.8))


def test_the_blending_step_reports_the_changed_parameters():
    steps = prepare_surface(measured(rough(seed=4)), contact()).steps
    blending = next(step for step in steps if step.startswith("blended"))
    assert all(name in blending for name in ("Sq", "Sdq", "Ssk", "Sku"))


def test_the_places_of_a_map_are_non_overlapping_blocks():
    """The places are the 25 non-overlapping blocks of the map, starting with the central one."""
    heights = rough((600, 500), seed=4)
    grid = contact((120, 80), periodic=(False, False))
    cuts = [
        prepare_surface(
            measured(heights), grid, conditioning=SurfaceConditioning(form="none"), place=place
        ).surface.heights
        for place in range(count_places(measured(heights), grid))
    ]
    # 600/120 along and 500/80 across, rounded down to odd numbers centred in the map
    assert len(cuts) == 5 * 5
    blocks = [
        block - block.mean()
        for i in range(5)
        for j in range(5)
        for block in [heights[120 * i : 120 * (i + 1), 50 + 80 * j : 50 + 80 * (j + 1)]]
    ]
    for place in cuts:
        assert min(np.abs(place - block).max() for block in blocks) < 1e-12
    assert len({place.tobytes() for place in cuts}) == 25
    np.testing.assert_array_equal(
        cuts[0],
        prepare_surface(
            measured(heights), grid, conditioning=SurfaceConditioning(form="none")
        ).surface.heights,
    )
    with pytest.raises(BadInput, match="room for 25 separate places of the contact's"):
        prepare_surface(measured(heights), grid, place=25)


def test_a_small_map_has_one_place_and_a_profile_several_along_its_length():
    grid = contact((120, 80), periodic=(False, False))
    assert count_places(measured(rough((130, 90))), grid) == 1
    assert count_places(replace(measured(rough((400, 500))), uniform=1), grid) == 3


@pytest.mark.parametrize(("wavelength", "noted"), [(16e-6, False), (2.5e-6, True)])
def test_a_slope_decided_by_sampling_is_noted(wavelength, noted):
    """Waves of sixteen pixels keep their slope; those of 2.5 pixels are shorter than three."""
    pixels = Grid((256, 256), (-128e-6, -128e-6), (128e-6, 128e-6), periodic=(False, False))
    heights = 1e-7 * np.sin(2.0 * np.pi * pixels.x / wavelength)[:, None] * np.ones(256)
    half = Grid((200, 200), (-100e-6, -100e-6), (100e-6, 100e-6), periodic=(False, False))
    steps = prepare_surface(MeasuredSurface(heights, pixels, "waves", "text"), half).steps
    assert any("sampling decides the slope" in step for step in steps) == noted
