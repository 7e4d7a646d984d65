"""The dynamic stiffness k(ω) + iω c(ω) of a solved contact: what a small oscillation of the bodies' distance meets.

Reynolds' equation with its squeeze term, the deflection and the touching cells, linearised where
they were solved. The oil needs time to follow, so the force runs before or behind the distance:
that is the contact's own damping, which may be negative where the film is carried through just
late enough (the entraining motion pays for it).
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

from asperity.contact.hertz import line_stiffness
from asperity.core.errors import AsperityError, BadInput, require_positive
from asperity.ehl import ContactSolution, Scales
from asperity.ehl.linear_solvers.gmres import Shifted
from asperity.ehl.linear_solvers.oscillating import (
    Oscillating,
    OscillationResponse,
    at_cap,
    elastic,
)
from asperity.ehl.outcome import CONSERVING
from asperity.solution.state import balance_of
from asperity.solution.stiffness import ELASTIC, FLOWING, YIELDED, Yielded, checked_depth

TOLERANCE = 1e-5  # of the linear equations: stiffness to 1e-4, a damping ratio of 0.001 to 1 %
# of those where a mass resonates, if they are solved by rounds: a damping ratio of 0.003 to 1 %
AT_RESONANCE = 3e-5
ROUGHLY = 1e-2  # of those of a trial frequency: stiffness to 1 %
STANDS_FROM, CLOSEST = (
    3e-4,
    1e-6,
)  # between which stiffness and damping are watched whether they stand ...
FEWEST_WATCHED, WATCHED = (
    4,
    0.2,
)  # ... over the last steps, a share of all, as slow ones tell little one by one ...
STILL, LEAST_LOSS = 0.005, 2e-6  # ... to this share; a loss factor of less is none
SHORT = 2.0  # times what single precision says to be left, and a sweep has come short of it
SAME_FREQUENCY = 0.005  # a resonance is found when its own stiffness moves it by less
STANDING = 10.0  # tolerances that a solution may miss by
MOST_TRIALS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicStiffness:
    """Force over approach of a contact that is shaken at `frequency_hz`: `stiffness` k [N/m] + iω `damping` c [N s/m].

    The approach of a line contact is that of points `reference_depth` [m] away (None for others:
    from far away). `yielded` tells what cells at the pressure cap do: "flowing" at a constant
    pressure, as virgin roughness does, or "elastic", as where this load has been borne before. At
    0 Hz `damping` is nan. `left` is the share of the linear equations that was not met.
    """

    frequency_hz: float
    stiffness: float
    damping: float
    yielded: Yielded
    reference_depth: float | None
    left: float

    @property
    def damping_ratio(self) -> float:
        """ζ = ω c/2k of a mass that resonates on this contact at this frequency, and of nothing else."""
        return math.pi * self.frequency_hz * self.damping / self.stiffness


class ShakenContact:
    """A solved contact made ready to be shaken at any number of frequencies.

    Parameters
    ----------
    solution : of the model unified (or paper) or mixed, dry ones too
    yielded : what cells at the pressure cap do, see `DynamicStiffness`
    reference_depth : of a line contact [m]; None takes `roller_depth` of the conditions

    Raises
    ------
    BadInput
        for a solution of the conserving model, one that does not stand still (unsolved, or a moment of a motion), or a
        reference no deeper than the contact is wide.
    """

    def __init__(
        self,
        solution: ContactSolution,
        *,
        yielded: Yielded = ELASTIC,
        reference_depth: float | None = None,
    ) -> None:
        if yielded not in YIELDED:
            raise BadInput(f"yielded must be one of {', '.join(YIELDED)}, got {yielded!r}")
        conditions = solution.conditions
        self.yielded, self.conditions = yielded, conditions
        self.depth = checked_depth(conditions, reference_depth) if conditions.endless else None
        if solution.options.model == CONSERVING:
            raise BadInput(
                "a dynamic stiffness needs the model unified or mixed, got conserving; solve by one of them"
            )
        balance = balance_of(solution, whole=False)
        if balance.residual_rms > STANDING * solution.options.tolerance:
            raise BadInput(
                f"a dynamic stiffness needs a contact that stands still, and {balance.residual_rms:.1e} of this one's "
                "equations is left; solve it without motion, or to its end"
            )
        self.scales, self.yields = (
            Scales.from_conditions(conditions, solution.lubricant),
            at_cap(balance),
        )
        self.balance = elastic(balance) if yielded == ELASTIC else balance
        self.oscillating = Oscillating(self.balance)

    def at(self, frequency_hz: float, *, tolerance: float = TOLERANCE) -> DynamicStiffness:
        """Stiffness and damping at a frequency [Hz]; 0 for a change so slow that the film follows.

        `tolerance` is the share of the linear equations that may be left.

        Raises
        ------
        AsperityError
            where the linear equations cannot be solved.
        """
        if not 0.0 <= frequency_hz < math.inf:
            raise BadInput(f"frequency must be 0 Hz or more, got {frequency_hz:g} Hz")
        return self._at(frequency_hz, tolerance, None)

    def _at(
        self, frequency_hz: float, tolerance: float, start: OscillationResponse | None
    ) -> DynamicStiffness:
        answer = self.oscillating.answer(
            self.per_crossing(frequency_hz), tolerance=tolerance, start=start
        )
        if not answer.left < 2.0 * tolerance:
            raise AsperityError(
                f"dynamic stiffness not found at {frequency_hz:g} Hz: {answer.steps} steps left "
                f"{answer.left:.1e} of the linear equations, wanted {tolerance:.0e}"
            )
        return self._read(answer, frequency_hz)

    def _read(self, answer: OscillationResponse, frequency_hz: float) -> DynamicStiffness:
        response, omega = self._response(complex(answer.total.sum())), 2.0 * math.pi * frequency_hz
        return DynamicStiffness(
            frequency_hz=frequency_hz,
            stiffness=response.real,
            damping=response.imag / omega if omega > 0.0 else math.nan,
            yielded=self.yielded,
            reference_depth=self.depth,
            left=answer.left,
        )

    def _response(self, pressed: complex) -> complex:
        """Complex k + iωc [N/m] of the sum of the dimensionless pressures per approach."""
        return self._from_reference(pressed * self._newtons_per_metre())

    def per_crossing(self, frequency_hz: float) -> float:
        """Angular frequency times the time that oil takes across a half-width."""
        speed = self.conditions.entrainment_speed
        return 2.0 * math.pi * frequency_hz * self.scales.length / speed if speed > 0.0 else 0.0

    def resonance(self, mass: float) -> DynamicStiffness:
        """Where a mass [kg] resonates on this contact, k = m ω², to 0.5 % of its frequency; or AsperityError."""
        require_positive("mass", mass, "kg")
        hertz = _resonance_hz(self._bodies(), mass)
        sweep = self.oscillating.sweep(self.per_crossing(hertz))
        for trial in range(MOST_TRIALS):
            stiffness = self._followed(sweep, roughly=trial == 0).real
            if stiffness <= 0.0:
                break
            moved = _resonance_hz(stiffness, mass)
            if trial and abs(moved - hertz) <= SAME_FREQUENCY * moved:
                return self._found(sweep, hertz)
            hertz = moved
            try:
                sweep.move(self.per_crossing(hertz))
            except (
                ArithmeticError
            ):  # what was gathered at the other frequency is not enough for this one
                sweep = self.oscillating.sweep(self.per_crossing(hertz))
        raise AsperityError(
            f"a mass of {mass:g} kg has no resonance on this contact: k = m ω² is met nowhere"
        )

    def settled(self, frequency_hz: float) -> DynamicStiffness:
        """Stiffness and damping at a frequency [Hz], so close that the damping ratio stands to 1 % (or 1e-6)."""
        sweep = self.oscillating.sweep(self.per_crossing(frequency_hz))
        self._followed(sweep, roughly=False)
        return self._found(sweep, frequency_hz)

    def _followed(self, sweep: Shifted, *, roughly: bool) -> complex:
        """Complex k + iωc [N/m] once it does not move any more, or `roughly` once the equations are met to `ROUGHLY`.

        What is left of the equations tells little of the damping: the smaller it is, the closer
        they have to be met.
        """
        said: list[complex] = []
        while True:
            if sweep.count:
                said.append(self._response(sweep.sum))
                if sweep.left <= (ROUGHLY if roughly else CLOSEST) or (
                    not roughly and _stands(said, sweep)
                ):
                    return said[-1]
            if sweep.full or not sweep.step():
                return self._response(sweep.sum)

    def _found(self, sweep: Shifted, frequency_hz: float) -> DynamicStiffness:
        """Where a sweep has come to, unless it is short of what it says: then solved on by rounds."""
        answer = self.oscillating.swept(sweep)
        if answer.left > max(SHORT * sweep.left, AT_RESONANCE) or sweep.left > STANDS_FROM:
            return self._at(frequency_hz, AT_RESONANCE, answer)
        return self._read(answer, frequency_hz)

    def _bodies(self) -> float:
        """Stiffness of the smooth dry bodies under the whole load [N/m], near any contact's that has been loaded."""
        conditions = self.conditions
        if not conditions.long:
            approach = conditions.hertz.approach
            assert approach is not None  # a line's alone depends on the depth
            return 1.5 * conditions.load / approach
        radius, modulus, length = (
            conditions.radius_along_rolling,
            conditions.pair.reduced_modulus,
            conditions.line_length,
        )
        depth = length if self.depth is None else self.depth  # of a roller its length counts as one
        return line_stiffness(conditions.load, length, radius, modulus, depth)

    def _newtons_per_metre(self) -> float:
        """What one dimensionless cell's pressure per gap is worth, over the whole length of a line contact."""
        problem, scales, conditions = self.balance.problem, self.scales, self.conditions
        dx, dy = problem.spacing
        cell = scales.pressure * scales.length**2 / scales.gap * dx * dy
        if not conditions.endless or conditions.length is None:
            return cell
        return cell * conditions.length / (problem.cells[1] * dy * scales.length)

    def _from_reference(self, response: complex) -> complex:
        """The solver measures a line's approach from points one half-width away; deeper ones give way besides."""
        conditions = self.conditions
        if self.depth is None or conditions.length is None:
            return response
        modulus, a = conditions.pair.reduced_modulus, conditions.hertz.half_widths[0]
        return 1.0 / (
            1.0 / response
            + 2.0 / (math.pi * modulus * conditions.length) * math.log(self.depth / a)
        )


