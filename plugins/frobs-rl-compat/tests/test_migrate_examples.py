"""Which tasks ``frobs migrate`` recognizes, and which numbers it reads from them."""

from __future__ import annotations

import ast
import shutil
from pathlib import Path

import pytest

from frobs_core.util.yaml import load_yaml
from frobs_rl_compat.migrate import migrate_package, read_package
from frobs_rl_compat.migrate.examples import Example, find_example
from frobs_rl_compat.migrate.python_files import read_python_files
from frobs_rl_compat.migrate.recognition import KNOWN_TASKS, factors, fingerprint, recognize
from frobs_rl_compat.migrate.robot import find_robot
from frobs_rl_compat.migrate.values import UntranslatableError
from frobs_rl_compat.migrate.world import read_walls

ORIGINALS = Path(__file__).parents[4] / "shared" / "frobs_rl" / "originals"
MAZE = "frobs_rl_resources/kobuki_maze/kobuki_maze_rl"
REACHER = "frobs_rl_resources/abb_irb140_reacher/abb_irb140_reacher"

needs_originals = pytest.mark.needs("originals")


def method(text: str) -> ast.FunctionDef:
    function = ast.parse(text).body[0]
    assert isinstance(function, ast.FunctionDef)
    return function


REWARD = "def _get_reward(self):\n    reward = 0\n    reward -= 0.5*self.angle\n    return reward\n"
SETTINGS = (
    "def __init__(self):\n    rows = np.array([[1.0, -2.0], [3.0, 4.0]])\n    super(Old, self).__init__(file='a')\n"
)
SAME = [
    (REWARD, REWARD.replace("0.5*", "2 * ")),
    (REWARD, REWARD.replace("reward = 0\n", '"""Pay."""\n    reward = 0  # none\n    rospy.logwarn(str(reward))\n')),
    (REWARD, REWARD.replace("reward = 0\n", "reward = 0\n    self.goal_marker.color.r = 1.0\n")),
    (REWARD, REWARD.replace("reward = 0\n", "reward = 0\n    if reward:\n        rospy.loginfo('paid')\n")),
    (SETTINGS, SETTINGS.replace("[3.0, 4.0]", "[3.0, 4.5], [-5, 6]")),
    (SETTINGS, SETTINGS.replace("super(Old, self)", "super()")),
    ("def f(self):\n    get_param('/a/b')", "def f(self) -> float:\n    get_param('/c')"),
    ("def f(self):\n    gazebo_set_model_state('box', pos_x=-1.0)", "def f(self):\n    gazebo_set_model_state('box', pos_x=2)"),
]  # fmt: skip
OTHER = [
    (REWARD, REWARD.replace("reward = 0\n", "reward = 1\n")),
    (REWARD, REWARD.replace("reward -= ", "reward += ")),
    (REWARD, REWARD.replace("self.angle", "self.distance")),
    (SETTINGS, SETTINGS.replace("file='a'", "file='b'")),
    (SETTINGS, SETTINGS.replace("rows", "columns")),
    ("def f(self):\n    gazebo_set_model_state('box', pos_x=1)", "def f(self):\n    gazebo_set_model_state('bot', pos_x=1)"),
    ("def f(self):\n    return 1", "def f(self):\n    return 2"),
    ("def f(self):\n    self.done = True", "def f(self):\n    self.done = False"),
]  # fmt: skip


@pytest.mark.parametrize(("first", "second"), SAME)
def test_literals_that_are_read_logs_and_formatting_change_no_fingerprint(first, second):
    assert fingerprint(method(first)) == fingerprint(method(second))


@pytest.mark.parametrize(("first", "second"), OTHER)
def test_changed_code_changes_the_fingerprint(first, second):
    assert fingerprint(method(first)) != fingerprint(method(second))


def test_a_fingerprint_does_not_depend_on_the_version_of_python():
    assert fingerprint(method(REWARD)) == "9ca18dd045c8b5e6"


def test_the_numbers_of_a_reward_are_read_in_the_order_of_its_lines():
    assert factors(method("def f(self):\n    a = x + 0.09\n    b = y - 2*z\n    return 3")) == [0.09, 2]


WALL = """<sdf version="1.7"><model name="maze"><pose>1 2 0 0 0 1.5708</pose><link name="wall">
<collision name="wall"><pose>0 0 {height} {roll} 0 0</pose><geometry>{geometry}</geometry></collision>
<pose>3 0 0 0 0 1.5708</pose></link></model></sdf>"""
BOX = "<box><size>5 0.2 2.5</size></box>"


@pytest.fixture
def walls(tmp_path):
    def read(height: float = 1.25, roll: float = 0.0, geometry: str = BOX) -> list[dict]:
        file = tmp_path / "model.sdf"
        file.write_text(WALL.format(height=height, roll=roll, geometry=geometry))
        return list(read_walls(file, 10 - 20j))

    return read


