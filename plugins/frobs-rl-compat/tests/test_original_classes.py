"""The environments that reproduce FRobs_RL's examples, compared with the original classes and files.

The methods of the original classes run with mocks in the place of ROS, so that these tests need no ROS. Tests over a real
ROS graph are in ``test_originals.py``.
"""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Callable, Iterator
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import spec_from_loader
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from unittest.mock import MagicMock, patch
from xml.etree import ElementTree

import gymnasium
import numpy as np
import pytest
import scipy.spatial  # noqa: F401, which the originals import while modules are replaced

from frobs_core.util.yaml import load_yaml
from frobs_tasks_legacy.navigation.task import NavigateLegacy

RESOURCES = Path(__file__).parents[4] / "shared" / "frobs_rl" / "originals" / "frobs_rl_resources"
MAZE = RESOURCES / "kobuki_maze" / "kobuki_maze_rl"
REACHER = RESOURCES / "abb_irb140_reacher" / "abb_irb140_reacher"
WALLS = MAZE / "worlds" / "Kobuki_maze_smallv2" / "model.sdf"
REPLACED = ("rospy", "rostopic", "tf", "gym", "frobs_rl", "control_msgs", "gazebo_msgs", "geometry_msgs", "nav_msgs",
            "sensor_msgs", "std_msgs", "trajectory_msgs", "visualization_msgs")  # fmt: skip

pytestmark = pytest.mark.needs("originals")


class MockedRos(MetaPathFinder, Loader):
    """Provides a mock for every module in ``REPLACED``, and the parameters of a YAML file."""

    def __init__(self, parameters: Path) -> None:
        self._parameters = load_yaml(parameters)

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        return spec_from_loader(name, self, is_package=True) if name.partition(".")[0] in REPLACED else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return MagicMock(name=spec.name)

    def exec_module(self, module: ModuleType) -> None:
        if module.__spec__.name == "frobs_rl.envs":
            module.robot_BasicEnv.RobotBasicEnv = object
        if module.__spec__.name == "rospy":
            module.has_param.return_value = False
            module.get_param.side_effect = self._parameter

    def _parameter(self, name: str) -> Any:
        _, root, key = name.split("/")
        return self._parameters[root][key]


@pytest.fixture
def original(monkeypatch) -> Iterator[Callable[..., Any]]:
    """Return a function that makes an environment of an original class without calling its constructor."""

    def make(package: Path, module: str, name: str, parameters: str) -> Any:
        monkeypatch.syspath_prepend(str(package / "src"))
        monkeypatch.setattr(sys, "meta_path", [MockedRos(package / "config" / parameters), *sys.meta_path])
        cls = getattr(importlib.import_module(f"{package.name}.task_env.{module}"), name)
        # The constructor sets markers, publishers and the speed of boxes, which do not matter here.
        missing = {"__getattr__": lambda self, name: 1 if name.startswith("box") else MagicMock(name=name)}
        env = object.__new__(type(name, (cls,), missing))
        env.get_params()
        return env

    with patch.dict(sys.modules):
        for name in [name for name in sys.modules if name.partition(".")[0] in REPLACED]:
            del sys.modules[name]
        yield make


def drive(env: gymnasium.Env, judge: Callable[..., Any]) -> Iterator[tuple[list[Any], list[Any]]]:
    """Yield the rewards and ends of 200 steps, and those of the original class in the same states."""
    task, robot = env.unwrapped.task, env.unwrapped.robot
    env.reset(seed=0)
    for step in range(200):
        goal, left = task._course.target[0].copy(), int(task._course.left[0])
        place = {0: goal, 3: (-9.7, 7.5), 6: (-5.0, 7.5)}.get(step % 10)  # at the waypoint, a wall, and the start
        if place is not None:
            robot.write_base_pose(np.array([[*place, 0.0]]), np.array([[1.0, 0.0, 0.0, 0.0]]))
        _, reward, terminated, _, info = env.step(env.action_space.sample())
        (x, y, _), (w, i, j, k) = robot.base_pose[0][0], robot.base_pose[1][0]
        yaw = np.arctan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))
        lidar = task._sensors.read(task.lidar)[0] if "lidar" in task._observed else np.full(1, 30.0)
        offset = (complex(*goal) - complex(x, y)) * np.exp(-1j * yaw)
        expected = judge(
            get_robot_pos=lambda pos=(x, y): np.array(pos),
            get_lidar_ranges=lambda ranges=lidar: ranges,
            mag_vec_dist=abs(offset),
            ang_rob_goal=np.angle(offset),
            goal_pos=goal,
            current_traj=np.array([goal] * 8),
            curren_traj_len=left,
            curren_traj_counter=0,
        )
        yield [reward, terminated, float(info["is_success"])], expected
        if terminated:
            env.reset()


