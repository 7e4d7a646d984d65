"""Values that may not be available, with the reason."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from asperity.core.errors import AsperityError

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Determined(Generic[T]):
    """Value, or None with the `reason` why it is not available (empty if it was not requested)."""

    value: T | None
    reason: str = ""

    @classmethod
    def attempt(
        cls, compute: Callable[[], T], *, reraise: tuple[type[AsperityError], ...] = ()
    ) -> "Determined[T]":
        """Return the computed value; errors other than those to `reraise` become the reason."""
        try:
            return cls(compute())
        except reraise:
            raise
        except AsperityError as error:
            return cls(None, str(error))
