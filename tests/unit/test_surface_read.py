import logging
import time
import warnings

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput, UnreadableFile
from asperity.core.third_party import suppress_output, surface_topography
from asperity.surface import Surface, read_surface, write_surface


def xyz(path, cells=(20, 12), pixel=(2.0, 3.0)):
    rows = [
        f"{i * pixel[0]} {j * pixel[1]} {i + 100 * j}\n"
        for j in range(cells[1])
        for i in range(cells[0])
    ]
    path.write_text("".join(rows))
    return path


def hills(cells=(24, 16)):
    x, y = np.meshgrid(np.arange(cells[0]), np.arange(cells[1]), indexing="ij")
    return 1e-6 * (np.sin(x / 3.0) + 0.1 * y)


@pytest.fixture
def x3p(tmp_path):
    import x3pio

    heights = hills()
    heights[3, 5] = np.nan
    x3pio.write(tmp_path / "map.x3p", heights.T, x_scale=2e-6, y_scale=3e-6)
    return tmp_path / "map.x3p", heights


def test_x_is_the_first_axis_missing_cells_are_nan_and_lengths_are_in_metres(x3p):
    path, heights = x3p
    measured = read_surface(path)
    np.testing.assert_allclose(measured.heights, heights, rtol=1e-12)
    assert measured.grid.cells == (24, 16)
    assert measured.grid.spacing == pytest.approx((2e-6, 3e-6))
    assert measured.missing == pytest.approx(1.0 / (24 * 16))
    assert any("not square" in note for note in measured.notes)


def test_an_x3p_with_an_inner_folder_is_read_and_noted(x3p, tmp_path):
    import zipfile

    path, heights = x3p
    with zipfile.ZipFile(path) as standard, zipfile.ZipFile(tmp_path / "loose.x3p", "w") as loose:
        for name in standard.namelist():
            content = standard.read(name)
            loose.writestr(
                f"inner/{name}",
                content.replace(b"ISO5436_2", b"ISO5436") if name == "main.xml" else content,
            )
    measured = read_surface(tmp_path / "loose.x3p")
    np.testing.assert_allclose(measured.heights, heights, rtol=1e-12)
    assert measured.grid.spacing == pytest.approx((2e-6, 3e-6))
    assert any("violates the standard" in note for note in measured.notes)


def test_sdf_gives_the_same_surface_as_x3p(tmp_path):
    import sdfio

    sdfio.write(tmp_path / "map.sdf", hills().T, x_scale=2e-6, y_scale=2e-6)
    measured = read_surface(tmp_path / "map.sdf")
    np.testing.assert_allclose(measured.heights, hills(), atol=1e-12)
    assert measured.grid.spacing == pytest.approx((2e-6, 2e-6))


def test_a_file_without_units_requires_them_as_arguments(tmp_path):
    path = xyz(tmp_path / "points.txt")
    with pytest.raises(BadInput, match=r"states no units.*lateral_unit"):
        read_surface(path)
    measured = read_surface(path, unit="nm", lateral_unit="um")
    assert measured.grid.spacing == pytest.approx((2e-6, 3e-6))
    assert measured.heights[7, 3] == pytest.approx(307e-9)


def test_stated_units_and_pixel_replace_those_of_the_file_with_a_note(x3p):
    path, _ = x3p
    plain = read_surface(path)
    corrected = read_surface(path, unit="mm", lateral_unit="mm")  # the file states metres
    np.testing.assert_allclose(corrected.heights, 1e-3 * plain.heights, rtol=1e-12)
    assert corrected.grid.spacing == pytest.approx([1e-3 * size for size in plain.grid.spacing])
    assert [note for note in corrected.notes if "although the file states m" in note] == [
        "heights are read in mm, although the file states m",
        "lengths along x and y are read in mm, although the file states m",
    ]
    stated = read_surface(path, pixel=3e-6)
    assert stated.grid.spacing == pytest.approx((3e-6, 3e-6))
    np.testing.assert_array_equal(stated.heights, plain.heights)
    assert any("not that of the file, 2e-06 x " in note for note in stated.notes)
    same = read_surface(path, unit="meter", lateral_unit=" m")
    assert same.notes == plain.notes


def test_a_unit_other_than_a_length_is_refused(tmp_path):
    with pytest.raises(BadInput, match="'furlong'"):
        read_surface(xyz(tmp_path / "points.txt"), unit="furlong", lateral_unit="um")


