"""Flow that pressure drives through a film on arrays: one bilinear sum that serves the balance and its linearisation.

x is the first axis and aperiodic with zero pressure on both end faces; y is the second axis and periodic. A face's
mobility is the arithmetic mean of its two cells', at the ends of the cell's and what it would be at zero pressure.
Knows no units, no oil and no tolerance.
"""

from typing import Any

from numba import njit

from asperity.arrays import Field
from asperity.kernels.reynolds import Stencil

RUPTURED, FULL, PLATEAU = 0, 1, 2  # what a cell's signed unknown stands for: missing oil, pressure, growth of the gap


@njit(cache=True, fastmath={"reassoc", "contract", "arcp"})
def driven_outflow(pressure: Field, mobility: Field, ambient: Field, spacing: tuple[Any, Any], out: Field) -> None:
    """Add to `out` what pressure drives out of each cell, per cell area; linear in pressure and in both mobilities.

    `ambient` is the mobility of the first and the last cells at zero pressure, shape (2, ny).
    """
    nx, ny = pressure.shape
    real = pressure.dtype.type
    over_dx2, over_dy2 = real(0.5 / (spacing[0] * spacing[0])), real(0.5 / (spacing[1] * spacing[1]))
    last = ny - 1
    for j in range(ny):
        out[0, j] += real(2.0) * over_dx2 * (mobility[0, j] + ambient[0, j]) * pressure[0, j]
        out[nx - 1, j] += real(2.0) * over_dx2 * (mobility[nx - 1, j] + ambient[1, j]) * pressure[nx - 1, j]
    for i in range(nx):
        if i < nx - 1:
            for j in range(ny):
                east = over_dx2 * (mobility[i, j] + mobility[i + 1, j]) * (pressure[i, j] - pressure[i + 1, j])
                out[i, j] += east
                out[i + 1, j] -= east
        for j in range(last):
            north = over_dy2 * (mobility[i, j] + mobility[i, j + 1]) * (pressure[i, j] - pressure[i, j + 1])
            out[i, j] += north
            out[i, j + 1] -= north
        north = over_dy2 * (mobility[i, last] + mobility[i, 0]) * (pressure[i, last] - pressure[i, 0])
        out[i, last] += north
        out[i, 0] -= north


@njit(cache=True)
def fluid_stencil(
    pressed: Field,
    content_by_unknown: Field,
    content_by_gap: Field,
    bending: Field,
    mobility: Field,
    ambient: Field,
    near: Field,
    spacing: tuple[Any, Any],
    standing: float,
    storing: float,
    out: Stencil,
) -> None:
    """Fill the five-point approximation of the oil balance's derivative by the signed unknowns.

    `pressed` is 1 where an unknown is the oil's pressure, `bending` where that pressure also bends the bodies;
    `near` holds the compliance of cells 0, 1 and 2 along x. With `standing` 1 the oil that arrives is what the cell
    upstream holds, with 0 it is known. A cell stores `storing` times the oil it gains.
    """
    nx, ny = pressed.shape
    dx, dy = spacing
    over_dx2, over_dy2 = 0.5 / (dx * dx), 0.5 / (dy * dy)
    over_dx = 1.0 / dx
    near0, near1, near2 = near[0], near[1], near[2]
    for i in range(nx):
        up, down = max(i - 1, 0), min(i + 1, nx - 1)
        for j in range(ny):
            jn = j + 1 if j < ny - 1 else 0
            js = j - 1 if j > 0 else ny - 1
            here = content_by_gap[i, j] * (over_dx + storing)
            above = content_by_gap[up, j] * over_dx * standing
            east = over_dx2 * (mobility[i, j] + mobility[down, j])
            west = over_dx2 * (mobility[i, j] + mobility[up, j])
            if i == 0:
                west = 2.0 * over_dx2 * (mobility[i, j] + ambient[0, j])
            if i == nx - 1:
                east = 2.0 * over_dx2 * (mobility[i, j] + ambient[1, j])
            north = over_dy2 * (mobility[i, j] + mobility[i, jn])
            south = over_dy2 * (mobility[i, j] + mobility[i, js])
            own = (east + west + north + south) * pressed[i, j] + content_by_unknown[i, j] * (over_dx + storing)
            if i == 0:  # the gap ahead of the inlet moves with that of the first cell
                out.centre[i, j] = own + (here - above) * near0 * bending[i, j]
                out.west[i, j] = 0.0
            else:
                out.centre[i, j] = own + (here * near0 - above * near1) * bending[i, j]
                out.west[i, j] = (
                    -west * pressed[up, j]
                    - content_by_unknown[up, j] * over_dx * standing
                    + (here * near1 - above * near0) * bending[up, j]
                )
            out.east[i, j] = 0.0
            if i < nx - 1:
                out.east[i, j] = -east * pressed[down, j] + (here * near1 - above * near2) * bending[down, j]
            out.north[i, j] = -north * pressed[i, jn]
            out.south[i, j] = -south * pressed[i, js]
