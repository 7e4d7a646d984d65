"""Errors that asperity raises on purpose.

Each message is one sentence with the quantity, its value and the remedy.
"""

from collections.abc import Collection
from typing import Any

MAX_SHOWN = 80  # characters of a key or value in a message


class AsperityError(Exception):
    """Base class of all errors that asperity raises on purpose."""


class BadInput(AsperityError, ValueError):
    """An unusable input; the message names it, its value and the remedy."""


class UnreadableFile(BadInput):
    """A file that is missing, damaged or of another type than its name states."""


class NotConverged(AsperityError):
    """A solver that stopped above its tolerance; `solution` is the last iterate."""

    def __init__(self, solution: Any, message: str) -> None:
        super().__init__(message)
        self.solution = solution


def install_text(extra: str) -> str:
    """Return how an extra is installed.

    Examples
    --------
    >>> from asperity.core.errors import install_text
    >>> install_text("page")
    "pip install 'asperity[page]', in a clone pip install '.[page]'"
    """
    return f"pip install 'asperity[{extra}]', in a clone pip install '.[{extra}]'"


def with_article(noun: str) -> str:
    """Return the noun with its indefinite article.

    Examples
    --------
    >>> from asperity.core.errors import with_article
    >>> with_article("oil"), with_article("lubricant")
    ('an oil', 'a lubricant')
    """
    return f"{'an' if noun[:1] in 'aeiou' else 'a'} {noun}"


def shortened(text: str, longest: int = MAX_SHOWN) -> str:
    """Return a text as messages show it, cut after a number of characters.

    Examples
    --------
    >>> from asperity.core.errors import shortened
    >>> shortened("contact", 4)
    'cont... (7 characters)'
    """
    return text if len(text) <= longest else f"{text[:longest]}... ({len(text)} characters)"


def require_positive(name: str, value: float, unit: str = "") -> float:
    """Return `value`; raise BadInput unless it is positive and finite.

    Examples
    --------
    >>> from asperity.core.errors import require_positive
    >>> require_positive("load", 20.0, "N")
    20.0
    """
    if not 0.0 < value < float("inf"):
        raise BadInput(
            f"{name} must be positive and finite, got {value:g} {unit}".rstrip()
            + "; correct its sign or value"
        )
    return value


def require_choice(name: str, value: str, known: Collection[str]) -> None:
    """Raise BadInput, with the known names, unless `value` is one of them."""
    if value not in known:
        raise BadInput(f"{name} must be one of {', '.join(known)}, got {value!r}")
