"""Notes on implausible input and results: present with their cause, absent otherwise."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from asperity.case import Case, case_template, load_case
from asperity.contact.conditions import ElasticPair
from asperity.contact.grid import Grid
from asperity.ehl import Options, film_loss, flooded_reach, least_film, solve_contact
from asperity.ehl.far_pressure import ELASTIC_SHARE
from asperity.lubricant import Barus, DowsonHigginson, Lubricant, Newtonian, Roelands
from asperity.results import solve_case
from asperity.solution import inlet_notes, plausibility_notes, solution_notes, uncertain_films
from asperity.solution.plausibility import ridge_radii
from asperity.surface import Surface, flat_surface, gaussian_surface, ground_surface
from support.paper import barus, contact, grid, rough

HARD = {"load": 20000.0, "hardness": 7e9}


def roelands(eta0, alpha):
    return Lubricant(
        viscosity=Roelands(eta0, alpha), density=DowsonHigginson(880.0), rheology=Newtonian()
    )


def test_the_papers_contact_is_plausible():
    assert plausibility_notes(contact(hardness=2e9), barus()) == ()


@pytest.mark.parametrize(
    ("conditions", "oil", "note_text"),
    [
        (contact(), barus(4e-9), "4 1/GPa is outside the usual range of oils, 5 to 40"),
        (contact(), barus(18.2e-6), "1.82e+04 1/GPa is outside the usual range of oils, 5 to 40"),
        (
            contact(pair=ElasticPair((210e6, 200e9), (0.3, 0.3))),
            barus(),
            "Body 1 has a Young's modulus of 210 MPa",
        ),
        (
            contact(pair=ElasticPair((200e9, 200e12), (0.3, 0.3))),
            barus(),
            "Body 2 has a Young's modulus of 2e+05 GPa",
        ),
        (
            contact(hardness=0.5e9),
            barus(),
            "hardness of 0.5 GPa is below the maximum Hertz pressure of 0.569 GPa",
        ),
        (contact(**HARD), barus(), "raises the viscosity by exp(65.5)"),
        (contact(), roelands(0.001, 22e-9), "Roelands' exponent z is 1.56"),
    ],
)
def test_implausible_input_is_noted(conditions, oil, note_text):
    assert any(note_text in note for note in plausibility_notes(conditions, oil))


@pytest.mark.parametrize(
    ("conditions", "oil"),
    [
        (contact(pair=ElasticPair((5e6, 70e9), (0.49, 0.22))), None),  # rubber on glass
        (contact(**HARD), roelands(0.04, 22e-9)),  # gears
    ],
)
def test_plausible_input_is_not_noted(conditions, oil):
    assert plausibility_notes(conditions, oil) == ()


def test_short_inlets_are_noted_as_starved_and_long_inlets_as_longer_than_necessary():
    a = contact().hertz.half_widths[0]
    assert (
        "is starved: the film is about 5"
        in inlet_notes(contact(), barus(), grid((256, 8), (-4.5, 1.9)))[0]
    )
    assert inlet_notes(contact(), barus(), grid((256, 8), (-12.0, 3.0))) == ()
    heavy = contact(load=50000.0, speed=0.5)
    half_width = heavy.hertz.half_widths[0]
    long, ample = (
        Grid((256, 8), (inlet * half_width, -a), (1.9 * half_width, a)) for inlet in (-4.5, -1.6)
    )
    (note_text,) = inlet_notes(heavy, roelands(0.04, 22e-9), long)
    assert "is longer than necessary (m* = 1.1): starting grid.x at -1.6" in note_text
    assert inlet_notes(heavy, roelands(0.04, 22e-9), ample) == ()


def test_contact_at_a_grid_edge_is_noted():
    rough = {"sq": 1e-6, "correlation_length": 20e-6, "rng": np.random.default_rng(1)}
    soft = contact(hardness=0.36e9)  # cannot carry the load within 1.24 half-widths
    small = gaussian_surface(grid((64, 32), (-4.0, 1.3)), **rough)
    assert any(
        "reaches the outlet edge of" in note
        for note in solution_notes(solve_contact(soft, None, small))
    )
    wide_domain = gaussian_surface(grid((128, 32), (-5.0, 5.0)), **rough)
    assert not any(
        "reaches the" in note for note in solution_notes(solve_contact(soft, None, wide_domain))
    )


def test_excessive_pressures_and_unresolved_heights_are_noted():
    small = grid((64, 32), (-2.0, 1.3))
    steep = gaussian_surface(small, sq=3e-6, correlation_length=20e-6, rng=np.random.default_rng(1))
    assert any(
        "exceeds a twentieth of E' = 219.8 GPa" in n
        for n in solution_notes(solve_contact(contact(), None, steep))
    )
    noise = Surface(1e-9 * np.random.default_rng(1).standard_normal(small.cells), small)
    (note_text,) = solution_notes(solve_contact(contact(), None, noise))
    assert "cells along the correlation length in x, where 4 are needed" in note_text


def test_a_film_outside_the_range_of_its_fits_is_noted_with_the_reason():
    smooth = Surface(np.zeros((64, 8)), grid((64, 8), (-1.3, 1.9)))
    oil = Lubricant(
        viscosity=Barus(0.096, 18.2e-9), density=DowsonHigginson(880.0), rheology=Newtonian()
    )
    starved = solve_contact(contact(), oil, smooth, options=Options())
    assert any(
        "nearest fit" in note and "the inlet is starved" in note for note in solution_notes(starved)
    )
    flooded = replace(smooth, grid=grid((256, 8), (-12.0, 2.0)), heights=np.zeros((256, 8)))
    assert solution_notes(solve_contact(contact(), oil, flooded)) == ()


def test_unloaded_asperities_at_a_small_film_ratio_are_noted():
    """The paper's contact at Sq 2.5 um: film ratio 0.25, nine tenths on asperities; no note."""
    solved = solve_contact(contact(hardness=2e9), barus(), rough(grid((48, 32)), 2.5e-6))
    assert not any("film ratio" in note for note in solution_notes(solved))
    unloaded = replace(solved, in_contact=np.zeros_like(solved.in_contact))
    assert any(
        "film ratio of 0.2" in note and "contact.roughness = running" in note
        for note in solution_notes(unloaded)
    )
    smooth = replace(unloaded, surface=flat_surface(solved.grid))
    assert not any("film ratio" in note for note in solution_notes(smooth))


