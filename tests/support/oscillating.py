"""Linearised dynamic equations of a solved contact, written face by face in NumPy and solved as one
dense complex system.

Only the state of each cell comes from the package; derivatives come from complex steps.
"""

import numpy as np

from asperity.ehl.models.mixed import MixedBalance
from asperity.kernels.reynolds import CAPPED, LUBRICATED, TOUCHING
from support.reynolds import net_outflow

TINY = 1e-30


def compliance(problem):
    """Return the deflection of every cell under unit pressure in every other, shape
    (cells, cells).
    """
    count = problem.roughness.size
    units = np.eye(count).reshape(count, *problem.cells)
    return np.stack([problem.deflection(unit).ravel() for unit in units], axis=1)


def faces_of(balance):
    """Return the model's interpolation of content and mobility from cells to faces."""
    accurate = balance.problem.accurate
    upwind = (0.0, 0.0) if isinstance(balance, MixedBalance) else (0.0, 0.5)
    return {"wedge": (0.375, 0.125) if accurate else upwind, "logarithmic": accurate}


def load_response_of_cells(balance, frequencies):
    """Complex change of the sum of P per unit of approach, at angular frequencies ω a/u."""
    problem, count = balance.problem, balance.gap.size
    two_pressures = isinstance(balance, MixedBalance)
    oil_pressure = balance.unknowns.oil if two_pressures else balance.pressure
    wet = (balance.rows.state == LUBRICATED).ravel()
    solid = balance.solid if two_pressures else balance.rows.state
    closed = (solid == TOUCHING).ravel()
    free = ~closed & (solid != CAPPED).ravel()
    held = (
        balance.film.content_by_gap == 0.0
        if two_pressures
        else (balance.gap <= problem.contact_gap) & (solid != LUBRICATED)
    )
    deflection = compliance(problem)

    def oil_rows(d_pressure, d_gap):
        """Directional derivatives of outflow and content by the oil's pressure and the gap."""
        pressure = oil_pressure + 1j * TINY * d_pressure
        gap = np.maximum(balance.gap, problem.contact_gap) + 1j * TINY * np.where(held, 0.0, d_gap)
        outflow, content = _outflow(balance, pressure, gap)
        return outflow.imag.ravel() / TINY, content.imag.ravel() / TINY

    oil_cells, solid_cells = np.flatnonzero(wet), np.flatnonzero(closed)
    columns, stored, totals = [], [], []
    for number, cell in enumerate([*oil_cells, *solid_cells]):
        unit = np.zeros(count)
        unit[cell] = 1.0
        is_oil = number < oil_cells.size
        total = unit if not (two_pressures and is_oil) or free[cell] else np.zeros(count)
        own = unit if is_oil or not two_pressures else np.zeros(count)
        d_gap = deflection @ total
        rows, kept = oil_rows(own.reshape(problem.cells), d_gap.reshape(problem.cells))
        totals.append(total)
        columns.append(np.concatenate([rows[oil_cells], d_gap[solid_cells]]))
        stored.append(np.concatenate([kept[oil_cells], np.zeros(solid_cells.size)]))
    by_approach = np.ones(problem.cells)
    rows, kept = oil_rows(np.zeros(problem.cells), by_approach)
    rhs = np.concatenate([rows[oil_cells], np.ones(solid_cells.size)])
    kept = np.concatenate([kept[oil_cells], np.zeros(solid_cells.size)])
    matrix, stores, total = (
        np.stack(columns, axis=1),
        np.stack(stored, axis=1),
        np.array(totals).sum(axis=1),
    )
    return [
        complex(
            total @ np.linalg.solve(matrix + 1j * frequency * stores, rhs + 1j * frequency * kept)
        )
        for frequency in frequencies
    ]


def _outflow(balance, pressure, gap):
    """Net outflow and oil content of every cell; complex arguments are allowed."""
    problem = balance.problem
    oil, pascals = problem.lubricant, pressure * problem.p_scale
    density = oil.density(pascals) / oil.density.rho0
    eta0 = oil.viscosity.eta0
    mobility = density * gap**3 * eta0 / (problem.speed * oil.viscosity(pascals))
    if isinstance(balance, MixedBalance):
        least = problem.contact_gap**6 / problem.speed / gap.real**3
        if problem.exact:  # of constant fluidity
            least = least * (gap / gap.real) ** 3
        mobility = np.where(mobility.real < least, least, mobility)
    ambient = gap[[0, -1]] ** 3 / problem.speed
    content = density * gap
    dx, dy = problem.spacing
    ahead = gap[0] + ((problem.x[0] - dx) ** 2 - problem.x[0] ** 2) / 2.0
    entering = (ahead + gap[0]) / 2.0
    scheme = faces_of(balance) | {"height": gap if problem.exact else None}
    outflow = net_outflow(pressure, content, mobility, ambient, entering, dx, dy, **scheme)
    if isinstance(
        balance, MixedBalance
    ):  # second order, limited at film steps; the degree of opening is fixed
        here, before = content[1:-1], content[:-2]
        lean = here * before / (here**2 + before**2)
        added = np.zeros_like(content)
        added[1:-1] = balance.limiter[1:-1] / lean.real * lean * (here - before)
        difference = added.copy()
        difference[1:] -= added[:-1]
        outflow = outflow + difference / dx
    return outflow, content
