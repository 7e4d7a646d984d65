"""Mobility of the faces between cells for the flow that pressure drives, one of three means.

The exact one carries the flow through a gap that varies linearly between the cells' centres, of oil
whose viscosity grows exponentially with the pressure. An arithmetic mean drains a thin film beside
a valley many times too fast.
"""

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.kernels.compiled import njit
from asperity.kernels.reynolds import Faces, Film

# mean mobility of a face: arithmetic; logarithmic, exact for a given flow where viscosity grows
# exponentially at constant gap; exact, the same where the gap varies linearly
MEANS = ARITHMETIC, LOGARITHMIC, EXACT = 0, 1, 2


@njit(cache=True)
def _log_mean(own: float, following: float, log_ratio: float) -> tuple[float, float, float]:
    """Return the logarithmic mean of two positive numbers and its slopes in their logarithms."""
    if abs(log_ratio) < 1e-2:
        mean = 0.5 * (own + following) * (1.0 - log_ratio * log_ratio / 12.0)
        return mean, own * (0.5 - log_ratio / 6.0), following * (0.5 + log_ratio / 6.0)
    mean = (own - following) / log_ratio
    return mean, (own - mean) / log_ratio, (mean - following) / log_ratio


@njit(cache=True)
def _exact_mean(
    own: float, following: float, own_gap: float, next_gap: float
) -> tuple[float, float, float]:
    """Return the mobility that is exact for a linear gap, and its slopes in the log fluidities.

    Under a flow -h^3 f dp/dx with f falling exponentially in p, the integral of h^-3 over the face
    and the logarithmic mean of f separate.
    """
    own_cubed, next_cubed = own_gap * own_gap * own_gap, next_gap * next_gap * next_gap
    own_fluidity, next_fluidity = own / own_cubed, following / next_cubed
    mean, by_own, by_next = _log_mean(
        own_fluidity, next_fluidity, np.log(own_fluidity / next_fluidity)
    )
    cubed = 2.0 * own_gap * own_gap * next_gap * next_gap / (own_gap + next_gap)
    return mean * cubed, by_own * cubed, by_next * cubed


@njit(cache=True)
def _by_gap(face: float, slope: float, own_gap: float, next_gap: float, log_slope: float) -> float:
    """Return the slope of an exact face in the log mobility of a cell whose gap changes.

    `slope` is that in its log fluidity, `log_slope` the log mobility's in the gap.
    """
    power = log_slope * own_gap  # 3 and the exponent of shear thinning
    return (slope * (power - 3.0) + face * (1.0 + next_gap / (own_gap + next_gap))) / power


@njit(cache=True)
def _mean_mobility(
    film: Film, height: Field, mean: int, own: tuple[int, int], following: tuple[int, int]
) -> tuple[float, float, float, float, float]:
    """Return a face's mobility, its slopes in both log mobilities, and those that follow gaps."""
    first, second = film.mobility[own], film.mobility[following]
    if mean == ARITHMETIC or first <= 0.0 or second <= 0.0:
        by_own, by_next = 0.5 * first, 0.5 * second
        return by_own + by_next, by_own, by_next, by_own, by_next
    if mean == LOGARITHMIC:
        face, by_own, by_next = _log_mean(first, second, np.log(first) - np.log(second))
        return face, by_own, by_next, by_own, by_next
    here, there, slopes = height[own], height[following], film.log_mobility_by_gap
    face, by_own, by_next = _exact_mean(first, second, here, there)
    own_gap = _by_gap(face, by_own, here, there, slopes[own])
    next_gap = _by_gap(face, by_next, there, here, slopes[following])
    return face, by_own, by_next, own_gap, next_gap


@njit(cache=True)
def face_mobilities(film: Film, height: Field, mean: int, ends: Mask, faces: Faces) -> None:
    """Fill `faces` with one of the `MEANS`, for a film of thickness `height`.

    North faces of the lines marked in `ends` always take the logarithmic mean.
    """
    nx, ny = height.shape
    eps, last = film.mobility, ny - 1
    for j in range(ny):
        faces.inlet[j] = 0.5 * (eps[0, j] + film.ambient[0, j])
        outlet = 0.5 * eps[nx - 1, j]
        faces.east[nx - 1, j] = outlet + 0.5 * film.ambient[1, j]
        faces.east_by_own[nx - 1, j] = faces.east_by_own_gap[nx - 1, j] = outlet
        faces.east_by_next[nx - 1, j] = faces.east_by_next_gap[nx - 1, j] = 0.0
    for i in range(nx):
        for j in range(ny):
            if i < nx - 1:
                face, own, following, own_gap, next_gap = _mean_mobility(
                    film, height, mean, (i, j), (i + 1, j)
                )
                faces.east[i, j] = face
                faces.east_by_own[i, j], faces.east_by_next[i, j] = own, following
                faces.east_by_own_gap[i, j], faces.east_by_next_gap[i, j] = own_gap, next_gap
            face, own, following, own_gap, next_gap = _mean_mobility(
                film,
                height,
                LOGARITHMIC if ends[j] else mean,
                (i, j),
                (i, j + 1 if j < last else faces.behind),
            )
            faces.north[i, j] = face
            faces.north_by_own[i, j], faces.north_by_next[i, j] = own, following
            faces.north_by_own_gap[i, j], faces.north_by_next_gap[i, j] = own_gap, next_gap