def test_sharp_ridges_are_noted():
    """Crossing grooves form edges; crests of a Gaussian surface have a radius on any grid."""
    conditions, domain = contact(speed=0.02), grid((96, 64))
    ground = ground_surface(
        domain,
        sq=0.5e-6,
        groove_width=40e-6,
        groove_length=80e-6,
        direction=np.pi / 2,
        rng=np.random.default_rng(1),
    )
    gaussian = gaussian_surface(
        domain, sq=0.5e-6, correlation_length=20e-6, rng=np.random.default_rng(1)
    )
    on_ground, on_gaussian = (
        solve_contact(conditions, barus(), surface) for surface in (ground, gaussian)
    )
    (note_text,) = (note for note in solution_notes(on_ground) if "are sharp edges" in note)
    assert "on cells twice as wide" in note_text
    assert not any("are sharp edges" in note for note in solution_notes(on_gaussian))
    dry = solve_contact(conditions, None, ground)
    assert not any("are sharp edges" in note for note in solution_notes(dry))


@pytest.mark.parametrize(
    ("shape", "ratio"), [(lambda t: t**2, 1.0), (lambda t: np.abs(t) * 1e-5, 2.0)]
)
def test_ridge_radii_of_a_parabola_and_of_an_edge(shape, ratio):
    """Ten crests of radius 1/2 m along x; for edges the radius doubles with the cell width."""
    domain = grid((240, 16))
    from_crest = (np.arange(240) % 24 - 12) * domain.spacing[0]
    surface = Surface(np.repeat(-shape(from_crest)[:, None], 16, axis=1), domain)
    loaded = replace(solve_contact(contact(), None, flat_surface(domain)), surface=surface)
    all_touching = replace(loaded, in_contact=np.ones(domain.cells, dtype=bool))
    fine, coarse = ridge_radii(all_touching)
    assert coarse / fine == pytest.approx(ratio)
    assert fine == pytest.approx(0.5 if ratio == 1.0 else domain.spacing[0] / 2e-5)
    assert ridge_radii(replace(all_touching, in_contact=np.zeros(domain.cells, dtype=bool))) is None


