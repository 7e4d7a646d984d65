"""Presets, machines, sound, Stribeck curve, link and picture of the live page."""

import re
from urllib.parse import parse_qs, urlsplit

import pytest

from asperity.app.presets import TITLES
from asperity.case import load_case
from support.browser import (
    NOT_WARMED_UP,
    ONE_WORKER,
    SharedVisit,
    Visit,
    chromium,
    expect,
    serving,
    write_small_contact,
)
from support.source import ROOT

pytest.importorskip("panel", reason="the extra page is not installed")

FEW_SPEEDS = f"""
from asperity.app import speed_curve
assert speed_curve.POINTS > 5
speed_curve.POINTS = 5
{ONE_WORKER}
"""
PLAYED = "() => window.asperitySound?.count ?? 0"
LEVEL = "() => window.asperitySound.level"


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def server(browser, tmp_path_factory):  # noqa: ARG001 - no server is started without a browser
    """Serve a contact that slides."""
    folder = tmp_path_factory.mktemp("server")
    name = write_small_contact(folder, sliding=True)
    with serving(folder, name, program=("-c", FEW_SPEEDS)) as started:
        yield started


@pytest.fixture(scope="module")
def shared(browser, server):
    opened = SharedVisit(browser, server)
    yield opened
    opened.close()


def type_value(page, name, text):
    box = page.get_by_role("textbox", name=name)
    box.fill(text)
    box.press("Enter")


def test_a_machine_opens_with_its_drawing_and_its_contacts(browser, tmp_path):
    case = (ROOT / "examples" / "nu206.toml").read_text("utf-8")
    few = "grid.cells = [64, 48]\nsolver.running_cells = 600\n"
    (tmp_path / "nu206.toml").write_text(f"{case}{few}", "utf-8")
    with serving(tmp_path, "nu206.toml", program=("-c", NOT_WARMED_UP)) as server:
        visit = Visit(browser, server)
        page = visit.go()
        page.get_by_alt_text(re.compile("drawn to scale")).wait_for()
        before = page.locator(".block.drawing img").get_attribute("src")
        contact = page.get_by_role("combobox", name="Contact", exact=True)
        contact.select_option("roller 1, outer ring")
        type_value(page, "Radial load", "6 kN")
        page.wait_for_function(
            "before => Bokeh.documents[0].get_model_by_name('drawing').text.includes('img')"
            " && !Bokeh.documents[0].get_model_by_name('drawing').text.includes(before)",
            arg=before,
        )
        with page.expect_download() as taken:
            page.get_by_role("button", name="Case file").click()
        saved = load_case(taken.value.path().read_text("utf-8")).conditions
        assert saved.geometry == "line"
        assert 0.0 < saved.load < 6000.0
        visit.close()


def test_values_have_printed_units_and_ticks_and_a_steep_roughness_is_remarked_at_its_knob(page):
    expect(page.get_by_role("textbox", name="Composite roughness, Sq")).to_have_value("1 µm")
    expect(page.locator(".bk-clearfix", has_text="0.1 µm").first).to_contain_text("10 µm")
    assert page.get_by_role("textbox", name="Lay direction (°)").count() == 1
    type_value(page, "Composite roughness, Sq", "1.2 μm")  # the Greek letter
    expect(page.get_by_role("slider", name="Composite roughness, Sq")).to_have_attribute(
        "aria-valuetext", "1.2 µm"
    )
    type_value(page, "Composite roughness, Sq", "50 µm")
    remark = page.get_by_text(re.compile(r"^Sq is 2\.5 times the correlation length"))
    remark.wait_for()
    box = page.get_by_role("textbox", name="Composite roughness, Sq").bounding_box()
    assert 0 < remark.bounding_box()["y"] - box["y"] < 150
    type_value(page, "Composite roughness, Sq", "1 µm")
    remark.wait_for(state="hidden")
    page.get_by_text(re.compile("^Solved on")).wait_for()


def test_a_stribeck_curve_is_drawn_in_idle_time_with_the_working_point(page):
    points = """() => {
      const view = [...Bokeh.index.query(view => view.model.type === "Figure"
        && view.model.html_attributes["aria-label"].startsWith("Stribeck"))][0]
      return view?.model.renderers.map(drawn => [...drawn.data_source.data.u])
    }"""
    page.wait_for_function(f"() => (({points})() ?? [[]])[0].length >= 3")
    drawn, now = page.evaluate(points)[0], page.evaluate(points)[-1]
    assert now == [pytest.approx(1.91)]
    assert drawn == sorted(drawn)
    type_value(page, "Entrainment speed, u", "2.5 m/s")
    page.wait_for_function("() => location.search.includes('speed=2.5')")
    page.wait_for_function(f"() => ({points})().at(-1)[0] === 2.5")
    assert set(drawn) <= set(page.evaluate(points)[0])  # the same curve goes on
    type_value(page, "Entrainment speed, u", "1.91 m/s")
    page.wait_for_function("() => location.search === ''")


def test_the_acceleration_is_played_and_follows_a_knob(page):
    assert page.evaluate(PLAYED) == 0
    page.get_by_role("button", name="Listen").click()
    page.wait_for_function("() => window.asperitySound?.count === 1")
    assert page.evaluate(LEVEL) == pytest.approx(1.0)
    assert page.evaluate("() => window.asperitySound.context.state") == "running"
    type_value(page, "Composite roughness, Sq", "1.5 µm")
    page.wait_for_function("() => window.asperitySound.count > 1")
    assert page.evaluate(LEVEL) > 1.1  # rougher bodies are louder
    page.get_by_role("button", name="Stop sound").click()
    page.wait_for_function("() => window.asperitySound.length === 0")


def test_link_and_picture_are_taken_and_every_preset_shows_its_stored_numbers_at_once(shared):
    page = shared.go("contact?preset=nu206")
    page.get_by_text(re.compile("Stored solution of asperity|^Solved on")).wait_for()
    page.wait_for_function("() => location.search.includes('preset=nu206')")
    page.get_by_role("button", name="Copy link").click()
    page.get_by_role("button", name="Link copied").wait_for()
    link = page.evaluate("() => navigator.clipboard.readText()")
    assert parse_qs(urlsplit(link).query)["preset"] == ["nu206"]
    with page.expect_download() as taken:
        page.get_by_role("button", name="PNG").click()
    picture = taken.value.path().read_bytes()
    assert taken.value.suggested_filename == "asperity-contact.png"
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 30_000
    for key, title in TITLES.items():
        page.get_by_role("button", name=title).click()
        page.wait_for_function(f"() => location.search.includes('preset={key}')")
        page.get_by_text(re.compile("Stored solution of asperity|^Solved on")).wait_for()
        expect(page.locator("#headline")).to_contain_text("Mixed lubrication")
        expect(page.locator("#headline")).to_contain_text("Hz")
        pictures = page.locator(".block.drawing img")
        expect(pictures).to_have_count(0 if key in ("paper", "ball-on-disc") else 1)
    shared.require_no_error()
