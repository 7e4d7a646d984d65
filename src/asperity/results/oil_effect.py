"""Effect of an estimated pressure-viscosity coefficient on film, load share and resonance."""

from dataclasses import dataclass, replace

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.quantities import quantity
from asperity.ehl import ContactError, ContactSolution, ContactState, Sides
from asperity.lubricant import STATED_ALPHA_ERROR, Barus, Roelands
from asperity.results.surface_spread import Row, crf_sides
from asperity.solution import contact_state, solve_thermal_contact

Ends = tuple[float, float]
FILMS = {"h_central_m": "h_central", "h_mean_m": "h_mean", "h_min_m": "h_min"}  # key -> field


@dataclass(frozen=True)
class AlphaEffect:
    """Film and load share at both ends of the interval of an estimated alpha.

    Parameters
    ----------
    error : half of that interval over alpha
    films : relative film at the lower and at the upper end, by key in the catalogue
    clr : change of the load share at the lower and at the upper end
    """

    error: float
    films: dict[str, Ends]
    clr: Ends

    @property
    def clr_sides(self) -> Sides:
        """Error of the load share below and above it."""
        return _sides(self.clr)

    def film_sides(self, key: str) -> Sides:
        """Return the relative error of a film below and above it."""
        low, high = self.films[key]
        return _sides((low - 1.0, high - 1.0))

    def ends(self, means: Row) -> dict[str, Ends]:
        """Return the values at both ends by key, SI, for a contact with these means."""
        values: dict[str, Ends] = {}
        for key, (low, high) in self.films.items():
            film = float(means[key] or 0.0)
            values[key] = film * low, film * high
        clr = float(means["clr"] or 0.0)
        below, above = (min(max(clr + change, 0.0), 1.0) for change in self.clr)
        return values | {"clr": (below, above)}

    def summary(self, means: Row) -> dict[str, object]:
        """Return the effect for `--json`."""
        return {"alpha_error": self.error, **{k: list(v) for k, v in self.ends(means).items()}}

    def note(self, means: Row) -> str:
        """Return a sentence with both ends, and what a measured alpha would gain."""
        ends = self.ends(means)
        central, clr = quantity("h_central_m"), quantity("clr")
        share = STATED_ALPHA_ERROR / self.error
        return (
            f"Alpha is estimated, ± {100.0 * self.error:.0f} %: at the ends of this interval the "
            f"{central.name} is {central.text(ends['h_central_m'][0])} and "
            f"{central.text(ends['h_central_m'][1])}, the {clr.name} {clr.text(ends['clr'][0])} "
            f"and {clr.text(ends['clr'][1])}. A measured alpha "
            f"(± {100.0 * STATED_ALPHA_ERROR:.0f} %) would reduce these ranges to "
            f"{100.0 * share:.0f} %."
        )


def _sides(changes: Ends) -> Sides:
    return max(0.0, -min(changes)), max(0.0, *changes)


def estimates_alpha(case: Case) -> bool:
    """Return True for an oil whose pressure-viscosity coefficient is estimated."""
    sheet = case.oil_sheet
    return case.lubricant is not None and sheet is not None and sheet.alpha is None


def with_alpha(case: Case, state: ContactState, effect: AlphaEffect | None) -> ContactError:
    """Return the uncertainty of a contact with the part of an estimated alpha.

    That part is undetermined without its `effect`; CRF follows from CLR by the coupling's law.
    """
    error = state.error
    assert error is not None  # set by contact_state
    if not estimates_alpha(case):
        return error
    sides = None if effect is None else effect.clr_sides
    crf_hz, model = error.crf_hz, case.vibration
    if crf_hz is not None and model is not None:
        oil = sides and crf_sides(error.clr.value, sides, state, case.conditions, model)
        crf_hz = replace(crf_hz, oil=oil)
    return replace(error, clr=replace(error.clr, oil=sides), crf_hz=crf_hz)


def alpha_effect(case: Case, solution: ContactSolution) -> AlphaEffect | None:
    """Return the effect of an estimated alpha, from a solution with standing roughness.

    None for an alpha that is given, without oil, and where a contact does not converge.
    """
    oil = solution.lubricant
    if oil is None or not estimates_alpha(case) or not solution.convergence.converged:
        return None
    law = oil.viscosity
    assert isinstance(law, Barus | Roelands)  # of a data sheet
    states = [contact_state(solution)]
    for factor in (1.0 - oil.alpha_error, 1.0 + oil.alpha_error):
        changed = replace(oil, viscosity=replace(law, alpha=factor * law.alpha))
        with threadpool_limits(1):  # sums depend on the number of threads
            solved = solve_thermal_contact(
                solution.conditions,
                changed,
                solution.surface,
                boundary_friction=case.boundary_friction,
                thermal=case.thermal,
                options=case.options,
                start=solution,
                strict=False,
            )
        if not solved.convergence.converged:
            return None
        states.append(contact_state(solved))
    middle, low, high = states
    films = {
        key: (
            getattr(low, name) / getattr(middle, name),
            getattr(high, name) / getattr(middle, name),
        )
        for key, name in FILMS.items()
    }
    return AlphaEffect(oil.alpha_error, films, (low.clr - middle.clr, high.clr - middle.clr))


def oil_summary(case: Case, effect: AlphaEffect | None, means: Row) -> dict[str, object]:
    """Return what `--json` has for an oil from a data sheet; empty without one.

    `oil` has its numbers with their `origins`, `alpha_effect` film and load share at the ends of
    the interval of an estimated alpha.
    """
    facts = case.oil_facts
    if not facts:
        return {}
    origins = {fact.key: ": ".join(filter(None, (fact.origin, fact.how))) for fact in facts}
    values: dict[str, object] = {fact.key: fact.value for fact in facts}
    summary: dict[str, object] = {"oil": {**values, "origins": origins}}
    return summary if effect is None else summary | {"alpha_effect": effect.summary(means)}
