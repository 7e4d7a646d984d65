"""Vibration model of a case; the contact is solved only if the model needs it."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from asperity.case import Case
from asperity.core.errors import BadInput
from asperity.core.quantities import lines, quantity, read
from asperity.coupling import MAX_LINEAR_LOAD, Vibration, contact_vibration, dry_full_load
from asperity.ehl import ContactState, Iteration
from asperity.resonance import Resonance
from asperity.results.solve import solve_case

KEYS = ("crf_hz", "crfa", "crf_std_hz", "crfa_std", "clr", "car", "sq_m")


@dataclass(frozen=True, slots=True, kw_only=True)
class VibratedCase:
    """Vibration of a case, and the state of its contact."""

    case: Case
    state: ContactState
    vibration: Vibration

    @property
    def resonance(self) -> Resonance:
        """Contact resonance of the record, found or not."""
        return self.vibration.resonance

    def scalars(self) -> dict[str, object]:
        """Return the numbers of `asperity vibrate --json` by key, SI; None if not available."""
        numbers = read(self, (*map(quantity, KEYS), *lines("vibration")))
        result = {"found": self.resonance.found, "reason": self.resonance.reason}
        return {
            "verdict": self.verdict(),
            **numbers,
            **result,
            "band_hz": list(self.vibration.band_hz),
        }

    def verdict(self) -> str:
        """Return one sentence: resonance, contact, and a warning if the spring is nonlinear."""
        resonance = self.resonance
        model = self.case.vibration
        force = self.vibration.dynamic_load
        load = f"{self.case.conditions.load:g} N on asperities"
        solved = model is not None and model.needs_solution
        contact = (
            f"solved contact, {100 * self.state.clr:.0f} % of {load}"
            if solved
            else f"dry contact, all {load}"
        )
        if not resonance.found:
            return f"No contact resonance ({resonance.reason.rstrip('.')}): {contact}."
        deviation = f" ± {resonance.crf_std_hz:.1f}" if math.isfinite(resonance.crf_std_hz) else ""
        sentence = f"Contact resonance at {resonance.crf_hz:.1f}{deviation} Hz"
        sentence += f", CRFA {resonance.crfa:.3g} (m/s^2)^2/Hz: {contact}"
        linear = model is not None and model.linear
        if linear and force is not None and force > MAX_LINEAR_LOAD:
            sentence += (
                f"; the dynamic force is {100 * force:.0f} % of the load, too much for a linear "
                "spring: use vibration.response = nonlinear"
            )
        return f"{sentence}."


def vibrate_case(
    case: Case, *, progress: Callable[[Iteration], None] | None = None
) -> VibratedCase:
    """Simulate the vibration of a case.

    The contact is that of the paper's section 2, dry with all load on asperities of the case's Sq;
    or the solved contact if the case's stiffness law, damping law or excitation needs one.

    Raises
    ------
    BadInput
        for a case without [vibration], or as `contact_vibration`.
    NotConverged
        if the contact is required and does not converge.
    """
    model = case.vibration
    if model is None:
        raise BadInput(f"{case.source}: [vibration] is missing; add it with mass and damping_ratio")
    if model.needs_solution:
        run = solve_case(case, progress=progress)
        assert run.vibration is not None  # the case has a model
        return VibratedCase(case=case, state=run.state, vibration=run.vibration)
    state = dry_full_load(case.conditions, case.surface().sq)
    with case.naming("vibration"):
        return VibratedCase(
            case=case, state=state, vibration=contact_vibration(state, case.conditions, model)
        )
