"""Mean over time of a contact whose roughness moves, with its interval.

The same tracks pass through the contact on two grids, one of half as many cells along each axis.
Time is counted in passages: the oil crosses the Hertz zone in one. The start is cut off where the
standard error of the rest is smallest, and the rest is divided into means over one passage each.
Adjacent passages share roughness and are correlated, as are many passages of a slow body. Sources:
K. P. White Jr., Simulation 69 (1997) 323 (cut); A. M. Law, Simulation Modeling and Analysis, 5th
ed. (2015), ch. 9 (batch means). With several tracks the coarse grid is a control variate: it runs
on every track, the fine one on the first.
"""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import islice
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.coverage import UPPER
from asperity.core.errors import NotConverged
from asperity.ehl import ContactSolution, Options
from asperity.ehl.outcome import TWO_PRESSURES
from asperity.lubricant import Lubricant
from asperity.surface import MovingSurfaces
from asperity.transient.motion import moving_contact, step_seconds
from asperity.transient.time_step import Snapshot

PASSAGES, MAX_PASSAGES = 6, 24  # first length of a series, and the largest until it is stationary
TIME_STEP = 2.0  # cells that the oil travels in a step, if the model follows it over several
MAX_SLIDING_CELLS = 2.0  # of roughness relative to the oil in such a step; beyond, one-cell steps
# The numbers of a moment average over the Hertz zone, so that adjacent passages, which share
# roughness, correlate by 1/4 and the variance of their mean is 1.5 times that of independent ones.
VARIANCE_RATIO = 1.5
MIN_INDEPENDENT = 1.5  # values, below which a series says nothing about the scatter of its mean
MAX_FIRST_FAILED = 0.5  # share of failed steps in the first passage, from which the rest fails
TOLERANCE = 1e-2  # of a time step; with a tenth of it the mean CLR changes by less than 0.002

Measure = Callable[[Snapshot], Mapping[str, float]]


class Series(NamedTuple):
    """Numbers of a moving contact at every time step of a track on one grid.

    `values` has a row per step, the steady start first, and a column per number; `failed` counts
    steps that did not converge, `iterations` all Newton steps, `seconds` their time. `kept` are
    the snapshots of the start and of the end of every passage. Per passage, `zones` Hertz zones of
    roughness pass; those of the track are `track_zones`.
    """

    cells: tuple[int, int]
    steps_per_passage: int
    names: tuple[str, ...]
    values: Field
    failed: int
    iterations: int
    seconds: float
    kept: tuple[Snapshot, ...] = ()
    zones: float = 1.0
    track_zones: float = math.inf

    def column(self, name: str) -> Field:
        """Return one number over time."""
        column: Field = self.values[:, self.names.index(name)]
        return column

    @property
    def length(self) -> int:
        """Length in whole passages."""
        return (len(self.values) - 1) // self.steps_per_passage

    def passages(self, cut: int) -> Field:
        """Return means over each whole passage after the first `cut` ones, (passages, names)."""
        steps = self.steps_per_passage
        settled = self.values[1 + cut * steps :]
        count = len(settled) // steps
        means: Field = settled[: count * steps].reshape(count, steps, -1).mean(axis=1)
        return means

    def independent(self, passages: int) -> float:
        """Return how many independent values have the same scatter as some passages' mean."""
        return passages * min(1.0, self.zones) / VARIANCE_RATIO

    def repeats(self, passages: int) -> bool:
        """Return True if the track repeats within some passages."""
        return passages * self.zones > self.track_zones


@dataclass(frozen=True, kw_only=True)
class TimeMean:
    """Mean of one number over time and tracks, with parts of its interval.

    `time` is the half-width due to the finite time and number of tracks, `grid` the difference
    between both grids (None without a coarse one), `deviation` the standard deviation over time.
    """

    value: float
    time: float
    grid: float | None
    deviation: float


