"""Forecast of a series: its protocols, and the schedule of forecasts of a watch.

The forecasting method is given by the caller; a forecast may raise the alarm. A watch spends a
limited share of its time on forecasts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from time import monotonic
from typing import Protocol

from asperity.core.arrays import Field
from asperity.core.documents import JsonObject, Table

MAX_TIME_SHARE = 0.1  # of a watch's time
FORECAST = "forecast"  # `raised_by` of an alarm


@dataclass(frozen=True)
class Bands:
    """A quantity over a series and its forecast, in SI units.

    Parameters
    ----------
    key, limit : quantity, and the limit that it should not cross
    x, last : visits and later times; the last visit
    ends : interval with the median in between, shape (3, times): at each visit as known then,
        and of the forecast
    """

    key: str
    limit: float
    x: Field
    last: float
    ends: Field


class ForecastResult(Protocol):
    """A forecast, or the reason why there is none; `alarm` calls for action."""

    @property
    def bands(self) -> Bands | None:
        """Data of the figure; None without a forecast."""

    @property
    def alarm(self) -> bool:
        """True if action is required."""

    def sentence(self) -> str:
        """Return the forecast as a sentence."""

    def scalars(self) -> JsonObject:
        """Return the forecast as in JSON."""


class Forecaster(Protocol):
    """Forecaster of a series from its rows, as in `asperity track --json`."""

    @property
    def question(self) -> str:
        """Text that identifies the forecast; a forecast of another question is made again."""

    def __call__(self, rows: Sequence[Table], x_name: str, *, comparable: bool) -> ForecastResult:
        """Forecast a series; `comparable` if the amplitudes of its lines can be compared."""


@dataclass
class ForecastSchedule:
    """Schedule of the forecasts of a watched series.

    `last` is the last forecast, made after the recording `acknowledged`; `due_s` the next time.
    """

    forecaster: Forecaster | None
    last: ForecastResult | None = None
    acknowledged: str | None = None
    due_s: float = -inf

    @property
    def question(self) -> dict[str, str]:
        """Part of a judgement's question; empty without a forecaster."""
        return {} if self.forecaster is None else {FORECAST: self.forecaster.question}

    @property
    def due(self) -> bool:
        """True if a forecast may be made now."""
        return self.forecaster is not None and monotonic() >= self.due_s

    def standing(self, acknowledged: str | None) -> ForecastResult | None:
        """Return the last forecast, unless alarms have been acknowledged since."""
        return self.last if self.acknowledged == acknowledged else None

    def make(
        self,
        rows: Sequence[Table],
        x_name: str,
        *,
        comparable: bool,
        acknowledged: str | None,
    ) -> ForecastResult:
        """Make a forecast and schedule the next one."""
        assert self.forecaster is not None
        start = monotonic()
        self.last, self.acknowledged = (
            self.forecaster(rows, x_name, comparable=comparable),
            acknowledged,
        )
        self.due_s = start + (monotonic() - start) / MAX_TIME_SHARE
        return self.last
