"""`asperity infer`: posterior of a contact from recordings, and the next operating point."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from asperity import inference, report, simulation
from asperity import surface as surfaces
from asperity.cli.app import app
from asperity.cli.forecast import contacts_solved, emulated, require_forecast
from asperity.cli.monitored.series import EXIT_CODES
from asperity.cli.options import (
    AsJson,
    Band,
    Channel,
    EmulatorFolder,
    Figures,
    ForecastLimit,
    Method,
    OpenPage,
    Overrides,
    Page,
    Quiet,
    Rate,
    Scale,
    Seed,
    Shaft,
    StandingRoughness,
    SurfaceFile,
    Unit,
    Workers,
    Worn,
    chosen_case,
)
from asperity.cli.output import Block, columns, named_path, progress, show, table, written
from asperity.cli.terminal.browser import open_page, require_page
from asperity.core import processes
from asperity.core.coverage import PERCENT
from asperity.core.errors import BadInput, require_choice
from asperity.core.quantities import NO_VALUE, quantity

if TYPE_CHECKING:
    from asperity.inference import (
        Emulator,
        Forecast,
        Inference,
        Limit,
        ObservedSeries,
        Sampler,
        Setting,
    )
    from asperity.resonance import SeriesMethod
    from asperity.simulation import WearHistory


PathsArgument = Annotated[
    list[Path] | None,
    typer.Argument(metavar="FILE", help="Recordings, or folders of recordings."),
]
CaseFileOption = Annotated[
    Path | None,
    typer.Option(
        "--case", metavar="CASE.toml", help="Case of the contact, with priors in [infer]."
    ),
]
TableFileOption = Annotated[
    Path | None,
    typer.Option(
        "--table",
        metavar="CSV",
        help="Table with columns file, load_n, entrainment_m_s, temperature_degc.",
    ),
]
CapacitanceOption = Annotated[
    Path | None,
    typer.Option(
        metavar="CSV",
        help="Measured capacitances: load_n, entrainment_m_s, capacitance_f, capacitance_std_f.",
    ),
]
ExtendOption = Annotated[
    int,
    typer.Option(
        metavar="N",
        min=0,
        help="Refine the emulator with up to N contacts inside the posterior.",
    ),
]
SamplerOption = Annotated[
    str, typer.Option(help="Sampler: importance, or nested (dynesty; takes minutes).")
]
DesignOption = Annotated[
    float | None,
    typer.Option(
        metavar="CLR", help="Find changes that keep CLR below this value; needs no recordings."
    ),
]


@app.command()
def infer(
    paths: PathsArgument = None,
    case_file: CaseFileOption = None,
    overrides: Overrides = None,
    snapshot: StandingRoughness = False,
    surface: SurfaceFile = None,
    table_file: TableFileOption = None,
    capacitance: CapacitanceOption = None,
    emulator: EmulatorFolder = None,
    extend: ExtendOption = 0,
    sampler: SamplerOption = "importance",
    forecast: ForecastLimit = None,
    worn: Worn = None,
    design: DesignOption = None,
    seed: Seed = 0,
    rate: Rate = None,
    unit: Unit = None,
    channel: Channel = None,
    scale: Scale = None,
    band: Band = None,
    shaft: Shaft = None,
    method: Method = None,
    workers: Workers = None,
    page: Page = None,
    figures: Figures = None,
    opened: OpenPage = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Infer the state of a contact from recordings, with intervals."""
    case_file = _required(
        case_file,
        paths or capacitance,
        sampler,
        forecast,
        worn,
        design,
    )
    setting, surface_notes = _setting(case_file, overrides, surface, snapshot=snapshot)
    limit = _limit(forecast, setting, worn)
    require_page(page, requested=opened)
    source = _source(table_file, band, rate, unit, channel, scale, shaft, method)
    count = workers or processes.cores()
    observations = _observe(paths, setting, source, count, quiet=quiet)
    initial = emulated(setting, emulator, count, quiet=quiet)
    forecaster = partial(_forecast, setting, observations, *limit, seed)
    ahead = forecaster(initial)
    latest = _latest(observations, ahead, surface_notes, capacitance)
    result = _infer(setting, initial, latest, sampler, seed, extend, count, quiet=quiet)
    if extend:
        ahead = forecaster(result.emulator)
    _show(result, ahead, design, (page, figures), opened=opened, as_json=as_json, quiet=quiet)


