"""Adapter of asperity: contacts, waves and sliders of the benchmark, solved by `asperity.ehl`."""

from dataclasses import replace
from itertools import islice

import numpy as np

from asperity.benchmark.cases import CaseTable
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput
from asperity.ehl import (
    ContactModel,
    ContactSolution,
    FilmBoundary,
    Options,
    solve_contact,
    solve_film,
)
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.solution import contact_state
from asperity.surface import MovingSurfaces, Surface, flat_surface
from asperity.transient import moving_contact

LENGTH = 0.01  # of a line contact [m]; no certified value depends on it
TIGHT = Options(tolerance=1e-6)


class AsperitySolver:
    """Adapter of asperity with a tight tolerance."""

    name = "asperity"
    kinds = ("dry", "wave", "ehl", "mixed", "conserving", "moving", "slider")

    def solve(self, inputs: CaseTable, cells: int) -> dict[str, float]:
        """Return quantities by key."""
        return _SOLVES[inputs["kind"]](inputs, cells)


def _conditions(inputs: CaseTable, speed: float = 1.0) -> ContactConditions:
    line = inputs["geometry"] == "line"
    radius = inputs["radius_m"]
    return ContactConditions(
        pair=ElasticPair(tuple(inputs["youngs_modulus_pa"]), tuple(inputs["poisson_ratio"])),
        geometry=inputs["geometry"],
        radius=tuple(radius) if isinstance(radius, list) else radius,
        length=LENGTH if line else None,
        load=inputs["line_load_n_m"] * LENGTH if line else inputs["load_n"],
        surface_speeds=(speed, speed),
    )


def waves_on(grid: Grid, inputs: CaseTable) -> Field:
    """Return the heights of the case's waves [m].

    Each wave is (amplitude [m], waves along x and y over the side, phase [rad]).
    """
    x, y = grid.x[:, None], grid.y[None, :]
    angular_wavenumber = 2.0 * np.pi / inputs["side_m"]
    return np.asarray(
        np.sum(
            [
                a * np.cos(angular_wavenumber * (kx * x + ky * y) + phase)
                for a, kx, ky, phase in inputs["waves"]
            ],
            axis=0,
        )
    )


def dry_roughness(grid: Grid, inputs: CaseTable) -> Field:
    """Return the heights [m] of a dry ball's or ellipse's roughness: waves, rings, or none."""
    if "waves" in inputs:
        return waves_on(grid, inputs)
    if "rings" in inputs:
        amplitude, length = inputs["rings"]
        return np.asarray(
            amplitude * np.cos(2.0 * np.pi * np.hypot(grid.x[:, None], grid.y[None, :]) / length)
        )
    return np.zeros(grid.cells)


def pressures(pressure: Field, cell_area: float) -> dict[str, float]:
    """Return largest pressure, pressure-weighted mean pressure, and contact area.

    The weighted mean depends less on single cells.
    """
    return {
        "p_max_pa": float(pressure.max()),
        "p_weighted_pa": float((pressure**2).sum() / pressure.sum()),
        "contact_area_m2": float(np.count_nonzero(pressure) * cell_area),
    }


def _dry(inputs: CaseTable, cells: int) -> dict[str, float]:
    conditions = _conditions(inputs)
    a, b = conditions.hertz.half_widths
    if inputs["geometry"] == "line":
        grid = Grid((cells, 8), (-1.5 * a, 0.0), (1.5 * a, 8 * 3.0 * a / cells))
    else:
        x, y = (inputs["side_m"] / 2.0,) * 2 if "side_m" in inputs else (1.5 * a, 1.5 * b)
        grid = Grid((cells, cells), (-x, -y), (x, y), periodic=(False, False))
    if inputs["geometry"] == "line" and "waves" in inputs:
        surface = _oiled_waves(inputs, grid)
    else:
        surface = Surface(dry_roughness(grid, inputs), grid)
    solution = solve_contact(conditions, None, surface, options=TIGHT)
    values = pressures(solution.pressure, grid.spacing[0] * grid.spacing[1])
    if inputs["geometry"] == "line" and "waves" not in inputs:
        values["half_width_m"] = _half_width(grid.x, solution.pressure[:, 0])
    return values


def _half_width(x: Field, pressure: Field) -> float:
    """Return the zero of the squared pressure, which is linear at the edge."""
    inside = np.flatnonzero(pressure)[-3:-1]  # without the last cell, which the edge cuts
    slope, level = np.polyfit(x[inside] ** 2, pressure[inside] ** 2, 1)
    return float(np.sqrt(-level / slope))


