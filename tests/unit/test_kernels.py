"""Compiled loops against slow twins, and the linearisation against what it linearises."""

import numpy as np
import pytest

from asperity.ehl import Options, Scales
from asperity.ehl.linear_solvers.single_pressure import Linear, MultigridSolver, five_point_pattern
from asperity.ehl.problem_setup import contact_problem, first_guess
from asperity.kernels import line_relaxation, multigrid, reynolds, stencils
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film, Rows
from asperity.kernels.stencils import OuterNeighbours, Stencil
from support import reynolds as twin
from support.paper import barus, contact, grid, rough

CELLS, DX, DY = (10, 8), 0.13, 0.21
NEAR = np.array([0.5, 0.3, 0.2, 0.05])


@pytest.fixture
def rng():
    return np.random.default_rng(8)


@pytest.fixture
def film(rng):
    return Film(
        *(0.1 + rng.random(CELLS) for _ in range(6)),
        *(0.1 + rng.random((2, CELLS[1])) for _ in range(2)),
    )


@pytest.fixture
def rows(rng):
    return Rows(rng.integers(0, 4, CELLS).astype(np.int8), 0.5 + rng.random(CELLS), 1.7)


@pytest.fixture
def stencil(rng):
    """Diagonally dominant, otherwise arbitrary."""
    return Stencil(5.0 + rng.random(CELLS), *(-rng.random(CELLS) for _ in range(4)))


def far_of(cells, rng=None):
    """Couplings of cells two away along x; nothing without a generator."""
    return OuterNeighbours(*(np.empty((2, 0, 0)) if rng is None else -rng.random((2, *cells))))


def dense(stencil, far=None):
    """The stencil as a matrix: x ends, y goes round."""
    nx, ny = stencil.centre.shape
    matrix = np.zeros((nx * ny, nx * ny))
    for i in range(nx):
        for j in range(ny):
            row = i * ny + j
            matrix[row, row] += stencil.centre[i, j]
            if i > 0:
                matrix[row, row - ny] += stencil.west[i, j]
            if i < nx - 1:
                matrix[row, row + ny] += stencil.east[i, j]
            matrix[row, i * ny + (j + 1) % ny] += stencil.north[i, j]
            matrix[row, i * ny + (j - 1) % ny] += stencil.south[i, j]
            if far is not None and i > 1:
                matrix[row, row - 2 * ny] += far.west[i, j]
            if far is not None and i < nx - 2:
                matrix[row, row + 2 * ny] += far.east[i, j]
    return matrix


SCHEMES = [
    {"wedge": (0.0, 0.5), "logarithmic": False},
    {"wedge": (0.375, 0.125), "logarithmic": True},
]


def faces_of(film, wedge=(0.0, 0.5), logarithmic=False, ends=()):
    cells = film.mobility.shape
    faces = Faces(*np.empty((6, *cells)), np.empty(cells[1]), np.array(wedge))
    across_ends = np.isin(np.arange(cells[1]), ends)
    reynolds.face_mobilities(film, np.log(film.mobility), logarithmic, across_ends, faces)
    return faces


def test_across_a_rollers_end_the_mobility_is_the_logarithmic_mean(film):
    """Exact for a viscosity that grows exponentially: of ∫ ε dP over the difference of ln ε."""
    plain, ended = faces_of(film), faces_of(film, ends=(0, 6))
    own, following = film.mobility, np.roll(film.mobility, -1, 1)
    logarithmic = (own - following) / np.log(own / following)
    at = np.isin(np.arange(CELLS[1]), (0, 6))
    assert ended.north[:, at] == pytest.approx(logarithmic[:, at], rel=1e-4)
    assert np.array_equal(ended.north[:, ~at], plain.north[:, ~at])
    assert np.array_equal(ended.east, plain.east)
    step = 1e-6
    grown = film._replace(mobility=film.mobility * np.exp(step * (np.arange(CELLS[1]) == 0)))
    slope = (faces_of(grown, ends=(0, 6)).north - ended.north)[:, 0] / step
    assert ended.north_by_own[:, 0] == pytest.approx(slope, rel=1e-3)


