"""Arrays and lists of points: one orientation by every way in, holes, units, and their notes."""

import numpy as np
import pytest
import xarray

from asperity.core.errors import BadInput, UnreadableFile
from asperity.surface import read_surface, surface_from_array

DX, DY = 2e-6, 3e-6
ROWS = np.random.default_rng(3).normal(size=(24, 32)) + 2.0 * np.sin(
    np.arange(32.0)
)  # [um], (y, x)


def labelled(rows=ROWS, *, x_unit="um", y_unit="um", height_unit="um"):
    """Return the rows, the first at the largest y, with coordinates."""
    ny, nx = rows.shape
    return xarray.DataArray(
        rows,
        dims=("y", "x"),
        coords={
            "x": ("x", 1e6 * DX * np.arange(nx), {"units": x_unit}),
            "y": ("y", 1e6 * DY * np.arange(ny)[::-1], {"units": y_unit}),
        },
        name="heights",
        attrs={"units": height_unit},
    )


def points(rows=ROWS):
    """Return the same as points (x, y, z) in um."""
    table = labelled(rows)
    x, y = np.meshgrid(table.x, table.y)
    return np.c_[x.ravel(), y.ravel(), rows.ravel()]


def by_every_way(folder):
    """Return the surface by every file format and by the library, by name."""
    np.savetxt(folder / "table.txt", ROWS, fmt="%.12g")
    np.savetxt(folder / "table.csv", ROWS, fmt="%.12g", delimiter=",")
    np.save(folder / "table.npy", ROWS)
    np.savez(folder / "table.npz", heights=ROWS)
    np.savez(folder / "axes.npz", z=ROWS, x=DX * np.arange(32), y=DY * np.arange(24)[::-1])
    labelled().to_netcdf(folder / "labelled.nc")
    labelled().T.to_netcdf(folder / "x_first.nc")
    xarray.DataArray(ROWS, dims=("row", "column")).to_netcdf(folder / "bare.nc")
    np.savetxt(folder / "points.xyz", points(), fmt="%.12g")
    size = {"unit": "um", "pixel": (DX, DY)}
    files = ("table.txt", "table.csv", "table.npy", "table.npz", "bare.nc")
    return {
        **{name: read_surface(folder / name, **size) for name in files},
        "axes.npz": read_surface(folder / "axes.npz", unit="um", lateral_unit="m"),
        "labelled.nc": read_surface(folder / "labelled.nc"),
        "x_first.nc": read_surface(folder / "x_first.nc"),
        "points.xyz": read_surface(folder / "points.xyz", unit="um", lateral_unit="um"),
        "numpy": surface_from_array(ROWS, **size),
        "xarray": surface_from_array(labelled()),
    }


def test_an_array_is_the_same_surface_by_every_way_in(tmp_path):
    """Columns run along x, the rolling direction; a row is a constant y, the first the largest."""
    for name, surface in by_every_way(tmp_path).items():
        assert surface.grid.cells == (32, 24), name
        assert surface.grid.spacing == pytest.approx((DX, DY)), name
        np.testing.assert_allclose(surface.heights, 1e-6 * ROWS[::-1].T, atol=1e-16, err_msg=name)
        named = name in ("axes.npz", "labelled.nc", "x_first.nc", "points.xyz", "xarray")
        assert surface.rolling_along == ("x" if named else "columns")


def test_a_turned_table_rolls_along_its_rows():
    turned = surface_from_array(ROWS, unit="um", pixel=DX).turned()
    assert turned.grid.cells == (24, 32)
    assert turned.rolling_along == "rows"
    assert turned.turned().rolling_along == "columns"


def test_units_of_coordinates_and_heights_are_those_of_the_array():
    metric = labelled(1e3 * ROWS, height_unit="nanometer", x_unit="micron", y_unit="micron")
    surface = surface_from_array(metric)
    np.testing.assert_allclose(surface.heights, 1e-6 * ROWS[::-1].T, atol=1e-16)
    assert surface.grid.spacing == pytest.approx((DX, DY))


@pytest.mark.parametrize(
    ("array", "message"),
    [
        (labelled(x_unit="um", y_unit="mm"), "x in um and y in mm; give both one unit"),
        (labelled(height_unit="%"), "values in %, not heights; export its height"),
        (labelled().assign_coords(x=np.arange(32.0) ** 2), "x that is not evenly spaced"),
        (np.zeros((8, 8, 3)), "3-dimensional array"),
        (np.full((8, 8), "a"), "type <U1"),
    ],
)
def test_arrays_that_are_no_map_of_heights_are_refused(array, message):
    with pytest.raises(UnreadableFile, match=message):
        surface_from_array(array, lateral_unit=None)


