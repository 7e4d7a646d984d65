"""Load sharing of oil and asperities per cell, film and step limit: loops against NumPy
references.
"""

import numpy as np
import pytest

from asperity.kernels import face_mobilities, load_sharing, reynolds, step_limits
from asperity.kernels.load_sharing import FREE, CellState, ContactBounds
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film, Liquid

CELLS, DX, DY = (30, 20), 0.13, 0.21
BOUNDS = ContactBounds(contact_gap=0.1, contact_scale=3.0, closed_gap=0.101, p_cap=0.9)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture
def cells(rng):
    """Gaps around the contact film, some exactly on it; pressures from zero to beyond the cap."""
    oil, total = rng.uniform(0.0, 1.0, (2, *CELLS))
    gap = rng.uniform(-0.6, 0.5, CELLS)
    gap[rng.random(CELLS) < 0.3] = 0.1
    signed_oil = np.where(rng.random(CELLS) < 0.2, -oil, oil)
    return CellState(
        signed_oil,
        oil,
        np.maximum(total, 0.7 * oil),
        gap,
        rng.standard_normal(CELLS),
        0.1 + rng.random(CELLS),
    )


def numpy_reference(cells, released):
    """NumPy reference of the decisions: lifted, solid, residual, submerged and closed cells."""
    contact_pressure = (cells.gap - BOUNDS.contact_gap) * BOUNDS.contact_scale
    solid_pressure = cells.total - cells.oil
    free, yielding = (
        solid_pressure < contact_pressure,
        cells.total - contact_pressure > BOUNDS.p_cap,
    )
    criteria = (
        ~free,
        ~yielding,
        cells.outflow + solid_pressure * cells.own_outflow < 0.0,
        cells.signed >= 0.0,
    )
    for index in range(len(criteria)):  # each criterion decides in some cells
        assert (
            ~criteria[index]
            & np.all([criteria[other] for other in range(len(criteria)) if other != index], axis=0)
        ).any()
    separating = np.all(criteria, axis=0)
    free = free | (separating & (solid_pressure <= 0.0)) | released
    residual = np.where(free, solid_pressure, contact_pressure)
    solid = np.where(free, FREE, TOUCHING)
    capped = cells.total - BOUNDS.p_cap > residual
    residual, solid = (
        np.where(capped, cells.total - BOUNDS.p_cap, residual),
        np.where(capped, CAPPED, solid),
    )
    submerged = (solid == FREE) & (contact_pressure < 0.0) & ~yielding
    closed = (solid != FREE) & (cells.gap <= BOUNDS.closed_gap)
    return (
        separating,
        solid_pressure,
        solid,
        residual,
        submerged,
        closed,
        closed | ((contact_pressure <= 0.0) & ~submerged),
    )


def test_each_cell_is_decided_as_in_the_numpy_reference(rng, cells):
    released = rng.random(CELLS) < 0.1
    separating, solid_pressure, solid, residual, submerged, closed, sealed = numpy_reference(
        cells, released
    )
    masks, codes, rows = (
        np.empty((3, *CELLS), dtype=bool),
        np.empty(CELLS, np.int8),
        np.empty(CELLS),
    )
    assert load_sharing.mark_opening(cells, BOUNDS, masks[0]) == bool(
        np.any(separating & (solid_pressure > 0.0))
    )
    assert np.array_equal(masks[0], separating)
    assert separating.any()
    assert load_sharing.fill_contact_rows(
        cells, BOUNDS, separating, released, codes, rows, masks[1]
    ) == bool(submerged.any())
    assert np.array_equal(codes, solid)
    np.testing.assert_allclose(rows, residual, rtol=1e-14, atol=1e-14)
    assert np.array_equal(masks[1], submerged)
    assert {FREE, TOUCHING, CAPPED} == set(codes.ravel().tolist())
    scale = original = rng.random(CELLS)
    original = scale.copy()
    load_sharing.mark_sealed(cells, BOUNDS, codes, submerged, scale, masks[2])
    assert np.array_equal(masks[2], sealed)
    np.testing.assert_allclose(
        scale, np.where(closed, 1.0 / cells.own_outflow, original), rtol=1e-14
    )


def test_the_oil_residual_is_the_complementarity_function(rng, cells):
    """max(min(q, R/J), q - P_cap), and its active branch."""
    scale, rows, state = rng.random(CELLS), np.empty(CELLS), np.empty(CELLS, np.int8)
    load_sharing.fill_oil_rows(cells, BOUNDS, scale, rows, state)
    balanced, oil = cells.outflow * scale, cells.oil
    expected = np.maximum(np.minimum(oil, balanced), oil - BOUNDS.p_cap)
    np.testing.assert_allclose(rows, expected, rtol=1e-14)
    capped = oil - BOUNDS.p_cap > np.minimum(oil, balanced)
    assert np.array_equal(
        state, np.where(capped, CAPPED, np.where(balanced < oil, LUBRICATED, RUPTURED))
    )


def test_oil_fills_a_flattened_streak_downstream():
    solid = np.full((6, 2), CAPPED, np.int8)
    solid[4, 0] = TOUCHING  # ends the first streak
    state = np.full((6, 2), RUPTURED, np.int8)
    state[1] = LUBRICATED
    residual, outflow, scale = np.full((6, 2), -1.0), np.full((6, 2), -2.0), np.full((6, 2), 0.5)
    residual[1, 1] = 1.0  # no oil flows on from here
    gap, rim = np.full((6, 2), 0.1), np.zeros(2, dtype=bool)
    load_sharing.extend_lubrication(gap, 0.101, solid, rim, (outflow, scale), state, residual)
    assert np.flatnonzero(state[:, 0] == LUBRICATED).tolist() == [1, 2, 3]
    assert np.flatnonzero(state[:, 1] == LUBRICATED).tolist() == [1]
    assert (residual[2:4, 0] == -1.0).all()


