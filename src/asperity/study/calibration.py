"""The quantities of a case that best meet what is known of its wear curve: found on the real solver, with the cost.

Least squares of scipy from the best of a Latin hypercube. The objective is a little rough (a moved domain or
correlation length draws the surface anew), so slopes are taken over a tenth of each range, and what seeds alone do to
them is taken out before anything is called determined. docs/theory/calibration.md has the equations.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from asperity.arrays import Field
from asperity.case import Case
from asperity.errors import AsperityError, BadInput, require_positive
from asperity.paper import PAPER_ANCHORS, SPLIT_ANCHOR, Anchor, compare_with_anchors
from asperity.study.curve import SQ_KEY, WearCurve
from asperity.study.evaluate import DONE
from asperity.study.execute import StudyProgress, run_study, study_executor
from asperity.study.plan import plan_points
from asperity.study.ranges import (
    OPEN_RANGES,
    ParameterRange,
    at_cells,
    entry_of,
    open_ranges,
    overrides_at,
    parse_range,
    require_ranges,
    stated_value,
)
from asperity.study.silence import with_silence

if TYPE_CHECKING:
    import pandas

FREE = OPEN_RANGES[:4]  # what decides CAR and CLR: cap, correlation length, alpha, inlet
CELLS, SEEDS, SCREENED, STARTS = 128, 3, 32, 2
SLOPE_SEEDS = 2  # times as many surfaces for the slopes at the end as for the fit
CHECK_SEEDS = 5
STEP = 0.1  # of a range, either way, over which slopes are taken
MOST_STEPS = 8  # of least squares from one start
NEARER = 1e-2  # of a range, or of the misfit: smaller steps and gains are lost in the roughness
LOST = 20.0  # tolerances that an anchor without a value counts as missed by
SAME_LEVEL = 0.02  # Sq nearer than this to another are solved once
PRIOR_VARIANCE = 1.0 / 12.0  # of a share that may be anything from 0 to 1
LEARNT_FROM = 0.5  # share of that variance that the anchors must take away from a quantity to determine it
FARTHEST = 0.3  # of a range, to which slopes are trusted
EDGE = 0.01  # of a range: a quantity this near to its end would go on
RESERVED = {
    SQ_KEY: "anchors are at roughnesses of their own",
    "surface.seed": "what is found should not hang on one surface; give seeds",
    "vibration.seed": "what is found should not hang on one record; give seeds",
    "grid.cells": "they go with the domain; give cells",
}


class CalibratedParameter(NamedTuple):
    """A quantity that was free: what was found, and how well the anchors determine it.

    `low` and `high` are one standard deviation either way, the range searched counting as what was known before, and
    the whole range where the anchors do not determine the quantity; `learnt` is how much of the range's variance they
    took away, 0 nothing, 1 all.
    """

    range: ParameterRange
    start: float | None
    value: float
    low: float
    high: float
    std_share: float
    learnt: float
    at_end: bool

    @property
    def identifiable(self) -> bool:
        """Whether the anchors determine it, rather than the range."""
        return self.learnt >= LEARNT_FROM


class Direction(NamedTuple):
    """A direction in the space of shares: `weights` of the quantities, how far the anchors let it go (in ranges)."""

    weights: tuple[float, ...]
    std: float
    determined: bool


class TradeOff(NamedTuple):
    """What the others would gain if one anchor were given up: by slopes, so for small steps only.

    `misfit` of the others (sum of squared misses in tolerances) would go to `without`; `relieved` would gain most, its
    miss in tolerances going from `miss` to `miss_without`.
    """

    given_up: str
    misfit: float
    without: float
    relieved: str
    miss: float
    miss_without: float


@dataclass(frozen=True)
class Calibration:
    """What best meets the anchors, and what that leaves open.

    Parameters
    ----------
    case : as given, on the cells of the fit
    calibrated : the case with what was found, on its own cells, ready for `asperity study`
    anchors : all of them; `aimed_at` are those that decided
    parameters : of the free quantities, in order
    correlation : shape (parameters, parameters)
    directions : of the free quantities, the best determined first
    trade_offs : the dearest anchor first
    start, fit, check : as `anchors.compare` has it. `check` is on the case's own cells, with surfaces that the fit has
        not seen; `low` and `high` are 90 % intervals over seeds
    misfit, start_misfit : sums of squared misses in tolerances
    evaluations, cases : parameter sets tried, contacts solved or found in the folder
    failed : contacts that failed or did not converge, and were left out
    seconds : it took
    """

    case: Case
    calibrated: Case
    anchors: tuple[Anchor, ...]
    parameters: tuple[CalibratedParameter, ...]
    correlation: Field
    directions: tuple[Direction, ...]
    trade_offs: tuple[TradeOff, ...]
    start: "pandas.DataFrame"
    fit: "pandas.DataFrame"
    check: "pandas.DataFrame"
    start_misfit: float
    misfit: float
    evaluations: int
    cases: int
    failed: int
    seconds: float
    start_curve: WearCurve = field(repr=False)
    curve: WearCurve = field(repr=False)
    check_curve: WearCurve = field(repr=False)

    @property
    def aimed_at(self) -> tuple[Anchor, ...]:
        """The anchors that decided."""
        return tuple(anchor for anchor in self.anchors if anchor.fitted)

    @property
    def unidentifiable(self) -> tuple[str, ...]:
        """Quantities that the anchors do not determine."""
        return tuple(found.range.key for found in self.parameters if not found.identifiable)

    def verdict(self) -> str:
        """What was found, what it meets, what cannot be met together and what stays open."""
        aimed = {anchor.name for anchor in self.aimed_at}
        met = self.fit[self.fit["anchor"].isin(aimed)]
        missed = [f"{row.anchor} ({row.ours:.4g} for {row.printed:g})" for row in met[~met["met"]].itertuples()]
        values = ", ".join(f"{p.range.key} {_shown(p.value)}{_unit(p.range)}" for p in self.parameters)
        sentence = f"{int(met['met'].sum())} of {len(met)} anchors are met within their tolerances with {values}"
        sentence += f"; missed: {', '.join(missed)}." if missed else "."
        if self.unidentifiable:
            sentence += f" Not determined by the anchors: {', '.join(self.unidentifiable)}."
        ends = [p.range.key for p in self.parameters if p.at_end]
        if ends:
            sentence += f" At the end of the range: {', '.join(ends)}."
        return sentence

    def scalars(self) -> dict[str, Any]:
        """What `asperity calibrate --json` prints; None where there is none."""

        def rows(table: "pandas.DataFrame") -> list[dict[str, Any]]:
            return [{str(key): _or_none(value) for key, value in row.items()} for row in table.to_dict("records")]

        return {
            "verdict": self.verdict(),
            "parameters": [
                {
                    "key": p.range.key,
                    "unit": p.range.unit,
                    "searched": [p.range.low, p.range.high],
                    "start": p.start,
                    "value": p.value,
                    "low": p.low,
                    "high": p.high,
                    "std_share": p.std_share,
                    "learnt": p.learnt,
                    "identifiable": p.identifiable,
                    "at_end": p.at_end,
                }
                for p in self.parameters
            ],
            "correlation": self.correlation.tolist(),
            "directions": [
                {
                    "weights": dict(zip((p.range.key for p in self.parameters), d.weights, strict=True)),
                    "std": _or_none(d.std),
                    "determined": d.determined,
                }
                for d in self.directions
            ],
            "trade_offs": [trade._asdict() for trade in self.trade_offs],
            "misfit": self.misfit,
            "start_misfit": self.start_misfit,
            "start": rows(self.start),
            "fit": rows(self.fit),
            "check": rows(self.check),
            "evaluations": self.evaluations,
            "cases": self.cases,
            "failed": self.failed,
            "seconds": self.seconds,
        }


def calibrate(
    case: Case,
    anchors: Sequence[Anchor] = PAPER_ANCHORS,
    *,
    free: Sequence[ParameterRange | str] | None = None,
    levels: Sequence[float] | None = None,
    cells: int | None = CELLS,
    seeds: int = SEEDS,
    screened: int = SCREENED,
    starts: int = STARTS,
    sample_seed: int = 0,
    out: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Calibration:
    """Find the values of free quantities with which a case's wear curve best meets anchors.

    The misfit is the sum over the anchors that are `fitted` of (miss/tolerance)^2, on means over `seeds` surfaces that
    are the same in every evaluation.

    Parameters
    ----------
    case : the contact; what is not free stays as it is
    anchors : what the curve should meet
    free : ranges to search, or their texts (`parse_range`); by default pressure cap, correlation length,
        pressure-viscosity coefficient and inlet, as far as the case has them
    levels : roughnesses to solve at [m]; by default the anchors' own
    cells : along each axis of the widest domain; None: the case's own
    seeds : surfaces a level
    screened : parameter sets of the Latin hypercube that the starts are chosen from
    starts : how many of the best least squares starts from
    sample_seed : of the hypercube
    out : folder that keeps every evaluation, so that a second call goes on where the first was stopped
    executor, workers, progress : see `run_study`

    Raises
    ------
    BadInput
        for a range, anchor or setting that cannot be used.
    AsperityError
        if no parameter set can be solved.
    """
    given, case = case, at_cells(case, cells)
    wanted = FREE if free is None else tuple(parse_range(r) if isinstance(r, str) else r for r in free)
    ranges = open_ranges(case, wanted) if free is None else wanted
    require_ranges(case, ranges, RESERVED)
    aimed = _aimed_at(case, anchors)
    sq = _levels(aimed, levels)
    for name, count in (("seeds", seeds), ("screened", screened), ("starts", starts)):
        if count < 1:
            raise BadInput(f"{name} must be 1 or more, got {count}")
    with nullcontext(executor) if executor is not None else study_executor(workers) as pool:
        bench = _Bench(case, ranges, aimed, sq, seeds, None if out is None else Path(out), pool, progress)
        best = _searched(bench, screened, starts, sample_seed)
        slopes = _Slopes.at(bench, best, SLOPE_SEEDS * seeds)
        calibrated = _calibrated(given, ranges, best)
        check = bench.checked(calibrated)
    curve, start_curve = bench.curve(best), bench.curve(None)
    covariance, scale = slopes.covariance(len(aimed) - len(ranges))
    deviations = np.sqrt(np.diag(covariance))
    return Calibration(
        case=case,
        calibrated=calibrated,
        anchors=tuple(anchors),
        parameters=tuple(_parameters(given, ranges, best, deviations)),
        correlation=covariance / np.outer(deviations, deviations),
        directions=tuple(slopes.directions(scale)),
        trade_offs=tuple(slopes.trade_offs(best, aimed)),
        start=_compared(start_curve, anchors),
        fit=_compared(curve, anchors),
        check=_compared(check, anchors),
        start_misfit=float(np.sum(bench.misses(None) ** 2)),
        misfit=float(np.sum(bench.misses(best) ** 2)),
        evaluations=len(bench.known),
        cases=bench.cases,
        failed=bench.failed,
        seconds=bench.seconds,
        start_curve=start_curve,
        curve=curve,
        check_curve=check,
    )


def _aimed_at(case: Case, anchors: Sequence[Anchor]) -> tuple[Anchor, ...]:
    aimed = tuple(anchor for anchor in anchors if anchor.fitted)
    if not aimed:
        raise BadInput("calibration needs an anchor to aim at, got none; leave out fitted = false")
    for anchor in aimed:
        if anchor.quantity == SPLIT_ANCHOR:
            raise BadInput(f"anchor {anchor.name!r} is a split, which moves in jumps; set fitted = false for it")
        if case.vibration is None and anchor.quantity.startswith("crf"):
            raise BadInput(f"{case.source}: anchor {anchor.name!r} needs a vibration; add [vibration]")
    return aimed


def _levels(aimed: Sequence[Anchor], levels: Sequence[float] | None) -> tuple[float, ...]:
    """Roughnesses to solve at [m]: those given, or the anchors', of near ones the outer."""
    asked = sorted({sq for anchor in aimed for sq in (anchor.sq, anchor.since) if sq is not None})
    if levels is not None:
        for level in levels:
            require_positive("level", level, "m")
        chosen = sorted(set(levels))
        if not chosen or chosen[0] > asked[0] * (1 + 1e-9) or chosen[-1] < asked[-1] * (1 - 1e-9):
            raise BadInput(
                f"levels must span the anchors' Sq from {1e6 * asked[0]:g} to {1e6 * asked[-1]:g} um, "
                f"got {', '.join(f'{1e6 * level:g}' for level in chosen) or 'none'}"
            )
        return tuple(chosen)
    kept = [asked[-1]]
    for level in reversed(asked[:-1]):
        if level < kept[-1] * (1.0 - SAME_LEVEL):
            kept.append(level)
    kept[-1] = asked[0]
    return tuple(sorted(kept))


