"""Tables "equation, source, function, test" of the theory pages, in both directions.

Functions and tests named in docs/theory/equations.md exist, and every public law that states an
equation in its docstring has a row on some page.
"""

import inspect
import re
from collections.abc import Iterator

import pytest

from support.pages import Line, Page, read
from support.source import ROOT, exported, faces, functions, parsed

THEORY = [read(path) for path in sorted(ROOT.glob("docs/theory/*.md"))]
EQUATION = re.compile(r"\S = \S")
NO_LAW = {  # public, with an equation in the docstring, but no physical law
    "CaseFile": "a key and its value",
    "Condition": "what an indicator may follow, and how much of it",
    "recursion": "a digital filter",
}


def tables(page: Page) -> Iterator[tuple[Line, dict[str, str]]]:
    """Table rows with columns for functions and tests, as dictionaries by heading."""
    headings: list[str] = []
    for line, cells in page.rows():
        if "equation" in cells[0] or cells[0] in ("what", "step", "claim"):
            headings = cells
        elif {"function", "test"} <= set(headings) and len(cells) == len(headings):
            yield line, dict(zip(headings, cells, strict=True))


ROWS = [(page, line, row) for page in THEORY for line, row in tables(page)]
NAMED = [  # rows that name a public object and a test file
    (page, line, row)
    for page, line, row in ROWS
    if page.path.stem == "equations" and re.search(r"`test_\w+\.py`", row["test"])
]


def test_the_tables_are_found():
    assert len(NAMED) > 25
    assert len({page.path.stem for page, _, _ in ROWS}) >= 6


@pytest.mark.parametrize(
    ("page", "line", "row"), NAMED, ids=[row["function"] for _, _, row in NAMED]
)
def test_a_row_names_a_public_function_and_a_test_that_uses_it(page, line, row):
    public = {name for face in faces().values() for name in exported(face)}
    (name,) = re.findall(r"`(?:\w+\.)*(\w+)`", row["function"])
    assert name in public, f"{page.path.name}:{line.number}"
    files = [
        path
        for file in re.findall(r"`(test_\w+\.py)`", row["test"])
        for path in ROOT.glob(f"tests/*/{file}")
    ]
    known = {function.name for file in files for function in functions(parsed(file))}
    tests = set(re.findall(r"`(test_\w+)`", row["test"]))
    assert files
    assert tests <= known, (
        f"{page.path.name}:{line.number}: {tests - known} is not in {[file.name for file in files]}"
    )


def test_every_public_law_has_a_table_row():
    documented = " ".join(cell for page in THEORY for _, cells in page.rows() for cell in cells)
    laws = {
        name
        for face in faces().values()
        for name, member in exported(face).items()
        if inspect.isroutine(member) or inspect.isclass(member)
        if EQUATION.search((member.__doc__ or "").split("\n\n")[0])
        if not (member.__doc__ or "").startswith(
            f"{name}("
        )  # the generated docstring of a dataclass
    }
    assert len(laws) > 30
    assert (
        sorted(name for name in laws - NO_LAW.keys() if not re.search(rf"\b{name}\b", documented))
        == []
    )
    assert sorted(NO_LAW.keys() - laws) == []
