"""Reference solver of lubricated contacts: nodes, dense matrices, Newton's method on active sets.

It is written from the equations alone and shares no code with asperity. Lengths are in units of the
Hertz half-width a, pressures in p_h, gaps in a^2/R, times in a/u, viscosity and density relative to
their ambient values; `number` is 12 eta0 u R^2/(a^3 p_h). The unknowns are the oil s at every inner
node (its pressure; with mass conservation s < 0 is the missing share of the film), the pressure
`solid` that the bodies carry where they touch, and the approach.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.linalg import lu_factor, lu_solve
from scipy.special import iti0k0, k1

Field = np.ndarray
Law = Callable[[Field], tuple[Field, Field]]  # of the pressure: value and slope


@dataclass(frozen=True)
class Mesh:
    """Nodes of a line, a strip that is periodic along y, or half a ball's contact (y >= 0, mirrored)."""

    x: Field
    y: Field
    kind: str

    @property
    def shape(self) -> tuple[int, int]:
        return self.x.size, self.y.size

    @property
    def inner(self) -> Field:
        """Nodes with a mass balance; the others have no pressure."""
        inside = np.zeros(self.shape, dtype=bool)
        inside[1:-1, : -1 if self.kind == "ball" else None] = True
        return inside.ravel()

    @property
    def weights(self) -> Field:
        """Area of each node (of a strip over its width, of a ball over both halves)."""
        across = np.full(self.y.size, 1.0 / self.y.size)
        if self.kind == "ball":
            across = np.full(self.y.size, 2.0 * (self.y[1] - self.y[0]))
            across[0] /= 2.0
        return np.outer(np.full(self.x.size, self.x[1] - self.x[0]), across).ravel()


def line(lower: float, upper: float, nodes: int) -> Mesh:
    return Mesh(np.linspace(lower, upper, nodes), np.zeros(1), "line")


def strip(lower: float, upper: float, width: float, nodes: tuple[int, int]) -> Mesh:
    return Mesh(
        np.linspace(lower, upper, nodes[0]), np.arange(nodes[1]) * width / nodes[1], "strip"
    )


def half_ball(lower: float, upper: float, side: float, nodes: tuple[int, int]) -> Mesh:
    return Mesh(np.linspace(lower, upper, nodes[0]), np.linspace(0.0, side, nodes[1]), "ball")


def compliance(mesh: Mesh) -> Field:
    """Return the dense matrix of the deflection at each node by the pressure at each node."""
    if mesh.kind == "ball":
        return _ball_compliance(mesh)
    nx, ny = mesh.shape
    dx = mesh.x[1] - mesh.x[0]
    away = np.arange(-nx, nx + 1) * dx
    far = np.abs(np.where(away == 0.0, 1.0, away))
    hats = np.empty((ny, 2 * nx - 1))
    twice = away**2 * (np.where(away == 0.0, 0.0, np.log(far)) / 2.0 - 0.75) / -np.pi
    hats[0] = np.diff(twice, 2) / dx
    # e^(iky) along y: 2 K0(k |x|) replaces 1/r, integrated twice along x
    for number in range(1, ny):
        k = 2.0 * np.pi * min(number, ny - number) / (ny * (mesh.y[1] - mesh.y[0]))
        once = iti0k0(k * far)[1] / k
        twice = far * once - (1.0 - k * far * k1(k * far)) / k**2
        hats[number] = np.diff(np.where(away == 0.0, 0.0, twice), 2) / dx / np.pi
    columns = np.fft.ifft(hats, axis=0).real  # by distance along y and x
    i, j = (part.ravel() for part in np.indices(mesh.shape))
    return columns[(j[:, None] - j[None, :]) % ny, i[:, None] - i[None, :] + nx - 1]


