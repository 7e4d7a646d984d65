"""Build the site into build/site: `make docs`.

The pages are first staged in one tree with the README, the changelog and the reference of
`make_reference.py`, so that generated files stay apart from sources. Warnings are errors; nothing
is fetched.
"""

import csv
import os
import re
import shutil
import sys
from collections.abc import Iterator
from importlib.metadata import files as files_of
from pathlib import Path

import draw_benchmark
import make_explorer
import make_quantities
import make_reference
from sphinx.cmd.build import main as sphinx

DOCS = Path(__file__).parent
ROOT = DOCS.parent
STAGE, SITE, KEPT = (ROOT / "build" / name for name in ("site-source", "site", "site-kept"))
BESIDE = {
    "README.md": "readme.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "SECURITY.md": "security.md",
}
LINK = re.compile(r"(!?\[[^\]]*\]\()([^)\s]+)(\))")
TABLE = re.compile(r"^(:file: )(\S+)()$", re.MULTILINE)  # of a csv-table
ERRORS = STAGE / "images" / "benchmark-error.png"  # drawn from the csv of the last `make bench`
MATHJAX = ("sphinx-mathjax-offline", "tex-svg.js")  # package, and its file that draws equations
# pages for developers, which the site's search leaves out
FOR_DEVELOPERS = (
    "architecture",
    "benchmarks",
    "changelog",
    "contributing",
    "decisions",
    "security",
    "validation",
)
TERMS = DOCS / "search-terms.csv"  # terms by page, for its search
COMMENT = re.compile(r"^<!-- not run: .* -->\n", re.MULTILINE)
REST = "<!-- the rest -->"  # replaced by the pages that no other list of pages names


def staged(path: Path) -> Path:
    """Return the path of a repository file in the stage, whose root is docs."""
    name = path.relative_to(ROOT).as_posix()
    return STAGE / BESIDE.get(name, name.removeprefix("docs/"))


def sources() -> Iterator[Path]:
    """Yield the source files of the site, without the reference."""
    yield from (ROOT / name for name in BESIDE)
    yield from (ROOT / "examples").glob("*.toml")
    yield ROOT / "benchmark" / "certified.csv"
    yield ROOT / "src" / "asperity" / "contact" / "materials.csv"
    yield from (
        path for path in DOCS.rglob("*") if path.is_file() and "__pycache__" not in path.parts
    )


def relinked(path: Path) -> str:
    """Return a page with its links adapted to the stage."""
    here = staged(path).parent

    def leading(link: re.Match) -> str:
        target, hash_, anchor = link[2].partition("#")
        if "://" in target or not target:
            return link[0]
        there = staged((path.parent / target).resolve())
        return f"{link[1]}{os.path.relpath(there, here)}{hash_}{anchor}{link[3]}"

    parts = re.split(r"(^```.*?^```)", path.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    return "".join((TABLE if part.startswith("```") else LINK).sub(leading, part) for part in parts)


def mathjax() -> Path:
    """Return the path of MathJax's single file in its Sphinx package."""
    library, name = MATHJAX
    return Path(next(file for file in files_of(library) or () if file.name == name).locate())


def listed(texts: dict[Path, str]) -> set[str]:
    """Return the pages of the stage's root that a list of pages names."""
    blocks = (
        block
        for text in texts.values()
        for block in re.findall(r"```\{toctree\}.*?```", text, re.DOTALL)
    )
    return {
        line.strip().rpartition("/")[2]
        for block in blocks
        for line in block.splitlines()
        if line.startswith("../")
    }


def searchable(path: Path, text: str, terms: dict[str, list[str]]) -> str:
    """Return a staged page with its search terms; pages for developers are not searched."""
    page = path.relative_to(STAGE).with_suffix("").as_posix()
    if page in FOR_DEVELOPERS or page.startswith("project/"):
        return f"---\nnosearch: true\n---\n\n{text}"
    if page not in terms:
        return text
    title, line_end, rest = COMMENT.sub("", text).partition("\n")  # a term needs a target below
    entries = "\n".join(f"```{{index}} ! single: {term}\n```" for term in terms.pop(page))
    return f"{title}{line_end}\n{entries}\n{rest}"


def search_terms() -> dict[str, list[str]]:
    """Return the terms of each page."""
    terms: dict[str, list[str]] = {}
    with TERMS.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            terms.setdefault(row["page"], []).append(row["term"])
    return terms


def stage() -> None:
    """Update the stage; unchanged files keep their time, so that only changed ones are rebuilt."""
    texts = {staged(path): relinked(path) for path in sources() if path.suffix == ".md"}
    texts |= {STAGE / name: text for name, text in make_reference.pages().items()}
    rest = sorted(path.stem for path in texts if path.parent == STAGE and path.stem != "index")
    names = "\n".join(f"../{name}" for name in rest if name not in listed(texts))
    terms = search_terms()
    contents = {
        path: searchable(path, text.replace(REST, names), terms).encode()
        for path, text in texts.items()
    }
    if terms:
        raise SystemExit(f"{TERMS.name} names pages that do not exist: {', '.join(terms)}")
    contents |= {staged(path): path.read_bytes() for path in sources() if path.suffix != ".md"}
    contents[STAGE / "_static" / "mathjax" / MATHJAX[1]] = mathjax().read_bytes()
    made = [STAGE / name for name in ("gallery", "reference/names")]
    for path in STAGE.rglob("*"):
        if (
            path.is_file()
            and path not in (*contents, ERRORS)
            and not any(path.is_relative_to(folder) for folder in made)
        ):
            path.unlink()
    for path, content in contents.items():
        if not path.exists() or path.read_bytes() != content:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    draw_benchmark.write(ERRORS)


def main() -> int:
    """Write the generated pages, stage and build the site; return the exit code."""
    for generator in (make_explorer, make_quantities):
        generator.PAGE.write_text(generator.page(), "utf-8")
    stage()
    shutil.rmtree(SITE, ignore_errors=True)
    code = sphinx(
        ["-W", "--keep-going", "-q", "-b", "html", "-d", str(KEPT), str(STAGE), str(SITE)]
    )
    if code == 0:
        print(  # noqa: T201
            f"The site is in {SITE.relative_to(ROOT)}: open"
            f" {(SITE / 'index.html').relative_to(ROOT)}."
        )
    return code


if __name__ == "__main__":
    sys.exit(main())
