"""The built site: links resolve within it, pages load nothing from elsewhere, mathematics is drawn.

`make docs` builds it. Without it these tests are skipped, except in CI, where ASPERITY_SITE
requires it.
"""

import os
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from support.browser import chromium
from support.source import ROOT
from support.vocabulary import case_sections, commands

SITE = ROOT / "build" / "site"
SCHEMES = ("http", "https", "mailto", "data", "javascript")
FEWEST = 15  # scripts of the gallery


@pytest.fixture(scope="module", autouse=True)
def site() -> Path:
    if not (SITE / "index.html").is_file():
        if os.environ.get("ASPERITY_SITE"):
            pytest.fail("the site is not built, and ASPERITY_SITE asks for its tests")
        pytest.skip("the site is not built: make docs")
    return SITE


class Reader(HTMLParser):
    """Links of a page, the resources it loads, and the targets of links to it."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {key: value or "" for key, value in attrs}
        self.anchors |= {given[key] for key in ("id", "name") if key in given}
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag == "link" and "href" in given and "canonical" not in given.get("rel", ""):
            self.loaded.append(given["href"])
        elif "src" in given:
            self.loaded.append(given["src"])


@cache
def read(path: Path) -> Reader:
    reader = Reader()
    reader.feed(path.read_text("utf-8"))
    return reader


def html() -> list[Path]:
    """Return the pages, without the fragments that the theme serves."""
    return sorted(path for path in SITE.rglob("*.html") if "_static" not in path.parts)


def test_every_link_resolves(site):
    broken = []
    for page in html():
        for link in (*read(page).links, *read(page).loaded):
            parts = urlsplit(link)
            if parts.scheme in SCHEMES:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            target = target / "index.html" if target.is_dir() else target
            anchored = not parts.fragment or target.suffix != ".html" or not target.is_file()
            if not target.is_file() or not (
                anchored or unquote(parts.fragment) in read(target).anchors
            ):
                broken.append(f"{page.relative_to(site)}: {link}")
    assert len(html()) > 100
    assert broken == []


def test_no_page_loads_anything_from_elsewhere(site):
    foreign = {
        link
        for page in html()
        for link in read(page).loaded
        if urlsplit(link).scheme in ("http", "https")
    }
    foreign |= {link for page in html() for link in read(page).loaded if link.startswith("//")}
    styles = "".join(path.read_text("utf-8") for path in site.rglob("*.css"))
    assert foreign == set()
    assert re.findall(r"url\(['\"]?(?:https?:)?//[^)]*\)|@import ['\"]http[^;]*", styles) == []


def test_the_gallery_has_scripts_and_notebooks_with_figures(site):
    scripts = sorted(path.stem for path in ROOT.glob("docs/scripts/*.py"))
    assert len(scripts) >= FEWEST
    for name in scripts:
        page = read(site / "gallery" / f"{name}.html")
        assert any(link.endswith(f"{name}.ipynb") for link in page.links), name
        assert any(re.search(rf"sphx_glr_{name}_\d+", link) for link in page.loaded), name


def test_the_reference_has_every_name_command_and_key(site):
    text = (site / "reference" / "commands.html").read_text("utf-8")
    assert [name for name in commands() if f"asperity {name}".strip() not in text] == []
    keys = (site / "reference" / "case-keys.html").read_text("utf-8")
    missing = [
        key
        for section in case_sections().values()
        for key in section.model_fields
        if f">{key}<" not in keys
    ]
    assert missing == []
    import asperity

    assert [
        name
        for name in dir(asperity)
        if not (site / "reference" / "names" / f"asperity.{name}.html").is_file()
    ] == []


def test_a_browser_contacts_no_other_host_and_draws_mathematics(site):
    requests, errors = [], []
    with chromium() as browser:
        page = browser.new_page()
        page.on("request", lambda request: requests.append(request.url))
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on(
            "console",
            lambda message: errors.append(message.text) if message.type == "error" else None,
        )
        for name in (
            "index",
            "gallery/index",
            "gallery/01_smooth_line",
            "reference/names/asperity.Grid",
            "search",
        ):
            page.goto((site / f"{name}.html").as_uri())
        page.goto((site / "theory" / "equations.html").as_uri())
        page.locator("mjx-container svg").first.wait_for()
        drawn = page.locator("mjx-container svg").count()
        wide = []
        for name in (
            "index",
            "gallery/index",
            "reference/api",
            "reference/case-keys",
            "theory/equations",
        ):
            page.set_viewport_size({"width": 390, "height": 800})
            page.goto((site / f"{name}.html").as_uri())
            if page.evaluate("document.documentElement.scrollWidth > window.innerWidth + 1"):
                wide.append(name)
    assert drawn > 20
    assert [url for url in requests if not url.startswith(("file:", "data:", "blob:"))] == []
    assert errors == []
    assert wide == [], "wider than a phone screen"