def test_a_file_of_several_maps_must_name_the_heights(tmp_path):
    np.savez(tmp_path / "two.npz", left=ROWS, right=ROWS)
    with pytest.raises(UnreadableFile, match="got maps: left, right; export one"):
        read_surface(tmp_path / "two.npz", unit="um", pixel=DX)
    np.savez(tmp_path / "two.npz", heights=ROWS, quality=ROWS)
    assert read_surface(tmp_path / "two.npz", unit="um", pixel=DX).missing == 0.0
    with pytest.raises(BadInput, match="give `pixel`"):
        read_surface(tmp_path / "two.npz", unit="um")


def test_holes_in_a_list_of_points_are_missing_heights(tmp_path):
    kept = np.ones(ROWS.size, dtype=bool)
    kept[[5, 100, 101]] = False
    np.savetxt(tmp_path / "holes.xyz", points()[kept], fmt="%.12g")
    surface = read_surface(tmp_path / "holes.xyz", unit="um", lateral_unit="um")
    expected = 1e-6 * np.where(kept, ROWS.ravel(), np.nan).reshape(ROWS.shape)
    np.testing.assert_allclose(surface.heights, expected[::-1].T, atol=1e-16)
    assert surface.missing == 3 / ROWS.size


def test_points_a_little_off_a_grid_take_its_nearest_place(tmp_path):
    rng = np.random.default_rng(7)
    moved = points()
    moved[:, :2] += rng.uniform(-0.3, 0.3, size=(ROWS.size, 2))  # pixels of 2 and 3 um
    np.savetxt(tmp_path / "off.xyz", rng.permutation(moved), fmt="%.12g")
    surface = read_surface(tmp_path / "off.xyz", unit="um", lateral_unit="um")
    np.testing.assert_allclose(surface.heights, 1e-6 * ROWS[::-1].T, atol=1e-16)
    assert surface.grid.spacing == pytest.approx((DX, DY), rel=0.01)
    assert any("off a regular grid" in note for note in surface.notes)


def test_scattered_points_are_interpolated(tmp_path):
    """A plane between random points is a plane."""
    x, y = np.random.default_rng(2).uniform(0.0, 100.0, size=(2, 4000))
    np.savetxt(tmp_path / "scattered.xyz", np.c_[x, y, 0.3 * x - 0.1 * y], fmt="%.9g")
    surface = read_surface(tmp_path / "scattered.xyz", unit="um", lateral_unit="um")
    slopes = [np.diff(surface.heights, axis=axis) / surface.grid.spacing[axis] for axis in (0, 1)]
    for slope, expected in zip(slopes, (0.3, -0.1), strict=True):
        np.testing.assert_allclose(slope[np.isfinite(slope)], expected, rtol=1e-5)
    assert surface.missing < 0.1
    assert any("interpolated linearly" in note for note in surface.notes)


@pytest.mark.parametrize(
    ("change", "missing", "note"),
    [
        (lambda p: p[(p[:, 0] != 20.0) & (p[:, 0] != 22.0)], 2 * 24, None),
        (lambda p: np.r_[p, p[:3]], 0, "3 points repeat others"),
        (lambda p: np.where(np.arange(len(p))[:, None] == 7, [*p[7, :2], np.nan], p), 1, None),
        (lambda p: p[::-1], 0, None),
    ],
    ids=["two columns missing", "repeated points", "a height that is no number", "backwards"],
)
def test_imperfect_lists_of_points_keep_their_grid(tmp_path, change, missing, note):
    np.savetxt(tmp_path / "list.xyz", change(points()), fmt="%.12g")
    surface = read_surface(tmp_path / "list.xyz", unit="um", lateral_unit="um")
    assert surface.grid.spacing == pytest.approx((DX, DY))
    found = np.isfinite(surface.heights)
    assert (~found).sum() == missing
    np.testing.assert_allclose(surface.heights[found], 1e-6 * ROWS[::-1].T[found], atol=1e-16)
    if note is not None:
        assert sum(note in other for other in surface.notes) == 1
    assert not any("off any regular grid" in other for other in surface.notes)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda p: np.r_[p, [[1e9, 5.0, 0.0]]], "too narrow for a map; .* delete stray points"),
        (lambda p: p * [1.0, 0.0, 1.0], "32 complete points .* too few for a map"),
        (lambda p: np.c_[p[:, 0] + 64.0 * p[:, 1] / 3.0, p[:, 1] * 1e-6, p[:, 2]], "too narrow"),
    ],
)
def test_lists_of_points_that_are_no_map_are_refused(tmp_path, change, message):
    np.savetxt(tmp_path / "list.xyz", change(points()), fmt="%.12g")
    with pytest.raises(UnreadableFile, match=message):
        read_surface(tmp_path / "list.xyz", unit="um", lateral_unit="um")