def reach(env: gymnasium.Env, judge: Callable[..., Any]) -> Iterator[tuple[list[Any], list[Any]]]:
    """Yield the rewards and ends of 200 steps, and those of the original class in the same states."""
    task, robot = env.unwrapped.task, env.unwrapped.robot
    for step in range(200):
        if step % 5 == 0:
            env.reset(seed=step)
        if step % 10 == 0:  # with the goal at the tool
            env.reset(options={"joint_positions": robot.joint_positions[0].copy(), "goal": task._tcp[0].copy()})
        _, reward, terminated, _, info = env.step(env.action_space.sample())
        joints = SimpleNamespace(position=robot.joint_positions[0].tolist())
        expected = judge(get_joints=lambda joints=joints: joints, goal=task.goal[0].copy(), ee_pos=task._tcp[0].copy())
        yield [reward, terminated, float(info["is_success"])], expected


@pytest.mark.parametrize(
    ("id", "package", "module", "name", "parameters", "run"),
    [
        ("KobukiMazeLegacy", MAZE, "kobuki_maze", "KobukiMazeEnv", "maze_task.yaml", drive),
        ("KobukiDynamicLegacy", MAZE, "kobuki_dynamic_v2", "KobukiDynamicEnv", "dynamic_obj_task.yaml", drive),
        ("KobukiDynamicLegacy", MAZE, "kobuki_dynamic_v3", "KobukiDynamicEnv", "dynamic_obj_task.yaml", drive),
        ("KobukiEmptyLegacy", MAZE, "kobuki_empty", "KobukiEmptyEnv", "dynamic_obj_task.yaml", drive),
        ("Irb140ReachVelocityLegacy", REACHER, "abb_irb140_vel_reacher", "ABBIRB140VelReacherEnv", "reacher_task.yaml", reach),
    ],
)  # fmt: skip
def test_a_legacy_id_pays_and_ends_as_the_original_class_over_mocked_ros(
    original, make, id, package, module, name, parameters, run
):
    judge = original(package, module, name, parameters)

    def judged(**state: Any) -> list[Any]:
        vars(judge).update(state, info={})
        reward, done = judge._get_reward(), judge._check_if_done()
        return [float(reward), bool(done), judge.info.get("is_success", 0.0)]

    # Starting anywhere, as in FRobs_RL, brings joints to the limits in its file, of which the robot's own are a part.
    kwargs = {"initial": "random", "limits": "configured"} if run is reach else {}
    env = make(f"frobs/{id}-v0", **kwargs)
    env.action_space.seed(0)
    results, expected = (list(side) for side in zip(*run(env, judged), strict=True))
    np.testing.assert_allclose([row[0] for row in results], [row[0] for row in expected], rtol=0, atol=1e-9)
    assert [row[1:] for row in results] == [row[1:] for row in expected]
    # at the goal, also with a joint at a limit
    assert {row[0] for row in expected} >= ({10.0} if run is drive else {90.0, 100.0})


def test_the_maze_has_the_original_walls_boxes_and_waypoints():
    task = NavigateLegacy(world="maze")
    bodies = task.scene().bodies
    walls = [body for name, body in bodies.items() if name.startswith("wall")]
    model = ElementTree.parse(WALLS).getroot().find("model")
    links = model.findall("link")
    spawned = np.array([3.7, -4.3])
    offset = spawned + np.array(model.findtext("pose").split()[:2], float)
    poses = np.array([link.findtext("pose").split() for link in links], float)
    sizes = [[float(size) for size in link.findtext("collision/geometry/box/size").split()] for link in links]
    np.testing.assert_allclose([wall.pose.pos[:2] for wall in walls], poses[:, :2] + offset, atol=1e-3)
    np.testing.assert_allclose([wall.geometry.size for wall in walls], sizes, atol=0.02)
    turns = [2.0 * np.arctan2(wall.pose.quat_wxyz[3], wall.pose.quat_wxyz[0]) for wall in walls]
    np.testing.assert_allclose(
        np.exp(2j * np.array(turns)), np.exp(2j * poses[:, 5]), atol=1e-4
    )  # half turns do not matter

    boxes = [body for name, body in bodies.items() if name.startswith("box")]
    assert [(box.pose.pos[:2], box.geometry.size) for box in boxes] == [
        ((-2.5, -5.0), (1.0, 1.0, 0.5)),
        ((-6.5, -5.0), (1.0, 1.0, 0.5)),
    ]
    source = (MAZE / "src" / "kobuki_maze_rl" / "task_env" / "kobuki_maze.py").read_text()
    routes = {node.targets[0].id: ast.literal_eval(node.value.args[0]) for node in ast.walk(ast.parse(source))
              if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]).startswith("traj")}  # fmt: skip
    assert len(task.plan.routes) == len(routes) == 4
    for number, route in enumerate(task.plan.routes, start=1):
        np.testing.assert_array_equal(route, routes[f"traj{number}"])
