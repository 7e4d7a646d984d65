"""Every snippet of every page is run, or states a reason above it: `<!-- not run: reason -->`.

The snippets of a page are run in order, in this process, in one folder that holds the examples;
names that Python defines remain for the page's next block of Python. Those of README are run in
test_readme, which compares their output. A block of `text` behind commands is their output: each
line must be printed, where "..." matches any text.
"""

import re
import shlex
import shutil

import pytest

from asperity.cli import main
from support.pages import Block, Page, pages, read
from support.source import ROOT

RUN = (
    "sh",
    "console",
    "python",
)  # other languages cannot be run: cases and output
REASON = re.compile(r"<!-- not run: (\S.*\S) -->")
SUCCESS = {0, 3, 4, 5}  # exit codes of a command that did its work
# pages that show numbers of a running contact; those of others are solved on fewer cells and over
# fewer passages, and the cases of `new` as they are by test_starters
SHOW_NUMBERS = {"first-hour.md", "wear.md"}
SHOWN = re.compile(r"(--[\w-]+|\S+\.\w+)")


def reason(page: Page, block: Block) -> str | None:
    """Return the reason why a block is not run, or None if it is run."""
    above = page.text.splitlines()[block.line.number - 2]
    found = REASON.fullmatch(above.strip())
    return found[1] if found else None


def snippets(page: Page) -> list[Block]:
    return [block for block in page.blocks if block.language in RUN and reason(page, block) is None]


def with_snippets() -> list[Page]:
    return [page for page in pages() if snippets(page) and page.path.name != "README.md"]


@pytest.mark.parametrize(
    "page", with_snippets(), ids=lambda page: page.path.relative_to(ROOT).as_posix()
)
def test_the_snippets_of_a_page_run(page, tmp_path, monkeypatch, capsys, request):
    monkeypatch.chdir(tmp_path)
    if page.path.name not in SHOW_NUMBERS:
        request.getfixturevalue("short_tracks")
        request.getfixturevalue("thinnest_film_only")
    shutil.copytree(ROOT / "examples", "examples")
    names: dict[str, object] = {"__name__": "__main__"}
    for block in snippets(page):
        if block.language == "python":
            exec(compile(block.text, f"{page.path.name}:{block.line.number}", "exec"), names)
            continue
        after = next(
            (other for other in page.blocks if other.line.number > block.line.number), None
        )
        shown = after.text if after is not None and after.language in ("", "text") else ""
        refused = shown if shown.startswith("error: ") else None
        lines = block.text.replace("\\\n", " ").splitlines()
        output = "\n".join(run(line.removeprefix("$ "), refused, capsys) for line in lines)
        assert refused is not None or missing_lines(shown, output) == []


def missing_lines(shown: str, output: str) -> list[str]:
    """Return the lines that a page shows and no command printed."""
    patterns = {line: ".*".join(map(re.escape, line.split("..."))) for line in shown.splitlines()}
    return [
        line
        for line, pattern in patterns.items()
        if not re.search(f"^{pattern}$", output, re.MULTILINE)
    ]


def run(line: str, refusal: str | None, capsys) -> str:
    """Return the output of a command that succeeds, or fails as the block behind it shows."""
    words = shlex.split(line, comments=True)
    if not words:
        return ""
    assert words[0] == "asperity", f"{line}: mark commands of other programs as not run"
    with pytest.raises(SystemExit) as end:
        main(words[1:])
    captured = capsys.readouterr()
    if refusal is not None and end.value.code == 2:
        assert captured.err.strip() == refusal.strip()
    else:
        assert (end.value.code or 0) in SUCCESS, f"{line}: {captured.err}"
    return captured.out


def test_a_reason_is_given_only_above_snippets():
    for page in pages():
        marks = [
            number
            for number, line in enumerate(page.text.splitlines(), 1)
            if REASON.fullmatch(line.strip())
        ]
        fences = {block.line.number for block in page.blocks if block.language in RUN}
        assert [number for number in marks if number + 1 not in fences] == [], page.path


def test_a_failing_snippet_is_detected(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AssertionError, match="no-such-case"):
        run("asperity solve no-such-case.toml", None, capsys)
    with pytest.raises(AssertionError, match="mark commands of other programs"):
        run("make test", None, capsys)


def test_a_line_that_is_not_printed_is_detected():
    output = "Full film: 0 %.\nReport: mine.html\n"
    assert missing_lines("Full film: ...\nReport: mine.html", output) == []
    assert missing_lines("Full ...\nMixed ...", output) == ["Mixed ..."]
    assert missing_lines("film: 0 %.", output) == ["film: 0 %."]


def test_readme_is_run_by_its_own_tests_or_gives_a_reason():
    page = read(ROOT / "README.md")
    marked = [block for block in page.blocks if block.language in RUN and reason(page, block)]
    own = list(snippets(page))
    assert len(own) == 2, [  # the first commands and the example of Python, see test_readme
        block.text for block in own
    ]
    assert marked
