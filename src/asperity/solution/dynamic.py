"""Dynamic stiffness k(ω) + iω c(ω) of a solved contact under small oscillations of the approach.

Reynolds' equation with its squeeze term, the deflection and the touching cells are linearised about
the solution. The oil needs time to follow, so the force leads or lags the approach: this is the
contact's own damping. It may be negative where the film is carried through with a suitable delay;
the entraining motion supplies the energy.
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
from asperity.solution.stiffness import (
    ELASTIC,
    FLOWING,
    YIELDED,
    Yielded,
    at_depth,
    checked_depth,
    stiffness_scale,
)

# Relative residuals of the linear equations:
TOLERANCE = 1e-5  # stiffness to 1e-4, a damping ratio of 0.001 to 1 %
RESONANCE_TOLERANCE = 3e-5  # at a resonance, if solved by rounds: a damping ratio of 0.003 to 1 %
TRIAL_TOLERANCE = 1e-2  # at a trial frequency: stiffness to 1 %
MONITOR_FROM, MIN_RESIDUAL = 3e-4, 1e-6  # between which stagnation of k and c ends a sweep
# Stagnation: k and c change by at most this share over the last steps (a share of all steps).
MIN_MONITORED_STEPS, MONITORED_SHARE = 4, 0.2
STAGNATION, MIN_LOSS_FACTOR = 0.005, 2e-6
RESIDUAL_MISMATCH = 2.0  # true residual over that in single precision, above which it is refined
FREQUENCY_TOLERANCE = 0.005  # relative change of the frequency at which a resonance is accepted
STEADY_FACTOR = 10.0  # largest residual of a steady solution, in its tolerances
MAX_TRIALS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicStiffness:
    """Force over approach of a contact oscillating at `frequency_hz`: k [N/m] + iω c [N s/m].

    `stiffness` is k, `damping` is c (nan at 0 Hz). The approach of a line contact is that of points
    `reference_depth` [m] away (None for others: from infinity). `yielded` is the behaviour of cells
    at the pressure cap: "flowing" at constant pressure, as virgin roughness, or "elastic", as where
    this load has been carried before. `residual` is the relative residual of the linear equations.
    """

    frequency_hz: float
    stiffness: float
    damping: float
    yielded: Yielded
    reference_depth: float | None
    residual: float

    @property
    def damping_ratio(self) -> float:
        """Damping ratio ζ = ω c/2k of a mass that resonates on this contact alone."""
        return math.pi * self.frequency_hz * self.damping / self.stiffness


class OscillatingContact:
    """Solved contact, linearised for oscillations at any number of frequencies.

    Parameters
    ----------
    solution : of the model unified (or paper) or mixed; dry contacts too
    yielded : behaviour of cells at the pressure cap, see `DynamicStiffness`
    reference_depth : of a line contact [m]; default `roller_depth` of the conditions

    Raises
    ------
    BadInput
        for the conserving model, an unsteady solution (not converged, or a snapshot of a motion),
        or a reference depth less than the half-width.
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
                "dynamic stiffness needs the model unified or mixed, got conserving; solve with "
                "one of them"
            )
        balance = balance_of(solution, whole=False)
        if balance.residual_rms > STEADY_FACTOR * solution.options.tolerance:
            raise BadInput(
                f"dynamic stiffness needs a steady, converged contact, but the residual is "
                f"{balance.residual_rms:.1e}; solve it without motion, to convergence"
            )
        self.scales, self.yields = (
            Scales.from_conditions(conditions, solution.lubricant),
            at_cap(balance),
        )
        self.balance = elastic(balance) if yielded == ELASTIC else balance
        self.oscillating = Oscillating(self.balance)

    def evaluate(self, frequency_hz: float, *, tolerance: float = TOLERANCE) -> DynamicStiffness:
        """Return stiffness and damping at a frequency [Hz]; at 0 Hz the film follows fully.

        `tolerance` is the largest relative residual of the linear equations.

        Raises
        ------
        AsperityError
            if the linear equations do not converge.
        """
        if not 0.0 <= frequency_hz < math.inf:
            raise BadInput(f"frequency must be 0 Hz or more, got {frequency_hz:g} Hz")
        return self._solve(frequency_hz, tolerance, None)

    def _solve(
        self, frequency_hz: float, tolerance: float, start: OscillationResponse | None
    ) -> DynamicStiffness:
        result = self.oscillating.response(
            self.dimensionless_frequency(frequency_hz), tolerance=tolerance, start=start
        )
        if not result.residual < 2.0 * tolerance:
            raise AsperityError(
                f"dynamic stiffness did not converge at {frequency_hz:g} Hz: residual "
                f"{result.residual:.1e} after {result.steps} steps, required {tolerance:.0e}"
            )
        return self._to_stiffness(result, frequency_hz)

    def _to_stiffness(self, result: OscillationResponse, frequency_hz: float) -> DynamicStiffness:
        response = self._response(complex(result.total.sum()))
        omega = 2.0 * math.pi * frequency_hz
        return DynamicStiffness(
            frequency_hz=frequency_hz,
            stiffness=response.real,
            damping=response.imag / omega if omega > 0.0 else math.nan,
            yielded=self.yielded,
            reference_depth=self.depth,
            residual=result.residual,
        )

    def _response(self, pressure_sum: complex) -> complex:
        """Return k + iωc [N/m] from the sum of the dimensionless pressures per approach."""
        scale = stiffness_scale(self.conditions, self.balance.problem, self.scales)
        return at_depth(self.conditions, pressure_sum * scale, self.depth)

    def dimensionless_frequency(self, frequency_hz: float) -> float:
        """Return the angular frequency times the oil's transit time over a half-width."""
        speed = self.conditions.entrainment_speed
        return 2.0 * math.pi * frequency_hz * self.scales.length / speed if speed > 0.0 else 0.0

    def resonance(self, mass: float) -> DynamicStiffness:
        """Return the dynamic stiffness at the resonance of a mass [kg], k = m ω² (to 0.5 %).

        Raises
        ------
        AsperityError
            if there is no resonance or the linear equations do not converge.
        """
        require_positive("mass", mass, "kg")
        frequency_hz = _resonance_hz(self._smooth_stiffness(), mass)
        sweep = self.oscillating.sweep(self.dimensionless_frequency(frequency_hz))
        for trial in range(MAX_TRIALS):
            stiffness = self._iterate(sweep, roughly=trial == 0).real
            if stiffness <= 0.0:
                break
            updated_hz = _resonance_hz(stiffness, mass)
            if trial and abs(updated_hz - frequency_hz) <= FREQUENCY_TOLERANCE * updated_hz:
                return self._finish(sweep, frequency_hz)
            frequency_hz = updated_hz
            try:
                sweep.move(self.dimensionless_frequency(frequency_hz))
            except ArithmeticError:  # the subspace of the other frequency does not suffice here
                sweep = self.oscillating.sweep(self.dimensionless_frequency(frequency_hz))
        raise AsperityError(
            f"a mass of {mass:g} kg has no resonance on this contact: k = m ω² has no solution"
        )

    def converged_at(self, frequency_hz: float) -> DynamicStiffness:
        """Return stiffness and damping at a frequency [Hz], damping ratio to 1 % (or 1e-6)."""
        sweep = self.oscillating.sweep(self.dimensionless_frequency(frequency_hz))
        self._iterate(sweep, roughly=False)
        return self._finish(sweep, frequency_hz)

    def _iterate(self, sweep: Shifted, *, roughly: bool) -> complex:
        """Iterate k + iωc [N/m] until it stagnates, or with `roughly` to `TRIAL_TOLERANCE`.

        The residual says little about the damping: the smaller the damping, the smaller the
        residual it requires.
        """
        responses: list[complex] = []
        while True:
            if sweep.count:
                responses.append(self._response(sweep.sum))
                if sweep.residual <= (TRIAL_TOLERANCE if roughly else MIN_RESIDUAL) or (
                    not roughly and _stagnated(responses, sweep)
                ):
                    return responses[-1]
            if sweep.full or not sweep.step():
                return self._response(sweep.sum)

    def _finish(self, sweep: Shifted, frequency_hz: float) -> DynamicStiffness:
        """Return the result of a sweep, refined by rounds if its true residual is too large."""
        result = self.oscillating.swept(sweep)
        if (
            result.residual > max(RESIDUAL_MISMATCH * sweep.residual, RESONANCE_TOLERANCE)
            or sweep.residual > MONITOR_FROM
        ):
            return self._solve(frequency_hz, RESONANCE_TOLERANCE, result)
        return self._to_stiffness(result, frequency_hz)

    def _smooth_stiffness(self) -> float:
        """Return the stiffness of the smooth dry bodies [N/m], the initial guess."""
        conditions = self.conditions
        if not conditions.long:
            approach = conditions.hertz.approach
            assert approach is not None  # a line's alone depends on the depth
            return 1.5 * conditions.load / approach
        radius = conditions.radius_along_rolling
        modulus = conditions.pair.reduced_modulus
        length = conditions.line_length
        depth = length if self.depth is None else self.depth  # for a roller its length
        return line_stiffness(conditions.load, length, radius, modulus, depth)


