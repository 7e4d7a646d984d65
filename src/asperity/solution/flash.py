"""Flash temperature: sliding heat that both bodies take up as it passes, shared between them through the film.

Per area q = |τ| Δu. Half of it flows to each surface, and k_f/h of their difference across the
film (the paper's Eqs 15 and 16): q_1 = q/2 + k_f (T_2 - T_1)/h, q_2 = q - q_1. Each surface
answers its heat by a convolution, exactly for heat that is constant over cells: the integral of an
instantaneous source over time,

    T(X, Y) = 2/(k sqrt(pi)) * int_0^inf E_x(X, s) E_y(Y, s) ds,   s = sqrt(kappa t),

where E is a cell's share of the Gaussian of width 2 s around the source, which has moved by u
s^2/kappa. It holds at any speed, forward, backward or at rest; the paper's one-dimensional
integrals are its limit of great speed. A line contact repeats in y and is as long as it is: at
rest its temperature has a limit for that reason alone. Source: H. S. Carslaw, J. C. Jaeger,
Conduction of Heat in Solids (1959), section 10.7.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from asperity.core.arrays import Field, Mask
from asperity.core.errors import AsperityError
from asperity.ehl import ContactSolution
from asperity.ehl.linear_solvers.gmres import gmres
from asperity.lubricant import Solid, Thermal
from asperity.solution.traction import Friction, friction

Waves = npt.NDArray[np.complexfloating[Any, Any]]

NODES = 6  # of Gauss's rule in a panel
RATIO = 1.25  # of the s at both ends of a panel, at most
SPREAD = 1.0  # of s, by which the source drifts in a panel, at most
EARLIEST, LATEST = 1.0 / 16.0, 1e4  # first s in cells; last s in lengths of the source
HARMONICS = 6
AT_ONCE = 256  # values of s: what they need stays in the processor's cache
SHARING_TOLERANCE, SURELY = 1e-6, 0.5
AT_A_TIME, MOST_STEPS, MOST_ROUNDS = (
    1e-3,
    100,
    8,
)  # of GMRES in single precision; what it leaves is measured in double


@dataclass(frozen=True, slots=True)
class MovingSource:
    """Surface temperature of a body that moves past a heat input: an exact cell-to-cell convolution by FFT.

    `spectrum` is the transformed kernel, in double and in single precision, and `own` the rise of
    a cell by its own heat [K m^2/W].
    """

    cells: tuple[int, int]
    spectrum: tuple[Waves, Waves]
    own: float
    periodic: bool

    def __call__(self, heat: Field) -> Field:
        """Temperature rise [K] of a heat input [W/m^2], both (nx, ny) and of one precision."""
        nx, ny = self.cells
        length = ny if self.periodic else 2 * ny
        waves = scipy.fft.fft(
            scipy.fft.rfft(heat, n=length, axis=1), n=2 * nx, axis=0, overwrite_x=True
        )
        waves *= self.spectrum[heat.dtype == np.float32]
        return np.asarray(
            scipy.fft.irfft(scipy.fft.ifft(waves, axis=0, overwrite_x=True)[:nx], n=length, axis=1)[
                :, :ny
            ]
        )


@lru_cache(maxsize=16)
def moving_source(
    cells: tuple[int, int],
    spacing: tuple[float, float],
    speed: float,
    solid: Solid,
    *,
    length: float | None,
) -> MovingSource:
    """A body of `solid` that moves at `speed` along x [m/s] under cells of `spacing` [m].

    `length` of a line contact [m], which repeats in y; None for heat that is bounded both ways.
    """
    (nx, ny), (dx, dy) = cells, spacing
    drift = speed / solid.diffusivity
    s, weight = _times(nx, dx, dy, drift, max(nx * dx, ny * dy, length or 0.0))
    along = np.arange(2 * nx)
    x = (
        np.where(along < nx, along, along - 2.0 * nx) * dx
    )  # downstream, then upstream of the source
    edges = np.append(np.sort(x) - dx / 2.0, (nx - 0.5) * dx)
    kernel = np.zeros((2 * nx, ny if length is not None else ny + 1))
    for first in range(0, s.size, AT_ONCE):
        now, weighs = s[first : first + AT_ONCE], weight[first : first + AT_ONCE]
        share_x = np.diff(_gaussian(edges[:, None] - drift * now**2, now), axis=0) * weighs
        if length is None:
            kernel += share_x @ _shares(ny + 1, dy, now).T
        else:
            kernel += _over_line(share_x, ny, dy, length, now)
    kernel *= 2.0 / (solid.conductivity * np.sqrt(np.pi))
    kernel = np.roll(kernel, nx, axis=0)
    mirrored = np.concatenate([kernel, kernel[:, -2:0:-1]], axis=1) if length is None else kernel
    spectrum = scipy.fft.fft(scipy.fft.rfft(mirrored, axis=1), axis=0)
    both = spectrum, spectrum.astype(np.complex64)
    for array in both:
        array.flags.writeable = False
    return MovingSource(cells, both, float(kernel[0, 0]), length is not None)


def _times(nx: int, dx: float, dy: float, drift: float, reach: float) -> tuple[Field, Field]:
    """The values of s and their weights, Gauss's rule in panels.

    Panels grow by a ratio, and end where the source has drifted by half cells: however little the
    heat spreads, each panel then lies on one side of a cell's edge. Once it has spread beyond a
    cell, drifts may be as long as it.
    """
    first, last = EARLIEST * min(dx, dy), LATEST * reach
    ends = np.geomspace(first, last, int(np.ceil(np.log(last / first) / np.log(RATIO))) + 1)
    if drift != 0.0:
        drifted = [0.5 * dx]
        while drifted[-1] < (nx + 3.0) * dx:
            drifted.append(
                drifted[-1] + max(0.5 * dx, SPREAD * math.sqrt(drifted[-1] / abs(drift)))
            )
        ends = np.concatenate([ends, np.sqrt(np.array(drifted) / abs(drift))])
    ends = np.concatenate([[0.0], np.unique(ends)])
    node, share = np.polynomial.legendre.leggauss(NODES)
    half = np.diff(ends) / 2.0
    nodes = (ends[:-1] + half)[:, None] + half[:, None] * node
    return nodes.ravel(), (half[:, None] * share).ravel()


def _gaussian(x: Field, s: Field) -> Field:
    """Heat that has spread by s, left of x."""
    widths = x / (2.0 * s)
    return np.asarray(0.5 * scipy.special.erf(widths, out=widths))


def _shares(cells: int, dy: float, s: Field) -> Field:
    """Shares of cells 0, 1, ... of heat that started at cell 0, shape (cells, s)."""
    edges = (np.arange(cells + 1) - 0.5) * dy
    return np.diff(_gaussian(edges[:, None], s), axis=0)


def _over_line(share_x: Field, ny: int, dy: float, length: float, s: Field) -> Field:
    """The sum over s of shares along x times those along a line, in which heat repeats, shape (shares, ny).

    Images while heat has not spread far, a few harmonics afterwards.
    """
    share_x = (
        share_x * 2.0 * _gaussian(np.array(length / 2.0), s)
    )  # heat from beyond the line's ends is missing
    near = s < ny * dy / 8.0
    images = (
        _shares(2 * ny + 1, dy, s[near])[np.abs(np.arange(-2 * ny, 2 * ny))]
        .reshape(4, ny, -1)
        .sum(axis=0)
    )
    order = np.arange(HARMONICS + 1)
    wave = 2.0 * np.pi * order / (ny * dy)
    decay = np.exp(-((wave[:, None] * s[~near]) ** 2)) * np.sinc(order / ny)[:, None]
    cosines = np.where(order > 0, 2.0, 1.0) * np.cos(np.arange(ny)[:, None] * dy * wave) / ny
    return np.asarray(share_x[:, near] @ images.T + share_x[:, ~near] @ decay.T @ cosines.T)


@dataclass(frozen=True, kw_only=True)
class FlashTemperature:
    """What sliding heat does; fields of shape (nx, ny).

    `surface_1`, `surface_2` and `film` (its mean over the thickness) are temperatures above
    ambient [K]; `heat` is what a unit of area makes and `into_1` what of it flows into body 1
    [W/m^2]. `max_k` is the largest rise of either surface above its own bulk, `film_max_k` that of
    the film above ambient [K]; `heat_1_w` and `heat_2_w` flow into the bodies [W], of a line
    contact over its length.
    """

    surface_1: Field
    surface_2: Field
    film: Field
    heat: Field
    into_1: Field
    max_k: float
    film_max_k: float
    heat_1_w: float
    heat_2_w: float


def flash_temperature(
    solution: ContactSolution, rubbing: Friction | None = None, *, thermal: Thermal | None = None
) -> FlashTemperature:
    """Temperatures of both surfaces and of the film, as friction heats them.

    Parameters
    ----------
    rubbing : the friction; that of `friction(solution)` unless given
    thermal : the bodies, the oil's conductivity, the temperatures around; `Thermal()` unless given

    Raises
    ------
    AsperityError
        if the two bodies' temperatures could not be matched.
    """
    thermal = thermal or Thermal()
    conditions, grid = solution.conditions, solution.grid
    rubbing = rubbing or friction(solution, thermal=thermal)
    heat = np.abs(rubbing.shear) * conditions.sliding_speed
    length = conditions.length
    one, two = (
        moving_source(grid.cells, grid.spacing, speed, solid, length=length)
        for speed, solid in zip(conditions.surface_speeds, thermal.solids, strict=True)
    )
    bulk = tuple(
        temperature - thermal.ambient
        for temperature in thermal.bulk or (thermal.ambient, thermal.ambient)
    )
    resistance, exchanging = (
        solution.gap / thermal.oil_conductivity,
        np.ones(grid.cells, dtype=bool),
    )
    if solution.lubricant is None:  # no film, and nothing beside the contact
        resistance, exchanging = 0.0 * resistance, solution.in_contact
    passed = _passed_on(one, two, heat, resistance, exchanging, bulk[1] - bulk[0])
    into_1, into_2 = 0.5 * heat + passed, 0.5 * heat - passed
    rise_1, rise_2 = one(into_1), two(into_2)
    surface_1, surface_2 = bulk[0] + rise_1, bulk[1] + rise_2
    film = (
        0.5 * (surface_1 + surface_2) + heat * resistance / 12.0
    )  # a parabola across the film above the mean
    dx, dy = grid.spacing
    area = dx * dy * (length / grid.extent[1] if length is not None else 1.0)
    return FlashTemperature(
        surface_1=surface_1,
        surface_2=surface_2,
        film=film,
        heat=heat,
        into_1=into_1,
        max_k=float(max(rise_1.max(), rise_2.max())),
        film_max_k=float(film.max()),
        heat_1_w=float(into_1.sum() * area),
        heat_2_w=float(into_2.sum() * area),
    )


def _passed_on(
    one: MovingSource,
    two: MovingSource,
    heat: Field,
    resistance: Field,
    exchanging: Mask,
    warmer: float,
) -> Field:
    """Heat that crosses the film from body 2 to body 1 [W/m^2]: resistance times it is the surfaces' difference."""
    half = 0.5 * heat
    wanted = np.asarray(np.where(exchanging, warmer + two(half) - one(half), 0.0))
    if not np.any(wanted):
        return wanted
    summed = one.spectrum[0] + two.spectrum[0], one.spectrum[1] + two.spectrum[1]
    both = MovingSource(one.cells, summed, one.own + two.own, one.periodic)
    scale = 1.0 / (resistance + both.own)
    parts: dict[Any, tuple[Field, Field]] = {
        np.dtype(kind): (resistance.astype(kind), scale.astype(kind))
        for kind in (np.float32, np.float64)
    }

    def unbalanced(vector: Field) -> Field:
        resisted, scaled = parts[vector.dtype]
        crossing = vector.reshape(heat.shape) * scaled
        answer = resisted * crossing + both(crossing)
        return np.where(exchanging, answer, vector.reshape(heat.shape)).ravel()

    solved, left, size = np.zeros(heat.size), wanted.ravel(), float(np.linalg.norm(wanted))
    for number in range(MOST_ROUNDS + 1):
        rest = float(np.linalg.norm(left))
        if rest <= SHARING_TOLERANCE * size:
            return np.asarray(np.where(exchanging, solved.reshape(heat.shape) * scale, 0.0))
        if number < MOST_ROUNDS:
            tolerance = max(AT_A_TIME, SURELY * SHARING_TOLERANCE * size / rest)
            single = (left / rest).astype(np.float32)
            solved += rest * gmres(
                unbalanced, np.asarray, single, tolerance=tolerance, max_steps=MOST_STEPS
            )
            left = wanted.ravel() - unbalanced(solved)
    raise AsperityError(
        "the heat could not be shared between the bodies; is the film far thinner than a cell?"
    )
