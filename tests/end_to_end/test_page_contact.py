"""The contact page in a browser: sliders, results, dropped files, links and windows."""

import json
import re
import tomllib

import numpy as np
import pytest
import x3pio

from asperity.app.inputs import case_inputs
from asperity.app.opening import default_case
from support.browser import (
    SharedVisit,
    Visit,
    chromium,
    click_mark,
    expect,
    require_operable,
    serving,
    write_small_contact,
)

uploads = pytest.importorskip("asperity.app.uploads", reason="the extra page is not installed")

HOSTILE_NAMES = [
    "{{7*7}}<img src=x onerror=window.pwned=1>.x3p",
    "$(touch pwned)'; import os; os.system('touch pwned').x3p",
    '"><script>window.pwned=1</script>.x3p',
    ".." + "x" * 200 + ".x3p",
]
HOSTILE_ADDRESSES = [
    "contact.load=<script>window.pwned=1</script>",
    "<img src=x onerror=window.pwned=1>=1",
    'contact.load="><svg onload=window.pwned=1>',
    "dropped=<img src=x onerror=window.pwned=1>",
    "contact.load={{7*7}}",
    "surface.file=/etc/passwd",
    "contact.load=__import__('os').system('touch pwned')",
    "contact.load=500 N%0d%0aSet-Cookie: a=b",
    "surface.seed=javascript:window.pwned=1",
    "case=</script><script>window.pwned=1</script>",
]
WRONG = [
    ("Normal load, F", "-5 N"),
    ("Entrainment speed, u", "fast"),
    ("Composite roughness, Sq", "2"),
    ("Slide-to-roll ratio", "7 m"),
    ("Hardness", "2 GHz"),
]
SHORT_OF_UNIT = 'Composite roughness, Sq must be a length such as "5.4 mm", got the bare number 2'


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def server(browser, tmp_path_factory):  # noqa: ARG001 - no server is started without a browser
    folder = tmp_path_factory.mktemp("server")
    with serving(folder, write_small_contact(folder)) as started:
        yield started


@pytest.fixture
def visit(browser, server):
    made = Visit(browser, server)
    yield made
    made.close()


@pytest.fixture(scope="module")
def shared(browser, server):
    opened = SharedVisit(browser, server, height=844)
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """Write a measured surface that is large enough for the contact."""
    path = tmp_path_factory.mktemp("surface") / "ring.x3p"
    rng = np.random.default_rng(3)
    waves = rng.standard_normal((40, 40)).repeat(8, axis=0).repeat(8, axis=1) * 5e-7
    x3pio.write(str(path), waves, x_scale=2e-6, y_scale=2e-6)
    return path


# a message to the server consists of a header, metadata, content and buffers
NEVER_READY = """() => {
  const send = WebSocket.prototype.send
  let held = []
  WebSocket.prototype.send = function (part) {
    held.push(part)
    if (held.length < 3 + 2 * (JSON.parse(held[0]).num_buffers ?? 0)) return
    if (!held[2].includes("document_ready")) held.forEach((one) => send.call(this, one))
    held = []
  }
}"""


# vertical position of the film map in every frame that the browser draws
TOPS = """() => {
  window.tops = []
  const look = () => {
    window.tops.push(document.querySelector(".block.film").getBoundingClientRect().top + scrollY)
    requestAnimationFrame(look)
  }
  look()
}"""


def strip(page):
    return page.locator("#headline")


def tile(page, name="CLR"):
    """Return a number of the strip."""
    return strip(page).locator("dl div", has_text=name).locator("dd").first


def wait_for_change(page, text, name="CLR"):
    """Wait until a tile shows another text that does not belong to a coarse solution."""
    expect(tile(page, name)).not_to_have_text(text, use_inner_text=True)
    expect(tile(page, name)).not_to_contain_text("coarse snapshot")


def wait_for_share(page, text):
    """Wait until the tile of the load share shows this text."""
    expect(tile(page)).to_have_text(text, use_inner_text=True)


