"""Lubricated cases: smooth lines and balls, mixed and mass-conserving waves, moving waves, cavities."""

from collections.abc import Iterator
from functools import partial
from typing import Any

from benchmark import oiled, ways
from benchmark.dry_cases import BODIES, STEEL, Stated
from benchmark.values import Value, paired, stepped

LAWS = {"density": "dowson-higginson", "density_c1_1_pa": 0.6e-9, "density_c2_1_pa": 1.7e-9}
OIL = {"eta0_pa_s": 0.096, "alpha_1_pa": 18.2e-9, "viscosity": "roelands", "roelands_p0_pa": 1.96e8}
OIL |= {"rho0_kg_m3": 880.0, **LAWS}

OILED = BODIES + (
    "Line contact in plane strain: h = h0 + x^2/(2 R) + u(p), d/dx(rho h^3/(12 eta) dp/dx) = um d(rho h)/dx, um the mean of "
    "surface_speeds_m_s, p = 0 at inlet and outlet (in Hertz half-widths from the centre, oil fills the inlet), p >= 0 with "
    "p = dp/dx = 0 where the film ruptures, the integral of p is line_load_n_m. Newtonian, isothermal. barus: eta = eta0 "
    "exp(alpha p). roelands: eta = eta0 exp((ln(eta0/(Pa s)) + 9.67)((1 + p/p0)^z - 1)), z = alpha p0/(ln eta0 + 9.67). "
    "dowson-higginson: rho = rho0 (1 + c1 p/(1 + c2 p)). h_central_m: h at x = 0; h_min_m: least h anywhere."
)
CAVITY = (
    "Rigid walls, d/dx(h^3/(12 eta) dp/dx) = u d(theta h)/dx, u the mean of the walls' speeds, p >= 0, 0 <= theta <= 1, p (1 "
    "- theta) = 0 (Jakobsson, Floberg, Olsson), pressures_pa at both ends. flux_m2_s: the flow u theta h - h^3/(12 eta) dp/dx. "
)
SLIDER = (
    CAVITY + "h = least_m (1 + (2 x/length_m - 1)^2) from 0 to length_m. load_n_m: integral of p."
)
JOURNAL = (
    CAVITY
    + "h = clearance_m (1 + eccentricity cos(x/radius_m)) from 0 to 2 pi radius_m, full of oil at x = 0."
)
COMMON = (
    "Elastic half-spaces, E* = 1/sum((1 - nu^2)/E). Newtonian, isothermal. roelands: eta = eta0 exp((ln(eta0/(Pa s)) + "
    "9.67)((1 + p/p0)^z - 1)), z = alpha p0/(ln eta0 + 9.67). dowson-higginson: rho = rho0 (1 + c1 p/(1 + c2 p)). um is "
    "the mean of surface_speeds_m_s, along +x. p = 0 at the domain's ends (Hertz half-widths a from the centre), oil fills "
    "the inlet. "
)
BALL = COMMON + (
    "h = h0 + (x^2 + y^2)/(2 R) + u(p), u the deflection of the half-space under p alone. div(rho h^3/(12 eta) grad p) = um d(rho h)/dx "
    "where p > 0; p >= 0, and where p = 0 um d(rho h)/dx >= 0 (Reynolds' rupture; cavities are refilled). p = 0 at |y| = "
    "side_half_widths too. The integral of p is load_n. h_central_m: h at the origin; h_min_m: least h."
)
WAVES = (
    "h = h0 + x^2/(2 R) + u(P) - z, u of plane strain (with width_m: of a half-space whose pressure repeats along y). z = "
    "sum of A cos(2 pi (m x + n y/width_m) + phase) over waves = [A in m, m in 1/m, n, phase]; y runs over one width_m. The "
    "integral of P over x (mean over y) is line_load_n_m. p_weighted_pa: integral of P^2 over that of P. h_mean_m: mean of "
    "the film over |x| <= a, a = sqrt(4 W R/(pi E*)). h_central_m: the film at x = y = 0. "
)
MIXED = (
    COMMON
    + WAVES
    + (
        "Roughness stands still. The film is f = max(h, c), c = touching_film_m. The oil's pressure q: q >= 0, R >= 0, q R = "
        "0, R = um d(rho(q) f)/dx - div(k grad q), in touching places too; k = max(rho f^3/eta(q), rho0 c^6/(f^3 eta0))/12. "
        "The bodies bear P - q: P - q >= 0, h >= c, (P - q)(h - c) = 0. load_share: the part of the load where h = c."
    )
)
CONSERVING = (
    COMMON
    + WAVES
    + (
        "Roughness stands still. No oil is lost: um d(theta rho f)/dx = d(k dp/dx)/dx everywhere, p >= 0, 0 <= theta <= 1, p "
        "(1 - theta) = 0 (Jakobsson, Floberg, Olsson), f = max(h, c), k = max(rho f^3/eta, rho0 c^6/(f^3 eta0))/12, c = "
        "touching_film_m, which nothing reaches; P = p. flux_m2_s: flow over rho0, um theta rho f/rho0 where p is level."
    )
)
MOVING = (
    COMMON
    + WAVES
    + (
        "The waves are the first body's and move with it: z(x - u1 t). d(rho h)/dt + um d(rho h)/dx = d(rho h^3/(12 eta) "
        "dp/dx)/dx where p > 0, p >= 0 (cavities are refilled), the load is held. Periodic in time (reached after "
        "settles_half_widths of um t/a from the wave standing still). amplitude_ratio: amplitude of h's first harmonic in "
        "time at x = 0 over A; h_mean_m: there, mean of h over a period (not over |x| <= a)."
    )
)


