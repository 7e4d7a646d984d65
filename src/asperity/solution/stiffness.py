"""The tangent stiffness of a solved contact, asperities and film apart: the load a little up and down, solved again.

Quasi-static: the film is given the time to settle that a 3 kHz vibration does not quite leave it
(oil crosses the paper's Hertz zone in 0.06 ms, a fifth of a period). No squeeze, no film damping:
`asperity.solution.dynamic_stiffness` has both.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput, require_positive
from asperity.ehl import ContactSolution, solve_contact
from asperity.ehl.outcome import CONSERVING
from asperity.solution.state import plastic_overlap

LOAD_STEP = 0.02  # up and down, as a share of the load
TIGHT = 1e-6  # solver tolerance: the approach differs by some per cent of a^2/R only
# times the cap: no cell of a shaken-down contact reaches it again in steps of some per cent
HARDENED = 1.15

Yielded = Literal["flowing", "elastic"]
FLOWING, ELASTIC = YIELDED = get_args(Yielded)


@dataclass(frozen=True, slots=True, kw_only=True)
class TangentStiffness:
    """dF/dδ of a contact [N/m] and its parts: `asperity` by the load on touching cells, `film` by all other load.

    δ is the approach of the bodies, of a line contact measured from points `reference_depth` [m]
    away, on which it depends (None for the others, measured from far away). `step` is the load
    step behind the figures, as a share of the load; `step_change` and `split_change` are how far
    the total, relatively, and the asperities' share of it move from a step twice as large to this
    one. The total is sharp to a few per cent; the split is not, because few cells change hands in
    a small step. `yielded` tells what cells at the pressure cap did: "flowing" at a constant
    pressure, on unloading too, as virgin roughness does on average while ever new asperities come;
    or "elastic", as in a joint that has borne this load before.
    """

    asperity: float
    film: float
    reference_depth: float | None
    step: float
    step_change: float
    split_change: float
    yielded: Yielded = FLOWING

    @property
    def total(self) -> float:
        """Asperities and film together [N/m]."""
        return self.asperity + self.film


def tangent_stiffness(
    solution: ContactSolution,
    *,
    reference_depth: float | None = None,
    step: float = LOAD_STEP,
    yielded: Yielded = FLOWING,
) -> TangentStiffness:
    """Tangent stiffness of a solved contact, by central differences over load steps of `step` and half of it.

    Parameters
    ----------
    reference_depth : of a line contact [m]; None takes `roller_depth` of the conditions
    step : share of the load
    yielded : what cells at the pressure cap do; "elastic" takes the overlap that the cap allowed off the heights, puts
        the cap up by 15 % and solves that contact, which then has nowhere left to yield

    Raises
    ------
    BadInput
        for a yielding that is none, a step outside 0.1 % to 20 %, or a reference no deeper than the contact is wide.
    NotConverged
        if a neighbouring load cannot be solved.
    """
    if not 1e-3 <= step <= 0.2:
        raise BadInput(
            f"load step must lie between 0.001 and 0.2 of the load, got {step:g}; {LOAD_STEP:g} is usual"
        )
    if yielded not in YIELDED:
        raise BadInput(f"yielded must be one of {', '.join(YIELDED)}, got {yielded!r}")
    depth = (
        checked_depth(solution.conditions, reference_depth) if solution.conditions.endless else None
    )
    if yielded == ELASTIC and solution.p_cap is not None:
        solution = _shaken_down(solution)
    coarse, fine = (_central_difference(solution, depth, share) for share in (step, step / 2.0))
    return TangentStiffness(
        asperity=fine[0],
        film=fine[1],
        reference_depth=depth,
        step=step / 2.0,
        step_change=sum(fine) / sum(coarse) - 1.0,
        split_change=fine[0] / sum(fine) - coarse[0] / sum(coarse),
        yielded=yielded,
    )


def _shaken_down(solution: ContactSolution) -> ContactSolution:
    """The same contact, its asperities as flat as the load has made them and hard enough to stay so."""
    surface, conditions = solution.surface, solution.conditions
    if solution.options.model == CONSERVING or conditions.hardness is None:
        raise BadInput(
            "a contact is shaken down in the models unified and mixed only; solve by one of them"
        )
    flattened = replace(
        solution, surface=replace(surface, heights=surface.heights - plastic_overlap(solution))
    )
    hardened = replace(conditions, hardness=HARDENED * conditions.hardness)
    return _solved_again(replace(flattened, conditions=hardened), 1.0)


def checked_depth(conditions: ContactConditions, reference_depth: float | None) -> float:
    """Where a line contact's approach is measured from [m]: `roller_depth` unless given."""
    depth = roller_depth(conditions) if reference_depth is None else reference_depth
    require_positive("reference depth", depth, "m")
    half_width = conditions.hertz.half_widths[0]
    if depth <= half_width:
        raise BadInput(
            f"reference depth must be greater than the contact's half-width of {half_width:.3g} m, got {depth:.3g} m"
        )
    return depth


def roller_depth(conditions: ContactConditions) -> float:
    """Depth 2R/e [m] that makes a half-space as stiff as a cylinder pressed at its centre; R is the effective radius.

    The cylinder's approach (P'/πE*)(2 ln(4R/a) - 1) is the half-space's (P'/πE*)(2 ln(2d/a) + 1)
    at d = 2R/e. Source: K. L. Johnson, Contact Mechanics (1985), eqs 5.57-5.58.
    """
    return 2.0 * conditions.radius_along_rolling / math.e


def _central_difference(
    solution: ContactSolution, depth: float | None, share: float
) -> tuple[float, float]:
    """Asperity and film part [N/m]."""
    less, more = (_state_at(solution, depth, 1.0 + sign * share) for sign in (-1.0, 1.0))
    asperity, film, approach = (b - a for a, b in zip(less, more, strict=True))
    return asperity / approach, film / approach


def _state_at(
    solution: ContactSolution, depth: float | None, factor: float
) -> tuple[float, float, float]:
    """Load on asperities, load on film, approach of points `depth` away; at `factor` times the load."""
    solved = _solved_again(solution, factor)
    load = solved.conditions.load
    borne = float(solved.pressure[solved.in_contact].sum() / solved.pressure.sum())
    return borne * load, (1.0 - borne) * load, approach_of(solved, depth)


def _solved_again(solution: ContactSolution, factor: float) -> ContactSolution:
    """Solved tightly, from the solution itself."""
    conditions = replace(solution.conditions, load=factor * solution.conditions.load)
    options = replace(solution.options, tolerance=min(TIGHT, solution.options.tolerance))
    return solve_contact(
        conditions,
        solution.lubricant,
        solution.surface,
        options=options,
        start=solution,
        viscosity_factor=solution.viscosity_factor,
    )


def approach_of(solution: ContactSolution, depth: float | None) -> float:
    """Approach of the bodies [m], of a line contact that of points `depth` [m] away, at any load from the same zero.

    The solver measures a line contact from points one half-width away, and the half-width grows
    with the load.
    """
    conditions, approach = solution.conditions, -solution.rigid_approach
    if depth is not None:
        slope = 2.0 * conditions.line_load / (np.pi * conditions.pair.reduced_modulus)
        approach += slope * float(np.log(depth / conditions.hertz.half_widths[0]))
    return approach
