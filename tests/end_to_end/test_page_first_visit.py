"""First visit of the live page: numbers at once, what stays visible, what a wrong value leaves."""

import http.client
import os
import re
import signal
from pathlib import Path

import pytest

from asperity.app.presets import default_case, stored_result
from support.browser import Server, Visit, chromium, expect, serving

pytest.importorskip("panel", reason="the extra page is not installed")

FIRST_S = 1.0  # of the server's processor, from the request of the page to its first numbers
WRONG = [
    ("Normal load, F", "-5 N"),
    ("Entrainment speed, u", "fast"),
    ("Composite roughness, Sq", "2"),
    ("Slide-to-roll ratio", "7 m"),
    ("Hardness", "2 GHz"),
]


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def server(browser, tmp_path_factory):  # noqa: ARG001 - no server is started without a browser
    """Serve the default case."""
    with serving(tmp_path_factory.mktemp("server")) as started:
        yield started


@pytest.fixture
def visit(browser, server):
    made = Visit(browser, server)
    yield made
    made.close()


def processor_seconds(server):
    """Return the processor time of the server, without its workers [s]."""
    stat = Path(f"/proc/{server.process.pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")


def strip(page):
    return page.locator("#headline")


def in_view(page, locator):
    """Return True if an element is inside the window."""
    box, height = locator.bounding_box(), page.viewport_size["height"]
    return box is not None and box["y"] >= 0.0 and box["y"] + box["height"] <= height


def stored_clr():
    """Return the load share that a first visit shows."""
    result = stored_result(default_case()).result
    return next(tile.value for tile in result.tiles if tile.key == "clr").split()[0]


def test_the_first_numbers_are_there_within_a_second_although_nothing_is_compiled(
    browser, tmp_path
):
    server = Server(tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    before = processor_seconds(server)
    visit = Visit(browser, server)
    visit.page.goto(f"{server.url}contact", wait_until="commit")
    strip(visit.page).get_by_text(stored_clr()).wait_for()
    assert processor_seconds(server) - before < FIRST_S
    expect(visit.page.locator("#compiling")).to_be_visible()
    visit.close()
    for worker in server.workers:  # do not wait until they have compiled
        os.kill(worker, signal.SIGKILL)
    server.stop()


def test_the_solver_confirms_the_stored_solution(browser, server):
    """The first visit of this server: its solver is still being loaded."""
    visit = Visit(browser, server)
    page = visit.go()
    page.get_by_text(re.compile(r"^Loading the solver .*Stored solution of asperity")).wait_for()
    page.get_by_text(re.compile("^Solved on")).wait_for()
    expect(page.locator("#compiling")).to_be_hidden()
    expect(strip(page)).to_contain_text(stored_clr())
    visit.close()


def test_the_numbers_are_in_the_page_itself(server):
    connection = http.client.HTTPConnection(server.host)
    connection.request("GET", "/contact", headers=server.cookie)
    text = connection.getresponse().read().decode("utf-8")
    connection.close()
    head = text[: text.index("<script ")]  # what the browser shows before it loads a script
    assert "Mixed lubrication" in head
    assert re.search(r"<dt>CLR</dt><dd>\d+\.\d <span>%</span><small>[\d.]+ to [\d.]+ %", head)


@pytest.mark.parametrize("width", [390, 1280])
def test_regime_and_load_share_stay_visible_while_any_knob_turns(browser, server, width):
    visit = Visit(browser, server, viewport={"width": width, "height": 844})
    page = visit.solved()
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
    visit.close()


def test_every_question_mark_has_a_tooltip(visit):
    page = visit.solved()
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


def test_a_wrong_value_marks_the_verdict_as_outdated(visit):
    page = visit.solved()
    for name, value in WRONG:
        box = page.get_by_role("textbox", name=name)
        good = box.input_value()
        box.fill(value)
        box.press("Enter")
        page.get_by_text(re.compile("^Not solved: invalid value of")).wait_for()
        assert page.get_by_text(re.compile("^Solved on")).count() == 0
        for block in ("tiles", "verdict", "film", "spectrum"):
            expect(page.locator(f".block.{block}")).not_to_have_css("opacity", "1")
        expect(strip(page).locator("dd").first).not_to_have_css("opacity", "1")
        expect(strip(page)).to_contain_text("outdated")
        box.fill(good)
        box.press("Enter")
        page.get_by_text(re.compile("^Solved on")).wait_for()
        expect(page.locator(".block.tiles")).to_have_css("opacity", "1")
