"""Every snippet of every page is run, or says above itself why it is not: `<!-- not run: reason
-->`.

The snippets of a page are run in their order, in one folder that holds the examples, in this
process; what Python defines stays for the page's next block of Python. README's are run in
test_readme, which holds what they print. A block of `text` behind commands is what they print:
each of its lines, where "..." stands for anything.
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
)  # of other languages nothing can be run: cases and what is printed
REASON = re.compile(r"<!-- not run: (\S.*\S) -->")
FINE = {0, 3, 4, 5}  # exit codes of a command that did what it is for
SHOWN = re.compile(r"(--[\w-]+|\S+\.\w+)")


def reason(page: Page, block: Block) -> str | None:
    """Why a block is not run; None if it is."""
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
def test_the_snippets_of_a_page_run(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples", "examples")
    kept: dict[str, object] = {"__name__": "__main__"}
    for block in snippets(page):
        if block.language == "python":
            exec(compile(block.text, f"{page.path.name}:{block.line.number}", "exec"), kept)
            continue
        after = next((one for one in page.blocks if one.line.number > block.line.number), None)
        shown = after.text if after is not None and after.language in ("", "text") else ""
        refused = shown if shown.startswith("error: ") else None
        lines = block.text.replace("\\\n", " ").splitlines()
        said = "\n".join(run(line.removeprefix("$ "), refused, capsys) for line in lines)
        assert refused is not None or unsaid(shown, said) == []


def unsaid(shown: str, said: str) -> list[str]:
    """The lines that a page shows and nothing printed."""
    patterns = {line: ".*".join(map(re.escape, line.split("..."))) for line in shown.splitlines()}
    return [
        line
        for line, pattern in patterns.items()
        if not re.search(f"^{pattern}$", said, re.MULTILINE)
    ]


def run(line: str, refusal: str | None, capsys) -> str:
    """What a command prints that does what it is for, or is refused as the block behind it
    shows.
    """
    words = shlex.split(line, comments=True)
    if not words:
        return ""
    assert words[0] == "asperity", f"{line}: mark what is no command of ours as not run"
    with pytest.raises(SystemExit) as end:
        main(words[1:])
    said = capsys.readouterr()
    if refusal is not None and end.value.code == 2:
        assert said.err.strip() == refusal.strip()
    else:
        assert (end.value.code or 0) in FINE, f"{line}: {said.err}"
    return said.out


def test_a_reason_stands_above_a_snippet_and_nowhere_else():
    for page in pages():
        marks = [
            number
            for number, line in enumerate(page.text.splitlines(), 1)
            if REASON.fullmatch(line.strip())
        ]
        fences = {block.line.number for block in page.blocks if block.language in RUN}
        assert [number for number in marks if number + 1 not in fences] == [], page.path


def test_a_snippet_that_fails_is_seen(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AssertionError, match="no-such-case"):
        run("asperity solve no-such-case.toml", None, capsys)
    with pytest.raises(AssertionError, match="mark what is no command"):
        run("make test", None, capsys)


def test_a_line_that_nothing_printed_is_seen():
    said = "Full film: 0 %.\nReport: mine.html\n"
    assert unsaid("Full film: ...\nReport: mine.html", said) == []
    assert unsaid("Full ...\nMixed ...", said) == ["Mixed ..."]
    assert unsaid("film: 0 %.", said) == ["film: 0 %."]


def test_readme_is_run_by_its_own_tests_or_says_why_not():
    page = read(ROOT / "README.md")
    marked = [block for block in page.blocks if block.language in RUN and reason(page, block)]
    own = list(snippets(page))
    assert len(own) == 2, [
        block.text for block in own
    ]  # the first commands and the Python, see test_readme
    assert marked
