"""Flash temperature: frictional heat divided between both moving bodies by the film.

Heat per area is q = |τ| Δu. Half of it flows to each surface, plus k_f/h times their temperature
difference across the film (the paper's Eqs 15 and 16): q_1 = q/2 + k_f (T_2 - T_1)/h, q_2 = q -
q_1. Each surface responds by a convolution, exact for heat that is constant over cells, the time
integral of an instantaneous source,

    T(X, Y) = 2/(k sqrt(pi)) * int_0^inf E_x(X, s) E_y(Y, s) ds,   s = sqrt(kappa t),

where E is a cell's share of the Gaussian of width 2 s around the source, which has moved by u
s^2/kappa. It holds at any speed, forward, backward or zero; the paper's one-dimensional integrals
are the limit of high speed. A line contact is periodic in y but has finite length; only the finite
length bounds its temperature at zero speed. Source: H. S. Carslaw, J. C. Jaeger, Conduction of Heat
in Solids (1959), section 10.7.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from asperity.core.arrays import Field, Mask, usual_float_errors
from asperity.core.errors import AsperityError
from asperity.ehl import ContactSolution
from asperity.ehl.linear_solvers.gmres import gmres
from asperity.lubricant import Solid, Thermal
from asperity.solution.traction import Friction, friction

Waves = npt.NDArray[np.complexfloating]

NODES = 6  # Gauss-Legendre nodes per panel
PANEL_RATIO = 1.25  # largest ratio of s at the two ends of a panel
MAX_DRIFT = 1.0  # largest drift of the source within a panel, in s
FIRST_S, LAST_S = 1.0 / 16.0, 1e4  # first s [cells]; last s [lengths of the source]
HARMONICS = 6
BATCH = 256  # values of s per batch, so that the arrays stay in the processor's cache
SHARING_TOLERANCE = 1e-6  # relative residual of the heat division
SAFETY = 0.5  # on the tolerance of the last round
# GMRES runs in single precision in rounds; residuals are evaluated in double precision.
ROUND_TOLERANCE = 1e-3
MAX_STEPS, MAX_ROUNDS = 100, 8


@dataclass(frozen=True, slots=True)
class MovingSource:
    """Surface temperature of a body moving past a heat input: exact convolution by FFT.

    `spectrum` is the transformed kernel in double and in single precision, and `own` the
    temperature rise of a cell per own heat flux [K m^2/W].
    """

    cells: tuple[int, int]
    spectrum: tuple[Waves, Waves]
    own: float
    periodic: bool

    def __call__(self, heat: Field) -> Field:
        """Return the temperature rise [K] of a heat input [W/m^2], both (nx, ny)."""
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
    """Return the convolution for a body of `solid` moving at `speed` along x [m/s].

    `spacing` of the cells [m]; `length` of a line contact [m], periodic in y; None for heat that is
    bounded in both directions.
    """
    kernel = _moving_kernel(cells, spacing, speed, solid, length)
    kernel *= 2.0 / (solid.conductivity * np.sqrt(np.pi))
    kernel = np.roll(kernel, cells[0], axis=0)
    mirrored = np.concatenate([kernel, kernel[:, -2:0:-1]], axis=1) if length is None else kernel
    spectrum = scipy.fft.fft(scipy.fft.rfft(mirrored, axis=1), axis=0)
    combined = spectrum, spectrum.astype(np.complex64)
    for array in combined:
        array.flags.writeable = False
    return MovingSource(cells, combined, float(kernel[0, 0]), length is not None)


def _moving_kernel(
    cells: tuple[int, int],
    spacing: tuple[float, float],
    speed: float,
    solid: Solid,
    length: float | None,
) -> Field:
    """Return the integral over time of the shares of heat in cells, upstream to downstream."""
    (nx, ny), (dx, dy) = cells, spacing
    drift = speed / solid.diffusivity
    s, weight = _times(nx, dx, dy, drift, max(nx * dx, ny * dy, length or 0.0))
    kernel = np.zeros((2 * nx, ny if length is not None else ny + 1))
    for first in range(0, s.size, BATCH):
        batch = s[first : first + BATCH]
        share_x = _shares_downstream(nx, dx, drift, batch) * weight[first : first + BATCH]
        if length is None:
            kernel += share_x @ _shares(ny + 1, dy, batch).T
        else:
            kernel += _over_line(share_x, ny, dy, length, batch)
    return kernel


def _shares_downstream(nx: int, dx: float, drift: float, s: Field) -> Field:
    """Return the shares in cells along x of heat released in cell 0 of a moving body, (2 nx, s)."""
    index = np.arange(2 * nx)
    # downstream, then upstream of the source
    x = np.where(index < nx, index, index - 2.0 * nx) * dx
    edges = np.append(np.sort(x) - dx / 2.0, (nx - 0.5) * dx)
    return np.diff(_gaussian(edges[:, None] - drift * s**2, s), axis=0)


def _times(nx: int, dx: float, dy: float, drift: float, reach: float) -> tuple[Field, Field]:
    """Return quadrature nodes s and their weights (Gauss-Legendre in panels).

    Panels grow by a constant ratio, and also end where the source has drifted by half cells:
    however little the heat has spread, each panel then lies on one side of a cell edge. Once the
    heat has spread beyond a cell, the drift per panel may be as long as the spread.
    """
    first = FIRST_S * min(dx, dy)
    last = LAST_S * reach
    edges = np.geomspace(first, last, int(np.ceil(np.log(last / first) / np.log(PANEL_RATIO))) + 1)
    if drift != 0.0:
        drifted = [0.5 * dx]
        while drifted[-1] < (nx + 3.0) * dx:
            drifted.append(
                drifted[-1] + max(0.5 * dx, MAX_DRIFT * math.sqrt(drifted[-1] / abs(drift)))
            )
        edges = np.concatenate([edges, np.sqrt(np.array(drifted) / abs(drift))])
    edges = np.concatenate([[0.0], np.unique(edges)])
    node, weight = np.polynomial.legendre.leggauss(NODES)
    half = np.diff(edges) / 2.0
    nodes = (edges[:-1] + half)[:, None] + half[:, None] * node
    return nodes.ravel(), (half[:, None] * weight).ravel()


def _gaussian(x: Field, s: Field) -> Field:
    """Return the share of heat, spread by s, that lies to the left of x."""
    widths = x / (2.0 * s)
    return np.asarray(0.5 * scipy.special.erf(widths, out=widths))


def _shares(cells: int, dy: float, s: Field) -> Field:
    """Return the shares in cells 0, 1, ... of heat released in cell 0, shape (cells, s)."""
    edges = (np.arange(cells + 1) - 0.5) * dy
    return np.diff(_gaussian(edges[:, None], s), axis=0)


def _over_line(share_x: Field, ny: int, dy: float, length: float, s: Field) -> Field:
    """Return the sum over s of shares along x times those along a periodic line, (shares, ny).

    Images are summed while the heat has spread little, a few harmonics afterwards.
    """
    # no heat arrives from beyond the ends of the line
    share_x = share_x * 2.0 * _gaussian(np.array(length / 2.0), s)
    local = s < ny * dy / 8.0
    images = (
        _shares(2 * ny + 1, dy, s[local])[np.abs(np.arange(-2 * ny, 2 * ny))]
        .reshape(4, ny, -1)
        .sum(axis=0)
    )
    order = np.arange(HARMONICS + 1)
    wave = 2.0 * np.pi * order / (ny * dy)
    decay = np.exp(-((wave[:, None] * s[~local]) ** 2)) * np.sinc(order / ny)[:, None]
    cosines = np.where(order > 0, 2.0, 1.0) * np.cos(np.arange(ny)[:, None] * dy * wave) / ny
    return np.asarray(share_x[:, local] @ images.T + share_x[:, ~local] @ decay.T @ cosines.T)


@dataclass(frozen=True, kw_only=True)
class FlashTemperature:
    """Temperatures and heat flows due to sliding; fields of shape (nx, ny).

    `surface_1`, `surface_2` and `film` (its mean over the thickness) are temperatures above ambient
    [K]; `heat` is generated per area and `into_1` its part that flows into body 1 [W/m^2]. `max_k`
    is the largest rise of either surface above its own bulk temperature, `film_max_k` that of the
    film above ambient [K]; `heat_1_w` and `heat_2_w` flow into the bodies [W], for a line contact
    over its length.
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


