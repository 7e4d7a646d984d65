"""HTML report of solved runs: results, conditions, uncertainties and limits of the model."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from asperity.core.documents import Table
from asperity.core.errors import BadInput
from asperity.core.quantities import mark_rolling, quantity, select
from asperity.ehl import Convergence
from asperity.lubricant import Newtonian
from asperity.report.base import (
    Exhibit,
    Picture,
    Tile,
    range_text,
    render,
    tile,
    write_exhibits,
    write_page,
)
from asperity.report.oil_balance import DRY, model_name, oil_limit
from asperity.report.run import contact, friction_maps, roller, several_runs
from asperity.report.run.conditions import conditions_table
from asperity.report.run.stiffness import stiffness_over_frequency
from asperity.report.run.vibration import spectrum
from asperity.results import ENDS, RUN_GROUPS, Run, uncertainty_rows

TILES = (
    "clr",
    "car",
    "h_mean_m",
    "lambda_ratio",
    "friction_coefficient",
    "flash_temperature_max_k",
    "crf_hz",
    "crfa",
    "contact_damping_ratio",
)

SHOWN, SHOWN_OF_SEVERAL = 4, 2  # pictures of a run before the fold


def write_report(
    runs: Sequence[Run],
    path: str | Path,
    *,
    title: str | None = None,
    figures: str | Path | None = None,
) -> Path:
    """Write a self-contained HTML report of one or several runs, atomically.

    Parameters
    ----------
    runs : at least one; several are compared and drawn over their roughness
    path : file to write; its folder must exist
    title : heading of the page (default: the contact and its roughness)
    figures : folder for each figure as PDF (85 and 175 mm wide) and `captions.md`

    Returns
    -------
    Path
        File written. The same runs and asperity version give the same bytes.

    Raises
    ------
    BadInput
        if there are no runs, or the path is not writable.
    """
    if not runs:
        raise BadInput("a report needs at least one run, got none; name the run files to show")
    page = write_page(path, lambda: render_page(runs, title=title))
    if figures is not None:
        write_exhibits(report_exhibits(runs), figures)
    return page


def report_exhibits(runs: Sequence[Run]) -> Iterator[Exhibit]:
    """Yield all exhibits of a report; the names of several runs start with the run's number."""
    if len(runs) == 1:
        yield from run_exhibits(runs[0])
        return
    if len({run.state.sq for run in runs}) > 1:
        yield from _overview(runs)
    for number, run in enumerate(runs, 1):
        for exhibit in run_exhibits(run):
            yield replace(exhibit, name=f"run-{number}-{exhibit.name}")


def render_page(runs: Sequence[Run], *, title: str | None = None) -> str:
    """Render the page as HTML text."""
    oils = [run.solution.lubricant for run in runs]
    ends = any(run.axial is not None for run in runs)
    groups = [
        name
        for group in RUN_GROUPS
        for name in ([group, ENDS] if ends and group == "pressure" else [group])
    ]
    return render(
        "run/page.html.j2",
        title=title or _title(runs),
        runs=[_view(run, number, len(runs) > 1) for number, run in enumerate(runs, 1)],
        overview=[exhibit.picture() for exhibit in _overview(runs)]
        if len({run.state.sq for run in runs}) > 1
        else [],
        headline=[quantity(key) for key in TILES],
        numbers=[entry for group in groups for entry in select(group)],
        conditions=conditions_table(runs),
        snapshot=any(run.is_snapshot for run in runs),
        moment=_moment(runs),
        newtonian=any(oil is not None and isinstance(oil.rheology, Newtonian) for oil in oils),
        alone=_has_one_surface(runs),
        isothermal=_is_isothermal(runs),
        cold_inlet=_has_cold_inlet(runs),
        sphere=any(
            run.case.vibration and run.case.vibration.stiffness_law.point_spring for run in runs
        ),
        line=any(run.solution.conditions.long for run in runs),
        ends=ends,
        oil_limits=_oil_limits(runs),
    )


def _alpha_notes(run: Run) -> list[str]:
    """Return the effect of an estimated pressure-viscosity coefficient as a note."""
    return [] if run.alpha_effect is None else [run.alpha_effect.note(run.scalars())]


def _has_cold_inlet(runs: Sequence[Run]) -> bool:
    """Return True if a lubricated contact is computed without inlet shear heating."""
    return any(run.solution.lubricant and run.card.inlet_heating is None for run in runs)


def _is_isothermal(runs: Sequence[Run]) -> bool:
    """Return True if a lubricated contact is computed without thermal feedback."""
    return any(run.solution.lubricant and not run.case.thermal.feedback for run in runs)


def _moment(runs: Sequence[Run]) -> str | None:
    """Return the moment of running contacts that maps show; None without running contacts."""
    if all(run.running is None for run in runs):
        return None
    solved = all(run.snapshot_clr is not None for run in runs)
    return "the snapshot from which it starts" if solved else "its last moment"


