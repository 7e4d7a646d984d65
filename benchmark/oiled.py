"""Lubricated cases as problems of the reference solvers, and the quantities of their solutions."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from benchmark import twin

Given = dict[str, Any]
Found = dict[str, float]


class Stated:
    """A case and its scales, computed from the numbers of its file."""

    def __init__(self, given: Given) -> None:
        self.given = given
        young, poisson = given["youngs_modulus_pa"], given["poisson_ratio"]
        modulus = 1.0 / sum((1.0 - nu**2) / e for e, nu in zip(young, poisson, strict=True))
        radius = self.radius = given["radius_m"]
        if given["geometry"] == "point":
            self.a = (3.0 * given["load_n"] * radius / (4.0 * modulus)) ** (1.0 / 3.0)
            self.p_h = 1.5 * given["load_n"] / (np.pi * self.a**2)
        else:
            self.a = np.sqrt(4.0 * given["line_load_n_m"] * radius / (np.pi * modulus))
            self.p_h = 2.0 * given["line_load_n_m"] / (np.pi * self.a)
        self.speed = float(np.mean(given["surface_speeds_m_s"]))
        self.height = self.a**2 / radius

    def mesh(self, nodes: tuple[int, int]) -> twin.Mesh:
        low, high = self.given["inlet_half_widths"], self.given["outlet_half_widths"]
        if self.given["geometry"] == "point":
            return twin.half_ball(low, high, self.given["side_half_widths"], nodes)
        if "width_m" in self.given:
            return twin.strip(low, high, self.given["width_m"] / self.a, nodes)
        return twin.line(low, high, nodes[0])

    def shape(self, mesh: twin.Mesh, shifted: float = 0.0) -> np.ndarray:
        """Return the gap without approach; the waves have moved by `shifted` half-widths."""
        x, y = mesh.x[:, None], mesh.y[None, :]
        gap = x**2 / 2.0 + (y**2 / 2.0 if mesh.kind == "ball" else 0.0 * y)
        for amplitude, along, across, phase in self.given.get("waves", []):
            turn = (
                2.0
                * np.pi
                * (
                    along * self.a * (x - shifted)
                    + across * y * self.a / self.given.get("width_m", 1.0)
                )
            )
            gap = gap - amplitude / self.height * np.cos(turn + phase)
        return gap.ravel()

    def problem(self, nodes: tuple[int, int]) -> twin.Problem:
        mesh, oil = self.mesh(nodes), self.given["oil"]
        c1, c2 = oil["density_c1_1_pa"] * self.p_h, oil["density_c2_1_pa"] * self.p_h
        alpha = oil["alpha_1_pa"] * self.p_h
        if oil["viscosity"] == "roelands":
            scale, q = np.log(oil["eta0_pa_s"]) + 9.67, self.p_h / oil["roelands_p0_pa"]
            z = alpha / q / scale
        return twin.Problem(
            mesh,
            self.shape(mesh),
            2.0 * np.pi / 3.0 if mesh.kind == "ball" else np.pi / 2.0,
            12.0 * oil["eta0_pa_s"] * self.speed * self.radius**2 / (self.a**3 * self.p_h),
            (lambda p: (alpha * p, np.full_like(p, alpha)))
            if oil["viscosity"] == "barus"
            else (
                lambda p: (
                    scale * ((1.0 + q * p) ** z - 1.0),
                    scale * z * q * (1.0 + q * p) ** (z - 1.0),
                )
            ),
            lambda p: (1.0 + c1 * p / (1.0 + c2 * p), c1 / (1.0 + c2 * p) ** 2),
            self.given.get("touching_film_m", 0.0) / self.height,
            self.given["kind"] == "conserving",
        )


def interpolated(mesh: twin.Mesh, coarse: twin.Mesh, state: twin.State) -> twin.State:
    """Interpolate a state to other nodes."""

    def moved(field: np.ndarray) -> np.ndarray:
        values, y = field.reshape(coarse.shape), coarse.y
        if coarse.kind == "line":
            return np.interp(mesh.x, coarse.x, values[:, 0])
        if coarse.kind == "strip":
            values, y = np.hstack([values, values[:, :1]]), np.append(y, 2.0 * y[-1] - y[-2])
        at = np.stack(np.meshgrid(mesh.x, mesh.y, indexing="ij"), axis=-1)
        return RegularGridInterpolator((coarse.x, y), values)(at).ravel()

    return twin.State(moved(state.oil), moved(state.solid), state.approach)


def solved(given: Given, grids: list[tuple[int, int]]) -> Iterator[tuple[twin.Twin, twin.State]]:
    """Yield the solution on each grid; the previous grid's solution is the initial guess."""
    stated, state, before = Stated(given), None, None
    for nodes in grids:
        solver = twin.Twin(stated.problem(nodes))
        mesh = solver.problem.mesh
        if state is None:
            state = solver.steady(twin.hertz_start(solver, 0.5))
        else:
            start = interpolated(mesh, before, state)
            try:
                state = solver.settled(start, most=25)
            except twin.NotFound:
                state = solver.steady(start)
        before = mesh
        yield solver, state


