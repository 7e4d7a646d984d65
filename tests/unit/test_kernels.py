"""Compiled kernels against NumPy references, and the linearisation against differences."""

from importlib import import_module
from pkgutil import iter_modules

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from asperity import kernels
from asperity.ehl import Options, Scales
from asperity.ehl.linear_solvers.single_pressure import Linear, MultigridSolver, five_point_pattern
from asperity.ehl.problem_setup import contact_problem, first_guess
from asperity.kernels import face_mobilities, line_relaxation, multigrid, reynolds, stencils
from asperity.kernels.reynolds import CAPPED, LUBRICATED, RUPTURED, TOUCHING, Faces, Film, Rows
from asperity.kernels.stencils import OuterNeighbours, Stencil
from support import reynolds as reference
from support.paper import barus, contact, grid, rough

CELLS, DX, DY = (10, 8), 0.13, 0.21
COMPLIANCE = np.array([0.5, 0.3, 0.2, 0.05])


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
    """A diagonally dominant, otherwise random stencil."""
    return Stencil(5.0 + rng.random(CELLS), *(-rng.random(CELLS) for _ in range(4)))


def random_outer_couplings(cells, rng=None):
    """Random couplings to cells two away along x; empty without a generator."""
    return OuterNeighbours(*(np.empty((2, 0, 0)) if rng is None else -rng.random((2, *cells))))


def dense(stencil, outer=None):
    """Return the stencil as a dense matrix, bounded in x and periodic in y."""
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
            if outer is not None and i > 1:
                matrix[row, row - 2 * ny] += outer.west[i, j]
            if outer is not None and i < nx - 2:
                matrix[row, row + 2 * ny] += outer.east[i, j]
    return matrix


HEIGHT = 0.3 + np.random.default_rng(3).random(CELLS)
SCHEMES = [
    {"wedge": (0.0, 0.5), "logarithmic": False},
    {"wedge": (0.375, 0.125), "logarithmic": True},
    {"wedge": (0.0, 0.0), "height": HEIGHT},
]


def make_faces(film, wedge=(0.0, 0.5), logarithmic=False, ends=(), height=None):
    cells = film.mobility.shape
    ends_of_lines = np.empty(cells[1]), np.array(wedge)
    faces = Faces(*np.empty((6, *cells)), *ends_of_lines, *np.empty((4, *cells)))
    across_ends = np.isin(np.arange(cells[1]), ends)
    mean = face_mobilities.LOGARITHMIC if logarithmic else face_mobilities.ARITHMETIC
    if height is None:
        height = np.ones(cells)
    else:
        mean = face_mobilities.EXACT
    face_mobilities.face_mobilities(film, height, mean, across_ends, faces)
    return faces


def shifted(scheme, d_height):
    """Return a scheme with its heights, if it has any, changed by `d_height`."""
    return scheme | {"height": scheme["height"] + d_height} if "height" in scheme else scheme


def test_the_mobility_across_a_rollers_end_is_the_logarithmic_mean(film):
    """Exact for an exponential viscosity law: ∫ ε dP over the difference of ln ε."""
    plain, with_ends = make_faces(film), make_faces(film, ends=(0, 6))
    own, following = film.mobility, np.roll(film.mobility, -1, 1)
    logarithmic = (own - following) / np.log(own / following)
    at = np.isin(np.arange(CELLS[1]), (0, 6))
    assert with_ends.north[:, at] == pytest.approx(logarithmic[:, at], rel=1e-4)
    assert np.array_equal(with_ends.north[:, ~at], plain.north[:, ~at])
    assert np.array_equal(with_ends.east, plain.east)
    step = 1e-6
    grown = film._replace(mobility=film.mobility * np.exp(step * (np.arange(CELLS[1]) == 0)))
    slope = (make_faces(grown, ends=(0, 6)).north - with_ends.north)[:, 0] / step
    assert with_ends.north_by_own[:, 0] == pytest.approx(slope, rel=1e-3)