@dataclass(frozen=True, kw_only=True)
class OwnResonance:
    """Resonance of a mass on a solved contact, with cells at the cap elastic (run in) or flowing.

    `yields` is True if any cell of the `solution` is at the pressure cap.
    """

    elastic: DynamicStiffness
    yields: bool
    solution: ContactSolution = field(repr=False, compare=False)

    @cached_property
    def virgin(self) -> DynamicStiffness:
        """Stiffness with flowing cells at the cap, at the frequency of `elastic`; lazy.

        Raises
        ------
        AsperityError
            if the linear equations do not converge.
        """
        if not self.yields:  # both limits coincide
            return replace(self.elastic, yielded=FLOWING)
        oscillating = OscillatingContact(
            self.solution, yielded=FLOWING, reference_depth=self.elastic.reference_depth
        )
        return oscillating.converged_at(self.elastic.frequency_hz)


def own_resonance(
    solution: ContactSolution, mass: float, *, reference_depth: float | None = None
) -> OwnResonance:
    """Compute the resonance of a mass [kg] on a solved contact.

    Raises
    ------
    BadInput, AsperityError
        see `OscillatingContact`.
    """
    oscillating = OscillatingContact(solution, reference_depth=reference_depth)
    return OwnResonance(
        elastic=oscillating.resonance(mass), yields=oscillating.yields, solution=solution
    )


