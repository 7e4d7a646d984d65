"""The built site: links resolve within it, pages load nothing from elsewhere, mathematics is drawn.

`make docs` builds it. Without it these tests are skipped, except in CI, where ASPERITY_SITE
requires it.
"""

import os
import re
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import quote, unquote, urlsplit

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
    scripts = sorted(ROOT.glob("docs/scripts/*/*.py"))
    assert len(scripts) >= FEWEST
    for script in scripts:
        name = script.stem
        page = read(site / "gallery" / script.parent.name / f"{name}.html")
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
            "gallery/film/01_smooth_line",
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


# Search
# ---------------------------------------------------------------------------------

FOR_DEVELOPERS = (
    "architecture",
    "benchmarks",
    "changelog",
    "contributing",
    "decisions",
    "project/",
    "security",
    "validation",
)
SEARCHED = {  # what users type, and the page that answers
    "my oil is ISO VG 68": "start/faq",
    "how do I enter bearing 6205": "start/faq",
    "specific film thickness": "questions/micropitting",
    "starved lubrication": "questions/starvation",
    "grease": "questions/starvation",
    "install windows": "start/install",
    "licence": "start/install",
    "not converged": "start/troubleshooting",
    "sampling rate": "recordings",
    "export results to csv": "how-to/export",
    "plot pressure": "how-to/export",
    "temperature": "theory/friction",
    "false alarm": "theory/alarms",
    "python api": "start/faq",
    "Hamrock Dowson": "theory/grid",
    "profilometer": "how-to/surface",
    "friction coefficient": "questions/friction",
    "pitting life": "questions/life",
    "how long does it take": "start/faq",
    "finite line contact": "questions/edges",
    "dry contact": "case-file",
    "Reynolds equation": "theory/equations",
    "JFO": "theory/conserving",
    "Stribeck curve": "questions/friction",
    "tutorial": "start/first-hour",
    "FAQ": "start/faq",
    "gear": "machines",
    "wear rate": "how-to/wear",
    "error bars": "start/reading-a-report",
    "wind turbine gearbox": "machines",
}
UNLISTED = (  # not among the search terms
    "pressure spike",
    "roughness of both bodies",
    "cam follower film",
    "bearing damage detection",
    "load carried by asperities",
    "units of the results",
    "save a picture",
    "unfinished study resume",
    "measured surface tilt",
    "oil data sheet",
)


def first_hits(page, site: Path, query: str) -> list[str]:
    """Return the pages that the site's search lists for a query."""
    page.goto(f"{(site / 'search.html').as_uri()}?q={quote(query)}")
    page.wait_for_selector("#search-results .search-summary:not(:empty)")
    page.wait_for_function(
        "/finished|not match|found/.test(document.querySelector('.search-summary').innerText)"
    )
    found = page.eval_on_selector_all(
        "#search-results li > a", "links => links.map(link => link.getAttribute('href'))"
    )
    return [re.split(r"\.html|#|\?", link)[0] for link in found]


def test_the_search_answers_users(site):
    with chromium() as browser:
        page = browser.new_page()
        hits = {query: first_hits(page, site, query) for query in (*SEARCHED, *UNLISTED)}
    assert [query for query, found in hits.items() if not found] == []
    found = {query: hits[query][0] for query in SEARCHED}
    assert found == SEARCHED
    developers = [query for query in hits if hits[query][0].startswith(FOR_DEVELOPERS)]
    assert developers == []
