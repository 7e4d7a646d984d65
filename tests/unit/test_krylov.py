import numpy as np
import pytest

from asperity.ehl.linear_solvers.gmres import Shifted, gmres


@pytest.fixture
def system():
    rng = np.random.default_rng(4)
    matrix = np.eye(60) * 4.0 + rng.standard_normal((60, 60)) / 2.0
    return matrix, rng.standard_normal(60)


def same(vector):
    return vector


def test_it_solves_what_a_direct_solver_solves(system):
    matrix, rhs = system
    found = gmres(matrix.__matmul__, same, rhs, tolerance=1e-11, max_steps=60)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, rhs), rtol=1e-8)


@pytest.mark.parametrize("tolerance", [0.5, 0.1, 1e-3, 1e-6])
def test_it_stops_on_the_true_residual_whatever_the_preconditioner(system, tolerance):
    matrix, rhs = system
    scale = np.geomspace(1e-3, 1e3, 60)
    found = gmres(matrix.__matmul__, lambda v: v * scale, rhs, tolerance=tolerance, max_steps=60)
    assert np.linalg.norm(matrix @ found - rhs) < tolerance * np.linalg.norm(rhs)


def test_an_exact_preconditioner_needs_one_step(system):
    matrix, rhs = system
    inverse, products = np.linalg.inv(matrix), []

    def product(vector):
        products.append(1)
        return matrix @ vector

    found = gmres(product, inverse.__matmul__, rhs, tolerance=1e-9, max_steps=60)
    np.testing.assert_allclose(matrix @ found, rhs, atol=1e-9)
    assert len(products) == 1


def test_out_of_steps_it_returns_the_least_residual_of_the_space_it_has(system):
    matrix, rhs = system
    found = gmres(matrix.__matmul__, same, rhs, tolerance=1e-12, max_steps=5)
    space = np.stack([np.linalg.matrix_power(matrix, k) @ rhs for k in range(5)], axis=1)
    space, _ = np.linalg.qr(space)
    best, *_ = np.linalg.lstsq(matrix @ space, rhs)
    np.testing.assert_allclose(found, space @ best, rtol=1e-8)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_complex_systems_too(system, dtype):
    rng = np.random.default_rng(5)
    matrix = (system[0] + 1j * rng.standard_normal((60, 60)) / 2.0).astype(dtype)
    rhs = (system[1] * np.exp(2j * np.pi * rng.random(60))).astype(dtype)
    for tolerance in (0.1, 1e-4):
        found = gmres(matrix.__matmul__, same, rhs, tolerance=tolerance, max_steps=60)
        assert found.dtype == dtype
        left = np.linalg.norm(matrix @ found - rhs) / np.linalg.norm(rhs)
        assert 0.05 * tolerance < left < 1.001 * tolerance
    exact = np.linalg.solve(matrix.astype(complex), rhs)
    np.testing.assert_allclose(
        gmres(matrix.__matmul__, same, rhs, tolerance=1e-6, max_steps=60), exact, atol=1e-5
    )


def test_nothing_wanted_is_nothing_done(system):
    assert not gmres(system[0].__matmul__, same, np.zeros(60), tolerance=0.1, max_steps=9).any()


def shifted(kind, spread=1.0):
    """A sweep of 60 equations at Ω = 1.7, weights of the sum, and matrix and right-hand side at any
    Ω.
    """
    rng = np.random.default_rng(5)
    a = np.diag(np.linspace(1.0, 1.0 + spread, 60)) + 0.02 * rng.standard_normal((60, 60))
    b = 0.03 * rng.standard_normal((60, 60))
    rhs, bearing = rng.standard_normal((2, 60)), rng.standard_normal(60)
    matrices = a.astype(kind), b.astype(kind)
    sweep = Shifted(
        lambda v: (matrices[0] @ v, matrices[1] @ v),
        same,
        tuple(rhs.astype(kind)),
        bearing,
        1.7,
        60,
    )
    return sweep, bearing, lambda at: (a + 1j * at * b, rhs[0] + 1j * at * rhs[1])


def test_a_sweep_solves_what_it_says_and_knows_the_sum_on_the_way():
    sweep, bearing, equations = shifted(np.complex128)
    while sweep.left > 1e-9:
        assert sweep.step()
    np.testing.assert_allclose(sweep.answer(), np.linalg.solve(*equations(1.7)), atol=1e-7)
    assert sweep.sum == pytest.approx(bearing @ sweep.answer(), rel=1e-9)
    assert sweep.count < 40


def test_a_sweep_that_moves_keeps_what_it_knows():
    """And says what it leaves of the equations at the new frequency, not at the old."""
    sweep, _, equations = shifted(np.complex128)
    for _ in range(8):
        sweep.step()
    before = sweep.left
    sweep.move(1.8)
    assert sweep.count == 8
    assert before < sweep.left < 0.2
    matrix, rhs = equations(1.8)
    rest = rhs - matrix @ sweep.answer()
    assert sweep.left == pytest.approx(np.linalg.norm(rest) / np.linalg.norm(rhs), rel=1e-9)
    while sweep.left > 1e-9:
        assert sweep.step()
    np.testing.assert_allclose(sweep.answer(), np.linalg.solve(matrix, rhs), atol=1e-7)


@pytest.mark.parametrize("spread", [1.0, 300.0])
def test_a_sweep_in_single_precision_comes_as_far_as_that_tells(spread):
    """On from what the last step made of it alone, the second stops at 5e-4."""
    sweep, _, equations = shifted(np.complex64, spread)
    while sweep.left > 3e-6:
        assert not sweep.full
        assert sweep.step()
    np.testing.assert_allclose(sweep.answer(), np.linalg.solve(*equations(1.7)), atol=1e-4)


def test_a_sweep_goes_on_where_nothing_falls_until_the_end():
    """Each cell of a ring hands on to the next: no step but the last one meets anything."""
    rhs = np.eye(8, dtype=complex)[0]
    sweep = Shifted(lambda v: (np.roll(v, 1), 0.0 * v), same, (rhs, 0.0 * rhs), np.ones(8), 1.0, 8)
    for _ in range(7):
        assert sweep.step()
    assert sweep.left == pytest.approx(1.0)
    assert sweep.step()
    np.testing.assert_allclose(sweep.answer(), np.roll(rhs, -1), atol=1e-12)