@pytest.mark.parametrize(("unit", "pixel"), [("mm", 2e-3), ("pm", 2e-12)])
def test_an_implausible_pixel_needs_a_confirmation(tmp_path, unit, pixel):
    path = xyz(tmp_path / "points.txt", pixel=(2.0, 2.0))
    with pytest.raises(BadInput, match=r"pixel of .* implausible .* or confirm it with `pixel`"):
        read_surface(path, unit="um", lateral_unit=unit)
    confirmed = read_surface(path, unit="um", pixel=pixel)
    assert confirmed.grid.spacing == pytest.approx((pixel, pixel))
    assert sum("unusual for a roughness map" in note for note in confirmed.notes) == 2


def assert_refused(path, message):
    with pytest.raises(UnreadableFile, match=message) as caught:
        read_surface(path)
    text = str(caught.value)
    assert path.name in text
    assert "\n" not in text
    assert len(text) < 300


def test_a_missing_file_is_refused(tmp_path):
    assert_refused(tmp_path / "nowhere.opd", "does not exist")


def test_a_folder_is_refused(tmp_path):
    assert_refused(tmp_path, "is a folder")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("empty.opd", b"", "empty"),
        ("text.opd", b"this is not a Wyko file\n" * 40, "another format"),
        ("noise.al3d", np.random.default_rng(1).bytes(5000), "another format"),
        ("noise.bin", np.random.default_rng(2).bytes(2 * 1201 * 1201), "no format"),
        ("archive.x3p", b"PK\x03\x04" + b"x" * 300, "zip"),
        ("words.txt", b"once upon a time\n" * 30, "txt"),
        ("cut.xyz", b"0 0 1\n1 0 2\n0 1 3\n1 ", "xyz"),
    ],
)
def test_a_file_with_the_wrong_content_is_refused(tmp_path, name, content, message, capfd):
    path = tmp_path / name
    path.write_bytes(content)
    assert_refused(path, message)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("share", [0.01, 0.3, 0.7, 0.99])
def test_a_truncated_file_is_refused(x3p, share):
    path, _ = x3p
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    assert_refused(path, "x3p")


def test_a_file_with_the_suffix_of_another_format_is_refused_with_the_right_suffix(tmp_path):
    import sdfio

    sdfio.write(tmp_path / "map.opd", hills().T, x_scale=2e-6, y_scale=2e-6)
    assert_refused(tmp_path / "map.opd", r"looks like sdf; rename it to \.sdf")


def test_a_map_without_valid_heights_is_refused(tmp_path):
    import x3pio

    x3pio.write(tmp_path / "blind.x3p", np.full((16, 16), np.nan), x_scale=1e-6, y_scale=1e-6)
    assert_refused(tmp_path / "blind.x3p", "no valid height")


def test_a_map_of_too_few_points_is_refused(tmp_path):
    with pytest.raises(UnreadableFile, match="3 x 4 heights, too few"):
        read_surface(xyz(tmp_path / "few.xyz", cells=(3, 4)), unit="um", lateral_unit="um")


def test_a_profile_is_constant_along_y(tmp_path):
    path = tmp_path / "line.hfm"
    path.write_text("".join(f"{0.0005 * i:.4f} {np.sin(i):.5f}\n" for i in range(200)))
    measured = read_surface(path, unit="um", lateral_unit="mm")
    assert measured.uniform == 1
    assert measured.grid.spacing[0] == pytest.approx(0.5e-6)
    np.testing.assert_allclose(
        measured.heights, 1e-6 * np.sin(np.arange(200))[:, None] * np.ones(8), atol=6e-12
    )


def test_a_single_row_is_read_as_a_profile(tmp_path):
    import sdfio

    sdfio.write(tmp_path / "row.sdf", hills((40, 1)), x_scale=2e-6, y_scale=2e-6)
    with pytest.raises(UnreadableFile, match="too few"):
        read_surface(tmp_path / "row.sdf")  # 1 x 40: a profile must lie along x
    sdfio.write(tmp_path / "row.sdf", hills((40, 1)).T, x_scale=2e-6, y_scale=2e-6)
    measured = read_surface(tmp_path / "row.sdf")
    np.testing.assert_allclose(measured.profile, hills((40, 1))[:, 0], atol=1e-15)
    assert measured.uniform == 1


