"""One jump of a wearing contact: how far it may go, what the law of removal takes off, what else changes the surfaces.

Order: the contact is solved at positions of the tracks; the law's rate at its beginning is taken
along the jump; what the pressure cap pressed flat stays flat; then each mechanism is asked, body
by body.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy

from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.simulation.wear.contact import PositionSolver, SolvedPosition
from asperity.simulation.wear.reach import part_of, reached
from asperity.simulation.wear.state import WearState
from asperity.surface import MovingSurfaces, Surface
from asperity.wear import (
    Body,
    Change,
    Exposure,
    MechanismState,
    Passage,
    Patch,
    RubbingConditions,
    TrackPosition,
    WearModel,
    is_uniform_along,
    longest_jump,
    map_to_track,
    positions,
    removed_depth,
    to_other_track,
)

FEWEST_PATCHES = 4
# of a smooth contact's approach a^2/(2R): what a jump's step is a share of where Sq is less
LEAST_HEIGHT = 0.1
WORST_ERROR = (
    1e-3  # of Sq, by which this jump and the one before may differ from one of both together
)
FIRST, SHORTER, SHORTEST = (
    0.5,
    0.7,
    1.0 / 64.0,
)  # of the longest jump: the first, with none before it; and in steps
GAUSS = (
    math.sqrt(0.5 * math.log(2.0)) / math.pi
)  # deviation of ISO 16610-61's filter over its cut-off
BODIES = (0, 1)


@dataclass(frozen=True)
class WearingContact:
    """A case's contact as it wears: what stays the same from jump to jump."""

    case: Case
    model: WearModel
    surfaces: MovingSurfaces

    @cached_property
    def solver(self) -> PositionSolver:
        """What solves the contact at a position."""
        return PositionSolver.of(self.case, flattening=self.model.flattening)

    @cached_property
    def overrolling(self) -> tuple[float, float]:
        """How often a point of each body passes the contact [1/s]; 0 of one that stands still."""
        conditions = self.case.conditions
        if self.model.overrolling is not None:
            rates = self.model.overrolling
        else:
            round_trip = 4.0 * math.pi * conditions.radius_along_rolling
            first, second = (abs(speed) / round_trip for speed in conditions.surface_speeds)
            rates = (first, second)
        still = [speed == 0.0 for speed in conditions.surface_speeds]
        return 0.0 if still[0] else rates[0], 0.0 if still[1] else rates[1]

    @cached_property
    def bodies(self) -> tuple[Body, Body]:
        """Both bodies' material and speed."""
        conditions = self.case.conditions
        first, second = (
            Body(
                youngs_modulus=modulus,
                poisson_ratio=ratio,
                hardness=conditions.hardness,
                speed=speed,
            )
            for modulus, ratio, speed in zip(
                conditions.pair.youngs_moduli,
                conditions.pair.poisson_ratios,
                conditions.surface_speeds,
                strict=True,
            )
        )
        return first, second

    def exposures(
        self, at: Sequence[tuple[TrackPosition, SolvedPosition]] = ()
    ) -> tuple[Exposure, Exposure]:
        """How each body meets the contact, solved at those positions; none: one as cold as its surroundings."""
        conditions = self.case.conditions
        first, second = (
            Exposure(
                k=coefficient.k * self._acting(at, which),
                body=body,
                overrolling=rate,
                width=2.0 * conditions.hertz.half_widths[0],
                sliding_speed=conditions.sliding_speed,
            )
            for which, coefficient, body, rate in zip(
                BODIES, self.model.coefficients, self.bodies, self.overrolling, strict=True
            )
        )
        return first, second

    def _acting(self, at: Sequence[tuple[TrackPosition, SolvedPosition]], body: int) -> float:
        """What the law makes of pressure times sliding, at most: 1 by Archard's, the share of defects by theirs."""
        cold = RubbingConditions(
            pressure=np.ones(1),
            shear=np.full(1, self.case.boundary_friction),
            sliding_speed=self.case.conditions.sliding_speed,
            temperature=np.full(1, self.case.thermal.ambient),
        )
        worst = 0.0
        for rubbing in [self.rubbing(solved, body) for _, solved in at] or [cold]:
            by_archard = rubbing.pressure * rubbing.sliding_speed
            rubs = by_archard > 0.0
            worst = max(
                worst, float(np.max(self.model.law(rubbing)[rubs] / by_archard[rubs], initial=0.0))
            )
        return worst

    @cached_property
    def patches(self) -> int:
        """Positions that a jump is the mean of; one where no body has anywhere to go."""
        if self.model.patches is not None:
            return self.model.patches
        length = self.surfaces.first.grid.extent[0]
        return max(
            FEWEST_PATCHES, math.ceil(length / self.case.conditions.hertz.half_widths[0] - 1e-9)
        )

    @property
    def seed(self) -> int:
        """Of all that is drawn: the case's surface's."""
        return int(getattr(self.case.contents.surface, "seed", 0))

    def perimeter(self, body: int) -> float:
        """Way along a body that wears as its track does [m]: all round it, or the domain where it stands still."""
        speed, rate = self.bodies[body].speed, self.overrolling[body]
        return self.surfaces.first.grid.extent[0] if speed == 0.0 else abs(speed) / rate

    @property
    def width(self) -> float:
        """Of the wearing track across rolling [m]: a line contact's length, else the domain's."""
        length = self.case.conditions.length if self.case.conditions.endless else None
        return self.surfaces.grid.extent[1] if length is None else length

    def volume(self, depth: Field, body: int) -> float:
        """What a depth on a body's track [m] is of volume [m^3], all round the body."""
        return float(depth.mean()) * self.perimeter(body) * self.width

    # Where bodies are
    # ------------------------------------------------------------------------------------------------

    def worn_surfaces(self, worn: WearState) -> MovingSurfaces:
        """Both tracks as they are now."""
        return self.surfaces.lowered(worn.lowered(0), worn.lowered(1))

    def track(self, worn: WearState, body: int) -> tuple[slice, slice]:
        """Cells of a body's track that the contact reaches: the Hertz zone, or more where the scar has grown beyond.

        All along rolling of a body that moves, and all across of an endless contact.
        """
        along = transverse = slice(None)
        grid, half_widths = self.surfaces.grid, self.case.conditions.hertz.half_widths
        if self.bodies[body].speed == 0.0:
            along = reached(worn.worn[body].mean(axis=1), grid.x, half_widths[0])
        if not self.case.conditions.endless:
            both = worn.worn[0].mean(axis=0) + worn.worn[1].mean(axis=0)[::-1]
            transverse = reached(both + both[::-1], 0.5 * (grid.y - grid.y[::-1]), half_widths[1])
        return along, transverse

    def levelled(self, worn: WearState) -> tuple[Surface, Surface]:
        """Both tracks' roughness where the contact reaches them, without the form that wear has given them."""
        now = self.worn_surfaces(worn)
        first, second = (
            part_of(
                Surface(surface.heights + self._form(worn, body), surface.grid),
                self.track(worn, body),
            )
            for body, surface in enumerate((now.first, now.second))
        )
        return first, second

    def _form(self, worn: WearState, body: int) -> Field:
        """Of a groove its mean profile, along what is alike; of a standing body's bounded scar its long waves.

        Where no body was rough all of such a scar is form.
        """
        lowered, endless = worn.lowered(body), self.case.conditions.endless
        moves = self.bodies[body].speed != 0.0
        if endless and moves:
            return np.zeros_like(lowered)
        if endless or moves:
            return np.broadcast_to(
                lowered.mean(axis=0 if moves else 1, keepdims=True), lowered.shape
            )
        scar = worn.worn[body] + worn.flattened[body]
        if not any(self.surfaces.rough):
            return np.asarray(scar)
        half_width, spacing = self.case.conditions.hertz.half_widths[0], self.surfaces.grid.spacing
        return np.asarray(
            scipy.ndimage.gaussian_filter(
                scar, [GAUSS * half_width / step for step in spacing], mode="nearest"
            )
        )

    def positions(self, worn: WearState) -> tuple[TrackPosition, ...]:
        """Where the contact is solved in this jump."""
        now = self.worn_surfaces(worn)
        tracks = (now.first, now.second)
        first, second = (
            self.bodies[body].speed != 0.0 and not is_uniform_along(tracks[body].heights)
            for body in BODIES
        )  # one that is the same all along need go nowhere
        cells = (now.first.grid.cells[0], now.second.grid.cells[0])
        count = self.patches if first or second else 1
        return positions(cells, (first, second), count, worn.number, self.seed)

    def height(self, worn: WearState) -> float:
        """What steps and errors are counted against [m]: Sq; of smooth bodies their scars', or a share of the approach.

        Of rough ones the scar's form is left out.
        """
        conditions, now = self.case.conditions, self.worn_surfaces(worn)
        bodies = self.levelled(worn) if any(self.surfaces.rough) else (now.first, now.second)
        approach = conditions.hertz.half_widths[0] ** 2 / (2.0 * conditions.radius_along_rolling)
        return max(math.hypot(*(surface.sq for surface in bodies)), LEAST_HEIGHT * approach)

    # What is taken off
    # -----------------------------------------------------------------------------------------------

    def rubbing(self, solved: SolvedPosition, body: int) -> RubbingConditions:
        """What the law of removal is told of a body at a position."""
        needed = self.model.law.needs_temperature
        if needed and solved.temperatures is None:
            raise BadInput(
                f"{self.case.source}: no temperature of the contact is known; take another law of removal"
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

    def rate(
        self, worn: WearState, at: Sequence[tuple[TrackPosition, SolvedPosition]], body: int
    ) -> Field:
        """Depth that a body's track loses [m/s]."""
        surface = (self.surfaces.first, self.surfaces.second)[body]
        laid = [
            map_to_track(
                self.model.law(self.rubbing(solved, body)), surface.grid.cells, position, body
            )
            for position, solved in at
        ]
        depth_rate_factor = self.exposures()[body].depth_rate_factor(surface.grid.extent[0])
        rate = self.model.coefficients[body].k * depth_rate_factor * np.mean(laid, axis=0)
        if self.bodies[body].speed != 0.0 and is_uniform_along(
            surface.heights - worn.lowered(body)
        ):
            rate = np.broadcast_to(
                rate.mean(axis=0), rate.shape
            ).copy()  # each point of it meets every position
        return np.asarray(rate)

    def booked(self, at: Sequence[tuple[TrackPosition, SolvedPosition]], body: int) -> float:
        """Volume that a body loses by law [m^3/s]: its k times the law's sum over the contact, on average."""
        (dx, dy), grid = self.surfaces.grid.spacing, self.surfaces.grid
        sums = [float(self.model.law(self.rubbing(solved, body)).sum()) for _, solved in at]
        return (
            self.model.coefficients[body].k
            * float(np.mean(sums))
            * dx
            * dy
            * self.width
            / grid.extent[1]
        )

    def seconds(self, worn: WearState, at: Sequence[tuple[TrackPosition, SolvedPosition]]) -> float:
        """How long the jump from the contacts at those positions may be."""
        rates = self.rate(worn, at, 0), self.rate(worn, at, 1)
        exposures, spacing = self.exposures(at), self.surfaces.grid.spacing
        height = self.model.step * self.height(worn)
        modulus = self.case.conditions.pair.reduced_modulus
        longest = longest_jump(exposures, rates, height, self.model.decay, spacing, modulus)
        longest = min(longest, worn.longest)
        if self.model.flattening or (worn.number == 0 and self.model.mechanisms):
            slowest = min((rate for rate in self.overrolling if rate > 0.0), default=1.0)
            longest = min(
                longest, max(worn.time, 1.0 / slowest)
            )  # what settles at once is looked at often at first
        return self._within_error(worn, rates, exposures, longest)

    def _within_error(
        self,
        worn: WearState,
        rates: tuple[Field, Field],
        exposures: tuple[Exposure, Exposure],
        longest: float,
    ) -> float:
        """The longest jump that differs little enough from the one before going on; nothing is solved for it."""
        if math.isinf(longest):
            return longest
        if worn.seconds == 0.0:
            return FIRST * longest
        seconds = longest
        while seconds > SHORTEST * longest:
            if (
                self._error(worn, self._removed(rates, seconds, exposures), exposures, seconds)
                <= WORST_ERROR
            ):
                break
            seconds *= SHORTER
        return seconds

    def jumped(
        self, worn: WearState, at: Sequence[tuple[TrackPosition, SolvedPosition]], seconds: float
    ) -> WearState:
        """Both bodies after a jump of so many seconds from the contacts at those positions."""
        rates = self.rate(worn, at, 0), self.rate(worn, at, 1)
        exposures = self.exposures(at)
        removed = self._removed(rates, seconds, exposures)
        booked = tuple(worn.booked[body] + self.booked(at, body) * seconds for body in BODIES)
        lost = worn.worn[0] + removed[0], worn.worn[1] + removed[1]
        after = replace(
            worn,
            number=worn.number + 1,
            time=worn.time + seconds,
            worn=lost,
            flattened=self._flattened(worn, at),
            booked=(booked[0], booked[1]),
            error=worn.error + self._error(worn, removed, exposures, seconds),
            rates=rates,
            seconds=seconds,
            longest=math.inf,
            facts={},
        )
        for place, name in enumerate(self.model.mechanisms):
            for body in BODIES:
                after = self._roughened(worn, after, at, removed[body], name, (body, place))
        return after

    def _removed(
        self, rates: tuple[Field, Field], seconds: float, exposures: tuple[Exposure, Exposure]
    ) -> tuple[Field, Field]:
        modulus, tracks = (
            self.case.conditions.pair.reduced_modulus,
            (self.surfaces.first, self.surfaces.second),
        )
        first, second = (
            removed_depth(rates[body], seconds, exposures[body], tracks[body].grid, modulus)
            for body in BODIES
        )
        return first, second

    def _flattened(
        self, worn: WearState, at: Sequence[tuple[TrackPosition, SolvedPosition]]
    ) -> tuple[Field, Field]:
        """What the cap has pressed flat: of each point the deepest overlap at any position, by halves on two rough."""
        if not self.model.flattening:
            return worn.flattened
        rough = self.surfaces.rough
        share = 1.0 / max(sum(rough), 1)
        tracks = (self.surfaces.first, self.surfaces.second)
        first, second = (
            worn.flattened[body]
            + share
            * rough[body]
            * np.max(
                [
                    map_to_track(solved.overlap, tracks[body].grid.cells, position, body)
                    for position, solved in at
                    if solved.overlap is not None
                ],
                axis=0,
            )
            for body in BODIES
        )
        return first, second

    def _error(
        self,
        worn: WearState,
        removed: tuple[Field, Field],
        exposures: tuple[Exposure, Exposure],
        seconds: float,
    ) -> float:
        """How far what this jump takes off and the one before differ in Sq from one of both together, relative."""
        if worn.seconds == 0.0:
            return 0.0
        once, twice = (
            self._removed(worn.rates, long, exposures)
            for long in (worn.seconds, worn.seconds + seconds)
        )
        after = replace(worn, worn=(worn.worn[0] + removed[0], worn.worn[1] + removed[1]))
        levels, tracks = self.levelled(after), [self.track(after, body) for body in BODIES]
        now = math.hypot(*(surface.sq for surface in levels))
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
        return abs(at_once - now) / self.height(after)

    # What roughens
    # ---------------------------------------------------------------------------------------------------

    def _roughened(
        self,
        worn: WearState,
        after: WearState,
        at: Sequence[tuple[TrackPosition, SolvedPosition]],
        removed: Field,
        name: str,
        which: tuple[int, int],
    ) -> WearState:
        """One mechanism, asked of one body."""
        body, _ = which
        now = self.worn_surfaces(after)
        surface, label = (now.first, now.second)[body], f"{name}.{body + 1}"
        passage = Passage(
            body=body,
            grid=surface.grid,
            heights=surface.heights,
            removed=removed,
            patches=tuple(self._patch(position, solved, body) for position, solved in at),
            material=self.bodies[body],
            sliding_speed=self.case.conditions.sliding_speed,
            half_width=self.case.conditions.hertz.half_widths[0],
            overrollings=worn.time * self.overrolling[body],
            jump=after.seconds * self.overrolling[body],
            seconds=after.seconds,
            boundary_friction=self.case.boundary_friction,
            rng=np.random.default_rng([self.seed, worn.number, *which]),
            state=after.states.get(label, {}),
        )
        change = self.model.mechanisms[name](passage)
        return self._booked_change(after, change, body, label, [place for place, _ in at])

    def _booked_change(
        self,
        after: WearState,
        change: Change,
        body: int,
        label: str,
        places: Sequence[TrackPosition],
    ) -> WearState:
        changed, mechanical = list(after.changed), list(after.mechanical)
        changed[body] = changed[body] + change.heights_change
        mechanical[body] -= self.volume(change.heights_change, body)
        if change.transferred is not None and change.transferred.any():
            other = 1 - body
            thinner = self.perimeter(body) / self.perimeter(other)
            given = thinner * np.mean(
                [to_other_track(change.transferred, place, body) for place in places], axis=0
            )
            changed[other] = changed[other] + given
            mechanical[other] -= self.volume(given, other)
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

        def laid(field: Field, beside: float = 0.0) -> Field:
            return map_to_track(field, cells, position, body, beside)

        temperature = None
        if self.model.needs_temperature and solved.temperatures is not None:
            temperature = laid(solved.temperatures[body])
        return Patch(
            pressure=laid(solved.pressure),
            asperity_pressure=laid(solved.asperity_pressure),
            shear=laid(solved.shear if body == 0 else -solved.shear),
            film=laid(solved.film, math.inf),
            temperature=temperature,
        )
