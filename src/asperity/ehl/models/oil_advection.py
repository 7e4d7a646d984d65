"""Oil carried by the moving bodies in two-pressure models: upwind wedge, second-order limiter.

The wedge is first order, or second order with a slope limiter that acts where the film's content
jumps, as at the edge of a touching cell.
"""

import numpy as np

from asperity.core.arrays import Field
from asperity.ehl.models.single_pressure import Problem
from asperity.kernels import load_sharing
from asperity.kernels.reynolds import limited_outflow

OPENING_RANGE = 0.5  # in contact films: gap above the contact film over which the limiter sets in


def uses_limiter(problem: Problem) -> bool:
    """Return True if the wedge is second order with a slope limiter.

    Smooth bodies have a third-order wedge, and at the borders of conserving cavities content jumps.
    """
    return not problem.accurate and not problem.conserve


def is_lagrangian(problem: Problem) -> bool:
    """Return True if oil is balanced along its path."""
    return problem.past is not None and problem.past.lagrangian


def upstream_content(problem: Problem, content: Field) -> Field:
    """Return the content upstream of each cell, (nx, ny).

    For Lagrangian oil it is that of one time step earlier.
    """
    upstream = np.concatenate([content[:1], content[:-1]])
    if problem.past is not None and problem.past.upstream is not None:
        upstream[2:] = problem.past.upstream[2:]
    return upstream


def slope_limiter(problem: Problem, content: Field, gap: Field) -> Field:
    """Return the slope limiter, (nx, ny).

    Half of 2 m₁ m₂/(m₁² + m₂²) of each cell and the one upstream: 1/2 where the film is uniform. It
    falls beside nearly closed cells and is zero beside closed ones: there the film is constant, and
    its content varies with density only.
    """
    closed = problem.contact_gap
    limiter = np.empty_like(content)
    load_sharing.limiter(
        content, upstream_content(problem, content), gap, closed, OPENING_RANGE * closed, limiter
    )
    return limiter


def second_order_outflow(
    problem: Problem, content: Field, limiter: Field, *, second_order: bool
) -> Field:
    """Return the outflow of each cell due to the second order of the wedge, (nx, ny)."""
    if not is_lagrangian(problem):
        return limiter_outflow(problem, content, limiter, limiter)
    past = problem.past
    assert past is not None
    added = limiter * (content - upstream_content(problem, content))
    if second_order and past.limiter_correction is not None:
        added -= past.limiter_correction
    added *= past.rate
    return added


def limiter_outflow(problem: Problem, content: Field, own: Field, upstream: Field) -> Field:
    """Return the outflow of each cell due to the second order, for an additional content, (nx, ny).

    The correction is `own` times a cell's content less `upstream` times that upstream: the limiter
    itself, or its derivatives.
    """
    past = problem.past
    if past is not None and past.lagrangian:
        return own * content * content.dtype.type(past.rate)
    added = np.empty_like(content)
    limited_outflow(content, own, upstream, problem.spacing[0], added)
    return added


def advected_outflow(problem: Problem, content: Field) -> Field:
    """Return the outflow of each cell of a content that moves with the oil, (nx, ny).

    It is upwind and of first order.
    """
    past, dx = problem.past, problem.spacing[0]
    if past is None or not past.lagrangian:
        outflow = content.copy()
        outflow[1:] -= content[:-1]
        outflow /= dx
    else:
        outflow = np.zeros_like(content)
        if not problem.conserve:
            outflow[0], outflow[1] = content[0] / dx, (content[1] - content[0]) / dx
    return outflow if past is None else outflow + past.rate * content


def upwind_at_outlet(problem: Problem, content: Field, outflow: Field) -> None:
    """Make the film's last face first order, in place.

    Where oil is missing, all of it must be upwind.
    """
    if not is_lagrangian(problem):
        dx = problem.spacing[0]
        outflow[-1] -= (content[-1] - content[-2]) * content.dtype.type(0.5 / dx)


def outflow_by_content(problem: Problem) -> float:
    """Return the derivative of a cell's outflow in its own content."""
    past = problem.past
    wedge = 0.0 if past is not None and past.lagrangian else 1.0 / problem.spacing[0]
    return wedge if past is None else wedge + past.rate
