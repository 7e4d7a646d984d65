"""`asperity wear`: simulate wear over hours, resumable; or fit a wear coefficient to a test."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from asperity import case, report, simulation
from asperity import surface as surfaces
from asperity import wear as wear_laws
from asperity.cli.app import app
from asperity.cli.options import (
    AsJson,
    LateralUnit,
    OpenPage,
    OutFolder,
    Overrides,
    Page,
    Quiet,
    StandingRoughness,
    SurfaceFile,
    Unit,
    Workers,
    chosen_case,
)
from asperity.cli.output import Block, columns, progress, show, span, table, written
from asperity.cli.terminal.browser import open_page, require_page
from asperity.core.errors import BadInput
from asperity.core.processes import cores
from asperity.core.quantities import mark_rolling, quantity

if TYPE_CHECKING:
    from asperity.case import Case
    from asperity.simulation import LiftOffChange, SpeedShare, WearHistory, WearProgress
    from asperity.surface import MeasuredSurface
    from asperity.wear import WearFit

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
    "capacitance_f",
)
BODY_COLUMNS = (
    "overrollings",
    "worn_depth_m",
    "worn_depth_max_m",
    "worn_volume_m3",
    "sq_m",
    "spk_m",
    "svk_m",
)


PathArgument = Annotated[
    Path | None,
    typer.Argument(metavar="CASE.toml", help="Case, with [wear] for how it wears."),
]
LiftOffOption = Annotated[
    bool,
    typer.Option(
        "--lift-off", help="Also find the speed at which the asperities lift off, before and after."
    ),
]
HoursOption = Annotated[float | None, typer.Option(metavar="H", help="Hours of running.")]
FitOption = Annotated[
    Path | None,
    typer.Option(metavar="TRACE", help="Fit k to a test, instead of a case: its friction record."),
]
ScarOption = Annotated[
    Path | None, typer.Option(metavar="PROFILE", help="With --fit: a profile across the track.")
]
LoadOption = Annotated[
    str | None,
    typer.Option(metavar="FORCE", help="Load of the test, if its record does not state it."),
]
TrackRadiusOption = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH", help="Track radius of the test, if its record does not state it."
    ),
]
SecondLoadOption = Annotated[
    str | None, typer.Option(metavar="FORCE", help="Load of a second test to predict.")
]
SecondDistanceOption = Annotated[
    str | None, typer.Option(metavar="LENGTH", help="Sliding distance of a second test.")
]


@app.command()
def wear(
    path: PathArgument = None,
    hours: HoursOption = None,
    surface: SurfaceFile = None,
    overrides: Overrides = None,
    snapshot: StandingRoughness = False,
    lift_off: LiftOffOption = False,
    out: OutFolder = None,
    workers: Workers = None,
    page: Page = None,
    opened: OpenPage = False,
    fit: FitOption = None,
    scar: ScarOption = None,
    unit: Unit = None,
    lateral_unit: LateralUnit = None,
    load: LoadOption = None,
    track_radius: TrackRadiusOption = None,
    second_load: SecondLoadOption = None,
    second_distance: SecondDistanceOption = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Simulate wear over hours, or fit a wear coefficient to a test."""
    if fit is not None or scar is not None:
        if fit is None or scar is None or path or hours or lift_off:
            raise BadInput(
                "--fit TRACE and --scar PROFILE go together, without a case, --hours or "
                "--lift-off; state only these two"
            )
        amounts = {
            "load": _amount("--load", "N", load),
            "track_radius": _amount("--track-radius", "m", track_radius),
            "second_load": _amount("--second-load", "N", second_load),
            "second_distance": _amount("--second-distance", "m", second_distance),
        }
        fitted = _fit(
            fit, surfaces.read_surface(scar, unit=unit, lateral_unit=lateral_unit), **amounts
        )
        show(fitted.verdict(), fitted.scalars, _fitted(fitted), as_json=as_json, quiet=quiet)
        return
    if path is None or hours is None:
        raise BadInput(
            "asperity wear needs a case and --hours, or --fit TRACE and --scar PROFILE; state "
            "either pair"
        )
    require_page(page, requested=opened)
    chosen = chosen_case(path, overrides, surface, snapshot=snapshot)
    history = _simulate(chosen, path.name, hours, out, workers or cores(), quiet=quiet)
    change = _lift_off(history, path.name, quiet=quiet) if lift_off else None
    if page is not None:
        report.write_wear_report(history, page, lift_off=change)
    _show(history, change, page, as_json=as_json, quiet=quiet)
    open_page(page, requested=opened)