# Evaluations ---------------------------------------------------------------------------------------------------------


class _Bench:
    """The real solver as a function of shares of the ranges; what was asked once is remembered, and kept in `out`."""

    def __init__(
        self,
        case: Case,
        ranges: Sequence[ParameterRange],
        aimed: Sequence[Anchor],
        sq: Sequence[float],
        seeds: int,
        out: Path | None,
        executor: Executor,
        progress: Callable[[StudyProgress], None] | None,
    ) -> None:
        self.case, self.ranges, self.aimed, self.sq, self.seeds = case, ranges, aimed, sq, seeds
        self.out, self.executor, self.progress = out, executor, progress
        self.known: dict[tuple[float, ...] | None, pandas.DataFrame] = {}
        self.cases = self.failed = 0
        self.seconds = 0.0

    def solve(self, wanted: Sequence[Field | None], seeds: int | None = None) -> "list[pandas.DataFrame]":
        """The rows of each set of shares (None: the case as it is), all levels and seeds, as one study."""
        sets = [
            {} if shares is None else overrides_at(self.case, self.ranges, [float(share) for share in shares])
            for shares in wanted
        ]
        points = [{**chosen, SQ_KEY: f"{1e6 * level:.9g} um"} for chosen in sets for level in self.sq]
        plan = plan_points(self.case, points, seeds=seeds or self.seeds, seeding="common")
        out = None if self.out is None else self.out / "evaluations"
        result = run_study(plan, out=out, executor=self.executor, progress=self.progress)
        self.cases += len(plan.cases)
        self.failed += result.failed
        self.seconds += result.seconds
        place = result.table["point"] // len(self.sq)
        return [with_silence(result.table[place == number]) for number in range(len(sets))]

    def learn(self, wanted: Sequence[Field | None]) -> None:
        """Solve those of the sets that are not known yet."""
        new = [shares for shares in wanted if _name(shares) not in self.known]
        if new:
            self.known.update(zip(map(_name, new), self.solve(new), strict=True))

    def curve(self, shares: Field | None) -> WearCurve:
        """The wear curve of one set."""
        self.learn([shares])
        return WearCurve(np.array(self.sq), self.known[_name(shares)])

    def misses(self, shares: Field | None) -> Field:
        """What each anchor that is aimed at is missed by, in its tolerances."""
        curve = self.curve(shares)
        if not (curve.table["status"] == DONE).any():
            return np.full(len(self.aimed), LOST)
        return np.array([_miss(anchor, anchor.of(curve)[0]) for anchor in self.aimed])

    def checked(self, calibrated: Case) -> WearCurve:
        """The calibrated case on its own cells, on surfaces of its own at every level."""
        plan = plan_points(calibrated, [{SQ_KEY: f"{1e6 * level:.9g} um"} for level in self.sq], seeds=CHECK_SEEDS)
        out = None if self.out is None else self.out / "check"
        result = run_study(plan, out=out, executor=self.executor, progress=self.progress)
        self.cases += len(plan.cases)
        self.failed += result.failed
        self.seconds += result.seconds
        return WearCurve(np.array(self.sq), with_silence(result.table))