def _twinned(
    given: dict[str, Any],
    grids: list[tuple[int, int]],
    cells: tuple[int, ...],
    keys: tuple[str, ...],
) -> list[Value]:
    """Return the values of a steady case by dense Newton on these grids and by asperity."""
    found = oiled.limit(oiled.steady(given, grids), [1.0 / (along - 1) for along, _ in grids])
    along, across = grids[-1]
    nodes = f"{along} nodes" if across == 1 else f"{along} x {across} nodes"
    other = ways.refined("asperity", given, cells)
    return stepped(
        f"dense Newton on up to {nodes}",
        found,
        f"asperity, {cells[0]} to {cells[-1]} cells",
        other,
        *keys,
    )


def balls() -> Iterator[Stated]:
    for number, (load, speed) in enumerate(((0.7, 0.036), (1.5, 0.08), (5.0, 0.3))):
        given = {
            "kind": "ehl",
            "definition": BALL,
            "geometry": "point",
            "radius_m": 12.5e-3,
            "load_n": load,
        }
        given |= {
            "surface_speeds_m_s": [speed, speed],
            "inlet_half_widths": -3.0,
            "outlet_half_widths": 1.5,
        }
        given |= {"side_half_widths": 2.0, **STEEL, "oil": {**OIL, "eta0_pa_s": 0.04}}
        grids = [(64, 29), (91, 41), (127, 57)]
        yield (
            f"ehl-ball-{number + 1}",
            given,
            partial(_twinned, given, grids, (128, 256, 512), ("h_central_m", "h_min_m")),
        )


def with_waves(
    kind: str, definition: str, waves: list[list[float]], speeds: list[float], film: float | None
) -> dict[str, Any]:
    given = {
        "kind": kind,
        "definition": definition,
        "geometry": "line",
        "radius_m": 5.4e-3,
        "line_load_n_m": 50e3,
    }
    given |= {
        "surface_speeds_m_s": speeds,
        "inlet_half_widths": -3.0,
        "outlet_half_widths": 2.0,
        **STEEL,
    }
    given |= {"waves": waves, "oil": OIL}
    return given | ({} if film is None else {"touching_film_m": film})


SHARED = ("load_share", "p_weighted_pa", "h_mean_m")
NODES = [(251, 1), (501, 1), (1001, 1), (2001, 1)]
CELLS = (1024, 2048, 4096)


def mixed() -> Iterator[Stated]:
    for number, (length, height, speed, film) in enumerate(
        ((40e-6, 0.3e-6, 0.1, 40e-9), (60e-6, 0.5e-6, 0.1, 50e-9), (40e-6, 0.2e-6, 0.1, 80e-9))
    ):
        given = with_waves("mixed", MIXED, [[height, 1.0 / length, 0.0, 0.0]], [speed, speed], film)
        yield f"mixed-line-{number + 1}", given, partial(_twinned, given, NODES, CELLS, SHARED)


def strips() -> Iterator[Stated]:
    waves = [[0.25e-6, 1.0 / 60e-6, 0.0, 0.0], [0.25e-6, 0.0, 1.0, 0.0]]
    given = with_waves("mixed", MIXED, waves, [0.1, 0.1], 80e-9) | {"width_m": 60e-6}
    yield (
        "mixed-strip-1",
        given,
        partial(_twinned, given, [(101, 12), (151, 18), (201, 24)], (128, 256, 512), SHARED),
    )


def conserving() -> Iterator[Stated]:
    keys = ("h_central_m", "h_mean_m", "flux_m2_s")
    for number, (length, height, speed) in enumerate(
        ((40e-6, 0.2e-6, 1.0), (60e-6, 0.4e-6, 0.5), (40e-6, 0.5e-6, 0.5))
    ):
        given = with_waves(
            "conserving", CONSERVING, [[height, 1.0 / length, 0.0, 0.0]], [speed, speed], 20e-9
        )
        yield (
            f"conserving-line-{number + 1}",
            given,
            partial(_twinned, given, NODES, (384, 768, 1536), keys),
        )


