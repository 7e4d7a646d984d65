"""`asperity infer`: what recordings say of a contact, and what to run next."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from asperity import inference, report, simulation
from asperity import surface as surfaces
from asperity.cli import options
from asperity.cli.app import app
from asperity.cli.forecast import contacts_solved, emulated, require_forecast
from asperity.cli.options import AsJson, Overrides, Page, Quiet, chosen_case, require_output
from asperity.cli.output import Block, columns, progress, show, table, written
from asperity.cli.recordings import EXIT_CODES
from asperity.core import processes
from asperity.core.errors import BadInput, require_choice
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.inference import (
        Design,
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


@app.command()
def infer(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[FILE...]", help="Recordings, or folders of them."),
    ] = None,
    case_file: Annotated[
        Path | None,
        typer.Option(
            "--case", metavar="CASE.toml", help="The contact; its [infer] says what is not known."
        ),
    ] = None,
    overrides: Overrides = None,
    surface: options.SurfaceFile = None,
    table_file: Annotated[
        Path | None,
        typer.Option(
            "--table",
            metavar="CSV",
            help="Columns file, load_n, entrainment_m_s, temperature_degc.",
        ),
    ] = None,
    emulator: options.EmulatorFolder = None,
    extend: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, help="Solve up to N further points where the posterior is; kept."
        ),
    ] = 0,
    sampler: Annotated[
        str, typer.Option(help="importance, or nested (dynesty), which takes minutes.")
    ] = "importance",
    forecast: options.ForecastLimit = None,
    worn: options.Worn = None,
    design: Annotated[
        float | None,
        typer.Option(
            metavar="CLR", help="What keeps the load share below it, such as 0.3; alone, too."
        ),
    ] = None,
    seed: options.SampleSeed = 0,
    rate: options.Rate = None,
    unit: options.Unit = None,
    channel: options.Channel = None,
    scale: options.Scale = None,
    band: options.Band = None,
    shaft: options.Shaft = None,
    method: options.Method = None,
    workers: options.Workers = None,
    page: Page = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say what recordings tell of a contact, with intervals, what they cannot tell, and what to run next."""
    case_file = _required(
        case_file, paths, sampler=sampler, forecast=forecast, worn=worn, design=design
    )
    setting, known = _setting(case_file, overrides, surface)
    limit = None if forecast is None else inference.read_limit(forecast, setting)
    if limit is not None:
        inference.require_limit(setting, limit, worn=worn is not None)
    history = None if worn is None else simulation.load_wear(worn)
    require_output(page, ".html", option="--report")
    count, heard = workers or processes.cores(), inference.ObservedSeries()
    if paths:
        with progress("recordings", "reading recordings ...", quiet=quiet):
            heard = inference.observe_recordings(
                paths,
                setting,
                source=inference.RecordingInput(
                    table=table_file,
                    band_hz=band,
                    rate_hz=rate,
                    unit=unit,
                    channel=channel,
                    scale=scale,
                    shaft_hz=shaft or None,
                    method=cast("SeriesMethod | None", method),
                ),
                workers=count,
            )
    answering = emulated(setting, emulator, count, quiet=quiet)
    ahead = _forecast(setting, answering, heard, limit, history, seed)
    latest = (
        inference.latest_observations(heard)
        if ahead is not None and ahead.change_detected
        else heard
    )
    now = replace(latest, notes=(*latest.notes, *known))
    by = cast("Sampler", sampler)
    found = inference.infer_series(setting, answering, now, sampler=by, seed=seed)
    with contacts_solved(quiet=quiet) as step:
        found = inference.refine_emulator(found, extend, sampler=by, workers=count, progress=step)
    if found.emulator is not answering:
        ahead = _forecast(setting, found.emulator, heard, limit, history, seed)
    kept = (
        None
        if design is None
        else inference.design_contact(found.forward, found.draws.z, clr=design)
    )
    if page is not None:
        report.write_inference_report(found, page, forecast=ahead, design=kept)
    _show(found, ahead, kept, page, as_json=as_json, quiet=quiet)


