import numpy as np
import pytest

from asperity import (
    BadInput,
    ContactConditions,
    ElasticPair,
    flat_surface,
    solve_contact,
    subsurface_stress,
)
from asperity.contact.grid import Grid
from asperity.solution import StressTensor, hertz_stress
from asperity.solution.stress import default_depths, stress_below
from asperity.solution.stress_influence import (
    ODD_IN_X,
    ODD_IN_Y,
    Tractions,
    _influence,
    _rectangles,
)

NAMES = ("xx", "yy", "zz", "xy", "yz", "xz")


def random_tensor(count: int = 200) -> StressTensor:
    return StressTensor(*np.random.default_rng(3).normal(size=(6, count)))


def matrices(tensor: StressTensor) -> np.ndarray:
    xx, yy, zz, xy, yz, xz = (getattr(tensor, name) for name in NAMES)
    return np.moveaxis(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), -1, 0)


def test_equivalent_stresses_are_those_of_the_principal_stresses():
    tensor = random_tensor()
    principal = np.linalg.eigvalsh(matrices(tensor))
    np.testing.assert_allclose(
        tensor.max_shear, (principal[:, 2] - principal[:, 0]) / 2.0, rtol=1e-9
    )
    differences = np.diff(principal, axis=1).T
    expected = np.sqrt(
        (differences[0] ** 2 + differences[1] ** 2 + (differences[0] + differences[1]) ** 2) / 2.0
    )
    np.testing.assert_allclose(tensor.von_mises, expected, rtol=1e-9)


def test_equal_pressure_from_all_sides_has_no_equivalent_stress():
    normal_stress = np.array([-2.0])
    tensor = StressTensor(
        normal_stress,
        normal_stress,
        normal_stress,
        0 * normal_stress,
        0 * normal_stress,
        0 * normal_stress,
    )
    assert tensor.von_mises[0] == tensor.max_shear[0] == 0.0


def sum_over_images(cells, spacing, depth, loaded, images=60):
    """Stresses of unit pressure and unit traction, each on one cell, summed over the periodic
    images in y.
    """
    nx, ny = cells
    kernels = _rectangles((nx, (images + 1) * ny), spacing, depth, 0.3)
    total = np.zeros((6, nx, ny))
    for traction, (i0, j0) in enumerate(loaded):
        for component in range(6):
            i, j = np.arange(nx) - i0, np.arange(ny) - j0
            for image in range(-images, images + 1):
                distance = j + image * ny
                sign_x = np.where(i < 0, -1.0 if ODD_IN_X[traction][component] else 1.0, 1.0)
                sign_y = np.where(distance < 0, -1.0 if ODD_IN_Y[component] else 1.0, 1.0)
                computed = kernels[traction, component][np.ix_(np.abs(i), np.abs(distance))]
                total[component] += sign_x[:, None] * sign_y * computed
    return total


@pytest.mark.parametrize(
    ("cells", "size"), [((16, 12), (1.2, 0.5)), ((12, 15), (0.5, 2.5)), ((13, 16), (1.0, 1.0))]
)
@pytest.mark.parametrize("depth", [0.0, 0.3, 1.5, 3.0, 12.0])
def test_fourier_stresses_agree_with_closed_forms_of_rectangles_and_their_images(
    cells, size, depth
):
    """Compare the half-space's response to waves with Love's solution for rectangles.

    Depths are in cells along x.
    """
    spacing = (size[0] / cells[0], size[1] / cells[1])
    loaded = ((3, 5), (8, 2))
    pressure, shear = np.zeros(cells), np.zeros(cells)
    pressure[loaded[0]] = shear[loaded[1]] = 1.0
    grid = Grid(cells, (0.0, 0.0), size)
    computed = Tractions.from_fields(grid, pressure, shear).stresses(
        depth * spacing[0], 0.3, cache=False
    )
    expected = sum_over_images(cells, spacing, depth * spacing[0], loaded)
    np.testing.assert_allclose(
        computed, expected, atol=2e-4
    )  # relative to the load; the neglected images contribute as much


def test_deep_kernels_store_only_the_waves_that_reach_their_depth():
    widths = [
        _influence((16, 64), (0.1, 0.1), True, depth, 0.3).shape[-1]
        for depth in (0.05, 1.0, 2.0, 50.0)
    ]
    reach = -np.log(1e-8) / (
        2.0 * np.pi / 6.4
    )  # times depth: a wave of this wavenumber decays to 1e-8
    assert widths == [33, int(reach / 1.0) + 1, int(reach / 2.0) + 1, 1]