def _infer(
    setting: "Setting",
    emulator: "Emulator",
    observations: "ObservedSeries",
    sampler: str,
    seed: int,
    extend: int,
    workers: int,
    *,
    quiet: bool,
) -> "Inference":
    """Infer the state, and again after `extend` contacts were added where the posterior lies."""
    by = cast("Sampler", sampler)
    result = inference.infer_series(setting, emulator, observations, sampler=by, seed=seed)
    with contacts_solved(quiet=quiet) as step:
        return inference.refine_emulator(result, extend, sampler=by, workers=workers, progress=step)


def _limit(
    forecast: str | None, setting: "Setting", worn: Path | None
) -> tuple["Limit | None", "WearHistory | None"]:
    """Return the limit whose crossing is forecast, and the wear simulation that is its prior.

    Either is None if it is not given.
    """
    if forecast is None:
        return None, None
    limit = inference.read_limit(forecast, setting)
    inference.require_limit(setting, limit, worn=worn is not None)
    return limit, None if worn is None else simulation.load_wear(worn)


def _source(
    table: Path | None,
    band: tuple[float, float] | None,
    rate: float | None,
    unit: str | None,
    channel: str | None,
    scale: float | None,
    shaft: list[float] | None,
    method: str | None,
) -> "inference.RecordingInput":
    """Return how the recordings are read, from the options."""
    return inference.RecordingInput(
        table=table,
        band_hz=band,
        rate_hz=rate,
        unit=unit,
        channel=channel,
        scale=scale,
        shaft_hz=shaft or None,
        method=cast("SeriesMethod | None", method),
    )


def _observe(
    paths: list[Path] | None,
    setting: "Setting",
    source: "inference.RecordingInput",
    workers: int,
    *,
    quiet: bool,
) -> "ObservedSeries":
    """Return the resonances in the recordings, if any."""
    if not paths:
        return inference.ObservedSeries()
    with progress("recordings", "reading recordings ...", quiet=quiet):
        return inference.observe_recordings(paths, setting, source=source, workers=workers)


def _required(
    case_file: Path | None,
    measured: list[Path] | Path | None,
    sampler: str,
    forecast: str | None,
    worn: Path | None,
    design: float | None,
) -> Path:
    """Check that the requested options go together; return the case file."""
    if case_file is None:
        raise BadInput("asperity infer needs a case; state --case CASE.toml")
    require_forecast(forecast, worn=worn)
    if not measured and (design is None or forecast is not None):
        raise BadInput(
            "asperity infer needs recordings; name files, their folder, or --capacitance"
        )
    require_choice("--sampler", sampler, inference.SAMPLERS)
    if design is not None:
        inference.require_share("--design", design)
    return case_file


def _latest(
    observations: "ObservedSeries",
    ahead: "Forecast | None",
    notes: tuple[str, ...],
    capacitance: Path | None,
) -> "ObservedSeries":
    """Return the last tenth of a series whose contact changes, otherwise all of it, with notes.

    Measured capacitances are added.
    """
    changes = ahead is not None and ahead.change_detected
    latest = inference.latest_observations(observations) if changes else observations
    measured = () if capacitance is None else inference.read_capacitances(capacitance)
    return replace(
        latest,
        observations=(*latest.observations, *measured),
        notes=(*latest.notes, *notes),
    )


def _forecast(
    setting: "Setting",
    observations: "ObservedSeries",
    limit: "Limit | None",
    history: "WearHistory | None",
    seed: int,
    emulator: "Emulator",
) -> "Forecast | None":
    """Forecast when the limit is crossed; None without a limit."""
    if limit is None:
        return None
    return inference.forecast_series(
        setting, emulator, observations, limit, worn=history, seed=seed
    )


