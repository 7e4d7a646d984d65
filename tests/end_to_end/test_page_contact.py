"""The contact page in a browser: sliders, results, dropped files, links and access control."""

import http.client
import json
import re
import tomllib

import numpy as np
import pytest
import x3pio

from asperity.app.inputs import case_inputs
from asperity.app.opening import default_case
from support.browser import (
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
    "<img src=x onerror=window.pwned=1>.x3p",
    "$(touch pwned).x3p",
    "a'; import os; os.system('touch pwned').x3p",
    '"><script>window.pwned=1</script>.x3p',
    "{{7*7}}.x3p",
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
HOSTILE_HEADERS = [
    {"Host": "evil.example"},
    {"Host": '"><script>pwned</script>'},
    {"X-Forwarded-Host": "<script>pwned</script>"},
    {"X-Forwarded-Proto": "javascript"},
    {"X-Forwarded-Prefix": "/<script>pwned</script>"},
    {"Referer": "<script>pwned</script>"},
    {"User-Agent": "<script>pwned</script>"},
    {"Cookie": "is_guest=1; user=<script>pwned</script>"},
    {"Bokeh-Session-Id": "<script>pwned</script>"},
    {"Accept-Language": "{{7*7}}<script>pwned</script>"},
]


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


def tile(page, name="CLR"):
    """Return a number of the strip."""
    return page.locator("#headline dl div", has_text=name).locator("dd").first


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


def test_a_browser_that_never_reports_ready_shows_the_contact(visit):
    visit.context.add_init_script(f"({NEVER_READY})()")
    visit.solved()


def test_a_slider_updates_maps_numbers_and_address(visit):
    page = visit.solved()
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


def test_a_slider_moves_by_keyboard_and_announces_its_value(visit):
    page = visit.solved()
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


def test_every_control_is_named_and_reached_by_the_keyboard(visit):
    page = visit.solved()
    page.get_by_role("button", name="More inputs").click()
    page.get_by_role("button", name="Fewer inputs").wait_for()
    require_operable(page)


def test_a_wrong_value_is_reported_at_its_slider(visit):
    page = visit.solved()
    box = set_slider(page, "Composite roughness, Sq", "2")
    message = page.get_by_text(
        'Composite roughness, Sq must be a length such as "5.4 mm", got the bare number 2'
    )
    message.wait_for()
    below, above = message.bounding_box(), box.bounding_box()
    assert 0 < below["y"] - above["y"] < 120
    expect(page.locator(".block.film")).not_to_have_css("opacity", "1")
    expect(page.locator(".block.verdict")).to_contain_text("Previous result: ")
    set_slider(page, "Composite roughness, Sq", "1 um")
    message.wait_for(state="hidden")
    expect(page.locator(".block.verdict")).not_to_contain_text("Previous result: ")
    expect(page.locator(".block.film")).to_have_css("opacity", "1")


def test_a_pinned_contact_is_compared(visit):
    page = visit.solved()
    page.get_by_role("button", name="Pin to compare").click()
    set_slider(page, "Entrainment speed, u", "3 m/s")
    page.wait_for_function("() => location.search.includes('entrainment')")
    expect(tile(page)).to_have_text(re.compile(r"[−-][\d.]+ % vs. pinned"))
    page.get_by_role("button", name="Unpin").click()
    page.get_by_text("vs. pinned").first.wait_for(state="hidden")


def test_an_earlier_setting_is_restored_by_a_click(visit):
    page = visit.solved()
    first, speed = (
        tile(page).inner_text(),
        page.get_by_role("textbox", name="Entrainment speed, u").input_value(),
    )
    set_slider(page, "Entrainment speed, u", "3 m/s")
    page.wait_for_function("() => location.search.includes('entrainment')")
    wait_for_change(page, first)
    page.get_by_text(re.compile("^Solved on")).wait_for()
    click_mark(page, "Load share over roughness", 0)
    page.wait_for_function("() => !location.search.includes('entrainment')")
    wait_for_value(page, "Entrainment speed, u", speed)
    wait_for_share(page, first)


def test_case_file_and_script_are_downloaded(visit):
    page = visit.solved("contact?contact.load=600+N")
    with page.expect_download() as taken:
        page.get_by_role("button", name="Case file").click()
    assert taken.value.suggested_filename == "contact.toml"
    assert tomllib.loads(taken.value.path().read_text("utf-8"))["contact"]["load"] == "600 N"
    with page.expect_download() as taken:
        page.get_by_role("button", name="Python script").click()
    compile(taken.value.path().read_text("utf-8"), "contact.py", "exec")


def test_a_dropped_surface_is_solved(visit, ring):
    page = visit.solved()
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
    visit.page = visit.context.new_page()
    page = visit.solved(link.removeprefix(visit.server.url))  # as long as the server runs
    wait_for_share(page, clr)
    assert page.get_by_text("dropped surface").count() == 0


def test_a_law_is_selected(visit):
    page = visit.solved()
    page.get_by_role("button", name="More inputs").click()
    page.get_by_label("Viscosity law").select_option("roelands")
    page.wait_for_function("() => location.search.includes('lubricant.viscosity.law=roelands')")
    page.get_by_label("Contact model").select_option("paper")
    page.wait_for_function("() => location.search.includes('model=paper')")


def test_a_damaged_file_is_refused_in_one_sentence(visit, ring, tmp_path):
    page = visit.solved()
    clr = tile(page).inner_text()
    (tmp_path / "cut.x3p").write_bytes(ring.read_bytes()[:3000])
    page.locator("input[type=file]").set_input_files(tmp_path / "cut.x3p")
    page.get_by_text(re.compile(r"cut\.x3p .*\.$")).wait_for()
    wait_for_share(page, clr)


def test_a_file_name_is_only_shown_as_text(visit, server):
    """Names that end up in markup in different ways; test_page_server.py tests more."""
    page = visit.solved()
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


def test_an_address_only_sets_values(visit, server):
    *values, other_case = HOSTILE_ADDRESSES
    for query in ("&".join(values), other_case):
        page = visit.go(f"contact?{query}")
        notes = page.get_by_text(re.compile("^The link "))
        notes.first.wait_for()
        shown = " ".join(notes.all_inner_texts())
        assert shown.count("The link ") == query.count("&") + 1, shown
        assert page.evaluate("() => window.pwned") is None
        wait_for_value(page, "Load, F", "500 N")
        assert page.get_by_text("root:").count() == 0
    assert not (server.log.parent / "pwned").exists()


@pytest.mark.parametrize("header", HOSTILE_HEADERS, ids=lambda header: next(iter(header)))
def test_a_header_does_not_appear_in_the_page(server, header):
    connection = http.client.HTTPConnection(server.host)
    connection.request("GET", "/contact", headers={**server.cookie, **header})
    reply = connection.getresponse()
    response = f"{reply.getheaders()} {reply.read().decode('utf-8')}"
    assert reply.status in (200, 400, 403)
    for text in ("pwned", "evil.example", "{{7*7}}"):
        assert text not in response
    connection.close()


def handshake(server, origin):
    connection = http.client.HTTPConnection(server.host)
    upgrade = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Origin": origin,
        **server.cookie,
    }
    connection.request(
        "GET", "/contact/ws", headers={**upgrade, "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    )
    status = connection.getresponse().status
    connection.close()
    return status


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:1", "null", "http://127.0.0.1.evil.example"]
)
def test_a_foreign_origin_gets_403(server, origin):
    assert handshake(server, origin) == 403


def test_the_first_address_opens_the_contact(server):
    connection = http.client.HTTPConnection(server.host)
    connection.request("GET", "/", headers=server.cookie)
    answer = connection.getresponse()
    assert (answer.status, answer.getheader("Location")) == (302, "/contact")
    connection.close()


def test_dark_and_light_text_is_legible(browser, server):
    for scheme in ("dark", "light"):
        visit = Visit(browser, server, color_scheme=scheme)
        page = visit.solved()
        colours = page.evaluate(
            "() => { const s = getComputedStyle(document.body); return JSON.stringify([s.color,"
            " s.backgroundColor]) }"
        )
        ink, paper = (
            [int(part) / 255 for part in re.findall(r"\d+", text)[:3]]
            for text in json.loads(colours)
        )
        assert contrast(ink, paper) > 7.0
        assert (sum(paper) < 1.0) == (scheme == "dark")
        visit.close()


def contrast(first, second):
    """Return the WCAG contrast ratio of two colours."""

    def luminance(colour):
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("width", [390, 1280, 2560])
def test_nothing_is_wider_than_the_window(browser, server, width):
    visit = Visit(browser, server, viewport={"width": width, "height": 900})
    page = visit.solved()
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    assert page.locator("header").bounding_box()["height"] < 60  # one line
    page.get_by_role("button", name="Pin to compare").click()
    page.get_by_text("vs. pinned").first.wait_for()
    page.get_by_role("img", name="Film minus pinned film").wait_for()
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    visit.close()