@pytest.mark.parametrize("repeats", [True, False])
def test_surface_stresses_equal_the_applied_tractions(repeats):
    generator = np.random.default_rng(5)
    grid = Grid((24, 20), (0.0, 0.0), (1.2, 1.0), (False, repeats))
    pressure, shear = generator.random(grid.cells), generator.normal(size=grid.cells)
    surface = stress_below(
        pressure, shear, grid, np.array([0.0, 0.1]), poisson_ratio=0.25
    ).tensor_at(0.0)
    np.testing.assert_allclose(surface.zz, -pressure, atol=5e-5)
    np.testing.assert_allclose(surface.xz, -shear, atol=5e-5)
    np.testing.assert_allclose(surface.yz, 0.0, atol=2e-4)


@pytest.mark.parametrize("repeats", [True, False])
def test_every_plane_below_the_surface_carries_the_load(repeats):
    """The force through a plane equals the applied force, except for the part outside the plane's
    finite width.
    """
    generator = np.random.default_rng(6)
    grid = Grid((96, 96), (-1.5, -1.5), (1.5, 1.5), (False, repeats))
    loaded = (np.abs(grid.x) < 0.2)[:, None] & (np.abs(grid.y) < 0.2)
    pressure, shear = np.where(loaded, generator.random((2, 96, 96)), 0.0)
    plane = stress_below(pressure, shear, grid, np.array([0.05]), poisson_ratio=0.3).tensor_at(0.05)
    assert -plane.zz.sum() == pytest.approx(pressure.sum(), rel=2e-3)
    assert -plane.xz.sum() == pytest.approx(shear.sum(), rel=5e-2)  # shear spreads further


def test_material_is_in_equilibrium():
    """The divergence of the stress vanishes below a rough pressure (central differences)."""
    generator = np.random.default_rng(7)
    grid = Grid((48, 32), (0.0, 0.0), (1.5, 1.0))
    stress = stress_below(
        generator.random(grid.cells),
        generator.normal(size=grid.cells),
        grid,
        np.array([0.4]),
        poisson_ratio=0.3,
    )
    (dx, dy), dz = grid.spacing, 0.01
    above, here, below = (stress.tensor_at(0.4 + shift) for shift in (-dz, 0.0, dz))

    def divergence(name_x, name_y, name_z):
        along = np.gradient(getattr(here, name_x), dx, axis=0)
        across = (np.roll(getattr(here, name_y), -1, 1) - np.roll(getattr(here, name_y), 1, 1)) / (
            2.0 * dy
        )
        down = (getattr(below, name_z) - getattr(above, name_z)) / (2.0 * dz)
        return (along + across + down)[1:-1], np.abs(down).max()

    for row in (("xx", "xy", "xz"), ("xy", "yy", "yz"), ("xz", "yz", "zz")):
        residual, scale = divergence(*row)
        assert np.abs(residual).max() < 0.02 * scale


def test_the_interpolated_peak_hardly_depends_on_the_depths():
    grid = Grid((64, 8), (-2.0, -1.0), (2.0, 1.0))
    pressure = np.repeat(np.sqrt(np.maximum(1.0 - grid.x**2, 0.0))[:, None], 8, axis=1)
    peaks = [
        stress_below(
            pressure,
            None,
            grid,
            np.concatenate([[0.0], np.geomspace(0.02, 3.0, count)]),
            poisson_ratio=0.3,
        )
        for count in (9, 24)
    ]
    assert peaks[0].peak.value == pytest.approx(peaks[1].peak.value, rel=1e-4)
    assert peaks[0].peak.depth == pytest.approx(peaks[1].peak.depth, rel=0.01)
    assert peaks[0].peak.depth not in peaks[0].depths


@pytest.mark.parametrize("core", [0.25, 1.0])
def test_the_core_is_the_largest_stress_below_a_depth(core):
    grid = Grid((64, 8), (-2.0, -1.0), (2.0, 1.0))
    pressure = np.repeat(np.sqrt(np.maximum(1.0 - grid.x**2, 0.0))[:, None], 8, axis=1)
    depths = np.concatenate([[0.0], np.geomspace(0.02, 3.0, 12)])
    stress = stress_below(
        pressure, 0.4 * pressure, grid, depths, poisson_ratio=0.3, core_depth=core
    )
    assert stress.peak.depth == 0.0
    fine = [stress.tensor_at(depth).von_mises.max() for depth in np.linspace(core, 3.0, 60)]
    assert stress.core.value == pytest.approx(max(fine), rel=1e-3)
    assert stress.core.depth >= core == stress.core_depth


def test_maps_and_section_show_the_same_stresses():
    generator = np.random.default_rng(8)
    grid = Grid((24, 20), (0.0, 0.0), (1.2, 1.0))
    stress = stress_below(
        generator.random(grid.cells), None, grid, np.array([0.0, 0.1, 0.3]), poisson_ratio=0.3
    )
    np.testing.assert_allclose(
        stress.section.von_mises, stress.von_mises[:, stress.row, :], rtol=1e-9
    )
    assert grid.y[stress.row] == stress.peak.y
    assert stress.largest.max() <= stress.peak.value
    k = list(stress.depths).index(stress.depth_of_largest[4, 7])
    assert stress.von_mises[4, 7, k] == stress.largest[4, 7]