def _name(shares: Field | None) -> tuple[float, ...] | None:
    return None if shares is None else tuple(float(share) for share in shares)


def _miss(anchor: Anchor, ours: float) -> float:
    return anchor.miss(ours) / anchor.tolerance if np.isfinite(ours) else LOST


def _searched(bench: _Bench, screened: int, starts: int, seed: int) -> Field:
    """The shares of least misfit among all that were tried."""
    from scipy.optimize import least_squares
    from scipy.stats import qmc

    count = len(bench.ranges)
    cube = [np.round(shares, 6) for shares in qmc.LatinHypercube(count, rng=seed).random(screened)]
    bench.learn([None, *cube])
    if not any((table["status"] == DONE).any() for table in bench.known.values()):
        reasons = next(iter(bench.known.values()))["reason"]
        raise AsperityError(f"no parameter set could be solved: {reasons.iloc[0]}")
    ranked = sorted(cube, key=lambda shares: float(np.sum(bench.misses(shares) ** 2)))
    for first in ranked[:starts]:
        least_squares(
            bench.misses,
            np.clip(first, EDGE, 1.0 - EDGE),
            jac=partial(_central, bench),
            bounds=(0.0, 1.0),
            max_nfev=MOST_STEPS,
            xtol=NEARER,
            ftol=NEARER,
        )
    tried = [np.array(shares) for shares in bench.known if shares is not None]
    return min(tried, key=lambda shares: float(np.sum(bench.misses(shares) ** 2)))


