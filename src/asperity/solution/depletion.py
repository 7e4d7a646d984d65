"""Layer of oil on a track over repeated passes of a contact, with reflow and supply between."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from asperity.contact.conditions import ContactConditions
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.ehl import ContactSolution, InletLayer, Options, solve_contact
from asperity.lubricant import Lubricant
from asperity.solution.flow import oil_flow
from asperity.surface import Surface

THINNEST = 1e-10  # m, of a layer; less than a molecule


@dataclass(frozen=True, kw_only=True)
class Reflow:
    """Replenishment of a track between two passes.

    Parameters
    ----------
    time : between two passes [s]
    surface_tension : of the oil, which levels the layer [N/m]; 0: none. Mineral oil: 0.03
    supply : thickness added everywhere between two passes [m], such as oil that grease bleeds
    """

    time: float
    surface_tension: float = 0.03
    supply: float = 0.0

    def __post_init__(self) -> None:
        require_positive("time between passes", self.time, "s")
        if not (self.surface_tension >= 0.0 and self.supply >= 0.0):
            raise BadInput(
                f"surface tension and supply must be 0 or more, got {self.surface_tension:g} N/m "
                f"and {self.supply:g} m"
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class Pass:
    """Pass of the contact over the track: its number from 1, and the solution with its layer."""

    number: int
    solution: ContactSolution
    layer: InletLayer


def deplete_track(
    conditions: ContactConditions,
    lubricant: Lubricant,
    surface: Surface,
    *,
    options: Options,
    passes: int,
    reflow: Reflow | None = None,
) -> Iterator[Pass]:
    """Yield repeated passes; the layer behind one, after its reflow, enters the next.

    Both bodies carry half of the layer. Oil pushed aside stays on the track's edges, unless it
    leaves the grid.

    Parameters
    ----------
    options : with the first `inlet_layer`, and the model "conserving"
    passes : number of passes
    reflow : replenishment between them; None: the layer behind a pass enters the next as it is

    Raises
    ------
    BadInput
        without an inlet layer.
    NotConverged
        if a pass does not converge.
    """
    if options.inlet_layer is None:
        raise BadInput("a depleting track needs options with an inlet layer; state inlet_layer")
    layer, solution = options.inlet_layer, None
    for number in range(1, passes + 1):
        now = replace(options, inlet_layer=layer)
        solution = solve_contact(conditions, lubricant, surface, options=now, start=solution)
        yield Pass(number=number, solution=solution, layer=layer)
        flow = oil_flow(solution)
        thickness = np.maximum(flow.layer_behind, THINNEST)
        if reflow is not None:
            thickness = levelled(thickness, flow.y, lubricant.viscosity.eta0, reflow)
        layer = InletLayer(tuple(thickness.tolist()), tuple(flow.y.tolist()))


def levelled(thickness: Field, y: Field, viscosity: float, reflow: Reflow) -> Field:
    """Return a layer on two bodies after capillary levelling and supply [m], (n,).

    On each body half of it flows under its surface tension, dh/dt = -d/dy(σ h³/3η d³h/dy³), without
    flow through the ends; gravity is left out. Source: S. E. Orchard, Appl. Sci. Res. A 11 (1962).

    Parameters
    ----------
    thickness, y : layer [m] and evenly spaced places across rolling [m], (n,)
    viscosity : at ambient pressure [Pa s]
    """
    half, spacing = 0.5 * np.asarray(thickness, dtype=float), float(y[1] - y[0])
    if reflow.surface_tension > 0.0:
        factor = reflow.surface_tension / (3.0 * viscosity * spacing**4)
        scale = float(half.max())

        def rate(_: float, share: Field) -> Field:
            height = scale * share
            mirrored = np.concatenate([height[:1], height, height[-1:]])
            curvature = mirrored[2:] - 2.0 * height + mirrored[:-2]
            between = 0.5 * (height[1:] + height[:-1])
            flow = factor * between**3 * np.diff(curvature)
            return np.diff(np.concatenate([[0.0], flow, [0.0]])) * -1.0 / scale

        solved = scipy.integrate.solve_ivp(
            rate, (0.0, reflow.time), half / scale, method="BDF", rtol=1e-8, atol=1e-10
        )
        half = np.maximum(scale * solved.y[:, -1], THINNEST)
    return np.asarray(2.0 * half + reflow.supply)
