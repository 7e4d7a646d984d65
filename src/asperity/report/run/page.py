"""One HTML page from solved runs: what was found, how, how well, and what the model leaves out."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from asperity.core.errors import BadInput
from asperity.core.quantities import quantity, select
from asperity.ehl import Convergence
from asperity.lubricant import Newtonian
from asperity.report.base import Exhibit, Picture, Tile, render, span, tile, write_page
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


def write_report(runs: Sequence[Run], path: str | Path, *, title: str | None = None) -> Path:
    """Write one self-contained HTML page about one or several runs, whole or not at all.

    Parameters
    ----------
    runs : at least one; several are put side by side and drawn against their roughness
    path : the file to write; its folder must exist
    title : heading of the page; without it, the page says what it shows

    Returns
    -------
    Path
        The file written. The same runs and asperity version give the same bytes.

    Raises
    ------
    BadInput
        for no runs, or a path that cannot be written to.
    """
    if not runs:
        raise BadInput("a report needs at least one run, got none; name the run files to show")
    return write_page(path, lambda: render_page(runs, title=title))


def render_page(runs: Sequence[Run], *, title: str | None = None) -> str:
    """The page as HTML text."""
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
        numbers=[entry for group in groups for entry in select(group)],
        conditions=conditions_table(runs),
        lubricated=any(oil is not None for oil in oils),
        newtonian=any(oil is not None and isinstance(oil.rheology, Newtonian) for oil in oils),
        alone=any(run.error.surfaces == 1 and run.state.sq > 0.0 for run in runs),
        isothermal=any(run.solution.lubricant and not run.case.thermal.feedback for run in runs),
        sphere=any(
            run.case.vibration and run.case.vibration.stiffness_law.point_spring for run in runs
        ),
        line=any(run.solution.conditions.long for run in runs),
        ends=ends,
        imbalance=span(
            quantity("mass_flux_imbalance"), [run.state.mass_flux_imbalance for run in runs]
        ),
    )


def _title(runs: Sequence[Run]) -> str:
    several_runs = f": {len(runs)} runs" if len(runs) > 1 else ""
    return f"Rough lubricated contact{several_runs}, Sq {span(quantity('sq_m'), [run.state.sq for run in runs])}"


class _RunView(NamedTuple):
    """What the template shows of one run."""

    label: str
    anchor: str
    run: Run
    scalars: dict[str, float | int | bool | None]
    convergence: Convergence
    tiles: list[Tile]
    pictures: list[Picture]
    doubts: list[tuple[str, str]]
    notes: list[str]


def _view(run: Run, number: int, several_runs: bool) -> _RunView:
    scalars, rough = run.scalars(), quantity("sq_m").named(run.state.sq)
    return _RunView(
        label=f"{number}. {rough}" if several_runs else rough,
        anchor=f"run-{number}",
        run=run,
        scalars=scalars,
        convergence=run.solution.convergence,
        tiles=[tile(quantity(key), scalars) for key in TILES],
        pictures=[exhibit.picture() for exhibit in _exhibits(run)],
        doubts=uncertainty_rows(run.error),
        notes=[*run.remarks, *_missing_exhibits(run)],
    )


def _exhibits(run: Run) -> Iterator[Exhibit]:
    """What is shown of a run, in the order of the page."""
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
    """Why a figure is not there."""
    if run.friction_failure is not None:
        yield f"There is no friction and no temperature to show: {run.friction_failure}."
    elif run.solution.conditions.sliding_speed == 0.0:
        yield "There is no friction to show: both surfaces move at the same speed."
    if run.vibration is not None and run.own_resonance_failure is not None:
        yield f"There is no stiffness and damping of the contact's own: {run.own_resonance_failure}."
    if run.vibration is not None and run.vibration.spectrum is None:
        yield f"There is no spectrum to show: {run.vibration.resonance.reason}."


def _overview(runs: Sequence[Run]) -> Iterator[Exhibit]:
    """Several runs against their roughness."""
    points = [run.scalars() for run in runs]
    full_load = {run.vibration.full_load_crf_hz for run in runs if run.vibration is not None}
    yield several_runs.shares_against_roughness(points)
    yield several_runs.resonance_against_roughness(
        points, full_load.pop() if len(full_load) == 1 else None
    )
    sliding = [point for point in points if point["friction_coefficient"]]
    if sliding:
        yield several_runs.friction_against_roughness(sliding)
