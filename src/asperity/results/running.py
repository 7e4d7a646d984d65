"""Running contact of a case: numbers as means over time, with the snapshot beside them."""

import json
import math
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields, replace
from functools import partial
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.contact.conditions import ContactConditions
from asperity.core.processes import cores, set_up_worker
from asperity.core.quantities import Quantity, lines, read
from asperity.coupling import Vibration, VibrationModel
from asperity.ehl import (
    ContactError,
    ContactSolution,
    ContactState,
    Iteration,
    Uncertainty,
    half_as_many,
    least_film,
)
from asperity.results.derived import Derived
from asperity.results.determined import Determined
from asperity.results.surface_spread import Row, Scalar, crf_error
from asperity.solution import Friction, friction, inlet_viscosity_factor
from asperity.surface import MovingSurfaces
from asperity.transient import (
    PASSAGES,
    Series,
    Snapshot,
    TimeMean,
    run_track,
    settled_from,
    time_means,
)

MOMENTS = 4  # at which heat and stress are evaluated
EVERY_STEP = ("load", "film", "pressure", "friction")  # groups of the catalogue: at every step
AT_MOMENTS = ("sharing", "heat", "stress", "observables")  # ... at some
WITHOUT = ("_error", "_error_m")  # keys of error bars, which the grids determine
MOST_TRACK_LENGTHS = 16  # of a generated track, in lengths of the domain
MAX_FAILED = 0.02  # share of the time steps that may miss the tolerance
_FROM_START = (
    "Maps, distributions and the contact's own resonance are those of the snapshot from which the "
    "running contact starts, with its roughness standing still."
)
_FROM_END = (
    "The contact with standing roughness did not converge, so that the running contact starts from "
    "an approximation. Maps and distributions are those of its last moment; the contact's own "
    "resonance is not determined."
)
ERRORS = {"clr": "clr_error", "car": "car_error", "h_min_m": "h_min_error_m"} | {
    "h_central_m": "h_central_error_m"
}


@dataclass(frozen=True, kw_only=True)
class Running:
    """Running contact: means over time and tracks by catalogue key, SI.

    `clr` is the mean load share with its interval, `snapshot_clr` that of standing roughness at
    the start of the first track, None if that did not converge. `cells` are those of the fine grid;
    `steps` and `failed` time steps were computed and not converged on all grids and tracks.
    `time_s` and `series` are the load share of the first track over time on the fine grid, the
    first `cut` passages of `steps_per_passage` steps being cut off.
    """

    numbers: dict[str, Scalar] = field(repr=False)
    clr: TimeMean
    snapshot_clr: float | None
    tracks: int
    cells: tuple[int, int]
    steps: int
    failed: int
    cut: int
    steps_per_passage: int
    time_s: tuple[float, ...] = field(repr=False)
    series: tuple[float, ...] = field(repr=False)

    @property
    def converged(self) -> bool:
        """True if nearly all time steps met the tolerance."""
        return self.failed <= MAX_FAILED * self.steps

    @property
    def clr_std(self) -> float:
        """Standard deviation of the load share over time."""
        return self.clr.deviation

    def to_json(self) -> str:
        """Return the record as JSON text."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> "Running | None":
        """Return the record of a stored run, None of one that was not solved.

        KeyError, TypeError or ValueError for another text.
        """
        values = json.loads(text)
        if values is None:
            return None
        for name in ("cells", "time_s", "series"):
            values[name] = tuple(values[name])
        return cls(**{**values, "clr": TimeMean(**values["clr"])})


class TrackProgress(NamedTuple):
    """Callbacks of a time step: with its last iteration, and with steps done and in total."""

    iteration: Callable[[Iteration], None] | None = None
    steps: Callable[[int, int], None] | None = None


NO_PROGRESS = TrackProgress()


class _Step(NamedTuple):
    """Attributes of a step that the catalogue's sources refer to."""

    state: ContactState
    solution: ContactSolution
    friction: Friction


def mean_state(state: ContactState, running: Running) -> ContactState:
    """Return the contact state with the means over time of a running contact."""
    sources = {entry.source: entry.key for entry in lines(*EVERY_STEP)}
    means: dict[str, Any] = {
        field.name: running.numbers[key]
        for field in fields(state)
        if (key := sources.get(f"state.{field.name}")) in running.numbers
    }
    return replace(state, **means)


def running_error(
    state: ContactState,
    row: Row,
    running: Running,
    conditions: ContactConditions,
    model: VibrationModel | None,
    vibration: Vibration | None,
) -> ContactError | None:
    """Return the uncertainty of a running contact's mean load share, and of its resonance."""
    if state.error is None:
        return None
    mean = running.clr
    clr = Uncertainty(
        value=min(max(mean.value, 0.0), 1.0),
        iteration=(0.0, 0.0),
        grid=None if mean.grid is None else (mean.grid, mean.grid),
        surfaces=(mean.time, mean.time),
        range=(0.0, 1.0),
    )
    crf = None
    if model is not None and vibration is not None and row["crf_hz"] is not None:
        crf = crf_error(clr, state, [row], conditions, model, vibration)
    return replace(state.error, clr=clr, crf_hz=crf, surfaces=running.tracks, running=True)