@usual_float_errors
def flash_temperature(
    solution: ContactSolution,
    friction_result: Friction | None = None,
    *,
    thermal: Thermal | None = None,
) -> FlashTemperature:
    """Compute the temperatures of both surfaces and of the film under frictional heating.

    Parameters
    ----------
    friction_result : friction of the contact; default `friction(solution)`
    thermal : solids, oil conductivity and ambient temperatures; default `Thermal()`

    Raises
    ------
    AsperityError
        if the division of heat between the bodies does not converge.
    """
    thermal = thermal or Thermal()
    conditions = solution.conditions
    friction_result = friction_result or friction(solution, thermal=thermal)
    heat = np.abs(friction_result.shear) * conditions.sliding_speed
    bodies = HeatedBodies(solution, thermal)
    bulk_1, bulk_2 = thermal.bulk_rise
    rises = bodies(heat, bulk_2 - bulk_1)
    surface_1, surface_2 = bulk_1 + rises.rise_1, bulk_2 + rises.rise_2
    # parabolic temperature profile across the film
    film = 0.5 * (surface_1 + surface_2) + heat * bodies.resistance / 12.0
    area = cell_area(solution)
    return FlashTemperature(
        surface_1=surface_1,
        surface_2=surface_2,
        film=film,
        heat=heat,
        into_1=rises.into_1,
        max_k=float(max(rises.rise_1.max(), rises.rise_2.max())),
        film_max_k=float(film.max()),
        heat_1_w=float(rises.into_1.sum() * area),
        heat_2_w=float(rises.into_2.sum() * area),
    )


