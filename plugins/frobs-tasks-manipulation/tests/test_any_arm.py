"""Manipulation with arms that are passed as model files: found grippers, fitted tasks, and experts that succeed."""

from __future__ import annotations

import logging
import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from expert_runs import made, success_rate
from gripper_arms import arm, robot, two_fingers

from frobs_core.description import Robot
from frobs_core.models import find_reader
from frobs_core.util.errors import ConfigurationError, UnsuitableRobotError
from frobs_tasks_manipulation.fit import kinematics

ID = "frobs_core:frobs/{}-v0"
PICK = ID.format("PickAndPlace")


@pytest.fixture(scope="module", params=[6, 4], ids=["six axes", "four axes"])
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model file of an arm with a gripper."""
    path = tmp_path_factory.mktemp("arm") / f"arm{request.param}.urdf"
    path.write_text(robot(arm(request.param), two_fingers()))
    return path


def test_an_arm_picks_and_places_from_its_file_alone(file: Path) -> None:
    with made(PICK, num_envs=30, robot=str(file)) as env:
        task: Any = env.task
        assert success_rate(env) >= 0.95
        assert task.size == pytest.approx(0.04)
        assert task.area >= 0.09
        assert task.tolerance <= max(0.02, task.area / 5)
        assert task.grasp.radial == (file.stem == "arm4")
        assert env.control.robot("robot").robot.groups["gripper"] == ("left",)


def test_the_order_of_the_joints_in_the_file_means_nothing(tmp_path: Path) -> None:
    parts = re.findall(r"<(?:link|joint)\b.*?</(?:link|joint)>", robot(arm(), two_fingers()))
    found = []
    for name, order in (("forth", parts), ("back", parts[::-1])):
        path = tmp_path / f"{name}.urdf"
        path.write_text(robot(*order))
        with made(PICK, num_envs=1, robot=str(path)) as env:
            task: Any = env.task
            found.append([*task.center, task.area, task.highest, task.size])  # the tool may be turned by half a turn
    np.testing.assert_allclose(found[0], found[1], atol=1e-6)


def test_the_area_is_not_in_a_base_behind_a_link_without_shapes(tmp_path: Path) -> None:
    text = robot(arm(6), two_fingers()).replace('size="0.1 0.1 0.1"', 'size="0.5 0.5 0.1"', 1)
    mount = '<link name="world"/><joint name="w" type="fixed"><parent link="world"/><child link="base"/></joint>'
    (tmp_path / "wide.urdf").write_text(text.replace("</robot>", f"{mount}</robot>"))
    described = find_reader("wide.urdf").with_gripper(Robot(model=str(tmp_path / "wide.urdf")))
    assert kinematics(described, described.read_model()).base_radius() == pytest.approx(0.25)


def test_drives_that_cannot_hold_the_arm_are_refused_with_the_effort(tmp_path: Path) -> None:
    path = tmp_path / "weak.urdf"
    text = robot(arm(), two_fingers())
    path.write_text(text.replace('effort="60"', 'effort="1"'))
    with pytest.raises(UnsuitableRobotError, match=r"joint 'j2' must hold (\S+), and its limit is 1;") as caught:
        made(PICK, num_envs=1, robot=str(path)).__enter__()
    needed = max(map(float, re.findall(r"must hold ([\d.]+)", str(caught.value))))
    path.write_text(text.replace('effort="60"', f'effort="{3 * needed:.1f}"'))
    with made(PICK, num_envs=10, robot=str(path)) as env:
        assert success_rate(env) >= 0.9


def test_what_was_fitted_is_printed(file: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "frobs")
    with made(PICK, num_envs=1, robot=str(file)) as env:
        (line,) = [message for message in caplog.messages if "was fitted" in message]
        task: Any = env.task
        assert line.startswith(f"the task was fitted to robot '{file.stem}': center=[")
        assert f"area={round(task.area, 4)}, " in line
        assert "size=0.04, " in line


def test_what_the_user_sets_takes_precedence(file: Path) -> None:
    controller_kwargs = {"max_delta": 0.01}
    with made(PICK, num_envs=1, robot=str(file), area=0.1, mass=0.2, controller_kwargs=controller_kwargs) as env:
        task: Any = env.task
        assert (task.area, task.mass) == (0.1, 0.2)
        controller: Any = env.control.controllers["robot/arm"]
        assert controller.max_delta == 0.01
        assert controller.axes == ("x", "y", "z")


@pytest.mark.needs("pybullet")
@pytest.mark.parametrize(
    "controller", ["joint_position", {"arm": "joint_delta_position"}, {"arm": "tcp_delta_pose"}], ids=str
)
def test_fitted_keywords_apply_to_the_controller_that_they_were_fitted_for(file: Path, controller: Any) -> None:
    with made(PICK, num_envs=1, robot=str(file), controller=controller) as env:
        fitted = getattr(env.control.controllers["robot/arm"], "target_box", None)
        assert (fitted is not None) == ("tcp_delta_pose" in str(controller))
        if fitted is not None:
            assert np.isfinite(fitted).all()


def test_another_simulator_gets_no_keywords_of_mujoco(file: Path) -> None:
    with made(PICK, num_envs=1, robot=str(file), simulator="pybullet") as env:
        env.reset(seed=0)
        env.step(env.action_space.sample())


def test_a_task_that_is_not_fitted_says_what_the_arm_cannot_reach(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(robot(arm(), two_fingers()))
    with pytest.raises(UnsuitableRobotError, match="cannot reach"):
        gym.make(PICK, robot=str(path), center=(2.0, 0.0))


def test_a_tool_center_point_that_is_not_between_the_fingers_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(robot(arm(4), two_fingers()))
    with pytest.raises(UnsuitableRobotError, match=r"'palm' between its fingers, .* or omit tcp"):
        gym.make(PICK, robot=str(path), tcp="palm")


def test_a_robot_without_a_gripper_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(robot(arm()))
    with pytest.raises(UnsuitableRobotError, match="'arm' has no gripper that FRobs recognizes"):
        gym.make(PICK, robot=str(path))
    with pytest.raises(UnsuitableRobotError, match="'irb120' has no gripper; attach one, as in robot='ARM"):
        gym.make(PICK, robot="irb120")


def test_a_grasp_is_checked() -> None:
    with pytest.raises(ConfigurationError, match=r"grasp has no parameter 'yaws'\. Did you mean 'yaw'"):
        gym.make("frobs_core:frobs/PandaPickAndPlace-v0", grasp={"yaws": 1.0})
    with pytest.raises(ConfigurationError, match=r"grasp.clearance is -1; it must be above 0 \[m\]"):
        gym.make("frobs_core:frobs/PandaPickAndPlace-v0", grasp={"clearance": -1})


def test_a_turned_grasp_turns_the_tool_and_the_objects() -> None:
    with made("frobs_core:frobs/PandaPickAndPlace-v0", num_envs=20, grasp={"yaw": np.pi / 4}) as env:
        task: Any = env.task
        assert success_rate(env) >= 0.95
        env.reset(seed=0)
        _, quat = env.control.robot("robot").frame_pose("tcp")
        assert np.abs(quat[0] @ [0.0, np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0]) == pytest.approx(1.0, abs=1e-3)
        assert np.abs(np.arctan2(task.cube.axes[:, 1], task.cube.axes[:, 0]) - np.pi / 4).max() < np.pi / 12 + 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("task", ["Push", "Lift", "Stack"])
def test_the_other_tasks_fit_too(file: Path, task: str) -> None:
    with made(ID.format(task), num_envs=20, robot=str(file)) as env:
        assert success_rate(env) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("name", ["irb120+two_finger_hand", "panda"])
def test_robots_with_a_name_fit_too(name: str) -> None:
    with made(PICK, num_envs=20, robot=name) as env:
        assert success_rate(env) >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize("name", ["panda_description/urdf/panda.urdf", "so_arm_description/urdf/so101.urdf"])
def test_public_arms_pick_and_place(name: str) -> None:
    try:
        folder = distribution("example-robot-data").locate_file("cmeel.prefix/share/example-robot-data/robots")
    except PackageNotFoundError:
        pytest.skip("needs example-robot-data")
    with made(PICK, num_envs=50, robot=str(Path(str(folder)) / name)) as env:
        assert success_rate(env) >= 0.95
