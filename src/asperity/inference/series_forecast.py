"""A series that is tracked or watched, foretold by its rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
    """A forecast of a series so far; `forecast` is None where there is none, for a `reason`."""

    forecast: Forecast | None
    reason: str = ""

    @property
    def bands(self) -> Bands | None:
        """The limit's quantity over the series and ahead."""
        return None if self.forecast is None else self.forecast.bands

    @property
    def alarm(self) -> bool:
        """Whether a change is told and the limit is near, or past."""
        return self.forecast is not None and self.forecast.alarm

    def sentence(self) -> str:
        """In words."""
        return f"No forecast: {self.reason}." if self.forecast is None else self.forecast.sentence()

    def scalars(self) -> dict[str, Any]:
        """As JSON has it: only its sentence where there is none."""
        return {"sentence": self.sentence()} if self.forecast is None else self.forecast.scalars()


@dataclass(frozen=True)
class SeriesForecaster:
    """Foretells a series by its rows, as `asperity track --json` and a store have them.

    Parameters
    ----------
    setting, emulator, limit, worn, seed : as `forecast_series` takes them

    Raises
    ------
    BadInput
        for a limit that cannot be crossed, or a wear history that says nothing of it.
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
        """By which an answer that is kept is known again."""
        worn = (
            "" if self.worn is None else f", {self.worn.hours:g} h of wear from {self.worn.folder}"
        )
        # of which there are more when extended
        emulator = f"{self.emulator.folder}, {self.emulator.points} contacts"
        return f"{self.limit.key}={self.limit.value:g} by {emulator}, seed {self.seed}{worn}"

    def __call__(
        self, rows: Sequence[Mapping[str, Any]], x_name: str, *, comparable: bool
    ) -> SeriesForecast:
        """When the limit is crossed; why that is not told, where it cannot be."""
        heard = observations_from_rows(rows, self.setting.case, comparable=comparable)
        try:
            return SeriesForecast(
                forecast_series(
                    self.setting,
                    self.emulator,
                    heard,
                    self.limit,
                    worn=self.worn,
                    seed=self.seed,
                    x_name=x_name,
                )
            )
        except AsperityError as error:
            return SeriesForecast(None, str(error).rstrip("."))
