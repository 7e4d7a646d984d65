"""How far anchors are missed with any values of the free quantities: on the real solver, each set solved once."""

import itertools
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import numpy as np
import pandas
import scipy

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.paper import Anchor
from asperity.study.curve import WearCurve, sq_points
from asperity.study.evaluate import DONE
from asperity.study.execute import StudyProgress, run_study
from asperity.study.full_film import with_silence
from asperity.study.plan import StudyPlan, plan_points
from asperity.study.ranges import ParameterRange, overrides_at

CHECK_SEEDS = 5
STEP = 0.1  # of a range, either way, over which slopes are taken
MOST_STEPS = 8  # of least squares from one start
NEARER = 1e-2  # of a range, or of the misfit: smaller steps and gains are lost in the roughness
LOST = 20.0  # tolerances that an anchor without a value counts as missed by
EDGE = 0.01  # of a range: a quantity this near to its end would go on


class MisfitSolver:
    """The real solver as a function of shares of the ranges; each set is solved once, and kept in `out`."""

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

    def solve(
        self, wanted: Sequence[Field | None], seeds: int | None = None
    ) -> list[pandas.DataFrame]:
        """The rows of each set of shares (None: the case as it is), all levels and seeds, as one study."""
        sets = [
            {} if shares is None else overrides_at(self.case, self.ranges, shares)
            for shares in wanted
        ]
        points = [{**chosen, **level} for chosen in sets for level in sq_points(self.sq)]
        table = self._run(
            plan_points(self.case, points, seeds=seeds or self.seeds, seeding="common"),
            "evaluations",
        )
        place = table["point"] // len(self.sq)
        return [with_silence(table[place == number]) for number in range(len(sets))]

    def _run(self, plan: StudyPlan, folder: str) -> pandas.DataFrame:
        out = None if self.out is None else self.out / folder
        result = run_study(plan, out=out, executor=self.executor, progress=self.progress)
        self.cases += len(plan.cases)
        self.failed += result.failed
        self.seconds += result.seconds
        return result.table

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
        each = ((anchor, anchor.evaluate(curve)[0]) for anchor in self.aimed)
        return np.array(
            [
                anchor.miss(ours) / anchor.tolerance if np.isfinite(ours) else LOST
                for anchor, ours in each
            ]
        )

    def misfit(self, shares: Field | None) -> float:
        """Sum of the squared misses."""
        return float(np.sum(self.misses(shares) ** 2))

    def checked(self, calibrated: Case) -> WearCurve:
        """The calibrated case on its own cells, on surfaces of its own at every level."""
        plan = plan_points(calibrated, sq_points(self.sq), seeds=CHECK_SEEDS)
        return WearCurve(np.array(self.sq), with_silence(self._run(plan, "check")))


def _name(shares: Field | None) -> tuple[float, ...] | None:
    return None if shares is None else tuple(float(share) for share in shares)


def least_misfit(solver: MisfitSolver, screened: int, starts: int, seed: int) -> Field:
    """The shares of least misfit among all that were tried."""
    count = len(solver.ranges)
    cube = [
        np.round(shares, 6)
        for shares in scipy.stats.qmc.LatinHypercube(count, rng=seed).random(screened)
    ]
    solver.learn([None, *cube])
    if not any((table["status"] == DONE).any() for table in solver.known.values()):
        reasons = next(iter(solver.known.values()))["reason"]
        raise AsperityError(f"no parameter set could be solved: {reasons.iloc[0]}")
    for first in sorted(cube, key=solver.misfit)[:starts]:
        scipy.optimize.least_squares(
            solver.misses,
            np.clip(first, EDGE, 1.0 - EDGE),
            jac=partial(_central, solver),
            bounds=(0.0, 1.0),
            max_nfev=MOST_STEPS,
            xtol=NEARER,
            ftol=NEARER,
        )
    return min(
        (np.array(shares) for shares in solver.known if shares is not None), key=solver.misfit
    )


def neighbours(shares: Field) -> list[tuple[Field, Field]]:
    """For each share the two sets STEP below and above it, inside the ranges."""
    pairs = []
    for i in range(shares.size):
        low, high = shares.copy(), shares.copy()
        low[i], high[i] = max(shares[i] - STEP, 0.0), min(shares[i] + STEP, 1.0)
        pairs.append((low, high))
    return pairs


def _central(solver: MisfitSolver, shares: Field) -> Field:
    """Slopes of the misses by differences, shape (anchors, shares); all that they need in one study."""
    pairs = neighbours(shares)
    solver.learn([shares, *itertools.chain(*pairs)])
    columns = [
        (solver.misses(high) - solver.misses(low)) / (high[i] - low[i])
        for i, (low, high) in enumerate(pairs)
    ]
    return np.stack(columns, axis=1)
