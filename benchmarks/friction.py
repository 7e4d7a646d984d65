"""Friction, flash temperature and thermal feedback: errors against closed forms, the paper's
case over Sq, cost.
"""

import statistics
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.integrate import quad
from scipy.special import iv, k0e, modstruve

from asperity import load_case, solve_contact, subsurface_stress
from asperity.case import Case
from asperity.contact.grid import Grid
from asperity.contact.hertz import line_pressure
from asperity.ehl import ContactSolution, Convergence, Iteration, Options, SolveStatus
from asperity.lubricant import (
    EyringShear,
    FrictionLaw,
    LinearBairWiner,
    NewtonianShear,
    Solid,
    Thermal,
)
from asperity.results import stribeck_curve
from asperity.solution import (
    contact_state,
    flash_temperature,
    friction,
    friction_and_heat,
    solve_thermal_contact,
)
from asperity.solution.flash import moving_source
from asperity.surface import flat_surface

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
SQ_UM = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)
SEEDS = (1, 2, 3)
STEEL, HALF = Solid(), 50e-6
DEPTHS = 16


def lines(*, fast: bool) -> Iterator[str]:
    yield "## Friction against closed forms\n"
    yield from limit_lines()
    yield "\n## Flash temperature against closed forms\n"
    yield from source_lines()
    yield "\n## Heat balance of solved contacts\n"
    yield from balance_lines()
    yield "\n## Cost of friction, heat and stress, 256 x 256\n"
    yield from cost_lines()
    if not fast:
        yield (
            "\n## The paper's case over Sq, without and with thermal feedback, 256 x 256, mean of"
            " three surfaces\n"
        )
        yield from roughness_lines()
        yield "\n## Stribeck curves of the paper's case, 128 x 128\n"
        yield from stribeck_lines()


def limit_lines() -> Iterator[str]:
    case = load_case(CASE)
    conditions, gap, alpha, eta0 = case.conditions, 0.7e-6, 18.2e-9, 0.096
    a, p_h, rate = (
        conditions.hertz.half_widths[0],
        conditions.hertz.p_max,
        conditions.sliding_speed / 0.7e-6,
    )
    beta, tau0 = alpha * p_h, 2e3

    def limited(x: float) -> float:
        pressure = p_h * np.sqrt(1.0 - (x / a) ** 2)
        limit = 2e6 + 0.05 * pressure
        return float(-limit * np.expm1(-eta0 * np.exp(alpha * pressure) * rate / limit))

    exact = {
        "Newton, modified Bessel and Struve functions": (
            NewtonianShear(),
            eta0 * rate * a * np.pi * (iv(1, beta) + modstruve(-1, beta)),
        ),
        "Eyring far above its characteristic stress": (
            EyringShear(tau0),
            2.0 * a * tau0 * (np.log(2.0 * eta0 * rate / tau0) + alpha * np.pi / 4.0 * p_h),
        ),
        "Bair-Winer without elasticity, quadrature": (
            LinearBairWiner(2e6, 0.05, ratio=1e-9),
            quad(limited, -a, a, epsrel=1e-9)[0],
        ),
    }
    yield (
        "| traction of a Hertz pressure, film 0.7 um | cells over 2a | coefficient | closed form |"
        " error |"
    )
    yield "|---|---|---|---|---|"
    for name, (law, force) in exact.items():
        for cells in (64, 256, 1024):
            found = friction(_hertz_film(case, law, cells, gap)).coefficient
            reference = force / conditions.line_load
            yield (
                f"| {name} | {cells} | {found:.5f} | {reference:.5f} |"
                f" {100 * (found / reference - 1):+.3f} % |"
            )
    dry = solve_contact(conditions, None, case.surface())
    found = friction(dry).coefficient
    yield (
        f"\nDry, Sq 1 um, 256 x 256: {found:.6f} where f_b is 0.15, error"
        f" {abs(found / 0.15 - 1):.0e}."
    )


def _hertz_film(case: Case, law: FrictionLaw, cells: int, gap: float) -> ContactSolution:
    a, p_h = case.conditions.hertz.half_widths[0], case.conditions.hertz.p_max
    grid = Grid((2 * cells, 8), (-2.0 * a, -a), (2.0 * a, a))
    inside = np.abs(grid.x) < a
    line_ones = np.line_ones(8)
    assert case.lubricant is not None
    return ContactSolution(
        conditions=case.conditions,
        lubricant=replace(case.lubricant, friction=law),
        surface=flat_surface(grid),
        options=Options(),
        pressure=line_pressure(grid.x, a, p_h)[:, None] * line_ones,
        gap=np.where(inside, gap, 1.0)[:, None] * line_ones,
        in_contact=np.zeros(grid.cells, bool),
        rigid_approach=0.0,
        convergence=Convergence(
            SolveStatus.CONVERGED, (Iteration(grid.cells, 1, 0.0, 0.0, 0.0),), 1e-4, 0.0
        ),
    )


