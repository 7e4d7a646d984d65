"""Titles of figures are read whole: none leaves its figure, and none runs into the next panel's."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from asperity.report.maps import map_figure
from asperity.report.run.curves import friction_figure
from asperity.report.style import ON_PAGE, svg, write_figure
from asperity.results import FrictionCurve, FrictionPoint


def boxes(figure):
    """Where the titles are, from left to right."""
    figure.draw_without_rendering()
    titles = [
        title
        for axes in figure.axes
        for title in (axes.title, axes._left_title)
        if title.get_text()
    ]
    return sorted((title.get_window_extent() for title in titles), key=lambda box: box.x0)


def all_readable(figure):
    found = boxes(figure)
    assert found
    inside = all(
        box.x0 >= 0.0 and box.x1 <= figure.bbox.width and box.y1 <= figure.bbox.height
        for box in found
    )
    return inside and all(
        left.x1 <= right.x0 or left.y0 >= right.y1 for left, right in pairwise(found)
    )


@pytest.fixture
def curve():
    numbers = dict.fromkeys(FrictionPoint.__dataclass_fields__, 0.1)
    points = tuple(
        FrictionPoint(**{**numbers, "converged": True, "entrainment_speed_m_s": u})
        for u in (0.5, 1.0, 2.0)
    )
    return FrictionCurve(
        kind="stribeck", points=points, boundary_friction=0.15, sq=0.3e-6, feedback=True
    )


def test_both_titles_of_a_friction_curve_are_read_whole(curve, tmp_path):
    figure = friction_figure([curve])
    assert not all_readable(figure)  # as they were written
    write_figure(figure, tmp_path / "stribeck.png")
    assert all_readable(figure)
    (first, second) = (axes._left_title.get_text() for axes in figure.axes)
    assert first.replace("\n", " ") == "Stribeck curve: friction, Sq 0.3 µm, thermal feedback"
    assert second.replace("\n", " ") == "Stribeck curve: temperature, Sq 0.3 µm, thermal feedback"


@pytest.mark.parametrize("extent", [(1.0, 3.0), (1.0, 1.0), (3.0, 1.0)])
@pytest.mark.parametrize(
    "title", ["Film thickness", "Shear stress (square-root scale), friction 0.0394"]
)
def test_the_title_of_a_map_is_read_whole_however_narrow_the_map(extent, title):
    with ON_PAGE.drawing():
        figure, axes = map_figure(ON_PAGE, extent)
        axes.imshow(np.zeros((2, 2)), extent=(0.0, extent[0], 0.0, extent[1]), aspect="equal")
        axes.set_title(title)
    text = svg(figure)
    assert all_readable(figure)
    assert title in text  # in one line: there is no room for two above a map


def test_a_title_with_room_stays_as_it_was():
    with ON_PAGE.drawing():
        figure, axes = ON_PAGE.panel(3.0)
        axes.set_title("Bearing curve")
        before = boxes(figure)[0].bounds
    svg(figure)
    assert boxes(figure)[0].bounds == pytest.approx(before)


def test_a_title_too_long_for_any_size_is_broken_into_lines():
    with ON_PAGE.drawing():
        figure = Figure(figsize=(7.0, 3.5), layout="constrained")
        for axes in figure.subplots(1, 2):
            axes.set_title("Reduced peak height of the levelled profile over the wear distance")
    svg(figure)
    assert all_readable(figure)
    assert all("\n" in axes._left_title.get_text() for axes in figure.axes)
