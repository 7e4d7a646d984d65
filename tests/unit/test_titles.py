"""Titles of figures are readable: each lies inside its figure and overlaps no other title."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from asperity.report.maps import map_figure
from asperity.report.run.curves import friction_figure
from asperity.report.style import ON_PAGE, svg, write_figure
from asperity.results import FrictionCurve, FrictionPoint


def boxes(figure):
    """Bounding boxes of the titles, from left to right."""
    figure.draw_without_rendering()
    titles = [
        title
        for axes in figure.axes
        for title in (axes.title, axes._left_title)
        if title.get_text()
    ]
    return sorted((title.get_window_extent() for title in titles), key=lambda box: box.x0)


def all_readable(figure):
    extents = boxes(figure)
    assert extents
    inside = all(
        box.x0 >= 0.0 and box.x1 <= figure.bbox.width and box.y1 <= figure.bbox.height
        for box in extents
    )
    return inside and all(
        left.x1 <= right.x0 or left.y0 >= right.y1 for left, right in pairwise(extents)
    )


@pytest.fixture
def curve():
    numbers = dict.fromkeys(FrictionPoint.__dataclass_fields__, 0.1)
    points = tuple(
        FrictionPoint(**{**numbers, "converged": True, "entrainment_speed_m_s": u})
        for u in (0.5, 1.0, 2.0)
    )
    return FrictionCurve(
        kind="stribeck",
        points=points,
        boundary_friction=0.15,
        sq=0.3e-6,
        feedback=True,
    )


def test_both_titles_of_a_friction_curve_are_readable(curve, tmp_path):
    figure = friction_figure([curve])
    assert not all_readable(figure)  # before `write_figure` fits them
    write_figure(figure, tmp_path / "stribeck.png")
    assert all_readable(figure)
    (first, second) = (axes._left_title.get_text() for axes in figure.axes)
    assert first.replace("\n", " ") == "Stribeck curve: friction, Sq 0.3 µm, thermal feedback"
    assert second.replace("\n", " ") == "Stribeck curve: temperature, Sq 0.3 µm, thermal feedback"


@pytest.mark.parametrize("extent", [(1.0, 3.0), (1.0, 1.0), (3.0, 1.0)])
@pytest.mark.parametrize(
    "title", ["Film thickness", "Shear stress (square-root scale), friction 0.0394"]
)
def test_the_title_of_a_narrow_map_is_readable(extent, title):
    with ON_PAGE.drawing():
        figure, axes = map_figure(ON_PAGE, extent)
        axes.imshow(np.zeros((2, 2)), extent=(0.0, extent[0], 0.0, extent[1]), aspect="equal")
        axes.set_title(title)
    text = svg(figure)
    assert all_readable(figure)
    assert title in text  # in one line, as there is no room for two above a map


def test_a_title_that_fits_is_unchanged():
    with ON_PAGE.drawing():
        figure, axes = ON_PAGE.panel(3.0)
        axes.set_title("Bearing curve")
        before = boxes(figure)[0].bounds
    svg(figure)
    assert boxes(figure)[0].bounds == pytest.approx(before)


def test_a_title_too_long_for_any_font_size_is_broken_into_lines():
    with ON_PAGE.drawing():
        figure = Figure(figsize=(7.0, 3.5), layout="constrained")
        for axes in figure.subplots(1, 2):
            axes.set_title("Reduced peak height of the levelled profile over the wear distance")
    svg(figure)
    assert all_readable(figure)
    assert all("\n" in axes._left_title.get_text() for axes in figure.axes)
