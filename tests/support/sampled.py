"""A contact solution with prescribed pressure and gap, for tests of quantities derived from
solutions.
"""

import numpy as np

from asperity.ehl import ContactSolution, Convergence, Iteration, Options, SolveStatus
from asperity.surface import flat_surface


def sampled(conditions, lubricant, grid, pressure, gap, in_contact=None):
    """Return a solution; scalar values are broadcast over the grid."""
    return ContactSolution(
        conditions=conditions,
        lubricant=lubricant,
        surface=flat_surface(grid),
        options=Options(),
        pressure=np.broadcast_to(np.asarray(pressure, float), grid.cells).copy(),
        gap=np.broadcast_to(np.asarray(gap, float), grid.cells).copy(),
        in_contact=np.zeros(grid.cells, bool) if in_contact is None else in_contact,
        rigid_approach=0.0,
        convergence=Convergence(
            SolveStatus.CONVERGED, (Iteration(grid.cells, 1, 0.0, 0.0, 0.0),), 1e-4, 0.0
        ),
    )
