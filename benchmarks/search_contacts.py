"""Small contacts of all kinds, for benchmarks of the search for a solution."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from asperity.case import Case, load_case
from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.contact.rollers import RollerShape
from asperity.ehl import (
    ContactModel,
    ContactSolution,
    InletLayer,
    Options,
    auto_grid,
    solve_contact,
    solve_film,
)
from asperity.lubricant import Barus
from asperity.solution import contact_state, dynamic_stiffness, own_resonance
from asperity.surface import flat_surface, gaussian_surface
from asperity.transient import moving_contact
from benchmarks import chosen_grids, films, robustness, rollers

EXAMPLES = Path(__file__).parents[1] / "examples"
POLYMER = """[contact]
geometry = "line"
radius = "0.59 m"
load = "3918 N"
length = "4.322 mm"
entrainment_speed = "11.5 mm/s"
[material]
youngs_modulus = "3.6 GPa"
poisson_ratio = 0.38
hardness = "0.25 GPa"
[lubricant]
viscosity = {{ law = "roelands", eta0 = "1.07 mPa s", alpha = "7.8 1/GPa" }}
density = {{ law = "dowson-higginson", rho0 = "870 kg/m^3" }}
rheology = "newtonian"
[grid]
cells = [5520, 16]
[surface]
{surface}
"""  # water between polymers, M 3700, L 0.01
MOST_STEPS = 150

Outcome = tuple[bool, int, float]


def _of(solution: ContactSolution) -> Outcome:
    convergence = solution.convergence
    return convergence.converged, convergence.iterations, contact_state(solution).clr


@cache
def contacts() -> dict[str, Callable[[], Outcome]]:
    """Return the contacts by name; each returns whether it is solved, its steps and load share."""
    return {**_wide(), **_hard(), **_smooth(), **_starved(), **_others()}


def _wide() -> dict[str, Callable[[], Outcome]]:
    sample = robustness.contacts(600)

    def solved(number: int, cells: int, model: ContactModel | None) -> Outcome:
        conditions, surface = robustness.prepared(sample[number], cells)
        options = Options(max_iterations=MOST_STEPS, model=model or "mixed")
        oil = robustness.OIL if model else None
        return _of(solve_contact(conditions, oil, surface, options=options, strict=False))

    found: dict[str, Callable[[], Outcome]] = {}
    groups: tuple[tuple[ContactModel, int, tuple[int, ...]], ...] = (
        ("mixed", 64, (0, 60, 90, 120, 150, 180, 210, 390)),
        ("mixed", 128, (203,)),
        ("conserving", 64, (1, 121, 241, 361)),
        ("unified", 64, (2, 202, 402)),
        ("paper", 64, (4, 304)),
    )
    for model, cells, numbers in groups:
        for number in numbers:
            found[f"wide {number}, {cells}, {model}"] = partial(solved, number, cells, model)
    for number in (5, 155, 305, 455):
        found[f"wide {number}, 64, dry"] = partial(solved, number, 64, None)
    return found


def _hard() -> dict[str, Callable[[], Outcome]]:
    """Hard steel, on half of the cells that its own grid has along each axis."""

    def solved(sample: chosen_grids.Sample) -> Outcome:
        whole = auto_grid(sample.conditions, sample.oil, sample.texture)
        nx, ny = (max(16, 8 * round(count / 16)) for count in whole.cells)
        grid = replace(whole, cells=(nx, ny))
        texture = sample.texture
        rng = np.random.default_rng(sample.seed)
        surface = gaussian_surface(grid, sq=texture.sq, correlation_length=texture.lengths, rng=rng)
        options = Options(max_iterations=MOST_STEPS)
        return _of(
            solve_contact(sample.conditions, sample.oil, surface, options=options, strict=False)
        )

    return {
        f"hard steel {number}": partial(solved, sample)
        for number, sample in enumerate(chosen_grids.samples(50))
        if number in (0, 16, 40, 48)
    }


def _smooth() -> dict[str, Callable[[], Outcome]]:
    def ball(load: float, oil: float, model: ContactModel, cells: int = 64) -> Outcome:
        conditions, _ = films.ball(load, oil)
        a, b = conditions.hertz.half_widths
        grid = Grid(
            (cells, cells), (-4.5 * a, -3.0 * b), (1.5 * a, 3.0 * b), periodic=(False, False)
        )
        options = Options(
            tolerance=1e-5, contact_film=films.NO_FLOOR, model=model, max_iterations=MOST_STEPS
        )
        surface = flat_surface(grid)
        return _of(solve_contact(conditions, films.BARUS, surface, options=options, strict=False))

    def line(load: float, oil: float, law: str) -> Outcome:
        conditions, lubricant, _ = films.line_case(load, oil, law)
        a = conditions.hertz.half_widths[0]
        surface = flat_surface(Grid((512, 8), (-4.5 * a, -a), (1.4 * a, a)))
        options = Options(tolerance=1e-7, contact_film=films.NO_FLOOR)
        return _of(solve_contact(conditions, lubricant, surface, options=options, strict=False))

    def isoviscous_ball() -> Outcome:
        pair = films.ball(100, 10)[0].pair
        modulus, radius, twice_u = pair.effective_modulus, 12.5e-3, 1e-11
        speed = twice_u * modulus * radius / 0.08
        conditions = ContactConditions(
            pair=pair,
            geometry="point",
            radius=radius,
            load=100.0 * twice_u**0.75 * modulus * radius**2,
            surface_speeds=(speed, speed),
        )
        oil = replace(films.BARUS, viscosity=Barus(0.04, 1e-14))
        a = conditions.hertz.half_widths[0]
        grid = Grid((64, 64), (-4.5 * a, -3.0 * a), (1.5 * a, 3.0 * a), periodic=(False, False))
        options = Options(tolerance=1e-5, contact_film=films.NO_FLOOR, model="paper")
        return _of(
            solve_contact(conditions, oil, flat_surface(grid), options=options, strict=False)
        )

    def polymer() -> Outcome:
        text = 'model = "conserving"\n' + POLYMER.format(surface='kind = "flat"')
        case = load_case(text, name="polymer.toml")
        return _of(
            solve_contact(
                case.conditions, case.lubricant, case.surface(), options=case.options, strict=False
            )
        )

    def roller(shape: RollerShape) -> Outcome:
        conditions = rollers.conditions(shape)
        grid = rollers.between(conditions, (48, 96), (-3.5, 1.8))
        return _of(solve_contact(conditions, rollers.OIL, flat_surface(grid), strict=False))

    found: dict[str, Callable[[], Outcome]] = {
        f"smooth ball M {load}, L {oil}, {model}": partial(ball, load, oil, model)
        for load, oil in ((20, 2), (20, 10), (200, 15), (2000, 10))
        for model in ("mixed", "conserving")
    }
    found["isoviscous ball, paper"] = isoviscous_ball
    found["smooth ball of 256 x 256"] = partial(ball, 20, 10, "mixed", 256)
    found["polymer line, conserving"] = polymer
    for load, oil, law in ((5, 5, "Roelands"), (20, 10, "Barus"), (200, 5, "Barus")):
        found[f"smooth line M {load}, L {oil}"] = partial(line, load, oil, law)
    shapes = {
        "ISO profile": RollerShape.iso(9e-3, rollers.LENGTH),
        "straight": RollerShape(),
        "tilted": rollers.lundberg(1.0).tilted(0.5e-3),
    }
    for name, shape in shapes.items():
        found[f"roller, {name}"] = partial(roller, shape)
    return found


def _starved() -> dict[str, Callable[[], Outcome]]:
    def solved(name: str, layer: float, **written: Any) -> Outcome:
        case = load_case(EXAMPLES / f"{name}.toml").with_written(
            {"model": "conserving", "grid.x": [-4.5, 2.5], **written}
        )
        options = Options(model="conserving", inlet_layer=InletLayer.uniform(layer))
        parts = case.conditions, case.lubricant, case.surface()
        return _of(solve_contact(*parts, options=options, strict=False))

    strip = {"surface": "flat", "grid.cells": [96, 8], "grid.y": [-0.2, 0.2]}
    disc = {"surface": "flat", "grid.cells": [64, 64], "grid.y": [-3, 3]}
    rough = {"grid.cells": [48, 48], "contact.roughness": "standing", "grid.x": [-2.5, 1.9]}
    return {
        "starved line, 0.7 um": lambda: solved("paper", 0.7e-6, **strip),
        "starved line, 0.2 um": lambda: solved("paper", 0.2e-6, **strip),
        "starved ball, 15 nm": lambda: solved("ball-on-disc", 15e-9, **disc),
        "starved ball, 5 nm": lambda: solved("ball-on-disc", 5e-9, **disc),
        "starved rough line, 0.3 um": lambda: solved("paper", 0.3e-6, **rough),
    }


def _paper(**written: Any) -> Case:
    return load_case(EXAMPLES / "paper.toml").with_written(written)


def _others() -> dict[str, Callable[[], Outcome]]:
    """Rigid channels, oscillating contacts and time steps."""

    def channel(slope: float, viscosity: float) -> Outcome:
        x = np.linspace(-1.0, 1.0, 200)
        gap = 1e-6 * (1.0 + slope * x**2)
        film = solve_film(
            gap,
            spacing=1e-5,
            entrainment_speed=2.0,
            viscosity=Barus(viscosity, 2e-8),
            strict=False,
        )
        return film.residual < 1e-11, film.steps, 0.0

    def oscillating(frequency_hz: float, **written: Any) -> Outcome:
        case = _paper(**{"grid.cells": [64, 64], "contact.roughness": "standing", **written})
        solution = solve_contact(case.conditions, case.lubricant, case.surface())
        dynamic_stiffness(solution, frequency_hz)
        return _of(solution)

    def own() -> Outcome:
        case = _paper(**{"grid.cells": [64, 64], "contact.roughness": "standing"})
        solution = solve_contact(case.conditions, case.lubricant, case.surface())
        own_resonance(solution, 0.1)
        return _of(solution)

    def running(steps: int, time_step: float, **written: Any) -> Outcome:
        case = _paper(**{"grid.cells": [64, 32], **written})
        surfaces = case.moving_surfaces()
        options = Options(tolerance=1e-3, model=case.options.model)
        assert case.lubricant is not None
        taken = moving_contact(
            case.conditions, case.lubricant, surfaces, time_step=time_step, options=options
        )
        snapshots = list(islice(taken, steps))
        done = [snapshot.solution.convergence for snapshot in snapshots]
        return (
            all(convergence.converged for convergence in done),
            sum(convergence.iterations for convergence in done),
            float(np.mean([snapshot.state.clr for snapshot in snapshots])),
        )

    gear = {"lubricant.viscosity": {"law": "barus", "eta0": "0.01 Pa s", "alpha": "18.2 1/GPa"}}
    return {
        "rigid channel": lambda: channel(3.0, 0.03),
        "rigid channel, thick oil": lambda: channel(30.0, 0.05),
        "oscillating, 1 kHz": lambda: oscillating(1e3),
        "oscillating, 100 kHz": lambda: oscillating(1e5),
        "oscillating thin film, 10 kHz": lambda: oscillating(1e4, **gear),
        "own resonance": own,
        "running, 1 cell": lambda: running(9, 1.0),
        "running, 4 cells": lambda: running(9, 4.0),
        "running thin film, 2 cells": lambda: running(9, 2.0, **gear),
        "running, conserving": lambda: running(4, 2.0, model="conserving"),
    }