def _neighbours(shares: Field) -> list[tuple[Field, Field]]:
    """For each share the two sets STEP below and above it, inside the ranges."""
    pairs = []
    for i in range(shares.size):
        low, high = shares.copy(), shares.copy()
        low[i], high[i] = max(shares[i] - STEP, 0.0), min(shares[i] + STEP, 1.0)
        pairs.append((low, high))
    return pairs


def _central(bench: _Bench, shares: Field) -> Field:
    """Slopes of the misses by differences, shape (anchors, shares); all that they need in one study."""
    pairs = _neighbours(shares)
    bench.learn([shares, *itertools.chain(*pairs)])
    columns = [(bench.misses(high) - bench.misses(low)) / (high[i] - low[i]) for i, (low, high) in enumerate(pairs)]
    return np.stack(columns, axis=1)


# What is determined --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Slopes:
    """Misses at the best set and their slopes, for each surface apart."""

    misses: Field  # (seeds, anchors), in tolerances
    each: Field  # (seeds, anchors, shares); rows of bounds that are kept are 0

    @classmethod
    def at(cls, bench: _Bench, best: Field, seeds: int) -> "_Slopes":
        """By differences over STEP either way, on more surfaces than the fit had."""
        pairs = _neighbours(best)
        tables = bench.solve([best, *itertools.chain(*pairs)], seeds)

        def values(table: "pandas.DataFrame") -> Field:
            """Shape (seeds, anchors): what each surface by itself gives."""
            found = np.full((seeds, len(bench.aimed)), np.nan)
            for seed in range(seeds):
                rows = table[(table["realisation"] == seed) & (table["status"] == DONE)]
                if len(rows) == len(bench.sq):
                    curve = WearCurve(np.array(bench.sq), rows)
                    found[seed] = [anchor.of(curve)[0] for anchor in bench.aimed]
            return found

        here, *around = (values(table) for table in tables)
        tolerances = np.array([anchor.tolerance for anchor in bench.aimed])
        slopes = np.stack(
            [
                (around[2 * i + 1] - around[2 * i]) / (high[i] - low[i]) / tolerances
                for i, (low, high) in enumerate(pairs)
            ],
            axis=2,
        )
        whole = np.isfinite(here).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
        if not whole.any():
            raise AsperityError("no surface could be solved all around the best set; give more seeds")
        mean = here[whole].mean(axis=0)
        off = np.array([anchor.miss(value) for anchor, value in zip(bench.aimed, mean, strict=True)])
        active = np.array([a.sense == "about" or m != 0.0 for a, m in zip(bench.aimed, off, strict=True)])
        misses = (here[whole] - mean + off) / tolerances
        return cls(np.where(active, misses, 0.0), np.where(active[None, :, None], slopes[whole], 0.0))

    @property
    def mean_misses(self) -> Field:
        """Shape (anchors,), in tolerances."""
        return np.asarray(self.misses.mean(axis=0))

    @property
    def mean(self) -> Field:
        """Slopes of the means, shape (anchors, shares)."""
        return np.asarray(self.each.mean(axis=0))

    @property
    def information(self) -> Field:
        """Fisher's, shape (shares, shares): Jᵀ W J without what the scatter over surfaces adds to it.

        An anchor's variance is its tolerance's and that of our mean. Products are of slopes on different surfaces,
        whose scatter cancels in the mean; their own squares would call a quantity determined because seeds differ.
        """
        count = len(self.each)
        scatter = self.misses.var(axis=0, ddof=1) / count if count > 1 else np.zeros(self.misses.shape[1])
        weights = 1.0 / (1.0 + scatter)
        total = count * self.mean
        found = total.T @ (weights[:, None] * total)
        if count > 1:
            found = (found - sum(one.T @ (weights[:, None] * one) for one in self.each)) / (count * (count - 1))
        values, vectors = np.linalg.eigh(found)
        return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)

    def covariance(self, freedom: int) -> tuple[Field, float]:
        """Of the shares, the ranges counting as known before; and the factor that a misfit beyond chance widens by."""
        misfit = float(np.sum(self.mean_misses**2))
        scale = max(1.0, misfit / freedom) if freedom > 0 else 1.0
        prior = np.eye(self.each.shape[2]) / PRIOR_VARIANCE
        return np.linalg.inv(self.information / scale + prior), scale

    def directions(self, scale: float) -> "list[Direction]":
        """Eigenvectors of the information, the best determined first."""
        values, vectors = np.linalg.eigh(self.information / scale)
        found = []
        for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
            sign = 1.0 if vector[np.argmax(np.abs(vector))] > 0.0 else -1.0
            std = 1.0 / math.sqrt(value) if value > 1e-9 * values[-1] else math.inf  # what is left of 0 after rounding
            learnt = value / (value + 1.0 / PRIOR_VARIANCE)
            found.append(Direction(tuple(float(w) for w in sign * vector), std, bool(learnt >= LEARNT_FROM)))
        return found

    def trade_offs(self, best: Field, aimed: Sequence[Anchor]) -> "list[TradeOff]":
        """For each anchor, what the others would gain without it, by slopes."""
        from scipy.optimize import lsq_linear

        low = np.maximum(-FARTHEST, -best) - 1e-9
        high = np.minimum(FARTHEST, 1.0 - best) + 1e-9

        def moved(rows: Sequence[int]) -> Field:
            """Misses of all anchors after the step that suits `rows` best."""
            step = lsq_linear(self.mean[rows], -self.mean_misses[rows], bounds=(low, high)).x
            return np.asarray(self.mean_misses + self.mean @ step)

        everything = moved(range(len(aimed)))
        found = []
        for number, anchor in enumerate(aimed):
            others = [i for i in range(len(aimed)) if i != number]
            if not others:
                continue
            before, after = everything[others], moved(others)[others]
            gains = before**2 - after**2
            first = int(np.argmax(gains))
            found.append(
                TradeOff(
                    anchor.name,
                    float(np.sum(before**2)),
                    float(np.sum(after**2)),
                    aimed[others[first]].name,
                    float(before[first]),
                    float(after[first]),
                )
            )
        return sorted(found, key=lambda trade: trade.without - trade.misfit)