def _resonance_hz(stiffness: float, mass: float) -> float:
    """Return the natural frequency [Hz] of a mass [kg] on a spring [N/m]."""
    return math.sqrt(stiffness / mass) / (2.0 * math.pi)


def _stagnated(responses: list[complex], sweep: Shifted) -> bool:
    """Return whether k and c have stagnated over the last steps at a sufficient residual."""
    monitored = max(MIN_MONITORED_STEPS, int(MONITORED_SHARE * sweep.count))
    if sweep.residual > MONITOR_FROM or len(responses) < monitored:
        return False
    *earlier, last = responses[-monitored:]
    damping = max(abs(response.imag - last.imag) for response in earlier)
    stiffness = max(abs(response.real - last.real) for response in earlier)
    return damping <= max(
        STAGNATION * abs(last.imag), MIN_LOSS_FACTOR * abs(last)
    ) and stiffness <= STAGNATION * abs(last.real)


def dynamic_stiffness(
    solution: ContactSolution,
    frequency_hz: float,
    *,
    yielded: Yielded = ELASTIC,
    reference_depth: float | None = None,
) -> DynamicStiffness:
    """Compute k(ω) and c(ω) of a solved contact at one frequency [Hz].

    Use `OscillatingContact` for several frequencies.

    Raises
    ------
    BadInput, AsperityError
        see `OscillatingContact`.
    """
    return OscillatingContact(solution, yielded=yielded, reference_depth=reference_depth).evaluate(
        frequency_hz
    )