def speed_at(peclet: float) -> float:
    return 2.0 * STEEL.diffusivity * peclet / HALF


def source_lines() -> Iterator[str]:
    k, kappa = STEEL.conductivity, STEEL.diffusivity
    yield (
        "Sources of half-width b = 50 um on steel, 64 x 64 cells over the source, Pe = u b/(2 κ);"
        " largest rise."
    )
    yield "\n| source | Pe | rise over q b/k | closed form | error |"
    yield "|---|---|---|---|---|"
    dx = 2.0 * HALF / 64
    for peclet in (0.01, 0.1, 1.0, 10.0, 100.0, 1e4):
        body = moving_source((128, 8), (dx, dx), speed_at(peclet), STEEL, length=1e3)
        x = (np.arange(128) - 63.5) * dx
        rise = body(np.where(np.abs(x) < HALF, 1.0, 0.0)[:, None] * np.line_ones(8))[:, 0]
        where = float(x[rise.argmax()])
        v = speed_at(peclet) / (2.0 * kappa)

        def source(at: float, where: float = where, v: float = v) -> float:
            return float(np.exp(v * (where - at) - v * abs(where - at)) * k0e(v * abs(where - at)))

        reach = sorted(
            {
                -HALF,
                HALF,
                where,
                *(where - s / v for s in (0.01, 1.0, 30.0) if where - s / v > -HALF),
            }
        )
        exact = sum(quad(source, a, b, epsrel=1e-9)[0] for a, b in pairwise(reach)) / (np.pi * k)
        yield _compared(
            "band, Jaeger's integral at the same point", peclet, float(rise.max()), exact
        )
        if peclet >= 100.0:
            blok = 2.0 / k * np.sqrt(kappa * 2.0 * HALF / (np.pi * speed_at(peclet)))
            yield _compared(
                "band, Blok's 1.128 at the trailing edge", peclet, float(rise.max()), blok
            )
    square = moving_source((65, 65), (2.0 * HALF / 65, 2.0 * HALF / 65), 0.0, STEEL, length=None)
    at_rest = float(square(np.line_ones((65, 65))).max())
    yield _compared(
        "square at rest, 4 ln(1 + √2)/π",
        0.0,
        at_rest,
        4.0 * np.log(1.0 + np.sqrt(2.0)) / np.pi * HALF / k,
    )
    for peclet in (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0):
        body = moving_source((64, 64), (dx, dx), speed_at(peclet), STEEL, length=None)
        fitted = 2.0 * HALF / (k * np.sqrt(np.pi * (1.011 + peclet)))
        yield _compared(
            "square, Tian and Kennedy's fit",
            peclet,
            float(body(np.line_ones((64, 64))).max()),
            fitted,
        )


def _compared(name: str, peclet: float, found: float, exact: float) -> str:
    unit = STEEL.conductivity / HALF
    return (
        f"| {name} | {peclet:g} | {found * unit:.5f} | {exact * unit:.5f} |"
        f" {100 * (found / exact - 1):+.3f} % |"
    )


def balance_lines() -> Iterator[str]:
    yield (
        "| Sq [um] | speeds [m/s] | friction power [W] | into body 1 [W] | into body 2 [W] |"
        " error of the sum |"
    )
    yield "|---|---|---|---|---|---|"
    case = load_case(CASE).with_overrides({"grid.cells": [128, 128]})
    for sq in (0.5, 2.0):
        chosen = case.with_overrides({"surface.sq": f"{sq} um"})
        solution = solve_contact(chosen.conditions, chosen.lubricant, chosen.surface())
        for speeds in ((2.101, 1.719), (1.719, 2.101), (3.82, 0.0), (5.0, -1.18), (1.91, 1.91)):
            moved = replace(
                solution, conditions=replace(solution.conditions, surface_speeds=speeds)
            )
            rubbing = friction(moved)
            heat = flash_temperature(moved, rubbing)
            off = (heat.heat_1_w + heat.heat_2_w) / rubbing.power - 1.0 if rubbing.power else 0.0
            yield (
                f"| {sq:g} | {speeds[0]:g}, {speeds[1]:g} | {rubbing.power:.3f} |"
                f" {heat.heat_1_w:.3f} | {heat.heat_2_w:.3f} | {off:.0e} |"
            )


