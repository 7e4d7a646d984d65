"""Tangent stiffness of a solved contact, split into asperities and film, by small load steps.

Quasi-static: the film settles fully, which a 3 kHz vibration does not quite permit (oil crosses the
paper's Hertz zone in 0.06 ms, a fifth of a period). Squeeze film and its damping are not included;
`asperity.solution.dynamic_stiffness` has both.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.core.errors import BadInput, require_positive
from asperity.ehl import ContactSolution, Scales, solve_contact
from asperity.ehl.models.single_pressure import Problem
from asperity.ehl.outcome import CONSERVING
from asperity.solution.state import plastic_overlap

LOAD_STEP = 0.02  # up and down, as a share of the load
SOLVER_TOLERANCE = 1e-6  # tight: the approach changes by some per cent of a^2/R only
# Increase of the pressure cap after shakedown: no cell reaches it in load steps of some per cent.
SHAKEDOWN_HARDENING = 1.15

Yielded = Literal["flowing", "elastic"]
FLOWING, ELASTIC = YIELDED = get_args(Yielded)


@dataclass(frozen=True, slots=True, kw_only=True)
class TangentStiffness:
    """Tangent stiffness dF/dδ [N/m]: `asperity` (touching cells) plus `film` (all others).

    δ is the approach of the bodies. For a line contact it refers to points `reference_depth` [m]
    away, on which it depends (None for other contacts, which refer to infinity). `step` is the load
    step used, as a share of the load; `step_change` and `split_change` are the changes of the total
    (relative) and of the asperity share when the step is halved to this one. The total is accurate
    to a few per cent, the split less, because few cells change state in a small step. `yielded` is
    the behaviour of cells at the pressure cap: "flowing" at constant pressure, also on unloading,
    as virgin roughness does on average while new asperities come into contact; or "elastic", as in
    a contact that has carried this load before.
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
        """Asperity and film stiffness together [N/m]."""
        return self.asperity + self.film


def tangent_stiffness(
    solution: ContactSolution,
    *,
    reference_depth: float | None = None,
    step: float = LOAD_STEP,
    yielded: Yielded = FLOWING,
) -> TangentStiffness:
    """Compute the tangent stiffness by central differences over load steps of `step` and `step`/2.

    Parameters
    ----------
    reference_depth : of a line contact [m]; default `roller_depth` of the conditions
    step : share of the load
    yielded : behaviour of cells at the pressure cap; "elastic" subtracts the overlap from the
        heights, raises the cap by 15 % and solves that contact, in which no cell yields again

    Raises
    ------
    BadInput
        for an unknown `yielded`, a step outside 0.1 % to 20 %, or a reference depth less than the
        half-width.
    NotConverged
        if a neighbouring load cannot be solved.
    """
    if not 1e-3 <= step <= 0.2:
        raise BadInput(
            f"load step must be between 0.001 and 0.2 of the load, got {step:g}; {LOAD_STEP:g} is "
            "usual"
        )
    if yielded not in YIELDED:
        raise BadInput(f"yielded must be one of {', '.join(YIELDED)}, got {yielded!r}")
    depth = (
        checked_depth(solution.conditions, reference_depth) if solution.conditions.endless else None
    )
    if yielded == ELASTIC and solution.p_cap is not None:
        solution = _after_shakedown(solution)
    coarse, fine = (
        _central_difference(solution, depth, relative_step) for relative_step in (step, step / 2.0)
    )
    return TangentStiffness(
        asperity=fine[0],
        film=fine[1],
        reference_depth=depth,
        step=step / 2.0,
        step_change=sum(fine) / sum(coarse) - 1.0,
        split_change=fine[0] / sum(fine) - coarse[0] / sum(coarse),
        yielded=yielded,
    )


def _after_shakedown(solution: ContactSolution) -> ContactSolution:
    """Return the contact after shakedown: flattened by its load, with a raised pressure cap."""
    surface = solution.surface
    conditions = solution.conditions
    if solution.options.model == CONSERVING or conditions.hardness is None:
        raise BadInput("shakedown needs the model unified or mixed; solve with one of them")
    flattened = replace(
        solution, surface=replace(surface, heights=surface.heights - plastic_overlap(solution))
    )
    hardened = replace(conditions, hardness=SHAKEDOWN_HARDENING * conditions.hardness)
    return _solve_at_load(replace(flattened, conditions=hardened), 1.0)


