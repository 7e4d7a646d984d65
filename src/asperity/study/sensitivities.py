"""How the misses of anchors move with the free quantities, and what that determines of them, for each surface apart."""

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

PRIOR_VARIANCE = 1.0 / 12.0  # of a share that may be anything from 0 to 1
FARTHEST = 0.3  # of a range, to which slopes are trusted


@dataclass(frozen=True)
class MisfitSlopes:
    """Misses at the best set and their slopes, for each surface apart."""

    misses: Field  # (seeds, anchors), in tolerances
    each: Field  # (seeds, anchors, shares); rows of bounds that are kept are 0

    @classmethod
    def at(cls, solver: MisfitSolver, best: Field, seeds: int) -> "MisfitSlopes":
        """By differences over STEP either way, on more surfaces than the fit had."""
        pairs = neighbours(best)
        tables = solver.solve([best, *itertools.chain(*pairs)], seeds)

        def values(table: pandas.DataFrame) -> Field:
            """Shape (seeds, anchors): what each surface by itself gives."""
            each = np.full((seeds, len(solver.aimed)), np.nan)
            for seed in range(seeds):
                rows = table[(table["realisation"] == seed) & (table["status"] == DONE)]
                if len(rows) == len(solver.sq):
                    curve = WearCurve(np.array(solver.sq), rows)
                    each[seed] = [anchor.evaluate(curve)[0] for anchor in solver.aimed]
            return each

        here, *around = (values(table) for table in tables)
        tolerances = np.array([anchor.tolerance for anchor in solver.aimed])
        slopes = np.stack(
            [
                (around[2 * i + 1] - around[2 * i]) / (high[i] - low[i]) / tolerances
                for i, (low, high) in enumerate(pairs)
            ],
            axis=2,
        )
        whole = np.isfinite(here).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2))
        if not whole.any():
            raise AsperityError(
                "no surface could be solved all around the best set; give more seeds"
            )
        mean = here[whole].mean(axis=0)
        off = np.array(
            [anchor.miss(value) for anchor, value in zip(solver.aimed, mean, strict=True)]
        )
        active = np.array(
            [a.sense == "about" or m != 0.0 for a, m in zip(solver.aimed, off, strict=True)]
        )
        misses = (here[whole] - mean + off) / tolerances
        return cls(
            np.where(active, misses, 0.0), np.where(active[None, :, None], slopes[whole], 0.0)
        )

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

        An anchor's variance is its tolerance's and that of our mean. Products are of slopes on
        different surfaces, whose scatter cancels in the mean; their own squares would call a
        quantity determined because seeds differ.
        """
        count = len(self.each)
        scatter = (
            self.misses.var(axis=0, ddof=1) / count if count > 1 else np.zeros(self.misses.shape[1])
        )
        weights = 1.0 / (1.0 + scatter)
        total = count * self.mean
        information = total.T @ (weights[:, None] * total)
        if count > 1:
            own = sum(slopes.T @ (weights[:, None] * slopes) for slopes in self.each)
            information = (information - own) / (count * (count - 1))
        values, vectors = np.linalg.eigh(information)
        return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)

    def covariance(self, freedom: int) -> tuple[Field, float]:
        """Of the shares, the ranges counting as known before; and the factor that a misfit beyond chance widens by."""
        misfit = float(np.sum(self.mean_misses**2))
        scale = max(1.0, misfit / freedom) if freedom > 0 else 1.0
        prior = np.eye(self.each.shape[2]) / PRIOR_VARIANCE
        return np.linalg.inv(self.information / scale + prior), scale

    def directions(self, scale: float) -> list[ParameterDirection]:
        """Eigenvectors of the information, the best determined first."""
        values, vectors = np.linalg.eigh(self.information / scale)
        directions = []
        for value, vector in zip(values[::-1], vectors.T[::-1], strict=True):
            sign = 1.0 if vector[np.argmax(np.abs(vector))] > 0.0 else -1.0
            std = (
                1.0 / math.sqrt(value) if value > 1e-9 * values[-1] else math.inf
            )  # what is left of 0 after rounding
            learnt = value / (value + 1.0 / PRIOR_VARIANCE)
            directions.append(
                ParameterDirection(
                    tuple((sign * vector).tolist()), std, bool(learnt >= LEARNT_FROM)
                )
            )
        return directions

    def trade_offs(self, best: Field, aimed: Sequence[Anchor]) -> list[TradeOff]:
        """For each anchor, what the others would gain without it, by slopes."""
        low = np.maximum(-FARTHEST, -best) - 1e-9
        high = np.minimum(FARTHEST, 1.0 - best) + 1e-9

        def moved(rows: Sequence[int]) -> Field:
            """Misses of all anchors after the step that suits `rows` best."""
            step = scipy.optimize.lsq_linear(
                self.mean[rows], -self.mean_misses[rows], bounds=(low, high)
            ).x
            return np.asarray(self.mean_misses + self.mean @ step)

        everything = moved(range(len(aimed)))
        trade_offs = []
        for number, anchor in enumerate(aimed):
            others = [i for i in range(len(aimed)) if i != number]
            if not others:
                continue
            before, after = everything[others], moved(others)[others]
            most = int(np.argmax(before**2 - after**2))
            misfits, misses = (
                (float(np.sum(before**2)), float(np.sum(after**2))),
                (before[most], after[most]),
            )
            trade_offs.append(
                TradeOff(anchor.name, *misfits, aimed[others[most]].name, *map(float, misses))
            )
        return sorted(trade_offs, key=lambda trade: trade.without - trade.misfit)
