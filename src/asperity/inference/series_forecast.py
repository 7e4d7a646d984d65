"""Forecast of a tracked or watched series from its rows."""

from collections.abc import Sequence
from dataclasses import dataclass

from asperity.core.documents import JsonObject, Table
from asperity.core.errors import AsperityError
from asperity.inference.emulator import Emulator
from asperity.inference.forecast import Forecast, Limit, require_limit
from asperity.inference.infer import forecast_series
from asperity.inference.recording_input import observations_from_rows
from asperity.inference.settings import Setting
from asperity.monitoring import Bands
from asperity.simulation import WearHistory


@dataclass(frozen=True, slots=True)
class SeriesForecast:
    """The forecast of a series, or None with the `reason`."""

    forecast: Forecast | None
    reason: str = ""

    @property
    def bands(self) -> Bands | None:
        """The limit's quantity over the series and in the forecast."""
        return None if self.forecast is None else self.forecast.bands

    @property
    def alarm(self) -> bool:
        """True if a change is detected and the limit is, or probably will be, crossed."""
        return self.forecast is not None and self.forecast.alarm

    def sentence(self) -> str:
        """Return the forecast as a sentence."""
        return f"No forecast: {self.reason}." if self.forecast is None else self.forecast.sentence()

    def scalars(self) -> JsonObject:
        """Return the JSON output; only a sentence without a forecast."""
        return {"sentence": self.sentence()} if self.forecast is None else self.forecast.scalars()


@dataclass(frozen=True)
class SeriesForecaster:
    """Forecasts a series from rows as in `asperity track --json` and a store.

    Parameters
    ----------
    setting, emulator, limit, worn, seed : see `forecast_series`

    Raises
    ------
    BadInput
        for a limit that cannot be crossed, or that a wear history does not apply to.
    """

    setting: Setting
    emulator: Emulator
    limit: Limit
    worn: WearHistory | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        require_limit(self.setting, self.limit, worn=self.worn is not None)

    @property
    def question(self) -> str:
        """Text that identifies the forecast, to recognise a stored one."""
        wear_text = (
            "" if self.worn is None else f", {self.worn.hours:g} h of wear from {self.worn.folder}"
        )
        # the number of contacts changes when the emulator is extended
        emulator = f"{self.emulator.folder}, {self.emulator.points} contacts"
        return f"{self.limit.key}={self.limit.value:g} by {emulator}, seed {self.seed}{wear_text}"

    def __call__(self, rows: Sequence[Table], x_name: str, *, comparable: bool) -> SeriesForecast:
        """Return the forecast, or the reason why there is none."""
        series = observations_from_rows(rows, self.setting.case, comparable=comparable)
        try:
            return SeriesForecast(
                forecast_series(
                    self.setting,
                    self.emulator,
                    series,
                    self.limit,
                    worn=self.worn,
                    seed=self.seed,
                    x_name=x_name,
                )
            )
        except AsperityError as error:
            return SeriesForecast(None, str(error).rstrip("."))