def _wave(inputs: CaseTable, cells: int) -> dict[str, float]:
    """Solve waves across a wide line contact, whose middle approximates an infinite contact."""
    pair = ElasticPair(tuple(inputs["youngs_modulus_pa"]), tuple(inputs["poisson_ratio"]))
    length = inputs["wavelength_m"]
    amplitude = inputs["amplitude_m"]
    p_mean = inputs["pressure_over_full"] * np.pi * pair.reduced_modulus * amplitude / length
    a = 30.0 * length
    wide = {
        "geometry": "line",
        "radius_m": a * pair.reduced_modulus / (2.0 * p_mean),
        "line_load_n_m": 0.5 * np.pi * a * p_mean,
    }
    grid = Grid((cells, cells), (-1.5 * a, 0.0), (1.5 * a, length))
    heights = np.tile(amplitude * np.cos(2.0 * np.pi * grid.y / length), (cells, 1))
    solution = solve_contact(
        _conditions({**inputs, **wide}), None, Surface(heights, grid), options=TIGHT
    )
    middle = slice(cells // 2 - 1, cells // 2 + 1)
    return {
        "p_max_pa": float(solution.pressure[middle].max()),
        "mean_gap_m": float(solution.gap[middle].mean()),
    }


def _oil(inputs: CaseTable) -> Lubricant:
    oil = inputs["oil"]
    density = (oil["density"], oil["density_c1_1_pa"], oil["density_c2_1_pa"])
    if density != ("dowson-higginson", 0.6e-9, 1.7e-9):
        raise BadInput(
            "the oil's density law must be Dowson and Higginson's with 0.6e-9 and 1.7e-9 1/Pa, "
            f"got {density}"
        )
    viscosity: Barus | Roelands
    if oil["viscosity"] == "barus":
        viscosity = Barus(oil["eta0_pa_s"], oil["alpha_1_pa"])
    else:
        viscosity = Roelands(oil["eta0_pa_s"], oil["alpha_1_pa"], oil["roelands_p0_pa"])
    return Lubricant(
        viscosity=viscosity, density=DowsonHigginson(oil["rho0_kg_m3"]), rheology=Newtonian()
    )


def _ehl_grid(inputs: CaseTable, a: float, cells: int) -> Grid:
    low = inputs["inlet_half_widths"] * a
    high = inputs["outlet_half_widths"] * a
    if inputs["geometry"] == "point":
        side = inputs["side_half_widths"] * a
        return Grid((cells, cells), (low, -side), (high, side), periodic=(False, False))
    if "width_m" in inputs:
        return Grid((cells, max(8, cells // 4)), (low, 0.0), (high, inputs["width_m"]))
    return Grid((cells, 8), (low, 0.0), (high, 8 * (high - low) / cells))


def _oiled_waves(inputs: CaseTable, grid: Grid) -> Surface:
    """Return the surface of waves in a lubricated contact.

    Each wave is (amplitude [m], waves per metre along x, waves over the width along y, phase
    [rad]).
    """
    x = grid.x[:, None]
    y = grid.y[None, :] / inputs.get("width_m", 1.0)
    heights = [
        a * np.cos(2.0 * np.pi * (wavenumber * x + across * y) + phase)
        for a, wavenumber, across, phase in inputs["waves"]
    ]
    return Surface(np.broadcast_to(np.sum(heights, axis=0), grid.cells).copy(), grid)


def _ehl(inputs: CaseTable, cells: int) -> dict[str, float]:
    """Solve a contact that is smooth, has stationary waves, or conserves oil."""
    conditions = _conditions(inputs, float(np.mean(inputs["surface_speeds_m_s"])))
    grid = _ehl_grid(inputs, conditions.hertz.half_widths[0], cells)
    surface = _oiled_waves(inputs, grid) if "waves" in inputs else flat_surface(grid)
    options = TIGHT
    if "touching_film_m" in inputs:
        model: ContactModel = "conserving" if inputs["kind"] == "conserving" else "mixed"
        options = Options(tolerance=1e-6, contact_film=inputs["touching_film_m"], model=model)
    return _films(inputs, solve_contact(conditions, _oil(inputs), surface, options=options))


def _films(inputs: CaseTable, solution: ContactSolution) -> dict[str, float]:
    grid = solution.grid
    gap = solution.gap
    pressure = solution.pressure
    if inputs["geometry"] == "point":
        state = contact_state(solution)
        return {"h_central_m": state.h_central, "h_min_m": state.h_min}
    middle = (
        gap[:, 0] if grid.y[0] == 0.0 or "width_m" not in inputs else 0.5 * (gap[:, 0] + gap[:, -1])
    )
    inside = np.linspace(-1.0, 1.0, 4001) * solution.conditions.hertz.half_widths[0]
    values = {
        "h_central_m": float(np.interp(0.0, grid.x, middle)),
        "h_min_m": _min_film(gap[:, 0]),
        "h_mean_m": float(np.interp(inside, grid.x, gap.mean(axis=1)).mean()),
        "p_weighted_pa": float((pressure**2).sum() / pressure.sum()),
        "load_share": float((pressure * solution.in_contact).sum() / pressure.sum()),
    }
    if solution.oil is not None and inputs["kind"] == "conserving":
        speed = float(np.mean(inputs["surface_speeds_m_s"]))
        # at the outlet only entrainment drives the oil
        values["flux_m2_s"] = speed * float((solution.oil.content * gap)[-1].mean())
    return values


def _moving(inputs: CaseTable, cells: int) -> dict[str, float]:
    """Solve waves of the first surface that pass through: film at x = 0 over their last period."""
    speeds = tuple(inputs["surface_speeds_m_s"])
    conditions = replace(_conditions(inputs), surface_speeds=speeds)
    a = conditions.hertz.half_widths[0]
    grid = _ehl_grid(inputs, a, cells)
    surfaces = MovingSurfaces.one_rough(_oiled_waves(inputs, grid), speeds)
    ((amplitude, wavenumber, _, _),) = inputs["waves"]
    step = grid.spacing[0]
    rough = speeds[0] / float(np.mean(speeds))
    period = round(1.0 / (wavenumber * rough * step))
    last = round(inputs["settles_half_widths"] * a / step) + period
    films = []
    for snapshot in islice(
        moving_contact(conditions, _oil(inputs), surfaces, options=TIGHT), last + 1
    ):
        if not snapshot.solution.convergence.converged:
            raise AsperityError(
                f"step {snapshot.number} of {last} did not converge; use another number of cells"
            )
        films.append(float(np.interp(0.0, grid.x, snapshot.solution.gap[:, 0])))
    period_films = np.array(films[-period:])
    phases = np.exp(2j * np.pi * np.arange(period) / period)
    return {
        "amplitude_ratio": float(2.0 * abs(phases @ period_films) / period / amplitude),
        "h_mean_m": float(period_films.mean()),
    }


def _min_film(gap: Field) -> float:
    """Return the vertex of the parabola through the lowest cell and its neighbours.

    Unlike the lowest cell it varies smoothly with the grid.
    """
    i = int(np.clip(gap.argmin(), 1, gap.size - 2))
    left, centre, right = gap[i - 1 : i + 2]
    bend = left - 2.0 * centre + right
    return float(centre - (right - left) ** 2 / (8.0 * bend)) if bend > 0.0 else float(centre)


def _slider(inputs: CaseTable, cells: int) -> dict[str, float]:
    journal = inputs["shape"] == "journal"
    length = 2.0 * np.pi * inputs["radius_m"] if journal else inputs["length_m"]
    share = (np.arange(cells) + 0.5) / cells
    if journal:
        gap = inputs["clearance_m"] * (1.0 + inputs["eccentricity"] * np.cos(2.0 * np.pi * share))
    else:
        gap = inputs["least_m"] * (1.0 + (2.0 * share - 1.0) ** 2)
    film = solve_film(
        gap,
        spacing=length / cells,
        entrainment_speed=inputs["speed_m_s"],
        viscosity=inputs["viscosity_pa_s"],
        boundary=FilmBoundary(ends=tuple(inputs["pressures_pa"])),
    )
    load = {} if journal else {"load_n_m": float(film.load)}
    return {"p_max_pa": float(film.pressure.max()), "flux_m2_s": float(film.flux.mean()), **load}


_SOLVES = {
    "dry": _dry,
    "wave": _wave,
    "ehl": _ehl,
    "mixed": _ehl,
    "conserving": _ehl,
    "moving": _moving,
    "slider": _slider,
}
