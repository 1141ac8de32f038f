from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from frobs_core.util.rotations import (
    cross,
    matrix_from_quat,
    quat_conjugate,
    quat_difference,
    quat_from_axis_angle,
    quat_from_matrix,
    quat_from_rpy,
    quat_multiply,
    quat_rotate,
)

numbers = st.floats(-1, 1, allow_subnormal=False)
quats = (
    arrays(float, 4, elements=numbers).filter(lambda q: np.linalg.norm(q) > 0.1).map(lambda q: q / np.linalg.norm(q))
)
vectors = arrays(float, 3, elements=numbers)


def same(a, b):
    return min(np.abs(a - b).max(), np.abs(a + b).max()) < 1e-12


@given(quats, quats, vectors)
def test_product_rotates_as_one_after_the_other(first, second, vector):
    once = quat_rotate(quat_multiply(first, second), vector)
    assert once == pytest.approx(quat_rotate(first, quat_rotate(second, vector)), abs=1e-12)


@given(quats, vectors)
def test_conjugate_undoes(quat, vector):
    assert quat_rotate(quat_conjugate(quat), quat_rotate(quat, vector)) == pytest.approx(vector, abs=1e-12)


@given(quats, vectors)
def test_matrix_rotates_as_the_quaternion(quat, vector):
    assert matrix_from_quat(quat) @ vector == pytest.approx(quat_rotate(quat, vector), abs=1e-12)


@given(quats)
def test_matrix_and_back(quat):
    back = quat_from_matrix(matrix_from_quat(quat))
    assert same(back, quat)
    assert back[0] >= 0


@given(st.integers(0, 3), st.floats(1e-12, 1e-6))
def test_half_turns_lose_no_precision(axis, tiny):
    quat = np.full(4, tiny)
    quat[axis] = 1.0
    quat /= np.linalg.norm(quat)
    assert same(quat_from_matrix(matrix_from_quat(quat)), quat)


@given(quats, vectors.filter(lambda v: np.linalg.norm(v) > 1e-6), st.floats(-math.pi + 1e-6, math.pi - 1e-6))
def test_difference_is_the_rotation_between(current, axis, angle):
    axis = axis / np.linalg.norm(axis)
    target = quat_multiply(quat_from_axis_angle(axis, angle), current)
    assert quat_difference(target, current) == pytest.approx(axis * angle, abs=1e-9)
    assert quat_difference(-target, current) == pytest.approx(axis * angle, abs=1e-9)


@given(quats)
def test_difference_to_itself_is_zero(quat):
    assert quat_difference(quat, quat) == pytest.approx(np.zeros(3), abs=1e-12)


@given(arrays(float, 3, elements=st.floats(-7, 7)))
def test_rpy_are_turns_about_fixed_axes(rpy):
    x, y, z = (quat_from_axis_angle(axis, angle) for axis, angle in zip(np.eye(3), rpy, strict=True))
    assert same(quat_from_rpy(rpy), quat_multiply(z, quat_multiply(y, x)))


def test_known_values():
    assert quat_rotate(quat_from_axis_angle([0, 0, 1], math.pi / 2), [1, 0, 0]) == pytest.approx([0, 1, 0])
    assert quat_from_matrix(np.diag([1.0, -1.0, -1.0])).tolist() == [0, 1, 0, 0]


def test_leading_dimensions_broadcast():
    quats = quat_from_rpy(np.zeros((5, 1, 3)))
    assert quat_multiply(quats, quat_from_rpy(np.zeros((2, 3)))).shape == (5, 2, 4)
    assert quat_rotate(quats, np.zeros((2, 3))).shape == (5, 2, 3)
    assert quat_difference(quats, np.array([1.0, 0, 0, 0])).shape == (5, 1, 3)
    assert quat_from_axis_angle(np.array([1.0, 0, 0]), np.zeros((5, 2))).shape == (5, 2, 4)
    assert matrix_from_quat(quats).shape == (5, 1, 3, 3)


@pytest.mark.parametrize("n", [2, 7, 33])
def test_a_row_does_not_depend_on_how_many_there_are(n):
    rng = np.random.default_rng(n)
    a, b = (quat_from_rpy(rng.uniform(-3, 3, (n, 3))) for _ in range(2))
    v = rng.normal(size=(n, 3))
    for function, arguments in [
        (quat_multiply, (a, b)),
        (quat_rotate, (a, v)),
        (quat_difference, (a, b)),
        (quat_from_rpy, (v,)),
        (matrix_from_quat, (a,)),
        (quat_from_matrix, (matrix_from_quat(a),)),
        (quat_from_axis_angle, (v, v[:, 0])),
    ]:
        many = function(*arguments)
        for i in range(n):
            assert np.array_equal(function(*(x[i : i + 1] for x in arguments))[0], many[i]), function.__name__


def test_a_cross_product_has_the_bits_of_numpy() -> None:
    first, second = np.random.default_rng(0).normal(size=(2, 200, 3))
    together = cross(first, second)
    assert together.tobytes() == np.cross(first, second).tobytes()
    assert all(cross(first[i : i + 1], second[i : i + 1]).tobytes() == together[i].tobytes() for i in range(200))
    assert cross(first[0], second[:5]).tobytes() == np.cross(first[0], second[:5]).tobytes()