def run_tracks(
    case: Case,
    *,
    tracks: int,
    workers: int = 1,
    progress: TrackProgress = NO_PROGRESS,
) -> tuple[Running, ContactSolution, list[str]]:
    """Return the running contact, a moment of it on the fine grid, and notes.

    The moment is the start, with standing roughness, or the last one if that did not converge.

    Parameters
    ----------
    case : case whose rough bodies move
    tracks : number of tracks, surfaces of the case's kind
    workers : processes, one of them for the fine grid; 1 starts none
    progress : callbacks, after every time step of the tracks that this process computes in turn

    Raises
    ------
    BadInput
        for tracks that a measured surface does not cover.
    NotConverged
        if most time steps do not converge.
    """
    cells = case.running_cells()
    coarse_cells = half_as_many(case.conditions, case.grid, cells)
    # without a coarse grid, all tracks but the first are on the fine one
    numbers = range(0 if coarse_cells else 1, tracks)
    further_cells = coarse_cells or cells
    with _further_tracks(case, further_cells, numbers, workers, progress) as further:

        def length() -> int:
            series = further[0]().value if coarse_cells else None
            return 0 if series is None else series.length

        fine = _track(case, cells, passages=length if coarse_cells else None, progress=progress)
        own = further[0]() if coarse_cells else Determined(fine)
        others = [outcome() for number, outcome in further.items() if number > 0]
    if own.value is None:  # without the coarse grid, the other tracks cannot be corrected
        track_series = [fine]
    else:
        track_series = [own.value, *(other.value for other in others if other.value is not None)]
    running = _running(case, track_series, fine)
    return running, _moment(fine), _notes(running, track_series, [own, *others])


def _moment(fine: Series) -> ContactSolution:
    """Return the start if it converged, or else the last moment that did."""
    kept = [snapshot.solution for snapshot in fine.kept]
    order = (kept[0], *reversed(kept))
    return next((solution for solution in order if solution.convergence.converged), kept[-1])


def _notes(running: Running, tracks: list[Series], outcomes: list[Determined[Series]]) -> list[str]:
    """Return notes on tracks that failed or are not stationary, and on failed time steps."""
    notes = [_FROM_START if running.snapshot_clr is not None else _FROM_END]
    notes += [
        f"Track {number} of {len(outcomes)} is left out: {outcome.reason.rstrip('.')}."
        for number, outcome in enumerate(outcomes, 1)
        if outcome.value is None and number > 1
    ]
    if outcomes[0].value is None:
        reason = outcomes[0].reason.rstrip(".")
        notes.append(f"The error due to the cells is not determined on a coarser grid: {reason}.")
    for number, series in enumerate(tracks, 1):
        if settled_from(series, "clr") is None:
            notes.append(
                f"The load share of track {number} is not stationary after {series.length} "
                "passages of the Hertz zone; the mean is that of the second half."
            )
    if outcomes[0].value is not None and running.numbers["friction_error"] is None:
        notes.append(
            "Too little roughness passes to determine the interval of the friction coefficient."
        )
    if running.failed:
        notes.append(
            f"{running.failed} of {running.steps} time steps did not reach the tolerance; the "
            "means include them."
        )
    return notes


def _running(case: Case, track_series: list[Series], fine: Series) -> Running:
    """Combine the series of all tracks and grids into one result."""
    cuts = [_cut(series) for series in track_series]
    all_series = track_series if fine is track_series[0] else [*track_series, fine]
    means, start = time_means(track_series, cuts, fine), fine.kept[0]
    totals: dict[str, Scalar] = {
        "iterations": sum(series.iterations for series in all_series),
        "seconds": sum(series.seconds for series in all_series),
        "friction_error": _error(means["friction_coefficient"]),
    }
    return Running(
        numbers=_numbers(case, means, _moments(fine, cuts[0])) | totals,
        clr=replace(means["clr"], time=min(means["clr"].time, 1.0)),  # the range of a share
        snapshot_clr=start.state.clr if start.solution.convergence.converged else None,
        tracks=len(track_series),
        cells=fine.cells,
        steps=sum(len(series.values) - 1 for series in all_series),
        failed=sum(series.failed for series in all_series),
        cut=cuts[0],
        steps_per_passage=fine.steps_per_passage,
        time_s=tuple(fine.column("time_s")),
        series=tuple(fine.column("clr")),
    )


def _error(mean: TimeMean) -> float | None:
    """Return the error of a mean by cells and finite time; None if a part is not determined."""
    return None if mean.grid is None or math.isinf(mean.time) else math.hypot(mean.grid, mean.time)


def _moments(fine: Series, cut: int) -> list[Snapshot]:
    """Return `MOMENTS` evenly spaced ends of passages after the first `cut` ones."""
    settled = [snapshot for snapshot in fine.kept if snapshot.number > cut * fine.steps_per_passage]
    spaced = np.linspace(0, len(settled) - 1, min(MOMENTS, len(settled))).round().astype(int)
    return [settled[index] for index in spaced]


