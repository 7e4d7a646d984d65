"""Misfit of a case's wear curve to anchors, as a function of the free quantities."""

import itertools
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pandas
import scipy

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.paper import Anchor
from asperity.study.curve import WearCurve, sq_points
from asperity.study.evaluate import DONE
from asperity.study.full_film import with_full_film_limits
from asperity.study.plan import StudyPlan, plan_points
from asperity.study.ranges import ParameterRange, overrides_at
from asperity.study.result import StudyResult

CHECK_SEEDS = 5
STEP = 0.1  # half-width of the central differences, as a fraction of a range
MAX_STEPS = 8  # of least squares from one start
TOLERANCE = 1e-2  # of a range or of the misfit; smaller changes are noise of the realisation
MISSING_RESIDUAL = 20.0  # residual of an anchor without a value, in tolerances
EDGE = 0.01  # fraction of a range within which a value counts as being at its end


class MisfitSolver:
    """The contact solver as a function of fractions of the ranges; each set is solved once.

    `run` computes a plan, stored under the given name.
    """

    def __init__(
        self,
        case: Case,
        ranges: Sequence[ParameterRange],
        targets: Sequence[Anchor],
        sq: Sequence[float],
        seeds: int,
        run: Callable[[StudyPlan, str], StudyResult],
    ) -> None:
        self.case, self.ranges, self.targets, self.sq, self.seeds = case, ranges, targets, sq, seeds
        self.run = run
        self.solved: dict[tuple[float, ...] | None, pandas.DataFrame] = {}
        self.cases = self.failed = 0
        self.seconds = 0.0

    def solve(
        self, parameter_sets: Sequence[Field | None], seeds: int | None = None
    ) -> list[pandas.DataFrame]:
        """Solve sets of shares (None: the case itself) at all levels and seeds as one study."""
        sets = [
            {} if shares is None else overrides_at(self.case, self.ranges, shares)
            for shares in parameter_sets
        ]
        points = [{**chosen, **level} for chosen in sets for level in sq_points(self.sq)]
        table = self._run(
            plan_points(self.case, points, seeds=seeds or self.seeds, seeding="common"),
            "evaluations",
        )
        set_number = table["point"] // len(self.sq)
        return [with_full_film_limits(table[set_number == number]) for number in range(len(sets))]

    def _run(self, plan: StudyPlan, folder: str) -> pandas.DataFrame:
        result = self.run(plan, folder)
        self.cases += len(plan.cases)
        self.failed += result.failed
        self.seconds += result.seconds
        return result.table

    def solve_missing(self, parameter_sets: Sequence[Field | None]) -> None:
        """Solve the sets that have not been solved yet."""
        new = [shares for shares in parameter_sets if _name(shares) not in self.solved]
        if new:
            self.solved.update(zip(map(_name, new), self.solve(new), strict=True))

    def curve(self, shares: Field | None) -> WearCurve:
        """Return the wear curve of one set."""
        self.solve_missing([shares])
        return WearCurve(np.array(self.sq), self.solved[_name(shares)])

    def residuals(self, shares: Field | None) -> Field:
        """Return the residual of each fitted anchor, in its tolerances."""
        curve = self.curve(shares)
        if not (curve.table["status"] == DONE).any():
            return np.full(len(self.targets), MISSING_RESIDUAL)
        values = ((anchor, anchor.evaluate(curve)[0]) for anchor in self.targets)
        return np.array(
            [
                anchor.miss(value) / anchor.tolerance if np.isfinite(value) else MISSING_RESIDUAL
                for anchor, value in values
            ]
        )

    def misfit(self, shares: Field | None) -> float:
        """Return the sum of squared residuals."""
        return float(np.sum(self.residuals(shares) ** 2))

    def check(self, calibrated: Case) -> WearCurve:
        """Solve the calibrated case on its own grid, with independent surfaces at every level."""
        plan = plan_points(calibrated, sq_points(self.sq), seeds=CHECK_SEEDS)
        return WearCurve(np.array(self.sq), with_full_film_limits(self._run(plan, "check")))


def _name(shares: Field | None) -> tuple[float, ...] | None:
    return None if shares is None else tuple(float(share) for share in shares)


def least_misfit(solver: MisfitSolver, screened: int, starts: int, seed: int) -> Field:
    """Return the shares of least misfit among all sets tried."""
    count = len(solver.ranges)
    cube = [
        np.round(shares, 6)
        for shares in scipy.stats.qmc.LatinHypercube(count, rng=seed).random(screened)
    ]
    solver.solve_missing([None, *cube])
    if not any((table["status"] == DONE).any() for table in solver.solved.values()):
        reasons = next(iter(solver.solved.values()))["reason"]
        raise AsperityError(f"no parameter set could be solved: {reasons.iloc[0]}")
    for first in sorted(cube, key=solver.misfit)[:starts]:
        scipy.optimize.least_squares(
            solver.residuals,
            np.clip(first, EDGE, 1.0 - EDGE),
            jac=partial(_central_differences, solver),
            bounds=(0.0, 1.0),
            max_nfev=MAX_STEPS,
            xtol=TOLERANCE,
            ftol=TOLERANCE,
        )
    return min(
        (np.array(shares) for shares in solver.solved if shares is not None), key=solver.misfit
    )


def neighbours(shares: Field) -> list[tuple[Field, Field]]:
    """Return, for each share, the two sets STEP below and above it, inside the ranges."""
    pairs = []
    for i in range(shares.size):
        low, high = shares.copy(), shares.copy()
        low[i], high[i] = max(shares[i] - STEP, 0.0), min(shares[i] + STEP, 1.0)
        pairs.append((low, high))
    return pairs


def _central_differences(solver: MisfitSolver, shares: Field) -> Field:
    """Return the Jacobian of the residuals, shape (anchors, shares), from one study."""
    pairs = neighbours(shares)
    solver.solve_missing([shares, *itertools.chain(*pairs)])
    columns = [
        (solver.residuals(high) - solver.residuals(low)) / (high[i] - low[i])
        for i, (low, high) in enumerate(pairs)
    ]
    return np.stack(columns, axis=1)
