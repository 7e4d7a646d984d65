"""Capacitance, contact resistance and ultrasonic reflection of solved contacts."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ellipk

import asperity as asp
from asperity.case import load_case
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.core.errors import BadInput
from asperity.ehl import Options, hertz_zone, solve_contact
from asperity.lubricant import Incompressible
from asperity.solution import Sensing, observables
from asperity.surface import flat_surface
from support.laplace import capacitance

EXAMPLES = Path(__file__).parents[2] / "examples"
VACUUM = 8.8541878128e-12
PAIR = ElasticPair((206e9, 206e9), (0.3, 0.3))


@pytest.fixture(scope="module")
def rough():
    """Snapshot of the paper's contact with a thick film, no cells touching."""
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {
            "contact.roughness": "standing",
            "surface.sq": "0.5 um",
            "contact.entrainment_speed": "8 m/s",
            "vibration": "none",
        }
    )
    return asp.solve_case(case, surfaces=1).solution


def incompressible(solution):
    return replace(solution.lubricant, density=Incompressible(870.0))


def dry_contact(geometry="point", radius=0.01, load=50.0, **settings):
    conditions = ContactConditions(
        pair=PAIR,
        geometry=geometry,
        radius=radius,
        load=load,
        surface_speeds=(0.0, 0.0),
        **settings,
    )
    a, b = conditions.hertz.half_widths
    across = 2.0 * a if conditions.endless else 1.5 * b
    cells = (192, 8) if conditions.endless else (192, 192)
    grid = Grid(cells, (-1.5 * a, -across), (1.5 * a, across), periodic=(False, conditions.endless))
    return solve_contact(conditions, None, flat_surface(grid), options=Options(tolerance=1e-6))


def test_plates_between_rough_surfaces_agree_with_laplace(rough):
    """Field lines across a rough film: 1 % of the solution of Laplace's equation."""
    assert not rough.in_contact.any()
    gap = rough.gap[165:205, 100:140]  # in the Hertz zone
    assert gap.std() > 0.1 * gap.mean()
    exact = [capacitance(gap, rough.grid.spacing, layers) for layers in (2, 4)]
    (coarse, plates), (fine, _) = exact
    extrapolated = fine + (fine - coarse) / 3.0
    assert extrapolated == pytest.approx(fine, rel=2e-3)
    assert plates == pytest.approx(extrapolated, rel=0.01)


def test_laplace_of_parallel_and_wedge_shaped_gaps():
    """Closed forms: A/h, and ln(h2/h1)/angle of a wedge with both faces in cylinder coordinates."""
    flat, plates = capacitance(np.full((5, 6), 2.0), (1.0, 0.5), 3)
    assert flat == pytest.approx(plates, rel=1e-12)
    assert plates == pytest.approx(4.0 * 2.5 / 2.0, rel=1e-12)
    x = np.linspace(1.0, 2.0, 81)
    wedge, _ = capacitance(np.repeat(x[:, None], 3, axis=1) * math.tan(0.3), (1.0 / 80.0, 0.5), 20)
    # sides of the mesh are straight, so that its ends differ from arcs by a per cent of the length
    assert wedge == pytest.approx(math.log(2.0) / 0.3, rel=0.02)


def test_capacitance_of_the_zone_is_that_of_its_films(rough):
    sensing = Sensing(permittivity=2.0)
    zone, area = hertz_zone(rough.conditions, rough.grid), math.prod(rough.grid.spacing)
    length = rough.conditions.length / (rough.grid.cells[1] * rough.grid.spacing[1])
    ratio = rough.lubricant.density(rough.pressure) / rough.lubricant.density.rho0
    mossotti = 0.25 * ratio  # (2 - 1)/(2 + 2)
    oil = (1.0 + 2.0 * mossotti) / (1.0 - mossotti)
    expected = VACUUM * (oil / rough.gap)[zone & ~rough.cavitated].sum() * area * length
    found = observables(rough, sensing)
    assert found.zone_capacitance == pytest.approx(expected, rel=0.02, abs=0.0)
    assert found.capacitance > found.zone_capacitance
    warm = observables(rough, sensing, film_rise=30.0)
    assert 0.97 < warm.zone_capacitance / found.zone_capacitance < 0.995