def _required(
    case_file: Path | None,
    paths: list[Path] | None,
    *,
    sampler: str,
    forecast: str | None,
    worn: Path | None,
    design: float | None,
) -> Path:
    """The contact's file, where everything else that was asked for goes with it."""
    if case_file is None:
        raise BadInput("asperity infer needs the contact; give --case CASE.toml")
    require_forecast(forecast, worn=worn)
    if not paths and (design is None or forecast is not None):
        raise BadInput("asperity infer needs recordings; name files, or their folder")
    require_choice("--sampler", sampler, inference.SAMPLERS)
    if design is not None:
        inference.require_share("--design", design)
    return case_file


def _forecast(
    setting: "Setting",
    emulator: "Emulator",
    heard: "ObservedSeries",
    limit: "Limit | None",
    history: "WearHistory | None",
    seed: int,
) -> "Forecast | None":
    """When the limit is crossed; None where nobody asked."""
    if limit is None:
        return None
    return inference.forecast_series(setting, emulator, heard, limit, worn=history, seed=seed)


def _setting(
    path: Path, overrides: list[str] | None, surface: Path | None
) -> tuple["Setting", tuple[str, ...]]:
    """What is to be inferred, Sq as a surface was measured where one is given, and a note of that."""
    setting = inference.inference_setting(chosen_case(path, overrides))
    if surface is None:
        return setting, ()
    setting, said = inference.with_measured_surface(setting, surfaces.read_surface(surface))
    return setting, (said,)


def _show(
    found: "Inference",
    ahead: "Forecast | None",
    kept: "Design | None",
    page: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """The verdict, first that of what was asked, and the tables; or all as JSON. An alarm decides the exit code."""
    asked = [one.sentence() for one in (ahead, kept) if one is not None]
    told = {
        "forecast": None if ahead is None else ahead.scalars(),
        "design": None if kept is None else kept.scalars(),
        "report": None if page is None else str(page),
    }
    blocks = (_told(found), _points(found), _models(found), _notes(found), written("report", page))
    show(
        [*asked, found.verdict()],
        lambda: found.scalars() | told,
        *blocks,
        as_json=as_json,
        quiet=quiet,
    )
    if ahead is not None and ahead.alarm:
        raise typer.Exit(EXIT_CODES["alarm"])


def _told(found: "Inference") -> Block:
    """A row a quantity: median, interval with and without the law's error, bits learned."""
    exact, rows = found.posterior(discrepancy=False), []
    for key, one in found.posterior().items():
        entry = quantity(key)
        rows.append(
            [
                entry.title,
                entry.number(one.median),
                entry.interval(one.low, one.high),
                entry.interval(exact[key].low, exact[key].high),
                quantity("information_bits").number(one.information_bits),
                "" if one.learnt else "as assumed",
            ]
        )
    point = found.forward.points[0]
    place = f"at {quantity('load_n').text(point.load_n)}, {quantity('entrainment_speed_m_s').text(point.entrainment_m_s)}"
    yield from columns([place, "median", "90 %", "90 %, laws exact", "bits", ""], rows, left=1)


def _points(found: "Inference") -> Block:
    """A row an operating point that was recorded."""
    rows = [one.cells() for one in found.point_estimates()]
    if rows:
        yield from columns(found.point_estimates()[0].HEADS, rows)


def _notes(found: "Inference") -> Block:
    """What makes intervals doubtful, what was taken for granted, how good the emulator is."""
    return table([], (*found.warnings(), *found.notes, found.emulator.sentence()))


def _models(found: "Inference") -> Block:
    """A row a model: law, with or without its error, evidence and probability."""
    rows = [
        [
            model.law,
            "with its error" if model.discrepancy else "exact",
            quantity("log_evidence").number(model.log_evidence, model.log_evidence_std),
            quantity("model_probability").text(model.probability),
        ]
        for model in found.models
    ]
    yield from columns(["law of the spring", "", "ln evidence", "probability"], rows, left=2)