def test_masked_and_unlabelled_arrays_are_read_like_tables(tmp_path):
    plain = surface_from_array(ROWS, unit="um", pixel=DX).heights
    masked = surface_from_array(np.ma.masked_greater(ROWS, 2.0), unit="um", pixel=DX)
    np.testing.assert_array_equal(np.isnan(masked.heights), 1e6 * plain > 2.0)
    for dims in (("y", "x"), ("Y", "x"), ("row", "column")):
        array = xarray.DataArray(ROWS, dims=dims)
        np.testing.assert_array_equal(surface_from_array(array, unit="um", pixel=DX).heights, plain)
    headed = "# Width: 64 um\n# Height: 72 um\n# Value units: um\n"
    rows = "\n".join("\t".join(f"{height:.12f}" for height in row) for row in ROWS)
    (tmp_path / "headed.txt").write_text(headed + rows)
    np.testing.assert_allclose(read_surface(tmp_path / "headed.txt").heights, plain, atol=1e-16)
    np.savez(tmp_path / "x-first.npz", heights=ROWS.T, x=np.arange(32.0), y=np.arange(24.0))
    with pytest.raises(UnreadableFile, match="store it with a row per y and a column per x"):
        read_surface(tmp_path / "x-first.npz", unit="um", lateral_unit="um")


def with_holes(share):
    rows = ROWS.copy()
    rows.ravel()[: int(share * rows.size)] = np.nan
    return rows


@pytest.mark.parametrize(
    ("rows", "note"),
    [
        (with_holes(0.89), "89 % of the heights are missing"),
        (with_holes(0.06), "6 % of the heights are missing"),
        (np.round(ROWS), "levels, 1 um apart"),
        (np.full((16, 16), 3.0), "all heights are equal"),
    ],
)
def test_maps_with_little_information_have_a_note(rows, note):
    surface = surface_from_array(rows, unit="um", pixel=DX)
    assert sum(note in other for other in surface.notes) == 1


def test_ordinary_maps_have_no_note():
    assert surface_from_array(with_holes(0.04), unit="um", pixel=DX).notes == ()


def test_wyko_text_is_read_in_waves(tmp_path):
    """Heights are in waves over Mult, with a line for each column of pixels."""
    header = (
        "Wyko ASCII Data File Format 0 0 1\nX Size\t32\nY Size\t24\n"
        "Block Name\tType\tLength\tValue\nPixel_size\t7\t4\t0.002\nAspect\t7\t4\t1.5\n"
        "Wavelength\t7\t4\t632.8\nMult\t6\t2\t2\nRAW_DATA\t3\t3072\n"
    )
    waves = ROWS.T * 1e3 / 632.8 * 2.0
    lines = ["\t".join(f"{wave:.9f}" for wave in column) for column in waves]
    lines[4] = "Bad" + lines[4][lines[4].index("\t") :]
    (tmp_path / "map.asc").write_text(header + "\n".join(lines) + "\n")
    lines[5] += "\t"
    surface = read_surface(tmp_path / "map.asc")
    expected = 1e-6 * ROWS.T
    expected[4, 0] = np.nan
    np.testing.assert_allclose(surface.heights, expected, atol=1e-14)
    assert surface.grid.spacing == pytest.approx((DX, DY))
    (tmp_path / "map.asc").write_text(header + "\n".join(lines[:-1]) + "\n")
    with pytest.raises(UnreadableFile, match="damaged Wyko text file"):
        read_surface(tmp_path / "map.asc")


def test_results_of_a_tribometer_are_named(tmp_path):
    rows = "".join(f"{i},{0.05 - 1e-4 * i:.4f},{50 + i}\n" for i in range(30))
    (tmp_path / "mtm.csv").write_text(f"Speed (mm/s),Traction Coefficient,SRR (%)\n{rows}")
    with pytest.raises(UnreadableFile, match="contains tribometer results"):
        read_surface(tmp_path / "mtm.csv", unit="um", lateral_unit="um")


def test_a_map_of_a_wear_scar_is_read(tmp_path):
    np.savetxt(tmp_path / "scar.txt", ROWS, header="wear scar, traction test at 2 N")
    assert read_surface(tmp_path / "scar.txt", unit="um", pixel=DX).missing == 0.0
