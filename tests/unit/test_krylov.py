import numpy as np
import pytest

from asperity.ehl.linear_solvers.gmres import Shifted, gmres


@pytest.fixture
def system():
    rng = np.random.default_rng(4)
    matrix = np.eye(60) * 4.0 + rng.standard_normal((60, 60)) / 2.0
    return matrix, rng.standard_normal(60)


def identity(vector):
    return vector


def test_gmres_agrees_with_a_direct_solver(system):
    matrix, rhs = system
    found = gmres(matrix.__matmul__, identity, rhs, tolerance=1e-11, max_steps=60)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, rhs), rtol=1e-8)


@pytest.mark.parametrize("tolerance", [0.5, 0.1, 1e-3, 1e-6])
def test_gmres_stops_on_the_true_residual_with_any_preconditioner(system, tolerance):
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


def test_at_the_step_limit_gmres_returns_the_minimal_residual_of_its_space(system):
    matrix, rhs = system
    found = gmres(matrix.__matmul__, identity, rhs, tolerance=1e-12, max_steps=5)
    space = np.stack([np.linalg.matrix_power(matrix, k) @ rhs for k in range(5)], axis=1)
    space, _ = np.linalg.qr(space)
    best, *_ = np.linalg.lstsq(matrix @ space, rhs)
    np.testing.assert_allclose(found, space @ best, rtol=1e-8)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_gmres_solves_complex_systems(system, dtype):
    rng = np.random.default_rng(5)
    matrix = (system[0] + 1j * rng.standard_normal((60, 60)) / 2.0).astype(dtype)
    rhs = (system[1] * np.exp(2j * np.pi * rng.random(60))).astype(dtype)
    for tolerance in (0.1, 1e-4):
        found = gmres(matrix.__matmul__, identity, rhs, tolerance=tolerance, max_steps=60)
        assert found.dtype == dtype
        residual = np.linalg.norm(matrix @ found - rhs) / np.linalg.norm(rhs)
        assert 0.05 * tolerance < residual < 1.001 * tolerance
    exact = np.linalg.solve(matrix.astype(complex), rhs)
    np.testing.assert_allclose(
        gmres(matrix.__matmul__, identity, rhs, tolerance=1e-6, max_steps=60), exact, atol=1e-5
    )


def test_a_zero_right_hand_side_gives_zero(system):
    assert not gmres(system[0].__matmul__, identity, np.zeros(60), tolerance=0.1, max_steps=9).any()


def shifted_solver(dtype, spread=1.0):
    """Return a solver for 60 equations at Ω = 1.7, the weights of the sum, and a function that
    gives matrix and right-hand side at any Ω.
    """
    rng = np.random.default_rng(5)
    a = np.diag(np.linspace(1.0, 1.0 + spread, 60)) + 0.02 * rng.standard_normal((60, 60))
    b = 0.03 * rng.standard_normal((60, 60))
    rhs, weights = rng.standard_normal((2, 60)), rng.standard_normal(60)
    matrices = a.astype(dtype), b.astype(dtype)
    solver = Shifted(
        lambda v: (matrices[0] @ v, matrices[1] @ v),
        identity,
        tuple(rhs.astype(dtype)),
        weights,
        1.7,
        60,
    )
    return solver, weights, lambda at: (a + 1j * at * b, rhs[0] + 1j * at * rhs[1])


def test_the_shifted_solver_converges_and_returns_the_weighted_sum():
    solver, weights, equations = shifted_solver(np.complex128)
    while solver.residual > 1e-9:
        assert solver.step()
    np.testing.assert_allclose(solver.solution(), np.linalg.solve(*equations(1.7)), atol=1e-7)
    assert solver.sum == pytest.approx(weights @ solver.solution(), rel=1e-9)
    assert solver.count < 40


def test_the_shifted_solver_keeps_its_space_at_a_new_frequency():
    """The reported residual is that at the new frequency, not at the old one."""
    solver, _, equations = shifted_solver(np.complex128)
    for _ in range(8):
        solver.step()
    before = solver.residual
    solver.move(1.8)
    assert solver.count == 8
    assert before < solver.residual < 0.2
    matrix, rhs = equations(1.8)
    residual = rhs - matrix @ solver.solution()
    assert solver.residual == pytest.approx(
        np.linalg.norm(residual) / np.linalg.norm(rhs), rel=1e-9
    )
    while solver.residual > 1e-9:
        assert solver.step()
    np.testing.assert_allclose(solver.solution(), np.linalg.solve(matrix, rhs), atol=1e-7)


@pytest.mark.parametrize("spread", [1.0, 300.0])
def test_the_shifted_solver_reaches_single_precision(spread):
    """Building on the last vector alone, the second case would stagnate at 5e-4."""
    solver, _, equations = shifted_solver(np.complex64, spread)
    while solver.residual > 3e-6:
        assert not solver.full
        assert solver.step()
    np.testing.assert_allclose(solver.solution(), np.linalg.solve(*equations(1.7)), atol=1e-4)


def test_the_shifted_solver_continues_through_stagnation():
    """Each cell of a ring passes its value to the next: only the last step lowers the residual."""
    rhs = np.eye(8, dtype=complex)[0]
    solver = Shifted(
        lambda v: (np.roll(v, 1), 0.0 * v), identity, (rhs, 0.0 * rhs), np.ones(8), 1.0, 8
    )
    for _ in range(7):
        assert solver.step()
    assert solver.residual == pytest.approx(1.0)
    assert solver.step()
    np.testing.assert_allclose(solver.solution(), np.roll(rhs, -1), atol=1e-12)