@pytest.mark.parametrize(("bar", "films"), [(0.14, ()), (0.3, ("minimum film thickness ± 30 %",))])
def test_a_film_with_a_wide_error_bar_is_not_determined(bar, films):
    numbers = {"h_min_m": 1e-7, "h_min_error_m": bar * 1e-7}
    assert uncertain_films({**numbers, "h_central_m": 2e-7, "h_central_error_m": 2e-8}) == films
    unknown = {"h_central_m": 2e-7, "h_central_error_m": None}
    assert uncertain_films({**numbers, **unknown}) == films


LIGHT_BALL = {
    "contact.radius": "15 mm",
    "contact.load": "0.765 N",
    "contact.entrainment_speed": "1.57 m/s",
    "contact.slip": 0.0,
    "material.youngs_modulus": "210 GPa",
    "material.hardness": "none",
    "lubricant.viscosity": {"law": "barus", "eta0": "50 cP", "alpha": "22 1/GPa"},
    "lubricant.density": {"law": "incompressible", "rho0": "870 kg/m^3"},
    "lubricant.rheology": "newtonian",
    "surface": "flat",
    "vibration": "none",
}


def light_ball(load: str, **overrides: object) -> Case:
    return load_case(case_template("point")).with_overrides(
        {**LIGHT_BALL, "contact.load": load, **overrides}
    )


@pytest.mark.parametrize(("load", "beyond"), [("0.765 N", "6.5 %"), ("1.5 N", "3.3 %")])
def test_the_film_of_a_light_ball_is_that_of_its_closed_form(load, beyond):
    """Brewe, Hamrock and Taylor (1979); elasticity adds about 2 % at 1.5 N."""
    case = light_ball(load)
    run = solve_case(case)
    assert run.state.h_min == pytest.approx(least_film(case.conditions, case.lubricant), rel=0.05)
    assert run.film_determined
    assert [note for note in run.notes if "paraboloid" in note or "inlet" in note] == [
        "The body counts as an endless paraboloid, as in film formulas: about "
        f"{beyond} of the film is due to pressure beyond its radius, where a real body ends."
    ]


def test_a_light_balls_grid_spans_the_pressure_that_carries_it():
    """At 3 N, between the regimes, a grid twice as long changes the film by 1 %."""
    case = light_ball("3 N")
    half_width = case.conditions.hertz.half_widths[0]
    assert case.grid.upper[1] > 50.0 * half_width
    film = solve_case(case).state.h_min
    for reach, ratio in ((-15.0, 0.93), (-100.0, 1.012)):
        grid = {
            "x": [reach, 8.0],
            "y": [reach, -reach],
            "cells": [-int(reach) * 5 + 40, -int(reach) * 10],
        }
        other = solve_case(light_ball("3 N", grid=grid), strict=False)
        assert other.state.h_min / film == pytest.approx(ratio, abs=0.02)


def test_a_film_that_the_body_is_too_small_for_is_not_determined():
    run = solve_case(light_ball("0.1 N"))
    assert run.film_determined is False
    assert (
        "film not determined (the pressure of so light a contact reaches beyond the body)"
        in run.verdict()
    )
    assert len([note for note in run.notes if "paraboloid" in note or "inlet" in note]) == 1


