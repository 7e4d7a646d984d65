"""`asperity wear`: a case let wear for hours; goes on where it was stopped."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, report, simulation
from asperity import surface as surfaces
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    LateralUnit,
    OutFolder,
    Overrides,
    Page,
    Quiet,
    SurfaceFile,
    Unit,
    Workers,
    chosen_case,
    require_output,
)
from asperity.cli.output import Block, columns, progress, show, span, table, written
from asperity.core.errors import BadInput
from asperity.core.processes import cores
from asperity.core.quantities import quantity
from asperity.wear import fit_wear_coefficient, read_friction_trace

if TYPE_CHECKING:
    from asperity.simulation import WearHistory, WearProgress
    from asperity.surface import MeasuredSurface
    from asperity.wear import WearFit

STARTS = "the start; after installation the first solve compiles the solver, up to a minute ..."
CONTACT = (
    "sq_m",
    "ssk",
    "spk_m",
    "svk_m",
    "clr",
    "car",
    "h_mean_m",
    "friction_coefficient",
    "flash_temperature_max_k",
    "crf_hz",
    "crfa",
)
OF_BODIES = (
    "overrollings",
    "worn_depth_m",
    "worn_depth_max_m",
    "worn_volume_m3",
    "sq_m",
    "spk_m",
    "svk_m",
)


@app.command()
def wear(
    path: Annotated[
        Path | None,
        typer.Argument(metavar="[CASE.toml]", help="A case; its [wear] says how it wears."),
    ] = None,
    hours: Annotated[float | None, typer.Option(metavar="H", help="Hours of running.")] = None,
    surface: SurfaceFile = None,
    overrides: Overrides = None,
    out: OutFolder = None,
    workers: Workers = None,
    page: Page = None,
    fit: Annotated[
        Path | None,
        typer.Option(
            metavar="TRACE", help="In place of a case: k from a test's friction record ..."
        ),
    ] = None,
    scar: Annotated[
        Path | None, typer.Option(metavar="PROFILE", help="... and a profile across its track.")
    ] = None,
    unit: Unit = None,
    lateral_unit: LateralUnit = None,
    load: Annotated[
        str | None, typer.Option(metavar="FORCE", help="Of the test, if its record has it not.")
    ] = None,
    track_radius: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Of the test, if its record has it not.")
    ] = None,
    second_load: Annotated[
        str | None, typer.Option(metavar="FORCE", help="Of a second test, to predict.")
    ] = None,
    second_distance: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Of a second test, to predict.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Let the contact wear: surfaces, load sharing, film and resonance over hours. Or fit k to a test, with --fit."""
    if fit is not None or scar is not None:
        if fit is None or scar is None or path is not None or hours is not None:
            raise BadInput(
                "--fit TRACE and --scar PROFILE go together, without a case or --hours; give those two"
            )
        amounts = {
            "load": _stated("--load", "N", load),
            "track_radius": _stated("--track-radius", "m", track_radius),
            "second_load": _stated("--second-load", "N", second_load),
            "second_distance": _stated("--second-distance", "m", second_distance),
        }
        fitted = _fit(
            fit, surfaces.read_surface(scar, unit=unit, lateral_unit=lateral_unit), **amounts
        )
        show(fitted.verdict(), fitted.scalars, _fitted(fitted), as_json=as_json, quiet=quiet)
        return
    if path is None or hours is None:
        raise BadInput(
            "asperity wear takes a case and --hours, or --fit TRACE and --scar PROFILE; give either pair"
        )
    require_output(page, ".html", option="--report")
    chosen = chosen_case(path, overrides, surface)
    with progress(path.name, STARTS, quiet=quiet) as display:

        def jump(taken: "WearProgress") -> None:
            row = taken.row
            told = ", ".join(quantity(key).named(row[key]) for key in ("sq_m", "clr"))
            display(
                f"{taken.hours:.4g} of {taken.of_hours:.4g} h, {told}",
                round(1000.0 * taken.hours / taken.of_hours),
                1000,
            )

        worn = simulation.run_wear(
            chosen, hours=hours, out=out, workers=workers or cores(), progress=jump
        )
    if page is not None:
        report.write_wear_report(worn, page)
    show(
        worn.verdict(),
        lambda: {**worn.scalars(), "report": None if page is None else str(page)},
        _contact(worn),
        _bodies(worn),
        table([], worn.notes),
        written("kept in", worn.folder),
        written("report", page),
        as_json=as_json,
        quiet=quiet,
    )


def _stated(option: str, unit: str, text: str | None) -> float | None:
    return None if text is None else case.read_amount(option, unit, text)


def _fit(
    record: Path,
    profile: "MeasuredSurface",
    *,
    load: float | None,
    track_radius: float | None,
    second_load: float | None,
    second_distance: float | None,
) -> "WearFit":
    trace = read_friction_trace(record, load=load, track_radius=track_radius)
    return fit_wear_coefficient(
        trace, profile, second_load=second_load, second_distance=second_distance
    )


def _fitted(fitted: "WearFit") -> Block:
    """What was read from a test, and what follows."""
    trace, scar = fitted.trace, fitted.scar
    estimates = {
        "wear_coefficient": fitted.k,
        "energy_wear_coefficient": fitted.energy_coefficient,
        "scar_volume_m3": fitted.volume,
        "second_volume_m3": fitted.second_volume,
    }
    rows = [
        (
            quantity(key).title,
            f"{quantity(key).number(one.median)}, {span(key, (one.low, one.high))}",
        )
        for key, one in estimates.items()
    ]
    bounds = quantity("wear_coefficient")
    rows += [
        ("k if what is piled up is foreign", bounds.text(fitted.k_all_lost)),
        (
            "k if it is the disc's own",
            bounds.text(fitted.k_none_lost) if fitted.k_none_lost else "0, nothing is lost",
        ),
        ("load, way, laps", f"{trace.load:.4g} N, {trace.distance:.4g} m, {trace.laps:.4g}"),
        (
            "track",
            f"radius {surfaces.length_text(trace.track_radius)}, width {surfaces.length_text(scar.width)}",
        ),
        ("missing, piled up", f"{scar.missing * 1e12:.3g}, {scar.piled * 1e12:.3g} µm²"),
        (
            quantity("friction_coefficient").title,
            quantity("friction_coefficient").text(trace.coefficient),
        ),
    ]
    yield from table(rows, fitted.notes)


def _contact(worn: "WearHistory") -> Block:
    """Both surfaces together, and the contact, at first and at the end."""
    first, last = worn.table.iloc[0], worn.final_values
    rows = [
        (
            quantity(key).title,
            quantity(key).number(first[key]),
            quantity(key).number_in(last),
            quantity(key).display,
        )
        for key in CONTACT
    ]
    return columns(["", "new", f"after {worn.hours:.4g} h", ""], rows, left=1)


def _bodies(worn: "WearHistory") -> Block:
    """What each body has come to."""
    last = worn.table.iloc[-1]
    rows = []
    for key in OF_BODIES:
        entry = quantity(key)
        ends = [entry.number(last[simulation.body_column(key, body)]) for body in (0, 1)]
        rows.append((entry.title, *ends, entry.display))
    return columns(["", "body 1", "body 2", ""], rows, left=1)
