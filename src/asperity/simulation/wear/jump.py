"""One jump of a wearing contact: its length, the removal, and the mechanisms that follow.

Order: the contact is solved at positions of the tracks; the initial rate of the law is integrated
over the jump; plastic flattening is kept; then each mechanism is applied, body by body.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.simulation.wear.contact import PositionSolver, SolvedPosition
from asperity.simulation.wear.state import WearState
from asperity.simulation.wear.tracks import BODIES, WearingTracks
from asperity.wear import (
    Change,
    Exposure,
    MechanismState,
    Passage,
    Patch,
    RubbingConditions,
    TrackPosition,
    is_uniform_along,
    longest_jump,
    map_to_track,
    removed_depth,
    to_other_track,
)

Solutions = Sequence[tuple[TrackPosition, SolvedPosition]]
# largest difference in Sq, relative, between two successive jumps and one jump over both
MAX_JUMP_ERROR = 1e-3
FIRST_JUMP = 0.5  # of the longest jump: the first jump has none before it to compare with
JUMP_REDUCTION, MIN_JUMP = 0.7, 1.0 / 64.0  # factor per reduction, and the limit


@dataclass(frozen=True)
class WearingContact(WearingTracks):
    """Contact of a case that wears: what stays the same from jump to jump."""

    @cached_property
    def solver(self) -> PositionSolver:
        """Solver of the contact at a position."""
        return PositionSolver.from_case(self.case, flattening=self.model.flattening)

    def exposures(self, solutions: Solutions = ()) -> tuple[Exposure, Exposure]:
        """Return the exposure of each body to the contact, solved at those positions.

        Without `solutions`, the contact is taken at ambient temperature.
        """
        conditions = self.case.conditions
        first, second = (
            Exposure(
                k=coefficient.k * self._law_factor(solutions, index),
                body=body,
                overrolling=rate,
                width=2.0 * conditions.hertz.half_widths[0],
                sliding_speed=conditions.sliding_speed,
            )
            for index, coefficient, body, rate in zip(
                BODIES, self.model.coefficients, self.bodies, self.overrolling, strict=True
            )
        )
        return first, second

    def _law_factor(self, solutions: Solutions, body: int) -> float:
        """Return the largest ratio of the law to pressure times sliding speed: 1 for Archard's."""
        cold = RubbingConditions(
            pressure=np.ones(1),
            shear=np.full(1, self.case.boundary_friction),
            sliding_speed=self.case.conditions.sliding_speed,
            temperature=np.full(1, self.case.thermal.ambient),
        )
        worst = 0.0
        for rubbing in [self.rubbing(solved, body) for _, solved in solutions] or [cold]:
            by_archard = rubbing.pressure * rubbing.sliding_speed
            rubs = by_archard > 0.0
            worst = max(
                worst, float(np.max(self.model.law(rubbing)[rubs] / by_archard[rubs], initial=0.0))
            )
        return worst

    def rubbing(self, solved: SolvedPosition, body: int) -> RubbingConditions:
        """Return the input of the wear law for a body at a position."""
        needed = self.model.law.needs_temperature
        if needed and solved.temperatures is None:
            raise BadInput(
                f"{self.case.source}: the wear law needs the contact temperature, which could "
                "not be computed; choose another law"
            )
        temperature = None
        if needed and solved.temperatures is not None:
            temperature = self.case.thermal.ambient + solved.temperatures[body]
        return RubbingConditions(
            pressure=solved.asperity_pressure,
            shear=self.case.boundary_friction * solved.asperity_pressure,
            sliding_speed=self.case.conditions.sliding_speed,
            temperature=temperature,
        )

    def rate(self, state: WearState, solutions: Solutions, body: int) -> Field:
        """Return the rate of depth loss of a body's track [m/s]."""
        surface = (self.surfaces.first, self.surfaces.second)[body]
        on_track = [
            map_to_track(
                self.model.law(self.rubbing(solved, body)), surface.grid.cells, position, body
            )
            for position, solved in solutions
        ]
        depth_rate_factor = self.exposures()[body].depth_rate_factor(surface.grid.extent[0])
        rate = self.model.coefficients[body].k * depth_rate_factor * np.mean(on_track, axis=0)
        if self.bodies[body].speed != 0.0 and is_uniform_along(
            surface.heights - state.lowered(body)
        ):
            # each point of a uniform track passes every position
            rate = np.broadcast_to(rate.mean(axis=0), rate.shape).copy()
        return np.asarray(rate)

    def booked_rate(self, solutions: Solutions, body: int) -> float:
        """Return the volume a body loses by the law [m^3/s]: k times the law's mean sum."""
        (dx, dy) = self.surfaces.grid.spacing
        grid = self.surfaces.grid
        sums = [float(self.model.law(self.rubbing(solved, body)).sum()) for _, solved in solutions]
        return (
            self.model.coefficients[body].k
            * float(np.mean(sums))
            * dx
            * dy
            * self.width
            / grid.extent[1]
        )

    def seconds(self, state: WearState, solutions: Solutions) -> float:
        """Return the length of the jump from the contacts at those positions [s]."""
        rates = self.rate(state, solutions, 0), self.rate(state, solutions, 1)
        exposures = self.exposures(solutions)
        spacing = self.surfaces.grid.spacing
        height = self.model.step * self.height(state)
        modulus = self.case.conditions.pair.reduced_modulus
        longest = longest_jump(exposures, rates, height, self.model.decay, spacing, modulus)
        longest = min(longest, state.longest)
        if self.model.flattening or (state.number == 0 and self.model.mechanisms):
            slowest = min((rate for rate in self.overrolling if rate > 0.0), default=1.0)
            # fast initial changes need short jumps
            longest = min(longest, max(state.time, 1.0 / slowest))
        return self._within_error(state, rates, exposures, longest)

    def _within_error(
        self,
        state: WearState,
        rates: tuple[Field, Field],
        exposures: tuple[Exposure, Exposure],
        longest: float,
    ) -> float:
        """Return the longest jump within MAX_JUMP_ERROR of the previous one; solves nothing."""
        if math.isinf(longest):
            return longest
        if state.seconds == 0.0:
            return FIRST_JUMP * longest
        seconds = longest
        while seconds > MIN_JUMP * longest:
            if (
                self._error(state, self._removed(rates, seconds, exposures), exposures, seconds)
                <= MAX_JUMP_ERROR
            ):
                break
            seconds *= JUMP_REDUCTION
        return seconds

    def after_jump(self, state: WearState, solutions: Solutions, seconds: float) -> WearState:
        """Return both bodies after a jump of `seconds` from the contacts at those positions."""
        rates = self.rate(state, solutions, 0), self.rate(state, solutions, 1)
        exposures = self.exposures(solutions)
        removed = self._removed(rates, seconds, exposures)
        booked = tuple(
            state.booked[body] + self.booked_rate(solutions, body) * seconds for body in BODIES
        )
        depths = state.worn[0] + removed[0], state.worn[1] + removed[1]
        after = replace(
            state,
            number=state.number + 1,
            time=state.time + seconds,
            worn=depths,
            flattened=self._flattening(state, solutions),
            booked=(booked[0], booked[1]),
            error=state.error + self._error(state, removed, exposures, seconds),
            rates=rates,
            seconds=seconds,
            longest=math.inf,
            facts={},
        )
        for index, name in enumerate(self.model.mechanisms):
            for body in BODIES:
                after = self._with_mechanism(
                    state, after, solutions, removed[body], name, (body, index)
                )
        return after

    def _removed(
        self, rates: tuple[Field, Field], seconds: float, exposures: tuple[Exposure, Exposure]
    ) -> tuple[Field, Field]:
        modulus = self.case.conditions.pair.reduced_modulus
        tracks = (self.surfaces.first, self.surfaces.second)
        first, second = (
            removed_depth(rates[body], seconds, exposures[body], tracks[body].grid, modulus)
            for body in BODIES
        )
        return first, second

    def _flattening(self, state: WearState, solutions: Solutions) -> tuple[Field, Field]:
        """Return the plastic flattening: deepest overlap of each point, shared by rough bodies."""
        if not self.model.flattening:
            return state.flattened
        rough = self.surfaces.rough
        share = 1.0 / max(sum(rough), 1)
        tracks = (self.surfaces.first, self.surfaces.second)
        first, second = (
            state.flattened[body]
            + share
            * rough[body]
            * np.max(
                [
                    map_to_track(solved.overlap, tracks[body].grid.cells, position, body)
                    for position, solved in solutions
                    if solved.overlap is not None
                ],
                axis=0,
            )
            for body in BODIES
        )
        return first, second

    def _error(
        self,
        state: WearState,
        removed: tuple[Field, Field],
        exposures: tuple[Exposure, Exposure],
        seconds: float,
    ) -> float:
        """Return the relative difference in Sq between two successive jumps and one over both."""
        if state.seconds == 0.0:
            return 0.0
        once, twice = (
            self._removed(state.rates, long, exposures)
            for long in (state.seconds, state.seconds + seconds)
        )
        after = replace(state, worn=(state.worn[0] + removed[0], state.worn[1] + removed[1]))
        levels = self.levelled(after)
        tracks = [self.track(after, body) for body in BODIES]
        sq = math.hypot(*(surface.sq for surface in levels))
        at_once = math.hypot(
            *(
                float(
                    np.std(
                        levels[body].heights
                        + (once[body] + removed[body] - twice[body])[tracks[body]]
                    )
                )
                for body in BODIES
            )
        )
        return abs(at_once - sq) / self.height(after)

    def _with_mechanism(
        self,
        state: WearState,
        after: WearState,
        solutions: Solutions,
        removed: Field,
        name: str,
        which: tuple[int, int],
    ) -> WearState:
        """Return the state after one mechanism of one body."""
        body, _ = which
        surfaces = self.worn_surfaces(after)
        surface = (surfaces.first, surfaces.second)[body]
        label = f"{name}.{body + 1}"
        passage = Passage(
            body=body,
            grid=surface.grid,
            heights=surface.heights,
            removed=removed,
            patches=tuple(self._patch(position, solved, body) for position, solved in solutions),
            material=self.bodies[body],
            sliding_speed=self.case.conditions.sliding_speed,
            half_width=self.case.conditions.hertz.half_widths[0],
            overrollings=state.time * self.overrolling[body],
            jump=after.seconds * self.overrolling[body],
            seconds=after.seconds,
            boundary_friction=self.case.boundary_friction,
            rng=np.random.default_rng([self.seed, state.number, *which]),
            state=after.states.get(label, {}),
        )
        change = self.model.mechanisms[name](passage)
        return self._with_change(
            after, change, body, label, [position for position, _ in solutions]
        )

    def _with_change(
        self,
        after: WearState,
        change: Change,
        body: int,
        label: str,
        positions: Sequence[TrackPosition],
    ) -> WearState:
        changed = list(after.changed)
        mechanical = list(after.mechanical)
        changed[body] = changed[body] + change.heights_change
        mechanical[body] -= self.volume(change.heights_change, body)
        if change.transferred is not None and change.transferred.any():
            other = 1 - body
            thinner = self.perimeter(body) / self.perimeter(other)
            deposit = thinner * np.mean(
                [to_other_track(change.transferred, position, body) for position in positions],
                axis=0,
            )
            changed[other] = changed[other] + deposit
            mechanical[other] -= self.volume(deposit, other)
        states: dict[str, MechanismState] = {**after.states, label: change.state}
        facts: Mapping[str, float] = {
            f"{label}.{key}": float(value) for key, value in change.facts.items()
        }
        rate = self.overrolling[body]
        return replace(
            after,
            longest=min(after.longest, change.longest / rate if rate > 0.0 else math.inf),
            changed=(changed[0], changed[1]),
            mechanical=(mechanical[0], mechanical[1]),
            states=states,
            facts={**after.facts, **facts},
        )

    def _patch(self, position: TrackPosition, solved: SolvedPosition, body: int) -> Patch:
        cells = (self.surfaces.first, self.surfaces.second)[body].grid.cells

        def on_track(field: Field, outside: float = 0.0) -> Field:
            return map_to_track(field, cells, position, body, outside)

        temperature = None
        if self.model.needs_temperature and solved.temperatures is not None:
            temperature = on_track(solved.temperatures[body])
        return Patch(
            pressure=on_track(solved.pressure),
            asperity_pressure=on_track(solved.asperity_pressure),
            shear=on_track(solved.shear if body == 0 else -solved.shear),
            film=on_track(solved.film, math.inf),
            temperature=temperature,
        )