def test_touching_cells_conduct_and_have_no_capacitance(rough):
    touching = np.zeros_like(rough.in_contact)
    touching[180:184, 120:124] = True
    changed = replace(rough, in_contact=touching)
    before, after = observables(rough), observables(changed)
    assert before.contact_resistance is None
    assert after.contact_resistance > 0.0
    springs = 1.0 / rough.gap[hertz_zone(rough.conditions, rough.grid)]
    lost = 1.0 - after.zone_capacitance / before.zone_capacitance
    assert lost == pytest.approx((1.0 / rough.gap[touching]).sum() / springs.sum(), rel=0.1)


def test_capacitance_does_not_depend_on_the_size_of_the_grid():
    """The part around the grid replaces that on it."""
    text = (EXAMPLES / "ball-on-disc.toml").read_text("utf-8")
    base = {"surface": "flat", "vibration": "none"}
    found = []
    for reach, cells in ((2.5, 128), (5.0, 256)):
        ends = [-reach, reach]
        changed = {**base, "grid.cells": [cells, cells], "grid.x": ends, "grid.y": ends}
        case = load_case(text).with_overrides(changed)
        found.append(
            observables(asp.solve_case(case, surfaces=1).solution, Sensing(permittivity=1.0))
        )
    assert found[0].capacitance == pytest.approx(found[1].capacitance, rel=0.01, abs=0.0)


@pytest.mark.parametrize(
    ("ratio", "ends"), [(37.5, (1.5, 1.6)), (15.0, (1.5, 3.0)), (1.0, (1.2, 8.0))]
)
def test_capacitance_is_positive_around_any_grid(ratio, ends):
    """Edges near an elongated contact, where the parabola is lower than on the far ones."""
    right, across = ends
    case = load_case(EXAMPLES / "ball-on-disc.toml").with_overrides(
        {
            "surface": "flat",
            "vibration": "none",
            "contact.geometry": "elliptic",
            "contact.radius": ["4 mm", f"{4.0 * ratio} mm"],
            "contact.load": "15 N",
            "contact.entrainment_speed": "0.5 m/s",
            "grid.cells": [96, 96],
            "grid.x": [-4.5, right],
            "grid.y": [-across, across],
        }
    )
    seen = asp.solve_case(case, surfaces=1).observables
    assert seen.capacitance > seen.zone_capacitance > 0.0


def test_capacitance_of_dry_contact_is_limited_by_the_contact_film():
    found = []
    for cells in (96, 112, 160):
        case = load_case(EXAMPLES / "ball-on-disc.toml").with_overrides(
            {"lubricant": "none", "surface": "flat", "vibration": "none", "grid.cells": [cells] * 2}
        )
        found.append(asp.solve_case(case, surfaces=1).observables.capacitance)
    assert max(found) < 1.3 * min(found)


def test_a_rigid_ball_over_a_plane_has_the_capacitance_of_its_plates():
    solution = dry_contact(load=1e-4)
    radius, shift = 0.01, 1e-6
    far = replace(
        solution,
        gap=solution.gap + shift,
        in_contact=np.zeros_like(solution.in_contact),
        pressure=np.zeros_like(solution.pressure),
    )
    # ∫ 2πr dr/(c + R - √(R² - r²)) from 0 to R
    c = shift
    exact = 2.0 * math.pi * ((radius + c) * math.log((radius + c) / c) - radius)
    assert observables(far).capacitance / VACUUM == pytest.approx(exact, rel=0.01)


def test_a_rigid_cylinder_over_a_plane_has_the_capacitance_of_its_plates():
    """L ∫ dx/(c + x²/2R) from -R to R."""
    solution = dry_contact("line", load=4000.0, length=0.01)
    radius, c = 0.01, 1e-6
    gap = c + np.repeat(solution.grid.x[:, None] ** 2 / (2.0 * radius), 8, axis=1)
    far = replace(solution, gap=gap, in_contact=np.zeros_like(solution.in_contact))
    exact = 2.0 * 0.01 * math.sqrt(2.0 * radius / c) * math.atan(math.sqrt(radius / (2.0 * c)))
    assert observables(far).capacitance / VACUUM == pytest.approx(exact, rel=2e-3)