def _show(
    history: "WearHistory",
    change: "LiftOffChange | None",
    page: Path | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    verdicts = [history.verdict(), *([] if change is None else [change.verdict()])]
    show(
        verdicts,
        lambda: {
            **history.scalars(),
            **({} if change is None else change.scalars()),
            "verdict": " ".join(verdicts),
            "report": None if page is None else str(page),
        },
        _contact(history, change),
        _bodies(history),
        table([], history.notes),
        []
        if history.folder is None
        else [f"Saved in {history.folder}; the same command resumes it"],
        written("Report", page),
        as_json=as_json,
        quiet=quiet,
    )


def _simulate(
    chosen: "Case", label: str, hours: float, out: Path | None, workers: int, *, quiet: bool
) -> "WearHistory":
    with progress(label, "the start ...", quiet=quiet, compiles=True) as display:

        def jump(state: "WearProgress") -> None:
            row = state.row
            values = ", ".join(quantity(key).named(row[key]) for key in ("sq_m", "clr"))
            display(
                f"{state.hours:.4g} of {state.of_hours:.4g} h, {values}",
                round(1000.0 * state.hours / state.of_hours),
                1000,
            )

        return simulation.run_wear(chosen, hours=hours, out=out, workers=workers, progress=jump)


def _lift_off(history: "WearHistory", label: str, *, quiet: bool) -> "LiftOffChange":
    with progress(label, "lift-off speed ...", quiet=quiet) as display:

        def solved(speed: float, share: "SpeedShare") -> None:
            display(
                f"lift-off speed: {quantity('clr').named(share.clr)} at "
                f"{quantity('entrainment_speed_m_s').text(speed)}"
            )

        return history.lift_off(solved)


def _amount(option: str, unit: str, text: str | None) -> float | None:
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
    trace = wear_laws.read_friction_trace(record, load=load, track_radius=track_radius)
    return wear_laws.fit_wear_coefficient(
        trace, profile, second_load=second_load, second_distance=second_distance
    )


def _fitted(fitted: "WearFit") -> Block:
    """Return the rows of a fit."""
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
            f"{quantity(key).number(estimate.median)}, {span(key, (estimate.low, estimate.high))}",
        )
        for key, estimate in estimates.items()
    ]
    bounds = quantity("wear_coefficient")
    rows += [
        ("k if piled-up material is foreign", bounds.text(fitted.k_all_lost)),
        (
            "k if it is the disc's own",
            bounds.text(fitted.k_none_lost) if fitted.k_none_lost else "0, no loss",
        ),
        ("load, distance, laps", f"{trace.load:.4g} N, {trace.distance:.4g} m, {trace.laps:.4g}"),
        (
            "track",
            f"radius {surfaces.length_text(trace.track_radius)}, "
            f"width {surfaces.length_text(scar.width)}",
        ),
        ("missing, piled up", f"{scar.missing * 1e12:.3g}, {scar.piled * 1e12:.3g} µm²"),
        (
            quantity("friction_coefficient").title,
            quantity("friction_coefficient").text(trace.coefficient),
        ),
    ]
    yield from table(rows, fitted.notes)


def _contact(history: "WearHistory", change: "LiftOffChange | None") -> Block:
    """Return the initial and final values of the composite surface and the contact."""
    rolling = history.case.conditions.sliding_speed == 0.0
    first, last = (mark_rolling(history.printed_row(row), rolling=rolling) for row in (0, -1))
    rows = [
        (entry.title, entry.number(first[entry.key]), entry.text_in(last))
        for entry in map(quantity, CONTACT)
    ]
    if change is not None:
        entry = quantity("lift_off_speed_m_s")
        rows.append((entry.title, entry.number(change.before.speed), change.after.text))
    return columns(["", "new", f"after {history.hours:.4g} h"], rows, left=1)


def _bodies(history: "WearHistory") -> Block:
    """Return the final values of each body."""
    last = history.table.iloc[-1]
    rows = []
    for key in BODY_COLUMNS:
        entry = quantity(key)
        values = [entry.number(last[simulation.body_column(key, body)]) for body in (0, 1)]
        rows.append((entry.title, *values, entry.display))
    return columns(["", "body 1", "body 2", ""], rows, left=1)