def run_track(
    conditions: ContactConditions,
    lubricant: Lubricant,
    surfaces: MovingSurfaces,
    measure: Measure,
    *,
    passages: Callable[[], int] | None = None,
    options: Options | None = None,
    viscosity_factor: Field | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Series:
    """March a track through the contact, and return its series.

    Parameters
    ----------
    conditions, lubricant, surfaces : the contact, with the roughness of both bodies
    measure : returns numbers of a step by name, the same names at every step
    passages : returns the length of the series, at least `PASSAGES`; called after these. By
        default half as many more are added until the series of `clr` is stationary, at most
        `MAX_PASSAGES`
    options : solver settings; the tolerance is `TOLERANCE` or more
    viscosity_factor : local over isothermal viscosity, (nx, ny)
    progress : called with the number of steps done and in total

    Raises
    ------
    BadInput
        as `moving_contact`.
    NotConverged
        if half of the first passage does not converge. The steady start may be unconverged,
        because each step starts from the oil of the one before, and the start is cut off.
    """
    options = _options(options)
    time_step = _time_step(conditions, options)
    per_passage = _steps_per_passage(conditions, surfaces, time_step)
    zones = _slowest_roughness(surfaces) / conditions.entrainment_speed
    length = min(MAX_PASSAGES, math.ceil(PASSAGES / min(1.0, max(zones, 0.1))))
    record = _Record(measure, per_passage, length)
    for snapshot in moving_contact(
        conditions,
        lubricant,
        surfaces,
        time_step=time_step,
        options=options,
        viscosity_factor=viscosity_factor,
    ):
        record.add(snapshot)
        if record.last_failed is not None and snapshot.number <= per_passage:
            _require_progress(record.last_failed, record.failed, per_passage)
        if progress is not None:
            progress(snapshot.number, record.steps)
        if snapshot.number < record.steps:
            continue
        series = record.series(surfaces.grid.cells)
        longer = _length(series) if passages is None else passages()
        if longer <= record.length:
            break
        record.length = longer
    return series._replace(
        zones=zones,
        track_zones=surfaces.first.grid.extent[0] / (2.0 * conditions.hertz.half_widths[0]),
    )


def solve_passage(
    conditions: ContactConditions,
    lubricant: Lubricant,
    surfaces: MovingSurfaces,
    *,
    options: Options | None = None,
    viscosity_factor: Field | None = None,
) -> ContactSolution:
    """Return the running contact with its roughness at time 0, a passage after a steady start.

    Raises
    ------
    BadInput
        as `moving_contact`.
    NotConverged
        if the last time step, or half of them, do not converge.
    """
    options = _options(options)
    time_step = _time_step(conditions, options)
    per_passage = _steps_per_passage(conditions, surfaces, time_step)
    for passages in (1, 2):  # a start that does not converge takes one more to be forgotten
        steps = passages * per_passage
        earlier = surfaces.earlier(steps * step_seconds(conditions, surfaces, time_step))
        snapshots = moving_contact(
            conditions,
            lubricant,
            earlier,
            time_step=time_step,
            options=options,
            viscosity_factor=viscosity_factor,
        )
        last = next(snapshots).solution
        if last.convergence.converged:
            break
    _require_progress(last, 0, steps)
    failed = 0
    for snapshot in islice(snapshots, steps):
        last = snapshot.solution
        if not last.convergence.converged:
            failed += 1
            _require_progress(last, failed, steps)
    if not last.convergence.converged:
        raise _not_converged(last)
    return last


def _require_progress(solution: ContactSolution, failed: int, steps: int) -> None:
    """Raise NotConverged if a solution is not finite, or more than half of the steps failed."""
    if failed > MAX_FIRST_FAILED * steps or not np.isfinite(solution.pressure).all():
        raise _not_converged(solution)


def _not_converged(solution: ContactSolution) -> NotConverged:
    return NotConverged(solution, f"contact not solved: {solution.convergence.explain()}")


def _options(options: Options | None) -> Options:
    """Return the settings of a time step."""
    options = options or Options()
    return replace(options, tolerance=max(options.tolerance, TOLERANCE))


def _time_step(conditions: ContactConditions, options: Options) -> float:
    """Return the time step in cells of the oil's path."""
    longest = TIME_STEP if options.model in TWO_PRESSURES else 1.0
    slid = 0.5 * abs(conditions.slide_to_roll) * longest
    return longest if slid <= MAX_SLIDING_CELLS else 1.0


def _steps_per_passage(
    conditions: ContactConditions, surfaces: MovingSurfaces, time_step: float
) -> int:
    """Return the time steps in which the oil crosses the Hertz zone."""
    crossing = 2.0 * conditions.hertz.half_widths[0] / surfaces.grid.spacing[0]
    return max(1, round(crossing / time_step))


def _length(series: Series) -> int:
    """Return the passages that a series needs: those it has if it is stationary, or more."""
    if settled_from(series, "clr") is not None:
        return series.length
    return min(MAX_PASSAGES, series.length + series.length // 2)


def _slowest_roughness(surfaces: MovingSurfaces) -> float:
    """Return the smallest speed of a rough body that moves [m/s]."""
    bodies = zip(surfaces.speeds, surfaces.rough, strict=True)
    return min((abs(speed) for speed, is_rough in bodies if is_rough and speed), default=0.0)


class _Record:
    """Numbers of the time steps so far, of `length` passages in all."""

    def __init__(self, measure: Measure, per_passage: int, length: int) -> None:
        self.measure, self.per_passage, self.length = measure, per_passage, length
        self.began, self.rows, self.names = (
            time.perf_counter(),
            list[list[float]](),
            tuple[str, ...](),
        )
        self.failed, self.iterations, self.kept = 0, 0, list[Snapshot]()
        self.last_failed: ContactSolution | None = None

    @property
    def steps(self) -> int:
        """Number of the last time step."""
        return self.length * self.per_passage

    def add(self, snapshot: Snapshot) -> None:
        """Add a time step."""
        numbers, convergence = self.measure(snapshot), snapshot.solution.convergence
        self.names = (*numbers,)
        self.rows.append([*numbers.values()])
        self.failed += snapshot.number > 0 and not convergence.converged
        if not convergence.converged:
            self.last_failed = snapshot.solution
        self.iterations += convergence.iterations
        if snapshot.number % self.per_passage == 0:
            self.kept.append(replace(snapshot, memory={}))

    def series(self, cells: tuple[int, int]) -> Series:
        """Return the series so far."""
        return Series(
            cells=cells,
            steps_per_passage=self.per_passage,
            names=self.names,
            values=np.array(self.rows, float),
            failed=self.failed,
            iterations=self.iterations,
            seconds=time.perf_counter() - self.began,
            kept=tuple(self.kept),
        )


def settled_from(series: Series, name: str) -> int | None:
    """Return the number of passages to cut off, by one number of a series; None if not stationary.

    The standard error of the mean of the rest is smallest from there; a series whose minimum lies
    in its second half is not stationary.
    """
    steps, values = series.steps_per_passage, series.column(name)[1:]
    latest = max(1, len(values) // steps // 2)
    rest = [values[cut * steps :] for cut in range(1, latest + 1)]
    cut = 1 + int(np.argmin([float(np.var(part)) / len(part) for part in rest]))
    return None if cut == latest and latest > 1 else cut


def time_means(coarse: list[Series], cuts: list[int], fine: Series) -> dict[str, TimeMean]:
    """Return the mean of every number over time and tracks, with its interval.

    They are means of the fine grid on one track, or of the coarse grid on several tracks, corrected
    by the difference between both grids on the first. Of tracks that repeat, the scatter is that
    between their means; one that repeats stands for itself.

    Parameters
    ----------
    coarse : series of every track on the coarse grid, or on the fine one if there is no other
    cuts : passages cut off from each
    fine : series of the first track on the fine grid, the same as the first one without others
    """
    blocks = [series.passages(cut) for series, cut in zip(coarse, cuts, strict=True)]
    accurate = fine.passages(cuts[0])
    count = min(len(accurate), len(blocks[0]))
    change = accurate[:count] - blocks[0][:count]
    grid = None if fine is coarse[0] else np.abs(change.mean(axis=0))
    parts = _parts(coarse, blocks, fine, accurate, change)
    means, half_widths = sum(part.values.mean(axis=0) for part in parts), _half_widths(parts)
    deviations = fine.values[1 + cuts[0] * fine.steps_per_passage :].std(axis=0)
    return {
        name: TimeMean(
            value=float(means[column]),
            time=float(half_widths[column]),
            grid=None if grid is None else float(grid[column]),
            deviation=float(deviations[column]),
        )
        for column, name in enumerate(fine.names)
    }


class _Sample(NamedTuple):
    """Independent part of a mean: values of passages, (passages, names), `independent` of them."""

    values: Field
    independent: float


def _parts(
    coarse: list[Series], blocks: list[Field], fine: Series, accurate: Field, change: Field
) -> list[_Sample]:
    """Return the independent parts of the mean over time and tracks.

    `blocks` and `accurate` are the means over passages on both grids, `change` their difference on
    the first track.
    """
    if len(coarse) == 1:
        return [_Sample(accurate, fine.independent(len(accurate)))]
    if any(series.repeats(len(block)) for series, block in zip(coarse, blocks, strict=True)):
        means_of_tracks = np.array([block.mean(axis=0) for block in blocks])
        return [_Sample(means_of_tracks + change.mean(axis=0), len(coarse))]
    return _corrected(coarse, blocks, change)


def _corrected(coarse: list[Series], blocks: list[Field], change: Field) -> list[_Sample]:
    """Return the parts of the coarse tracks' mean, weighted by their independent passages.

    The first track's part includes the difference between both grids.
    """
    numbers = [series.independent(len(block)) for series, block in zip(coarse, blocks, strict=True)]
    weights = [number / sum(numbers) for number in numbers]
    first = weights[0] * blocks[0][: len(change)] + change
    others = zip(weights[1:], blocks[1:], numbers[1:], strict=True)
    return [
        _Sample(first, numbers[0]),
        *(_Sample(weight * block, number) for weight, block, number in others),
    ]


def _half_widths(parts: list[_Sample]) -> Field:
    """Return the half-widths of the sum of the parts' means (Welch and Satterthwaite).

    Infinite if a part has fewer than `MIN_INDEPENDENT` independent passages.
    """
    columns = parts[0].values.shape[1]
    if any(part.independent < MIN_INDEPENDENT for part in parts):
        return np.full(columns, math.inf)
    freedoms = np.array([part.independent - 1.0 for part in parts])[:, None]
    # of correlated values, the mean square about their mean is too small by (m - 1)/m
    variances = np.array([part.values.var(axis=0) for part in parts]) / freedoms
    total = variances.sum(axis=0)
    weights = (variances**2 / freedoms).sum(axis=0)
    freedom = np.divide(total**2, weights, out=np.ones(columns), where=weights > 0.0)
    half_widths: Field = stdtrit(freedom, UPPER) * np.sqrt(total)
    return half_widths
