"""The finite-volume Reynolds equation face by face in plain NumPy, dimensionless and in
SI units.
"""

import numpy as np

SECOND_ORDER = (0.0, 0.5)


def mean(own, following, logarithmic, gaps=None):
    """Return the arithmetic or logarithmic mean of two mobilities.

    With both `gaps`, the mobility that is exact for a linear gap and a fluidity that falls
    exponentially with the pressure: 1 over the mean of h^-3, times the fluidity's logarithmic mean.
    """
    if gaps is not None:
        here, there = gaps
        inverse_cube = (here + there) / (2.0 * here**2 * there**2)
        return mean(own / here**3, following / there**3, True) / inverse_cube
    if not logarithmic:
        return (own + following) / 2.0
    ratio = np.log(own / following)
    alike = np.abs(ratio) < 1e-4
    nearly = (own + following) / 2.0 * (1.0 - ratio**2 / 12.0)
    return np.where(alike, nearly, (own - following) / np.where(alike, 1.0, ratio))


def faces(
    pressure,
    content,
    mobility,
    ambient,
    inlet_content,
    dx,
    dy,
    wedge=SECOND_ORDER,
    logarithmic=False,
    height=None,
):
    """Return the fluxes through all x faces, shape (nx + 1, ny), and through the north face of each
    cell.

    Complex arguments are allowed. `ambient` is the mobility of the first and the last cells at the
    ambient pressure of the outer faces, `wedge` the weights of the next and of the upstream cell.
    Faces are exact for a linear gap where `height` is given.
    """
    along = across = None
    if height is not None:
        along, across = (height[:-1], height[1:]), (height, np.roll(height, -1, 1))
    nx = pressure.shape[0]
    couette = np.empty((nx + 1, pressure.shape[1]), dtype=pressure.dtype)
    couette[0] = inlet_content
    couette[1] = content[0]
    ahead, behind = content[2:] - content[1:-1], content[1:-1] - content[:-2]
    couette[2:-1] = content[1:-1] + wedge[0] * ahead + wedge[1] * behind
    couette[-1] = 1.5 * content[-1] - 0.5 * content[-2]
    poiseuille = np.empty_like(couette)
    poiseuille[0] = -(mobility[0] + ambient[0]) / 2.0 * pressure[0] / (dx / 2.0)
    poiseuille[1:-1] = (
        -mean(mobility[:-1], mobility[1:], logarithmic, along) * np.diff(pressure, axis=0) / dx
    )
    poiseuille[-1] = (mobility[-1] + ambient[1]) / 2.0 * pressure[-1] / (dx / 2.0)
    following = np.roll(mobility, -1, 1)
    drop = pressure - np.roll(pressure, -1, 1)
    north = mean(mobility, following, logarithmic, across) * drop / dy
    return couette + poiseuille, north


def net_outflow(*arguments, **scheme):
    along, north = faces(*arguments, **scheme)
    dx, dy = arguments[-2:]
    return np.diff(along, axis=0) / dx + (north - np.roll(north, 1, 1)) / dy


def mass_outflow(solution):
    """Net mass outflow of each cell [kg/m^2/s] of a solved contact, from its pressure, gap and oil
    laws.
    """
    conditions, oil, grid = solution.conditions, solution.lubricant, solution.grid
    dx, dy = grid.spacing
    h = solution.gap
    p = solution.pressure if solution.oil is None else solution.oil.pressure
    density = oil.density(p)
    u = conditions.entrainment_speed
    ahead = h[0] + ((grid.x[0] - dx) ** 2 - grid.x[0] ** 2) / (2.0 * conditions.radius)
    entering = oil.density.rho0 * u * (ahead + h[0]) / 2.0
    at_rest = oil.density.rho0 * h[[0, -1]] ** 3 / (12.0 * oil.viscosity.eta0)
    mobility = density * h**3 / (12.0 * oil.viscosity(p))
    if solution.oil is None:
        return net_outflow(p, u * density * h, mobility, at_rest, entering, dx, dy)
    contact_film = (
        solution.options.contact_film
    )  # lower bound: the mobility of ambient oil in the contact film
    mobility = np.maximum(
        mobility, oil.density.rho0 * contact_film**6 / h**3 / (12.0 * oil.viscosity.eta0)
    )
    height = h if np.any(solution.surface.heights) else None
    return net_outflow(
        p, u * density * h, mobility, at_rest, entering, dx, dy, wedge=(0.0, 0.0), height=height
    ) + limited_wedge(solution, dx)


def limited_wedge(solution, dx):
    """Return the mixed model's second-order part of the wedge, limited at film steps and zero at
    closed cells.
    """
    film = (
        solution.conditions.entrainment_speed
        * solution.lubricant.density(solution.oil.pressure)
        * solution.gap
    )
    opened = np.clip(2.0 * (solution.gap / solution.options.contact_film - 1.0), 0.0, 1.0)
    before, here = film[:-1], film[1:]
    share = opened[1:] * opened[:-1] * before * here / (before**2 + here**2)
    added = np.zeros_like(film)
    # the outlet face already has the full second-order part
    added[1:-1] = (share * (here - before))[:-1]
    return np.diff(added, axis=0, prepend=0.0 * added[:1]) / dx