def test_the_film_of_a_light_ball_is_not_determined_on_a_small_grid():
    """Its load converges only as the inverse of the grid's size."""
    case = light_ball("0.765 N", grid={"x": [-30.0, 10.0], "y": [-30.0, 30.0], "cells": [224, 304]})
    run = solve_case(case)
    formula, loss = (
        function(case.conditions, case.lubricant, *more)
        for function, more in ((least_film, ()), (film_loss, (case.grid,)))
    )
    assert 0.4 < run.state.h_min / formula < 0.55
    assert loss == pytest.approx(0.6, abs=0.05)
    assert run.film_determined is False
    assert "film not determined (the grid is too small for so light a contact)" in run.verdict()
    notes = [note for note in run.notes if "inlet" in note]
    assert "starved: the film is about 60 % too thin" in notes[0]
    needed = (
        flooded_reach(case.conditions, case.lubricant)[0] / case.conditions.hertz.half_widths[0]
    )
    assert f"start grid.x at -{needed:.3g} and grid.y at -{needed:.3g}" in notes[0]
    assert [note.endswith("the inlet is starved.") for note in notes[1:]] == [True]


def test_the_load_of_a_rigid_ball_within_a_grid_is_the_integral_of_its_pressure():
    case = light_ball("0.765 N")
    film = least_film(case.conditions, case.lubricant)
    length = np.sqrt(2.0 * 15e-3 * film)

    def pressure(s):
        return s**2 / (1.0 + s**2) ** 2

    whole = scipy.integrate.quad(pressure, 0.0, np.inf)[0]
    for reach in (0.5, 3.0, 40.0):
        within = Grid((16, 16), (-reach * length,) * 2, (reach * length,) * 2, (False, False))
        share = scipy.integrate.quad(pressure, 0.0, reach)[0] / whole
        loss = film_loss(case.conditions, case.lubricant, within)
        assert loss == pytest.approx(1.0 - share**2, rel=1e-6)


@pytest.mark.parametrize("ratio", [1.0, 4.0])
def test_far_pressure_carries_the_load_beyond_a_grid(ratio):
    """Kapitza's pressure of paraboloids, integrated over the inlet half beyond an ellipse."""
    case = light_ball("10 N")
    first, second, reach = 15e-3, 15e-3 * ratio, 5e-3
    conditions = replace(case.conditions, geometry="elliptic", radius=(first, second))
    pressure = 12.0 * 0.05 * 1.57 / (3.0 + 2.0 / ratio)

    def at(angle: float, distance: float) -> float:
        x, y = distance * np.cos(angle), distance * np.sqrt(ratio) * np.sin(angle)
        gap = x**2 / (2.0 * first) + y**2 / (2.0 * second)
        return pressure * x / gap**2 * distance * np.sqrt(ratio)

    load = scipy.integrate.dblquad(at, reach, np.inf, -np.pi / 2.0, np.pi / 2.0)[0]
    share = ELASTIC_SHARE * flooded_reach(conditions, case.lubricant)[0] / reach
    assert share * conditions.load == pytest.approx(load, rel=1e-6)


def test_a_rough_light_ball_keeps_the_grid_of_its_roughness():
    rough = {"kind": "gaussian", "sq": "0.1 um", "correlation_length": "60 um"}
    case = light_ball("0.765 N", surface=rough)
    (note,) = [note for note in case.notes if "too thin" in note]
    assert "reaches beyond the grid of its roughness" in note
    assert "grid.x" not in note


def test_a_light_film_without_an_error_bar_is_not_determined():
    case = light_ball("0.765 N", model="conserving")
    run = solve_case(case, strict=False)
    assert run.film_determined is False
    assert "no coarser grid to compare with" in run.verdict()