def _cut(series: Series) -> int:
    """Return the passages to cut off: half where the series is not stationary."""
    return settled_from(series, "clr") or max(1, series.length // 2)


def _track(
    case: Case,
    cells: tuple[int, int],
    *,
    passages: Callable[[], int] | None = None,
    progress: TrackProgress = NO_PROGRESS,
) -> Series:
    """March a case's track on one grid, with one thread for the algebra."""
    entries = _entries(EVERY_STEP)

    def measure(snapshot: Snapshot) -> dict[str, float]:
        if progress.iteration is not None:
            progress.iteration(snapshot.solution.convergence.history[-1])
        rubbing = friction(
            snapshot.solution, boundary_friction=case.boundary_friction, thermal=case.thermal
        )
        numbers = read(_Step(snapshot.state, snapshot.solution, rubbing), entries)
        values = {key: math.nan if value is None else value for key, value in numbers.items()}
        return {"time_s": snapshot.time, **values, **snapshot.rolling_friction}

    assert case.lubricant is not None
    with threadpool_limits(1):
        surfaces = running_surfaces(case).on_cells(cells)
        return run_track(
            case.conditions,
            case.lubricant,
            surfaces,
            measure,
            passages=passages,
            options=case.options,
            viscosity_factor=inlet_viscosity_factor(
                case.conditions, case.lubricant, surfaces.grid, case.thermal
            ),
            progress=progress.steps,
        )


def running_surfaces(case: Case, passages: int = PASSAGES) -> MovingSurfaces:
    """Return both bodies' roughness; generated tracks do not repeat within some passages."""
    conditions = case.conditions
    fastest = max(map(abs, conditions.surface_speeds)) / conditions.entrainment_speed
    zones = case.grid.extent[0] / (2.0 * conditions.hertz.half_widths[0])
    return case.moving_surfaces(min(math.ceil(passages * fastest / zones), MOST_TRACK_LENGTHS))


def _entries(groups: tuple[str, ...]) -> list[Quantity]:
    return [entry for entry in lines(*groups) if not entry.key.endswith(WITHOUT)]


def _numbers(case: Case, means: dict[str, TimeMean], moments: list[Snapshot]) -> dict[str, Scalar]:
    """Return the means of every number, and error bars as differences between the grids."""
    numbers: dict[str, Scalar] = {
        key: None if math.isnan(mean.value) else mean.value
        for key, mean in means.items()
        if key != "time_s"
    }
    assert case.lubricant is not None
    clr, car, sq = means["clr"], means["car"], case.surface().sq
    film = least_film(case.conditions, case.lubricant)
    # of the full roughness, not of the part that the cells resolve
    numbers |= {"sq_m": sq, "lambda_ratio": film / sq}
    numbers |= {"clr": min(max(clr.value, 0.0), 1.0), "car": max(car.value, 0.0)}
    numbers |= {error: means[key].grid for key, error in ERRORS.items()}
    imbalances = [snapshot.state.mass_flux_imbalance for snapshot in moments]
    numbers["mass_flux_imbalance"] = float(np.mean(imbalances))
    rows = [Determined.attempt(partial(_at_moment, case, moment)).value for moment in moments]
    for entry in _entries(AT_MOMENTS):
        values = [float(value) for row in rows if row and (value := row[entry.key]) is not None]
        numbers[entry.key] = float(np.mean(values)) if values else None
    return numbers


def _at_moment(case: Case, snapshot: Snapshot) -> dict[str, Scalar]:
    """Return the numbers that are evaluated at some moments only."""
    moment = Derived(case=case, solution=snapshot.solution, state=snapshot.state)
    return read(moment, _entries(AT_MOMENTS))


_Outcome = Callable[[], Determined[Series]]


@contextmanager
def _further_tracks(
    case: Case,
    cells: tuple[int, int],
    numbers: range,
    workers: int,
    progress: TrackProgress,
) -> Iterator[dict[int, _Outcome]]:
    """Yield a function per track that returns it on the coarse grid.

    Other processes compute them meanwhile, or this one beforehand if it is the only one.
    """
    if workers < 2 or not numbers:
        series = {number: _further_track(case, cells, number, progress) for number in numbers}
        yield {number: partial(series.__getitem__, number) for number in numbers}
        return
    pool = ProcessPoolExecutor(
        min(workers - 1, cores(), len(numbers)), get_context("spawn"), set_up_worker
    )
    try:
        futures: dict[int, Future[Determined[Series]]] = {
            number: pool.submit(_further_track, case, cells, number) for number in numbers
        }
        yield {number: future.result for number, future in futures.items()}
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _further_track(
    case: Case,
    cells: tuple[int, int],
    number: int,
    progress: TrackProgress = NO_PROGRESS,
) -> Determined[Series]:
    """Return a track without its snapshots, or the reason why there is none."""

    def series() -> Series:
        return _track(case.on_surface(number), cells, progress=progress)._replace(kept=())

    return Determined.attempt(series)