def test_the_poses_of_spawn_model_link_and_collision_are_composed(walls):
    (wall,) = walls()
    assert wall["centre"] == pytest.approx([11.0, -15.0], abs=1e-4)
    assert wall["along"] == pytest.approx(180.0, abs=1e-3)
    assert (wall["length"], wall["thickness"], wall["height"]) == (5.0, 0.2, 2.5)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"height": 2.0}, "is not on the floor"),
        ({"roll": 0.1}, "tilted"),
        ({"geometry": "<sphere><radius>1</radius></sphere>"}, "not a box"),
        ({"geometry": "<box><size>1 2</size></box>"}, "does not have 3 numbers"),
    ],
)
def test_a_world_that_no_floor_plan_describes_is_not_translated(walls, changes, reason):
    with pytest.raises(UntranslatableError, match=reason):
        walls(**changes)


@pytest.fixture
def originals(tmp_path, monkeypatch) -> Path:
    """The originals, copied as a nested workspace: its folder ``src``."""
    root = tmp_path / "catkin_ws" / "src"
    shutil.copytree(ORIGINALS, root)
    for path in root.rglob("*"):
        path.chmod(path.stat().st_mode | 0o200)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(root))
    return root


def change(file: Path, *changes: tuple[str, str]) -> None:
    text = file.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)


def example_of(folder: Path, id: str | None = None) -> Example:
    package = read_package(folder, id)
    example, reason = find_example(package, find_robot(package, {})[0])
    assert example is not None, reason
    return example


def reason_of(folder: Path, id: str | None = None) -> str:
    package = read_package(folder, id)
    example, reason = find_example(package, find_robot(package, {})[0])
    assert example is None
    return reason


@needs_originals
def test_every_stored_fingerprint_is_that_of_an_original_method():
    classes = {}
    for package in (MAZE, REACHER):
        for old in read_python_files(ORIGINALS / package).classes:
            for name, function in old.methods.items():
                classes.setdefault(name, set()).add(fingerprint(function))
    known = load_yaml(KNOWN_TASKS)
    for methods in [
        *known["robots"].values(),
        *known["nodes"].values(),
        *(task["methods"] for task in known["tasks"].values()),
    ]:
        for name, stored in methods.items():
            assert set(stored) <= classes[name], name


@needs_originals
@pytest.mark.parametrize(
    ("package", "id", "name"),
    [
        (MAZE, None, "maze"),
        (MAZE, "KobukiDynamicEnv-v2", "dynamic"),
        (MAZE, "KobukiDynamicEnv-v3", "dynamic"),
        (MAZE, "KobukiEmptyEnv-v0", "empty"),
        (REACHER, None, "reach_velocity"),
    ],
)
def test_the_tasks_of_the_examples_are_recognized(package, id, name):
    found = recognize(read_package(ORIGINALS / package, id))
    assert found is not None
    assert (found.name, found.differing) == (name, [])


@needs_originals
@pytest.mark.parametrize("id", ["ABBIRB140ReacherPosEnv-v0", "ABBIRB140ReacherEnv-v0"])
def test_tasks_that_need_moveit_are_not_translated(originals, id):
    assert "MoveIt" in reason_of(originals / REACHER, id)


@needs_originals
def test_a_package_whose_numbers_were_changed_is_migrated_with_its_numbers(originals):
    package = originals / MAZE
    change(package / "config" / "maze_task.yaml", ("_dist_reward: 10.0", "_dist_reward: 7.5"), ("0.50", "0.8"))
    change(
        package / "src" / "kobuki_maze_rl" / "task_env" / "kobuki_maze.py",
        ("[-1.0,-11.5], # 4", "[-1.0,-11.0], [-0.5, -11.25], # 4"),
        ("pos_x=-5.0, pos_y=7.5", "pos_x=-4.0, pos_y=7.0"),
        ("pos_x=-2.5, pos_y=-5.0", "pos_x=-2.0, pos_y=-5.5"),
        ("high=0.02", "high=0.04"),
        ("pos_x= 3.7", "pos_x= 4.7"),
        ("[ 1.0,  1.0]", "[ 0.5,  1.0]"),
        ("-1.0, -1.0]", "-0.5, -1.0]"),
    )
    change(
        package / "worlds" / "Kobuki_maze_smallv2" / "model.sdf",
        ("<size>15 0.15 2.5</size>", "<size>14 0.2 2.5</size>"),
    )
    example = example_of(package)
    parameters, plan = example.parameters, example.floor_plan
    assert (parameters["multiplier_dist_reward"], parameters["tolerance_goal_pos"]) == (7.5, 0.8)
    assert parameters["controller_kwargs"] == {"max_linear_velocity": 0.5, "max_angular_velocity": 1.0}
    assert plan["routes"][0][3:5] == [[-1.0, -11.0], [-0.5, -11.25]]
    assert plan["start"] == {"pos": [-4.0, 7.0]}
    assert plan["boxes"][0]["pos"] == [-2.0, -5.5]
    assert plan["boxes"][0]["max_speed"] == pytest.approx(0.2)
    wall = plan["walls"]["pieces"][0]
    assert wall["centre"] == pytest.approx([5.85334, -5.57937])
    assert (wall["length"], wall["thickness"]) == (14.0, 0.2)


