"""Slopes of the anchors' residuals for each surface, and the information they contain."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas
import scipy

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.paper import Anchor
from asperity.study.anchor_misfit import MisfitSolver, neighbours
from asperity.study.calibration_result import LEARNT_FROM, ParameterDirection, TradeOff
from asperity.study.curve import WearCurve
from asperity.study.evaluate import DONE

PRIOR_VARIANCE = 1.0 / 12.0  # of a share uniformly distributed from 0 to 1
MAX_STEP = 0.3  # largest step for which slopes are trusted, as a fraction of a range


@dataclass(frozen=True)
class MisfitSlopes:
    """Residuals at the best set and their slopes, for each surface."""

    residuals: Field  # (seeds, anchors), in tolerances
    slopes: Field  # (seeds, anchors, shares); rows of satisfied bounds are 0

    @classmethod
    def from_differences(cls, solver: MisfitSolver, best: Field, seeds: int) -> "MisfitSlopes":
        """Take central differences over STEP on both sides, on more surfaces than the fit."""
        pairs = neighbours(best)
        targets = solver.targets
        tables = solver.solve([best, *itertools.chain(*pairs)], seeds)
        centre, *adjacent = (_anchored_values(solver, table, seeds) for table in tables)
        tolerances = np.array([anchor.tolerance for anchor in targets])
        slopes = np.stack(
            [
                (adjacent[2 * i + 1] - adjacent[2 * i]) / (high[i] - low[i]) / tolerances
                for i, (low, high) in enumerate(pairs)
            ],
            axis=2,
        )
        solved = np.isfinite(centre).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
        if not solved.any():
            raise AsperityError(
                "no surface could be solved at all neighbours of the best set; give more seeds"
            )
        centre, slopes = centre[solved], slopes[solved]
        mean = centre.mean(axis=0)
        misses = _misses(targets, mean)
        active = np.array([anchor.sense == "about" for anchor in targets]) | (misses != 0.0)
        residuals = np.where(active, (centre - mean + misses) / tolerances, 0.0)
        return cls(residuals, np.where(active[None, :, None], slopes, 0.0))

    @property
    def mean_residuals(self) -> Field:
        """Mean residuals over surfaces, shape (anchors,), in tolerances."""
        return np.asarray(self.residuals.mean(axis=0))

    @property
    def mean(self) -> Field:
        """Mean slopes over surfaces, shape (anchors, shares)."""
        return np.asarray(self.slopes.mean(axis=0))

    @property
    def information(self) -> Field:
        """Fisher information Jᵀ W J, shape (shares, shares), without the scatter over surfaces.

        An anchor's variance is that of its tolerance plus that of the computed mean. Only slopes
        of different surfaces are multiplied, so that their scatter cancels in the mean; squares of
        single slopes would make a quantity appear determined because seeds differ.
        """
        count = len(self.slopes)
        scatter = (
            self.residuals.var(axis=0, ddof=1) / count
            if count > 1
            else np.zeros(self.residuals.shape[1])
        )
        weights = 1.0 / (1.0 + scatter)
        total = count * self.mean
        information = total.T @ (weights[:, None] * total)
        if count > 1:
            diagonal = sum(slopes.T @ (weights[:, None] * slopes) for slopes in self.slopes)
            information = (information - diagonal) / (count * (count - 1))
        values, vectors = np.linalg.eigh(information)
        return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)

    def covariance(self, freedom: int) -> tuple[Field, float]:
        """Return the posterior covariance of the shares and the scale factor of the misfit."""
        misfit = float(np.sum(self.mean_residuals**2))
        scale = max(1.0, misfit / freedom) if freedom > 0 else 1.0
        prior = np.eye(self.slopes.shape[2]) / PRIOR_VARIANCE
        return np.linalg.inv(self.information / scale + prior), scale

    def directions(self, scale: float) -> list[ParameterDirection]:
        """Return the eigenvectors of the information, the best determined first."""
        values, vectors = np.linalg.eigh(self.information / scale)
        directions = []
        for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
            sign = 1.0 if vector[np.argmax(np.abs(vector))] > 0.0 else -1.0
            # eigenvalues at rounding level count as 0
            std = 1.0 / math.sqrt(value) if value > 1e-9 * values[-1] else math.inf
            learnt = value / (value + 1.0 / PRIOR_VARIANCE)
            directions.append(
                ParameterDirection(
                    tuple((sign * vector).tolist()), std, bool(learnt >= LEARNT_FROM)
                )
            )
        return directions

    def trade_offs(self, best: Field, aimed: Sequence[Anchor]) -> list[TradeOff]:
        """Return, for each anchor, the linearised gain of the others without it."""
        low = np.maximum(-MAX_STEP, -best) - 1e-9
        high = np.minimum(MAX_STEP, 1.0 - best) + 1e-9

        def fitted(rows: Sequence[int]) -> Field:
            """Return the residuals of all anchors after the best step for `rows`."""
            step = scipy.optimize.lsq_linear(
                self.mean[rows], -self.mean_residuals[rows], bounds=(low, high)
            ).x
            return np.asarray(self.mean_residuals + self.mean @ step)

        all_fitted = fitted(range(len(aimed)))
        trade_offs = []
        for number, anchor in enumerate(aimed):
            others = [i for i in range(len(aimed)) if i != number]
            if not others:
                continue
            before = all_fitted[others]
            after = fitted(others)[others]
            largest = int(np.argmax(before**2 - after**2))
            trade_offs.append(
                TradeOff(
                    anchor.name,
                    float(np.sum(before**2)),
                    float(np.sum(after**2)),
                    aimed[others[largest]].name,
                    float(before[largest]),
                    float(after[largest]),
                )
            )
        return sorted(trade_offs, key=lambda trade: trade.without - trade.misfit)


def _misses(anchors: Sequence[Anchor], values: Field) -> Field:
    return np.array([anchor.miss(value) for anchor, value in zip(anchors, values, strict=True)])


def _anchored_values(solver: MisfitSolver, table: pandas.DataFrame, seeds: int) -> Field:
    """Return the anchored quantities of each surface, shape (seeds, anchors)."""
    by_seed = np.full((seeds, len(solver.targets)), np.nan)
    for seed in range(seeds):
        rows = table[(table["realisation"] == seed) & (table["status"] == DONE)]
        if len(rows) == len(solver.sq):
            curve = WearCurve(np.array(solver.sq), rows)
            by_seed[seed] = [anchor.evaluate(curve)[0] for anchor in solver.targets]
    return by_seed