def test_oil_behind_the_end_of_the_film_keeps_its_thickness(rough):
    """Streamers of a film of thickness 1 in gaps of 2 and 4 fill a half and a quarter of them."""
    gap, pressure = np.full_like(rough.gap, 1e-6), np.full_like(rough.pressure, 1e5)
    places = [180, 190]
    gap[places] = [[2e-6], [4e-6]]
    pressure[places] = 0.0
    film = replace(rough, gap=gap, pressure=pressure, lubricant=incompressible(rough))
    full = replace(film, pressure=np.full_like(pressure, 1e5))
    lost = [observables(found, Sensing(permittivity=3.0)) for found in (full, film)]
    length = rough.conditions.length / (rough.grid.cells[1] * rough.grid.spacing[1])
    row = rough.grid.cells[1] * math.prod(rough.grid.spacing) * length
    expected = VACUUM * row * ((3.0 - 2.0) / 2e-6 + (3.0 - 1.5) / 4e-6)
    change = lost[0].zone_capacitance - lost[1].zone_capacitance
    assert change == pytest.approx(expected, rel=1e-6, abs=0.0)


def test_constriction_of_a_round_and_an_elliptic_spot():
    """(ρ₁ + ρ₂)/4a of a disc, and (ρ₁ + ρ₂) K(e)/2πa of an ellipse (Holm)."""
    sensing = Sensing(resistivity=(2e-7, 6e-7))
    ball = dry_contact()
    a = ball.conditions.hertz.half_widths[0]
    found = observables(ball, sensing).contact_resistance
    assert found == pytest.approx(8e-7 / (4.0 * a), rel=0.01)
    ellipse = dry_contact("elliptic", radius=(0.01, 0.03))
    short, long = ellipse.conditions.hertz.half_widths
    expected = 8e-7 * ellipk(1.0 - (short / long) ** 2) / (2.0 * math.pi * long)
    assert observables(ellipse, sensing).contact_resistance == pytest.approx(expected, rel=0.01)
    film = replace(sensing, film_resistivity=1e-9)
    area = ball.in_contact.sum() * math.prod(ball.grid.spacing)
    assert observables(ball, film).contact_resistance == pytest.approx(
        found + 1e-9 / area, rel=1e-9
    )


def test_constriction_of_two_cylinders():
    """Current that spreads in a half-plane: the resistance grows by (ρ₁ + ρ₂) ln(a₁/a₂)/πL."""
    sensing = Sensing(resistivity=(1e-6, 1e-6))
    wide, narrow = (dry_contact("line", load=load, length=0.01) for load in (4000.0, 1000.0))
    resistance = [observables(solution, sensing).contact_resistance for solution in (narrow, wide)]
    assert resistance[0] - resistance[1] == pytest.approx(
        2e-6 * math.log(2.0) / (math.pi * 0.01), rel=0.02
    )


def test_two_distant_spots_conduct_in_parallel():
    ball = dry_contact()
    spots = np.zeros_like(ball.in_contact)
    spots[20:26, 20:26] = spots[160:166, 160:166] = True
    single = np.zeros_like(spots)
    single[20:26, 20:26] = True
    ball = replace(ball, gap=np.full_like(ball.gap, 1e-6), pressure=np.ones_like(ball.pressure))
    resistance = [
        observables(replace(ball, in_contact=cells)).contact_resistance for cells in (single, spots)
    ]
    distance = math.dist((20, 20), (160, 160)) * ball.grid.spacing[0]
    mutual = sum(Sensing().resistivity) / (2.0 * math.pi * distance)
    assert resistance[1] == pytest.approx(0.5 * (resistance[0] + mutual), rel=5e-3)


def test_a_film_reflects_as_a_spring(rough):
    """1/√(1 + (2K/ωz)²) between equal bodies, K = B/h."""
    film, pressure = 2e-7, 0.4e9
    even = replace(
        rough,
        gap=np.full_like(rough.gap, film),
        pressure=np.full_like(rough.pressure, pressure),
        in_contact=np.zeros_like(rough.in_contact),
    )
    law = rough.lubricant.density
    modulus = float(law(np.array(pressure)) / law.slope(np.array(pressure)))
    seen = observables(even)
    assert seen.interface_stiffness == pytest.approx(modulus / film, rel=1e-3)
    (impedance, _) = seen.impedances
    conditions = rough.conditions.pair
    e, nu = conditions.youngs_moduli[0], conditions.poisson_ratios[0]
    speed = math.sqrt(e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu) * 7800.0))
    assert impedance == pytest.approx(7800.0 * speed, rel=1e-12)
    for frequency_hz in (1e6, 10e6, 100e6):
        ratio = 2.0 * modulus / film / (2.0 * math.pi * frequency_hz * impedance)
        assert float(seen.reflection(frequency_hz)) == pytest.approx(
            1.0 / math.hypot(1.0, ratio), rel=1e-3
        )
    assert seen.ultrasonic_reflection == pytest.approx(float(seen.reflection(10e6)))


