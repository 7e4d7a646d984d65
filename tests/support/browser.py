"""A live page's server and a browser that finds no other host; both report errors."""

import os
import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from asperity.app.presets import default_case

TIMEOUT_MS = 60_000
REQUIRED = (  # if this variable is set, as in CI, a missing browser fails the tests
    "ASPERITY_CHROMIUM"
)
ARGUMENTS = (
    "--no-sandbox",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # no other host is found
)
ONE_WORKER = """
import sys
from asperity.app import jobs
from asperity.cli import main
assert jobs.MAX_WORKERS > 1
jobs.MAX_WORKERS = 1
main(sys.argv[1:])
"""  # each worker loads the solver, which takes seconds of processor time
NOT_WARMED_UP = f"""
from asperity.app.jobs import WorkerPool
WorkerPool.warm_up = lambda _: None
{ONE_WORKER}
"""  # the first job that solves a contact loads the solver


def missing(reason: str) -> None:
    """Skip the test, or fail where the browser tests are required."""
    if os.environ.get(REQUIRED):
        pytest.fail(f"{reason}, and {REQUIRED} requires these tests")
    pytest.skip(f"{reason}: pip install 'asperity[page]' playwright, apt-get install chromium")


class Server:
    """A running `asperity page`, with one worker process unless another program is given."""

    def __init__(
        self,
        folder: Path,
        *arguments: str,
        program: tuple[str, ...] = ("-c", ONE_WORKER),
        **environment: str,
    ) -> None:
        self.log = folder / "server.log"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                [sys.executable, *program, "page", *arguments, "--port", "0"],
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                cwd=folder,
                env={**os.environ, **environment},
            )
        first_line = self.process.stdout.readline()
        found = re.search(r"(http://\S+/)\?token=(\S+)", first_line)
        if not found:
            self.process.kill()
            self.process.communicate()
        assert found, f"{first_line}{self.log.read_text('utf-8')}"
        self.url, self.token = found.groups()
        self.context = None  # of the browser, which its visits share

    @property
    def host(self) -> str:
        return urlsplit(self.url).netloc

    @property
    def cookie(self) -> dict[str, str]:
        """Header of a visitor who was admitted."""
        return {"Cookie": f"asperity-{self.host.rpartition(':')[2]}={self.token}"}

    @property
    def workers(self) -> list[int]:
        """Identifiers of the worker processes."""
        pid = self.process.pid
        return [*map(int, Path(f"/proc/{pid}/task/{pid}/children").read_text("ascii").split())]

    def stop(self) -> str:
        """Stop the server with SIGINT, as Ctrl-C does; return its log."""
        self.process.send_signal(2)
        try:
            self.process.wait(30)
        finally:
            self.process.kill()
            self.process.stdout.close()
        return self.log.read_text("utf-8")


def write_small_contact(folder: Path, *, sliding: bool = False) -> str:
    """Write the default case on few cells, with standing roughness; return its name.

    Without sliding, the page computes no Stribeck curve; with sliding, the cells are too few for a
    coarse solution.
    """
    cells, slip = ([64, 48], 0.2) if sliding else ([96, 64], 0.0)
    few = {"grid.cells": cells, "contact.slip": slip, "contact.roughness": "standing"}
    (folder / "contact.toml").write_text(default_case().with_overrides(few).text, "utf-8")
    return "contact.toml"


@contextmanager
def serving(folder: Path, *arguments: str, **settings):
    """Run a server; assert at the end that it logged no exception."""
    server = Server(folder, *arguments, **settings)
    try:
        yield server
    finally:
        log = server.stop()
    assert "Traceback" not in log, log
    assert "Exception" not in log, log


@contextmanager
def chromium():
    """Debian's browser, driven by Playwright."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("Playwright is not installed")
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        missing("chromium is not installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        yield browser
        browser.close()


def expect(locator):
    """Return Playwright's expectation with the timeout of a visit, because the page appears in
    parts.
    """
    from playwright.sync_api import expect as expected

    expected.set_options(timeout=TIMEOUT_MS)
    return expected(locator)


def new_context(browser, server: Server, *, admitted: bool):
    """Return a new context of the browser, with the server's cookie if the visitor is admitted."""
    context = browser.new_context(permissions=["clipboard-read", "clipboard-write"])
    if admitted:
        name, _, value = server.cookie["Cookie"].partition("=")
        cookie = {"name": name, "value": value, "url": server.url, "sameSite": "Strict"}
        context.add_cookies([cookie])
    return context


