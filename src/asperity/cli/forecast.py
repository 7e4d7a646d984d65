"""Forecaster of a series for `track` and `watch`, and its emulator."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from asperity import case, inference, simulation
from asperity.cli.options import contact_at
from asperity.cli.output import progress
from asperity.core.errors import BadInput

if TYPE_CHECKING:
    from asperity.inference import Emulator, SeriesForecaster, Setting
    from asperity.study import StudyProgress

EMULATING = "solving contacts for the emulator; once per case ..."


def require_forecast(forecast: str | None, **only_with: object) -> None:
    """Raise BadInput for options that need `--forecast`."""
    reasons = {"worn": "is the prior for the drift of Sq", "emulator": "is used for forecasts"}
    for name, value in only_with.items():
        if value is not None and forecast is None:
            raise BadInput(f"--{name} {reasons[name]}; add --forecast")


def series_forecaster(
    forecast: str | None,
    case_file: Path | None,
    worn: Path | None,
    emulator: Path | None,
    *,
    workers: int,
    quiet: bool,
) -> "SeriesForecaster | None":
    """Build the forecaster of a tracked or watched series; None without `--forecast`."""
    require_forecast(forecast, worn=worn, emulator=emulator)
    if forecast is None:
        return None
    contact = contact_at(case_file)
    if not isinstance(contact, case.Case):
        raise BadInput("--forecast needs a contact; give --case CASE.toml of a single contact")
    setting = inference.inference_setting(contact)
    limit = inference.read_limit(forecast, setting)
    inference.require_limit(setting, limit, worn=worn is not None)
    history = None if worn is None else simulation.load_wear(worn)
    return inference.SeriesForecaster(
        setting, emulated(setting, emulator, workers, quiet=quiet), limit, history
    )


def emulated(setting: "Setting", folder: Path | None, workers: int, *, quiet: bool) -> "Emulator":
    """Build or load the emulator, with progress on a terminal."""
    with contacts_solved(quiet=quiet) as step:
        return inference.build_emulator(setting, folder=folder, workers=workers, progress=step)


@contextmanager
def contacts_solved(*, quiet: bool) -> "Iterator[Callable[[StudyProgress], None]]":
    """Show the count of an emulator's contacts on a terminal as they are solved."""
    with progress("emulator", EMULATING, quiet=quiet) as display:

        def step(state: "StudyProgress") -> None:
            remaining_s = state.seconds_left
            remaining = "" if remaining_s is None else f", {remaining_s:.0f} s left"
            display(
                f"{state.kept + state.done} of {state.total} contacts{remaining}",
                state.kept + state.done,
                state.total,
            )

        yield step