def wait_for_value(page, name, text):
    """Wait until the box of a slider has this value."""
    expect(page.get_by_role("textbox", name=name)).to_have_value(text)


def film(page):
    """Return the numbers of the film map in the browser."""
    return page.evaluate(
        "() => { for (const d of Bokeh.documents) for (const m of d._all_models.values())"
        " if (m.type === 'ColumnDataSource' && m.data.image?.[0]?.dtype === 'float32')"
        " return Array.from(m.data.image[0]).slice(0, 4000) }"
    )


def set_slider(page, name, text):
    box = page.get_by_role("textbox", name=name)
    box.fill(text)
    box.press("Enter")
    return box


def test_a_pinned_contact_is_compared_and_an_earlier_setting_restored_by_a_click(page):
    """The first mark is the contact as served, until a later test loads the page with others."""
    first, speed = (
        tile(page).inner_text(),
        page.get_by_role("textbox", name="Entrainment speed, u").input_value(),
    )
    page.get_by_role("button", name="Pin to compare").click()
    set_slider(page, "Entrainment speed, u", "3 m/s")
    page.wait_for_function("() => location.search.includes('entrainment')")
    expect(tile(page)).to_have_text(re.compile(r"[−-][\d.]+ % vs. pinned"))
    page.get_by_role("button", name="Unpin").click()
    page.get_by_text("vs. pinned").first.wait_for(state="hidden")
    wait_for_change(page, first)
    page.get_by_text(re.compile("^Solved on")).wait_for()
    click_mark(page, "Load share over roughness", 0)
    page.wait_for_function("() => !location.search.includes('entrainment')")
    wait_for_value(page, "Entrainment speed, u", speed)
    wait_for_share(page, first)


def test_a_slider_updates_maps_numbers_and_address(page):
    clr, crf, map_before = tile(page).inner_text(), tile(page, "CRF").inner_text(), film(page)
    page.evaluate(TOPS)
    set_slider(page, "Load, F", "800 N")
    page.wait_for_function("() => location.search.includes('contact.load=800')")
    wait_for_change(page, clr)
    wait_for_change(page, crf, "CRF")
    assert film(page) != map_before
    assert (
        page.evaluate("() => Math.max(...window.tops) - Math.min(...window.tops)") < 4
    )  # the layout does not jump meanwhile
    again = tile(page).inner_text()
    page.reload()
    page.get_by_text("Solved on").wait_for()
    page.wait_for_function("() => location.search.includes('contact.load=800')")
    wait_for_share(page, again)
    wait_for_value(page, "Load, F", "800 N")
    with page.expect_download() as taken:
        page.get_by_role("button", name="Case file").click()
    assert taken.value.suggested_filename == "contact.toml"
    assert tomllib.loads(taken.value.path().read_text("utf-8"))["contact"]["load"] == "800 N"
    with page.expect_download() as taken:
        page.get_by_role("button", name="Python script").click()
    compile(taken.value.path().read_text("utf-8"), "contact.py", "exec")
    set_slider(page, "Load, F", "500 N")
    wait_for_share(page, clr)


def test_every_control_is_named_and_used_by_the_keyboard_and_laws_are_selected(page):
    handles = page.get_by_role("slider").all()
    assert len(handles) == sum(
        not (case_input.more or case_input.choices)
        for case_input in case_inputs(default_case()).values()
    )
    assert all(handle.get_attribute("aria-label") for handle in handles)
    assert page.get_by_role("slider", name="Load, F").get_attribute("aria-valuetext") == "500 N"
    assert "- slider:" not in page.locator("body").aria_snapshot()  # a slider without a name
    page.get_by_role("slider", name="Load, F").focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_function("() => location.search.includes('contact.load=530')")
    expect(page.get_by_role("slider", name="Load, F")).to_have_attribute("aria-valuetext", "530 N")
    wait_for_value(page, "Load, F", "530 N")
    page.get_by_role("button", name="More inputs").click()
    page.get_by_role("button", name="Fewer inputs").wait_for()
    require_operable(page)
    page.get_by_label("Viscosity law").select_option("roelands")
    page.wait_for_function("() => location.search.includes('lubricant.viscosity.law=roelands')")
    page.get_by_label("Contact model").select_option("paper")
    page.wait_for_function("() => location.search.includes('model=paper')")
    page.get_by_label("Contact model").select_option("mixed")
    page.get_by_label("Viscosity law").select_option("barus")
    set_slider(page, "Load, F", "500 N")
    page.wait_for_function("() => location.search === ''")  # every value is that of the case again
    page.get_by_role("button", name="Fewer inputs").click()
    page.get_by_role("button", name="More inputs").wait_for()


