"""Sentence length on the documentation pages, counted without names and formulas."""

import re
from collections.abc import Iterator

import pytest

from support.pages import SPAN, Page, pages
from support.source import ROOT

MAX_WORDS = 40  # words
KEYS = "`--json`"  # a list of keys is not a sentence
NOT_PROSE = re.compile(
    r"#|\||:::|<|\$\$|\([^)]*\)=$"
)  # headings, tables and directives are not prose
ITEM = re.compile(r"^(?:[-*]|\d+\.)\s+")
END = re.compile(r"(?<=[.!?])[\"')*\]]*\s+(?=[^a-z])|(?<=[.!?][*\")])\s+")


def paragraphs(page: Page) -> Iterator[tuple[int, str]]:
    """Paragraphs with the number of their first line."""
    number, parts, previous = 0, [], 0
    for line in page.prose:
        text = line.text.strip()
        excluded = not text or NOT_PROSE.match(text)
        if parts and (excluded or ITEM.match(text) or line.number != previous + 1):
            yield number, " ".join(parts)
            parts = []
        if not excluded:
            number, parts = (
                (number if parts else line.number),
                [*parts, ITEM.sub("", text, count=1)],
            )
        previous = line.number
    if parts:
        yield number, " ".join(parts)


def sentences(text: str) -> list[str]:
    text = re.sub(
        r"\]\([^)]*\)", "]", SPAN.sub(lambda span: span[0] if span[0] == KEYS else "`", text)
    )
    return END.split(re.sub(r"\$[^$]*\$", "$", text))


def words(sentence: str) -> int:
    return sum(bool(re.search(r"[^\W\d_]", word)) for word in sentence.split())


def long_sentences(page: Page) -> list[str]:
    return [
        f"{number}: {words(sentence)} words: {sentence}"
        for number, text in paragraphs(page)
        for sentence in sentences(text)
        if KEYS not in sentence and words(sentence) > MAX_WORDS
    ]


PAGES = pytest.mark.parametrize(
    "page", pages(), ids=lambda page: page.path.relative_to(ROOT).as_posix()
)


@PAGES
def test_no_sentence_is_long(page):
    wrong = long_sentences(page)
    assert not wrong, f"{page.path.relative_to(ROOT).as_posix()}: " + "\n".join(wrong)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        (f"{'word ' * 41}.", 1),
        (f"{'word ' * 40}.", 0),
        (f"{'word ' * 30}. {'Word ' * 30}.", 0),
        (f"{'word ' * 30}; {'word ' * 30}.", 1),
        (f"{'word ' * 30}\n{'word ' * 30}", 1),
        (f"- {'word ' * 30}\n- {'word ' * 30}", 0),
        (f"{'`name` ' * 60}", 0),
        (f"{'word ' * 30}\n\n{'word ' * 30}", 0),
        (f"{'word ' * 30}\n```sh\nls\n```\n{'word ' * 30}", 0),
    ],
)
def test_only_words_of_sentences_are_counted(text, count):
    assert len(long_sentences(Page(ROOT / "page.md", text))) == count