@needs_originals
def test_a_package_under_other_names_is_migrated(originals):
    package = originals / MAZE
    expected = example_of(package)
    for file in package.rglob("*"):
        if file.suffix in (".py", ".xml", ".xacro"):
            text = file.read_text().replace("kobuki_maze_rl", "my_maze").replace("KobukiMazeEnv", "MyMaze")
            file.write_text(text.replace("KobukiLIDAREnv", "MyRobot"))
    found = example_of(package)
    assert (found.parameters, found.floor_plan) == (expected.parameters, expected.floor_plan)


@needs_originals
def test_the_reacher_is_migrated_with_the_numbers_in_its_code_too(originals):
    package = originals / REACHER
    file = package / "src" / "abb_irb140_reacher" / "task_env" / "abb_irb140_vel_reacher.py"
    start = file.read_text().index("def _get_reward")
    text = file.read_text()
    file.write_text(text[:start] + text[start:].replace("0.09", "0.05"))
    change(package / "config" / "reacher_task.yaml", ("joint_limits_reward: 10.0", "joint_limits_reward: 3.0"))
    parameters = example_of(package).parameters
    assert (parameters["limit_margin"], parameters["joint_limits_reward"]) == (0.05, 3.0)
    assert parameters["position_goal_max"] == {"x": 0.5, "y": 0.5, "z": 1.0}
    assert parameters["pos_dynamic_params"]["z_max_freq"] == 0.01


@pytest.mark.slow
@needs_originals
def test_a_package_whose_code_was_changed_stays_a_skeleton_that_names_the_method(originals, tmp_path):
    package = originals / MAZE
    file = package / "src" / "kobuki_maze_rl" / "task_env" / "kobuki_maze.py"
    change(
        file,
        (
            "reward   -= self.mult_dist_reward*self.mag_vec_dist",
            "reward   -= self.mult_dist_reward*self.mag_vec_dist**2",
        ),
    )
    made = migrate_package(package, tmp_path / "made")
    left = dict(made.left)
    assert "KobukiMazeEnvSkeleton-v0" in left["ID KobukiMazeEnv-v0"]
    assert "frobs/KobukiMazeLegacy-v0" in left["the task"]
    assert "KobukiMazeEnv._get_reward (kobuki_maze.py" in left["the task"]
    assert "_check_if_done" not in left["the task"]
    assert (made.path / "src" / "frobs_kobuki_maze_rl" / "task.py").is_file()


@needs_originals
def test_the_node_that_moves_the_goal_must_be_the_original_one(originals):
    folder = originals / REACHER / "src" / "abb_irb140_reacher" / "task_env"
    change(folder / "pos_publisher.py", ("self.x_amplitude * np.sin", "self.x_amplitude * np.cos"))
    assert "PosPublisher.spin (pos_publisher.py" in reason_of(originals / REACHER)
    (folder / "pos_publisher.py").unlink()
    assert "PosPublisher, which is missing" in reason_of(originals / REACHER)


@needs_originals
def test_a_world_file_with_models_is_not_translated(originals):
    change(originals / REACHER / "worlds" / "no_collision.world", ("<wind/>", "<wind/><model name='table'/>"))
    assert "the world no_collision.world contains table" in reason_of(originals / REACHER)
    script = originals / REACHER / "src" / "train_model.py"
    change(script, ("'no_collision.world'", "'elsewhere.world'"))
    assert "the package does not contain the world file elsewhere.world" in reason_of(originals / REACHER)
    change(script, ("'elsewhere.world'", "sys.argv[1]"))
    assert "sys.argv[1] is not a literal" in reason_of(originals / REACHER)


@needs_originals
def test_a_class_with_another_method_is_not_translated(originals):
    file = originals / MAZE / "src" / "kobuki_maze_rl" / "robot_env" / "kobuki_lidar_env.py"
    change(file, ("    def send_vel(", "    def step(self, action):\n        return None\n\n    def send_vel("))
    assert "KobukiLIDAREnv.step (kobuki_lidar_env.py" in reason_of(originals / MAZE)


@needs_originals
@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ("low=-np.pi, high=np.pi", "low=-0.5, high=0.5", "__init__"),
        ("traj_space = spaces.Discrete(4)", "traj_space = spaces.Discrete(5)", "traj5 is unknown"),
        (
            "low=0.0, high=0.02",
            "low=0.01, high=0.02",
            "boxes_vel_space must have one component per box, and all lower bounds must be 0",
        ),
        ("/worlds/Kobuki_maze_smallv2", "/worlds/Nowhere", "Nowhere"),
    ],
)
def test_a_value_that_no_task_supports_is_named(originals, old, new, reason):
    package = originals / MAZE
    change(package / "src" / "kobuki_maze_rl" / "task_env" / "kobuki_maze.py", (old, new))
    assert reason in reason_of(package)


@needs_originals
def test_the_parameters_of_the_file_that_the_constructor_loads_go_first():
    values = {id: read_package(ORIGINALS / MAZE, id).constructed.values["self.lidar_samples"]
              for id in ("KobukiMazeEnv-v0", "KobukiDynamicEnv-v3")}  # fmt: skip
    assert values == {"KobukiMazeEnv-v0": 8, "KobukiDynamicEnv-v3": 36}
