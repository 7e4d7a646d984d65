"""Figures of the page: comparison of maps, and the Stribeck curve without points."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("panel", reason="the extra page is not installed")

from asperity.app.contact_result import OPEN, ContactMaps
from asperity.app.contact_tools import PictureButton
from asperity.app.map_images import DIFFERS, MapImages
from asperity.app.presets import preset_case
from asperity.app.settings import Settings
from asperity.app.speed_curve import SpeedCurve
from asperity.paper import papers_case

HALF_WIDTHS = (50e-6, 40e-6)


def contact_maps(scale=1.0, cells=(8, 6)):
    """Return maps on a domain of `scale` times 200 by 160 µm."""
    x, y = (np.linspace(-scale, scale, count) * 1e-4 for count in cells)
    return ContactMaps(
        x=x,
        y=y,
        extent=((-scale * 1e-4, scale * 1e-4), (-scale * 8e-5, scale * 8e-5)),
        gap=np.full(cells, 1e-6),
        pressure=np.full(cells, 1e8),
        cells=np.full(cells, OPEN, np.uint8),
        gap_top=2e-6,
        half_widths=HALF_WIDTHS,
        hertz_pressure=1e9,
        endless=False,
    )


@pytest.mark.parametrize("pinned", [contact_maps(1.3), contact_maps(cells=(10, 6))])
def test_films_are_subtracted_on_equal_cells_only(pinned):
    images = MapImages()
    images.make()
    shown = contact_maps()
    images.show(shown, replace(shown, gap=shown.gap + 1e-6))
    assert images.change.children[0].title.text == "Film minus pinned film"
    images.show(shown, pinned)
    assert images.change.visible
    assert DIFFERS in images.change.children[0].text
    images.show(shown, None)
    assert not images.change.visible


def drawn_curve(sliding_ratio, friction):
    """Return the Stribeck curve of a contact whose points are never solved."""
    queue = SimpleNamespace(busy=True)
    curve = SpeedCurve(queue, lambda: False)
    curve.create()
    case = papers_case().with_written({"contact.slip": sliding_ratio})
    curve.follow(case, SimpleNamespace(row={"friction_coefficient": friction}))
    return curve


def test_without_sliding_a_sentence_replaces_the_stribeck_curve():
    curve = drawn_curve(0.0, 0.0)
    assert not curve.figure.visible
    assert "nothing slides" in curve.model.children[0].text
    assert curve.model.min_height == 0


def test_the_axes_of_a_stribeck_curve_hold_the_working_point_and_all_speeds():
    curve = drawn_curve(0.2, 0.1163)
    figure = curve.figure
    assert figure.visible
    assert figure.title.text == "Stribeck curve, 0 of 9 points"
    assert (figure.y_range.start, figure.y_range.end) == (0.0, pytest.approx(1.15 * 0.1163))
    assert figure.x_range.start < 0.191 < 19.1 < figure.x_range.end


def test_maps_of_one_instant_state_their_own_contact_area():
    images = MapImages()
    images.make()
    title = images.film.children[0].title
    images.show(replace(contact_maps(), instant_area=0.086))
    assert title.text == "Film at one instant, CAR 8.6 %"
    images.show(contact_maps())
    assert title.text == "Film thickness, contact and cavitation"


def test_a_picture_names_case_and_inputs():
    picture = PictureButton()
    settings = Settings(preset_case("nu206"), preset="nu206")
    picture.show(settings.with_value("machine.radial_load", "5 kN"))
    data = picture.button.js_event_callbacks["button_click"][0].args["source"].data
    assert data["head"][0][0] == "NU 206 bearing, changed"
    inputs = dict(zip(data["names"][0], data["values"][0], strict=True))
    assert (inputs["Radial load"], inputs["Oil temperature, T"]) == ("5 kN", "80 °C")