TABLES = {
    "decimal commas in quotes": (
        "x.csv",
        '"x","z"\n' + "".join(f'"{i},50","{i}0,25"\n' for i in range(12)),
    ),
    "semicolons": ("x.txt", "X;Z\n[mm];[um]\n" + "".join(f"{i},5;{i}0,25\n" for i in range(12))),
    "tabs": ("x.dat", "".join(f"{i}.5\t{i}0.25\t\n" for i in range(12))),
    "commas": ("x.csv", "x,z\n" + "".join(f"{i}.5,{i}0.25\n" for i in range(12))),
    "blanks": ("x.prf", "".join(f"  {i},5  {i}0,25\n" for i in range(12))),
}


@pytest.mark.parametrize("table", TABLES)
def test_columns_are_read_with_any_separator(tmp_path, table):
    name, text = TABLES[table]
    (tmp_path / name).write_text(text)
    measured = read_surface(tmp_path / name, unit="um", lateral_unit="um")
    assert measured.grid.spacing[0] == pytest.approx(1e-6)
    np.testing.assert_allclose(measured.profile, 1e-6 * (10.0 * np.arange(12) + 0.25), atol=1e-12)


def test_unevenly_spaced_points_are_interpolated_and_noted(tmp_path):
    x = np.linspace(0.0, 1.0, 50) ** 1.2
    (tmp_path / "line.csv").write_text("".join(f"{a:.6f};{2.0 * a:.6f}\n" for a in x))
    measured = read_surface(tmp_path / "line.csv", unit="um", lateral_unit="mm")
    np.testing.assert_allclose(measured.profile, 2e-6 * np.linspace(0.0, 1.0, 50), atol=1e-11)
    assert any("not evenly spaced" in note for note in measured.notes)


@pytest.mark.parametrize("name", ["bare.txt", "bare.csv", "bare.npy"])
def test_a_matrix_of_heights_requires_the_pixel_size(tmp_path, name):
    rows = hills((12, 9)).T[::-1] * 1e6  # the first row is the top
    if name == "bare.npy":
        np.save(tmp_path / name, rows)
    else:
        separator = "," if name == "bare.csv" else " "
        (tmp_path / name).write_text(
            "\n".join(separator.join(f"{z:.9f}" for z in row) for row in rows)
        )
    with pytest.raises(BadInput, match="give `pixel`"):
        read_surface(tmp_path / name, unit="um")
    with pytest.raises(BadInput, match="give unit"):
        read_surface(tmp_path / name, pixel=2e-6)
    measured = read_surface(tmp_path / name, unit="um", pixel=(2e-6, 3e-6))
    assert measured.grid.spacing == pytest.approx((2e-6, 3e-6))
    np.testing.assert_allclose(measured.heights, hills((12, 9)), atol=1e-14)


def test_implausibly_steep_heights_are_noted(tmp_path):
    measured = read_surface(xyz(tmp_path / "points.txt"), unit="mm", lateral_unit="um")
    assert any("check the units of both" in note for note in measured.notes)


def test_the_library_is_imported_without_a_message_about_mpi():
    assert surface_topography().__name__ == "SurfaceTopography"


def test_log_messages_of_a_reader_do_not_reach_the_terminal(caplog):
    with suppress_output() as notes:
        logging.getLogger("reader").error("could not reshape")
        warnings.warn("odd header", UserWarning, stacklevel=1)
    assert caplog.records == []
    assert notes == ["the reader warns: odd header"]
    logging.getLogger("reader").error("and afterwards it does")
    assert len(caplog.records) == 1


def test_a_declared_marker_is_a_missing_height(tmp_path):
    """Header of an ESRI grid."""
    path = tmp_path / "map.asc"
    rows = [[f"{(i * j) % 7 * 1e-7:.3e}" for j in range(12)] for i in range(10)]
    rows[3][4] = rows[8][2] = "-9999"
    lines = ["ncols 12", "nrows 10", "NODATA_value -9999", *(" ".join(row) for row in rows)]
    path.write_text("\n".join(lines), "utf-8")
    surface = read_surface(path, unit="m", pixel=2e-6)
    assert np.isnan(surface.heights).sum() == 2
    assert np.nanmax(np.abs(surface.heights)) < 1e-6


def test_equal_surfaces_are_written_as_equal_files(tmp_path):
    grid = Grid((9, 8), (0.0, 0.0), (9e-6, 8e-6))
    surface = Surface(np.random.default_rng(1).standard_normal((9, 8)) * 1e-6, grid)
    first = write_surface(surface, tmp_path / "first.x3p").read_bytes()
    time.sleep(1.1)  # the date of a file has seconds
    assert write_surface(surface, tmp_path / "second.x3p").read_bytes() == first
    np.testing.assert_array_equal(read_surface(tmp_path / "first.x3p").heights, surface.heights)
