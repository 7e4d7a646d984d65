"""Which of oil and asperities bears a cell, its film, and how far it may step: loops against slow
twins.
"""

import numpy as np
import pytest

from asperity.kernels import load_sharing, reynolds, step_limits
from asperity.kernels.load_sharing import FREE, CellState, ContactBounds
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film, Liquid

CELLS, DX, DY = (30, 20), 0.13, 0.21
BOUNDS = ContactBounds(contact_gap=0.1, contact_scale=3.0, closed_gap=0.101, p_cap=0.9)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture
def cells(rng):
    """Gaps around the contact film, some of them just on it; pressures from nothing to beyond the
    cap.
    """
    oil, total = rng.uniform(0.0, 1.0, (2, *CELLS))
    gap = rng.uniform(-0.6, 0.5, CELLS)
    gap[rng.random(CELLS) < 0.3] = 0.1
    signed = np.where(rng.random(CELLS) < 0.2, -oil, oil)
    return CellState(
        signed,
        oil,
        np.maximum(total, 0.7 * oil),
        gap,
        rng.standard_normal(CELLS),
        0.1 + rng.random(CELLS),
    )


def twin(cells, freed):
    """The same in NumPy: what lifts, what decides, what is left, what is sunk and what is shut."""
    touching = (cells.gap - BOUNDS.contact_gap) * BOUNDS.contact_scale
    borne = cells.total - cells.oil
    free, yields = borne < touching, cells.total - touching > BOUNDS.p_cap
    lifts = ~free, ~yields, cells.outflow + borne * cells.own_outflow < 0.0, cells.signed >= 0.0
    for alone in range(len(lifts)):  # each of them decides somewhere
        assert (
            ~lifts[alone]
            & np.all([lifts[other] for other in range(len(lifts)) if other != alone], axis=0)
        ).any()
    lifted = np.all(lifts, axis=0)
    free = free | (lifted & (borne <= 0.0)) | freed
    residual = np.where(free, borne, touching)
    solid = np.where(free, FREE, TOUCHING)
    capped = cells.total - BOUNDS.p_cap > residual
    residual, solid = (
        np.where(capped, cells.total - BOUNDS.p_cap, residual),
        np.where(capped, CAPPED, solid),
    )
    sunk = (solid == FREE) & (touching < 0.0) & ~yields
    closed = (solid != FREE) & (cells.gap <= BOUNDS.closed_gap)
    return lifted, borne, solid, residual, sunk, closed, closed | ((touching <= 0.0) & ~sunk)


def test_each_cell_is_decided_as_its_twin_says(rng, cells):
    freed = rng.random(CELLS) < 0.1
    lifted, borne, solid, residual, sunk, closed, shut = twin(cells, freed)
    marks, codes, left = (
        np.empty((3, *CELLS), dtype=bool),
        np.empty(CELLS, np.int8),
        np.empty(CELLS),
    )
    assert load_sharing.mark_opening(cells, BOUNDS, marks[0]) == bool(
        np.any(lifted & (borne > 0.0))
    )
    assert np.array_equal(marks[0], lifted)
    assert lifted.any()
    assert load_sharing.fill_contact_rows(
        cells, BOUNDS, lifted, freed, codes, left, marks[1]
    ) == bool(sunk.any())
    assert np.array_equal(codes, solid)
    np.testing.assert_allclose(left, residual, rtol=1e-14, atol=1e-14)
    assert np.array_equal(marks[1], sunk)
    assert {FREE, TOUCHING, CAPPED} == set(codes.ravel().tolist())
    scale = fresh = rng.random(CELLS)
    fresh = scale.copy()
    load_sharing.mark_sealed(cells, BOUNDS, codes, sunk, scale, marks[2])
    assert np.array_equal(marks[2], shut)
    np.testing.assert_allclose(scale, np.where(closed, 1.0 / cells.own_outflow, fresh), rtol=1e-14)


def test_what_is_left_of_the_oils_equations(rng, cells):
    """max(min(q, R/J), q - P_cap), and which of the three it is."""
    scale, left, state = rng.random(CELLS), np.empty(CELLS), np.empty(CELLS, np.int8)
    load_sharing.fill_oil_rows(cells, BOUNDS, scale, left, state)
    balanced, oil = cells.outflow * scale, cells.oil
    expected = np.maximum(np.minimum(oil, balanced), oil - BOUNDS.p_cap)
    np.testing.assert_allclose(left, expected, rtol=1e-14)
    full = oil - BOUNDS.p_cap > np.minimum(oil, balanced)
    assert np.array_equal(
        state, np.where(full, CAPPED, np.where(balanced < oil, LUBRICATED, RUPTURED))
    )


def test_oil_fills_a_flattened_streak_down_the_stream():
    solid = np.full((6, 2), CAPPED, np.int8)
    solid[4, 0] = TOUCHING  # ends the first streak
    state = np.full((6, 2), RUPTURED, np.int8)
    state[1] = LUBRICATED
    residual, outflow, scale = np.full((6, 2), -1.0), np.full((6, 2), -2.0), np.full((6, 2), 0.5)
    residual[1, 1] = 1.0  # hands on nothing
    gap, rim = np.full((6, 2), 0.1), np.zeros(2, dtype=bool)
    load_sharing.extend_lubrication(gap, 0.101, solid, rim, (outflow, scale), state, residual)
    assert np.flatnonzero(state[:, 0] == LUBRICATED).tolist() == [1, 2, 3]
    assert np.flatnonzero(state[:, 1] == LUBRICATED).tolist() == [1]
    assert (residual[2:4, 0] == -1.0).all()


