"""Initial guesses of a starved contact: the flooded one, its inlet emptied up to a front."""

from dataclasses import replace

import numpy as np

from asperity.ehl.contact_solution import ContactSolution
from asperity.ehl.inlet_layer import InletLayer

# gap over the layer's thickness at the front; the true one follows from the solution
FRONTS = (4.0, 2.2, 8.0, 1.6, 16.0)


def emptied_inlet(flooded: ContactSolution, layer: InletLayer, front: float) -> ContactSolution:
    """Return a flooded contact without pressure where the gap ahead is `front` times the layer."""
    assert flooded.oil is not None
    thickness = layer.thickness_at(flooded.grid.y)[None, :]
    empty = (flooded.gap > front * thickness) & (flooded.grid.x[:, None] < 0.0)
    content = np.where(empty, thickness / flooded.gap, flooded.oil.content)
    oil = replace(flooded.oil, content=content, pressure=np.where(empty, 0.0, flooded.oil.pressure))
    return replace(flooded, pressure=np.where(empty, 0.0, flooded.pressure), oil=oil)


def passes_less(flooded: ContactSolution, layer: InletLayer) -> bool:
    """Return whether a flooded contact passes less oil than a layer brings everywhere."""
    assert flooded.oil is not None
    passed = flooded.oil.content[-1] * flooded.gap[-1]  # at ambient pressure
    return bool(np.all(passed <= layer.thickness_at(flooded.grid.y)))
