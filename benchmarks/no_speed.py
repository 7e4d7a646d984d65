"""Low-speed limit: the load share of lines and balls, which tends to 1, and a gear pair's Stribeck
curve.

The lines are the paper's contact; the balls have 10 mm radius, 15 N and the paper's oil. The gear
pair is an FZG type C at its pitch point, load stage 7, ground across, on 256 x 128 cells. Each
speed of the curve is solved from a cold start, and from the solution of the next higher speed.
"""

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from asperity.case import load_case
from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.ehl import solve_contact
from asperity.lubricant import Lubricant
from asperity.results import stribeck_curve
from asperity.solution import contact_state
from asperity.surface import Surface, gaussian_surface
from benchmarks.roughness_levels import paper_case

SQ_UM, CAPS_GPA = (0.5, 1.0, 2.5), (0.7, 2.0, 7.0)
SPEEDS, CELLS = (1e-2, 1e-4, 1e-6), (128, 256)
SEED, LENGTH = 7, 20e-6
CLR_TOLERANCE = 0.02  # of CLR about 1
GEARS = """
[contact]
geometry = "line"
radius = "8.38 mm"
length = "14 mm"
load = "5421 N"
entrainment_speed = "3.29 m/s"
slip = 0.2
[material]
youngs_modulus = "206 GPa"
poisson_ratio = 0.3
hardness = "7 GPa"
boundary_friction = 0.12
[lubricant]
viscosity = { law = "roelands", eta0 = "9 mPa s", alpha = "16 1/GPa" }
density = { law = "dowson-higginson", rho0 = "840 kg/m^3" }
rheology = { law = "ree-eyring", tau0 = "6 MPa" }
[surface]
kind = "ground"
sq = "0.5 um"
groove_width = "20 um"
groove_length = "150 um"
direction_deg = 90
seed = 1
[thermal]
ambient = "90 degC"
[grid]
cells = [256, 128]
x = [-4.5, 1.5]
y = [-1, 1]
"""
GEAR_SPEEDS = (1e-4, 1e-3, 0.01, 0.033, 0.067, 0.1, 0.33, 1.0, 3.29)  # m/s


def posed(
    body: str, sq_um: float, cap_gpa: float, speed: float, cells: int
) -> tuple[ContactConditions, Lubricant, Surface]:
    """Return one of the contacts, its oil and its roughness."""
    case = paper_case(sq_um, SEED, cells)
    oil, speeds = case.lubricant, (1.1 * speed, 0.9 * speed)
    assert oil is not None
    line = replace(case.conditions, hardness=1e9 * cap_gpa, surface_speeds=speeds)
    if body == "line":
        return line, oil, case.surface()
    ball = replace(line, geometry="point", radius=10e-3, length=None, load=15.0)
    a = ball.hertz.half_widths[0]
    grid = Grid((cells, cells), (-2.5 * a, -2.0 * a), (1.5 * a, 2.0 * a), periodic=(False, False))
    rng = np.random.default_rng(SEED)
    return ball, oil, gaussian_surface(grid, sq=1e-6 * sq_um, correlation_length=LENGTH, rng=rng)


def limits(*, fast: bool) -> Iterator[str]:
    """Yield a row per body, grid and speed: nine contacts of three roughnesses and three caps."""
    heads = (
        "contact | cells | speed [m/s] | solved | minimum CLR | largest | within 0.02 of 1 | median"
        " [s] | longest"
    )
    yield f"| {heads} |"
    yield "|---|---|---|---|---|---|---|---|---|"
    solve_contact(
        *posed("line", SQ_UM[0], CAPS_GPA[0], SPEEDS[0], 64), strict=False
    )  # load the compiled kernels
    for body in ("line", "ball"):
        for cells in CELLS[:1] if fast else CELLS:
            for speed in SPEEDS:
                solved, clr, seconds = 0, [], []
                for sq_um in SQ_UM:
                    for cap_gpa in CAPS_GPA:
                        conditions, oil, surface = posed(body, sq_um, cap_gpa, speed, cells)
                        began = time.process_time()
                        solution = solve_contact(conditions, oil, surface, strict=False)
                        seconds.append(time.process_time() - began)
                        solved += solution.convergence.converged
                        clr.append(contact_state(solution).clr)
                within_tolerance = sum(abs(value - 1.0) < CLR_TOLERANCE for value in clr)
                yield (
                    f"| {body} | {cells} x {cells} | {speed:g} | {solved} of {len(clr)} |"
                    f" {min(clr):.4f} | {max(clr):.4f} | {within_tolerance} of {len(clr)} |"
                    f" {np.median(seconds):.2f} | {max(seconds):.2f} |"
                )


def gears(*, fast: bool) -> Iterator[str]:
    """Yield friction and load share over speed, cold and from the next higher speed."""
    case = load_case(GEARS, name="gears")
    speeds = GEAR_SPEEDS[::4] if fast else GEAR_SPEEDS
    swept = stribeck_curve(case, speeds=speeds).points
    yield ("| speed [m/s] | film ratio | CLR cold | swept | friction cold | swept | solved |")
    yield "|---|---|---|---|---|---|---|"
    for after in swept:
        (alone,) = stribeck_curve(case, speeds=[after.entrainment_speed_m_s]).points
        yield (
            f"| {after.entrainment_speed_m_s:g} | {after.lambda_ratio:.2g} | {alone.clr:.4f} |"
            f" {after.clr:.4f} | {alone.friction_coefficient:.4f} |"
            f" {after.friction_coefficient:.4f} | {alone.converged + after.converged} of 2 |"
        )


def lines(*, fast: bool) -> Iterator[str]:
    """Yield both tables as Markdown."""
    yield "## Low-speed limit\n"
    yield (
        f"The paper's contact and a ball, Sq {', '.join(f'{sq:g}' for sq in SQ_UM)} um, caps "
        f"{', '.join(f'{cap:g}' for cap in CAPS_GPA)} GPa, one surface each, model mixed:\n"
    )
    yield from limits(fast=fast)
    yield "\nA hard gear pair, boundary friction 0.12, Sq 0.5 um ground across, 256 x 128 cells:\n"
    yield from gears(fast=fast)