def test_own_outflow_is_the_derivative_with_the_film_held(rng):
    film = Film(
        *(0.1 + rng.random(CELLS) for _ in range(6)),
        *(0.1 + rng.random((2, CELLS[1])) for _ in range(2)),
    )
    faces = Faces(*np.empty((6, *CELLS)), np.empty(CELLS[1]), np.zeros(2))
    reynolds.face_mobilities(film, film.mobility, False, np.zeros(CELLS[1], dtype=bool), faces)
    found, pressure, step = np.empty(CELLS), rng.random(CELLS), 0.5
    load_sharing.outflow_by_pressure(film, faces, 2.5, DX, DY, found)
    before, after = np.empty((2, *CELLS))
    reynolds.net_outflow(pressure, film.content, faces, film.content[0], DX, DY, before)
    for cell in np.ndindex(CELLS):
        moved = pressure.copy()
        moved[cell] += step
        reynolds.net_outflow(moved, film.content, faces, film.content[0], DX, DY, after)
        through = (after - before)[cell] / step
        assert found[cell] == pytest.approx(
            through + 2.5 * film.content_by_pressure[cell], rel=1e-9
        )


def test_the_lean_and_its_slopes(rng):
    content, gap = 0.1 + rng.random(CELLS), rng.uniform(0.05, 0.3, CELLS)
    upstream = np.concatenate([content[:1], content[:-1]])
    found, own, back = np.empty((3, *CELLS))
    load_sharing.limiter(content, upstream, gap, 0.1, 0.05, found)
    opened = np.clip((gap - 0.1) / 0.05, 0.0, 1.0)
    expected = upstream * content / (upstream**2 + content**2) * opened
    expected[1:] *= opened[:-1]
    expected[0] = 0.0
    np.testing.assert_allclose(found, expected, rtol=1e-13)

    def limited(here, before):
        return (
            expected
            / (upstream * content / (upstream**2 + content**2))
            * (before * here / (before**2 + here**2) * (here - before))
        )

    load_sharing.limiter_slopes(found, content, upstream, own, back)
    step = 1e-30j
    np.testing.assert_allclose(
        own, limited(content + step, upstream).imag / 1e-30, rtol=1e-10, atol=1e-12
    )
    np.testing.assert_allclose(
        back, -limited(content, upstream + step).imag / 1e-30, rtol=1e-10, atol=1e-12
    )


def test_a_film_is_what_its_oil_makes_it(rng):
    """No cell moves its oil less easily than the least, whose slopes are nothing."""
    liquid, height, least = Liquid(*(0.2 + rng.random((6, *CELLS)))), 0.2 + rng.random(CELLS), 0.05
    film = Film(*np.empty((6, *CELLS)), *np.ones((2, 2, CELLS[1])))
    reynolds.fill_film(liquid, height, 1.7, least, film)
    mobility = 1.7 * liquid.density * height**3 / (liquid.viscosity * liquid.thinning)
    stiff = mobility < least / height**3
    assert 0 < stiff.sum() < stiff.size
    by_pressure = liquid.density_slope / liquid.density - (1.0 + liquid.exponent) * liquid.log_slope
    expected = (
        liquid.density * height,
        liquid.density,
        liquid.density_slope * height,
        np.maximum(mobility, least / height**3),
        np.where(stiff, 0.0, (3.0 + liquid.exponent) / height),
        np.where(stiff, 0.0, by_pressure),
    )
    for found, wanted in zip(film, expected, strict=False):
        np.testing.assert_allclose(found, wanted, rtol=1e-13, atol=1e-15)
    held = rng.random(CELLS) < 0.4
    load_sharing.fix_film_gap(held, film)
    assert (film.content_by_gap[held] == 0.0).all()
    assert (film.log_mobility_by_gap[held] == 0.0).all()
    np.testing.assert_array_equal(film.content_by_gap[~held], liquid.density[~held])
    np.testing.assert_array_equal(film.ambient_by_gap, np.where(held[[0, -1]], 0.0, 1.0))


def test_a_step_is_limited_where_it_reverses(rng):
    """The limit halves where a step exceeds it and reverses; elsewhere it grows by half at most."""
    bounds = step_limits.StepBounds(0.5, 0.5, bound_reversals=True)
    step, before, size = rng.standard_normal((3, *CELLS))
    longest, out = 0.1 + rng.random(CELLS), np.empty(CELLS)
    allowed = np.maximum(0.5, 0.5 * size)
    turned = (step * before < 0.0) & (np.abs(step) > longest)
    expected = np.where(
        turned, 0.5 * np.minimum(longest, allowed), np.minimum(1.5 * longest, allowed)
    )
    step_limits.limit_steps(step, size, bounds, before, longest, out)
    np.testing.assert_allclose(longest, expected, rtol=1e-15)
    np.testing.assert_allclose(out, np.clip(step, -expected, expected), rtol=1e-15)
