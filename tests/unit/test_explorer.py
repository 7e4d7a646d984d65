"""Static explorer: its stored contacts are those of the solver, its page is one small file that
works in a browser.
"""

import json
import re
import sys
from importlib import import_module

import numpy as np
import pytest
from PIL import Image

from support.browser import chromium
from support.source import ROOT

MOST_BYTES = 2_000_000
WIDTHS = (390, 1280)


@pytest.fixture(scope="module", autouse=True)
def programs():
    """Put the programs of docs on the import path."""
    sys.path.insert(0, str(ROOT / "docs"))
    yield
    sys.path.remove(str(ROOT / "docs"))


def module(name: str):
    return import_module(name)


@pytest.fixture(scope="module")
def stored() -> dict:
    return json.loads((ROOT / "docs" / "explorer" / "contacts.json").read_text("utf-8"))


def test_every_operating_point_is_stored_and_converged(stored):
    points = module("solve_explorer").points()
    assert len(points) == len(stored["contacts"]) >= 240
    assert [
        point for point, row in zip(points, stored["contacts"], strict=True) if not row["converged"]
    ] == []


def test_stored_conditions_are_those_of_the_program(stored):
    fresh = json.loads(json.dumps(module("solve_explorer").description()))
    del fresh["version"]  # that of the computation
    assert {key: stored[key] for key in fresh} == fresh


@pytest.mark.parametrize("point", [(2.0, 1.0, 500.0), (0.25, 3.0, 250.0), (8.0, 0.5, 1000.0)])
def test_stored_contacts_equal_a_fresh_solution(stored, point):
    program = module("solve_explorer")
    index = program.points().index(point)
    contact, row = program.solve(program.Point(*point)), stored["contacts"][index]
    for key in ("clr", "car", "clr_low", "clr_high"):
        assert contact.numbers[key] == pytest.approx(row[key], abs=2e-3), key
    for key in ("lambda_ratio", "crf_hz", "h_mean_m", "friction_coefficient"):
        expected = row[key]
        assert contact.numbers[key] == (expected and pytest.approx(expected, rel=5e-3)), key
    height, width = contact.film.shape
    down, right = divmod(index, len(program.ROUGHNESSES) * len(program.LOADS))
    with Image.open(program.MAPS) as sheet:
        tile = np.asarray(sheet)[2 * height * down :, width * right :]
    for part, fresh in enumerate((contact.film, contact.pressure)):
        kept = tile[part * height : (part + 1) * height, :width].astype(int)
        assert np.mean(np.abs(kept - fresh) > 1) < 0.01
    assert (contact.film == 0).any() == (row["clr"] > 0.0)


def test_load_share_grows_with_roughness_and_falls_with_speed(stored):
    program = module("solve_explorer")
    shape = (len(program.SPEEDS), len(program.ROUGHNESSES), len(program.LOADS))
    clr = np.array([row["clr"] for row in stored["contacts"]]).reshape(shape)
    assert np.mean(np.diff(clr, axis=0) <= 0.02) > 0.97
    assert np.mean(np.diff(clr, axis=1) >= -0.02) > 0.97
    assert clr.min() < 0.01
    assert clr.max() > 0.9


@pytest.mark.parametrize(
    ("low", "value", "high", "determined", "words"),
    [
        (0.0, 0.001, 0.005, True, "Full film"),
        (0.3, 0.5, 0.7, False, "Mixed lubrication"),
        (0.7, 0.85, 0.95, False, "Mixed lubrication to boundary lubrication"),
        (0.88, 0.93, 0.99, True, "Boundary lubrication"),
    ],
)
def test_regime_in_words(low, value, high, determined, words):
    row = {"clr_low": low, "clr": value, "clr_high": high, "determined": determined}
    assert module("make_explorer").regime(row) == words


def test_page_is_assembled_from_the_stored_contacts():
    program = module("make_explorer")
    text = program.PAGE.read_text("utf-8")
    assert text == program.page(), "run python docs/make_explorer.py"


def test_page_is_small_and_self_contained():
    path = module("make_explorer").PAGE
    text = path.read_text("utf-8")
    assert path.stat().st_size <= MOST_BYTES
    assert (
        re.findall(
            r"(?:src|href)=[\"'](?!data:)[^\"']*|url\((?!data:)|@import|fetch\(|XMLHttp", text
        )
        == []
    )
    assert "http:" not in text
    assert "https:" not in text


@pytest.mark.parametrize("width", WIDTHS)
def test_page_works_in_a_browser(stored, width):
    program = module("make_explorer")
    requests, errors = [], []
    with chromium() as browser:
        page = browser.new_page(viewport={"width": width, "height": 844}, has_touch=width < 500)
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("console", lambda message: errors.append(message.text))
        page.goto(program.PAGE.as_uri())
        page.wait_for_function("() => levels !== null")
        start = shown(page)
        assert "Load" in page.get_by_role("slider").last.evaluate(
            "slider => slider.labels[0].textContent"
        )
        assert f"{100 * row_at(stored, 2.0, 1.0, 500.0)['clr']:.1f}\u00a0%" in start
        assert row_at(stored, 2.0, 1.0, 500.0)["verdict"] in start
        assert colours(page, "film") > 10
        before = page.evaluate("document.getElementById('film').toDataURL()")
        speed = page.get_by_role("slider").first
        speed.focus()
        page.keyboard.press("ArrowRight")
        assert row_at(stored, 4.0, 1.0, 500.0)["verdict"] in shown(page)
        assert speed.get_attribute("aria-valuetext") == "4 m/s"
        assert page.evaluate("document.getElementById('film').toDataURL()") != before
        box = speed.bounding_box()
        press = page.touchscreen.tap if width < 500 else page.mouse.click
        press(box["x"] + box["width"] - 9, box["y"] + box["height"] / 2)
        assert row_at(stored, 16.0, 1.0, 500.0)["verdict"] in shown(page)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        assert box["height"] >= 24
    assert errors == []
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []


def row_at(stored: dict, *point: float) -> dict:
    return stored["contacts"][module("solve_explorer").points().index(point)]


def shown(page) -> str:
    return page.locator("main").inner_text()


def colours(page, name: str) -> int:
    """Number of different colours in a map."""
    return page.evaluate(
        """name => {
          const {width, height} = document.getElementById(name)
          const context = document.getElementById(name).getContext("2d")
          const pixels = context.getImageData(0, 0, width, height).data
          return new Set(new Uint32Array(pixels.buffer)).size
        }""",
        name,
    )


def test_moving_picture_is_small():
    path = ROOT / "docs" / "images" / "running-roughness.webp"
    assert path.stat().st_size <= 1_500_000
    with Image.open(path) as picture:
        assert picture.width == module("draw_motion").WIDTH == 640
        assert picture.n_frames == module("draw_motion").PASS
