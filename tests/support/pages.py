"""The documentation read as markdown: code spans, fenced blocks, headings, tables and links with
their positions.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from support.source import ROOT

SPAN = re.compile(r"(?<!`)`([^`]+)`(?!`)")
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


class Line(NamedTuple):
    number: int
    headings: tuple[str, ...]  # headings above the line, the outermost first
    text: str


class Span(NamedTuple):
    """A code span between backticks."""

    line: Line
    text: str


class Block(NamedTuple):
    """A fenced block."""

    line: Line
    language: str
    text: str


@dataclass(frozen=True)
class Page:
    path: Path
    text: str

    @cached_property
    def _read(self) -> tuple[list[Line], list[Block]]:
        prose, blocks, headings, fence = [], [], (), None
        for number, text in enumerate(self.text.splitlines(), 1):
            line = Line(number, headings, text)
            if text.startswith("```"):
                if fence is None:
                    fence = Block(line, text.strip("`"), "")
                else:
                    blocks.append(fence)
                    fence = None
            elif fence is not None:
                fence = fence._replace(text=f"{fence.text}{text}\n")
            else:
                if mark := re.match(r"(#+) (.*)", text):
                    headings = (*headings[: len(mark[1]) - 1], mark[2])
                prose.append(line)
        assert fence is None, f"{self.path}: a fence is not closed"
        return prose, blocks

    @property
    def prose(self) -> list[Line]:
        return self._read[0]

    @property
    def blocks(self) -> list[Block]:
        return self._read[1]

    def spans(self) -> Iterator[Span]:
        for line in self.prose:
            yield from (Span(line, text.replace(r"\|", "|")) for text in SPAN.findall(line.text))

    def links(self) -> Iterator[tuple[Line, str]]:
        for line in self.prose:
            yield from ((line, target) for target in LINK.findall(SPAN.sub("", line.text)))

    def rows(self) -> Iterator[tuple[Line, list[str]]]:
        """Yield the cells of every table row."""
        for line in self.prose:
            if line.text.startswith("|") and not line.text.startswith("|---"):
                yield line, [cell.strip() for cell in re.split(r"(?<!\\)\|", line.text)[1:-1]]

    def anchors(self) -> set[str]:
        """Return the link targets of this page: headings in lower case with hyphens for spaces."""
        headings = (mark[1] for line in self.prose if (mark := re.match(r"#+ (.*)", line.text)))
        return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def read(path: Path) -> Page:
    return Page(path, path.read_text("utf-8"))


def pages() -> list[Page]:
    """Return the pages for users and contributors, without the changelog, which names removed
    items.
    """
    return [
        read(path)
        for path in (
            *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY")),
            *sorted(ROOT.glob("docs/**/*.md")),
        )
    ]