def _setting(
    path: Path, overrides: list[str] | None, surface: Path | None, *, snapshot: bool
) -> tuple["Setting", tuple[str, ...]]:
    """Return the setting, with Sq as measured on a surface if one is given, and a note on it."""
    setting = inference.inference_setting(chosen_case(path, overrides, snapshot=snapshot))
    if surface is None:
        return setting, ()
    setting, note = inference.with_measured_surface(setting, surfaces.read_surface(surface))
    return setting, (note,)


def _show(
    result: "Inference",
    ahead: "Forecast | None",
    design: float | None,
    outputs: tuple[Path | None, Path | None],
    *,
    opened: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Print verdicts and tables, or all as JSON; exit with the alarm's code if there is one."""
    page, figures = outputs
    designed = None
    if design is not None:
        designed = inference.design_contact(result.forward, result.draws.z, clr=design)
    if figures is not None:
        report.write_exhibits(report.inference_exhibits(result, ahead, designed), figures)
    if page is not None:
        report.write_inference_report(result, page, forecast=ahead, design=designed)
    verdicts = [outcome.sentence() for outcome in (ahead, designed) if outcome is not None]
    extras = {
        "forecast": None if ahead is None else ahead.scalars(),
        "design": None if designed is None else designed.scalars(),
        "report": None if page is None else str(page),
        **named_path("figures", figures),
    }
    blocks = (
        _posterior(result),
        _points(result),
        _models(result),
        _notes(result),
        written("Report", page),
        written("Figures", figures),
    )
    show(
        [*verdicts, result.verdict()],
        lambda: result.scalars() | extras,
        *blocks,
        as_json=as_json,
        quiet=quiet,
    )
    open_page(page, requested=opened)
    if ahead is not None and ahead.alarm:
        raise typer.Exit(EXIT_CODES["alarm"])


def _posterior(result: "Inference") -> Block:
    """Return a row per quantity: median, interval with and without the law's error, information."""
    exact = result.posterior(discrepancy=False)
    bits = quantity("information_bits")
    rows = []
    for key, estimate in result.posterior().items():
        entry = quantity(key)
        rows.append(
            [
                entry.title,
                entry.number(estimate.median),
                entry.interval(estimate.low, estimate.high),
                entry.interval(exact[key].low, exact[key].high),
                bits.number(estimate.information_bits) if estimate.learnt else NO_VALUE,
            ]
        )
    point = result.forward.points[0]
    speed = quantity("entrainment_speed_m_s").text(point.entrainment_m_s)
    yield from columns(
        [
            f"at {quantity('load_n').text(point.load_n)}, {speed}",
            "median",
            PERCENT,
            f"{PERCENT}, laws exact",
            "bits",
        ],
        rows,
        left=1,
    )
    if any(row[-1] == NO_VALUE for row in rows):
        yield f"  {NO_VALUE}: as assumed; the recordings give less than half a bit"


def _points(result: "Inference") -> Block:
    """Return a row per recorded operating point."""
    rows = [point.cells() for point in result.point_estimates()]
    if rows:
        yield from columns(result.point_estimates()[0].HEADS, rows)


def _notes(result: "Inference") -> Block:
    """Return warnings, assumptions and the emulator's accuracy."""
    return table([], (*result.warnings(), *result.notes, result.emulator.sentence()))


def _models(result: "Inference") -> Block:
    """Return a row per model: law, with or without its error, evidence and probability."""
    rows = [
        [
            model.law,
            "with its error" if model.discrepancy else "exact",
            quantity("log_evidence").number(model.log_evidence, model.log_evidence_std),
            quantity("model_probability").text(model.probability),
        ]
        for model in result.models
    ]
    yield from columns(["law of the spring", "", "ln evidence", "probability"], rows, left=2)