def test_an_exact_face_carries_the_flow_through_a_linear_gap():
    """The flow q = -h^3 e^(-a p) dp/dx by quadrature, over gaps up to a hundredfold."""
    for first, second in ((1.0, 100.0), (100.0, 1.0), (1.0, 1.0 + 1e-9), (3.0, 7.0)):
        share = np.linspace(0.0, 1.0, 400_001)
        resistance = np.trapezoid((first + share * (second - first)) ** -3.0, share)
        pressure, stiffening = np.array([0.2, 0.9]), 12.0
        fluidity = np.exp(-stiffening * pressure)
        flow = (fluidity[0] - fluidity[1]) / stiffening / resistance
        own, following = fluidity * np.array([first, second]) ** 3
        face, *_ = face_mobilities._exact_mean(own, following, first, second)
        assert face * np.diff(pressure)[0] == pytest.approx(flow, rel=1e-6)


def outflow(pressure, film, inlet, **scheme):
    out = np.empty(CELLS)
    reynolds.net_outflow(pressure, film.content, make_faces(film, **scheme), inlet, DX, DY, out)
    return out


@pytest.mark.parametrize("scheme", SCHEMES)
def test_net_outflow_matches_the_reference(rng, film, scheme):
    pressure, inlet = rng.random(CELLS), rng.random(CELLS[1])
    expected = reference.net_outflow(
        pressure, film.content, film.mobility, film.ambient, inlet, DX, DY, **scheme
    )
    np.testing.assert_allclose(
        outflow(pressure, film, inlet, **scheme), expected, rtol=1e-12, atol=1e-12
    )


def test_net_outflow_conserves_mass(rng, film):
    """Fluxes telescope: all net outflows sum to the outlet flux minus the inlet flux."""
    pressure, inlet = rng.random(CELLS), rng.random(CELLS[1])
    along, _ = reference.faces(pressure, film.content, film.mobility, film.ambient, inlet, DX, DY)
    kept = outflow(pressure, film, inlet).sum() * DX
    assert kept == pytest.approx(along[-1].sum() - along[0].sum(), rel=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES[:2])
