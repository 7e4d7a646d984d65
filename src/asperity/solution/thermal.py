"""Friction and heat of a solved contact together, and the way back: oil thinned by the heat of its own shearing.

With `Thermal.feedback` the film's temperature sets the oil's shear stress, and its viscosity in
Reynolds' equation; without it heat is only a result.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, NotConverged
from asperity.ehl import ContactSolution, Options, SolveStatus, solve_contact
from asperity.ehl.strategies.grid_continuation import Progress
from asperity.lubricant import Lubricant, Thermal
from asperity.solution.flash import FlashTemperature, flash_temperature
from asperity.solution.traction import BOUNDARY_FRICTION, Friction, friction, warm_factor
from asperity.surface import Surface

SETTLED = 1e-3  # change of the film's temperature, over its largest rise
LEAST_RISE = 1.0  # [K]; below it the change is measured against this
MOST_ROUNDS = 400
HOT = 30.0  # rise of the film [K] that no oil stays as viscous through
MOST_SOLVES = 25
MOST_WARM_ITERATIONS = 40  # a solve that starts from one a little colder takes ten
MEMORY = 5  # rounds that the next guess is mixed from


def friction_and_heat(
    solution: ContactSolution,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
) -> tuple[Friction, FlashTemperature]:
    """Friction and flash temperature; with `thermal.feedback` each at the other's value.

    Raises
    ------
    BadInput
        for a boundary friction outside 0 to 2.
    AsperityError
        if friction and temperature do not settle.
    """
    thermal = thermal or Thermal()
    if not thermal.feedback or solution.lubricant is None:
        rubbing = friction(solution, boundary_friction=boundary_friction, thermal=thermal)
        return rubbing, flash_temperature(solution, rubbing, thermal=thermal)
    rise: Field = np.zeros(solution.grid.cells)
    mixer = Mixer()
    for _ in range(MOST_ROUNDS):
        rubbing = friction(
            solution,
            boundary_friction=boundary_friction,
            thermal=thermal,
            film_temperature=thermal.ambient + rise,
        )
        heat = flash_temperature(solution, rubbing, thermal=thermal)
        change = heat.film - rise
        left = float(np.max(np.abs(change)))
        if left < SETTLED * max(heat.film_max_k, LEAST_RISE):
            return rubbing, heat
        # a cell's own warming thins its oil and cools it: the step of Newton's method that sees
        # this and nothing else
        warm = thermal.ambient + rise
        thinning = np.log(
            warm_factor(solution, thermal, warm) / warm_factor(solution, thermal, warm + 1.0)
        )
        rise = mixer(rise, change / (1.0 + thinning * np.maximum(heat.film, 0.0)))
    raise AsperityError(
        f"friction and temperature did not settle: {left:.2g} K apart after {MOST_ROUNDS} rounds; "
        "take the feedback of heat out, or a friction law with a limit"
    )


class Mixer:
    """The next guess of a fixed point from the last few: Anderson's method, with half the step after a worse round.

    Source: D. G. Anderson, J. ACM 12 (1965) 547.
    """

    def __init__(self) -> None:
        self.share, self.before = 1.0, np.inf
        self.guesses: list[Field] = []
        self.changes: list[Field] = []

    def __call__(self, guess: Field, change: Field) -> Field:
        """A better guess than `guess`, which the iteration would change by `change`."""
        left = float(np.linalg.norm(change))
        if left > self.before:
            self.share = max(0.5 * self.share, 0.05)
            self.guesses, self.changes = [], []
        self.before = left
        self.guesses = [*self.guesses[-MEMORY:], guess]
        self.changes = [*self.changes[-MEMORY:], change]
        if len(self.guesses) == 1:
            return np.asarray(guess + self.share * change)
        guesses = np.stack([(new - old).ravel() for old, new in pairwise(self.guesses)], axis=1)
        changes = np.stack([(new - old).ravel() for old, new in pairwise(self.changes)], axis=1)
        weights = np.linalg.lstsq(changes, change.ravel(), rcond=1e-10)[0]
        return (
            guess
            + self.share * change
            - ((guesses + self.share * changes) @ weights).reshape(guess.shape)
        )


def solve_thermal_contact(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    surface: Surface,
    *,
    boundary_friction: float = BOUNDARY_FRICTION,
    thermal: Thermal | None = None,
    options: Options | None = None,
    start: ContactSolution | None = None,
    strict: bool = True,
    progress: Progress | None = None,
) -> ContactSolution:
    """Solve the contact with the oil as viscous as the film's own temperature leaves it, if `thermal.feedback` asks.

    Contact and heat are solved in turn until the film's temperature stands still (root mean square
    of its change below a thousandth of its largest rise). Parameters are those of `solve_contact`
    and `friction_and_heat`; the solution carries the viscosity factors, and all steps of all
    rounds.

    Raises
    ------
    BadInput, NotConverged, AsperityError
        as those two; NotConverged too if contact and heat do not settle.
    """
    thermal = thermal or Thermal()
    solution = solve_contact(
        conditions,
        lubricant,
        surface,
        options=options,
        start=start,
        strict=strict,
        progress=progress,
    )
    nothing_fed_back = lubricant is None or not thermal.feedback or conditions.sliding_speed == 0.0
    if nothing_fed_back or not solution.convergence.converged:
        return solution
    history, seconds = solution.convergence.history, solution.convergence.seconds
    options = options or Options()
    few = replace(options, max_iterations=min(options.max_iterations, MOST_WARM_ITERATIONS))
    solved_at: Field = np.zeros(
        surface.grid.cells
    )  # rise of the film that the solution's viscosity belongs to
    share, settled = 1.0, False
    for _ in range(MOST_SOLVES):
        film = friction_and_heat(solution, boundary_friction=boundary_friction, thermal=thermal)[
            1
        ].film
        left = float(np.sqrt(np.mean((film - solved_at) ** 2)))
        settled = left < SETTLED * max(float(np.max(film)), LEAST_RISE)
        if settled:
            break
        wanted = solved_at + share * (film - solved_at)
        warmer = solve_contact(
            conditions,
            lubricant,
            surface,
            options=few,
            start=solution,
            viscosity_factor=warm_factor(solution, thermal, thermal.ambient + wanted),
            strict=False,
            progress=progress,
        )
        history, seconds = (
            history + warmer.convergence.history,
            seconds + warmer.convergence.seconds,
        )
        if warmer.convergence.converged:
            solution, solved_at, share = (
                replace(warmer, options=options),
                wanted,
                min(1.0, 2.0 * share),
            )
        else:  # too far from cold to hot: go part of the way
            share *= 0.5
    status = SolveStatus.CONVERGED if settled else SolveStatus.OUT_OF_ITERATIONS
    ending = replace(solution.convergence, status=status, history=history, seconds=seconds)
    solution = replace(solution, convergence=ending)
    if strict and not ending.converged:
        raise NotConverged(solution, f"contact and heat did not settle in {MOST_SOLVES} rounds")
    return solution