def cost_lines() -> Iterator[str]:
    case = load_case(CASE)
    solution = solve_contact(case.conditions, case.lubricant, case.surface())
    seconds = [
        solve_contact(case.conditions, case.lubricant, case.surface()).convergence.seconds
        for _ in range(3)
    ]
    solve = statistics.median(seconds)
    moving_source.cache_clear()
    began = perf_counter()
    rubbing, _ = friction_and_heat(solution)
    first = perf_counter() - began
    heat = _median(lambda: friction_and_heat(solution))
    fed = _median(lambda: friction_and_heat(solution, thermal=Thermal(feedback=True)))
    depths = np.linspace(0.1, 1.6, DEPTHS) * case.conditions.hertz.half_widths[0]
    began = perf_counter()
    subsurface_stress(solution, shear=rubbing.shear, depths=depths)
    first_stress = perf_counter() - began
    stress = _median(lambda: subsurface_stress(solution, shear=rubbing.shear, depths=depths))
    yield f"- one cold solve, Sq 1 um: {solve:.2f} s"
    yield f"- friction and heat: {heat:.3f} s (the first time on a grid {first:.3f} s)"
    yield f"- the same at the film's own temperature: {fed:.3f} s"
    yield f"- stress at {DEPTHS} depths: {stress:.3f} s (the first time {first_stress:.3f} s)"
    yield (
        f"- heat and stress together: {heat + stress:.2f} s, {100 * (heat + stress) / solve:.0f} %"
        " of the solve"
    )


def _median(run: Callable[[], object]) -> float:
    taken = []
    for _ in range(5):
        began = perf_counter()
        run()
        taken.append(perf_counter() - began)
    return statistics.median(taken)


def roughness_lines() -> Iterator[str]:
    yield (
        "| Sq [um] | CLR [%] | friction (range) | asperities | oil | surface [K] | film [K] | mean"
        " film [um] | with feedback: CLR [%] | friction | oil | film [K] | mean film [um] |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    warm = Thermal(feedback=True)
    for sq in (0.0, *SQ_UM):
        rows = []
        for seed in SEEDS if sq else SEEDS[:1]:
            overrides = (
                {"surface.sq": f"{sq} um", "surface.seed": seed} if sq else {"surface": "flat"}
            )
            case = load_case(CASE).with_overrides(overrides)
            given = (case.conditions, case.lubricant, case.surface())
            cold = solve_contact(*given)
            fed = solve_thermal_contact(*given, thermal=warm)
            rows.append([*_row(cold, Thermal()), *_row(fed, warm)])
        mean = np.mean(rows, axis=0)
        coefficients = [row[1] for row in rows]
        yield (
            f"| {sq:g} | {mean[0]:.1f} | {mean[1]:.4f} ({min(coefficients):.4f} to"
            f" {max(coefficients):.4f}) | {mean[2]:.4f} | {mean[3]:.4f} | {mean[4]:.1f} |"
            f" {mean[5]:.1f} | {mean[6]:.3f} | {mean[7]:.1f} | {mean[8]:.4f} | {mean[10]:.4f} |"
            f" {mean[12]:.1f} | {mean[13]:.3f} |"
        )


def _row(solution: ContactSolution, thermal: Thermal) -> list[float]:
    rubbing, heat = friction_and_heat(solution, thermal=thermal)
    state = contact_state(solution)
    return [
        100.0 * state.clr,
        rubbing.coefficient,
        rubbing.asperity_part,
        rubbing.oil_part,
        heat.max_k,
        heat.film_max_k,
        1e6 * state.h_mean,
    ]


def stribeck_lines() -> Iterator[str]:
    curves = []
    for sq in ("0.5 um", "1 um", "2 um"):
        for feedback in ("false", "true"):
            case = load_case(CASE).with_overrides(
                {"grid.cells": [128, 128], "surface.sq": sq, "thermal.feedback": feedback}
            )
            curves.append(stribeck_curve(case))
    names = [
        f"Sq {1e6 * curve.sq:g} um{', with feedback' if curve.feedback else ''}" for curve in curves
    ]
    yield f"| u [m/s] | {' | '.join(names)} |"
    yield "|---|" + "---|" * len(curves)
    for points in zip(*(curve.points for curve in curves), strict=True):
        found = [
            f"{p.friction_coefficient:.4f}{'' if p.converged else ' (not converged)'}"
            for p in points
        ]
        yield f"| {points[0].entrainment_speed_m_s:.3g} | {' | '.join(found)} |"


if __name__ == "__main__":
    for line in lines(fast=False):
        print(line, flush=True)
