"""The original packages of FRobs_RL, unchanged, over the bridge with MuJoCo and with a real Gazebo 11.

They lie beside the project while it is developed and in CI, in ``../shared``; nothing of them is part of it.
"""

from __future__ import annotations

import json
import re
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml

ORIGINALS = Path(__file__).parents[4] / "shared" / "frobs_rl" / "originals"
MAZE = "frobs_rl_resources/kobuki_maze/kobuki_maze_rl"
REACHER = "frobs_rl_resources/abb_irb140_reacher/abb_irb140_reacher"
WORLD = "worlds/Kobuki_maze_smallv2/model.sdf"
SHORT = {"training_steps": 60, "learning_starts": 20, "save_freq": 30, "batch_size": 16, "buffer_size": 1000}

pytestmark = [
    pytest.mark.slow,
    pytest.mark.needs("originals"),
]


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """The originals, copied as a nested workspace: its folder ``src``."""
    root = tmp_path / "catkin_ws" / "src"
    shutil.copytree(ORIGINALS, root)
    for path in root.rglob("*"):
        path.chmod(path.stat().st_mode | 0o200)
    return root


@pytest.fixture
def run_original(workspace: Path, run_in_workspace: Callable[..., Callable[..., str]]) -> Callable[..., str]:
    """Return what runs a script of one of the packages."""

    def run(package: str, script: str, backend: str, text: str | None = None) -> str:
        file = workspace / package / "src" / script
        if text is not None:
            file.write_text(text)
        return run_in_workspace(workspace, backend)(file)

    return run


def shorten(config: Path) -> None:
    """Change the numbers in a training file that say how long it takes."""
    text = config.read_text()
    for key, value in SHORT.items():
        text = re.sub(rf"\b{key}: \d+", f"{key}: {value}", text)
    text = text.replace("load_model: True", "load_model: False")  # its model is not part of the repository
    text = re.sub(r"freq: \d+(\s+unit: )\w+", r"freq: 10\1step", text)
    config.write_text(text)


@pytest.mark.parametrize(
    ("package", "script", "models"),
    [
        pytest.param(MAZE, "train.py", "models/maze/td3/trained_model_v2_3.zip", id="kobuki_maze_rl"),
        pytest.param(REACHER, "train_model.py", "models/td3/trained_model_new.zip", id="abb_irb140_reacher"),
        pytest.param(
            REACHER, "train_model_pos.py", "models/reacher_pos/td3/trained_model_new.zip", id="abb_irb140_moveit"
        ),
    ],
)
@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco", "gazebo")
def test_training_starts_steps_learns_saves_and_ends(run_original, workspace, backend, package, script, models):
    for config in (workspace / package / "config").glob("td3*.yaml"):
        shorten(config)
    run_original(package, script, backend)
    assert (workspace / package / models).is_file()


def processes_with(variable: str) -> list[str]:
    """Return the command lines of processes whose environment has a variable."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if variable in (folder / "environ").read_bytes().decode(errors="replace").split("\0"):
                found.append((folder / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue  # it has ended, or is another user's
    return found


@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco")
def test_ctrl_c_ends_a_training_script_quietly_and_leaves_no_process(workspace, start_in_workspace, tmp_path):
    config = workspace / MAZE / "config" / "td3.yaml"
    shorten(config)
    config.write_text(config.read_text().replace("training_steps: 60", "training_steps: 1000000"))
    process = start_in_workspace(workspace, "bridge:mujoco")(workspace / MAZE / "src" / "train.py")
    errors = []
    for line in process.stderr:
        errors.append(line)
        if "REWARD" in line:
            break
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    _, rest = process.communicate(timeout=60)
    assert time.monotonic() - began < 20.0
    assert process.returncode == -signal.SIGINT
    assert "Traceback" not in "".join(errors) + rest
    assert "Error" not in rest
    assert processes_with(f"HOME={tmp_path / 'home'}") == []


DRIVE = """
import json, sys, time
import numpy as np
import rospy
from frobs_rl.common import ros_gazebo
from kobuki_maze_rl.task_env import {module}

ros_gazebo.launch_Gazebo(paused=True, gui=False)
rospy.init_node("driver")
env = {module}.{name}()
env.action_space.seed(0)
{before}
env.reset()
{between}
records = []
for _ in range(200):
    observation, reward, done, info = env.step(env.action_space.sample())
    records.append((observation.tolist(), float(reward), bool(done)))
    if done:
        env.reset()
print("RESULT", json.dumps({{"records": records, "more": more}}))
env.close()
"""


def result_of(output: str) -> dict:
    return json.loads(re.search(r"^RESULT (.*)$", output, re.MULTILINE)[1])


@pytest.mark.parametrize(
    ("module", "name", "width"),
    [
        ("kobuki_empty", "KobukiEmptyEnv", None),
        ("kobuki_dynamic_v1", "KobukiDynamicEnv", None),
        ("kobuki_dynamic_v2", "KobukiDynamicEnv", None),
        ("kobuki_dynamic_v3", "KobukiDynamicEnv", None),
    ],
)
@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco", "gazebo")
def test_every_other_task_steps_for_200_actions(run_original, backend, module, name, width):
    text = DRIVE.format(module=module, name=name, before="more = {}", between="")
    records = result_of(run_original(MAZE, "drive.py", backend, text))["records"]
    assert len(records) == 200
    assert np.isfinite([reward for _, reward, _ in records]).all()


STATES = """
def pose(name):
    found = ros_gazebo.gazebo_get_model_state(name)[1]
    p, q = found.position, found.orientation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def link(name):
    from gazebo_msgs.srv import GetLinkState

    found = rospy.ServiceProxy("/gazebo/get_link_state", GetLinkState)(name, "world").link_state.pose
    p, q = found.position, found.orientation
    return [p.x, p.y, p.z, q.x, q.y, q.z, q.w]


