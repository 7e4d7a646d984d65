"""Libraries that read files: kept silent, and what they complain of in a line."""

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from typing import Any

LONGEST = 100  # characters of a complaint
_STEERING = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


@contextmanager
def quietly() -> Iterator[list[str]]:
    """Drop what libraries print or log: the terminal belongs to the caller. What they warn users of is in the list."""
    notes: list[str] = []
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with (
            redirect_stdout(StringIO()),
            redirect_stderr(StringIO()),
            warnings.catch_warnings(record=True) as caught,
        ):
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", UserWarning)
            yield notes
        notes.extend(f"the reader warns: {first_line(warning.message)}" for warning in caught)
    finally:
        logging.disable(before)


def first_line(reason: Any) -> str:
    """The first line of what a library complains about, short enough for a sentence."""
    text = next(
        (line.strip() for line in str(reason).splitlines() if line.strip()), type(reason).__name__
    )
    shown = "".join(c for c in text if c.isprintable()).rstrip(".;")
    return shown if len(shown) <= LONGEST else shown[: LONGEST - 3] + "..."


def printable(text: str) -> str:
    """A line without what steers a terminal: names of files and channels are other people's."""
    return _STEERING.sub("?", text)