def _has_one_surface(runs: Sequence[Run]) -> bool:
    """Return True if scatter over surfaces is missing in the intervals of a run."""
    return any(
        run.error.surfaces == 1 and run.state.sq > 0.0 and run.running is None for run in runs
    )


def _oil_limits(runs: Sequence[Run]) -> list[tuple[str, str]]:
    """Return the limits set by the oil balance of each contact model among the runs."""
    imbalances: dict[str, list[float]] = {}
    for run in runs:
        imbalances.setdefault(model_name(run.solution), []).append(run.state.mass_flux_imbalance)
    if len(imbalances) > 1:
        imbalances.pop(DRY, None)
    entry = quantity("mass_flux_imbalance")
    return [oil_limit(model, range_text(entry, values)) for model, values in imbalances.items()]


def _title(runs: Sequence[Run]) -> str:
    kind = "dry" if all(run.solution.lubricant is None for run in runs) else "lubricated"
    count = f": {len(runs)} runs" if len(runs) > 1 else ""
    sq = range_text(quantity("sq_m"), [run.state.sq for run in runs])
    return f"Rough {kind} contact{count}, Sq {sq}"


class _RunView(NamedTuple):
    """Values of one run for the template."""

    label: str
    anchor: str
    run: Run
    scalars: Table
    convergence: Convergence
    tiles: list[Tile]
    pictures: list[Picture]
    more_pictures: list[Picture]
    uncertainties: list[tuple[str, str]]
    notes: list[str]


def _view(run: Run, number: int, numbered: bool) -> _RunView:
    rolling = run.solution.conditions.sliding_speed == 0.0
    scalars = mark_rolling(run.scalars(), rolling=rolling)
    shown = SHOWN_OF_SEVERAL if numbered else SHOWN
    pictures = [exhibit.picture() for exhibit in run_exhibits(run)]
    roughness = quantity("sq_m").named(run.state.sq)
    return _RunView(
        label=f"{number}. {roughness}" if numbered else roughness,
        anchor=f"run-{number}",
        run=run,
        scalars=scalars,
        convergence=run.solution.convergence,
        tiles=[tile(quantity(key), scalars) for key in TILES],
        pictures=pictures[:shown],
        more_pictures=pictures[shown:],
        uncertainties=uncertainty_rows(run.error, run.friction_interval),
        notes=[*run.remarks, *_alpha_notes(run), *_missing_exhibits(run)],
    )


def run_exhibits(run: Run) -> Iterator[Exhibit]:
    """Yield the exhibits of a run in the order of the page."""
    yield contact.contact_map(run)
    yield contact.film_map(run)
    yield contact.pressure_map(run)
    yield contact.centre_line(run)
    if run.axial is not None:
        yield roller.along_length(run, run.axial)
    yield contact.roughness_map(run)
    yield contact.height_distribution(run)
    friction, heat = run.friction, run.heat
    if friction is not None and heat is not None and run.solution.conditions.sliding_speed != 0.0:
        yield friction_maps.traction_map(run, friction)
        yield friction_maps.temperature_map(run, friction, heat)
        yield friction_maps.temperature_line(run, heat)
    yield friction_maps.stress_map(run)
    yield friction_maps.stress_section(run)
    yield friction_maps.stress_over_depth(run)
    if run.vibration is not None and run.vibration.spectrum is not None:
        yield spectrum(run.vibration, run.resonance_text())
    if run.dynamic_curve is not None:
        yield stiffness_over_frequency(run)
    yield contact.convergence_history(run)


def _missing_exhibits(run: Run) -> Iterator[str]:
    """Yield the reason for each figure that is missing."""
    if run.friction_failure is not None:
        yield f"No friction and temperature figures: {run.friction_failure}."
    elif run.solution.conditions.sliding_speed == 0.0:
        yield "No friction figures: both surfaces move at the same speed."
    if run.vibration is not None and run.own_resonance_failure is not None:
        yield f"No dynamic stiffness and damping: {run.own_resonance_failure}."
    if run.vibration is not None and run.vibration.spectrum is None:
        yield f"No spectrum: {run.vibration.resonance.reason}."


def _overview(runs: Sequence[Run]) -> Iterator[Exhibit]:
    """Yield the exhibits of several runs over roughness."""
    points = [run.scalars() for run in runs]
    full_load = {run.vibration.full_load_crf_hz for run in runs if run.vibration is not None}
    yield several_runs.shares_against_roughness(points)
    yield several_runs.resonance_against_roughness(
        points, full_load.pop() if len(full_load) == 1 else None
    )
    sliding = [point for point in points if point["friction_coefficient"]]
    if sliding:
        yield several_runs.friction_against_roughness(sliding)