def checked_depth(conditions: ContactConditions, reference_depth: float | None) -> float:
    """Return the reference depth of a line contact [m], by default `roller_depth`."""
    depth = roller_depth(conditions) if reference_depth is None else reference_depth
    require_positive("reference depth", depth, "m")
    half_width = conditions.hertz.half_widths[0]
    if depth <= half_width:
        raise BadInput(
            f"reference depth must be greater than the contact's half-width of {half_width:.3g} "
            f"m, got {depth:.3g} m"
        )
    return depth


def roller_depth(conditions: ContactConditions) -> float:
    """Return the depth 2R/e [m] at which a half-space is as stiff as a cylinder held at its centre.

    R is the effective radius. The cylinder's approach (P'/πE*)(2 ln(4R/a) - 1) is the half-space's
    (P'/πE*)(2 ln(2d/a) + 1) at d = 2R/e. Source: K. L. Johnson, Contact Mechanics (1985), eqs
    5.57-5.58.
    """
    return 2.0 * conditions.radius_along_rolling / math.e


def stiffness_scale(conditions: ContactConditions, problem: Problem, scales: Scales) -> float:
    """Return the factor from a dimensionless pressure sum per approach to a stiffness [N/m]."""
    dx, dy = problem.spacing
    cell = scales.pressure * scales.length**2 / scales.gap * dx * dy
    if not conditions.endless or conditions.length is None:
        return cell
    return cell * conditions.length / (problem.cells[1] * dy * scales.length)


def at_depth(conditions: ContactConditions, stiffness: complex, depth: float | None) -> complex:
    """Convert a line contact's stiffness [N/m] from the solver's reference to points `depth` away.

    The solver refers it to points one half-width away; others (depth None) refer to infinity.
    """
    if depth is None or conditions.length is None:
        return stiffness
    distance = math.log(depth / conditions.hertz.half_widths[0])
    spread = 2.0 / (math.pi * conditions.pair.reduced_modulus * conditions.length)
    return 1.0 / (1.0 / stiffness + spread * distance)


def _central_difference(
    solution: ContactSolution, depth: float | None, relative_step: float
) -> tuple[float, float]:
    """Return the asperity and the film stiffness [N/m]."""
    below, above = (_state_at(solution, depth, 1.0 + sign * relative_step) for sign in (-1.0, 1.0))
    asperity, film, approach = (b - a for a, b in zip(below, above, strict=True))
    return asperity / approach, film / approach


def _state_at(
    solution: ContactSolution, depth: float | None, factor: float
) -> tuple[float, float, float]:
    """Return asperity load, film load and approach, at `factor` times the load."""
    solved = _solve_at_load(solution, factor)
    load = solved.conditions.load
    asperity_share = float(solved.pressure[solved.in_contact].sum() / solved.pressure.sum())
    return asperity_share * load, (1.0 - asperity_share) * load, approach_of(solved, depth)


def _solve_at_load(solution: ContactSolution, factor: float) -> ContactSolution:
    """Solve at `factor` times the load with a tight tolerance, warm-started."""
    conditions = replace(solution.conditions, load=factor * solution.conditions.load)
    options = replace(solution.options, tolerance=min(SOLVER_TOLERANCE, solution.options.tolerance))
    return solve_contact(
        conditions,
        solution.lubricant,
        solution.surface,
        options=options,
        start=solution,
        viscosity_factor=solution.viscosity_factor,
    )


def approach_of(solution: ContactSolution, depth: float | None) -> float:
    """Return the approach of the bodies [m], for a line contact that of points `depth` [m] away.

    The solver refers a line contact to points one half-width away, and the half-width grows with
    the load; this approach has the same zero at any load.
    """
    conditions = solution.conditions
    approach = -solution.rigid_approach
    if depth is not None:
        slope = 2.0 * conditions.line_load / (np.pi * conditions.pair.reduced_modulus)
        approach += slope * float(np.log(depth / conditions.hertz.half_widths[0]))
    return approach