@pytest.mark.parametrize(
    ("geometry", "radius", "length", "value", "depth"),
    [
        ("line", 0.01, 0.01, 0.558, 0.704),
        ("point", 0.01, None, 0.620, 0.481),
        ("elliptic", (0.01, 0.5), None, 0.57, 0.7),
    ],
)
def test_stress_below_hertz_contacts_of_all_geometries(geometry, radius, length, value, depth):
    """Johnson (1985), section 4.2 and table 4.1; an ellipse of axis ratio 0.08 is nearly a line."""
    pair = ElasticPair((2e11, 2e11), (0.3, 0.3))
    bodies = ContactConditions(
        pair=pair,
        geometry=geometry,
        radius=radius,
        load=100.0,
        length=length,
        surface_speeds=(1.0, 1.0),
    )
    a = min(bodies.hertz.half_widths) if geometry == "elliptic" else bodies.hertz.half_widths[0]
    stress = hertz_stress(bodies, np.concatenate([[0.0], np.geomspace(0.01, 2.5, 15)]) * a)
    tolerance = 0.004 if geometry != "elliptic" else 0.03
    assert stress.peak.value == pytest.approx(value * bodies.hertz.p_max, rel=tolerance)
    assert stress.peak.depth == pytest.approx(depth * a, rel=5.0 * tolerance)


def test_default_depths_range_from_the_surface_to_below_the_contact():
    pair = ElasticPair((2e11, 2e11), (0.3, 0.3))
    ball = ContactConditions(
        pair=pair, geometry="point", radius=0.01, load=10.0, surface_speeds=(1.0, 1.0)
    )
    a = ball.hertz.half_widths[0]
    grid = Grid((64, 64), (-2 * a, -2 * a), (2 * a, 2 * a), (False, False))
    depths = default_depths(ball, grid)
    assert depths.size == 16
    assert depths[0] == 0.0
    assert depths[1] == pytest.approx(grid.spacing[0] / 2.0)
    assert 0.1 * a in depths
    assert depths[-1] == pytest.approx(2.5 * a)


@pytest.mark.parametrize(
    ("shear", "depths", "message"),
    [
        (np.zeros((4, 4)), [0.1], "shear must have the grid's shape"),
        (None, [0.2, 0.1], "depths must increase"),
        (None, [-0.1, 0.1], "finite lengths of 0 m"),
        (None, [], "finite lengths of 0 m"),
        (None, [np.nan], "finite lengths of 0 m"),
    ],
)
def test_invalid_stress_input_is_refused(shear, depths, message):
    grid = Grid((8, 8), (0.0, 0.0), (1.0, 1.0))
    with pytest.raises(BadInput, match=message):
        stress_below(np.ones((8, 8)), shear, grid, np.array(depths), poisson_ratio=0.3)


def test_the_second_body_has_the_opposite_traction_and_its_own_poisson_ratio():
    pair = ElasticPair((2e11, 1e11), (0.3, 0.2))
    bodies = ContactConditions(
        pair=pair, geometry="line", radius=0.01, load=500.0, length=0.01, surface_speeds=(1.0, 1.0)
    )
    a = bodies.hertz.half_widths[0]
    grid = Grid((64, 8), (-2 * a, -a), (2 * a, a))
    solution = solve_contact(bodies, None, flat_surface(grid))
    shear = 0.1 * solution.pressure
    first, second = (subsurface_stress(solution, shear=shear, body=body) for body in (1, 2))
    np.testing.assert_allclose(
        second.tensor_at(0.3 * a).xz,
        first.tensor_at(0.3 * a).xz[::-1] * -1.0,
        atol=1e-4 * bodies.hertz.p_max,
    )
    assert second.peak.x < 0.0 < first.peak.x
    sideways = second.tensor_at(0.5 * a)
    np.testing.assert_allclose(
        sideways.yy, 0.2 * (sideways.xx + sideways.zz), atol=1e-5 * bodies.hertz.p_max
    )
    assert first.peak.value == pytest.approx(0.565 * bodies.hertz.p_max, rel=0.01)
    with pytest.raises(BadInput, match="body must be 1 or 2"):
        subsurface_stress(solution, body=0)


def test_the_largest_shear_is_accurate_in_single_precision():
    """On the axis of a ball contact two principal stresses are equal (Johnson 1985, eq. 3.45)."""
    depth, nu = np.linspace(0.05, 2.0, 200), 0.3
    factor = 1.0 - depth * np.arctan(1.0 / depth)
    across, down = -(1.0 + nu) * factor + 0.5 / (1.0 + depth**2), -1.0 / (1.0 + depth**2)
    zero = np.zeros_like(depth)
    single = StressTensor(
        *(part.astype(np.float32) for part in (across, across, down, zero, zero, zero))
    )
    np.testing.assert_allclose(single.max_shear, 0.5 * np.abs(across - down), rtol=2e-6)
