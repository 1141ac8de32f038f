"""What each type of sensor measures, against what is known of the motion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_core.description import Body, Bumper, Imu, Lidar, Scene
from frobs_core.models import Box, Pose
from frobs_core.util.errors import ConfigurationError
from frobs_core.util.rotations import quat_from_axis_angle
from frobs_devkit.testing.simulator.robots import ROVER

World = Callable[..., Any]
FREE = replace(ROVER, base="floating")
UP = np.array([[0.0, 0.0, 1.0]])


def test_a_lidar_without_an_end_goes_once_round_evenly() -> None:
    lidar = Lidar(frame="hull", rays=8, angle_min=0.0, range_min=0.1, range_max=5.0)
    np.testing.assert_allclose(lidar.angles, np.arange(8) * math.pi / 4)
    assert replace(lidar, rays=4).angles.tolist() == pytest.approx([0.0, math.pi / 2, math.pi, 1.5 * math.pi])
    assert Lidar(frame="hull", rays=1, range_min=0.1, range_max=5.0).angles.tolist() == [-math.pi]


def test_a_lidar_with_an_end_has_a_ray_at_it() -> None:
    lidar = Lidar(frame="hull", rays=3, angle_min=-1.0, angle_max=1.0, range_min=0.1, range_max=5.0)
    assert lidar.angles.tolist() == [-1.0, 0.0, 1.0]


def test_a_bumper_tells_of_the_wall_and_not_of_the_floor(world: World) -> None:
    w = world(2, bumper=Bumper(frame="hull"), floor=Bumper(frame="left_wheel", ignore=()))
    w.step(20)
    assert w.sensors.read("bumper").tolist() == [[0.0], [0.0]]
    assert w.sensors.read("floor").tolist() == [[1.0], [1.0]]
    w.robot.write_base_pose(np.array([[1.74, 0.0, 0.05]]), np.array([[1.0, 0.0, 0.0, 0.0]]), np.array([True, False]))
    w.robot.command(np.array([[8.0, 8.0]] * 2))
    w.step(10)
    assert w.sensors.read("bumper").tolist() == [[1.0], [0.0]]
    w.reset()
    assert w.sensors.read("bumper").tolist() == [[0.0], [0.0]]


def test_a_bumper_has_further_links_and_ignores_what_it_is_told_to(world: World) -> None:
    wheels = Bumper(frame="left_wheel", links=("right_wheel",), ignore=())
    w = world(1, wheels=wheels, blind=replace(wheels, ignore=("floor",)))
    w.step(20)
    assert w.sensors.read("wheels").item() == 1.0
    assert w.sensors.read("blind").item() == 0.0


def test_a_bumper_can_ignore_a_body_of_the_scene(world: World) -> None:
    near = Body(geometry=Box((0.2, 4.0, 1.0)), pose=Pose(pos=(0.249, 0.0, 0.5)))
    scene = Scene(bodies={"near": near})
    w = world(1, scene=scene, told=Bumper(frame="hull"), not_told=Bumper(frame="hull", ignore=("floor", "near")))
    w.step()
    assert w.sensors.read("told").item() == 1.0
    assert w.sensors.read("not_told").item() == 0.0


def test_a_bumper_needs_no_floor(world: World) -> None:
    w = world(1, robot=FREE, scene=Scene(floor=False), bumper=Bumper(frame="hull"))
    w.step()
    assert w.sensors.read("bumper").item() == 0.0


def test_an_imu_at_rest_feels_that_it_is_held_up(world: World) -> None:
    w = world(2, imu=Imu(frame="hull"))
    assert w.sensors.read("imu").tolist() == [[0.0, 0.0, 0.0, 0.0, 0.0, 9.81]] * 2
    w.step(50)
    np.testing.assert_allclose(w.sensors.read("imu"), [[0.0, 0.0, 0.0, 0.0, 0.0, 9.81]] * 2, atol=0.02)


def test_an_imu_in_free_fall_feels_nothing_however_it_is_turned(world: World) -> None:
    w = world(2, robot=FREE, scene=Scene(floor=False), imu=Imu(frame="hull"))
    quat = quat_from_axis_angle(np.array([0.6, 0.8, 0.0]), np.array([0.7, -1.2]))
    w.robot.write_base_pose(np.zeros((2, 3)), quat)
    w.sensors.reset(None, w.rng)
    assert np.sqrt((w.sensors.read("imu")[:, 3:] ** 2).sum(axis=1)) == pytest.approx([9.81, 9.81])
    w.step()
    np.testing.assert_allclose(w.sensors.read("imu"), 0.0, atol=1e-6)


def test_an_imu_off_the_centre_of_a_turn_feels_the_centripetal_force(world: World) -> None:
    w = world(1, robot=FREE, scene=Scene(floor=False, gravity=(0.0, 0.0, 0.0)),
              centre=Imu(frame="hull"), rim=Imu(frame="hull", offset=(0.5, 0.0, 0.0)))  # fmt: skip
    w.robot.write_base_twist(np.zeros((1, 3)), 2.0 * UP)
    w.sensors.reset(None, w.rng)
    w.step(3)
    centre, rim = w.sensors.read("centre")[0], w.sensors.read("rim")[0]
    np.testing.assert_allclose(rim[:3], [0.0, 0.0, 2.0], atol=1e-3)
    # Over a step in which the frame turns by 0.04 rad the mean is half of that behind the end.
    wanted = 2.0**2 * 0.5 * np.array([-math.cos(0.02), math.sin(0.02), 0.0]) * math.sin(0.02) / 0.02
    np.testing.assert_allclose(rim[3:] - centre[3:], wanted, atol=5e-3)


def test_an_imu_tells_gravity_as_it_is(world: World) -> None:
    w = world(2, imu=Imu(frame="hull"))
    w.simulation.write_parameter("gravity", "", np.array([[0.0, 0.0, -3.7]]), np.array([True, False]))
    w.reset()
    assert w.sensors.read("imu")[:, 5].tolist() == [3.7, 9.81]


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Lidar(frame="a", rays=0, range_min=0.1, range_max=1.0), "rays is 0"),
        (lambda: Lidar(frame="a", rays=2.5, range_min=0.1, range_max=1.0), "rays is 2.5"),  # type: ignore[arg-type]
        (lambda: Lidar(frame="a", rays=2, range_min=1.0, range_max=1.0), "range_max is 1.0; it must be above 1"),
        (lambda: Lidar(frame="a", rays=2, range_min=-1.0, range_max=1.0), "range_min"),
        (lambda: Lidar(frame="a", rays=2, angle_min=1.0, angle_max=0.0, range_min=0.1, range_max=1.0), "angle_max"),
        (lambda: Lidar(frame="a", rays=2, range_min=0.1, range_max=math.inf), "range_max is inf"),
        (lambda: Imu(frame="a", noise=-0.1), r"noise is -0.1; it must be in \[0, inf\]"),
        (lambda: Imu(frame="a", noise=(0.1, 0.1)), "it must be one number, or 6 numbers"),
        (lambda: Imu(frame="a", noise="much"), "noise is 'much'"),  # type: ignore[arg-type]
        (lambda: Imu(frame="a", rate=0.0), "rate is 0.0; it must be above 0"),
        (lambda: Imu(frame="a", delay=-1.0), "delay"),
        (lambda: Imu(frame="a", dropout=1.5), r"dropout is 1.5; it must be in \[0, 1\]"),
        (lambda: Imu(frame="a", offset=(0.0, 1.0)), "offset"),  # type: ignore[arg-type]
        (lambda: Bumper(frame="a", noise=0.1), "a bumper reads 0 or 1"),
        (lambda: Bumper(frame="a", ignore="floor"), "ignore is 'floor'"),  # type: ignore[arg-type]
    ],
)
def test_impossible_numbers_are_refused(make: Callable[[], Any], named: str) -> None:
    with pytest.raises(ConfigurationError, match=named):
        make()