@dataclass(frozen=True, kw_only=True)
class OwnResonance:
    """Where a mass resonates on a solved contact: the contact once it has borne its load, and while it still yields.

    `yields` tells whether any cell of the `solution` is at the pressure cap.
    """

    elastic: DynamicStiffness
    yields: bool
    solution: ContactSolution = field(repr=False, compare=False)

    @cached_property
    def virgin(self) -> DynamicStiffness:
        """Cells at the pressure cap flowing, at the frequency of `elastic`; worked out when first asked for.

        Raises
        ------
        AsperityError
            where the linear equations cannot be solved.
        """
        if not self.yields:  # and both limits are one
            return replace(self.elastic, yielded=FLOWING)
        shaken = ShakenContact(
            self.solution, yielded=FLOWING, reference_depth=self.elastic.reference_depth
        )
        return shaken.settled(self.elastic.frequency_hz)


def own_resonance(
    solution: ContactSolution, mass: float, *, reference_depth: float | None = None
) -> OwnResonance:
    """Stiffness and damping that a mass [kg] meets on a solved contact; raises what `ShakenContact` does."""
    shaken = ShakenContact(solution, reference_depth=reference_depth)
    return OwnResonance(elastic=shaken.resonance(mass), yields=shaken.yields, solution=solution)


def _resonance_hz(stiffness: float, mass: float) -> float:
    """Of a mass [kg] on a spring [N/m]."""
    return math.sqrt(stiffness / mass) / (2.0 * math.pi)


def _stands(said: list[complex], sweep: Shifted) -> bool:
    """Whether stiffness and damping have kept still over the last steps, and enough of the equations is met."""
    watched = max(FEWEST_WATCHED, int(WATCHED * sweep.count))
    if sweep.left > STANDS_FROM or len(said) < watched:
        return False
    *before, last = said[-watched:]
    damping = max(abs(one.imag - last.imag) for one in before)
    stiffness = max(abs(one.real - last.real) for one in before)
    return damping <= max(
        STILL * abs(last.imag), LEAST_LOSS * abs(last)
    ) and stiffness <= STILL * abs(last.real)


def dynamic_stiffness(
    solution: ContactSolution,
    frequency_hz: float,
    *,
    yielded: Yielded = ELASTIC,
    reference_depth: float | None = None,
) -> DynamicStiffness:
    """k(ω) and c(ω) of a solved contact at one frequency [Hz]; `ShakenContact` for many, and for what it raises."""
    return ShakenContact(solution, yielded=yielded, reference_depth=reference_depth).at(
        frequency_hz
    )
