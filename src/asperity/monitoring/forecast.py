"""What is foretold of a series: who foretells it is asked with its rows, and may raise the alarm.

What it is foretold by is left to others; a watch gives it a share of its time and goes on judging
meanwhile.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from time import monotonic
from typing import Any, Protocol

from asperity.core.arrays import Field

SHARE = 0.1  # of a watch's time, which forecasts may take
FORECAST = "forecast"  # raises the alarm


@dataclass(frozen=True)
class Bands:
    """A quantity over a series and ahead of it, SI.

    Parameters
    ----------
    key, limit : which quantity, and what it is not to cross
    x, last : of the visits and of times behind them; the last visit's
    ends : ends of 90 % with the median between them, (3, times): as each visit was known then, and what is foretold
    """

    key: str
    limit: float
    x: Field
    last: float
    ends: Field


class Foretold(Protocol):
    """A forecast, or why there is none; `alarm` is whether somebody is to act on it."""

    @property
    def bands(self) -> Bands | None:
        """What can be drawn of it; None where there is no forecast."""

    @property
    def alarm(self) -> bool:
        """Whether somebody is to act on it."""

    def sentence(self) -> str:
        """In words."""

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""


class Foreteller(Protocol):
    """Who foretells a series by its rows, as `asperity track --json` has them; `question` is what is asked."""

    @property
    def question(self) -> str:
        """What is asked: another question is answered anew."""

    def __call__(
        self, rows: Sequence[Mapping[str, Any]], x_name: str, *, comparable: bool
    ) -> Foretold:
        """The forecast of a series; `comparable` is whether the heights of its lines can be compared."""


@dataclass
class Ahead:
    """Forecasts of one watched series: the last one, up to where somebody had looked, and when the next is due [s]."""

    foreteller: Foreteller | None
    last: Foretold | None = None
    acknowledged: str | None = None
    due_s: float = -inf

    @property
    def asked(self) -> dict[str, str]:
        """What is asked beside the judgement; empty where nothing is."""
        return {} if self.foreteller is None else {FORECAST: self.foreteller.question}

    @property
    def due(self) -> bool:
        """Whether a forecast may be made now."""
        return self.foreteller is not None and monotonic() >= self.due_s

    def standing(self, acknowledged: str | None) -> Foretold | None:
        """The last forecast, unless somebody has looked since."""
        return self.last if self.acknowledged == acknowledged else None

    def make(
        self,
        rows: Sequence[Mapping[str, Any]],
        x_name: str,
        *,
        comparable: bool,
        acknowledged: str | None,
    ) -> Foretold:
        """A forecast of the series as it is; the next one is due when this one has taken no more than its share."""
        assert self.foreteller is not None
        began = monotonic()
        self.last, self.acknowledged = (
            self.foreteller(rows, x_name, comparable=comparable),
            acknowledged,
        )
        self.due_s = began + (monotonic() - began) / SHARE
        return self.last