def steady(given: Given, grids: list[tuple[int, int]]) -> list[Found]:
    """Return the quantities on each grid."""
    return [quantities(Stated(given), *found) for found in solved(given, grids)]


def quantities(stated: Stated, solver: twin.Twin, state: twin.State) -> Found:
    """Return the quantities of a solution in SI."""
    problem = solver.problem
    mesh, weights = problem.mesh, problem.mesh.weights
    film = np.maximum(solver.gap(state), problem.touch).reshape(mesh.shape)
    pressure = state.pressure
    found = {"p_weighted_pa": (weights @ pressure**2) / (weights @ pressure) * stated.p_h}
    middle = film[:, 0]
    found["h_central_m"] = float(np.interp(0.0, mesh.x, middle)) * stated.height
    found["h_min_m"] = least(film) * stated.height
    inside = np.linspace(-1.0, 1.0, 4001)
    found["h_mean_m"] = (
        float(np.trapezoid(np.interp(inside, mesh.x, film.mean(axis=1)), inside))
        / 2.0
        * stated.height
    )
    if problem.touch > 0.0:
        touching = (film <= problem.touch * (1.0 + 1e-9)).ravel()
        found["load_share"] = float((weights @ (pressure * touching)) / (weights @ pressure))
    if problem.keeps_oil:
        content = solver.content(state).reshape(mesh.shape)
        # near the outlet only the entrainment drives the flow
        found["flux_m2_s"] = float(content[-2].mean()) * stated.height * stated.speed
    return {key: float(value) for key, value in found.items()}


def least(film: np.ndarray) -> float:
    """Return the vertex of the parabolas through the lowest node and its neighbours.

    Along y only where the node has both neighbours.
    """
    i, j = np.unravel_index(int(film.argmin()), film.shape)

    def parabola_drop(before: float, here: float, behind: float) -> float:
        bend = before - 2.0 * here + behind
        return (behind - before) ** 2 / (8.0 * bend) if bend > 0.0 else 0.0

    lowest = film[i, j]
    if 0 < i < film.shape[0] - 1:
        lowest -= parabola_drop(film[i - 1, j], film[i, j], film[i + 1, j])
    if 0 < j < film.shape[1] - 1:
        lowest -= parabola_drop(film[i, j - 1], film[i, j], film[i, j + 1])
    return float(lowest)


def moving(given: Given, nodes: int) -> Found:
    """Solve moving waves in steps of one node; the result is the central film's last period."""
    stated = Stated(given)
    solver = twin.Twin(stated.problem((nodes, 1)))
    mesh, problem = solver.problem.mesh, solver.problem
    rough = given["surface_speeds_m_s"][0] / stated.speed
    ((amplitude, along, _, _),) = given["waves"]
    step = mesh.x[1] - mesh.x[0]
    period = round(1.0 / (along * stated.a) / rough / step)
    last = round(given["settles_half_widths"] / step) + period
    smooth = twin.Twin(replace(problem, shape=mesh.x**2 / 2.0), solver.matrix)
    state = smooth.steady(twin.hertz_start(smooth, 0.5))
    state = solver.steady(state)
    once, twice, films = solver.content(state), None, []
    centre = int(np.argmin(np.abs(mesh.x)))
    before = state
    for number in range(1, last + 1):
        now = twin.Twin.__new__(twin.Twin)
        now.__dict__ = {
            **solver.__dict__,
            "problem": replace(problem, shape=stated.shape(mesh, number * step * rough)),
        }
        guess = twin.State(
            np.maximum(2.0 * state.oil - before.oil, 0.0), state.solid, state.approach
        )
        past = twin.Past(step, once, twice)
        try:
            following = now.settled(guess, past, most=15, tolerance=1e-5)
        except twin.NotFound:
            following = now.settled(state, past, most=60, tolerance=1e-5)
        before, state = state, following
        once, twice = now.content(state), once
        films.append(float(now.gap(state)[centre]))
    films_last_period = np.array(films[-period:]) * stated.height
    turns = np.exp(2j * np.pi * np.arange(period) / period)
    return {
        "amplitude_ratio": float(2.0 * abs(turns @ films_last_period) / period / amplitude),
        "h_mean_m": float(films_last_period.mean()),
    }


def limit(found: list[Found], sizes: list[float]) -> tuple[Found, Found]:
    """Extrapolate from the last two grids at second order in their spacing.

    Also returns the difference to the extrapolation from the two grids before.
    """

    def extrapolated(coarse: int, fine: int, key: str) -> float:
        gain = sizes[fine] ** 2 / (sizes[coarse] ** 2 - sizes[fine] ** 2)
        return found[fine][key] + gain * (found[fine][key] - found[coarse][key])

    last = {key: extrapolated(-2, -1, key) for key in found[-1]}
    return last, {key: abs(last[key] - extrapolated(-3, -2, key)) for key in last}