def test_own_outflow_is_the_derivative_at_fixed_film(rng):
    film = Film(
        *(0.1 + rng.random(CELLS) for _ in range(6)),
        *(0.1 + rng.random((2, CELLS[1])) for _ in range(2)),
    )
    faces = Faces(*np.empty((6, *CELLS)), np.empty(CELLS[1]), np.zeros(2), *np.empty((4, *CELLS)))
    ends = np.zeros(CELLS[1], dtype=bool)
    face_mobilities.face_mobilities(film, np.ones(CELLS), face_mobilities.ARITHMETIC, ends, faces)
    computed, pressure, step = np.empty(CELLS), rng.random(CELLS), 0.5
    load_sharing.outflow_by_pressure(film, faces, 2.5, DX, DY, computed)
    before, after = np.empty((2, *CELLS))
    reynolds.net_outflow(pressure, film.content, faces, film.content[0], DX, DY, before)
    for cell in np.ndindex(CELLS):
        disturbed = pressure.copy()
        disturbed[cell] += step
        reynolds.net_outflow(disturbed, film.content, faces, film.content[0], DX, DY, after)
        net_change = (after - before)[cell] / step
        assert computed[cell] == pytest.approx(
            net_change + 2.5 * film.content_by_pressure[cell], rel=1e-9
        )


def test_the_limiter_and_its_slopes(rng):
    content, gap = 0.1 + rng.random(CELLS), rng.uniform(0.05, 0.3, CELLS)
    upstream = np.concatenate([content[:1], content[:-1]])
    limiter, slopes, upstream_slopes = np.empty((3, *CELLS))
    load_sharing.limiter(content, upstream, gap, 0.1, 0.05, limiter)
    opened = np.clip((gap - 0.1) / 0.05, 0.0, 1.0)
    expected = upstream * content / (upstream**2 + content**2) * opened
    expected[1:] *= opened[:-1]
    expected[0] = 0.0
    np.testing.assert_allclose(limiter, expected, rtol=1e-13)

    def limited_difference(cell, upstream_cell):
        return (
            expected
            / (upstream * content / (upstream**2 + content**2))
            * (upstream_cell * cell / (upstream_cell**2 + cell**2) * (cell - upstream_cell))
        )

    load_sharing.limiter_slopes(limiter, content, upstream, slopes, upstream_slopes)
    step = 1e-30j
    np.testing.assert_allclose(
        slopes, limited_difference(content + step, upstream).imag / 1e-30, rtol=1e-10, atol=1e-12
    )
    np.testing.assert_allclose(
        upstream_slopes,
        -limited_difference(content, upstream + step).imag / 1e-30,
        rtol=1e-10,
        atol=1e-12,
    )


@pytest.mark.parametrize("least_slope", [0.0, 3.0])
def test_film_mobility_is_that_of_its_oil(rng, least_slope):
    """Mobility has a lower bound with a stated derivative in the gap and none in the pressure."""
    liquid, height, lower_bound = (
        Liquid(*(0.2 + rng.random((6, *CELLS)))),
        0.2 + rng.random(CELLS),
        0.05,
    )
    film = Film(*np.empty((6, *CELLS)), *np.ones((2, 2, CELLS[1])))
    reynolds.fill_film(liquid, height, 1.7, (lower_bound, least_slope), film)
    mobility = 1.7 * liquid.density * height**3 / (liquid.viscosity * liquid.thinning)
    bounded = mobility < lower_bound / height**3
    assert 0 < bounded.sum() < bounded.size
    by_pressure = liquid.density_slope / liquid.density - (1.0 + liquid.exponent) * liquid.log_slope
    expected = (
        liquid.density * height,
        liquid.density,
        liquid.density_slope * height,
        np.maximum(mobility, lower_bound / height**3),
        np.where(bounded, least_slope, 3.0 + liquid.exponent) / height,
        np.where(bounded, 0.0, by_pressure),
    )
    for computed, reference in zip(film, expected, strict=False):
        np.testing.assert_allclose(computed, reference, rtol=1e-13, atol=1e-15)
    fixed = rng.random(CELLS) < 0.4
    load_sharing.fix_film_gap(fixed, film)
    assert (film.content_by_gap[fixed] == 0.0).all()
    assert (film.log_mobility_by_gap[fixed] == 0.0).all()
    np.testing.assert_array_equal(film.content_by_gap[~fixed], liquid.density[~fixed])
    np.testing.assert_array_equal(film.ambient_by_gap, np.where(fixed[[0, -1]], 0.0, 1.0))


def test_a_step_is_limited_where_it_reverses(rng):
    """The limit halves where a step exceeds it and reverses; otherwise it grows by at most half."""
    bounds = step_limits.StepBounds(0.5, 0.5, bound_reversals=True)
    step, before, size = rng.standard_normal((3, *CELLS))
    longest, out = 0.1 + rng.random(CELLS), np.empty(CELLS)
    allowed = np.maximum(0.5, 0.5 * size)
    exceeding = (step * before < 0.0) & (np.abs(step) > longest)
    expected = np.where(
        exceeding, 0.5 * np.minimum(longest, allowed), np.minimum(1.5 * longest, allowed)
    )
    step_limits.limit_steps(step, size, bounds, before, longest, out)
    np.testing.assert_allclose(longest, expected, rtol=1e-15)
    np.testing.assert_allclose(out, np.clip(step, -expected, expected), rtol=1e-15)
