"""Search for a solution of the two-pressure models: its record, and the driver of strategies."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from asperity.ehl.contact_solution import Oil
from asperity.ehl.controls import CONTINUATION, RESIDUALS, SEARCH
from asperity.ehl.models.mixed import MixedBalance, Pressures
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.newton.mixed import newton
from asperity.ehl.newton.single_pressure import Step
from asperity.ehl.scales import Scales
from asperity.ehl.strategies.grid_continuation import Search
from asperity.ehl.strategies.oil_state import oil_of, unknowns_of


class Level(NamedTuple):
    """A grid's place in the search.

    `coarse` if it is not the finest; `length` of the first of its time steps, in half-widths;
    `last` if conserved oil that fails in time steps is to be solved in another way.
    """

    coarse: bool = False
    length: float = 1.0
    last: bool = True


FINEST = Level()


class GridStrategy(ABC):
    """Way to solve a contact on one grid from an initial guess."""

    def applies(self, problem: Problem, _guess: Pressures) -> bool:
        """Return True where the strategy can be used."""
        return not problem.exact

    def target(self, search: "MixedSearch", problem: Problem, level: Level) -> tuple[float, int]:
        """Return the tolerance by which the strategy is judged, and its largest number of steps."""
        options = search.options
        if not level.coarse:
            return options.tolerance, options.max_iterations
        tolerance = max(self.coarse_tolerance(problem), options.tolerance)
        return tolerance, min(CONTINUATION.max_iterations, options.max_iterations)

    def coarse_tolerance(self, _problem: Problem) -> float:
        """Return the tolerance on a coarser grid."""
        return RESIDUALS.coarse_grid

    @abstractmethod
    def solve(
        self, search: "MixedSearch", problem: Problem, guess: Pressures, level: Level
    ) -> Step:
        """Return the last step."""


class MixedSearch(Search):
    """Steps of the two-pressure models on record, whichever strategy takes them."""

    imbalance = 0.0  # of the last step, where oil is conserved
    max_imbalance = np.inf  # largest one allowed, at any tolerance
    solved: Sequence[tuple[Problem, Pressures]] = ()  # of the figures
    arithmetic = False  # the last step has arithmetic means in place of exact face mobilities
    is_guess = False  # the solution is only an initial guess for exact face mobilities

    def prepare(self, finest: Problem) -> None:
        """Forget the figures of an earlier strategy."""
        self.cell, self.by_first_order = finest.spacing[0], None

    def first_converged(
        self,
        strategies: Sequence[GridStrategy],
        problem: Problem,
        guess: Pressures,
        level: Level = FINEST,
    ) -> Step:
        """Try the strategies that apply in turn, all from the same guess, until one converges."""
        for strategy in strategies:
            if strategy.applies(problem, guess):
                step = strategy.solve(self, problem, guess, level)
                if self.converged(strategy.target(self, problem, level)[0]):
                    break
        return step

    def steps(
        self,
        problem: Problem,
        unknowns: Pressures,
        tolerance: float,
        max_steps: int,
        *,
        second_order: bool = False,
        shared: bool | None = None,
        divergence: float = np.inf,
    ) -> Step:
        """Take Newton steps with the wedge of either order; see `newton` and `run`."""
        steps = newton(problem, unknowns, second_order=second_order, shared=shared)
        return self.run(problem, steps, tolerance, max_steps, divergence=divergence)

    def converged(self, tolerance: float, *, check_load: bool = True) -> bool:
        """Return True if the last step met the tolerance; if last, with conserved oil balanced."""
        closely = tolerance <= self.options.tolerance
        allowed = max(SEARCH.max_imbalance, SEARCH.imbalance_to_tolerance * tolerance)
        return super().converged(tolerance, check_load=check_load) and (
            self.imbalance <= min(self.max_imbalance, allowed if closely else np.inf)
        )

    def keep(self, problem: Problem, step: Step) -> None:
        """Keep the figures of a grid's solution, for the estimate of the discretisation error."""
        self.figures.append(self.figures_of(step))
        self.solved = [*self.solved, (problem, unknowns_of(step))][-len(self.figures) :]

    def oil(self, step: Step, lines: int, scales: Scales) -> Oil:
        """Return the state of the oil."""
        return oil_of(step, lines, scales)

    def _record(self, problem: Problem, step: Step) -> None:
        """Record a step and the imbalance of conserved oil."""
        balance = step.balance
        self.imbalance = (
            balance.imbalance if isinstance(balance, MixedBalance) and problem.conserve else 0.0
        )
        super()._record(problem, step)
