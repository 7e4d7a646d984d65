"""Failures that last: each cause is stated once when it begins, and once when it has ended."""

from dataclasses import dataclass, field
from time import monotonic

from asperity.core.errors import AsperityError
from asperity.core.third_party import first_line

MAX_DELAY_S = 60.0  # longest delay between attempts [s]


@dataclass
class Troubles:
    """Active failures by cause, and sentences on them that have not been shown yet."""

    active: dict[str, str] = field(default_factory=dict)
    sentences: list[str] = field(default_factory=list)

    def begin(self, cause: str, sentence: str) -> None:
        """State a failure, unless its cause is active already."""
        if cause not in self.active:
            self.sentences.append(sentence)
        self.active[cause] = sentence

    def end(self, cause: str, sentence: str = "") -> None:
        """State that a cause has ended, if it was active."""
        if self.active.pop(cause, None) is not None and sentence:
            self.sentences.append(sentence)

    def take(self) -> tuple[str, ...]:
        """Return the sentences that have not been shown yet."""
        taken, self.sentences = (*self.sentences,), []
        return taken


@dataclass
class RetryDelay:
    """Delay between attempts, doubled at each failure from `first_s` to `MAX_DELAY_S`."""

    first_s: float
    failures: int = 0
    next_s: float = 0.0

    @property
    def waiting(self) -> bool:
        """True before the next attempt is due."""
        return self.failures > 0 and monotonic() < self.next_s

    def record(self, *, failed: bool) -> None:
        """Record the outcome of an attempt."""
        self.failures = self.failures + 1 if failed else 0
        delay_s = min(self.first_s * 2.0 ** min(self.failures, 30), MAX_DELAY_S)
        self.next_s = monotonic() + delay_s


def failure_reason(error: Exception) -> str:
    """Return why something failed, without the remedy."""
    if isinstance(error, AsperityError):
        return str(error).partition("; ")[0].rstrip(".")
    return f"{type(error).__name__}: {first_line(error)}".rstrip(".")
