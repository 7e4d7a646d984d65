"""Third-party file readers: suppressed output, and their errors and warnings as one line."""

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from types import ModuleType

MAX_LENGTH = 100  # characters of an error message
_CONTROL_CHARACTERS = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")


@contextmanager
def suppress_output() -> Iterator[list[str]]:
    """Suppress printed and logged output of libraries; yield a list that receives user warnings."""
    notes: list[str] = []
    disabled_level = logging.root.manager.disable
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
        logging.disable(disabled_level)


def first_line(reason: object) -> str:
    """Return the first line of an error message, at most `MAX_LENGTH` characters long."""
    text = next(
        (line.strip() for line in str(reason).splitlines() if line.strip()), type(reason).__name__
    )
    clean = "".join(c for c in text if c.isprintable()).rstrip(".;")
    return clean if len(clean) <= MAX_LENGTH else clean[: MAX_LENGTH - 3] + "..."


def printable(text: str) -> str:
    """Replace terminal control characters, as names of files and channels are untrusted."""
    return _CONTROL_CHARACTERS.sub("?", text)


def surface_topography() -> ModuleType:
    """Import SurfaceTopography without its warning about missing MPI."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ImportWarning)
        import SurfaceTopography
    module: ModuleType = SurfaceTopography
    return module
