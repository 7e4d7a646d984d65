"""Transient contact: rough surfaces moving through the contact, with the squeeze term of the oil.

Steps are yielded; the caller stores them and decides when to stop (`asperity.simulation`).
"""

from collections.abc import Callable, Iterator
from itertools import count

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.ehl import MAX_CELLS_PER_TIME_STEP, Options, Start
from asperity.lubricant import Lubricant
from asperity.surface import MovingSurfaces
from asperity.transient.time_step import Memory, Snapshot, StepLength, TransientContact

Steps = Callable[..., Iterator[Snapshot]]  # interface of a transient model


def moving_contact(
    conditions: ContactConditions,
    lubricant: Lubricant,
    surfaces: MovingSurfaces,
    *,
    start: Start | Memory = "steady",
    time_step: float = 1.0,
    flattening: bool = False,
    options: Options | None = None,
    viscosity_factor: Field | None = None,
) -> Iterator[Snapshot]:
    """Yield the contact at time 0 and after each time step, without end.

    Parameters
    ----------
    conditions, lubricant : the contact and its oil; the load is constant
    surfaces : roughness of both bodies and its speeds
    start : "steady" from the steady solution with stationary roughness; "stationary" from rest,
        with dry contact and all gaps full of oil; or `memory` of an earlier snapshot to continue
        from, which is not yielded again
    time_step : over the transit time of the oil through a cell; 1 follows the oil
    flattening : lower the rough surface permanently by the overlap that the pressure cap permits
        (half each if both are rough)
    options : solver settings of every step; default `Options()`
    viscosity_factor : local over isothermal viscosity, (nx, ny), as by inlet shear heating

    A step that does not converge, the first included, is yielded, marked in `solution.convergence`,
    and the next step starts from it.

    Raises
    ------
    BadInput
        for a time step that is not positive or longer than 8 cells, an unknown start, and as
        `solve_contact`.
    """
    require_positive("time step", time_step, "cells")
    if time_step > MAX_CELLS_PER_TIME_STEP:
        raise BadInput(
            f"time step must be at most {MAX_CELLS_PER_TIME_STEP:g} cells, got {time_step:g}; "
            "1 follows the "
            "oil"
        )
    if isinstance(start, str) and start not in ("steady", "stationary"):
        raise BadInput(f"start must be steady or stationary, got {start!r}")
    seconds = step_seconds(conditions, surfaces, time_step)
    contact = TransientContact(
        conditions,
        lubricant,
        surfaces,
        options or Options(),
        StepLength(seconds, time_step),
        viscosity_factor=viscosity_factor,
        flattening=flattening,
    )
    if isinstance(start, str):
        first = contact.start(surfaces.composite_at(0.0), steady=start == "steady")
        yield first
        memory = first.memory
    else:
        memory = start
    for number in count(int(memory["number"]) + 1):
        snapshot = contact.step(number, memory, number * seconds)
        yield snapshot
        memory = snapshot.memory


def step_seconds(
    conditions: ContactConditions, surfaces: MovingSurfaces, time_step: float
) -> float:
    """Return the length of a time step [s] of `time_step` cells."""
    return time_step * surfaces.grid.spacing[0] / conditions.entrainment_speed
