from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from frobs_controllers.differential_drive import DifferentialDrive
from frobs_core import plugins
from frobs_core.contracts import CommandMode
from frobs_core.description import Body, Contact, Placement, Scene
from frobs_core.models import Box, Pose, RobotModel, load_model
from frobs_robots_kobuki.kobuki import KOBUKI
from frobs_robots_kobuki.plugin import frobs_robots

SIMULATORS = [
    "mujoco",
    "pybullet",
]
CONTROL = 0.2  # [s]
TOUCHING = ["wheel_left_link", "wheel_right_link", "caster_front_link", "caster_back_link"]


class Driven:
    """A Kobuki on the floor, with its controller."""

    def __init__(self, simulator: str, physics_timestep: float, scene: Scene) -> None:
        placement = Placement(robot=KOBUKI, model=load_model(KOBUKI.model), command_mode=CommandMode.VELOCITY)
        build: Any = plugins.get_record("simulator", simulator).load()
        self.sim = build({"robot": placement}, scene, num_envs=1, physics_timestep=physics_timestep)
        self.sim.reset()
        self.robot = self.sim.robots["robot"]
        self._decimation = round(CONTROL / physics_timestep)
        self._controller = DifferentialDrive()
        self._controller.bind(self.robot, CONTROL, self._decimation)
        self._controller.reset(None)

    def drive(self, linear: float, angular: float, seconds: float) -> None:
        for _ in range(round(seconds / CONTROL)):
            self.robot.command(self._controller.apply(np.array([[linear, angular]])))
            self.sim.step(self._decimation)

    @property
    def twist(self) -> tuple[np.ndarray, np.ndarray]:
        linear, angular = self.robot.base_twist
        return linear[0].copy(), angular[0].copy()

    @property
    def pos(self) -> np.ndarray:
        pos: np.ndarray = self.robot.base_pose[0][0].copy()
        return pos


@pytest.fixture(params=SIMULATORS)
def simulator(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(params=[0.005, 0.02], ids=["5 ms", "20 ms"])
def kobuki(simulator: str, request: pytest.FixtureRequest) -> Iterator[Driven]:
    driven = Driven(simulator, request.param, Scene())
    yield driven
    driven.sim.close()


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_model(KOBUKI.model)


def test_the_record_leads_to_the_robot() -> None:
    (record,) = frobs_robots()
    assert record.load() is KOBUKI


def test_wheels_masses_and_lidar_are_frobs_rls(model: RobotModel) -> None:
    assert model.joint_names == ("wheel_left_joint", "wheel_right_joint")
    drive, lidar = KOBUKI.differential_drive, KOBUKI.lidars["lidar"]
    assert drive is not None
    left, right = (model.frame_pose(f"wheel_{side}_link", np.zeros((1, 2)))[0][0] for side in ("left", "right"))
    assert left - right == pytest.approx([0.0, drive.separation, 0.0])
    assert left[2] == pytest.approx(drive.wheel_radius)
    masses = {link.name: link.inertial.mass for link in model.links if link.inertial}
    assert masses == {"base_link": 2.4, "wheel_left_link": 0.01, "wheel_right_link": 0.01}
    assert model.frame_pose(lidar.frame, np.zeros((1, 2)))[0][0] == pytest.approx([0.0, 0.0, 0.12])
    assert np.degrees(np.arctan2(lidar.directions[:, 1], lidar.directions[:, 0])) % 360 == pytest.approx(
        [180, 225, 270, 315, 0, 45, 90, 135], abs=1e-9
    )


def test_it_drives_straight_ahead_as_fast_as_commanded(kobuki: Driven) -> None:
    kobuki.drive(1.0, 0.0, 2.0)
    start = kobuki.pos
    kobuki.drive(1.0, 0.0, 2.0)
    linear, angular = kobuki.twist
    assert linear[:2] == pytest.approx([0.7, 0.0], abs=0.014)
    assert angular == pytest.approx(np.zeros(3), abs=0.01)
    assert kobuki.pos - start == pytest.approx([1.4, 0.0, 0.0], abs=0.03)


def test_it_turns_on_the_spot(kobuki: Driven) -> None:
    kobuki.drive(0.0, -1.0, 4.0)
    assert kobuki.twist[1] == pytest.approx([0.0, 0.0, -1.9], abs=0.04)
    assert kobuki.pos == pytest.approx(np.zeros(3), abs=0.005)


def test_it_follows_a_curve(kobuki: Driven) -> None:
    kobuki.drive(0.7, 0.5, 4.0)
    linear, angular = kobuki.twist
    assert np.hypot(*linear[:2]) == pytest.approx(0.49, rel=0.02)
    assert angular[2] == pytest.approx(0.95, rel=0.02)


def test_it_stops_and_stays(kobuki: Driven) -> None:
    kobuki.drive(1.0, 0.5, 2.0)
    kobuki.drive(0.0, 0.0, 2.0)
    assert np.abs(kobuki.twist[0]).max() < 0.005
    before = kobuki.pos
    kobuki.drive(0.0, 0.0, 2.0)
    assert kobuki.pos == pytest.approx(before, abs=0.002)


def test_it_takes_its_time_to_get_up_to_speed(kobuki: Driven) -> None:
    kobuki.drive(1.0, 0.0, 0.4)
    assert kobuki.twist[0][0] == pytest.approx(0.4, abs=0.04)  # 1 m/s²


@pytest.mark.parametrize("heading", [1.0, -1.0], ids=["ahead", "backward"])
def test_what_it_bumps_into_is_told_from_the_floor(simulator: str, heading: float) -> None:
    wall = Body(geometry=Box((0.1, 4.0, 1.0)), pose=Pose((heading, 0.0, 0.5)))
    contacts = {"bump": Contact(first="robot/base_link"), "floor": Contact(first="robot", second="floor")}
    kobuki = Driven(simulator, 0.02, Scene(bodies={"wall": wall}, contacts=contacts))
    kobuki.drive(heading, 0.0, 1.0)
    assert kobuki.sim.contact("floor")[0]
    assert not kobuki.sim.contact("bump")[0]
    kobuki.drive(heading, 0.0, 1.6)
    assert kobuki.sim.contact("bump")[0]
    kobuki.sim.close()


def test_a_link_without_friction_glides(simulator: str) -> None:
    slides = {}
    for name, friction in (("glides", 0.0), ("rubs", 1.0)):
        robot = replace(KOBUKI, friction=dict.fromkeys(TOUCHING, friction))
        placement = Placement(robot=robot, model=load_model(robot.model), command_mode=CommandMode.VELOCITY)
        sim: Any = plugins.get_record("simulator", simulator).load()(
            {"robot": placement}, Scene(), num_envs=1, physics_timestep=0.01
        )
        sim.reset()
        sim.step(20)  # settle
        sim.robots["robot"].write_base_twist(np.array([[0.0, 0.5, 0.0]]), np.zeros((1, 3)))
        sim.step(50)
        slides[name] = sim.robots["robot"].base_twist[0][0, 1]
        sim.close()
    assert slides["glides"] == pytest.approx(0.5, abs=0.02)
    assert abs(slides["rubs"]) < 0.05
