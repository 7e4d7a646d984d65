"""The developers' measured files, if available, against their README and one another."""

import json
from pathlib import Path

import numpy as np
import pytest

from asperity.contact.grid import Grid
from asperity.core.errors import BadInput, UnreadableFile
from asperity.surface import SurfaceConditioning, describe_surface, prepare_surface, read_surface

FILES = Path(__file__).parents[2].parent / "shared" / "data" / "surfaces"
pytestmark = pytest.mark.skipif(
    not FILES.is_dir(), reason="the developers' measured surfaces are not on this machine"
)
HERTZ = 55.9e-6  # half-width of the paper's contact at 500 N


def paper_grid(cells=256):
    return Grid((cells, cells), (-4.5 * HERTZ, -1.6 * HERTZ), (1.9 * HERTZ, 1.6 * HERTZ))


@pytest.mark.parametrize(
    ("name", "cells", "pixel", "sq", "missing"),
    [
        ("milled_1.opd", (736, 480), 1.634e-6, 1.89e-6, 0.0023),
        ("isotropic.al3d", (200, 296), 0.438e-6, 0.259e-6, 0.0),
        ("isotropic_iso5436.x3p", (200, 296), 0.438e-6, 0.259e-6, 0.0),
        ("isotropic_iso25178.x3p", (200, 296), 0.438e-6, 0.259e-6, 0.0),
        ("isotropic_iso1.sdf", (200, 296), 0.438e-6, 0.259e-6, 0.0),
        ("ground_lay.plu", (768, 576), 1.66e-6, 0.018e-6, 0.0),
    ],
)
def test_a_file_agrees_with_its_readme(name, cells, pixel, sq, missing):
    found = describe_surface(FILES / name).scalars()
    assert tuple(found["cells"]) == cells
    assert found["pixel_m"][0] == pytest.approx(pixel, rel=1e-3)
    assert found["sq_m"] == pytest.approx(sq, rel=0.02)
    assert found["missing"] == pytest.approx(missing, abs=1e-4)
    assert json.loads(json.dumps(found, allow_nan=False)) == found


def test_four_formats_of_one_surface_contain_the_same_heights():
    heights = read_surface(FILES / "isotropic.al3d").heights
    for name in ("isotropic_iso5436.x3p", "isotropic_iso25178.x3p", "isotropic_iso1.sdf"):
        np.testing.assert_allclose(read_surface(FILES / name).heights, heights, atol=1e-12)


def test_a_point_list_is_read_with_given_units():
    found = describe_surface(FILES / "nanovea_test1.txt", unit="um", lateral_unit="mm").scalars()
    assert found["sq_m"] == pytest.approx(4.47e-6, rel=0.01)
    assert found["pixel_m"] == pytest.approx([5e-6, 5e-6])


def test_profiles_agree_with_their_readme():
    stylus = describe_surface(FILES / "stylus_4p8mm.hfm").scalars()
    assert stylus["cells"][0] == 9600
    assert stylus["pixel_m"][0] == pytest.approx(0.5e-6, rel=1e-3)
    assert stylus["profile"]["rq_m"] == pytest.approx(0.138e-6, rel=0.02)
    track = describe_surface(FILES / "wear_track_C1.csv", unit="um", lateral_unit="mm").scalars()
    assert track["cells"][0] == 4800
    assert track["size_m"][0] == pytest.approx(2.4e-3, rel=1e-3)
    # the extremes of the file, -0.45 and 0.75, without form
    assert track["profile"]["rt_m"] == pytest.approx(1.2e-6, rel=0.02)


def test_an_archive_that_violates_the_standard_agrees_with_its_readme():
    found = describe_surface(
        FILES / "bullet_land.x3p", conditioning=SurfaceConditioning(form="cylinder")
    ).scalars()
    assert found["cells"] == [918, 256]
    assert found["pixel_m"] == pytest.approx([2.58e-6, 2.58e-6], rel=1e-3)
    assert found["missing"] == pytest.approx(0.11, abs=0.01)
    assert any("violates the standard" in note for note in found["notes"])


@pytest.mark.parametrize("name", ["nanovea_test1.txt", "wear_track_C1.csv"])
def test_a_file_without_units_is_refused_in_one_sentence(name, capfd):
    with pytest.raises(BadInput, match=name):
        read_surface(FILES / name)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "share"),
    [("milled_1.opd", 0.9), ("isotropic.al3d", 0.4), ("isotropic_iso1.sdf", 0.99)],
)
def test_a_truncated_file_is_refused(tmp_path, name, share):
    content = (FILES / name).read_bytes()
    (tmp_path / name).write_bytes(content[: int(share * len(content))])
    with pytest.raises(UnreadableFile, match=name):
        read_surface(tmp_path / name)


def test_a_wrong_extension_is_reported(tmp_path):
    disguised = tmp_path / "disguised.opd"
    disguised.write_bytes((FILES / "isotropic.al3d").read_bytes())
    with pytest.raises(UnreadableFile, match=r"looks like al3d; rename it to \.al3d"):
        read_surface(disguised)


def test_the_milled_surface_covers_the_paper_contact():
    prepared = prepare_surface(read_surface(FILES / "milled_1.opd"), paper_grid())
    heights = prepared.surface.heights
    assert np.std(heights[:, 0] - heights[:, -1]) < 2.0 * np.std(np.diff(heights, axis=1))
    assert [step.split()[0] for step in prepared.steps] == [
        "kept",
        "removed",
        "cut",
        "filled",
        "resampled",
        "blended",
        "removed",
        "has",
    ]
    assert prepare_surface(
        read_surface(FILES / "milled_1.opd"), paper_grid(), sq=1e-6
    ).surface.sq == pytest.approx(1e-6)


def test_the_prepared_surface_does_not_depend_on_the_cells():
    measured = read_surface(FILES / "milled_1.opd")
    coarse, fine = (prepare_surface(measured, paper_grid(n)).surface for n in (128, 384))
    difference = fine.heights[1::3, 1::3] - coarse.heights
    assert np.std(difference) < 0.05 * fine.sq  # the coarse surface lacks waves below 2.8 um


def test_a_small_surface_is_refused_or_tiled_on_request():
    small = read_surface(FILES / "isotropic.al3d")
    with pytest.raises(
        BadInput, match=r"87\.61 x 129\.7 um, smaller than the contact's 357\.8 x 178\.9 um"
    ):
        prepare_surface(small, paper_grid())
    tiled = prepare_surface(small, paper_grid(512), fit="tile")
    assert tiled.surface.sq == pytest.approx(0.259e-6, rel=0.05)