def test_net_outflow_is_second_order(scheme):
    """d(m)/dx - d(eps dp/dx)/dx - d(eps dp/dy)/dy of smooth fields, away from the first-order inlet
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
            pressure, content, make_faces(film, **scheme), np.ones(cells), dx, dx, out
        )
        p_x = np.pi * np.cos(np.pi * x) * (1.5 + np.cos(wave * y))
        p_y = -wave * np.sin(np.pi * x) * np.sin(wave * y)
        laplace = -(np.pi**2) * pressure - wave**2 * np.sin(np.pi * x) * np.cos(wave * y)
        eps_x, eps_y = 0.5 * np.sin(wave * y), 0.5 * x * wave * np.cos(wave * y)
        exact = 3.0 * x**2 - mobility * laplace - eps_x * p_x - eps_y * p_y
        return np.abs(out - exact)[2:-1].max()

    assert error(64) < error(32) / 3.6


@pytest.mark.parametrize("storage", [0.0, 3.0])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_jacobian_product_is_the_complex_step_of_the_reference(rng, film, rows, storage, scheme):
    pressure, d_pressure, d_gap = (rng.standard_normal(CELLS) for _ in range(3))
    found = np.empty(CELLS)
    faces = make_faces(film, **scheme)
    change = reynolds.PressureChange(d_pressure, d_gap)
    reynolds.jacobian_product(rows, film, faces, pressure, change, (DX, DY), storage, found)
    step = 1e-30j
    complex_outflow = reference.net_outflow(
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
        **shifted(scheme, step * d_gap),
    )
    stored = storage * (film.content_by_gap * d_gap + film.content_by_pressure * d_pressure)
    oil = (complex_outflow.imag / 1e-30 + stored) * rows.fluid_scale
    expected = np.choose(rows.state, [d_pressure, d_gap * rows.contact_scale, oil, d_pressure])
    np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)


def first_order_rows(film, storage=0.0):
    """Return unscaled rows: Poiseuille with fixed mobility, first-order wedge by compliances."""
    nx, ny = CELLS
    count = nx * ny
    matrix = np.empty((count, count))
    for column in range(count):
        unit = np.zeros(count)
        unit[column] = 1.0
        matrix[:, column] = reference.net_outflow(
            unit.reshape(CELLS), np.zeros(CELLS), film.mobility, film.ambient, np.zeros(ny), DX, DY
        ).ravel()
    by_gap, by_pressure = film.content_by_gap, film.content_by_pressure
    for i in range(nx):
        for j in range(ny):
            for k in range(max(i - 1, 0), min(i + 2, nx)):
                own_content = by_gap[i, j] * COMPLIANCE[abs(k - i)] + by_pressure[i, j] * (k == i)
                upstream_content = (
                    by_gap[i, j] * COMPLIANCE[abs(k + 1 - i)]
                )  # the gap at the inlet follows its first cell
                if i > 0:
                    upstream_content = by_gap[i - 1, j] * COMPLIANCE[abs(k + 1 - i)] + by_pressure[
                        i - 1, j
                    ] * (k == i - 1)
                matrix[i * ny + j, k * ny + j] += (
                    own_content - upstream_content
                ) / DX + storage * own_content
    return matrix


@pytest.mark.parametrize("storage", [0.0, 3.0])
def test_local_stencil_is_the_matrix_of_the_reference(film, rows, storage):
    stencil = Stencil(*(np.empty(CELLS) for _ in range(5)))
    stencils.local_stencil(rows, film, make_faces(film), COMPLIANCE, (DX, DY), storage, stencil)
    lubricated = first_order_rows(film, storage) * rows.fluid_scale.ravel()[:, None]
    ny = CELLS[1]
    expected = np.eye(lubricated.shape[0])
    for cell, state in enumerate(rows.state.ravel()):
        if state == LUBRICATED:
            expected[cell] = lubricated[cell]
        elif state == TOUCHING:
            expected[cell] = 0.0
            for other, distance in ((cell - ny, 1), (cell, 0), (cell + ny, 1)):
                if 0 <= other < lubricated.shape[0]:
                    expected[cell, other] = (
                        COMPLIANCE[distance] - COMPLIANCE[3]
                    ) * rows.contact_scale
    np.testing.assert_allclose(dense(stencil), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("scheme", [{}, {"height": HEIGHT}])
def test_own_stencil_is_the_complex_step_of_the_reference(rng, film, rows, scheme):
    """Each gap depends on its own pressure only; first-order wedge, fixed mobility at the ends."""
    compliance, pressure = 0.4, rng.random(CELLS)
    stencil = Stencil(*(np.zeros(CELLS) for _ in range(5)))
    faces = make_faces(film, **scheme)
    stencils.own_stencil(rows, film, faces, pressure, compliance, (DX, DY), stencil)
    slope = film.log_mobility_by_pressure + compliance * film.log_mobility_by_gap
    content = compliance * film.content_by_gap + film.content_by_pressure
    expected, step = np.empty((pressure.size, pressure.size)), 1e-30j
    lubricated = rows.state.ravel() == LUBRICATED
    for column in range(pressure.size):
        unit = np.zeros(pressure.size)
        unit[column] = 1.0
        unit = unit.reshape(CELLS)
        mobility = film.mobility * (1.0 + step * slope * unit)
        ambient = film.ambient - (mobility - film.mobility)[[0, -1]]  # keeps the means at both ends
        zero = np.zeros(CELLS, complex)
        gaps = shifted(scheme, step * compliance * unit)
        out = reference.net_outflow(
            pressure + step * unit, zero, mobility, ambient, zero[0], DX, DY, **gaps
        )
        carried = content * unit
        wedge = np.diff(carried, axis=0, prepend=0.0 * carried[:1]) / DX
        expected[:, column] = ((out.imag / 1e-30 + wedge) * rows.fluid_scale).ravel()
    expected[~lubricated] = np.eye(pressure.size)[~lubricated]
    np.testing.assert_allclose(dense(stencil), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_wedge_stencil_is_the_complex_step_of_the_reference(rng, film, rows, scheme):
    """Along x a pressure changes its own gap and both neighbours', across x its own only; couplings
    over three cells are dropped.
    """
    ny = CELLS[1]
    own, neighbour = 0.4, 0.15
    pressure, faces = rng.random(CELLS), make_faces(film, **scheme)
    stencil, outer = (
        Stencil(*(np.empty(CELLS) for _ in range(5))),
        OuterNeighbours(*(np.empty(CELLS) for _ in range(2))),
    )
    stencils.wedge_stencil(rows, film, faces, pressure, (own, neighbour), (DX, DY), stencil, outer)
    lubricated, step = rows.state == LUBRICATED, 1e-30j
    expected = np.eye(pressure.size)
    expected[lubricated.ravel()] = 0.0
    for column in range(pressure.size):
        unit = np.zeros(CELLS)
        unit.ravel()[column] = 1.0
        d_gap = {"x": own * unit, "y": own * unit}
        d_gap["x"][1:] += neighbour * unit[:-1]
        d_gap["x"][:-1] += neighbour * unit[1:]
        for along, other in (("x", (DX, np.inf)), ("y", (np.inf, DY))):
            d_log = film.log_mobility_by_gap * d_gap[along] + film.log_mobility_by_pressure * unit
            out = reference.net_outflow(
                pressure + step * unit,
                film.content
                + step * (film.content_by_gap * d_gap[along] + film.content_by_pressure * unit),
                film.mobility * (1.0 + step * d_log),
                film.ambient + step * film.ambient_by_gap * d_gap[along][[0, -1]],
                1.0 + step * film.content_by_gap[0] * d_gap[along][0],
                *other,
                **shifted(scheme, step * d_gap[along]),
            )
            rate = np.where(lubricated, out.imag / 1e-30 * rows.fluid_scale, 0.0)
            rate[column // ny + 3 :] = 0.0
            expected[:, column] += rate.ravel()
    np.testing.assert_allclose(dense(stencil, outer), expected, rtol=1e-11, atol=1e-11)
    assert np.abs(outer.west[lubricated][ny:]).min() > 0.0


def test_limited_outflow_matches_the_reference(rng):
    content, own, upstream, found = (*rng.random((3, *CELLS)), np.empty(CELLS))
    reynolds.limited_outflow(content, own, upstream, DX, found)
    through = np.zeros(
        (CELLS[0] + 1, CELLS[1])
    )  # x faces; the outer two and the first inner one stay zero
    through[2:-1] = own[1:-1] * content[1:-1] - upstream[1:-1] * content[:-2]
    np.testing.assert_allclose(found, np.diff(through, axis=0) / DX, rtol=1e-12, atol=1e-12)


def test_a_limiter_of_one_half_gives_the_second_order_wedge(rng, film):
    pressure, inlet = rng.random(CELLS), rng.random(CELLS[1])
    added, half = np.empty(CELLS), np.full(CELLS, 0.5)
    reynolds.limited_outflow(film.content, half, half, DX, added)
    first = outflow(pressure, film, inlet, wedge=(0.0, 0.0))
    np.testing.assert_allclose(
        first + added, outflow(pressure, film, inlet), rtol=1e-12, atol=1e-12
    )


def test_fluid_diagonal_is_that_of_the_stencil_bounded_by_the_stiff_film(film):
    found = np.empty(CELLS)
    reynolds.fluid_diagonal(film, make_faces(film), COMPLIANCE, DX, DY, found)
    own = np.diag(first_order_rows(film)).reshape(CELLS)
    above = np.concatenate([film.content_by_gap[:1], film.content_by_gap[:-1]])
    wedge = film.content_by_gap * COMPLIANCE[0] - above * COMPLIANCE[1] + film.content_by_pressure
    least = own - wedge / DX + (COMPLIANCE[0] - COMPLIANCE[1]) / DX
    np.testing.assert_allclose(found, np.maximum(own, least), rtol=1e-12)


@pytest.mark.parametrize("outer_coupled", [False, True])
@pytest.mark.parametrize("across", [8, 7, 2, 1])
@pytest.mark.parametrize("parity", [0, 1])
def test_relaxed_lines_leave_no_residual(rng, parity, across, outer_coupled):
    """The lines in between are fixed; with an odd number, the first and last are not coupled."""
    cells = CELLS[0], across
    stencil = Stencil(5.0 + rng.random(cells), *(-rng.random(cells) for _ in range(4)))
    outer = random_outer_couplings(cells, rng if outer_coupled else None)
    parts = np.empty((7, CELLS[0], (across + 1 - parity) // 2))
    lines = (
        line_relaxation.LineFactors(*parts)
        if outer_coupled
        else line_relaxation.LineFactors(*parts[:5], *outer)
    )
    line_relaxation.factor_lines(stencil, outer, parity, 0.02 if outer_coupled else 0.0, lines)
    residual, correction = rng.standard_normal((2, *cells))
    found = np.empty_like(lines.lower)
    line_relaxation.relax_lines(
        lines, parity, residual[:, parity::2].copy(), correction[:, 1 - parity :: 2].copy(), found
    )
    correction[:, parity::2] = found
    if across % 2:
        stencil.north[:, -1] = stencil.south[:, 0] = 0.0
    remaining = residual - (
        dense(stencil, outer if outer_coupled else None) @ correction.ravel()
    ).reshape(cells)
    np.testing.assert_allclose(remaining[:, parity::2], 0.0, atol=1e-12)
    assert across == 1 or np.abs(remaining[:, 1 - parity :: 2]).max() > 0.1


def test_a_vanishing_pivot_is_replaced(rng):
    """Pentadiagonal lines need not be diagonally dominant; elimination never divides by zero."""
    stencil, outer = (
        Stencil(*(-rng.random(CELLS) for _ in range(5))),
        random_outer_couplings(CELLS, rng),
    )
    stencil.centre[0] = 0.0
    lines = line_relaxation.LineFactors(*np.empty((7, CELLS[0], CELLS[1] // 2)))
    line_relaxation.factor_lines(stencil, outer, 0, 0.02, lines)
    least = 0.02 * (np.abs(stencil.west) + np.abs(stencil.centre) + np.abs(stencil.east))[:, ::2]
    assert np.all(1.0 / lines.inverse >= 0.999 * least)
    np.testing.assert_allclose(lines.inverse[0], 1.0 / least[0])


@pytest.mark.parametrize("outer_coupled", [False, True])
@pytest.mark.parametrize("across", [8, 7, 1])
def test_split_residual_is_the_matrix_product(rng, across, outer_coupled):
    cells = CELLS[0], across
    stencil = Stencil(5.0 + rng.random(cells), *(-rng.random(cells) for _ in range(4)))
    residual, correction = rng.standard_normal((2, *cells))
    even, odd = np.empty((CELLS[0], (across + 1) // 2)), np.empty((CELLS[0], across // 2))
    outer = random_outer_couplings(cells, rng if outer_coupled else None)
    line_relaxation.split_residual(stencil, outer, residual, correction, even, odd)
    expected = residual - (
        dense(stencil, outer if outer_coupled else None) @ correction.ravel()
    ).reshape(cells)
    np.testing.assert_allclose(even, expected[:, ::2], atol=1e-12)
    np.testing.assert_allclose(odd, expected[:, 1::2], atol=1e-12)
    merged = np.ones(cells)
    line_relaxation.add_lines(even, odd, merged)
    np.testing.assert_allclose(merged, expected + 1.0, atol=1e-12)


@pytest.mark.parametrize("block", [(1, 1), (2, 2), (3, 3), (2, 8), (4, 3)])
def test_aggregation_is_a_galerkin_product(rng, stencil, block):
    """R A R^T with R = 1 in the active cells of a block; restrict, prolong and the coarse stencil
    use the same R.
    """
    active, scale = rng.random(CELLS) < 0.7, 0.5 + rng.random(CELLS)
    active[: block[0], : block[1]] = False  # one block without active cells
    weight = active * scale
    cells = tuple(-(-n // size) for n, size in zip(CELLS, block, strict=True))
    coarse = Stencil(*(np.empty(cells) for _ in range(5)))
    line_relaxation.aggregate_stencil(stencil, weight, block, coarse)
    block_index = (np.arange(CELLS[0])[:, None] // block[0]) * cells[1] + np.arange(
        CELLS[1]
    ) // block[1]
    gather = np.zeros((cells[0] * cells[1], active.size))
    gather[block_index.ravel(), np.arange(active.size)] = active.ravel()
    expected = gather @ (scale.ravel()[:, None] * dense(stencil)) @ gather.T
    empty = np.diag(expected) == 0.0
    expected[empty, empty] = 1.0
    np.testing.assert_allclose(dense(coarse), expected, atol=1e-12)

    residual, restricted = rng.standard_normal(CELLS), np.empty(cells)
    line_relaxation.restrict(residual, weight, block, restricted)
    np.testing.assert_allclose(restricted.ravel(), gather @ (scale * residual).ravel(), atol=1e-12)
    spread, prolonged = rng.standard_normal(cells), np.empty(CELLS)
    line_relaxation.prolong(spread, weight, block, prolonged)
    np.testing.assert_allclose(prolonged.ravel(), gather.T @ spread.ravel(), atol=1e-12)


@pytest.mark.parametrize("cells", [(9, 7), (5, 2), (6, 1), (1, 4)])
def test_the_factored_matrix_solves_the_stencil(rng, cells):
    stencil = Stencil(5.0 + rng.random(cells), *(-rng.random(cells) for _ in range(4)))
    pattern, rhs = five_point_pattern(cells), rng.standard_normal(cells)
    found = pattern.solve(pattern.factored(stencil), rhs)
    np.testing.assert_allclose(dense(stencil) @ found.ravel(), rhs.ravel(), atol=1e-12)


@pytest.mark.parametrize("cells", [(150, 70), (40, 33), (64, 8)])
def test_multigrid_approximates_the_direct_solution(rng, cells):
    """Film with mobility varying by a factor of 1000 and a tenth of the cells ruptured."""
    mobility = np.exp(rng.uniform(0.0, 7.0, cells))
    east = 2.0 / (1.0 / mobility + 1.0 / np.roll(mobility, -1, 0))
    north = 2.0 / (1.0 / mobility + 1.0 / np.roll(mobility, -1, 1))
    west, south = np.roll(east, 1, 0), np.roll(north, 1, 1)
    stencil = Stencil(east + west + north + south, -west, -east, -north, -south)
    weight = np.where(rng.random(cells) < 0.9, 1.0, 0.0)
    sums = Stencil(*np.empty((5, *(-(-n // 2) for n in cells))))
    line_relaxation.aggregate_stencil(stencil, weight, (2, 2), sums)
    residual, rhs = rng.standard_normal(cells), np.empty(sums.centre.shape)
    line_relaxation.restrict(residual, weight, (2, 2), rhs)
    exact = five_point_pattern(rhs.shape).solve(five_point_pattern(rhs.shape).factored(sums), rhs)
    found = MultigridSolver(stencil, weight)(residual)
    expected = np.where(
        weight > 0.0, np.repeat(np.repeat(exact, 2, 0), 2, 1)[: cells[0], : cells[1]], 0.0
    )
    assert np.linalg.norm(found - expected) < 0.2 * np.linalg.norm(expected)
    assert (found[weight == 0.0] == 0.0).all()


def test_the_coarsest_grid_is_inverted(rng):
    """Not diagonally dominant, so pivoting is needed; a singular matrix is refused."""
    cells = 3, 4
    parts = Stencil(*rng.standard_normal((5, *cells)))
    inverse = np.empty((12, 12))
    assert multigrid.invert(parts, inverse)
    np.testing.assert_allclose(inverse @ dense(parts), np.eye(12), atol=1e-9)
    assert not multigrid.invert(Stencil(*np.zeros((5, *cells))), inverse)


@pytest.mark.parametrize("cells", [(7, 9), (6, 4), (5, 6)])
def test_restriction_and_prolongation_over_pairs(rng, cells):
    fine, weight = (
        rng.standard_normal(cells),
        np.where(rng.random(cells) < 0.7, rng.random(cells), 0.0),
    )
    for halved in ((True, True), (True, False), (False, True)):
        coarse = tuple(-(-n // 2) if half else n for n, half in zip(cells, halved, strict=True))
        where = [np.arange(n) // (2 if half else 1) for n, half in zip(cells, halved, strict=True)]
        scales, sums, expected = rng.random(coarse), np.empty(coarse), np.zeros(coarse)
        multigrid.restrict_scaled(fine, weight, scales, sums)
        np.add.at(expected, np.ix_(*where), fine * weight)
        np.testing.assert_allclose(sums, expected * scales, rtol=1e-12, atol=1e-12)
        prolonged = fine.copy()
        multigrid.add_prolonged(sums, weight, prolonged)
        np.testing.assert_allclose(
            prolonged, fine + np.where(weight > 0.0, sums[np.ix_(*where)], 0.0), rtol=1e-12
        )


@pytest.fixture(scope="module")
def evaluation():
    """A rough contact before convergence: all four states occur and no equation is satisfied."""
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


def test_each_cell_uses_the_equation_of_its_state(evaluation):
    problem, state, p = evaluation.problem, evaluation.rows.state, evaluation.pressure
    assert set(np.unique(state)) == {RUPTURED, TOUCHING, LUBRICATED, CAPPED}
    gap = (evaluation.gap - problem.contact_gap) * evaluation.rows.contact_scale
    fluid = evaluation.outflow * evaluation.rows.fluid_scale
    expected = np.maximum(np.minimum(p, np.minimum(gap, fluid)), p - problem.p_cap)
    np.testing.assert_array_equal(evaluation.residual, expected)


def test_the_linearisation_is_the_derivative_of_the_equations(evaluation):
    """Central differences of gap, outflow and pressure in their active cells, away from kinks."""
    problem, rng = evaluation.problem, np.random.default_rng(9)
    step = 1e-6
    d_pressure, d_approach = rng.standard_normal(problem.cells), 0.7
    approach = float(
        np.mean(evaluation.gap - problem.undeformed - problem.deflection(evaluation.pressure))
    )
    ahead, behind = (
        problem.evaluate(
            evaluation.pressure + sign * step * d_pressure, approach + sign * step * d_approach
        )
        for sign in (1.0, -1.0)
    )
    found = Linear(evaluation, dtype=np.float64).product(d_pressure, d_approach)
    d_outflow = (ahead.outflow - behind.outflow) / (2.0 * step) * evaluation.rows.fluid_scale
    d_gap = (ahead.gap - behind.gap) / (2.0 * step) * evaluation.rows.contact_scale
    expected = np.choose(evaluation.rows.state, [d_pressure, d_gap, d_outflow, d_pressure])
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


def test_film_slopes_match_differences(evaluation):
    """Derivatives of content and mobility by gap and pressure, in cells without contact."""
    problem, film = evaluation.problem, evaluation.film
    step = 1e-6
    separated = evaluation.gap > problem.contact_gap + 10.0 * step
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
                    (evaluation.pressure + sign * change[0]) * problem.p_scale,
                    evaluation.gap + sign * change[1],
                )
                for sign in (1.0, -1.0)
            )
        )
        np.testing.assert_allclose(
            by_content[separated], (c1 - c0)[separated] / (2.0 * step), rtol=1e-6
        )
        np.testing.assert_allclose(
            by_mobility[separated], (e1 - e0)[separated] / (2.0 * step), rtol=1e-5
        )
    in_contact = evaluation.gap <= problem.contact_gap
    assert in_contact.any()
    assert not film.content_by_gap[in_contact].any()
    assert not film.log_mobility_by_gap[in_contact].any()


def test_the_approximate_inverse_is_linear_and_zero_in_known_cells(evaluation):
    inverse = Linear(evaluation, dtype=np.float64)
    first, second = (
        np.random.default_rng(10).standard_normal((2, *evaluation.problem.cells))
        * evaluation.unknown
    )
    np.testing.assert_allclose(
        inverse(first + 2.0 * second), inverse(first) + 2.0 * inverse(second), atol=1e-9
    )
    assert not inverse(first)[~evaluation.unknown].any()


def test_single_precision_agrees_with_double_precision(evaluation):
    single, double = Linear(evaluation), Linear(evaluation, dtype=np.float64)
    d_pressure = (
        np.random.default_rng(11).standard_normal(evaluation.problem.cells) * evaluation.unknown
    )
    for found, expected in (
        (single.product(d_pressure.astype(np.float32), 0.3), double.product(d_pressure, 0.3)),
        (single(d_pressure.astype(np.float32)), double(d_pressure)),
    ):
        assert found.dtype == np.float32
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_coarsening_preserves_the_contact(evaluation):
    """Average heights, evaluate the parabola at the new cell centres, keep load and size."""
    fine = evaluation.problem
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


def test_no_kernel_raises_on_a_division_by_zero():
    """A zero pivot ends a search as not converged; see `asperity.kernels.compiled.njit`."""
    modules = [
        import_module(f"asperity.kernels.{module.name}")
        for module in iter_modules(kernels.__path__)
    ]
    compiled = {k for module in modules for k in vars(module).values() if isinstance(k, Dispatcher)}
    assert len(compiled) > 40
    assert {kernel.targetoptions["error_model"] for kernel in compiled} == {"numpy"}


def test_lines_with_a_zero_pivot_have_an_infinite_inverse(stencil):
    singular = Stencil(*(np.zeros_like(part) for part in stencil))
    empty = np.empty((0, 0))
    lines = line_relaxation.LineFactors(*np.empty((5, CELLS[0], CELLS[1] // 2)), empty, empty)
    line_relaxation.factor_lines(singular, OuterNeighbours(empty, empty), 0, 0.0, lines)
    assert np.isinf(lines.inverse[0]).all()
