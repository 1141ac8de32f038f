from __future__ import annotations

import numpy as np
import pytest

from frobs_core.util.rotations import quat_rotate
from frobs_tasks_legacy.reach.task import at_limits, unit_direction
from frobs_tasks_reach.motion import oscillation
from frobs_tasks_reach.reach import distance, turn_back

RNG = np.random.default_rng(0)


def test_distance_is_the_length_of_the_vector():
    offset = RNG.normal(size=(5, 3))
    np.testing.assert_allclose(distance(offset), np.linalg.norm(offset, axis=1), rtol=1e-15)


@pytest.mark.parametrize("layout", [np.ascontiguousarray, np.asfortranarray], ids=["C", "F"])
def test_distance_of_a_row_does_not_depend_on_the_batch_or_its_layout(layout):
    offset = layout(RNG.normal(size=(7, 3)))
    alone = [distance(offset[i].copy()) for i in range(7)]
    assert (distance(offset) == alone).all()


def test_unit_direction_has_length_one_and_is_zero_at_the_goal():
    directions = unit_direction(np.array([[3.0, 0.0, 4.0], [0.0, 0.0, 0.0]]))
    np.testing.assert_array_equal(directions, [[0.6, 0.0, 0.8], [0.0, 0.0, 0.0]])


def test_at_limits_tells_a_joint_at_or_beyond_either_limit():
    positions = np.array([[0.0, 0.0], [0.99995, 0.0], [0.0, -1.2], [0.9998, 0.0]])
    assert at_limits(positions, -np.ones(2), np.ones(2), 1e-4).tolist() == [False, True, True, False]


def test_oscillation_velocity_is_the_derivative_of_its_offset():
    amplitude, frequency, phase = RNG.uniform(size=(3, 4, 3))
    time, h = RNG.uniform(0.0, 5.0, 4), 1e-6
    before, _ = oscillation(time - h, amplitude, frequency, phase)
    after, _ = oscillation(time + h, amplitude, frequency, phase)
    _, velocity = oscillation(time, amplitude, frequency, phase)
    np.testing.assert_allclose(velocity, (after - before) / (2 * h), atol=1e-8)


def test_turning_back_is_the_inverse_rotation():
    rng = np.random.default_rng(0)
    quat = rng.normal(size=(9, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    vector, out = rng.normal(size=(9, 3)), np.empty((9, 3))
    turn_back(quat, vector, out)
    np.testing.assert_allclose(quat_rotate(quat, out), vector, atol=1e-12)
    alone = np.empty((1, 3))
    turn_back(quat[4:5], vector[4:5], alone)
    assert (alone[0] == out[4]).all()
