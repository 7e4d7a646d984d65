import numpy as np
import pytest

from asperity.ehl.krylov import gmres


@pytest.fixture
def system():
    rng = np.random.default_rng(4)
    matrix = np.eye(60) * 4.0 + rng.standard_normal((60, 60)) / 2.0
    return matrix, rng.standard_normal(60)


def same(vector):
    return vector


def test_it_solves_what_a_direct_solver_solves(system):
    matrix, wanted = system
    found = gmres(matrix.__matmul__, same, wanted, tolerance=1e-11, most_steps=60)
    np.testing.assert_allclose(found, np.linalg.solve(matrix, wanted), rtol=1e-8)


@pytest.mark.parametrize("tolerance", [0.5, 0.1, 1e-3, 1e-6])
def test_it_stops_on_the_true_residual_whatever_the_preconditioner(system, tolerance):
    matrix, wanted = system
    scale = np.geomspace(1e-3, 1e3, 60)
    found = gmres(matrix.__matmul__, lambda v: v * scale, wanted, tolerance=tolerance, most_steps=60)
    assert np.linalg.norm(matrix @ found - wanted) < tolerance * np.linalg.norm(wanted)


def test_an_exact_preconditioner_needs_one_step(system):
    matrix, wanted = system
    inverse, products = np.linalg.inv(matrix), []

    def product(vector):
        products.append(1)
        return matrix @ vector

    found = gmres(product, inverse.__matmul__, wanted, tolerance=1e-9, most_steps=60)
    np.testing.assert_allclose(matrix @ found, wanted, atol=1e-9)
    assert len(products) == 1


def test_out_of_steps_it_returns_the_least_residual_of_the_space_it_has(system):
    matrix, wanted = system
    found = gmres(matrix.__matmul__, same, wanted, tolerance=1e-12, most_steps=5)
    space = np.stack([np.linalg.matrix_power(matrix, k) @ wanted for k in range(5)], axis=1)
    space, _ = np.linalg.qr(space)
    best, *_ = np.linalg.lstsq(matrix @ space, wanted)
    np.testing.assert_allclose(found, space @ best, rtol=1e-8)


@pytest.mark.parametrize("dtype", [np.complex64, np.complex128])
def test_complex_systems_too(system, dtype):
    rng = np.random.default_rng(5)
    matrix = (system[0] + 1j * rng.standard_normal((60, 60)) / 2.0).astype(dtype)
    wanted = (system[1] * np.exp(2j * np.pi * rng.random(60))).astype(dtype)
    for tolerance in (0.1, 1e-4):
        found = gmres(matrix.__matmul__, same, wanted, tolerance=tolerance, most_steps=60)
        assert found.dtype == dtype
        left = np.linalg.norm(matrix @ found - wanted) / np.linalg.norm(wanted)
        assert 0.05 * tolerance < left < 1.001 * tolerance
    exact = np.linalg.solve(matrix.astype(complex), wanted)
    np.testing.assert_allclose(gmres(matrix.__matmul__, same, wanted, tolerance=1e-6, most_steps=60), exact, atol=1e-5)


def test_nothing_wanted_is_nothing_done(system):
    assert not gmres(system[0].__matmul__, same, np.zeros(60), tolerance=0.1, most_steps=9).any()