def test_the_thinnest_film_is_as_stiff_as_contact():
    """Cells whose film closes to contact change the interface by a per cent only."""
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {"contact.roughness": "standing", "grid.cells": [96, 96], "vibration": "none"}
    )
    solution = asp.solve_case(case, surfaces=1).solution
    assert solution.in_contact.any()
    film = replace(solution, in_contact=np.zeros_like(solution.in_contact))
    stiffness = [observables(found).interface_stiffness for found in (solution, film)]
    assert stiffness[1] == pytest.approx(stiffness[0], rel=0.05)


def test_incompressible_oil_has_no_reflection(rough):
    seen = observables(replace(rough, lubricant=incompressible(rough)))
    assert seen.interface_stiffness is seen.ultrasonic_reflection is None
    with pytest.raises(BadInput, match="incompressible oil has no ultrasonic reflection"):
        seen.reflection(1e6)


def test_a_soft_body_reflects_everything():
    """A Poisson's ratio of 0.5 has an infinite modulus of longitudinal waves."""
    seen = replace(observables(dry_contact()), impedances=(math.inf, 46e6))
    assert seen.ultrasonic_reflection == pytest.approx(1.0)


def test_reflection_at_the_ends_of_its_range(rough):
    seen = replace(observables(rough), impedances=(46e6, 17e6))
    stiff, soft = (replace(seen, interface_stiffness=k) for k in (1e25, 1.0))
    assert float(stiff.reflection(10e6)) == pytest.approx(29.0 / 63.0, rel=1e-6)
    assert float(soft.reflection(10e6)) == pytest.approx(1.0, rel=1e-6)
    frequencies = np.geomspace(1e4, 1e12, 50)
    assert np.all(np.diff(seen.reflection(frequencies)) >= 0.0)


def test_asperities_stiffen_the_interface_until_the_zone_touches():
    ball = dry_contact()
    assert observables(ball).interface_stiffness > 1e17  # touches all over the Hertz zone
    assert observables(ball).ultrasonic_reflection < 0.01
    free = np.zeros_like(ball.in_contact)
    open_gap = replace(ball, gap=np.full_like(ball.gap, 1e-6), in_contact=free)
    assert observables(open_gap).ultrasonic_reflection == 1.0
    stiffness = []
    apart = replace(ball, gap=np.full_like(ball.gap, 1e-6))
    for step in (16, 8, 4):
        spots = np.zeros_like(ball.in_contact)
        spots[::step, ::step] = True
        seen = observables(replace(apart, in_contact=spots & ball.in_contact))
        stiffness.append(seen.interface_stiffness)
    assert stiffness == sorted(stiffness)


def test_capacitance_rises_where_the_load_share_does_not():
    """From a lambda ratio of 3.1 to 1.1 threefold, without asperity contact."""
    case = load_case(EXAMPLES / "paper.toml").with_overrides(
        {"contact.roughness": "standing", "surface.sq": "0.25 um", "vibration": "none"}
    )
    thick, thin = (
        asp.solve_case(case.with_overrides({"contact.entrainment_speed": speed}), surfaces=1)
        for speed in ("2.6 m/s", "0.55 m/s")
    )
    assert (thick.state.lambda_ratio, thin.state.lambda_ratio) == pytest.approx((3.0, 1.0), rel=0.1)
    assert (thick.state.clr, thin.state.clr) == (0.0, 0.0)
    before, after = (run.observables.zone_capacitance for run in (thick, thin))
    assert after / before == pytest.approx(2.9, rel=0.1)


def test_insulated_spots_add_their_capacitance(rough):
    touching = np.zeros_like(rough.in_contact)
    touching[180:184, 120:124] = True
    changed = replace(rough, in_contact=touching, gap=np.where(touching, 5e-9, rough.gap))
    bare, insulated = (
        observables(changed, Sensing(boundary_film=film)).zone_capacitance for film in (None, 5e-9)
    )
    length = rough.conditions.length / (rough.grid.cells[1] * rough.grid.spacing[1])
    area = 16.0 * math.prod(rough.grid.spacing) * length
    ratio = rough.lubricant.density(rough.pressure[touching]) / rough.lubricant.density.rho0
    mossotti = 1.2 / 4.2 * ratio
    oil = ((1.0 + 2.0 * mossotti) / (1.0 - mossotti)).mean()
    assert observables(changed, Sensing(boundary_film=5e-9)).contact_resistance is None
    assert insulated - bare == pytest.approx(VACUUM * oil * area / 5e-9, rel=1e-9, abs=0.0)