def running() -> Iterator[Stated]:
    common = with_waves("moving", MOVING, [], [0.2, 0.2], None) | {"line_load_n_m": 200e3}
    common |= {"inlet_half_widths": -2.5, "outlet_half_widths": 1.5}
    for number, (share, speeds) in enumerate(
        ((1.0, [0.2, 0.2]), (2.0, [0.2, 0.2]), (1.0, [0.1, 0.3]))
    ):
        wave = [2e-8, float(f"{1.0 / (share * oiled.Stated(common).a):.10g}"), 0.0, 0.0]
        given = common | {"surface_speeds_m_s": speeds, "waves": [wave]}
        given["settles_half_widths"] = 2.5 * 0.2 / min(speeds)
        yield f"moving-line-{number + 1}", given, partial(_run, given)


def _run(given: dict[str, Any]) -> list[Value]:
    found = oiled.limit([oiled.moving(given, nodes) for nodes in (121, 241, 481)], [4.0, 2.0, 1.0])
    by = "dense Newton on up to 481 nodes, second order in time"
    other = ways.refined("asperity", given, (128, 256, 512))
    return stepped(by, found, "asperity, 128 to 512 cells", other, "amplitude_ratio", "h_mean_m")


def smooth_lines() -> Iterator[Stated]:
    for number, (law, alpha, speed, inlet, outlet) in enumerate(LINES):
        oil = {
            "eta0_pa_s": 0.096,
            "alpha_1_pa": alpha * 1e-9,
            "viscosity": law,
            "rho0_kg_m3": 880.0,
            **LAWS,
        }
        if law == "roelands":
            oil["roelands_p0_pa"] = 1.96e8
        given = {
            "kind": "ehl",
            "definition": OILED,
            "geometry": "line",
            "radius_m": 5.4e-3,
            "line_load_n_m": 50e3,
        }
        given |= {"surface_speeds_m_s": [speed, speed], "oil": oil}
        given |= {"inlet_half_widths": inlet, "outlet_half_widths": outlet, **STEEL}
        yield f"ehl-line-{number + 1}", given, partial(_smooth_line, given)


def _smooth_line(given: dict[str, Any]) -> list[Value]:
    first = ways.newton_on_nodes(given)
    second, step = ways.refined("asperity", given, (128, 256, 512))
    least = max(step[key] / first[key] for key in first) / 3.0
    return paired(
        "dense Newton on 401 and 801 nodes", first, "asperity, 128 to 512 cells", second, least
    )


LINES = [
    ("barus", 20.0, 1.91, -3.0, 1.9),
    ("barus", 20.0, 1.91, -4.5, 1.9),
    ("barus", 20.0, 1.91, -8.0, 1.9),
    ("roelands", 18.2, 2.0, -4.0, 2.0),
    ("roelands", 18.2, 2.0, -8.0, 2.5),
    ("barus", 15.0, 1.0, -4.0, 1.9),
    ("roelands", 22.0, 1.0, -8.0, 2.5),
]


def cavities() -> Iterator[Stated]:
    slider = {
        "kind": "slider",
        "definition": SLIDER,
        "viscosity_pa_s": 0.039,
        "speed_m_s": 2.285,
        "length_m": 76.2e-3,
    }
    wall = {**slider, "shape": "parabola", "least_m": 25.4e-6, "pressures_pa": [3364.14, 0.0]}
    yield "cavity-parabola", wall, partial(_parabola, wall)
    journal = {
        "kind": "slider",
        "definition": JOURNAL,
        "shape": "journal",
        "viscosity_pa_s": 0.02,
        "speed_m_s": 3.0,
    }
    journal |= {"radius_m": 25e-3, "clearance_m": 30e-6, "pressures_pa": [0.0, 0.0]}
    for eccentricity in (0.3, 0.6, 0.8):
        given = {**journal, "eccentricity": eccentricity}
        yield f"cavity-journal-{eccentricity:g}", given, partial(_journal, given)


def _parabola(wall: dict[str, Any]) -> list[Value]:
    first = ways.parabola(wall)
    second, step = ways.refined("asperity", wall, (400, 800, 1600))
    least = max(step[key] / first[key] for key in first) / 3.0
    return paired(
        "shooting on the flow, quadrature", first, "asperity, 400 to 1600 cells", second, least
    )


def _journal(given: dict[str, Any]) -> list[Value]:
    closed, twin = ways.sommerfeld(given), ways.journal(given)
    return paired("Sommerfeld, closed form", closed, "shooting on the flow, quadrature", twin)


FAMILIES = (smooth_lines, balls, mixed, strips, conserving, running, cavities)