def test_a_wrong_value_is_reported_at_its_slider_and_marks_the_result(page):
    for name, value in WRONG:
        box = page.get_by_role("textbox", name=name)
        good = box.input_value()
        set_slider(page, name, value)
        page.get_by_text(re.compile("^Not solved: invalid value of")).wait_for()
        assert page.get_by_text(re.compile("^Solved on")).count() == 0
        for block in ("tiles", "verdict", "film", "spectrum"):
            expect(page.locator(f".block.{block}")).not_to_have_css("opacity", "1")
        expect(strip(page).locator("dd").first).not_to_have_css("opacity", "1")
        expect(strip(page)).to_contain_text("outdated")
        expect(page.locator(".block.verdict")).to_contain_text("Previous result: ")
        message = page.get_by_text(SHORT_OF_UNIT)
        if value == "2":
            message.wait_for()
            below, above = message.bounding_box(), box.bounding_box()
            assert 0 < below["y"] - above["y"] < 120
        set_slider(page, name, good)
        page.get_by_text(re.compile("^Solved on")).wait_for()
        message.wait_for(state="hidden")
        expect(page.locator(".block.verdict")).not_to_contain_text("Previous result: ")
        for block in ("tiles", "film"):
            expect(page.locator(f".block.{block}")).to_have_css("opacity", "1")


def test_a_file_that_is_no_surface_is_refused_in_one_sentence_and_named_as_text(
    page, server, ring, tmp_path
):
    """Names that end up in markup in different ways; test_page_server.py tests more."""
    clr = tile(page).inner_text()
    (tmp_path / "cut.x3p").write_bytes(ring.read_bytes()[:3000])
    page.locator("input[type=file]").set_input_files(tmp_path / "cut.x3p")
    page.get_by_text(re.compile(r"cut\.x3p .*\.$")).wait_for()
    wait_for_share(page, clr)
    for number, name in enumerate(HOSTILE_NAMES):
        content = f"no surface {number}".encode() * (number + 1)
        page.locator("input[type=file]").set_input_files(
            {"name": name, "mimeType": "", "buffer": content}
        )
        page.get_by_text(uploads.safe_name(name)).filter(
            has_text=re.compile("in no format|cannot|is no")
        ).wait_for()
        assert page.evaluate("() => window.pwned") is None
    assert not (server.log.parent / "pwned").exists()


def contrast(first, second):
    """Return the WCAG contrast ratio of two colours."""

    def luminance(colour):
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def require_legible(page, scheme):
    """Assert that text contrasts with the background of this colour scheme."""
    colours = page.evaluate(
        "() => { const s = getComputedStyle(document.body); return JSON.stringify([s.color,"
        " s.backgroundColor]) }"
    )
    ink, paper = (
        [int(part) / 255 for part in re.findall(r"\d+", text)[:3]] for text in json.loads(colours)
    )
    assert contrast(ink, paper) > 7.0
    assert (sum(paper) < 1.0) == (scheme == "dark")


def in_view(page, locator):
    """Return True if an element is inside the window."""
    box, height = locator.bounding_box(), page.viewport_size["height"]
    return box is not None and box["y"] >= 0.0 and box["y"] + box["height"] <= height


