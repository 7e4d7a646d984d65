"""First visit of the live page: numbers at once, before the solver is loaded."""

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


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def server(browser, tmp_path_factory):  # noqa: ARG001 - no server is started without a browser
    """Serve the default case."""
    with serving(tmp_path_factory.mktemp("server")) as started:
        yield started


def processor_seconds(server):
    """Return the processor time of the server, without its workers [s]."""
    stat = Path(f"/proc/{server.process.pid}/stat").read_text("utf-8").rpartition(")")[2].split()
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")


def strip(page):
    return page.locator("#headline")


def stored_clr():
    """Return the load share that a first visit shows."""
    result = stored_result(default_case()).result
    return next(tile.value for tile in result.tiles if tile.key == "clr").split()[0]


def test_the_first_numbers_are_there_within_a_second_although_nothing_is_compiled(
    browser, tmp_path
):
    cache = str(tmp_path / "cache")
    server = Server(tmp_path, program=("-m", "asperity"), NUMBA_CACHE_DIR=cache)
    before = processor_seconds(server)
    visit = Visit(browser, server)
    visit.page.goto(f"{server.url}contact", wait_until="commit")
    strip(visit.page).get_by_text(stored_clr()).wait_for()
    assert processor_seconds(server) - before < FIRST_S
    expect(visit.page.locator("#compiling")).to_be_visible()
    status = re.compile(r"^Loading the solver .*Stored solution of asperity")
    visit.page.get_by_text(status).wait_for()
    visit.close()
    for worker in server.workers:  # do not wait until they have compiled
        os.kill(worker, signal.SIGKILL)
    server.stop()


def test_the_solver_confirms_the_stored_solution(browser, server):
    visit = Visit(browser, server)
    page = visit.go()
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
