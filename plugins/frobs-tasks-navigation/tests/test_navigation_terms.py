from __future__ import annotations

import numpy as np
import pytest

from frobs_tasks_navigation import terms


def test_yaw_survives_the_way_to_a_quaternion_and_back():
    yaw = np.linspace(-3.1, 3.1, 9)
    assert terms.yaw_of(terms.quat_of(yaw)) == pytest.approx(yaw)


def test_the_bearing_grows_to_the_left():
    offset = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, 0.0]])
    assert terms.bearing(offset, np.full(4, np.pi / 2)) == pytest.approx([-np.pi / 2, 0.0, np.pi / 2, 0.0])


def test_where_there_is_no_distance_nothing_is_nan():
    assert terms.distance(np.zeros((1, 2))).tolist() == [0.0]
    assert np.isfinite(terms.bearing(np.zeros((1, 2)), np.zeros(1))).all()


def test_distance_to_rectangles_is_zero_inside():
    points = np.array([[0.0, 0.0], [0.0, 2.0], [3.0, 4.0]])[:, None]
    centre, half = np.array([[0.0, 0.0]]), np.array([[1.0, 0.5]])
    assert terms.distance_to_rectangles(points, centre, np.zeros(1), half)[:, 0] == pytest.approx(
        [0.0, 1.5, np.hypot(2.0, 3.5)]
    )
    assert terms.distance_to_rectangles(points, centre, np.array([np.pi / 2]), half)[1, 0] == pytest.approx(1.0)


def test_to_and_fro_turns_when_it_should():
    time = np.array([0.0, 5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0])
    swung = terms.to_and_fro(time, np.array(10.0), np.array(20.0))
    assert swung == pytest.approx([0.0, 5.0, 10.0, 0.0, -10.0, 0.0, 10.0, 0.0, -10.0])
    assert np.abs(np.diff(terms.to_and_fro(np.linspace(0, 99, 1000), np.array(10.0), np.array(20.0)))).max() < 0.1


def test_outside_is_beyond_any_side():
    low, high = np.array([-1.0, -2.0]), np.array([1.0, 2.0])
    assert terms.outside(np.array([[0.0, 0.0], [1.1, 0.0], [0.0, -2.1]]), low, high).tolist() == [False, True, True]
