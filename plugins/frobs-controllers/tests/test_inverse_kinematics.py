import numpy as np

from frobs_controllers.inverse_kinematics import solve_3x3


def systems(count):
    rng = np.random.default_rng(0)
    jacobian = rng.normal(size=(count, 3, 6))
    return jacobian @ jacobian.transpose(0, 2, 1) + 0.01 * np.eye(3), rng.normal(size=(count, 3, 1))


def test_small_systems_are_solved_as_numpy_solves_them():
    matrix, vector = systems(200)
    assert np.allclose(solve_3x3(matrix, vector), np.linalg.solve(matrix, vector), rtol=1e-9, atol=1e-12)


def test_a_single_system_gets_the_bits_that_it_gets_among_many():
    matrix, vector = systems(500)
    together = solve_3x3(matrix, vector)
    for i in range(500):
        assert np.array_equal(solve_3x3(matrix[i : i + 1], vector[i : i + 1])[0], together[i])