walls = [f"maze::{{wall}}" for wall in {walls}]
more = {{"walls": [link(wall) for wall in walls], "boxes": [pose("box1"), pose("box2")]}}
yaws = []
sample = env.angle_space.sample


def spy():
    yaws.append(sample())
    return yaws[-1]


env.angle_space.sample = spy
"""
SCANS = """
more["start"], more["yaw"] = pose("kobuki_robot"), float(yaws[0][0])
more["scans"] = []
for x, y, yaw in {poses}:
    ros_gazebo.gazebo_set_model_state("kobuki_robot", pos_x=x, pos_y=y, ori_z=np.sin(yaw / 2), ori_w=np.cos(yaw / 2))
    ros_gazebo.gazebo_step_physics(3)
    time.sleep(0.2)
    more["scans"].append(env.get_lidar_ranges().tolist())
env.reset()
"""
POSES = [(-5.0, 7.5, 0.0), (-8.5, 0.0, 1.0), (-8.5, -2.0, 2.0), (-1.0, -7.0, 3.0), (-1.0, -11.5, -1.0),
         (3.0, -11.5, -2.0), (3.0, -6.0, 0.5), (3.0, 0.0, 1.5), (0.0, -3.0, -0.5), (-8.7, -5.0, 2.5)]  # fmt: skip


@pytest.fixture(scope="module")
def mazes(request: pytest.FixtureRequest) -> dict[str, dict]:
    """What the maze told of itself, by back end."""
    return {}


def wall_places(file: Path) -> Iterator[tuple[str, list[float]]]:
    """Yield each wall's name and its place in the world, [m]: the spawn's pose, then the model's, then the link's."""
    model = ElementTree.parse(file).getroot().find("model")
    x, y, z, *turn = map(float, model.findtext("pose").split())
    assert not any(turn)
    for link in model.findall("link"):
        place = list(map(float, link.findtext("pose").split()))[:3]
        yield link.get("name"), [place[0] + x + 3.7, place[1] + y - 4.3, place[2] + z]


def recomputed(observation: list[float], numbers: dict, remaining: range) -> set[float]:
    """Return the rewards that an observation may have, for each number of way points that may remain."""
    distance, angle, lidar = observation[0], abs(observation[1]), observation[7:]
    near = np.hypot(observation[2] - observation[5], observation[3] - observation[6]) <= numbers["tolerance_goal_pos"]
    rewards = set()
    for left in remaining:
        reward = numbers["step_reward"]
        if near:
            reward += numbers["reached_midway_reward"] if left else numbers["reached_goal_reward"]
        else:
            reward -= numbers["multiplier_dist_reward"] * distance
            reward -= numbers["angle_diff_reward_multiplier"] * min(angle, np.pi - angle)
            reward += numbers["not_reached_midway_reward"] * left
        rewards.add(
            reward + (numbers["collision_reward"] if min(lidar) < numbers["collision_distance_threshold"] else 0.0)
        )
    return rewards


@pytest.mark.ros_feature("packages that use FRobs_RL", "mujoco", "gazebo")
def test_the_maze_is_the_original_one(run_original, workspace, backend, mazes):
    expected = dict(wall_places(workspace / MAZE / WORLD))
    text = DRIVE.format(
        module="kobuki_maze", name="KobukiMazeEnv", before=STATES.format(walls=list(expected)), between=SCANS.format(poses=POSES)
    )  # fmt: skip
    found = result_of(run_original(MAZE, "drive.py", backend, text))
    more = found["more"]
    np.testing.assert_allclose([wall[:3] for wall in more["walls"]], list(expected.values()), atol=1e-3)
    boxes = [[-2.5 + 0.280571, -5.0 - 0.160515, 0.5], [-6.5 + 0.280571, -5.0 - 0.160515, 0.5]]
    np.testing.assert_allclose([box[:3] for box in more["boxes"]], boxes, atol=1e-3)
    x, y, _, _, _, qz, qw = more["start"]
    assert np.hypot(x + 5.0, y - 7.5) < 0.02
    turned = (2.0 * np.arctan2(qz, qw) - more["yaw"] + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(turned) < np.radians(2.0)

    numbers = yaml.safe_load((workspace / MAZE / "config" / "maze_task.yaml").read_text())["kobuki_maze"]
    for observation, reward, _ in found["records"]:
        assert min(abs(reward - each) for each in recomputed(observation, numbers, range(8))) < 1e-9

    mazes[backend] = more
    if len(mazes) == 2:
        first, second = (np.array(maze["scans"]) for maze in mazes.values())
        assert np.median(np.abs(first - second)) <= 0.02