def _ball_compliance(mesh: Mesh) -> Field:
    """Evaluate Love (1929) for a rectangle of unit pressure; 1/(pi E*) is 2/pi^2 in these units."""
    dx, dy = mesh.x[1] - mesh.x[0], mesh.y[1] - mesh.y[0]
    nx, ny = mesh.shape

    def deflection(x: Field, y: Field) -> Field:
        def corner(p: Field, q: Field) -> Field:
            return p * np.arcsinh(q / np.abs(p)) + q * np.arcsinh(p / np.abs(q))

        left, right, low, high = x - dx / 2.0, x + dx / 2.0, y - dy / 2.0, y + dy / 2.0
        return corner(right, high) - corner(left, high) - corner(right, low) + corner(left, low)

    offset_x, offset_y = np.arange(nx) * dx, np.arange(2 * ny) * dy
    table = 2.0 / np.pi**2 * deflection(offset_x[:, None], offset_y[None, :])
    i, j = (part.ravel() for part in np.indices(mesh.shape))
    apart = np.abs(i[:, None] - i[None, :])
    matrix = table[apart, np.abs(j[:, None] - j[None, :])]
    matrix += np.where(j[None, :] > 0, table[apart, j[:, None] + j[None, :]], 0.0)
    return matrix


@dataclass(frozen=True)
class Problem:
    """Problem to be solved; `shape` is the undeformed gap without approach, less the roughness."""

    mesh: Mesh
    shape: Field
    load: float  # pi/2 of lines and strips, 2 pi/3 of balls
    number: float
    log_viscosity: Law
    density: Law
    touch: float = 0.0  # gap at which bodies touch; 0: no solid contact
    keeps_oil: bool = False


@dataclass(frozen=True)
class State:
    oil: Field
    solid: Field
    approach: float

    @property
    def pressure(self) -> Field:
        return np.maximum(self.oil, 0.0) + self.solid


@dataclass(frozen=True)
class Past:
    """Contents one and two time steps ago, and the step; first-order difference without the second."""

    step: float
    once: Field
    twice: Field | None = None


class NotFound(Exception):
    """Newton's method did not converge."""


