"""The errors asperity raises on purpose: each carries one sentence that names the thing, the value and the remedy."""

from collections.abc import Collection
from typing import Any


class AsperityError(Exception):
    """Base of every error that asperity raises on purpose."""


class BadInput(AsperityError, ValueError):
    """Something given is not usable; the message names it, its value and the remedy."""


class UnreadableFile(BadInput):
    """A file is missing, damaged or not what its name says."""


class NotConverged(AsperityError):
    """A solver stopped before its tolerance; `solution` is the unfinished state."""

    def __init__(self, solution: Any, message: str) -> None:
        super().__init__(message)
        self.solution = solution


def articled(noun: str) -> str:
    """A noun with its indefinite article."""
    return f"{'an' if noun[:1] in 'aeiou' else 'a'} {noun}"


def require_positive(name: str, value: float, unit: str = "") -> float:
    """Return `value`, or say which quantity has to be positive and finite."""
    if not 0.0 < value < float("inf"):
        raise BadInput(
            f"{name} must be positive and finite, got {value:g} {unit}".rstrip()
            + "; correct its sign or value"
        )
    return value


def require_choice(name: str, value: str, known: Collection[str]) -> None:
    """Say which names are known, unless `value` is one of them."""
    if value not in known:
        raise BadInput(f"{name} must be one of {', '.join(known)}, got {value!r}")