@dataclass(frozen=True)
class SurfaceRises:
    """Heat that flows into both bodies [W/m^2], and the rise of their surfaces [K], (nx, ny)."""

    into_1: Field
    into_2: Field
    rise_1: Field
    rise_2: Field

    @property
    def mean_rise(self) -> Field:
        """Mean of both surfaces."""
        return 0.5 * (self.rise_1 + self.rise_2)


class HeatedBodies:
    """Both bodies of a solved contact under heat that its film divides between them."""

    def __init__(self, solution: ContactSolution, thermal: Thermal) -> None:
        grid, conditions = solution.grid, solution.conditions
        self.sources = tuple(
            moving_source(grid.cells, grid.spacing, speed, solid, length=conditions.length)
            for speed, solid in zip(conditions.surface_speeds, thermal.solids, strict=True)
        )
        self.resistance, self.exchanging = _film_resistance(solution, thermal)

    def __call__(self, heat: Field, bulk_difference: float = 0.0) -> SurfaceRises:
        """Return the response to a heat input [W/m^2].

        `bulk_difference` [K] is the bulk temperature of body 2 less that of body 1.
        """
        exchanged = _heat_across_film(
            self.sources, heat, self.resistance, self.exchanging, bulk_difference
        )
        into_1 = 0.5 * heat + exchanged
        into_2 = 0.5 * heat - exchanged
        first, second = self.sources
        return SurfaceRises(into_1, into_2, first(into_1), second(into_2))


def _film_resistance(solution: ContactSolution, thermal: Thermal) -> tuple[Field, Mask]:
    """Return the film's thermal resistance [m^2 K/W], and the cells that exchange heat."""
    resistance = solution.gap / thermal.oil_conductivity
    if solution.lubricant is None:  # no film, and no heat flow outside the contact
        return 0.0 * resistance, solution.in_contact
    return resistance, np.ones(solution.grid.cells, dtype=bool)


def cell_area(solution: ContactSolution) -> float:
    """Return the area [m^2] of a cell, that of a line contact in proportion to its length."""
    grid = solution.grid
    length = solution.conditions.length
    dx, dy = grid.spacing
    return dx * dy * (length / grid.extent[1] if length is not None else 1.0)


class _FilmExchange:
    """Temperature difference that a scaled heat flux across the film needs, per cell."""

    def __init__(
        self, bodies: tuple[MovingSource, ...], resistance: Field, exchanging: Mask
    ) -> None:
        body_1, body_2 = bodies
        summed = body_1.spectrum[0] + body_2.spectrum[0], body_1.spectrum[1] + body_2.spectrum[1]
        self.combined = MovingSource(body_1.cells, summed, body_1.own + body_2.own, body_1.periodic)
        self.scale, self.exchanging = 1.0 / (resistance + self.combined.own), exchanging
        self.parts: dict[np.dtype, tuple[Field, Field]] = {
            np.dtype(kind): (resistance.astype(kind), self.scale.astype(kind))
            for kind in (np.float32, np.float64)
        }

    def __call__(self, vector: Field) -> Field:
        """Return the difference, in the precision of the flux; both flat."""
        resistance, scale = self.parts[vector.dtype]
        field = vector.reshape(scale.shape)
        crossing = field * scale
        response = resistance * crossing + self.combined(crossing)
        return np.where(self.exchanging, response, field).ravel()


def _heat_across_film(
    bodies: tuple[MovingSource, ...],
    heat: Field,
    resistance: Field,
    exchanging: Mask,
    bulk_difference: float,
) -> Field:
    """Return the heat flux across the film from body 2 to body 1 [W/m^2].

    The flux times `resistance` equals the temperature difference of the surfaces. `bulk_difference`
    [K] is the bulk temperature of body 2 less that of body 1.
    """
    half, (body_1, body_2) = 0.5 * heat, bodies
    target = np.asarray(np.where(exchanging, bulk_difference + body_2(half) - body_1(half), 0.0))
    if not np.any(target):
        return target
    operator = _FilmExchange(bodies, resistance, exchanging)
    scaled_flux = np.zeros(heat.size)
    residual = target.ravel()
    size = float(np.linalg.norm(target))
    for rounds in range(MAX_ROUNDS + 1):
        residual_norm = float(np.linalg.norm(residual))
        if residual_norm <= SHARING_TOLERANCE * size:
            flux = scaled_flux.reshape(heat.shape) * operator.scale
            return np.asarray(np.where(exchanging, flux, 0.0))
        if rounds < MAX_ROUNDS:
            tolerance = max(ROUND_TOLERANCE, SAFETY * SHARING_TOLERANCE * size / residual_norm)
            right_side = (residual / residual_norm).astype(np.float32)
            scaled_flux += residual_norm * gmres(
                operator, np.asarray, right_side, tolerance=tolerance, max_steps=MAX_STEPS
            )
            residual = target.ravel() - operator(scaled_flux)
    raise AsperityError(
        "the division of heat between the bodies did not converge; check whether the film is far "
        "thinner than a cell"
    )