class Twin:
    """Solver of a problem: its matrices, which do not depend on the pressures."""

    def __init__(self, problem: Problem, matrix: Field | None = None) -> None:
        self.problem, mesh = problem, problem.mesh
        self.matrix = compliance(mesh) if matrix is None else matrix
        nx, ny = mesh.shape
        dx = mesh.x[1] - mesh.x[0]
        same_row = sparse.identity(ny)
        ahead, behind = sparse.eye(nx - 1, nx, 1), sparse.eye(nx - 1, nx)
        self.mean_x = sparse.kron((ahead + behind) / 2.0, same_row).tocsr()
        self.slope_x = sparse.kron((ahead - behind) / dx, same_row).tocsr()
        self.out_x = (
            sparse.kron(sparse.eye(nx, nx - 1) - sparse.eye(nx, nx - 1, -1), same_row).tocsr() / dx
        )
        self.upwind = sparse.kron(behind, same_row).tocsr()
        back = sparse.eye(nx - 1, nx) - sparse.eye(nx - 1, nx, -1)
        first = sparse.diags(np.r_[0.0, np.ones(nx - 2)])
        self.back = sparse.kron(first @ back, same_row).tocsr()
        self.both = sparse.kron(first @ abs(back), same_row).tocsr()
        if ny > 1:
            dy = mesh.y[1] - mesh.y[0]
            if mesh.kind == "ball":
                further, nearer = sparse.eye(ny - 1, ny, 1), sparse.eye(ny - 1, ny)
                out = sparse.eye(ny, ny - 1) - sparse.eye(ny, ny - 1, -1)
                out = (
                    sparse.diags(np.r_[2.0, np.ones(ny - 1)]) @ out
                )  # the flow of the mirrored half, too
            else:
                nearer = sparse.identity(ny)
                further = sparse.csr_matrix(np.roll(np.eye(ny), 1, 1))
                out = nearer - further.T
            along = sparse.identity(nx)
            self.mean_y = sparse.kron(along, (further + nearer) / 2.0).tocsr()
            self.slope_y = sparse.kron(along, (further - nearer) / dy).tocsr()
            self.out_y = sparse.kron(along, out).tocsr() / dy

    def gap(self, state: State) -> Field:
        return self.problem.shape + self.matrix @ state.pressure + state.approach

    def content(self, state: State, gap: Field | None = None) -> Field:
        gap = self.gap(state) if gap is None else gap
        density, _ = self.problem.density(np.maximum(state.oil, 0.0))
        share = 1.0 + np.minimum(state.oil, 0.0) if self.problem.keeps_oil else 1.0
        return density * np.maximum(gap, self.problem.touch) * share

    def balance(self, state: State, gap: Field, past: Past | None) -> tuple[Field, Any, Any]:
        """Return each node's net outflow and its derivatives by oil (at fixed gap) and by gap."""
        p, oil = self.problem, np.maximum(state.oil, 0.0)
        wet = (state.oil >= 0.0).astype(float)
        share = 1.0 + np.minimum(state.oil, 0.0) if p.keeps_oil else np.ones_like(oil)
        film, opens = np.maximum(gap, p.touch), (gap > p.touch).astype(float)
        density, by_p = p.density(oil)
        thick, thicker = p.log_viscosity(oil)
        content, content_by_gap = density * film * share, density * opens * share
        content_by_oil = wet * by_p * film + (1.0 - wet) * density * film * p.keeps_oil
        mobility = density * film**3 * np.exp(-thick)
        mobility_by_gap, mobility_by_oil = (
            3.0 * mobility / film * opens,
            mobility * (by_p / density - thicker),
        )
        least = p.touch**6 / film**3
        low = mobility < least
        mobility_by_gap = np.where(low, -3.0 * least / film * opens, mobility_by_gap) / p.number
        mobility_by_oil = np.where(low, 0.0, mobility_by_oil) / p.number
        mobility = np.maximum(mobility, least) / p.number

        at_faces, face = self._carried(content)
        drop = self.slope_x @ oil
        outflow = self.out_x @ (at_faces - (self.mean_x @ mobility) * drop)
        by_gap = face @ sparse.diags(content_by_gap) - sparse.diags(
            drop
        ) @ self.mean_x @ sparse.diags(mobility_by_gap)
        by_oil = sparse.diags(drop) @ self.mean_x @ sparse.diags(mobility_by_oil * wet)
        by_oil = face @ sparse.diags(content_by_oil) - by_oil
        by_oil -= sparse.diags(self.mean_x @ mobility) @ self.slope_x @ sparse.diags(wet)
        slope_gap, slope_oil = self.out_x @ by_gap, self.out_x @ by_oil
        if p.mesh.shape[1] > 1:
            drop = self.slope_y @ oil
            outflow -= self.out_y @ ((self.mean_y @ mobility) * drop)
            around = self.out_y @ sparse.diags(drop) @ self.mean_y
            slope_gap -= around @ sparse.diags(mobility_by_gap)
            slope_oil -= around @ sparse.diags(mobility_by_oil * wet)
            slope_oil -= (
                self.out_y @ sparse.diags(self.mean_y @ mobility) @ self.slope_y @ sparse.diags(wet)
            )
        if past is not None:
            lead = 1.0 if past.twice is None else 1.5
            before = past.once if past.twice is None else 2.0 * past.once - 0.5 * past.twice
            outflow += (lead * content - before) / past.step
            slope_gap += sparse.diags(lead * content_by_gap / past.step)
            slope_oil += sparse.diags(lead * content_by_oil / past.step)
        return outflow, slope_oil.tocsr(), slope_gap.tocsr()

    def _carried(self, content: Field) -> tuple[Field, Any]:
        """Return the content at the faces behind each node, second order, and its derivatives.

        With mass conservation, a limiter lowers the order at fronts.
        """
        rise = self.back @ content
        if not self.problem.keeps_oil:
            return self.upwind @ content + rise / 2.0, self.upwind + self.back / 2.0
        both = np.maximum(self.both @ content, 1e-12)
        steep = np.minimum(4.0 * np.abs(rise) / both, 1.0)
        by_rise = np.where(steep < 1.0, 0.5 - steep, 0.0)
        by_both = np.where(steep < 1.0, steep * rise / both / 2.0, 0.0)
        slopes = self.upwind + sparse.diags(by_rise) @ self.back + sparse.diags(by_both) @ self.both
        return self.upwind @ content + rise * (1.0 - steep) / 2.0, slopes

    def settled(
        self, state: State, past: Past | None = None, most: int = 60, tolerance: float = 1e-9
    ) -> State:
        """Solve by Newton's method; each step takes the active sets of the previous one.

        Raises
        ------
        NotFound
            if the steps cycle or diverge.
        """
        inner = self.problem.mesh.inner
        for _ in range(most):
            state, change = self._step(state, inner, past)
            if not np.isfinite(change):
                break
            if change < tolerance:
                return state
        raise NotFound(f"last step {change:.1e}")

    def _step(self, state: State, inner: Field, past: Past | None) -> tuple[State, float]:
        p, weights = self.problem, self.problem.mesh.weights
        gap = self.gap(state)
        outflow, by_oil, by_gap = self.balance(state, gap, past)
        oil = np.maximum(state.oil, 0.0)
        stiff = np.maximum(by_oil.diagonal() + by_gap.diagonal() * self.matrix.diagonal(), 1e-12)
        wet = inner & ((state.oil - outflow / stiff > 0.0) | p.keeps_oil)
        closed = inner & (state.solid > (gap - p.touch) / self.matrix.diagonal()) & (p.touch > 0.0)
        w, t = np.flatnonzero(wet), np.flatnonzero(closed)
        drop_oil, drop_solid = np.where(wet, 0.0, -state.oil), np.where(closed, 0.0, -state.solid)
        full = (state.oil[w] >= 0.0).astype(float)
        bent = by_gap[w] @ self.matrix[:, np.r_[w, t]]
        rows = np.empty((w.size + t.size + 1,) * 2)
        rows[: w.size, :-1] = bent
        rows[: w.size, : w.size] *= full
        rows[: w.size, : w.size] += by_oil[w][:, w].toarray()
        rows[: w.size, -1] = np.asarray(by_gap[w].sum(axis=1)).ravel()
        rows[w.size : -1, :-1] = self.matrix[np.ix_(t, np.r_[w, t])]
        rows[w.size : -1, : w.size] *= full
        rows[w.size : -1, -1] = 1.0
        rows[-1, :-1] = np.r_[weights[w] * full, weights[t]]
        rows[-1, -1] = 0.0
        sunk = self.matrix @ (drop_oil * (state.oil > 0.0) + drop_solid)
        residual = np.r_[
            outflow[w] + by_oil[w] @ drop_oil + by_gap[w] @ sunk,
            (gap + sunk - p.touch)[t],
            weights @ (oil + state.solid + drop_oil * (state.oil > 0.0) + drop_solid) - p.load,
        ]
        step = -lu_solve(
            lu_factor(rows, overwrite_a=True, check_finite=False), residual, check_finite=False
        )
        step = np.clip(step, -0.3, 0.3)
        new_oil, new_solid = state.oil + drop_oil, state.solid + drop_solid
        new_oil[w] += step[: w.size]
        new_solid[t] += step[w.size : -1]
        if not p.keeps_oil:
            new_oil = np.maximum(new_oil, 0.0)
        else:
            crossed = new_oil * state.oil < 0.0  # stop at the border first
            border = np.where(new_oil < 0.0, -1e-12, 0.0)
            new_oil = np.where(crossed, border, np.maximum(new_oil, -0.999))
        new_solid = np.maximum(new_solid, 0.0)
        change = max(
            np.abs(new_oil - state.oil).max(), np.abs(new_solid - state.solid).max(), abs(step[-1])
        )
        return State(new_oil, new_solid, state.approach + step[-1]), float(change)

    def steady(self, state: State) -> State:
        """Find the steady state by time steps that grow as long as they converge."""
        length, steps = 0.3, 0
        while length < 300.0:
            steps += 1
            if steps > 120:
                raise NotFound("time steps remain short")
            try:
                state = self.settled(
                    state, Past(length, self.content(state)), most=14, tolerance=1e-5
                )
                length *= 3.0
            except NotFound:
                length /= 4.0
            if length < 1e-4:
                raise NotFound("time steps remain short")
        return self.settled(state)


def hertz_start(twin: Twin, film: float = 0.3) -> State:
    """Return Hertz's pressure with a film of this thickness as the initial guess."""
    mesh = twin.problem.mesh
    x, y = mesh.x[:, None], mesh.y[None, :] if mesh.kind == "ball" else 0.0 * mesh.y[None, :]
    oil = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0)).ravel()
    bent = twin.problem.shape + twin.matrix @ oil
    return State(oil, np.zeros_like(oil), float(film - bent.min()))


def carried(twin: Twin, state: State, problem: Problem, steps: int) -> State:
    """Solve another problem on the same nodes by steps from the twin's own problem."""
    for part in np.linspace(0.0, 1.0, steps + 1)[1:]:
        between = replace(problem, shape=(1.0 - part) * twin.problem.shape + part * problem.shape)
        state = Twin(between, twin.matrix).steady(state)
    return state