class Visit:
    """A page in the browser, its requests to other hosts, and its errors.

    Visits of a server share a context, whose cache keeps compiled scripts, unless they are `alone`
    or not admitted.
    """

    def __init__(
        self,
        browser,
        server: Server,
        *,
        admitted: bool = True,
        alone: bool = False,
        width: int = 1280,
        height: int = 1000,
        scheme: str = "light",
    ) -> None:
        self.server, self.foreign, self.errors = server, [], []
        self._window, self._scheme = {"width": width, "height": height}, scheme
        self._alone = alone or not admitted
        if self._alone:
            self.context = new_context(browser, server, admitted=admitted)
        else:
            server.context = server.context or new_context(browser, server, admitted=True)
            self.context = server.context
        self.open()

    def open(self):
        """Open an empty page; return it."""
        self.page = self.context.new_page()
        self.page.set_viewport_size(self._window)
        self.page.emulate_media(color_scheme=self._scheme)
        self.page.set_default_timeout(TIMEOUT_MS)
        self.page.on("request", self._log_request)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", self._log_error)
        self.page.on("websocket", self._socket)
        self.page.on(
            "dialog",
            lambda dialog: (self.errors.append(f"dialog {dialog.message}"), dialog.dismiss()),
        )
        return self.page

    def _log_request(self, request):
        address = urlsplit(request.url)
        if address.scheme not in ("data", "blob") and address.netloc != self.server.host:
            self.foreign.append(request.url)

    def _socket(self, socket):
        if urlsplit(socket.url).netloc != self.server.host:
            self.foreign.append(socket.url)

    def _log_error(self, message):
        if message.type == "error":
            self.errors.append(message.text)

    def go(self, path: str = "contact"):
        """Visit a path and wait until a document is there."""
        self.page.goto(f"{self.server.url}{path}")
        self.page.wait_for_function(
            "() => window.Bokeh !== undefined && Bokeh.documents.length > 0"
        )
        return self.page

    def solved(self, path: str = "contact"):
        """Visit a contact and wait until it is solved."""
        page = self.go(path)
        page.get_by_text(re.compile("^(Loading the solver.*)?Solved on")).wait_for()
        return page

    def require_no_error(self):
        """Assert that no other host was asked and no error was reported."""
        assert self.foreign == []
        assert self.errors == []

    def close(self):
        """Close the page, and its context unless others use it; assert that nothing went wrong."""
        self.page.close()
        if self._alone:
            self.context.close()
        self.require_no_error()


class SharedVisit(Visit):
    """A solved contact for several tests, which leave the page as they found it.

    Loading it takes the browser, the server and a worker five seconds of processor time.
    """

    def __init__(self, browser, server: Server, **window) -> None:
        super().__init__(browser, server, **window)
        self.solved()
        self._first = self._shown()

    def _shown(self) -> tuple[str, list[str], list[str]]:
        """Return the address, the results in the strip, and the values of all inputs."""
        boxes = self.page.get_by_role("textbox")
        values = boxes.evaluate_all("boxes => boxes.map(box => box.value)")
        return self.page.url, self.page.locator("#headline").all_inner_texts(), values

    def as_first(self):
        """Return the page as it was at first; load it again if a test left it changed."""
        if self._shown() != self._first:
            self.solved()
        return self.page


CONTROLS = {
    "button",
    "checkbox",
    "combobox",
    "link",
    "listbox",
    "radio",
    "slider",
    "spinbutton",
    "switch",
    "textbox",
}
FOCUSED = """() => {
  let element = document.activeElement
  while (element?.shadowRoot?.activeElement) element = element.shadowRoot.activeElement
  window.reached ??= new Map()
  if (!window.reached.has(element)) window.reached.set(element, window.reached.size)
  return window.reached.get(element)
}"""


def accessible(page):
    """Return controls and pictures as a screen reader finds them, and the roles of those without a
    name.
    """
    tree = page.context.new_cdp_session(page).send("Accessibility.getFullAXTree")["nodes"]
    roles = {node["nodeId"]: node["role"]["value"] for node in tree if "role" in node}
    controls = [node for node in tree if not node["ignored"] and roles[node["nodeId"]] in CONTROLS]
    pictures = [
        node
        for node in tree
        if roles[node["nodeId"]] == "image"
        and not node["ignored"]
        and roles.get(node.get("parentId")) != "button"
    ]  # the button's name covers its icon
    nameless = [
        node for node in (*controls, *pictures) if not node.get("name", {}).get("value", "").strip()
    ]
    return controls, pictures, [roles[node["nodeId"]] for node in nameless]


def require_operable(page) -> None:
    """Assert that all controls and pictures have a name, and that the Tab key reaches every
    control.
    """
    for _ in range(20):  # the progress picture of a drop disappears by itself
        controls, pictures, nameless = accessible(page)
        if not nameless:
            break
        page.wait_for_timeout(500)
    assert nameless == []
    assert pictures
    count = len(controls)
    page.evaluate("() => { document.activeElement.blur(); scrollTo(0, 0) }")
    for _ in range(2 * count):
        page.keyboard.press("Tab")
        reached = page.evaluate(FOCUSED) + 1
        if reached >= count:
            return
    raise AssertionError(f"the Tab key reaches {reached} of {count} controls")


MARK = """([label, number]) => {
  const named = view => view.model.type === "Figure"
    && view.model.html_attributes["aria-label"] === label
  const figure = [...Bokeh.index.query(named)][0]
  const {glyph, data_source} = figure.model.renderers.find(drawn => drawn.glyph.type === "Scatter")
  const {left, top} = figure.canvas_view.el.getBoundingClientRect()
  const across = figure.frame.x_scale.compute(data_source.data[glyph.x.field][number])
  const down = figure.frame.y_scale.compute(data_source.data[glyph.y.field][number])
  return [left + across, top + down]
}"""


def click_mark(page, label, number):
    """Click a mark in the figure with this accessible name."""
    page.get_by_role("img", name=label).scroll_into_view_if_needed()
    before, place = None, page.evaluate(MARK, [label, number])
    while place != before:  # until everything above the figure has been loaded
        page.wait_for_timeout(300)
        before, place = place, page.evaluate(MARK, [label, number])
    page.mouse.click(*place)