def outflow(pressure, film, inlet, **scheme):
    out = np.empty(CELLS)
    reynolds.net_outflow(pressure, film.content, faces_of(film, **scheme), inlet, DX, DY, out)
    return out


@pytest.mark.parametrize("scheme", SCHEMES)
def test_net_outflow_is_its_twins(rng, film, scheme):
    pressure, inlet = rng.random(CELLS), rng.random(CELLS[1])
    expected = twin.net_outflow(
        pressure, film.content, film.mobility, film.ambient, inlet, DX, DY, **scheme
    )
    np.testing.assert_allclose(
        outflow(pressure, film, inlet, **scheme), expected, rtol=1e-12, atol=1e-12
    )


def test_what_leaves_the_cells_leaves_the_grid(rng, film):
    """Fluxes telescope: the sum of all net outflows is what the outlet face lets out less what the
    inlet lets in.
    """
    pressure, inlet = rng.random(CELLS), rng.random(CELLS[1])
    along, _ = twin.faces(pressure, film.content, film.mobility, film.ambient, inlet, DX, DY)
    kept = outflow(pressure, film, inlet).sum() * DX
    assert kept == pytest.approx(along[-1].sum() - along[0].sum(), rel=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_net_outflow_is_second_order(scheme):
    """d(m)/dx - d(eps dp/dx)/dx - d(eps dp/dy)/dy of smooth fields; away from the first-order inlet
    face.
    """

    def error(cells):
        x, dx = (np.arange(cells) + 0.5) / cells, 1.0 / cells
        x, y = np.meshgrid(x, x, indexing="ij")
        wave = 2.0 * np.pi
        pressure = np.sin(np.pi * x) * (1.5 + np.cos(wave * y))
        mobility = 1.0 + 0.5 * x * np.sin(wave * y)
        content = 1.0 + x**3
        out = np.empty((cells, cells))
        film = Film(
            content,
            content,
            content,
            mobility,
            mobility,
            mobility,
            mobility[[0, -1]],
            mobility[[0, -1]],
        )
        reynolds.net_outflow(
            pressure, content, faces_of(film, **scheme), np.ones(cells), dx, dx, out
        )
        p_x = np.pi * np.cos(np.pi * x) * (1.5 + np.cos(wave * y))
        p_y = -wave * np.sin(np.pi * x) * np.sin(wave * y)
        laplace = -(np.pi**2) * pressure - wave**2 * np.sin(np.pi * x) * np.cos(wave * y)
        eps_x, eps_y = 0.5 * np.sin(wave * y), 0.5 * x * wave * np.cos(wave * y)
        exact = 3.0 * x**2 - mobility * laplace - eps_x * p_x - eps_y * p_y
        return np.abs(out - exact)[2:-1].max()

    assert error(64) < error(32) / 3.6


@pytest.mark.parametrize("storing", [0.0, 3.0])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_jacobian_product_is_the_complex_step_of_the_twin(rng, film, rows, storing, scheme):
    pressure, d_pressure, d_gap = (rng.standard_normal(CELLS) for _ in range(3))
    found = np.empty(CELLS)
    faces = faces_of(film, **scheme)
    change = reynolds.PressureChange(d_pressure, d_gap)
    reynolds.jacobian_product(rows, film, faces, pressure, change, (DX, DY), storing, found)
    step = 1e-30j
    along_step = twin.net_outflow(
        pressure + step * d_pressure,
        film.content + step * (film.content_by_gap * d_gap + film.content_by_pressure * d_pressure),
        film.mobility
        * (
            1.0
            + step * (film.log_mobility_by_gap * d_gap + film.log_mobility_by_pressure * d_pressure)
        ),
        film.ambient + step * film.ambient_by_gap * d_gap[[0, -1]],
        1.0 + step * film.content_by_gap[0] * d_gap[0],
        DX,
        DY,
        **scheme,
    )
    stored = storing * (film.content_by_gap * d_gap + film.content_by_pressure * d_pressure)
    oil = (along_step.imag / 1e-30 + stored) * rows.fluid_scale
    expected = np.choose(rows.state, [d_pressure, d_gap * rows.contact_scale, oil, d_pressure])
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


def first_order_rows(film, storing=0.0):
    """Poiseuille with its mobility held, plus the first-order wedge through the near compliances;
    rows unscaled.
    """
    nx, ny = CELLS
    count = nx * ny
    matrix = np.empty((count, count))
    for column in range(count):
        unit = np.zeros(count)
        unit[column] = 1.0
        matrix[:, column] = twin.net_outflow(
            unit.reshape(CELLS), np.zeros(CELLS), film.mobility, film.ambient, np.zeros(ny), DX, DY
        ).ravel()
    by_gap, by_pressure = film.content_by_gap, film.content_by_pressure
    for i in range(nx):
        for j in range(ny):
            for k in range(max(i - 1, 0), min(i + 2, nx)):
                here = by_gap[i, j] * NEAR[abs(k - i)] + by_pressure[i, j] * (k == i)
                before = (
                    by_gap[i, j] * NEAR[abs(k + 1 - i)]
                )  # the inlet's gap moves with its first cell
                if i > 0:
                    before = by_gap[i - 1, j] * NEAR[abs(k + 1 - i)] + by_pressure[i - 1, j] * (
                        k == i - 1
                    )
                matrix[i * ny + j, k * ny + j] += (here - before) / DX + storing * here
    return matrix


@pytest.mark.parametrize("storing", [0.0, 3.0])
def test_local_stencil_is_the_twins_matrix(film, rows, storing):
    stencil = Stencil(*(np.empty(CELLS) for _ in range(5)))
    stencils.local_stencil(rows, film, faces_of(film), NEAR, (DX, DY), storing, stencil)
    wet = first_order_rows(film, storing) * rows.fluid_scale.ravel()[:, None]
    ny = CELLS[1]
    expected = np.eye(wet.shape[0])
    for cell, state in enumerate(rows.state.ravel()):
        if state == LUBRICATED:
            expected[cell] = wet[cell]
        elif state == TOUCHING:
            expected[cell] = 0.0
            for other, distance in ((cell - ny, 1), (cell, 0), (cell + ny, 1)):
                if 0 <= other < wet.shape[0]:
                    expected[cell, other] = (NEAR[distance] - NEAR[3]) * rows.contact_scale
    np.testing.assert_allclose(dense(stencil), expected, rtol=1e-12, atol=1e-12)


def test_own_stencil_is_the_complex_step_of_the_twin(rng, film, rows):
    """Each cell's gap gives way to its own pressure; the wedge is first order, and the ends'
    mobility is held.
    """
    compliance, pressure = 0.4, rng.random(CELLS)
    stencil = Stencil(*(np.zeros(CELLS) for _ in range(5)))
    stencils.own_stencil(rows, film, faces_of(film), pressure, compliance, (DX, DY), stencil)
    slope = film.log_mobility_by_pressure + compliance * film.log_mobility_by_gap
    content = compliance * film.content_by_gap + film.content_by_pressure
    expected, step = np.empty((pressure.size, pressure.size)), 1e-30j
    wet = rows.state.ravel() == LUBRICATED
    for column in range(pressure.size):
        unit = np.zeros(pressure.size)
        unit[column] = 1.0
        unit = unit.reshape(CELLS)
        mobility = film.mobility * (1.0 + step * slope * unit)
        ambient = (
            film.ambient - (mobility - film.mobility)[[0, -1]]
        )  # means at both ends do not change
        nothing = np.zeros(CELLS, complex)
        out = twin.net_outflow(
            pressure + step * unit, nothing, mobility, ambient, nothing[0], DX, DY
        )
        carried = content * unit
        wedge = np.diff(carried, axis=0, prepend=0.0 * carried[:1]) / DX
        expected[:, column] = ((out.imag / 1e-30 + wedge) * rows.fluid_scale).ravel()
    expected[~wet] = np.eye(pressure.size)[~wet]
    np.testing.assert_allclose(dense(stencil), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_wedge_stencil_is_the_complex_step_of_the_twin(rng, film, rows, scheme):
    """Along x a pressure moves its own gap and those on both sides, across x its own; three cells
    upstream is cut.
    """
    ny = CELLS[1]
    own, beside = 0.4, 0.15
    pressure, faces = rng.random(CELLS), faces_of(film, **scheme)
    stencil, far = (
        Stencil(*(np.empty(CELLS) for _ in range(5))),
        OuterNeighbours(*(np.empty(CELLS) for _ in range(2))),
    )
    stencils.wedge_stencil(rows, film, faces, pressure, (own, beside), (DX, DY), stencil, far)
    wet, step = rows.state == LUBRICATED, 1e-30j
    expected = np.eye(pressure.size)
    expected[wet.ravel()] = 0.0
    for column in range(pressure.size):
        unit = np.zeros(CELLS)
        unit.ravel()[column] = 1.0
        d_gap = {"x": own * unit, "y": own * unit}
        d_gap["x"][1:] += beside * unit[:-1]
        d_gap["x"][:-1] += beside * unit[1:]
        for along, other in (("x", (DX, np.inf)), ("y", (np.inf, DY))):
            d_log = film.log_mobility_by_gap * d_gap[along] + film.log_mobility_by_pressure * unit
            out = twin.net_outflow(
                pressure + step * unit,
                film.content
                + step * (film.content_by_gap * d_gap[along] + film.content_by_pressure * unit),
                film.mobility * (1.0 + step * d_log),
                film.ambient + step * film.ambient_by_gap * d_gap[along][[0, -1]],
                1.0 + step * film.content_by_gap[0] * d_gap[along][0],
                *other,
                **scheme,
            )
            rate = np.where(wet, out.imag / 1e-30 * rows.fluid_scale, 0.0)
            rate[column // ny + 3 :] = 0.0
            expected[:, column] += rate.ravel()
    np.testing.assert_allclose(dense(stencil, far), expected, rtol=1e-11, atol=1e-11)
    assert np.abs(far.west[wet][ny:]).min() > 0.0


def test_leaning_outflow_is_its_twins(rng):
    content, own, upstream, found = (*rng.random((3, *CELLS)), np.empty(CELLS))
    reynolds.limited_outflow(content, own, upstream, DX, found)
    through = np.zeros(
        (CELLS[0] + 1, CELLS[1])
    )  # x faces; the outer two and the first inner one stay as they are
    through[2:-1] = own[1:-1] * content[1:-1] - upstream[1:-1] * content[:-2]
    np.testing.assert_allclose(found, np.diff(through, axis=0) / DX, rtol=1e-12, atol=1e-12)


def test_a_film_that_leans_by_a_half_has_the_second_order_wedge(rng, film):
    pressure, inlet = rng.random(CELLS), rng.random(CELLS[1])
    added, half = np.empty(CELLS), np.full(CELLS, 0.5)
    reynolds.limited_outflow(film.content, half, half, DX, added)
    first = outflow(pressure, film, inlet, wedge=(0.0, 0.0))
    np.testing.assert_allclose(
        first + added, outflow(pressure, film, inlet), rtol=1e-12, atol=1e-12
    )


def test_fluid_diagonal_is_the_stencils_own_but_never_below_the_stiff_film(film):
    found = np.empty(CELLS)
    reynolds.fluid_diagonal(film, faces_of(film), NEAR, DX, DY, found)
    own = np.diag(first_order_rows(film)).reshape(CELLS)
    above = np.concatenate([film.content_by_gap[:1], film.content_by_gap[:-1]])
    wedge = film.content_by_gap * NEAR[0] - above * NEAR[1] + film.content_by_pressure
    least = own - wedge / DX + (NEAR[0] - NEAR[1]) / DX
    np.testing.assert_allclose(found, np.maximum(own, least), rtol=1e-12)


@pytest.mark.parametrize("reaching", [False, True])
@pytest.mark.parametrize("across", [8, 7, 2, 1])
@pytest.mark.parametrize("parity", [0, 1])
def test_relaxed_lines_leave_no_residual(rng, parity, across, reaching):
    """With the lines between held; of an odd number, the first and the last do not feel each
    other.
    """
    cells = CELLS[0], across
    stencil = Stencil(5.0 + rng.random(cells), *(-rng.random(cells) for _ in range(4)))
    far = far_of(cells, rng if reaching else None)
    parts = np.empty((7, CELLS[0], (across + 1 - parity) // 2))
    lines = (
        line_relaxation.LineFactors(*parts)
        if reaching
        else line_relaxation.LineFactors(*parts[:5], *far)
    )
    line_relaxation.factor_lines(stencil, far, parity, 0.02 if reaching else 0.0, lines)
    residual, correction = rng.standard_normal((2, *cells))
    found = np.empty_like(lines.lower)
    line_relaxation.relax_lines(
        lines, parity, residual[:, parity::2].copy(), correction[:, 1 - parity :: 2].copy(), found
    )
    correction[:, parity::2] = found
    if across % 2:
        stencil.north[:, -1] = stencil.south[:, 0] = 0.0
    left = residual - (dense(stencil, far if reaching else None) @ correction.ravel()).reshape(
        cells
    )
    np.testing.assert_allclose(left[:, parity::2], 0.0, atol=1e-12)
    assert across == 1 or np.abs(left[:, 1 - parity :: 2]).max() > 0.1


def test_a_pivot_that_vanishes_is_replaced(rng):
    """Lines of five are not dominated by their centres; elimination never divides by nothing."""
    stencil, far = Stencil(*(-rng.random(CELLS) for _ in range(5))), far_of(CELLS, rng)
    stencil.centre[0] = 0.0
    lines = line_relaxation.LineFactors(*np.empty((7, CELLS[0], CELLS[1] // 2)))
    line_relaxation.factor_lines(stencil, far, 0, 0.02, lines)
    least = 0.02 * (np.abs(stencil.west) + np.abs(stencil.centre) + np.abs(stencil.east))[:, ::2]
    assert np.all(1.0 / lines.inverse >= 0.999 * least)
    np.testing.assert_allclose(lines.inverse[0], 1.0 / least[0])


@pytest.mark.parametrize("reaching", [False, True])
@pytest.mark.parametrize("across", [8, 7, 1])
def test_split_residual_is_the_matrix_product(rng, across, reaching):
    cells = CELLS[0], across
    stencil = Stencil(5.0 + rng.random(cells), *(-rng.random(cells) for _ in range(4)))
    residual, correction = rng.standard_normal((2, *cells))
    even, odd = np.empty((CELLS[0], (across + 1) // 2)), np.empty((CELLS[0], across // 2))
    far = far_of(cells, rng if reaching else None)
    line_relaxation.split_residual(stencil, far, residual, correction, even, odd)
    expected = residual - (dense(stencil, far if reaching else None) @ correction.ravel()).reshape(
        cells
    )
    np.testing.assert_allclose(even, expected[:, ::2], atol=1e-12)
    np.testing.assert_allclose(odd, expected[:, 1::2], atol=1e-12)
    whole = np.ones(cells)
    line_relaxation.add_lines(even, odd, whole)
    np.testing.assert_allclose(whole, expected + 1.0, atol=1e-12)


@pytest.mark.parametrize("block", [(1, 1), (2, 2), (3, 3), (2, 8), (4, 3)])
def test_aggregation_is_a_galerkin_product(rng, stencil, block):
    """R A R^T with R one for the active cells of a block: restrict, prolong and the coarse stencil
    agree on R.
    """
    active, scale = rng.random(CELLS) < 0.7, 0.5 + rng.random(CELLS)
    active[: block[0], : block[1]] = False  # one block without any
    weight = active * scale
    cells = tuple(-(-n // size) for n, size in zip(CELLS, block, strict=True))
    coarse = Stencil(*(np.empty(cells) for _ in range(5)))
    line_relaxation.aggregate_stencil(stencil, weight, block, coarse)
    of_block = (np.arange(CELLS[0])[:, None] // block[0]) * cells[1] + np.arange(CELLS[1]) // block[
        1
    ]
    gather = np.zeros((cells[0] * cells[1], active.size))
    gather[of_block.ravel(), np.arange(active.size)] = active.ravel()
    expected = gather @ (scale.ravel()[:, None] * dense(stencil)) @ gather.T
    empty = np.diag(expected) == 0.0
    expected[empty, empty] = 1.0
    np.testing.assert_allclose(dense(coarse), expected, atol=1e-12)

    residual, restricted = rng.standard_normal(CELLS), np.empty(cells)
    line_relaxation.restrict(residual, weight, block, restricted)
    np.testing.assert_allclose(restricted.ravel(), gather @ (scale * residual).ravel(), atol=1e-12)
    spread, back = rng.standard_normal(cells), np.empty(CELLS)
    line_relaxation.prolong(spread, weight, block, back)
    np.testing.assert_allclose(back.ravel(), gather.T @ spread.ravel(), atol=1e-12)


@pytest.mark.parametrize("cells", [(9, 7), (5, 2), (6, 1), (1, 4)])
def test_factored_matrix_is_the_stencils(rng, cells):
    stencil = Stencil(5.0 + rng.random(cells), *(-rng.random(cells) for _ in range(4)))
    pattern, wanted = five_point_pattern(cells), rng.standard_normal(cells)
    found = pattern.solve(pattern.factored(stencil), wanted)
    np.testing.assert_allclose(dense(stencil) @ found.ravel(), wanted.ravel(), atol=1e-12)


@pytest.mark.parametrize("cells", [(150, 70), (40, 33), (64, 8)])
def test_nested_blocks_answer_what_the_factored_sum_does(rng, cells):
    """Flow in a film whose mobility varies a thousandfold, where a tenth of the cells is
    ruptured.
    """
    mobility = np.exp(rng.uniform(0.0, 7.0, cells))
    east = 2.0 / (1.0 / mobility + 1.0 / np.roll(mobility, -1, 0))
    north = 2.0 / (1.0 / mobility + 1.0 / np.roll(mobility, -1, 1))
    west, south = np.roll(east, 1, 0), np.roll(north, 1, 1)
    stencil = Stencil(east + west + north + south, -west, -east, -north, -south)
    weight = np.where(rng.random(cells) < 0.9, 1.0, 0.0)
    sums = Stencil(*np.empty((5, *(-(-n // 2) for n in cells))))
    line_relaxation.aggregate_stencil(stencil, weight, (2, 2), sums)
    residual, wanted = rng.standard_normal(cells), np.empty(sums.centre.shape)
    line_relaxation.restrict(residual, weight, (2, 2), wanted)
    exact = five_point_pattern(wanted.shape).solve(
        five_point_pattern(wanted.shape).factored(sums), wanted
    )
    found = MultigridSolver(stencil, weight)(residual)
    expected = np.where(
        weight > 0.0, np.repeat(np.repeat(exact, 2, 0), 2, 1)[: cells[0], : cells[1]], 0.0
    )
    assert np.linalg.norm(found - expected) < 0.2 * np.linalg.norm(expected)
    assert (found[weight == 0.0] == 0.0).all()


def test_the_last_of_nested_grids_is_inverted(rng):
    """Not dominated by its centres, so that pivots are taken; a matrix without an inverse is
    refused.
    """
    cells = 3, 4
    parts = Stencil(*rng.standard_normal((5, *cells)))
    inverse = np.empty((12, 12))
    assert multigrid.invert(parts, inverse)
    np.testing.assert_allclose(inverse @ dense(parts), np.eye(12), atol=1e-9)
    assert not multigrid.invert(Stencil(*np.zeros((5, *cells))), inverse)


@pytest.mark.parametrize("cells", [(7, 9), (6, 4), (5, 6)])
def test_sums_over_pairs_and_back(rng, cells):
    fine, weight = (
        rng.standard_normal(cells),
        np.where(rng.random(cells) < 0.7, rng.random(cells), 0.0),
    )
    for halved in ((True, True), (True, False), (False, True)):
        coarse = tuple(-(-n // 2) if half else n for n, half in zip(cells, halved, strict=True))
        where = [np.arange(n) // (2 if half else 1) for n, half in zip(cells, halved, strict=True)]
        over, sums, expected = rng.random(coarse), np.empty(coarse), np.zeros(coarse)
        multigrid.restrict_scaled(fine, weight, over, sums)
        np.add.at(expected, np.ix_(*where), fine * weight)
        np.testing.assert_allclose(sums, expected * over, rtol=1e-12, atol=1e-12)
        back = fine.copy()
        multigrid.add_prolonged(sums, weight, back)
        np.testing.assert_allclose(
            back, fine + np.where(weight > 0.0, sums[np.ix_(*where)], 0.0), rtol=1e-12
        )


@pytest.fixture(scope="module")
def balance():
    """A rough contact half way to its solution: all four states occur, nothing balances."""
    conditions, oil, on = contact(hardness=0.9e9), barus(), grid((32, 16))
    problem = contact_problem(
        conditions, oil, rough(on, 0.7e-6, correlation_length=40e-6), Options()
    )
    pressure, approach = first_guess(
        problem, conditions, oil, Scales.from_conditions(conditions, oil)
    )
    uneven = 1.0 + 0.3 * np.sin(np.arange(problem.cells[1]) * np.pi / 8.0)
    pressure = np.maximum(pressure * uneven + 0.02 * np.exp(-(problem.x**2) / 9.0)[:, None], 0.0)
    return problem.evaluate(pressure, approach - 0.3)


def test_every_state_occurs_and_each_cell_is_judged_by_its_own_equation(balance):
    problem, state, p = balance.problem, balance.rows.state, balance.pressure
    assert set(np.unique(state)) == {RUPTURED, TOUCHING, LUBRICATED, CAPPED}
    gap = (balance.gap - problem.contact_gap) * balance.rows.contact_scale
    fluid = balance.outflow * balance.rows.fluid_scale
    expected = np.maximum(np.minimum(p, np.minimum(gap, fluid)), p - problem.p_cap)
    np.testing.assert_array_equal(balance.residual, expected)


def test_the_linearisation_is_the_derivative_of_the_equations(balance):
    """Central differences of gap, outflow and pressure, in the cells that each decides and away
    from kinks.
    """
    problem, rng = balance.problem, np.random.default_rng(9)
    step = 1e-6
    d_pressure, d_approach = rng.standard_normal(problem.cells), 0.7
    approach = float(
        np.mean(balance.gap - problem.undeformed - problem.deflection(balance.pressure))
    )
    ahead, behind = (
        problem.evaluate(
            balance.pressure + sign * step * d_pressure, approach + sign * step * d_approach
        )
        for sign in (1.0, -1.0)
    )
    found = Linear(balance, dtype=np.float64).product(d_pressure, d_approach)
    d_outflow = (ahead.outflow - behind.outflow) / (2.0 * step) * balance.rows.fluid_scale
    d_gap = (ahead.gap - behind.gap) / (2.0 * step) * balance.rows.contact_scale
    expected = np.choose(balance.rows.state, [d_pressure, d_gap, d_outflow, d_pressure])
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_film_slopes_are_derivatives(balance):
    """Content and mobility by gap and by pressure, in cells where the bodies stay apart."""
    problem, film = balance.problem, balance.film
    step = 1e-6
    apart = balance.gap > problem.contact_gap + 10.0 * step
    oil = problem.lubricant
    for change, by_content, by_mobility in (
        ((step, 0.0), film.content_by_pressure, film.mobility * film.log_mobility_by_pressure),
        ((0.0, step), film.content_by_gap, film.mobility * film.log_mobility_by_gap),
    ):
        (c1, e1), (c0, e0) = (
            (
                oil.density(q) / 880.0 * h,
                oil.density(q)
                / 880.0
                * h**3
                * oil.viscosity.eta0
                / (problem.speed * oil.viscosity(q)),
            )
            for q, h in (
                (
                    (balance.pressure + sign * change[0]) * problem.p_scale,
                    balance.gap + sign * change[1],
                )
                for sign in (1.0, -1.0)
            )
        )
        np.testing.assert_allclose(by_content[apart], (c1 - c0)[apart] / (2.0 * step), rtol=1e-6)
        np.testing.assert_allclose(by_mobility[apart], (e1 - e0)[apart] / (2.0 * step), rtol=1e-5)
    closed = balance.gap <= problem.contact_gap
    assert closed.any()
    assert not film.content_by_gap[closed].any()
    assert not film.log_mobility_by_gap[closed].any()


def test_the_approximate_inverse_is_linear_and_leaves_known_cells_alone(balance):
    inverse = Linear(balance, dtype=np.float64)
    one, other = (
        np.random.default_rng(10).standard_normal((2, *balance.problem.cells)) * balance.unknown
    )
    np.testing.assert_allclose(
        inverse(one + 2.0 * other), inverse(one) + 2.0 * inverse(other), atol=1e-9
    )
    assert not inverse(one)[~balance.unknown].any()


def test_single_precision_is_the_double_one_rounded(balance):
    single, double = Linear(balance), Linear(balance, dtype=np.float64)
    d_pressure = np.random.default_rng(11).standard_normal(balance.problem.cells) * balance.unknown
    for found, expected in (
        (single.product(d_pressure.astype(np.float32), 0.3), double.product(d_pressure, 0.3)),
        (single(d_pressure.astype(np.float32)), double(d_pressure)),
    ):
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_coarser_is_the_same_contact(balance):
    """Averaged heights, the parabola at the new cell centres, the same load and size."""
    fine = balance.problem
    coarse = fine.coarsened((16, 8))
    assert coarse.cells == (16, 8)
    for axis in (0, 1):
        assert coarse.spacing[axis] * coarse.cells[axis] == pytest.approx(
            fine.spacing[axis] * fine.cells[axis]
        )
    np.testing.assert_allclose(coarse.x, (fine.x[::2] + fine.x[1::2]) / 2.0, rtol=1e-12)
    heights = (fine.x**2 / 2.0)[:, None] - fine.undeformed
    expected = (
        heights[::2, ::2] + heights[1::2, ::2] + heights[::2, 1::2] + heights[1::2, 1::2]
    ) / 4.0
    np.testing.assert_allclose(
        (coarse.x**2 / 2.0)[:, None] - coarse.undeformed, expected, atol=1e-12
    )
    for name in ("load", "p_cap", "contact_gap", "speed", "p_scale", "lubricant", "lower"):
        assert getattr(coarse, name) == getattr(fine, name)