# The result ----------------------------------------------------------------------------------------------------------


def _calibrated(case: Case, ranges: Sequence[ParameterRange], best: Field) -> Case:
    """The case with what was found, on its own cells, and a study of its wear curve where it has none."""
    found = overrides_at(case, ranges, [float(share) for share in best])
    found.pop("grid.cells", None)
    if case.contents.study is None:
        found["study"] = {"sq": {"from": "0.5 um", "to": "4 um", "step": "0.1 um"}, "seeds": CHECK_SEEDS}
    return case.with_overrides(found)


def _parameters(
    case: Case, ranges: Sequence[ParameterRange], best: Field, deviations: Field
) -> list[CalibratedParameter]:
    found = []
    for entry, share, std in zip(ranges, best, deviations, strict=True):
        learnt = float(1.0 - std**2 / PRIOR_VARIANCE)
        reach = (share - std, share + std) if learnt >= LEARNT_FROM else (0.0, 1.0)
        low, high = (entry.value(min(max(end, 0.0), 1.0)) for end in reach)
        found.append(
            CalibratedParameter(
                range=entry,
                start=_start(case, entry),
                value=entry.value(float(share)),
                low=low,
                high=high,
                std_share=float(std),
                learnt=learnt,
                at_end=not EDGE < share < 1.0 - EDGE,
            )
        )
    return found


def _start(case: Case, entry: ParameterRange) -> float | None:
    """What the case itself has, in the range's unit; of a pair in which both are free as one, the first."""
    from asperity.case import split_amount

    value = stated_value(case, entry.key)
    if isinstance(value, list) and entry_of(entry.key)[1] is None:
        value = value[0]
    return None if value is None else float(split_amount(value, entry.unit)[0])


def _compared(curve: WearCurve, anchors: Sequence[Anchor]) -> "pandas.DataFrame":
    """The anchors that the curve's levels can tell."""
    reached = [a for a in anchors if a.sq is not None and np.isfinite(a.of(curve)[0])]
    aimed_without = [a for a in anchors if a.fitted and a not in reached]
    return compare_with_anchors(curve, [*reached, *aimed_without])


def _shown(value: float) -> str:
    return f"{value:.3g}"


def _unit(entry: ParameterRange) -> str:
    return f" {entry.unit}" if entry.unit else ""


def _or_none(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
