import numpy as np

from frobs_controllers import rotations
from frobs_controllers.inverse_kinematics import joints_between, solve_3x3
from frobs_core import rotations as core


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


def test_joints_between_the_root_and_a_link_are_found(fake_arm):
    model = fake_arm().model
    assert joints_between(model, "link_3") == {"joint_1", "joint_2", "joint_3"}
    assert joints_between(model, model.root) == set()


def test_quaternions_agree_with_those_of_the_core():
    rng = np.random.default_rng(0)
    first, second = (quat / np.linalg.norm(quat, axis=-1, keepdims=True) for quat in rng.normal(size=(2, 50, 4)))
    assert np.allclose(rotations.quat_multiply(first, second), core.quat_multiply(first, second))
    vector = rng.normal(size=(50, 3)) * 0.1
    turn = rotations.quat_from_rotation_vector(vector)
    assert np.allclose(core.quat_difference(turn, np.tile([1.0, 0, 0, 0], (50, 1))), vector)
    assert np.allclose(rotations.quat_between(second, -rotations.quat_multiply(turn, second)), vector, rtol=0.01)
    assert np.array_equal(rotations.quat_from_rotation_vector(np.zeros((1, 3))), [[1.0, 0.0, 0.0, 0.0]])
