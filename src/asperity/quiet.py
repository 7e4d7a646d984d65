"""Libraries that read files: kept silent, and what they complain of in a line."""

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from typing import Any

LONGEST = 100  # characters of a complaint


@contextmanager
def quietly() -> Iterator[list[str]]:
    """Drop what libraries print or log: the terminal belongs to the caller. What they warn users of is in the list."""
    notes: list[str] = []
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()), warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("ignore")
            warnings.simplefilter("always", UserWarning)
            yield notes
        notes.extend(f"the reader warns: {first_line(warning.message)}" for warning in caught)
    finally:
        logging.disable(before)


def first_line(reason: Any) -> str:
    """The first line of what a library complains about, short enough for a sentence."""
    text = next((line.strip() for line in str(reason).splitlines() if line.strip()), type(reason).__name__)
    printable = "".join(c for c in text if c.isprintable()).rstrip(".;")
    return printable if len(printable) <= LONGEST else printable[: LONGEST - 3] + "..."