def require_strip_in_view(page):
    """Assert that regime and load share stay visible while any knob turns."""
    sliders = page.get_by_role("slider").all()
    assert len(sliders) > 8
    for slider in sliders:
        slider.scroll_into_view_if_needed()
        slider.focus()
        assert in_view(page, slider)
        names = strip(page).locator("dt").all()
        assert [name.inner_text() for name in names] == ["Regime", "CLR", "CRF"]
        for part in (*names, *strip(page).locator("dd").all()):
            assert in_view(page, part)
    below = strip(page).locator("..").bounding_box()
    assert below["height"] < 100


def require_fit(page, width, scheme):
    """Assert that the page fits its window, with a pinned contact too, and unpin that."""
    require_legible(page, scheme)
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    assert page.locator("header").bounding_box()["height"] < 60  # one line
    if width < 2000:  # the knobs of a wider window are below one another in view
        require_strip_in_view(page)
    page.get_by_role("button", name="Pin to compare").click()
    page.get_by_text("vs. pinned").first.wait_for()
    page.get_by_role("img", name="Film minus pinned film").wait_for()
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    page.get_by_role("button", name="Unpin").click()
    page.get_by_text("vs. pinned").first.wait_for(state="hidden")


def test_the_page_fits_its_window_is_legible_and_keeps_the_result_in_view(page):
    require_fit(page, 1280, "light")


def test_the_page_fits_a_phone_and_the_window_that_this_is_widened_to(browser, server):
    visit = Visit(browser, server, width=390, height=844, scheme="dark")
    page = visit.solved()
    require_fit(page, 390, "dark")
    page.set_viewport_size({"width": 2560, "height": 844})
    require_fit(page, 2560, "dark")
    visit.close()


def test_every_question_mark_has_a_tooltip(page):
    marks = page.locator(".bk-description").all()
    assert len(marks) == 13
    texts = set()
    for mark in marks:
        mark.scroll_into_view_if_needed()
        mark.hover()
        tooltip = page.locator(".bk-tooltip-content:visible")
        expect(tooltip).to_contain_text("Case file: ")
        texts.add(tooltip.inner_text())
        page.mouse.move(0, 0)
        expect(tooltip).to_have_count(0)
    assert len(texts) == 13
    assert any("Running roughness has a grid of its own" in text for text in texts)


def test_a_dropped_surface_is_solved(page, shared, ring):
    clr = tile(page).inner_text()
    page.locator("input[type=file]").set_input_files(ring)
    page.get_by_text("Measured surface ring.x3p").wait_for()
    page.wait_for_function("() => location.search.includes('dropped=ring.x3p')")
    wait_for_change(page, clr)
    expect(page.get_by_role("textbox", name="Composite roughness, Sq")).to_have_count(0)
    clr = tile(page).inner_text()
    set_slider(page, "Load, F", "700 N")
    page.wait_for_function("() => location.search.includes('contact.load=700')")
    wait_for_change(page, clr)  # a moment after the address
    clr, link = tile(page).inner_text(), page.url
    page.close()
    shared.open()
    page = shared.solved(link.removeprefix(shared.server.url))  # as long as the server runs
    wait_for_share(page, clr)
    assert page.get_by_text("dropped surface").count() == 0


def test_an_address_only_sets_values(shared, server):
    *values, other_case = HOSTILE_ADDRESSES
    for query in ("&".join(values), other_case):
        page = shared.go(f"contact?{query}")
        notes = page.get_by_text(re.compile("^The link "))
        notes.first.wait_for()
        shown = " ".join(notes.all_inner_texts())
        assert shown.count("The link ") == query.count("&") + 1, shown
        assert page.evaluate("() => window.pwned") is None
        wait_for_value(page, "Load, F", "500 N")
        assert page.get_by_text("root:").count() == 0
    shared.require_no_error()
    assert not (server.log.parent / "pwned").exists()


def test_a_browser_that_never_reports_ready_shows_the_contact(visit):
    visit.page.add_init_script(f"({NEVER_READY})()")
    visit.solved()
